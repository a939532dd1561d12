//! `fdi propose`.

use std::{fmt::Write, time::Instant};

use anyhow::Result;
use fdi_core::{
    ema_sim::{Geometry, model_file::MachineModel},
    read_machine,
    report::{Proposal, ProposedRecording, SCHEMA_VERSION, Separation},
};
use greybox::{CommandKind, Options, Proposed};

use super::explain::{effects, in_form, rounded, stage, whole_recordings};
use crate::{ExitStatus, GlobalArgs, Streams, args::ProposeArgs, progress::watched, stamp};

/// Looks for the recording that tells open causes apart, and writes its command.
#[expect(clippy::disallowed_methods, reason = "the time taken is part of the answer")]
pub(crate) fn propose(
    args: &ProposeArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let start = Instant::now();
    let model = read_machine(&args.model)?;
    let recordings = whole_recordings(&args.records, &model)?;
    let options = Options {
        seed: global.seed,
        jobs: global.threads(),
        without: effects(&args.without)?,
        ..Options::default()
    };
    let what = stage("looking for causes in", &recordings);
    let mut proposal =
        watched(streams, global.quiet, &what, || greybox::propose(&model, &recordings, &options))?;
    let paces = recordings.all().map(|record| fastest(&record.command, record.rate_hz));
    keep_pace(&mut proposal, &model, paces.fold(0.0, f64::max));
    let elapsed_s = (!global.stable).then(|| start.elapsed().as_secs_f64());
    let answer = document(&proposal, &model, global, elapsed_s);
    let text = in_form(global.output_format, &answer, human)?;
    streams.product(None, |out| out.write_all(text.as_bytes()))?;
    let Some(path) = &global.output else { return Ok(ExitStatus::Done) };
    if let Some(best) = proposal.menu.first() {
        let unit = match model.geometry() {
            Geometry::Rotary => "rad",
            Geometry::Linear => "m",
        };
        let written = command(best, &proposal, unit);
        streams.product(Some(path), |out| out.write_all(written.as_bytes()))?;
    } else {
        streams.say(format_args!("{}: not written, no recording is proposed", path.display()));
    }
    Ok(ExitStatus::Done)
}

/// Takes commands off the menu that go faster than the fastest pace recorded, where no limit of
/// speed is known.
fn keep_pace(proposal: &mut greybox::Proposal, model: &MachineModel, recorded: f64) {
    let is_limited = match (proposal.kind, model) {
        (CommandKind::Speed, _) => true,
        (CommandKind::Position, MachineModel::ServoAxis(model)) => {
            model.axis.controller.speed_limit < f64::MAX
        }
        (kind, _) => kind == CommandKind::Position,
    };
    if is_limited {
        return;
    }
    let most = PACE_MARGIN * recorded;
    proposal.menu.retain(|proposed| fastest(&proposed.command, proposal.rate_hz) <= most);
}

/// For rounding, and the same move on another grid.
const PACE_MARGIN: f64 = 1.02;

/// Fastest change over a twentieth of a second, per s: a step is no speed.
fn fastest(command: &[f64], rate_hz: f64) -> f64 {
    let lag = ((0.05 * rate_hz).round() as usize).max(1);
    let pairs = command.iter().zip(command.iter().skip(lag));
    pairs.map(|(a, b)| (b - a).abs()).fold(0.0, f64::max) * rate_hz / lag as f64
}

fn document(
    proposal: &greybox::Proposal,
    model: &MachineModel,
    global: &GlobalArgs,
    elapsed_s: Option<f64>,
) -> Proposal {
    let symbol = |id: &fdi_core::ema_sim::EffectId| id.info().symbol.to_owned();
    let recording = |proposed: &Proposed| ProposedRecording {
        description: proposed.description.clone(),
        duration_s: proposed.command.len() as f64 / proposal.rate_hz,
        separation: proposed.separation(),
        separations: proposed
            .separations
            .iter()
            .map(|(a, b, separation)| Separation {
                causes: [symbol(a), symbol(b)],
                separation: *separation,
            })
            .collect(),
    };
    Proposal {
        schema_version: SCHEMA_VERSION,
        tool: format!("fdi {}", env!("CARGO_PKG_VERSION")),
        seed: global.seed,
        stamp: global.stamp.then(stamp::now),
        model: model.name().unwrap_or("unnamed").to_owned(),
        open: proposal.open.iter().map(symbol).collect(),
        menu: proposal.menu.iter().map(recording).collect(),
        elapsed_s,
    }
}

fn human(answer: &Proposal) -> String {
    let open = answer.open.join(", ");
    let Some(best) = answer.menu.first() else {
        return match answer.open.len() {
            0 => "no effect is found: there is nothing to tell apart\n".to_owned(),
            1 => format!("{open} is found, and no other explains as much\n"),
            _ => format!("{open} are open, and no safe command tells them apart\n"),
        };
    };
    let pair = |one: &Separation| {
        let [a, b] = &one.causes;
        format!("{a} from {b} {}", rounded(one.separation))
    };
    let pairs =
        |item: &ProposedRecording| item.separations.iter().map(pair).collect::<Vec<_>>().join(", ");
    let mut text = format!(
        "To tell {open} apart, record {} for {} s: expected separation of {} (10 tells two apart in \
         half of the cases, 22 in nine of ten).\n",
        best.description,
        rounded(best.duration_s),
        pairs(best)
    );
    text.push_str("\nrecordings, the one to take first; of those alike the slower before\n");
    for item in &answer.menu {
        let _ = writeln!(text, "  {}: {}", item.description, pairs(item));
    }
    text
}

/// A command as a recording without measurements.
fn command(proposed: &Proposed, proposal: &greybox::Proposal, unit: &str) -> String {
    let name = match proposal.kind {
        CommandKind::Speed => format!("speed_command_{unit}_per_s"),
        // a motion is asked for as a position, whatever controller follows it
        CommandKind::Position | CommandKind::Motion => format!("command_{unit}"),
    };
    let load = if unit == "rad" { "load_n_m" } else { "force_n" };
    let mut text = format!("# command = \"recorded\"\n# rate-hz = {:?}\n", proposal.rate_hz);
    let _ = write!(text, "time_s,{name}");
    if proposed.load.is_some() {
        let _ = write!(text, ",{load}");
    }
    text.push('\n');
    for (n, value) in proposed.command.iter().enumerate() {
        let _ = write!(text, "{:.6},{value:.8}", n as f64 / proposal.rate_hz);
        if let Some(load) = &proposed.load {
            let _ = write!(text, ",{:.4}", load[n]);
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use fdi_core::ema_sim::model_file::parse_machine;

    use super::*;

    /// A ramp of so many rad/s.
    fn ramp(pace: f64) -> Vec<f64> {
        (0..1000).map(|n| pace * f64::from(n) / 1000.0).collect()
    }

    #[test]
    fn without_a_limit_of_speed_nothing_goes_faster_than_what_was_recorded() {
        let recorded = fastest(&ramp(2.0), 1000.0);
        assert!((recorded - 2.0).abs() < 1e-9);
        let offered = |kind| {
            let proposed = |pace| Proposed {
                description: format!("{pace}"),
                command: ramp(pace),
                load: None,
                separations: Vec::new(),
            };
            let menu = [0.6, 2.0, 6.0].map(proposed).into();
            greybox::Proposal { open: Vec::new(), menu, rate_hz: 1000.0, kind }
        };
        let left = |text: &str, kind| {
            let mut proposal = offered(kind);
            keep_pace(&mut proposal, &parse_machine(text).unwrap(), recorded);
            proposal.menu.len()
        };
        let limited = include_str!("../../../../fixtures/models/axis.toml");
        let line = "speed-limit-rad-per-s = 80.0\n";
        let free = limited.replace(line, "");
        assert_ne!(free, limited);
        assert_eq!(left(limited, CommandKind::Position), 3);
        assert_eq!(left(&free, CommandKind::Position), 2);
        assert_eq!(left(limited, CommandKind::Motion), 2);
    }
}
