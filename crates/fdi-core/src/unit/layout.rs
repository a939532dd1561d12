//! The unknowns of a unit: damage looked for and numbers with a tolerance.

use ema_sim::{FAULT_COUNT, FaultCoordinates, Parameter, Tolerance, UncertainNumber};

use crate::simulation::experiment::Experiment;

/// Part of the machine that a number acts on.
///
/// Relative numbers are the ratio to the model file's value less one.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Acts {
    /// Peak back-EMF over speed, relative.
    TorqueConstant,
    /// Rotor inertia, relative.
    MotorInertia,
    /// Inertia of the surface, relative.
    SurfaceInertia,
    /// Static and kinetic dry friction together, relative.
    DryFriction,
    /// Static over kinetic friction, relative.
    StaticOverKinetic,
    /// Viscous drag, relative.
    Viscous,
    /// Dry friction of the surface, relative.
    SurfaceFriction,
    /// Play as built, relative.
    Play,
    /// Efficiency of the gear, relative.
    Efficiency,
    /// Load on the surface, N·m.
    Load,
    /// Turns of a phase as built, relative.
    Turns(usize),
    /// Eccentricity as built, `ζ·cos φ`.
    EccentricityCos,
    /// Eccentricity as built, `ζ·sin φ`.
    EccentricitySin,
    /// Gain of the sensor of a phase, relative.
    PhaseGain(usize),
    /// Offset of the sensor of a phase, A.
    PhaseOffset(usize),
    /// Any other parameter, relative.
    Other(&'static Parameter),
}

impl Acts {
    /// True for errors of the sensors.
    pub(crate) fn is_of_sensor(self) -> bool {
        matches!(self, Self::PhaseGain(_) | Self::PhaseOffset(_))
    }
}

/// A number with a tolerance.
#[derive(Clone, Debug)]
pub(crate) struct UnitNumber {
    /// Key of the model file's `[tolerance]`, with the phase where there are three.
    pub(crate) key: String,
    pub(crate) acts: Acts,
    /// Standard deviation of one recording's unit from the model file, all levels together.
    pub(crate) std: f64,
}

/// The unknowns in their order: damage looked for, then numbers.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Indices of the coordinates of damage looked for.
    pub(crate) sought: Vec<usize>,
    pub(crate) numbers: Vec<UnitNumber>,
}

const PHASES: [&str; 3] = ["a", "b", "c"];

impl Layout {
    /// The unknowns of an experiment's machine.
    pub(crate) fn of(experiment: &Experiment) -> Self {
        let mut numbers: Vec<UnitNumber> = Vec::new();
        for tolerance in &experiment.tolerance {
            for number in numbers_of(tolerance) {
                match numbers.iter_mut().find(|known| known.key == number.key) {
                    Some(known) => known.std = known.std.hypot(number.std),
                    None => numbers.push(number),
                }
            }
        }
        Self { sought: experiment.sought_indices(), numbers }
    }

    /// Unknowns altogether.
    pub(crate) fn len(&self) -> usize {
        self.sought.len() + self.numbers.len()
    }

    /// Damage at a point of the unknowns.
    pub(crate) fn damage(&self, point: &[f64]) -> FaultCoordinates {
        let mut all = FaultCoordinates([0.0; FAULT_COUNT]);
        for (&index, &value) in self.sought.iter().zip(point) {
            all.0[index] = value;
        }
        all
    }

    /// Place of a coordinate of damage among the unknowns.
    pub(crate) fn place_of(&self, coordinate: usize) -> Option<usize> {
        self.sought.iter().position(|&index| index == coordinate)
    }

    /// The numbers at a point with their places.
    pub(crate) fn at<'a>(
        &'a self,
        point: &'a [f64],
    ) -> impl Iterator<Item = (&'a UnitNumber, f64)> + 'a {
        self.numbers.iter().zip(point[self.sought.len()..].iter().copied())
    }
}

/// The numbers that a tolerance stands for: one, or one a phase or direction.
fn numbers_of(tolerance: &Tolerance) -> Vec<UnitNumber> {
    let (key, std) = (tolerance.key(), tolerance.std());
    let one = |acts| vec![UnitNumber { key: key.to_owned(), acts, std }];
    let each = |acts: fn(usize) -> Acts| {
        let named = |(phase, name): (usize, &&str)| UnitNumber {
            key: format!("{key}.{name}"),
            acts: acts(phase),
            std,
        };
        PHASES.iter().enumerate().map(named).collect()
    };
    match tolerance.number {
        UncertainNumber::StaticOverKinetic => one(Acts::StaticOverKinetic),
        UncertainNumber::Load => one(Acts::Load),
        UncertainNumber::PhaseGain => each(Acts::PhaseGain),
        UncertainNumber::PhaseOffset => each(Acts::PhaseOffset),
        UncertainNumber::Turns => each(Acts::Turns),
        UncertainNumber::Eccentricity => {
            // the amplitude's mean square is that of both directions together
            let std = std * core::f64::consts::FRAC_1_SQRT_2;
            let along = |name, acts| UnitNumber { key: format!("{key}.{name}"), acts, std };
            vec![along("cos", Acts::EccentricityCos), along("sin", Acts::EccentricitySin)]
        }
        UncertainNumber::Parameter(parameter) => one(acts_of(parameter)),
        _ => Vec::new(),
    }
}

/// Part of the machine that a parameter of the model file is.
fn acts_of(parameter: &'static Parameter) -> Acts {
    match parameter.key() {
        "motor.back-emf-v-s-per-rad" => Acts::TorqueConstant,
        "motor.inertia-kg-m2" => Acts::MotorInertia,
        "motor.viscous-n-m-s-per-rad" => Acts::Viscous,
        "transmission.surface-inertia-kg-m2" => Acts::SurfaceInertia,
        "transmission.kinetic-friction-n-m" => Acts::DryFriction,
        // a file that gives both says of this one how the ratio may be off
        "transmission.static-friction-n-m" => Acts::StaticOverKinetic,
        "transmission.surface-friction-n-m" => Acts::SurfaceFriction,
        "transmission.backlash-rad" => Acts::Play,
        "transmission.efficiency-ratio" => Acts::Efficiency,
        _ => Acts::Other(parameter),
    }
}
