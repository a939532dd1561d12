//! `fdi propose`.

use std::{fmt::Write, time::Instant};

use anyhow::{Result, bail};
use fdi_core::{
    ChannelName, command_channel,
    ema_sim::{Geometry, model_file::MachineModel},
    load_channel, read_machine,
    report::{Prediction, Proposal, ProposedRecording, SCHEMA_VERSION, Separation},
};
use greybox::{Options, Proposed, with_holdout};

mod faults;

use super::explain::{effects, exact, in_form, rounded, sound, stage, whole_recordings};
use crate::{ExitStatus, GlobalArgs, Streams, args::ProposeArgs, progress::watched, stamp};

/// Looks for the recording that tells open causes apart, and writes its command.
#[expect(clippy::disallowed_methods, reason = "the time taken is part of the answer")]
pub(crate) fn propose(
    args: &ProposeArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    if let Some(faults) = &args.plan.faults {
        return faults::propose(args, faults, global, streams);
    }
    let start = Instant::now();
    if args.fidelity == Some(Prediction::Learnt) {
        bail!("`--fidelity learnt`: proposals predict with `ideal`, `low` or `high`");
    }
    let model = read_machine(&args.model)?;
    let recordings = with_holdout(&whole_recordings(&args.records, &model, global, streams)?);
    let recordings = sound(recordings, &args.records, &model, global, streams)?;
    let options = Options {
        seed: global.seed,
        jobs: global.threads(),
        without: effects(&args.without)?,
        exact: exact(&args.exact, &model)?,
        observation: args.fidelity.and_then(super::explain::observation),
        ..Options::default()
    };
    let what = stage("looking for causes in", &recordings);
    let proposal =
        watched(streams, global.quiet, &what, || greybox::propose(&model, &recordings, &options))?;
    let elapsed_s = (!global.stable).then(|| start.elapsed().as_secs_f64());
    let answer = document(&proposal, &model, global, elapsed_s);
    let words = |answer: &Proposal| human(answer, options.tie_nats);
    let text = in_form(global.output_format, &answer, words)?;
    streams.product(None, |out| out.write_all(text.as_bytes()))?;
    let Some(path) = &global.output else { return Ok(ExitStatus::Done) };
    if let Some(best) = proposal.menu.first() {
        let written = command(best, &proposal, model.geometry());
        streams.product(Some(path), |out| out.write_all(written.as_bytes()))?;
    } else {
        streams.say(format_args!("{}: not written, no recording is proposed", path.display()));
    }
    Ok(ExitStatus::Done)
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
            .map(|pair| Separation {
                causes: pair.causes.each_ref().map(symbol),
                separation: pair.expected,
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

fn human(answer: &Proposal, tie_nats: f64) -> String {
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
    let [half, most] = [0.5, 0.9].map(|chance| greybox::Separation::needed_for(chance, tie_nats));
    let mut text = format!(
        "To tell {open} apart, record {} for {} s: expected separation of {} ({half:.0} tells two \
         apart in half of the cases, {most:.0} in nine of ten).\n",
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
fn command(proposed: &Proposed, proposal: &greybox::Proposal, geometry: Geometry) -> String {
    let name = command_channel(geometry, proposal.kind);
    let load = proposed.load.as_deref().map(|load| (load_channel(geometry), load));
    command_text(proposal.rate_hz, (name, &proposed.command), load)
}

/// Columns of a command, and of a load where there is one, as a recording without measurements.
fn command_text(
    rate_hz: f64,
    (name, command): (ChannelName, &[f64]),
    load: Option<(ChannelName, &[f64])>,
) -> String {
    let mut text = format!("# command = \"recorded\"\n# rate-hz = {rate_hz:?}\n");
    let _ = write!(text, "time_s,{name}");
    if let Some((name, _)) = load {
        let _ = write!(text, ",{name}");
    }
    text.push('\n');
    for (n, value) in command.iter().enumerate() {
        let _ = write!(text, "{:.6},{value:.8}", n as f64 / rate_hz);
        if let Some((_, load)) = load {
            let _ = write!(text, ",{:.4}", load[n]);
        }
        text.push('\n');
    }
    text
}
