//! The unknowns of a unit: damage looked for and numbers with a tolerance.

use ema_sim::{
    Block, FAULT_COUNT, FaultCoordinates, FaultId, Level, Parameter, TemperatureLaw, ThermalNumber,
    Tolerance, UncertainNumber,
};

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
    /// Gain of the voltage's measurement, relative.
    VoltageGain,
    /// Winding's temperature less that of the model file's numbers, K.
    Temperature,
    /// Temperature coefficient less that of the model file, 1/K.
    Coefficient(ThermalNumber),
    /// Any other parameter, relative.
    Other(&'static Parameter),
}

impl Acts {
    /// True for errors of the current's sensors.
    pub(crate) fn is_of_sensor(self) -> bool {
        matches!(self, Self::PhaseGain(_) | Self::PhaseOffset(_))
    }

    /// The parameter of the model file that the number is the ratio of.
    pub(crate) fn parameter(self) -> Option<&'static Parameter> {
        Some(match self {
            Self::TorqueConstant => &Parameter::BACK_EMF,
            Self::MotorInertia => &Parameter::MOTOR_INERTIA,
            Self::SurfaceInertia => &Parameter::SURFACE_INERTIA,
            Self::DryFriction => &Parameter::KINETIC_FRICTION,
            Self::Viscous => &Parameter::VISCOUS,
            Self::SurfaceFriction => &Parameter::SURFACE_FRICTION,
            Self::Play => &Parameter::BACKLASH,
            Self::Efficiency => &Parameter::EFFICIENCY,
            Self::Other(parameter) => parameter,
            _ => return None,
        })
    }

    /// True for the temperature of the winding.
    pub(crate) fn is_temperature(self) -> bool {
        matches!(self, Self::Temperature)
    }

    /// The component that the number is of; `None` for the drive and the test.
    pub(crate) fn component(self) -> Option<Component> {
        match self {
            Self::TorqueConstant
            | Self::MotorInertia
            | Self::Viscous
            | Self::Turns(_)
            | Self::EccentricityCos
            | Self::EccentricitySin => Some(Component::Motor),
            Self::SurfaceInertia
            | Self::DryFriction
            | Self::StaticOverKinetic
            | Self::SurfaceFriction
            | Self::Play
            | Self::Efficiency => Some(Component::Gear),
            Self::PhaseGain(_) | Self::PhaseOffset(_) | Self::VoltageGain => {
                Some(Component::Sensor)
            }
            Self::Coefficient(number) => Some(match number {
                ThermalNumber::DryFriction => Component::Gear,
                _ => Component::Motor,
            }),
            Self::Load | Self::Temperature => None,
            Self::Other(parameter) => match parameter.block() {
                Block::Motor => Some(Component::Motor),
                Block::Transmission => Some(Component::Gear),
                _ => None,
            },
        }
    }
}

/// A number with a tolerance.
#[derive(Clone, Debug)]
pub(crate) struct UnitNumber {
    /// Key of the model file's `[tolerance]`, with the phase where there are three.
    pub(crate) key: String,
    pub(crate) acts: Acts,
    pub(crate) scatter: Scatter,
}

/// Part of an actuator that can be replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Component {
    /// Rotor, windings and bearings.
    Motor,
    /// Gear, screw and surface.
    Gear,
    /// Sensors of currents and voltage.
    Sensor,
}

impl Component {
    pub(crate) const COUNT: usize = 3;

    /// The component that a coordinate of damage is of: friction and play are of the gear.
    pub(crate) fn of_damage(coordinate: usize) -> Self {
        if coordinate < 2 { Self::Gear } else { Self::Motor }
    }
}

/// Standard deviations of a number at the levels of a machine, relative or in its unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Scatter {
    /// Between machines as built: type and unit.
    pub(crate) machine: f64,
    /// Between sessions of a machine.
    pub(crate) session: f64,
    /// Between recordings of a session.
    pub(crate) recording: f64,
}

impl Scatter {
    fn at(level: Level, std: f64) -> Self {
        match level {
            Level::Type | Level::Unit => Self { machine: std, ..Self::default() },
            Level::Session => Self { session: std, ..Self::default() },
            Level::Recording => Self { recording: std, ..Self::default() },
        }
    }

    fn with(self, other: Self) -> Self {
        Self {
            machine: self.machine.hypot(other.machine),
            session: self.session.hypot(other.session),
            recording: self.recording.hypot(other.recording),
        }
    }

    /// Standard deviation of one recording of a machine that nothing else is known of.
    pub(crate) fn together(self) -> f64 {
        self.machine.hypot(self.session).hypot(self.recording)
    }
}

/// Numbers that follow the temperature, each over its value at the model file's temperature.
pub(crate) fn thermal_ratios<'a>(
    law: Option<&TemperatureLaw>,
    numbers: impl Iterator<Item = (&'a UnitNumber, f64)>,
) -> [f64; ThermalNumber::ALL.len()] {
    let Some(law) = law else { return [1.0; ThermalNumber::ALL.len()] };
    let mut per_k = ThermalNumber::ALL.map(|number| law.coefficient(number).per_k);
    let mut away_k = 0.0;
    for (number, value) in numbers {
        match number.acts {
            Acts::Temperature => away_k += value,
            Acts::Coefficient(of) => per_k[of as usize] += value,
            _ => {}
        }
    }
    ThermalNumber::ALL.map(|number| number.ratio(per_k[number as usize], away_k))
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
        // a number that is exact is none that is looked for
        let open = experiment.tolerance.iter().filter(|tolerance| tolerance.std() > 0.0);
        for tolerance in open {
            for number in numbers_of(tolerance) {
                match numbers.iter_mut().find(|known| known.key == number.key) {
                    Some(known) => known.scatter = known.scatter.with(number.scatter),
                    None => numbers.push(number),
                }
            }
        }
        if numbers.iter().any(|number| number.acts.is_temperature()) {
            numbers.extend(coefficients_of(experiment.temperature.as_ref()));
        }
        // last, so that machines drawn without it are drawn alike with it
        numbers.sort_by_key(|number| matches!(number.acts, Acts::VoltageGain));
        Self { sought: experiment.sought_indices(), numbers }
    }

    /// True where another test of the machine has the same unknowns.
    pub(crate) fn is_of_machine(&self, other: &Self) -> bool {
        let alike = |(a, b): (&UnitNumber, &UnitNumber)| a.key == b.key && a.scatter == b.scatter;
        self.sought == other.sought
            && self.numbers.len() == other.numbers.len()
            && self.numbers.iter().zip(&other.numbers).all(alike)
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

    /// Places of a fault's coordinates of damage among the unknowns; none of the eccentricity's direction,
    /// which is in both of its coordinates.
    pub(crate) fn places_of(&self, fault: FaultId) -> Vec<usize> {
        let coordinates: &[usize] = match fault {
            FaultId::Eccentricity => &[5, 6],
            FaultId::EccentricityPhase => &[],
            size => &[size.index()],
        };
        coordinates.iter().filter_map(|&one| self.place_of(one)).collect()
    }

    /// Point with some unknowns set by the names of coordinates and the keys of numbers.
    #[cfg(test)]
    pub(crate) fn point(&self, set: &[(&str, f64)]) -> Vec<f64> {
        let mut point = vec![0.0; self.len()];
        for (name, value) in set {
            let damage = FaultCoordinates::NAMES.iter().position(|one| one == name);
            let number = || self.numbers.iter().position(|number| number.key == *name);
            let place = damage.or_else(|| Some(self.sought.len() + number()?)).unwrap();
            point[place] = *value;
        }
        point
    }

    /// Place of the winding's temperature among the unknowns, where it scatters.
    pub(crate) fn temperature(&self) -> Option<usize> {
        let is_temperature = |number: &UnitNumber| number.acts.is_temperature();
        Some(self.sought.len() + self.numbers.iter().position(is_temperature)?)
    }

    /// The numbers at a point with their places.
    pub(crate) fn at<'a>(
        &'a self,
        point: &'a [f64],
    ) -> impl Iterator<Item = (&'a UnitNumber, f64)> + 'a {
        self.numbers.iter().zip(point[self.sought.len()..].iter().copied())
    }
}

/// Coefficients of a law of temperature that differ between units.
fn coefficients_of(law: Option<&TemperatureLaw>) -> Vec<UnitNumber> {
    let uncertain = |number: ThermalNumber| {
        let std = law?.coefficient(number).std_per_k;
        let key = format!("temperature.{}", number.key());
        let scatter = Scatter { machine: std, ..Scatter::default() };
        (std > 0.0).then_some(UnitNumber { key, acts: Acts::Coefficient(number), scatter })
    };
    ThermalNumber::ALL.into_iter().filter_map(uncertain).collect()
}

/// The numbers that a tolerance stands for: one, or one a phase or direction.
fn numbers_of(tolerance: &Tolerance) -> Vec<UnitNumber> {
    let key = tolerance.key();
    let scatter = Scatter::at(tolerance.level, tolerance.std());
    let one = |acts| vec![UnitNumber { key: key.to_owned(), acts, scatter }];
    let each = |acts: fn(usize) -> Acts| {
        let named = |(phase, name): (usize, &&str)| UnitNumber {
            key: format!("{key}.{name}"),
            acts: acts(phase),
            scatter,
        };
        PHASES.iter().enumerate().map(named).collect()
    };
    match tolerance.number {
        UncertainNumber::StaticOverKinetic => one(Acts::StaticOverKinetic),
        UncertainNumber::Load => one(Acts::Load),
        UncertainNumber::WindingTemperature => one(Acts::Temperature),
        UncertainNumber::PhaseGain => each(Acts::PhaseGain),
        UncertainNumber::PhaseOffset => each(Acts::PhaseOffset),
        UncertainNumber::VoltageGain => one(Acts::VoltageGain),
        UncertainNumber::Turns => each(Acts::Turns),
        UncertainNumber::Eccentricity => {
            // the amplitude's mean square is that of both directions together
            let std = tolerance.std() * core::f64::consts::FRAC_1_SQRT_2;
            let scatter = Scatter::at(tolerance.level, std);
            let along = |name, acts| UnitNumber { key: format!("{key}.{name}"), acts, scatter };
            vec![along("cos", Acts::EccentricityCos), along("sin", Acts::EccentricitySin)]
        }
        UncertainNumber::Parameter(parameter) => one(acts_of(parameter)),
        _ => Vec::new(),
    }
}

/// Part of the machine that a parameter of the model file is.
fn acts_of(parameter: &'static Parameter) -> Acts {
    let known = [
        Acts::TorqueConstant,
        Acts::MotorInertia,
        Acts::Viscous,
        Acts::SurfaceInertia,
        Acts::DryFriction,
        Acts::SurfaceFriction,
        Acts::Play,
        Acts::Efficiency,
    ];
    if *parameter == Parameter::STATIC_FRICTION {
        // a file that gives both frictions says of this one how the ratio may be off
        return Acts::StaticOverKinetic;
    }
    let own = known.into_iter().find(|acts| acts.parameter() == Some(parameter));
    own.unwrap_or(Acts::Other(parameter))
}
