//! The seam between the command line and the offline stage.

use std::{fmt::Display, fs, path::Path};

use anyhow::{Context, Result, bail};
use fdi_core::{
    Bundle, Dataset, EMBEDDED_BUNDLES, Experiment, RootSeed, dataset_from_bytes, default_noise_a,
    ema_sim::Parameter, mode_figure_svg, report::BundleSummary,
};

use crate::args::BuildArgs;

/// Learns a bundle; gives the bytes of its file.
pub(crate) fn build(args: &BuildArgs, seed: RootSeed, tell: &dyn Fn(&str)) -> Result<Vec<u8>> {
    let mut common: Option<(String, Experiment)> = None;
    let mut all = Vec::new();
    for path in &args.dataset {
        let named = path.display().to_string();
        let bytes = fs::read(path).with_context(|| named.clone())?;
        let (experiment, datasets) = dataset_from_bytes(&bytes).with_context(|| named.clone())?;
        // the start angle is known where a design has one
        let starts = datasets.iter().any(|dataset| !dataset.design.is_turned());
        match &mut common {
            None => common = Some((named, experiment)),
            Some((first_name, first)) => {
                if let Some(difference) = difference(first, &experiment) {
                    bail!("{named}: {difference} as in {first_name}");
                }
                let known = all.iter().any(|dataset: &Dataset| !dataset.design.is_turned());
                if starts && !known {
                    first.scenario.start_angle_rad = experiment.scenario.start_angle_rad;
                }
            }
        }
        all.extend(datasets);
    }
    let (_, experiment) = common.context("no dataset given")?;
    let noise_a = default_noise_a(&experiment.actuator);
    Ok(Bundle::build_told(&experiment, all, noise_a, seed, tell)?.to_bytes())
}

/// The first thing in which an experiment differs from the one expected, start angle apart.
fn difference(expected: &Experiment, found: &Experiment) -> Option<String> {
    let differ = |what: &str, is: &dyn Display, expected: &dyn Display| {
        Some(format!("{what} is {is}, expected {expected}"))
    };
    for parameter in Parameter::ALL {
        let (is, want) = (parameter.get(&found.actuator), parameter.get(&expected.actuator));
        if is != want {
            let what = format!("`{}` of the model `{}`", parameter.key(), found.model_name);
            return differ(&what, &is, &want);
        }
    }
    let shape = |experiment: &Experiment| experiment.actuator.motor.back_emf_shape;
    if shape(found) != shape(expected) {
        return Some("`motor.back-emf-shape` of the model is not the one".to_owned());
    }
    if found.model_name != expected.model_name {
        return differ("the model", &found.model_name, &expected.model_name);
    }
    if found.name != expected.name {
        return differ("the command", &found.name, &expected.name);
    }
    let numbers = |e: &Experiment| {
        [
            ("the load in N·m", e.scenario.load_n_m),
            ("the length in s", e.scenario.duration_s),
            ("the rate in Hz", e.filter.output_hz),
            ("the filter in Hz", e.filter.corner_hz),
        ]
    };
    for ((what, is), (_, want)) in numbers(found).into_iter().zip(numbers(expected)) {
        if is != want {
            return differ(what, &is, &want);
        }
    }
    if found.scenario.command != expected.scenario.command {
        return Some(format!("the command `{}` is not the one", found.name));
    }
    if found.sought != expected.sought {
        return Some("the faults that the model lists are not the ones".to_owned());
    }
    (found.envelope != expected.envelope).then(|| "the envelope is not the one".to_owned())
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
