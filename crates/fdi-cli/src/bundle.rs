//! The seam between the command line and the offline stage.

use std::{fs, path::Path};

use anyhow::{Context, Result, bail};
use fdi_core::{
    Bundle, DEFAULT_NOISE_A, EMBEDDED_BUNDLES, RootSeed, dataset_from_bytes, mode_figure_svg,
    report::BundleSummary, store,
};

use crate::args::BuildArgs;

/// Learns a bundle; gives the bytes of its file.
pub(crate) fn build(args: &BuildArgs, seed: RootSeed) -> Result<Vec<u8>> {
    let mut common = None;
    let mut datasets = Vec::new();
    for path in &args.dataset {
        let named = || path.display().to_string();
        let bytes = fs::read(path).with_context(named)?;
        let (experiment, dataset) = dataset_from_bytes(&bytes).with_context(named)?;
        let first = common.get_or_insert_with(|| experiment.clone());
        if *first != experiment {
            bail!("{}: the dataset is of another experiment than the first one", named());
        }
        datasets.push(dataset);
    }
    let experiment = common.context("no dataset given")?;
    Ok(Bundle::build(&experiment, datasets, DEFAULT_NOISE_A, seed)?.to_bytes())
}

/// What the bundle in `file`, or the embedded one, holds.
pub(crate) fn summarise(file: Option<&Path>) -> Result<BundleSummary> {
    let (bundle, sha256) = read(file)?;
    Ok(bundle.summary(sha256)?)
}

/// The drawing of the first dynamic mode of the bundle in `file`, or the embedded one.
pub(crate) fn mode_figure(file: Option<&Path>) -> Result<String> {
    let (bundle, _) = read(file)?;
    Ok(mode_figure_svg(&bundle)?)
}

/// A bundle with its SHA-256.
fn read(file: Option<&Path>) -> Result<(Bundle, String)> {
    let (bytes, named) = match file {
        Some(path) => {
            let named = path.display().to_string();
            (fs::read(path).with_context(|| named.clone())?, named)
        }
        None => (EMBEDDED_BUNDLES[0].bytes.to_vec(), "the embedded bundle".to_owned()),
    };
    let bundle = Bundle::from_bytes(&bytes).context(named)?;
    Ok((bundle, store::sha256_hex(&bytes)))
}
