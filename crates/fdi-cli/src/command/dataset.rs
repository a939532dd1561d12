//! `fdi dataset`.

use anyhow::{Context, Result, bail};
use fdi_core::{
    Dataset, DatasetRequest, Experiment, ReferenceDesign, dataset_to_bytes, ema_sim::Imperfections,
    store,
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

/// Refuses what cannot be made or could not be read again.
fn check(args: &DatasetArgs, experiment: &Experiment) -> Result<()> {
    for (index, design) in args.design.iter().enumerate() {
        if args.design[..index].contains(design) {
            bail!("`--design`: `{}` is given twice", design.of_dataset().name());
        }
    }
    let everywhere = args.design.iter().all(|design| design.of_dataset().is_turned());
    if everywhere && args.test.start_angle_rad != 0.0 {
        bail!("`--start-angle-rad`: the designs asked for start anywhere");
    }
    let signals = args.design.len() * args.conditions.get();
    let bytes = signals.saturating_mul(experiment.samples()).saturating_mul(BYTES_PER_SAMPLE);
    if bytes > store::DECODE_LIMIT_BYTES {
        bail!(
            "`--conditions {}`: {signals} signals of {} samples make a file of {bytes} bytes, at \
             most {} can be read; make several files with different `--seed`",
            args.conditions,
            experiment.samples(),
            store::DECODE_LIMIT_BYTES
        );
    }
    Ok(())
}

/// A sample in full and rounded to 16 bits.
const BYTES_PER_SAMPLE: usize = 10;

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
