//! Least standard deviations that a diagnosis of a machine within its tolerances can have.

use fdi_core::{Bundle, Experiment, in_parallel, unit_noise_covariance};
use inference::{BandedMatrix, SymmetricMatrix, dot, tapered_covariance};

use super::hidden::{Hidden, SENSORS, SESSION, UNIT};
use crate::request::EvaluationError;

/// Simulations behind the covariance of the electronics' noise.
const NOISE_RUNS: u64 = 200;
/// Samples that its taper reaches.
const TAPER_SAMPLES: usize = 60;
/// Share of a number's scatter that its slope is taken over.
const SLOPE_SHARE: f64 = 0.3;

/// Recordings that a bound is of: the one diagnosed, and those of the unit as new.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundCase {
    /// Share of the tolerances.
    pub scale: f64,
    /// Recordings of the unit as new, each of a day of its own.
    pub references: usize,
    /// Half-width of the winding's temperature over days, K; `None`: normal, as days usually are.
    pub half_width_k: Option<f64>,
    /// Standard deviation of the winding's temperature as read, K; `None`: it is not read.
    pub reading_std_k: Option<f64>,
    /// True for the bound of a diagnosis with the low-fidelity model, whose error is noise to it.
    pub with_model_error: bool,
}

impl BoundCase {
    /// One recording at a share of the tolerances.
    pub fn alone(scale: f64) -> Self {
        Self {
            scale,
            references: 0,
            half_width_k: None,
            reading_std_k: None,
            with_model_error: false,
        }
    }

    fn temperature_std_k(&self) -> f64 {
        self.half_width_k.map_or(self.scale * SESSION.temperature_k, |half| half / 3f64.sqrt())
    }

    /// Temperature of each recording beyond that of the numbers, K: references in even steps over
    /// the days, the one diagnosed one standard deviation away.
    fn temperatures_k(&self) -> Vec<f64> {
        let std_k = self.temperature_std_k();
        let count = self.references as f64;
        let even = |n: usize| 3f64.sqrt() * std_k * (2.0 * (n as f64 + 0.5) / count - 1.0);
        (0..self.references).map(even).chain([std_k]).collect()
    }
}

/// Least standard deviations of k1 to k5 and k6 that any unbiased diagnosis of a healthy machine can
/// have, given tolerances at a share of their size.
///
/// ```text
/// C = (Σ_r J_rᵀ·Σ⁻¹·J_r + diag(0, 1/s²))⁻¹
/// ```
///
/// with `J_r` the slopes of the low-fidelity signal of recording `r` in damage and numbers (those of
/// the high-fidelity one hold every switching instant, which the noise of the electronics hides),
/// `Σ` the covariance of the noise of sensors and electronics, and `s` the scatter of the numbers
/// between units, and between days. `k6` is the root mean square of its two coordinates.
///
/// # Errors
///
/// [`EvaluationError`] when the machine cannot be simulated.
///
/// # Source
///
/// Cramér and Rao's inequality with priors: Van Trees, *Detection, Estimation, and Modulation Theory*,
/// part I, 2.4.
pub fn unit_bounds(
    bundle: &Bundle,
    case: &BoundCase,
    jobs: usize,
) -> Result<[f64; 6], EvaluationError> {
    let experiment = &bundle.experiment;
    let nominal = Hidden::nominal(experiment);
    let mut whole = noise(experiment, &nominal, jobs)?;
    if let (true, Some(error)) = (case.with_model_error, bundle.unit_error_covariance()) {
        whole = whole.plus(error);
    }
    let factor =
        whole.cholesky().map_err(|error| EvaluationError::Search { reason: error.to_string() })?;
    let unknowns = unknowns(case.scale);
    let mut rows = in_parallel(&unknowns, jobs, |_, unknown| -> Result<_, EvaluationError> {
        let side = |by: f64| {
            let mut moved = nominal.clone();
            (unknown.add)(&mut moved, by);
            moved.low_fidelity_signal(experiment)
        };
        let (above, below) = (side(unknown.step)?, side(-unknown.step)?);
        let slope = above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * unknown.step));
        Ok(slope.collect::<Vec<f64>>())
    })?;
    factor.whiten_each(&mut rows);
    let gram = |i: usize, j: usize| dot(&rows[i], &rows[j]);
    let parts = parts(&unknowns, case);
    let information = SymmetricMatrix::from_fn(parts.len(), |i, j| {
        let prior = if i == j { parts[i].precision } else { 0.0 };
        let shared = |r: usize| parts[i].shares[r] * parts[j].shares[r];
        let recordings = (0..=case.references).map(shared).sum::<f64>();
        recordings * gram(parts[i].unknown, parts[j].unknown) + prior
    });
    let variance = |place: usize| -> f64 {
        let mut unit = vec![0.0; parts.len()];
        unit[place] = 1.0;
        information.solve_semidefinite(&unit)[place]
    };
    let std = |place: usize| match place {
        5 => (0.5 * (variance(5) + variance(6))).sqrt(),
        other => variance(other).sqrt(),
    };
    Ok([0, 1, 2, 3, 4, 5].map(std))
}

/// Covariance of the noise of electronics and sensors on a healthy machine's signal.
fn noise(
    experiment: &Experiment,
    nominal: &Hidden,
    jobs: usize,
) -> Result<BandedMatrix, EvaluationError> {
    let signal = |hidden: &Hidden, seed: u64| -> Result<Vec<f64>, EvaluationError> {
        let (phases, angle_rad) = hidden.phases(&experiment.scenario, seed)?;
        let views = [&phases[0][..], &phases[1][..], &phases[2][..]];
        let pole_pairs = experiment.actuator.motor.pole_pairs;
        let envelope_a = experiment.envelope.of_phases_at(views, &angle_rad, pole_pairs);
        Ok(experiment.filter.apply(&envelope_a, experiment.actuator.controller.sample_hz))
    };
    let seeds: Vec<u64> = (0..NOISE_RUNS).collect();
    let mut runs = in_parallel(&seeds, jobs, |_, &seed| signal(nominal, seed))?;
    let count = runs.len() as f64;
    let samples = runs[0].len();
    let mean: Vec<f64> =
        (0..samples).map(|n| runs.iter().map(|run| run[n]).sum::<f64>() / count).collect();
    for run in &mut runs {
        for (value, mean) in run.iter_mut().zip(&mean) {
            *value = (*value - mean) * (count / (count - 1.0)).sqrt();
        }
    }
    let electronics: BandedMatrix = tapered_covariance(&runs, TAPER_SAMPLES);
    let rate_hz = experiment.actuator.controller.sample_hz;
    let sensors = unit_noise_covariance(&experiment.filter, rate_hz, samples);
    let mut whole = electronics.plus(&sensors.scaled(SENSORS.variance_a2()));
    whole.add_to_diagonal(1e-10);
    Ok(whole)
}

/// A part of an unknown that some recordings have.
struct Part {
    unknown: usize,
    /// Share of the unknown's slope that each recording has.
    shares: Vec<f64>,
    /// Inverse variance of the prior.
    precision: f64,
}

/// Damage of the recording diagnosed, then numbers of the unit and of each day.
fn parts(unknowns: &[UnknownOfBound], case: &BoundCase) -> Vec<Part> {
    let recordings = case.references + 1;
    let only =
        |one: usize| (0..recordings).map(|r| f64::from(u8::from(r == one))).collect::<Vec<f64>>();
    let temperatures_k = case.temperatures_k();
    let precision = |std: f64| 1.0 / (std * std);
    let mut parts = Vec::new();
    for (unknown, number) in unknowns.iter().enumerate() {
        let mut add = |shares, precision: f64| parts.push(Part { unknown, shares, precision });
        match number.scatter {
            ScatterOfBound::Damage => add(only(recordings - 1), 0.0),
            ScatterOfBound::Number { unit, session } => {
                if unit > 0.0 {
                    add(vec![1.0; recordings], precision(unit));
                }
                for one in (0..recordings).filter(|_| session > 0.0) {
                    add(only(one), precision(session));
                }
            }
            ScatterOfBound::Temperature => {
                let std_k = case.temperature_std_k();
                let read = case.reading_std_k.map_or(0.0, precision);
                for one in (0..recordings).filter(|_| std_k > 0.0) {
                    add(only(one), precision(std_k) + read);
                }
            }
            ScatterOfBound::Coefficient(std) if std > 0.0 => {
                add(temperatures_k.clone(), precision(std));
            }
            ScatterOfBound::Coefficient(_) => {}
        }
    }
    parts
}

/// Change of a machine by the size of an unknown.
type Addition = Box<dyn Fn(&mut Hidden, f64) + Sync>;

/// One unknown of the bound.
struct UnknownOfBound {
    add: Addition,
    step: f64,
    scatter: ScatterOfBound,
}

/// Scatter of an unknown of the bound.
enum ScatterOfBound {
    Damage,
    Number {
        unit: f64,
        session: f64,
    },
    Temperature,
    /// Between units, of a coefficient: it shows in proportion to the temperature.
    Coefficient(f64),
}

/// Change of a machine by the size of one number.
type Change = fn(&mut Hidden, f64);

/// Scatter of the machine's numbers between units and between sessions, the step of their slopes where
/// another unknown does the same, and how they change the machine.
///
/// The controller's ticks have kinks: what is alike takes equal differences, a friction of 2·0.01 of
/// k1, a play of 99·0.001 of k2.
const MACHINE_NUMBERS: [(f64, f64, Option<f64>, Change); 9] = [
    (UNIT.torque_constant, 0.0, None, |hidden, by| {
        hidden.actuator.motor.back_emf_v_s_per_rad *= 1.0 + by;
    }),
    (UNIT.motor_inertia, 0.0, None, |hidden, by| {
        hidden.actuator.motor.inertia_kg_m2 *= 1.0 + by;
    }),
    (UNIT.surface_inertia, 0.0, None, |hidden, by| {
        hidden.actuator.transmission.surface_inertia_kg_m2 *= 1.0 + by;
    }),
    (UNIT.viscous, SESSION.viscous, None, |hidden, by| {
        hidden.actuator.motor.viscous_n_m_s_per_rad *= 1.0 + by;
    }),
    (UNIT.friction, SESSION.friction, Some(0.02), |hidden, by| {
        hidden.actuator.transmission.kinetic_friction_n_m *= 1.0 + by;
        hidden.actuator.transmission.static_friction_n_m *= 1.0 + by;
    }),
    (UNIT.static_over_kinetic, SESSION.static_over_kinetic, None, |hidden, by| {
        hidden.actuator.transmission.static_friction_n_m *= 1.0 + by;
    }),
    (UNIT.play, 0.0, Some(0.099), |hidden, by| {
        hidden.actuator.transmission.backlash_rad *= 1.0 + by;
    }),
    (UNIT.efficiency, 0.0, None, |hidden, by| {
        hidden.actuator.transmission.efficiency_ratio *= 1.0 + by;
    }),
    (LOAD_STD_N_M, 0.0, None, |hidden, by| hidden.load_n_m += by),
];

/// Scatter of the load of the chirp, 0.5 N·m: 5 % and 0.1 N·m in squares.
const LOAD_STD_N_M: f64 = 0.103_077_640_640_441_5;

/// Damage without a prior, then the numbers with their scatter.
fn unknowns(scale: f64) -> Vec<UnknownOfBound> {
    let mut all: Vec<UnknownOfBound> = (0..7)
        .map(|place| UnknownOfBound {
            add: Box::new(move |hidden: &mut Hidden, by: f64| hidden.damage.0[place] += by),
            step: if place == 1 { 0.001 } else { 0.01 },
            scatter: ScatterOfBound::Damage,
        })
        .collect();
    if scale <= 0.0 {
        return all;
    }
    let number = |unit: f64, session: f64, step: Option<f64>, add| UnknownOfBound {
        add,
        step: step.unwrap_or(SLOPE_SHARE * unit),
        scatter: ScatterOfBound::Number { unit: scale * unit, session: scale * session },
    };
    for (unit, session, step, add) in MACHINE_NUMBERS {
        all.push(number(unit, session, step, Box::new(add)));
    }
    let parts = |phase: usize| -> [(f64, f64, Addition); 3] {
        [
            (UNIT.gain, SESSION.gain, Box::new(move |hidden, by| hidden.gains[phase] += by)),
            (
                UNIT.offset_a,
                SESSION.offset_a,
                Box::new(move |hidden, by| hidden.offsets_a[phase] += by),
            ),
            (UNIT.turns, 0.0, Box::new(move |hidden, by| hidden.turns[phase] += by)),
        ]
    };
    for (unit, session, add) in (0..3).flat_map(parts) {
        all.push(number(unit, session, None, add));
    }
    for part in 0..2 {
        let add = Box::new(move |hidden: &mut Hidden, by: f64| hidden.eccentricity[part] += by);
        all.push(number(UNIT.eccentricity, 0.0, None, add));
    }
    // relative changes of what follows the temperature, as its numbers take them
    let warm: [Change; 4] = [
        |hidden, by| hidden.actuator.motor.back_emf_v_s_per_rad *= 1.0 + by,
        |hidden, by| hidden.actuator.motor.resistance_ohm *= 1.0 + by,
        |hidden, by| {
            hidden.actuator.transmission.kinetic_friction_n_m *= 1.0 + by;
            hidden.actuator.transmission.static_friction_n_m *= 1.0 + by;
        },
        |hidden, by| hidden.actuator.motor.viscous_n_m_s_per_rad *= 1.0 + by,
    ];
    for (std, add) in UNIT.coefficients.into_iter().zip(warm) {
        let scatter = ScatterOfBound::Coefficient(scale * std);
        all.push(UnknownOfBound { add: Box::new(add), step: 0.01, scatter });
    }
    all.push(UnknownOfBound {
        add: Box::new(|hidden, by| hidden.temperature_k += by),
        step: 5.0,
        scatter: ScatterOfBound::Temperature,
    });
    all
}
