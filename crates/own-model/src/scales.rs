//! Scales of a model at work: torque, speed, travel, inertia, from a few runs of it.

use inference::rms;

use crate::{
    model::{ModelError, OwnModel, Record, Test},
    ports::{Law, PortsInUse, Seen},
};

/// Torque of the first trial, and its growth from trial to trial.
const FIRST_TORQUE: f64 = 1e-9;
const GROWTH: f64 = 10.0;
/// Trials: up to a torque of 1e9.
const TRIALS: usize = 19;
/// Change of a signal over its size that a trial torque has to make.
const SHOWS: f64 = 1e-3;

/// Scales of a model in a test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scales {
    /// Constant torque that would change a signal by its own size; zero where none does.
    pub(crate) torque: f64,
    /// Usual speed; zero where nothing moves.
    pub(crate) speed: f64,
    /// Half of the travel; zero where nothing moves.
    pub(crate) travel: f64,
    /// Time between two samples.
    pub(crate) sample_s: f64,
    /// Inertia, or mass, behind the load port, where it can be told.
    pub(crate) inertia: Option<f64>,
}

impl Scales {
    /// The scales of a model in that test of several in which it moves fastest.
    pub(crate) fn of_most_moving(
        model: &dyn OwnModel,
        records: &[Record],
    ) -> Result<Self, ModelError> {
        let mut scales: Option<Self> = None;
        for record in records {
            let these = Self::of(model, record)?;
            let rank = |of: &Self| (of.speed, of.torque);
            if scales.as_ref().is_none_or(|known| rank(known) < rank(&these)) {
                scales = Some(these);
            }
        }
        scales.ok_or(ModelError::TooShort { given: 0, least: 1 })
    }

    /// The scales of a model in the test of a recording.
    fn of(model: &dyn OwnModel, record: &Record) -> Result<Self, ModelError> {
        let numbers: Vec<f64> = model.numbers().iter().map(|number| number.value).collect();
        let test = &record.test;
        let mut ports = PortsInUse::none(test);
        let plain = model.run(&numbers, test, &mut ports)?;
        let seen = ports.seen().clone();
        let trial = if model.ports().load { shown(model, &numbers, test, &plain)? } else { None };
        let inertia = match trial {
            Some(trial) => inertia(model, &numbers, test, (&seen, trial))?,
            None => None,
        };
        let extremes = seen
            .positions
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(*x), b.max(*x)]);
        Ok(Self {
            torque: trial.unwrap_or(0.0),
            speed: rms(&seen.speeds),
            travel: (0.5 * (extremes[1] - extremes[0])).max(0.0),
            sample_s: 1.0 / test.rate_hz,
            inertia,
        })
    }
}

/// The constant torque that would change a signal by its own size, from the least that shows.
fn shown(
    model: &dyn OwnModel,
    numbers: &[f64],
    test: &Test,
    plain: &[Vec<f64>],
) -> Result<Option<f64>, ModelError> {
    let mut torque = FIRST_TORQUE;
    for _ in 0..TRIALS {
        let mut ports = PortsInUse::with(test, vec![Law::ConstantTorque(torque)], None);
        let loaded = model.run(numbers, test, &mut ports)?;
        let change = |(a, b): (&Vec<f64>, &Vec<f64>)| {
            let less: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
            let size = rms(b);
            if size > 0.0 { rms(&less) / size } else { 0.0 }
        };
        let most = loaded.iter().zip(plain).map(change).fold(0.0, f64::max);
        if most >= SHOWS && most.is_finite() {
            return Ok(Some(torque / most));
        }
        torque *= GROWTH;
    }
    Ok(None)
}

/// Inertia by the speed that a torque in the first sample alone takes away.
fn inertia(
    model: &dyn OwnModel,
    numbers: &[f64],
    test: &Test,
    (seen, torque): (&Seen, f64),
) -> Result<Option<f64>, ModelError> {
    let mut ports = PortsInUse::with_kick(test, torque);
    model.run(numbers, test, &mut ports)?;
    let (Some(with), Some(without)) = (ports.seen().speeds.get(1), seen.speeds.get(1)) else {
        return Ok(None);
    };
    let inertia = torque / test.rate_hz / (without - with);
    Ok(Some(inertia).filter(|inertia| inertia.is_finite() && *inertia > 0.0))
}
