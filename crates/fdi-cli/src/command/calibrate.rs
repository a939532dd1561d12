//! `fdi calibrate`.

use std::{fmt::Write, time::Instant};

use anyhow::Result;
use fdi_core::{
    ema_sim::model_file::MachineModel,
    read_machine,
    report::{CalibratedParameter, Calibration, SCHEMA_VERSION},
};
use greybox::{Calibrated, CalibratedNumber};

use super::explain::{holdout, in_form, rounded, stage, whole_recordings};
use crate::{ExitStatus, GlobalArgs, Streams, args::CalibrateArgs, progress::watched, stamp};

/// Finds the numbers of a machine from healthy recordings, and writes the model with them.
#[expect(clippy::disallowed_methods, reason = "the time taken is part of the answer")]
pub(crate) fn calibrate(
    args: &CalibrateArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let start = Instant::now();
    let model = read_machine(&args.model)?;
    let recordings = whole_recordings(&args.records, &model)?;
    let what = stage("fitting", &recordings);
    let calibrated = watched(streams, global.quiet, &what, || {
        greybox::calibrate(&model, &recordings, global.threads())
    })?;
    let elapsed_s = (!global.stable).then(|| start.elapsed().as_secs_f64());
    let answer = document(&calibrated, &model, global, elapsed_s);
    let text = in_form(global.output_format, &answer, human)?;
    streams.product(None, |out| out.write_all(text.as_bytes()))?;
    if let Some(path) = &global.output {
        let written = calibrated.model.write();
        streams.product(Some(path), |out| out.write_all(written.as_bytes()))?;
    }
    Ok(ExitStatus::Done)
}

fn document(
    calibrated: &Calibrated,
    model: &MachineModel,
    global: &GlobalArgs,
    elapsed_s: Option<f64>,
) -> Calibration {
    let parameter = |number: &CalibratedNumber| {
        let parameter = CalibratedParameter {
            nominal: number.nominal,
            value: number.value,
            std: number.std,
            interval_95: number.interval_95(),
            determined: number.determined,
            tied_to: number.tied_to.as_ref().map(|tie| tie.key.clone()),
        };
        (number.key.clone(), parameter)
    };
    let judged = |rms| holdout(rms, &calibrated.noise_floor, calibrated.drive_unit);
    Calibration {
        schema_version: SCHEMA_VERSION,
        tool: format!("fdi {}", env!("CARGO_PKG_VERSION")),
        stamp: global.stamp.then(stamp::now),
        model: model.name().unwrap_or("unnamed").to_owned(),
        parameters: calibrated.numbers.iter().map(parameter).collect(),
        holdout: calibrated.holdout_rms.map(judged),
        elapsed_s,
    }
}

fn human(answer: &Calibration) -> String {
    let mut text = format!("{:<44} {:>12} {:>12}   95 %\n", "number", "data sheet", "recordings");
    for (key, p) in &answer.parameters {
        let [from, to] = p.interval_95.map(rounded);
        let _ = write!(
            text,
            "{key:<44} {:>12} {:>12}   {from} to {to}",
            rounded(p.nominal),
            rounded(p.value)
        );
        if !p.determined {
            let tied = p.tied_to.as_ref().map_or_else(String::new, |key| format!(" from {key}"));
            let _ = write!(text, "   not determined{tied}: the data sheet's is kept");
        }
        text.push('\n');
    }
    if let Some(holdout) = &answer.holdout {
        let unit = holdout.unit.to_uppercase();
        let _ = writeln!(
            text,
            "on recordings not fitted the residual goes from {} to {} {unit} (noise {} {unit})",
            rounded(holdout.rms_before),
            rounded(holdout.rms_after),
            rounded(holdout.noise_floor)
        );
    }
    text
}
