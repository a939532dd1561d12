//! Least standard deviations that a diagnosis of a machine within its tolerances can have.

use fdi_core::{
    Bundle, Experiment,
    ema_sim::{FaultCoordinates, Parameter, ThermalNumber, UncertainNumber},
    in_parallel, unit_noise_covariance,
};
use inference::{BandedCholesky, BandedMatrix, SymmetricMatrix, dot, tapered_covariance};

use super::hidden::{Hidden, SESSION, UNIT};
use crate::{answers::SENSORS, request::EvaluationError};

/// Simulations behind the covariance of the electronics' noise.
const NOISE_RUNS: u64 = 200;
/// Samples that its taper reaches.
const TAPER_SAMPLES: usize = 60;
/// Steps to the damage and numbers that explain a signal best, and parts of a step that are tried.
const REFITS: usize = 6;
const REFIT_SHARES: [f64; 3] = [1.0, 0.4, 0.15];
/// Share of a number's scatter that its slope is taken over.
const SLOPE_SHARE: f64 = 0.3;

/// Recordings that a bound is of: those diagnosed, and those of the unit as new.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundCase {
    /// Share of the tolerances.
    pub scale: f64,
    /// Recordings of the unit as new, each of a day of its own.
    pub references: usize,
    /// Days on which the unit is recorded to be diagnosed, in one state of health.
    pub days: usize,
    /// Recordings of each of these days.
    pub each: usize,
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
            days: 1,
            each: 1,
            half_width_k: None,
            reading_std_k: None,
            with_model_error: false,
        }
    }

    fn temperature_std_k(&self) -> f64 {
        self.half_width_k.map_or(self.scale * SESSION.temperature_k, |half| half / 3f64.sqrt())
    }

    /// Day of each recording: each reference has its own, those diagnosed follow.
    fn days(&self) -> Vec<usize> {
        let later = (0..self.days).flat_map(|day| vec![self.references + day; self.each]);
        (0..self.references).chain(later).collect()
    }

    /// Temperature of each day beyond that of the numbers, K: days of references in even steps, those
    /// diagnosed one standard deviation away, in turn above and below.
    fn temperatures_k(&self) -> Vec<f64> {
        let std_k = self.temperature_std_k();
        let count = self.references as f64;
        let even = |n: usize| 3f64.sqrt() * std_k * (2.0 * (n as f64 + 0.5) / count - 1.0);
        let later = (0..self.days).map(|day| if day % 2 == 0 { std_k } else { -std_k });
        (0..self.references).map(even).chain(later).collect()
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
    let unknowns = unknowns(case.scale);
    let parts = parts(&unknowns, case, &case.days());
    let Whole { information, .. } = whole(bundle, case, &unknowns, &parts, jobs)?;
    let variance = |place: usize| variance(&information, &[(place, 1.0)]);
    let std = |place: usize| match place {
        5 => (0.5 * (variance(5) + variance(6))).sqrt(),
        other => variance(other).sqrt(),
    };
    Ok([0, 1, 2, 3, 4, 5].map(std))
}

/// Least standard deviation of a number of a unit as new, over that of its tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberBound {
    /// Key as [`fdi_core::LearntNumber`] has it.
    pub key: String,
    /// Standard deviation over that of the tolerances.
    pub share: f64,
}

/// Least standard deviations that any unbiased inference from the recordings of a unit as new can
/// have of its numbers, and of the motor's inertia over its torque constant; bounds as those of
/// [`unit_bounds`].
///
/// # Errors
///
/// [`EvaluationError`] when the machine cannot be simulated.
pub fn number_bounds(
    bundle: &Bundle,
    case: &BoundCase,
    jobs: usize,
) -> Result<Vec<NumberBound>, EvaluationError> {
    let mut unknowns = unknowns(case.scale);
    // machines as new have no damage
    unknowns.retain(|unknown| !matches!(unknown.scatter, ScatterOfBound::Damage));
    let parts = parts(&unknowns, case, &case.days()[..case.references]);
    let Whole { information, .. } = whole(bundle, case, &unknowns, &parts, jobs)?;
    let of_unit = |part: &Part| part.shares.iter().all(|share| *share == 1.0);
    let is_number = |part: &Part| {
        let scatter = &unknowns[part.unknown].scatter;
        matches!(scatter, ScatterOfBound::Coefficient(_)) || of_unit(part)
    };
    let bound = |place: usize| NumberBound {
        key: unknowns[parts[place].unknown].key.clone(),
        share: (variance(&information, &[(place, 1.0)]) * parts[place].precision).sqrt(),
    };
    let numbers = (0..parts.len()).filter(|&place| is_number(&parts[place]));
    let mut bounds: Vec<NumberBound> = numbers.map(bound).collect();
    let place = |parameter: &Parameter| {
        let is_it = |part: &Part| of_unit(part) && unknowns[part.unknown].key == parameter.key();
        parts.iter().position(is_it)
    };
    let (inertia, torque_constant) = (&Parameter::MOTOR_INERTIA, &Parameter::BACK_EMF);
    if let (Some(over), Some(under)) = (place(inertia), place(torque_constant)) {
        let prior = 1.0 / parts[over].precision + 1.0 / parts[under].precision;
        let left = variance(&information, &[(over, 1.0), (under, -1.0)]);
        let key = format!("{} / {}", inertia.key(), torque_constant.key());
        bounds.push(NumberBound { key, share: (left / prior).sqrt() });
    }
    Ok(bounds)
}

/// Evidence for changes of one recording's signal that neither damage nor the numbers of a machine
/// within its tolerances explain.
pub(super) struct Evidence {
    whole: Whole,
    parts: Vec<Part>,
    unknowns: Vec<UnknownOfBound>,
}

impl Evidence {
    /// Evidence in one recording at full tolerances.
    pub(super) fn of_one_recording(bundle: &Bundle, jobs: usize) -> Result<Self, EvaluationError> {
        let case = BoundCase::alone(1.0);
        let unknowns = unknowns(case.scale);
        let parts = parts(&unknowns, &case, &case.days());
        let whole = whole(bundle, &case, &unknowns, &parts, jobs)?;
        Ok(Self { whole, parts, unknowns })
    }

    /// Least sum of squares that damage and numbers leave of a signal of the low-fidelity model:
    ///
    /// ```text
    /// λ = min_x (y − f(x))ᵀ·Σ⁻¹·(y − f(x)) + xᵀ·P·x
    /// ```
    ///
    /// twice the logarithm of the likelihood ratio that the signal's own cause is worth beside them.
    /// The minimum is sought by steps with the slopes at the nominal machine, so that λ is no less than
    /// it; `None` where there is no such machine.
    pub(super) fn lambda(
        &self,
        experiment: &Experiment,
        nominal: &Hidden,
        signal_a: &[f64],
    ) -> Option<Lambda> {
        let white = |values: &[f64]| {
            let mut moved = nominal.clone();
            for (part, value) in self.parts.iter().zip(values) {
                (self.unknowns[part.unknown].add)(&mut moved, part.shares[0] * value);
            }
            let predicted = moved.low_fidelity_signal(experiment).ok()?;
            let mut white: Vec<f64> = signal_a.iter().zip(predicted).map(|(y, f)| y - f).collect();
            self.whole.factor.whiten(&mut white);
            let prior = self.parts.iter().zip(values).map(|(part, x)| part.precision * x * x);
            let sum = dot(&white, &white) + prior.sum::<f64>();
            sum.is_finite().then_some((sum, white))
        };
        let mut values = vec![0.0; self.parts.len()];
        let (mut least, mut residual) = white(&values)?;
        for _ in 0..REFITS {
            let descent = self.parts.iter().zip(&values).map(|(part, x)| {
                part.shares[0] * dot(&self.whole.rows[part.unknown], &residual) - part.precision * x
            });
            let step = self.whole.information.solve_semidefinite(&descent.collect::<Vec<f64>>());
            let moved = REFIT_SHARES.iter().find_map(|share| {
                let moved: Vec<f64> =
                    values.iter().zip(&step).map(|(x, step)| x + share * step).collect();
                let (sum, residual) = white(&moved)?;
                (sum < least).then_some((sum, residual, moved))
            });
            let Some((sum, white, moved)) = moved else { break };
            (least, residual, values) = (sum, white, moved);
        }
        Some(Lambda { value: least, residual })
    }

    /// Share of what is left of a signal of the low-fidelity model that a change of the high-fidelity
    /// one shows: with it squared, λ is what that machine's recordings are worth.
    pub(super) fn shown_share(&self, lambda: &Lambda, mut change_a: Vec<f64>) -> f64 {
        self.whole.factor.whiten(&mut change_a);
        dot(&lambda.residual, &change_a) / dot(&lambda.residual, &lambda.residual)
    }
}

/// Evidence for a signal's cause.
pub(super) struct Lambda {
    pub(super) value: f64,
    /// Part of the signal that damage and numbers leave, white.
    residual: Vec<f64>,
}

/// Slopes of one recording as white numbers, and what recordings and priors say of the parts.
struct Whole {
    factor: BandedCholesky,
    /// One row an unknown.
    rows: Vec<Vec<f64>>,
    information: SymmetricMatrix,
}

fn whole(
    bundle: &Bundle,
    case: &BoundCase,
    unknowns: &[UnknownOfBound],
    parts: &[Part],
    jobs: usize,
) -> Result<Whole, EvaluationError> {
    let experiment = &bundle.experiment;
    let nominal = Hidden::nominal(experiment);
    let mut whole = noise(experiment, &nominal, jobs)?;
    if let (true, Some(error)) = (case.with_model_error, bundle.unit_error_covariance()) {
        whole = whole.plus(error);
    }
    let factor =
        whole.cholesky().map_err(|error| EvaluationError::Search { reason: error.to_string() })?;
    let mut rows = in_parallel(unknowns, jobs, |_, unknown| -> Result<_, EvaluationError> {
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
    let information = SymmetricMatrix::from_fn(parts.len(), |i, j| {
        let prior = if i == j { parts[i].precision } else { 0.0 };
        let recordings = dot(&parts[i].shares, &parts[j].shares);
        recordings * gram(parts[i].unknown, parts[j].unknown) + prior
    });
    Ok(Whole { factor, rows, information })
}

/// Variance that an information leaves of a combination, given by place and weight.
fn variance(information: &SymmetricMatrix, of: &[(usize, f64)]) -> f64 {
    let mut weights = vec![0.0; information.order()];
    for &(place, weight) in of {
        weights[place] = weight;
    }
    dot(&weights, &information.solve_semidefinite(&weights))
}

/// Covariance of the noise of electronics and sensors on a healthy machine's signal.
fn noise(
    experiment: &Experiment,
    nominal: &Hidden,
    jobs: usize,
) -> Result<BandedMatrix, EvaluationError> {
    let seeds: Vec<u64> = (0..NOISE_RUNS).collect();
    let mut runs = in_parallel(&seeds, jobs, |_, &seed| nominal.signal(experiment, seed))?;
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
    let sensors = unit_noise_covariance(experiment, rate_hz);
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

/// Damage of the recordings diagnosed, then numbers of the unit and of each day.
fn parts(unknowns: &[UnknownOfBound], case: &BoundCase, day_of: &[usize]) -> Vec<Part> {
    let share = |is_there: bool| f64::from(u8::from(is_there));
    let of_day = |day: usize| day_of.iter().map(|&one| share(one == day)).collect::<Vec<f64>>();
    let days = day_of.last().map_or(0, |last| last + 1);
    let temperatures_k = case.temperatures_k();
    let precision = |std: f64| 1.0 / (std * std);
    let mut parts = Vec::new();
    for (unknown, number) in unknowns.iter().enumerate() {
        let mut add = |shares, precision: f64| parts.push(Part { unknown, shares, precision });
        match number.scatter {
            ScatterOfBound::Damage => {
                add(day_of.iter().map(|&day| share(day >= case.references)).collect(), 0.0);
            }
            ScatterOfBound::Number { unit, session } => {
                if unit > 0.0 {
                    add(vec![1.0; day_of.len()], precision(unit));
                }
                for day in (0..days).filter(|_| session > 0.0) {
                    add(of_day(day), precision(session));
                }
            }
            ScatterOfBound::Temperature => {
                let std_k = case.temperature_std_k();
                let read = case.reading_std_k.map_or(0.0, precision);
                for day in (0..days).filter(|_| std_k > 0.0) {
                    add(of_day(day), precision(std_k) + read);
                }
            }
            ScatterOfBound::Coefficient(std) if std > 0.0 => {
                add(day_of.iter().map(|&day| temperatures_k[day]).collect(), precision(std));
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
    /// Key of its tolerance, with the phase where there are three; of damage its name.
    key: String,
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

/// Keys of the machine's numbers, their scatter between units and between sessions, the step of their slopes where
/// another unknown does the same, and how they change the machine.
///
/// The controller's ticks have kinks: what is alike takes equal differences, a friction of 2·0.01 of
/// k1, a play of 99·0.001 of k2.
const MACHINE_NUMBERS: [(&str, f64, f64, Option<f64>, Change); 9] = [
    (Parameter::BACK_EMF.key(), UNIT.torque_constant, 0.0, None, |hidden, by| {
        hidden.actuator.motor.back_emf_v_s_per_rad *= 1.0 + by;
    }),
    (Parameter::MOTOR_INERTIA.key(), UNIT.motor_inertia, 0.0, None, |hidden, by| {
        hidden.actuator.motor.inertia_kg_m2 *= 1.0 + by;
    }),
    (Parameter::SURFACE_INERTIA.key(), UNIT.surface_inertia, 0.0, None, |hidden, by| {
        hidden.actuator.transmission.surface_inertia_kg_m2 *= 1.0 + by;
    }),
    (Parameter::VISCOUS.key(), UNIT.viscous, SESSION.viscous, None, |hidden, by| {
        hidden.actuator.motor.viscous_n_m_s_per_rad *= 1.0 + by;
    }),
    (
        Parameter::KINETIC_FRICTION.key(),
        UNIT.friction,
        SESSION.friction,
        Some(0.02),
        |hidden, by| {
            hidden.actuator.transmission.kinetic_friction_n_m *= 1.0 + by;
            hidden.actuator.transmission.static_friction_n_m *= 1.0 + by;
        },
    ),
    (
        UncertainNumber::StaticOverKinetic.key(),
        UNIT.static_over_kinetic,
        SESSION.static_over_kinetic,
        None,
        |hidden, by| {
            hidden.actuator.transmission.static_friction_n_m *= 1.0 + by;
        },
    ),
    (Parameter::BACKLASH.key(), UNIT.play, 0.0, Some(0.099), |hidden, by| {
        hidden.actuator.transmission.backlash_rad *= 1.0 + by;
    }),
    (Parameter::EFFICIENCY.key(), UNIT.efficiency, 0.0, None, |hidden, by| {
        hidden.actuator.transmission.efficiency_ratio *= 1.0 + by;
    }),
    (UncertainNumber::Load.key(), LOAD_STD_N_M, 0.0, None, |hidden, by| hidden.load_n_m += by),
];

/// Scatter of the load of the chirp, 0.5 N·m: 5 % and 0.1 N·m in squares.
const LOAD_STD_N_M: f64 = 0.103_077_640_640_441_5;

/// Damage without a prior, then the numbers with their scatter.
fn unknowns(scale: f64) -> Vec<UnknownOfBound> {
    let mut all: Vec<UnknownOfBound> = (0..7)
        .map(|place| UnknownOfBound {
            key: FaultCoordinates::NAMES[place].to_owned(),
            add: Box::new(move |hidden: &mut Hidden, by: f64| hidden.damage.0[place] += by),
            step: if place == 1 { 0.001 } else { 0.01 },
            scatter: ScatterOfBound::Damage,
        })
        .collect();
    if scale <= 0.0 {
        return all;
    }
    let number = |key: String, unit: f64, session: f64, step: Option<f64>, add| UnknownOfBound {
        key,
        add,
        step: step.unwrap_or(SLOPE_SHARE * unit),
        scatter: ScatterOfBound::Number { unit: scale * unit, session: scale * session },
    };
    for (key, unit, session, step, add) in MACHINE_NUMBERS {
        all.push(number(key.to_owned(), unit, session, step, Box::new(add)));
    }
    let parts = |phase: usize| -> [(UncertainNumber, f64, f64, Addition); 3] {
        use UncertainNumber::{PhaseGain, PhaseOffset, Turns};
        [
            (
                PhaseGain,
                UNIT.gain,
                SESSION.gain,
                Box::new(move |hidden, by| hidden.gains[phase] += by),
            ),
            (
                PhaseOffset,
                UNIT.offset_a,
                SESSION.offset_a,
                Box::new(move |hidden, by| hidden.offsets_a[phase] += by),
            ),
            (Turns, UNIT.turns, 0.0, Box::new(move |hidden, by| hidden.turns[phase] += by)),
        ]
    };
    for (phase, name) in ["a", "b", "c"].into_iter().enumerate() {
        for (of, unit, session, add) in parts(phase) {
            all.push(number(format!("{}.{name}", of.key()), unit, session, None, add));
        }
    }
    for (part, name) in ["cos", "sin"].into_iter().enumerate() {
        let add = Box::new(move |hidden: &mut Hidden, by: f64| hidden.eccentricity[part] += by);
        let key = format!("{}.{name}", UncertainNumber::Eccentricity.key());
        all.push(number(key, UNIT.eccentricity, 0.0, None, add));
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
    for ((std, add), of) in UNIT.coefficients.into_iter().zip(warm).zip(ThermalNumber::ALL) {
        let scatter = ScatterOfBound::Coefficient(scale * std);
        let key = format!("temperature.{}", of.key());
        all.push(UnknownOfBound { key, add: Box::new(add), step: 0.01, scatter });
    }
    all.push(UnknownOfBound {
        key: UncertainNumber::WindingTemperature.key().to_owned(),
        add: Box::new(|hidden, by| hidden.temperature_k += by),
        step: 5.0,
        scatter: ScatterOfBound::Temperature,
    });
    all
}
