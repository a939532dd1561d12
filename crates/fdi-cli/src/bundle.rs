//! The seam between the command line and the offline stage.

use std::{fs, path::Path};

use anyhow::{Context, Result, bail};
use fdi_core::{
    Bundle, EMBEDDED_BUNDLES, JoinedDatasets, RootSeed, dataset_from_bytes, default_noise_a,
    mode_figure_svg, report::BundleSummary,
};

use crate::args::BuildArgs;

/// Learns a bundle; gives the bytes of its file.
pub(crate) fn build(args: &BuildArgs, seed: RootSeed, tell: &dyn Fn(&str, f64)) -> Result<Vec<u8>> {
    let mut joined = JoinedDatasets::default();
    let mut first_name: Option<String> = None;
    for path in &args.dataset {
        let named = path.display().to_string();
        let bytes = fs::read(path).with_context(|| named.clone())?;
        let (experiment, datasets) = dataset_from_bytes(&bytes).with_context(|| named.clone())?;
        let first_name = first_name.get_or_insert_with(|| named.clone());
        if let Err(difference) = joined.add(experiment, datasets) {
            bail!("{named}: {difference} as in {first_name}");
        }
    }
    let (experiment, all) = joined.into_parts().context("no dataset given")?;
    let noise_a = default_noise_a(&experiment.actuator);
    Ok(Bundle::build_told(&experiment, all, noise_a, seed, tell)?.to_bytes())
}

/// Summarises the bundle in `file`, or the embedded one.
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
    Ok((bundle, recordings::sha256_hex(&bytes)))
}
