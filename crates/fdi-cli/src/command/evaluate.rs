//! `fdi evaluate`.

use std::{fmt::Write, num::NonZeroUsize, time::Instant};

use anyhow::{Context, Result, bail};
use experiments::{Contender, EvaluationRequest, EvaluationSetting, Protocol, evaluate};
use fdi_core::{ema_sim::Imperfections, nearest, report::Evaluation};
use fdi_report::Page;

use crate::{
    ExitStatus, GlobalArgs, OutputFormat, Streams,
    args::{EvaluateArgs, ProtocolArg, Switch},
    output::TOOL,
    progress::watched,
    report_file,
};

/// Sensor noise of the experiment that is about it, A.
const NOISY_A: f64 = 0.020;
/// Reference signals with most faults absent, in the same.
const NOISY_SPARSE: usize = 100;

/// Runs one of the paper's experiments.
#[expect(clippy::disallowed_methods, reason = "times of diagnoses are part of the result")]
pub(crate) fn evaluate_protocol(
    args: &EvaluateArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let render: fn(&Evaluation) -> Result<String> = match global.output_format {
        OutputFormat::Human => |result| Ok(describe(result)),
        OutputFormat::Json => |result| Ok(serde_json::to_string_pretty(result)? + "\n"),
        OutputFormat::Jsonl => |result| Ok(serde_json::to_string(result)? + "\n"),
        _ => bail!("no CSV form or other table: `--output-format human|json|jsonl`"),
    };
    let protocol = protocol(args.protocol);
    let is_noisy = protocol.is_noisy();
    let noise_a = args.noise_a.unwrap_or(if is_noisy { NOISY_A } else { 0.0 });
    let fastest_hz = protocol.experiment()?.actuator.controller.sample_hz;
    if !(2000.0..=fastest_hz).contains(&args.phase_rate_hz) {
        bail!("`--phase-rate-hz {}`: expected 2000 to {fastest_hz}", args.phase_rate_hz);
    }
    if !(args.largest_level > 0.0 && args.largest_level <= 1.0) {
        bail!("`--largest-level {}`: expected above 0, at most 1", args.largest_level);
    }
    let contenders = contenders(args, protocol)?;
    let start = Instant::now();
    let clock = move || start.elapsed().as_secs_f64();
    let request = EvaluationRequest {
        protocol,
        setting: EvaluationSetting {
            imperfections: Imperfections {
                controller_noise: args.controller_noise == Switch::On,
                digitisation: args.digitisation == Switch::On,
            },
            sensor_noise_a: noise_a,
            phase_rate_hz: args.phase_rate_hz,
            snapshots: args.snapshots.get(),
            sparse_snapshots: args.sparse_snapshots.unwrap_or(if is_noisy {
                NOISY_SPARSE
            } else {
                0
            }),
        },
        conditions: args.conditions.map_or(protocol.default_conditions(), NonZeroUsize::get),
        contenders: &contenders,
        healthy: args.healthy,
        largest_level: args.largest_level,
        max_evaluations: args.max_evaluations.map(NonZeroUsize::get),
        seed: global.seed,
        jobs: global.threads(),
        clock: if global.stable { None } else { Some(&clock) },
    };
    let searched: Vec<_> = contenders.iter().map(|one| one.name()).collect();
    let what = format!("evaluating {} conditions by {}", request.conditions, searched.join(", "));
    let result = watched(streams, global.quiet, &what, || evaluate(&request))?;
    report_file::write(args.report.places(), || Ok(Page::of_evaluation(&result, TOOL)))?;
    let text = render(&result)?;
    streams.product(global.output.as_deref(), |out| out.write_all(text.as_bytes()))?;
    Ok(ExitStatus::Done)
}

fn protocol(arg: ProtocolArg) -> Protocol {
    match arg {
        ProtocolArg::High => Protocol::High,
        ProtocolArg::Low => Protocol::Low,
        ProtocolArg::Metaheuristics => Protocol::Metaheuristics,
        ProtocolArg::Bench => Protocol::Bench,
        ProtocolArg::BenchNoisy => Protocol::BenchNoisy,
        ProtocolArg::Noisy => Protocol::Noisy,
    }
}

fn contenders(args: &EvaluateArgs, protocol: Protocol) -> Result<Vec<Contender>> {
    if args.methods.is_empty() {
        return Ok(protocol.default_contenders().to_vec());
    }
    args.methods
        .iter()
        .map(|name| {
            Contender::from_name(name).with_context(|| {
                let known: Vec<_> = Contender::ALL.iter().map(|c| c.name()).collect();
                match nearest(name, known.iter().copied()) {
                    Some(near) => format!("no method `{name}`; did you mean `{near}`?"),
                    None => format!("no method `{name}`; the methods are {}", known.join(", ")),
                }
            })
        })
        .collect()
}

/// A table a method.
fn describe(result: &Evaluation) -> String {
    let mut text = String::new();
    let mut line = |content: String| {
        writeln!(text, "{content}").expect("a String takes all text");
    };
    let settings = &result.settings;
    let on = |switch: bool| if switch { "on" } else { "off" };
    line(format!(
        "{}: {} conditions, seed {}; controller noise {}, digitisation {}, sensor noise {} A, \
         phases at {} Hz, {} + {} snapshots",
        result.protocol,
        result.conditions,
        result.seed,
        on(settings.controller_noise),
        on(settings.digitisation),
        settings.sensor_noise_a,
        settings.phase_rate_hz,
        settings.snapshots,
        settings.sparse_snapshots,
    ));
    for method in &result.methods {
        let time = method.wall_time_s.map_or(String::new(), |t| format!(", {t:.4} s"));
        line(format!(
            "\n{}: average {:.4} %, {} evaluations{time}",
            method.method, method.average_percent, method.evaluations_median
        ));
        for fault in &method.faults {
            let parts = [
                fault
                    .error_percent
                    .map(|q| format!("median {:.3} %, max {:.2} %", q.median, q.max)),
                fault.rmse_over_bound.map(|ratio| format!("rms/bound {ratio:.2}")),
                fault.coverage_95.map(|share| format!("coverage {:.1} %", 100.0 * share)),
                fault.false_alarms.map(|count| format!("false alarms {count}")),
            ];
            let row: Vec<String> =
                std::iter::once(fault.id.to_string()).chain(parts.into_iter().flatten()).collect();
            line(row.join("  "));
        }
    }
    text
}
