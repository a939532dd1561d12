//! Numbers of a unit that was learnt.
//!
//! The current shows torques over the torque constant alone, so that an inertia is known less well
//! than its ratio to that constant: the covariance gives both.
//!
//! # Source
//!
//! Joint posterior of the recordings, `crates/fdi-core/src/unit/joint.rs`; `docs/models/units.md`.

use ema_sim::{
    Actuator, Level, Parameter, Spread, TemperatureLaw, ThermalCoefficient, Tolerance,
    UncertainNumber, model_file::Model,
};

use crate::{
    diagnose::Diagnoser,
    simulation::experiment::Experiment,
    unit::{
        joint::BuiltFit,
        layout::{Acts, Layout},
        learning::UnitLearningError,
        learnt_unit::LearntUnit,
    },
};

/// Standard deviation over that of the data sheet up to which recordings determine a number. Of two
/// numbers of which only the ratio shows each keeps `1/√2` of its spread: that determines neither.
const DETERMINED_SHARE: f64 = 0.5;

/// A number of a unit as built, by the recordings that it was learnt from.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LearntNumber {
    /// Key of the model file's `[tolerance]`, with the phase where there are three; of a ratio
    /// both keys with ` / ` between them.
    pub key: String,
    /// Value in the model file.
    pub nominal: f64,
    /// Most probable value.
    pub value: f64,
    /// Standard deviation of the value.
    pub std: f64,
    /// Standard deviation by the model file's tolerances.
    pub prior_std: f64,
}

impl LearntNumber {
    /// 95 % interval of the value.
    pub fn interval_95(&self) -> [f64; 2] {
        [self.value - 1.96 * self.std, self.value + 1.96 * self.std]
    }

    /// True where the recordings leave half of the data sheet's spread at most.
    pub fn is_determined(&self) -> bool {
        self.std <= DETERMINED_SHARE * self.prior_std
    }
}

/// Numbers of a unit as built.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LearntNumbers {
    /// Numbers with a tolerance between units, in the order of the model file.
    pub numbers: Vec<LearntNumber>,
    /// Inertias and frictions over the torque constant, which is all that a current shows of
    /// either.
    pub ratios: Vec<LearntNumber>,
    /// The model of the type with the numbers of the unit, and what is left open of them as
    /// tolerances.
    ///
    /// Errors of its sensors, its mismatch of turns and its eccentricity have no place in a model
    /// file; their tolerances stay those of the type. What the numbers have in common, such as a
    /// ratio that is known better than either of two numbers, is lost.
    pub model: Model,
}

impl Diagnoser {
    /// Numbers of a unit as built, by all recordings that it was learnt from.
    ///
    /// # Errors
    ///
    /// [`UnitLearningError::OtherBundle`] for a unit of another bundle,
    /// [`UnitLearningError::Undetermined`] where its evidence determines no number.
    pub fn unit_numbers(&self, unit: &LearntUnit) -> Result<LearntNumbers, UnitLearningError> {
        let quantities = self.learnt.quantities();
        unit.check_basis(self.bundle(), &quantities)?;
        let fit = unit.as_built(&quantities).ok_or(UnitLearningError::Undetermined)?;
        let found =
            Found { experiment: &self.bundle().experiment, layout: quantities.layout(), fit };
        let mut numbers = found.numbers();
        if let Some(id) = unit.actuator_id() {
            numbers.model.name = Some(id.to_owned());
        }
        Ok(numbers)
    }
}

/// Numbers of a machine as recordings leave them.
struct Found<'a> {
    experiment: &'a Experiment,
    layout: &'a Layout,
    fit: BuiltFit,
}

impl Found<'_> {
    fn numbers(&self) -> LearntNumbers {
        let torque_constant = self.place(|acts| matches!(acts, Acts::TorqueConstant));
        let over = |place: usize| Some(self.ratio(place, torque_constant?));
        let is_torque = |acts: Acts| {
            matches!(
                acts,
                Acts::MotorInertia
                    | Acts::SurfaceInertia
                    | Acts::DryFriction
                    | Acts::Viscous
                    | Acts::SurfaceFriction
            )
        };
        let all = 0..self.fit.numbers.len();
        let torques = all.clone().filter(|&place| is_torque(self.acts(place)));
        LearntNumbers {
            ratios: torques.filter_map(over).collect(),
            numbers: all.map(|place| self.number(place)).collect(),
            model: Model {
                actuator: self.actuator(),
                tolerance: self.tolerance(),
                temperature: self.temperature(),
                ..self.experiment.model()
            },
        }
    }

    /// Place in the fit of the number that acts on something.
    fn place(&self, is_sought: impl Fn(Acts) -> bool) -> Option<usize> {
        (0..self.fit.numbers.len()).find(|&place| is_sought(self.acts(place)))
    }

    fn acts(&self, place: usize) -> Acts {
        self.layout.numbers[self.fit.numbers[place]].acts
    }

    fn std(&self, place: usize) -> f64 {
        self.fit.covariance[(place, place)].sqrt()
    }

    /// Standard deviation by the tolerances between units.
    fn prior_std(&self, place: usize) -> f64 {
        self.layout.numbers[self.fit.numbers[place]].scatter.machine
    }

    fn key(&self, place: usize) -> &str {
        match self.acts(place) {
            // a tolerance of the static friction is one of the ratio too
            Acts::StaticOverKinetic => UncertainNumber::StaticOverKinetic.key(),
            _ => &self.layout.numbers[self.fit.numbers[place]].key,
        }
    }

    fn number(&self, place: usize) -> LearntNumber {
        let Nominal { value: nominal, unit } = nominal(self.experiment, self.acts(place));
        LearntNumber {
            key: self.key(place).to_owned(),
            nominal,
            value: nominal + unit * self.fit.estimate[place],
            std: unit * self.std(place),
            prior_std: unit * self.prior_std(place),
        }
    }

    /// Ratio of two numbers that are relative, its error straight in theirs.
    fn ratio(&self, over: usize, under: usize) -> LearntNumber {
        let of = |place: usize| nominal(self.experiment, self.acts(place)).value;
        let nominal = of(over) / of(under);
        let [a, b] = [over, under].map(|place| 1.0 + self.fit.estimate[place]);
        let value = nominal * a / b;
        let covariance = |i, j| self.fit.covariance[(i, j)];
        let variance = covariance(over, over) / (a * a) + covariance(under, under) / (b * b)
            - 2.0 * covariance(over, under) / (a * b);
        LearntNumber {
            key: format!("{} / {}", self.key(over), self.key(under)),
            nominal,
            value,
            std: value * variance.max(0.0).sqrt(),
            prior_std: nominal * self.prior_std(over).hypot(self.prior_std(under)),
        }
    }

    fn actuator(&self) -> Actuator {
        let mut actuator = self.experiment.actuator;
        for place in 0..self.fit.numbers.len() {
            let Some(parameter) = self.acts(place).parameter() else { continue };
            let ratio = 1.0 + self.fit.estimate[place];
            parameter.set(&mut actuator, ratio * parameter.get(&self.experiment.actuator));
        }
        let static_over_kinetic = self.place(|acts| matches!(acts, Acts::StaticOverKinetic));
        let gear = &mut actuator.transmission;
        let own = self.experiment.actuator.transmission;
        // the static friction follows the kinetic one
        let ratio = 1.0 + static_over_kinetic.map_or(0.0, |place| self.fit.estimate[place]);
        let wanted_n_m = if own.kinetic_friction_n_m > 0.0 {
            let kinetic = gear.kinetic_friction_n_m / own.kinetic_friction_n_m;
            own.static_friction_n_m * kinetic * ratio
        } else {
            own.static_friction_n_m * ratio
        };
        gear.static_friction_n_m = wanted_n_m.max(gear.kinetic_friction_n_m);
        gear.efficiency_ratio = gear.efficiency_ratio.min(1.0);
        actuator
    }

    fn temperature(&self) -> Option<TemperatureLaw> {
        let mut law = self.experiment.temperature?;
        for place in 0..self.fit.numbers.len() {
            if let Acts::Coefficient(number) = self.acts(place) {
                let per_k = law.coefficient(number).per_k + self.fit.estimate[place];
                let std_per_k = self.std(place);
                law.coefficients[number as usize] = ThermalCoefficient { per_k, std_per_k };
            }
        }
        Some(law)
    }

    /// Tolerances about the numbers of the unit: of each that a model file has room for one between
    /// units, by the recordings, relative to the new value.
    fn tolerance(&self) -> Vec<Tolerance> {
        let mut narrowed = Vec::new();
        let mut all = Vec::new();
        for tolerance in &self.experiment.tolerance {
            let place = self.place_of(tolerance.number);
            match place.filter(|_| tolerance.level.is_of_machine()) {
                // type and unit were one number to the recordings
                Some(place) if narrowed.contains(&place) => {}
                Some(place) => {
                    narrowed.push(place);
                    let std = self.std(place) / (1.0 + self.fit.estimate[place]);
                    let spread = Spread::Std(std);
                    all.push(Tolerance { spread, level: Level::Unit, ..*tolerance });
                }
                None => all.push(*tolerance),
            }
        }
        all
    }

    /// Place in the fit of a number that a model file has room for.
    fn place_of(&self, number: UncertainNumber) -> Option<usize> {
        let is_ratio = |acts| matches!(acts, Acts::StaticOverKinetic);
        match number {
            UncertainNumber::StaticOverKinetic => self.place(is_ratio),
            UncertainNumber::Parameter(parameter) if *parameter == Parameter::STATIC_FRICTION => {
                self.place(is_ratio)
            }
            UncertainNumber::Parameter(parameter) => {
                self.place(|acts| acts.parameter() == Some(parameter))
            }
            _ => None,
        }
    }
}

/// Value of a number in the model file, and of one unit of it.
struct Nominal {
    value: f64,
    unit: f64,
}

fn nominal(experiment: &Experiment, acts: Acts) -> Nominal {
    if let Some(parameter) = acts.parameter() {
        let value = parameter.get(&experiment.actuator);
        return Nominal { value, unit: value };
    }
    let relative = |value: f64| Nominal { value, unit: value };
    let absolute = |value: f64| Nominal { value, unit: 1.0 };
    let gear = &experiment.actuator.transmission;
    match acts {
        Acts::StaticOverKinetic if gear.kinetic_friction_n_m > 0.0 => {
            relative(gear.static_friction_n_m / gear.kinetic_friction_n_m)
        }
        Acts::Load => absolute(experiment.scenario.load_n_m),
        Acts::Coefficient(number) => {
            absolute(experiment.temperature.map_or(0.0, |law| law.coefficient(number).per_k))
        }
        Acts::PhaseOffset(_)
        | Acts::EccentricityCos
        | Acts::EccentricitySin
        | Acts::Temperature => absolute(0.0),
        // gains, turns and whatever else is relative
        _ => relative(1.0),
    }
}
