//! The numbers of a machine from recordings of it in health.

use ema_sim::model_file::MachineModel;
use inference::{Whitener, rms};

use crate::{
    error::GreyboxError,
    fit::{Fitted, fit, sandwich},
    floor::{Floor, NoiseFloor, pairs},
    machine::{Machine, State},
    problem::Problem,
    record::{Record, Recordings},
    signal_chain::first_clipped,
    structure::{Structure, Target},
};

/// A number of the machine as the recordings have it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct CalibratedNumber {
    /// Key of the model file: `axis.inertia-kg-m2`.
    pub key: String,
    /// Value in the model file.
    pub nominal: f64,
    /// Value by the recordings.
    pub value: f64,
    /// Standard deviation of the value.
    pub std: f64,
    /// True where they say it: the standard deviation is below a fifth of the value and no bound
    /// was reached.
    pub determined: bool,
    /// Another number that these recordings cannot tell it from.
    pub tied_to: Option<Tie>,
}

/// A number that recordings cannot tell from another.
#[derive(Clone, Debug, PartialEq)]
pub struct Tie {
    /// Key of the model file.
    pub key: String,
    /// Correlation of the two.
    pub correlation: f64,
}

impl CalibratedNumber {
    /// 95 % interval.
    pub fn interval_95(&self) -> [f64; 2] {
        [self.value - 1.96 * self.std, self.value + 1.96 * self.std]
    }
}

/// The answer of a calibration.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Calibrated {
    /// All numbers asked for.
    pub numbers: Vec<CalibratedNumber>,
    /// Root mean square of the residual of the recordings held out: nominal and calibrated.
    pub holdout_rms: Option<[f64; 2]>,
    /// Level of the noise.
    pub noise_floor: NoiseFloor,
    /// Unit of the signal compared, `a` or `v`.
    pub drive_unit: &'static str,
    /// The model with what was determined.
    pub model: MachineModel,
}

/// Share of the value that a standard deviation may be.
const DETERMINED_SHARE: f64 = 0.2;
/// Correlation from which two numbers are not told apart.
const TIED_CORRELATION: f64 = 0.98;

/// Finds inertia, drag, dry friction and motor constant, and whatever else the model file calls
/// roughly known, from recordings of a healthy machine; least squares of the closed loop's drive
/// signal, as in `docs/models/greybox.md`.
///
/// What the recordings do not determine keeps its nominal value in
/// [`model`](Calibrated::model), and all others are found with it held there.
///
/// # Errors
///
/// [`GreyboxError`].
pub fn calibrate(
    model: &MachineModel,
    recordings: &Recordings,
    jobs: usize,
) -> Result<Calibrated, GreyboxError> {
    recordings.check()?;
    let machine = Machine::new(model).to_calibrate();
    if let Some(cut) = first_clipped(&machine, recordings)? {
        return Err((&cut).into());
    }
    let problem = |records| Problem::new(&machine, records, jobs);
    let (mut train, mut repeat) = (problem(&recordings.train), problem(&recordings.repeat));
    let pairs = pairs(recordings);
    train.leave_out_alike(&mut repeat, &pairs);
    let (torque, speed) = scales(&recordings.train, machine.constant());
    let nominal = Structure::calibration(&machine, torque, speed);

    let guess = Whitener::white(rms(&train.records[0].measured).max(1e-9));
    let first = fit(&train, nominal.clone(), &guess)?;
    let floor = match Floor::of_pairs(&train, &repeat, &pairs) {
        Some(floor) => floor,
        None => Floor::of_saturated(&first.residuals, &[])?,
    };
    let mut fitted = fit(&train, nominal.started_at(&first.values), &floor.whitener)?;
    let mut numbers = judged(&machine, &fitted, &train, &floor.whitener);
    // what is not determined stays where the data sheet has it, first what that knows best
    while let Some(place) = best_known(&machine, &fitted, &numbers) {
        let mut structure = fitted.structure.clone().started_at(&fitted.values);
        structure.free.remove(place);
        fitted = fit(&train, structure, &floor.whitener)?;
        for number in judged(&machine, &fitted, &train, &floor.whitener) {
            if let Some(known) = numbers.iter_mut().find(|known| known.key == number.key) {
                *known = number;
            }
        }
    }
    let found = fitted.structure.state(&machine, &fitted.values);
    let holdout = problem(&recordings.holdout);
    let holdout_rms = (!recordings.holdout.is_empty())
        .then(|| -> Result<[f64; 2], GreyboxError> {
            let nominal = machine.rough().iter().map(|rough| rough.value).collect();
            let states = [State { rough: nominal, ..found.clone() }, found.clone()];
            let drives = holdout.drives(&states)?;
            Ok([0, 1].map(|n: usize| rms(&holdout.residuals(&drives[n]).concat())))
        })
        .transpose()?;
    Ok(Calibrated {
        numbers,
        holdout_rms,
        noise_floor: floor.level(1.0),
        drive_unit: machine.drive_unit(),
        model: machine.with_rough(&found.rough),
    })
}

/// Place among the free numbers of the one that is not determined and that the data sheet knows
/// best, by its tolerance over its value.
fn best_known(machine: &Machine, fitted: &Fitted, numbers: &[CalibratedNumber]) -> Option<usize> {
    let tolerance = |key: &str| {
        let rough = machine.rough().iter().find(|rough| rough.key == key);
        rough.map_or(f64::INFINITY, |rough| match rough.value {
            0.0 => f64::INFINITY,
            value => rough.half_width / value.abs(),
        })
    };
    let open = |key: &str| numbers.iter().any(|number| number.key == key && !number.determined);
    let free = fitted.structure.free.iter().enumerate();
    free.filter(|(_, free)| open(&free.key))
        .min_by(|(_, a), (_, b)| tolerance(&a.key).total_cmp(&tolerance(&b.key)))
        .map(|(place, _)| place)
}

/// Typical torque and speed of recordings.
fn scales(records: &[Record], constant: f64) -> (f64, f64) {
    let drive: Vec<f64> = records.iter().flat_map(|r| r.drive.iter().copied()).collect();
    let speed: Vec<f64> = records
        .iter()
        .flat_map(|r| {
            let motion = r.position.as_ref().unwrap_or(&r.command);
            let step = (motion.len() / 1000).max(1);
            let pace = r.rate_hz / step as f64;
            motion
                .iter()
                .step_by(step)
                .zip(motion.iter().skip(step).step_by(step))
                .map(move |(a, b)| (b - a) * pace)
                .collect::<Vec<f64>>()
        })
        .collect();
    (constant * rms(&drive), rms(&speed))
}

fn judged(
    machine: &Machine,
    fitted: &Fitted,
    train: &Problem<'_>,
    whitener: &Whitener,
) -> Vec<CalibratedNumber> {
    let covariance = sandwich(fitted, train, whitener);
    let free = &fitted.structure.free;
    let scales = machine.scales_of(&fitted.structure.state(machine, &fitted.values).rough);
    let scale = |n: usize| match free[n].target {
        Target::Rough(number) => scales[number],
        _ => 1.0,
    };
    let std = |n: usize| libm::sqrt(covariance[(n, n)].max(0.0));
    (0..free.len())
        .map(|n| {
            let (value, std_n) = (fitted.values[n], std(n));
            let correlation =
                |m: usize| covariance[(n, m)] / (std_n * std(m)).max(f64::MIN_POSITIVE);
            let tied = (0..free.len())
                .filter(|m| *m != n)
                .max_by(|a, b| correlation(*a).abs().total_cmp(&correlation(*b).abs()));
            let tied_to = tied
                .filter(|m| correlation(*m).abs() > TIED_CORRELATION)
                .map(|m| Tie { key: free[m].key.clone(), correlation: correlation(m) });
            let on_bound = value <= free[n].least || value >= free[n].most;
            CalibratedNumber {
                key: free[n].key.clone(),
                nominal: machine
                    .nominal(&free[n].key)
                    .expect("a calibration frees numbers of the machine alone"),
                value: scale(n) * value,
                std: scale(n) * std_n,
                determined: std_n > 0.0
                    && std_n < DETERMINED_SHARE * value.abs()
                    && (!on_bound || value == 0.0),
                tied_to,
            }
        })
        .collect()
}
