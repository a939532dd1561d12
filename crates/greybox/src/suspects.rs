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

/// Energy, in units of the noise, by which the numbers that are compared as if they were exact change
/// all recordings at most, each a standard deviation off: all together they are not seen.
const MOST_UNSEEN: f64 = 0.1;

/// Keys of the numbers for which a model file states no tolerance: as
/// [`Options::exact`](crate::Options::exact) they leave those that it states.
pub fn numbers_without_tolerance(model: &MachineModel) -> Vec<String> {
    let stated = model.kind().rough();
    let is_stated = |place| stated.iter().any(|tolerance| tolerance.place == place);
    let numbers = model.kind().numbers().into_iter().enumerate();
    numbers.filter(|(place, _)| !is_stated(*place)).map(|(_, number)| number.key).collect()
}

/// The machine with the numbers not exact that its file states a tolerance for, and those of the
/// others that standard deviations of their usual tolerances show in the recordings. Numbers of
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
    let energy = |place: usize| -> f64 {
        let number = nominal.free.iter().zip(&columns);
        let own = number.filter(|(free, _)| free.target == Target::Rough(place));
        own.map(|(Free { prior, .. }, column)| {
            let white = whitened(&noise, column);
            prior.map_or(0.0, |prior| prior.std * prior.std * dot(&white, &white))
        })
        .sum()
    };
    let energies: Vec<f64> = (0..all.rough().len()).map(energy).collect();
    let seen = seen_of(&energies).into_iter().map(|place| all.rough()[place].key.as_str());
    let seen: Vec<&str> = seen.collect();
    Ok(all.with_rough_ones(|rough| {
        machine.nominal(&rough.key).is_some() || seen.contains(&rough.key.as_str())
    }))
}

/// Places of numbers but for those that change recordings least, as many as together change them by
/// less than [`MOST_UNSEEN`].
fn seen_of(energies: &[f64]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..energies.len()).collect();
    places.sort_by(|a, b| energies[*a].total_cmp(&energies[*b]));
    let mut unseen = 0.0;
    let is_unseen = |place: &usize| {
        unseen += energies[*place];
        unseen < MOST_UNSEEN
    };
    places.into_iter().skip_while(is_unseen).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_are_seen_together_are_seen() {
        assert_eq!(seen_of(&[0.05, 900.0, 0.0, 0.02]), [1]);
        // any two of these are unseen, but not all three
        assert_eq!(seen_of(&[0.04, 0.03, 900.0, 0.039]), [0, 2]);
        assert!(seen_of(&[]).is_empty());
    }
}
