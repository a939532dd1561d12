//! `fdi dataset`.

use anyhow::{Context, Result, anyhow};
use fdi_core::{
    Dataset, DatasetFileError, DatasetRequest, Experiment, ReferenceDesign, check_dataset_file,
    dataset_to_bytes, ema_sim::Imperfections,
};

use crate::{
    ExitStatus, GlobalArgs, Streams,
    args::{DatasetArgs, DesignArg},
    experiment,
};

/// Runs the designs asked for and writes their file.
pub(crate) fn dataset(
    args: &DatasetArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let path = global.output.as_deref().context("`--output FILE` says where the dataset goes")?;
    let experiment = experiment::experiment(&args.test)?;
    check(args, &experiment)?;
    let jobs = global.threads();
    let mut datasets = Vec::new();
    for design in &args.design {
        let request = DatasetRequest {
            design: design.of_dataset(),
            conditions: args.conditions.get(),
            seed: global.seed,
            imperfections: Imperfections::REAL,
            jobs,
        };
        datasets.push(Dataset::generate(&experiment, &request)?);
    }
    let bytes = dataset_to_bytes(&experiment, &datasets);
    streams.product(Some(path), |out| out.write_all(&bytes))?;
    if !global.quiet {
        streams.say(format_args!("{}", sentence(args, &experiment)));
    }
    Ok(ExitStatus::Done)
}

/// Refuses what cannot be made or could not be read again, by the option that asks for it.
fn check(args: &DatasetArgs, experiment: &Experiment) -> Result<()> {
    let designs: Vec<_> = args.design.iter().copied().map(DesignArg::of_dataset).collect();
    let checked = check_dataset_file(experiment, &designs, args.conditions.get());
    checked.map_err(|error| match error {
        DatasetFileError::Twice { .. } => anyhow!("`--design`: {error}"),
        DatasetFileError::StartsAnywhere => anyhow!("`--start-angle-rad`: {error}"),
        DatasetFileError::TooLarge { .. } => anyhow!(
            "`--conditions {}`: {error}; make several files with different `--seed`",
            args.conditions
        ),
        other => other.into(),
    })
}

/// Describes the dataset that was made, in words.
fn sentence(args: &DatasetArgs, experiment: &Experiment) -> String {
    let designs = args.design.iter().copied().map(DesignArg::of_dataset);
    let names: Vec<_> = designs.map(ReferenceDesign::name).collect();
    let sought: Vec<String> =
        experiment.sought_indices().iter().map(|index| format!("k{}", index + 1)).collect();
    let scenario = &experiment.scenario;
    format!(
        "{}, {} of {} s under {} N·m, start angle {} rad: {} conditions each of {}, for {}",
        experiment.model_name,
        experiment.name,
        scenario.duration_s,
        scenario.load_n_m,
        scenario.start_angle_rad,
        args.conditions,
        names.join(", "),
        sought.join(", ")
    )
}
