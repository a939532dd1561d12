//! The numbers of a model file that recordings can show to be off.

use ema_sim::model_file::MachineModel;
use inference::Whitener;

use crate::{
    error::GreyboxError,
    fit::whitened,
    gram::dot,
    machine::Machine,
    problem::{Problem, quiet_noise},
    record::{Record, Recordings},
    structure::{Free, Structure, Target},
};

/// Energy, in units of the noise, by which a number a standard deviation off changes all recordings
/// together, below which they are compared as if it were exact: it is seen in none of them.
const LEAST_SEEN: f64 = 1.0;

/// Keys of the numbers for which a model file states no tolerance: as
/// [`Options::exact`](crate::Options::exact) they leave those that it states.
pub fn numbers_without_tolerance(model: &MachineModel) -> Vec<String> {
    let stated = model.kind().rough();
    let is_stated = |place| stated.iter().any(|tolerance| tolerance.place == place);
    let numbers = model.kind().numbers().into_iter().enumerate();
    numbers.filter(|(place, _)| !is_stated(*place)).map(|(_, number)| number.key).collect()
}

/// The machine with the numbers not exact that its file states a tolerance for, and those of the
/// others that a standard deviation of their usual tolerance shows in the recordings. Numbers of
/// these keys are exact.
pub(crate) fn with_suspects(
    machine: &Machine,
    recordings: &Recordings,
    exact: &[String],
    jobs: usize,
) -> Result<Machine, GreyboxError> {
    let is_load = |record: &Record| {
        record.load.as_ref().is_some_and(|load| load.iter().any(|torque| *torque != 0.0))
    };
    let all = machine.with_suspects(exact, recordings.all().any(is_load))?;
    if !all.has_suspects() {
        return Ok(all);
    }
    let problem = Problem::new(&all, recordings.all(), jobs);
    let nominal = Structure::nominal(&all);
    let values = nominal.starts();
    let drive = problem.drives(&[nominal.state(&all, &values)])?.remove(0);
    let columns = problem.sensitivities(&nominal, 0, 1.0, &values, &drive)?;
    let noise = Whitener::white(quiet_noise(&problem));
    let is_seen = |place: usize| {
        let number = nominal.free.iter().zip(&columns);
        let mut own = number.filter(|(free, _)| free.target == Target::Rough(place));
        own.any(|(Free { prior, .. }, column)| {
            let white = whitened(&noise, column);
            prior.is_some_and(|prior| prior.std * prior.std * dot(&white, &white) >= LEAST_SEEN)
        })
    };
    let seen: Vec<&str> = (0..all.rough().len())
        .filter(|&place| is_seen(place))
        .map(|place| all.rough()[place].key.as_str())
        .collect();
    Ok(all.with_rough_ones(|rough| {
        machine.nominal(&rough.key).is_some() || seen.contains(&rough.key.as_str())
    }))
}
