//! The signal chain of recordings, judged before any physics: what controller, motor and sensors
//! say of one another has to hold before an effect may be named.
//!
//! | equation | what it tells |
//! | --- | --- |
//! | controller: `u = law(command, position)` | shift, sign and gain of each channel, inputs behind the controller, a drive switched off, a controller that the model file does not describe |
//! | balance of torques: `c·u = M·a + friction + load` | which channel it is, and a constant of the motor that is far off |
//! | samples of a channel | steps, a cut signal, gaps |
//! | motions beside one another | a hold-out that repeats what was fitted, or is of another machine |
//!
//! Symbols and limits: `docs/models/signal-chain.md`.

mod balance;
mod channels;
mod corrected;
mod correction;
mod equations;
mod fault;
mod inputs;
mod judged;
mod law;
mod least_squares;
mod motions;
mod recorded;
mod view;

use ema_sim::model_file::MachineModel;

pub use fault::{SignalChain, SignalChannel, SignalCheck, SignalCode, SignalEquation, SignalFault};

use crate::{
    error::GreyboxError,
    machine::Machine,
    parallel,
    record::{Record, Recordings},
};
use recorded::Recorded;

/// Judges the signal chain of recordings of a machine, before any physics.
///
/// # Errors
///
/// [`GreyboxError`] for recordings that cannot be compared with the model at all.
pub fn check_signals(
    model: &MachineModel,
    recordings: &Recordings,
) -> Result<SignalChain, GreyboxError> {
    recordings.check()?;
    examine(&Machine::new(model), recordings, 1)
}

/// Judges recordings that were checked.
pub(crate) fn examine(
    machine: &Machine,
    recordings: &Recordings,
    jobs: usize,
) -> Result<SignalChain, GreyboxError> {
    let all: Vec<&Record> = recordings.all().collect();
    let of = |record: &&Record| Recorded::new(machine, record);
    let recorded: Vec<Recorded> =
        parallel::map(&all, jobs, of).into_iter().collect::<Result<_, _>>()?;
    let mut faults: Vec<SignalFault> =
        recorded.iter().flat_map(|one| one.faults.iter().cloned()).collect();
    let checks: Vec<SignalCheck> = recorded.into_iter().map(|one| one.check).collect();
    let held_out = recordings.train.len()..recordings.train.len() + recordings.holdout.len();
    if faults.is_empty() {
        faults.extend(equations::other_machine(&checks[..held_out.start], &checks[held_out]));
    }
    faults.extend(same_motion(recordings));
    faults.sort_by_key(|fault| fault.code);
    Ok(SignalChain { checks, faults })
}

/// Asks of a signal chain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked {
    /// Sets right what can be set right.
    pub(crate) correct: bool,
    /// Threads.
    pub(crate) jobs: usize,
}

/// Recordings with what their signal chain shows set right where that is asked for, and what it
/// shows: what was set right first, what stands after it.
pub(crate) fn sound(
    machine: &Machine,
    recordings: Recordings,
    asked: Asked,
) -> Result<(Recordings, SignalChain), GreyboxError> {
    let mut chain = examine(machine, &recordings, asked.jobs)?;
    if !asked.correct || chain.faults.is_empty() {
        return Ok((recordings, chain));
    }
    let recordings = corrected::corrected(&recordings, &mut chain.faults);
    let after = examine(machine, &recordings, asked.jobs)?;
    chain.faults.retain(|fault| fault.corrected);
    chain.faults.extend(after.faults);
    Ok((recordings, SignalChain { checks: after.checks, ..chain }))
}

/// The lack of recordings all of whose hold-outs repeat what is fitted.
fn same_motion(recordings: &Recordings) -> Option<SignalFault> {
    let twin =
        |record: &Record| recordings.train.iter().find(|fitted| motions::repeats(record, fitted));
    let first = recordings.holdout.first()?;
    let fitted = twin(first)?;
    if !recordings.holdout.iter().all(|record| twin(record).is_some()) {
        return None;
    }
    Some(SignalFault {
        code: SignalCode::SameMotion,
        equation: SignalEquation::Motions,
        record: first.name.clone(),
        channel: Some(SignalChannel::Command),
        value: 0.0,
        unit: "1",
        told: format!(
            "{} repeats the command of {}: what is held out has to be of another command (a \
             repetition is for `--repeat`)",
            first.name, fitted.name
        ),
        corrected: false,
        correction: None,
    })
}
