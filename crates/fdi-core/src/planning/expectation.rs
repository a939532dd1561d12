//! Standard deviations that a test is expected to leave of each fault.
//!
//! The evidence of a recording that has not been taken is that of the signal which the model expects;
//! with the evidence of references alike, the tolerances and a thermometer it goes through the inference
//! that later answers the recording.

use ema_sim::{FAULT_COUNT, model_file::Model};
use nalgebra::DMatrix;

use crate::{
    offline::bundle::default_noise_a,
    report::SharedWith,
    seed::RootSeed,
    simulation::experiment::Experiment,
    statistics::noise_covariance::unit_noise_covariance,
    unit::{
        error::{UnitError, drawn_spread},
        evidence::{Evidence, InCommon, TemperatureReading},
        joint::{DamageFit, Joint, OfTest, OfUnit, Wear},
        layout::Component,
        quantities::Quantities,
        search::{Observed, expected_evidence},
        voltage::{SHOWN, VoltageError, VoltageReading},
    },
};

use super::request::PlanError;

/// Spreads of a quantity to which it is known where all that a current shows is known.
const KNOWN_SPREADS: f64 = 1e-3;
/// Spreads to which it is known where nothing was recorded: the information keeps a factor.
const UNKNOWN_SPREADS: f64 = 1e3;

/// Spread of a number that the voltage shows, between machines.
const VOLTAGE_SPREAD: f64 = 0.05;
/// Shares of the error of what a voltage shows that recordings of one unit have in common, near those
/// of the embedded chirp and of a planned test.
const VOLTAGE_IN_COMMON: InCommon = InCommon { unit: 0.1, state: 0.35, session: 0.8 };

/// Share of a least standard deviation below which that with a number known is worth telling.
const NOTABLE_SHARE: f64 = 0.95;

/// Standard deviations of faults by their index; not a number of what is not looked for.
pub(super) type Stds = [f64; FAULT_COUNT];

/// Recordings and readings beside the one that a test is planned for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Beside {
    /// Recordings of the unit as new with the same test, each of a day of its own.
    pub(super) references: usize,
    /// Standard deviation of the winding's temperature as read, K; `None`: it is not read.
    pub(super) reading_std_k: Option<f64>,
    /// True where the motor's voltage is recorded.
    pub(super) has_voltage: bool,
}

/// Information on what a test shows, and the model's error in it.
#[derive(Clone, Debug)]
pub(super) struct Worth {
    information: DMatrix<f64>,
    error: DMatrix<f64>,
    in_common: InCommon,
    /// Information on what the motor's voltage shows.
    voltage: DMatrix<f64>,
}

impl Worth {
    /// Worth of a recording of a test.
    pub(super) fn of_test(
        experiment: &Experiment,
        quantities: &Quantities,
        root: RootSeed,
        jobs: usize,
    ) -> Result<Self, PlanError> {
        let error = UnitError::guessed(experiment, quantities, root, jobs)?;
        let noise_a = default_noise_a(&experiment.actuator);
        let rate_hz = experiment.actuator.controller.sample_hz;
        let noise = unit_noise_covariance(experiment, rate_hz).scaled(noise_a * noise_a);
        let observed = Observed {
            signal_a: &vec![0.0; experiment.samples()],
            start_angle_rad: experiment.scenario.start_angle_rad,
            shares: None,
            noise: &noise,
            temperature: None,
            start_std_s: 0.0,
            damage: &[],
            nominal_slopes: None,
        };
        let error_of_voltage = error.voltage.as_ref().and_then(VoltageError::information);
        let Evidence { information, error, in_common, .. } =
            expected_evidence(experiment, quantities, &error, &observed)?;
        let voltage = error_of_voltage.unwrap_or_else(|| DMatrix::zeros(SHOWN, SHOWN));
        Ok(Self { information, error, in_common, voltage })
    }

    /// Worth where every quantity is known to some share of its spread between machines.
    fn of_spreads(spreads: &[f64], share: f64) -> Self {
        let entry = |i: usize, j: usize| {
            let known = share * spreads[i].max(f64::MIN_POSITIVE);
            if i == j { 1.0 / (known * known) } else { 0.0 }
        };
        let size = spreads.len();
        let information = DMatrix::from_fn(size, size, entry);
        let known = share * VOLTAGE_SPREAD;
        Self {
            information,
            error: DMatrix::zeros(size, size),
            in_common: InCommon::default(),
            voltage: DMatrix::from_diagonal_element(SHOWN, SHOWN, 1.0 / (known * known)),
        }
    }

    /// Worth of knowing exactly all that a current shows.
    pub(super) fn of_everything(spreads: &[f64]) -> Self {
        Self::of_spreads(spreads, KNOWN_SPREADS)
    }

    /// Worth of no motion.
    pub(super) fn of_nothing(spreads: &[f64]) -> Self {
        Self::of_spreads(spreads, UNKNOWN_SPREADS)
    }

    /// Worth of two motions in turn: their errors have nothing in common.
    pub(super) fn and(&self, other: &Self) -> Self {
        Self {
            information: &self.information + &other.information,
            error: &self.error + &other.error,
            in_common: other.in_common,
            voltage: &self.voltage + &other.voltage,
        }
    }

    /// Reading of the motor's voltage as it is expected.
    fn reading(&self, quantities: &Quantities) -> Option<VoltageReading> {
        let origin = vec![0.0; quantities.layout().len()];
        Some(VoltageReading {
            numbers: quantities.volts_at(&origin),
            by_quantities: DMatrix::zeros(SHOWN, quantities.len()),
            covariance: self.voltage.clone().cholesky()?.inverse(),
            in_common: VOLTAGE_IN_COMMON,
        })
    }

    /// Damage that such recordings tell; `None` where they determine none.
    fn damage(&self, quantities: &Quantities, beside: &Beside) -> Option<DamageFit> {
        let origin = vec![0.0; quantities.layout().len()];
        let evidence = Evidence {
            at: quantities.shown_at(&origin),
            information: self.information.clone(),
            descent: vec![0.0; self.information.nrows()],
            error: self.error.clone(),
            in_common: self.in_common,
            embedded: None,
            temperature: beside
                .reading_std_k
                .map(|std_k| TemperatureReading { away_k: 0.0, std_k }),
            voltage: if beside.has_voltage { Some(self.reading(quantities)?) } else { None },
            unmodelled: Vec::new(),
        };
        let of_session = |session: usize| OfUnit {
            evidence: &evidence,
            test: OfTest::only(quantities),
            session,
            wear: Wear::AsNew,
            replaced: [0; Component::COUNT],
        };
        let references: Vec<OfUnit<'_>> = (0..beside.references).map(of_session).collect();
        let joint = Joint::new(&references, &[of_session(beside.references)], &origin)?;
        joint.damage()
    }

    /// Standard deviations of faults by their index, of the eccentricity the root mean square over its
    /// two coordinates; not a number of what is not looked for.
    pub(super) fn stds(&self, quantities: &Quantities, beside: &Beside) -> Option<Stds> {
        let stds = self.damage(quantities, beside)?.stds(quantities.layout());
        Some(stds.map(|std| std.unwrap_or(f64::NAN)))
    }
}

/// Spreads between machines of all that a test shows.
pub(super) fn spreads(
    experiment: &Experiment,
    quantities: &Quantities,
    root: RootSeed,
) -> Vec<f64> {
    let of_sensors = quantities.layout().numbers.iter().filter(|one| one.acts.is_of_sensor());
    let mut spreads = drawn_spread(experiment, quantities, root).1;
    spreads.extend(of_sensors.map(|number| number.scatter.together()));
    spreads
}

/// Least standard deviations that any test of a current leaves.
pub(super) struct Least {
    /// Alone, with a thermometer, with the motor's voltage.
    all: [Stds; 3],
    /// Without a thermometer, each number with a tolerance known in turn.
    known: Vec<(String, Stds)>,
}

impl Least {
    /// `None` where tolerances and references determine no damage.
    pub(super) fn of(
        experiment: &Experiment,
        model: &Model,
        beside: &[Beside; 3],
        root: RootSeed,
    ) -> Option<Self> {
        let of = |experiment: &Experiment| {
            let quantities = Quantities::new(experiment);
            let spreads = spreads(experiment, &quantities, root);
            (Worth::of_everything(&spreads), quantities)
        };
        let [alone, read, voltage] = beside;
        let mut keys: Vec<&str> = model.tolerance.iter().map(ema_sim::Tolerance::key).collect();
        keys.sort_unstable();
        keys.dedup();
        let known = |key: &str| {
            let mut known = experiment.clone();
            known.tolerance.retain(|tolerance| tolerance.key() != key);
            let (worth, quantities) = of(&known);
            Some((key.to_owned(), worth.stds(&quantities, alone)?))
        };
        let (worth, quantities) = of(experiment);
        Some(Self {
            all: [
                worth.stds(&quantities, alone)?,
                worth.stds(&quantities, read)?,
                worth.stds(&quantities, voltage)?,
            ],
            known: keys.into_iter().filter_map(known).collect(),
        })
    }

    pub(super) fn stds(&self) -> [&Stds; 3] {
        self.all.each_ref()
    }

    /// The number whose tolerance a fault is shared with: the one that would lower its standard
    /// deviation most, were it known.
    pub(super) fn shared_with(&self, fault: usize) -> Option<SharedWith> {
        let std = |one: &(String, Stds)| one.1[fault];
        let best = self.known.iter().min_by(|a, b| std(a).total_cmp(&std(b)))?;
        let is_notable = std(best) < NOTABLE_SHARE * self.all[0][fault];
        is_notable.then(|| SharedWith { key: best.0.clone(), std: std(best) })
    }
}
