//! Recordings of a machine that has one effect more.

use ema_sim::{CommandKind, Effect, model_file::MachineModel};

use crate::{
    error::GreyboxError,
    machine::{Machine, State},
    record::{Record, Recordings},
    structure::Structure,
};

/// Adds to recordings what an effect does to the machine of a model: what its simulation shows with
/// the effect, less what it shows without.
///
/// ```text
/// y' = y + S(e) − S(0),   x' = x + X(e) − X(0)
/// ```
///
/// with the drive signal `y` and the position `x` measured, and those simulated, `S` and `X`. The
/// noise, and all that the model does not know, stays as recorded. A motion that is followed
/// ([`CommandKind::Motion`]) stays the same.
///
/// # Errors
///
/// [`GreyboxError`], where the model cannot be run on a command.
pub fn with_effect(
    model: &MachineModel,
    recordings: &Recordings,
    effect: &Effect,
) -> Result<Recordings, GreyboxError> {
    let machine = Machine::new(model);
    let nominal = Structure::nominal(&machine);
    let without = nominal.state(&machine, &nominal.starts());
    let mut with = without.clone();
    with.add(effect);
    let of = |records: &[Record]| -> Result<Vec<Record>, GreyboxError> {
        let each = records.iter().enumerate();
        each.map(|(place, record)| changed(&machine, [&without, &with], record, place)).collect()
    };
    Ok(Recordings {
        train: of(&recordings.train)?,
        holdout: of(&recordings.holdout)?,
        repeat: of(&recordings.repeat)?,
    })
}

/// A recording changed by what the second state does differently from the first.
fn changed(
    machine: &Machine,
    states: [&State; 2],
    record: &Record,
    place: usize,
) -> Result<Record, GreyboxError> {
    let without = machine.simulate(states[0], record, place)?;
    let with = machine.simulate(states[1], record, place)?;
    let moved = |measured: &[f64], with: &[f64], without: &[f64]| -> Vec<f64> {
        let changes = with.iter().zip(without).map(|(a, b)| a - b);
        measured.iter().zip(changes).map(|(x, by)| x + by).collect()
    };
    let mut changed = record.clone();
    changed.drive = moved(&record.drive, &with.drive, &without.drive);
    if let Some(position) = changed.position.as_mut()
        && record.kind != CommandKind::Motion
    {
        *position = moved(position, &with.motor, &without.motor);
    }
    Ok(changed)
}
