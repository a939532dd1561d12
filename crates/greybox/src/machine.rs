//! The nominal machine with free numbers, damage and effects, run on the command of a recording.

use ema_sim::{
    AxisParameter, Drive, Effect, FaultCoordinates, FaultId, Geometry, MotionTerm, Parameter,
    model_file::{AxisModel, AxisTolerance, MachineModel, Model, Tolerance},
};

use crate::{
    error::GreyboxError,
    follow::{self, followed, smoothed},
    record::{CommandKind, Record},
    run::{Run, finite},
};

/// Signals that the model gives for a recording, at its rate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prediction {
    /// What drives the machine, as its sensor shows it: A, or V.
    pub drive: Vec<f64>,
    /// Angle of the motor, or position of the axis.
    pub motor: Vec<f64>,
    /// Speed of the same.
    pub speed: Vec<f64>,
    /// Position of the surface, or of the axis.
    pub surface: Vec<f64>,
}

/// A number of the machine that a data sheet knows only roughly.
#[derive(Clone, Debug)]
pub(crate) struct Rough {
    pub(crate) key: String,
    pub(crate) value: f64,
    pub(crate) half_width: f64,
    knob: Knob,
}

#[derive(Clone, Copy, Debug)]
enum Knob {
    Actuator(&'static Parameter),
    Axis(&'static AxisParameter),
}

impl Rough {
    fn of_actuator(parameter: &'static Parameter, model: &Model, half_width_frac: f64) -> Self {
        let value = parameter.get(&model.actuator);
        let half_width = half_width_frac * value.abs();
        Self { key: parameter.key().to_owned(), value, half_width, knob: Knob::Actuator(parameter) }
    }

    fn of_axis(parameter: &'static AxisParameter, model: &AxisModel, half_width_frac: f64) -> Self {
        let value = parameter.get(&model.axis);
        let half_width = half_width_frac * value.abs();
        let key = parameter.key(model.axis.geometry, model.axis.drive);
        Self { key, value, half_width, knob: Knob::Axis(parameter) }
    }

    /// Term of the equation of motion that it sets, if any.
    pub(crate) fn motion_term(&self) -> Option<MotionTerm> {
        match self.knob {
            Knob::Actuator(parameter) => parameter.motion_term(),
            Knob::Axis(parameter) => parameter.motion_term(),
        }
    }

    /// Least and largest value that any machine has.
    pub(crate) fn bounds(&self) -> (f64, f64) {
        match self.knob {
            Knob::Actuator(parameter) => parameter.bounds(),
            Knob::Axis(parameter) => parameter.bounds(),
        }
    }
}

/// What of the machine is not nominal.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct State {
    /// Values of [`Machine::rough`].
    pub(crate) rough: Vec<f64>,
    pub(crate) faults: FaultCoordinates,
    pub(crate) effects: Vec<Effect>,
    /// The effects of each recording, where they differ between recordings.
    pub(crate) in_record: Vec<Vec<Effect>>,
}

impl State {
    /// Lets one more effect act.
    pub(crate) fn add(&mut self, effect: &Effect) {
        self.effects.push(effect.clone());
        for effects in &mut self.in_record {
            effects.push(effect.clone());
        }
    }
}

/// A model that recordings are compared with.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    model: MachineModel,
    pub(crate) built_in: Vec<Effect>,
    rough: Vec<Rough>,
}

impl Machine {
    pub(crate) fn new(model: &MachineModel) -> Self {
        let rough = match model {
            MachineModel::Actuator(model) => {
                let of = |t: &Tolerance| Rough::of_actuator(t.parameter, model, t.half_width_frac);
                model.tolerance.iter().map(of).collect()
            }
            MachineModel::ServoAxis(model) => {
                let of = |t: &AxisTolerance| Rough::of_axis(t.parameter, model, t.half_width_frac);
                model.tolerance.iter().map(of).collect()
            }
            _ => Vec::new(),
        };
        Self { built_in: model.switched_on(), model: model.clone(), rough }
    }

    pub(crate) fn geometry(&self) -> Geometry {
        self.model.geometry()
    }

    /// Coordinates of damage that it can have.
    pub(crate) fn fault_coordinates(&self) -> Vec<usize> {
        let mut places = Vec::new();
        for fault in self.model.faults() {
            match fault {
                FaultId::Eccentricity => places.extend([5, 6]),
                FaultId::EccentricityPhase => {}
                other => places.push(other.index()),
            }
        }
        places
    }

    /// What is known only roughly, in the order of the file.
    pub(crate) fn rough(&self) -> &[Rough] {
        &self.rough
    }

    /// What the model file says of a number that is known roughly.
    pub(crate) fn nominal(&self, key: &str) -> f64 {
        self.rough.iter().find(|rough| rough.key == key).map_or(0.0, |rough| rough.value)
    }

    /// The same machine with what a calibration asks for known only roughly as well: inertia,
    /// drag, dry friction and the constant of the motor.
    pub(crate) fn to_calibrate(&self) -> Self {
        let mut machine = self.clone();
        let more: Vec<Rough> = match &self.model {
            MachineModel::Actuator(model) => Parameter::ALL
                .iter()
                .filter(|parameter| parameter.motion_term().is_some())
                .map(|parameter| Rough::of_actuator(parameter, model, 0.0))
                .collect(),
            MachineModel::ServoAxis(model) => AxisParameter::ALL
                .iter()
                .filter(|parameter| parameter.motion_term().is_some())
                .map(|parameter| Rough::of_axis(parameter, model, 0.0))
                .collect(),
            _ => Vec::new(),
        };
        for rough in more {
            if machine.rough.iter().all(|known| known.key != rough.key) {
                machine.rough.push(rough);
            }
        }
        machine
    }

    /// The model with its rough numbers replaced.
    pub(crate) fn with_rough(&self, values: &[f64]) -> MachineModel {
        let mut model = self.model.clone();
        for (rough, value) in self.rough.iter().zip(values) {
            match (&mut model, rough.knob) {
                (MachineModel::Actuator(model), Knob::Actuator(parameter)) => {
                    parameter.set(&mut model.actuator, *value);
                }
                (MachineModel::ServoAxis(model), Knob::Axis(parameter)) => {
                    parameter.set(&mut model.axis, *value);
                }
                _ => {}
            }
        }
        // a static friction keeps its ratio to the kinetic one; below it it is no machine's
        match (&mut model, &self.model) {
            (MachineModel::Actuator(model), MachineModel::Actuator(nominal)) => {
                let (new, old) = (&mut model.actuator.transmission, &nominal.actuator.transmission);
                new.static_friction_n_m = kept(
                    old.static_friction_n_m,
                    old.kinetic_friction_n_m,
                    new.kinetic_friction_n_m,
                );
            }
            (MachineModel::ServoAxis(model), MachineModel::ServoAxis(nominal)) => {
                let (new, old) = (&mut model.axis, &nominal.axis);
                new.static_friction =
                    kept(old.static_friction, old.kinetic_friction, new.kinetic_friction);
            }
            _ => {}
        }
        model
    }

    /// Torque, or force, over the drive signal; for scales.
    pub(crate) fn constant(&self) -> f64 {
        match &self.model {
            MachineModel::Actuator(model) => 2.0 * model.actuator.motor.back_emf_v_s_per_rad,
            MachineModel::ServoAxis(model) => model.axis.force_constant,
            _ => 1.0,
        }
    }

    /// Inertia or mass that the motor moves.
    pub(crate) fn inertia(&self) -> f64 {
        match &self.model {
            MachineModel::Actuator(model) => model.actuator.total_inertia_kg_m2(),
            MachineModel::ServoAxis(model) => model.axis.inertia,
            _ => 1.0,
        }
    }

    /// The drive signal of a recording as it is compared with predictions.
    pub(crate) fn measured_drive(&self, record: &Record) -> Vec<f64> {
        match &self.model {
            MachineModel::ServoAxis(_) if record.kind == CommandKind::Motion => {
                followed(&smoothed(&record.drive), record.rate_hz)
            }
            _ => record.drive.clone(),
        }
    }

    /// Rate down to which the drive signal of a recording is averaged, Hz: what acts on the machine
    /// shows within a few bandwidths of its control. Far above it the likelihood would be one of
    /// single samples, and a delay of a part of a sample outweigh half of the friction.
    pub(crate) fn compared_hz(&self, record: &Record) -> f64 {
        if record.kind == CommandKind::Motion {
            return follow::compared_hz(record.rate_hz);
        }
        let (least, most) = COMPARED_HZ;
        (COMPARED_OVER_BANDWIDTH * self.bandwidth_hz()).clamp(least, most)
    }

    /// Bandwidth of the faster of the speed and the position loop, Hz: with gains `k_p` and `k_v`,
    /// `max(k_p, k_v·constant/inertia)/2π`.
    pub(crate) fn bandwidth_hz(&self) -> f64 {
        let (position, speed) = match &self.model {
            MachineModel::Actuator(model) => {
                let controller = &model.actuator.controller;
                (controller.position_gain_per_s, controller.speed_gain_a_s_per_rad)
            }
            MachineModel::ServoAxis(model) => {
                (model.axis.controller.position_gain_per_s, model.axis.controller.speed_gain)
            }
            _ => (0.0, 0.0),
        };
        position.max(speed * self.constant() / self.inertia()) / core::f64::consts::TAU
    }

    /// Largest speed of the surface or axis that the controller allows, rad/s or m/s.
    pub(crate) fn speed_limit(&self) -> f64 {
        match &self.model {
            MachineModel::Actuator(model) => {
                let actuator = &model.actuator;
                actuator.controller.speed_limit_rad_per_s / actuator.transmission.gear_ratio
            }
            MachineModel::ServoAxis(model) => model.axis.controller.speed_limit,
            _ => f64::INFINITY,
        }
    }

    /// Largest drive signal that a proposed command may need: half of the controller's limit.
    pub(crate) fn safe_drive(&self) -> f64 {
        0.5 * match &self.model {
            MachineModel::Actuator(model) => model.actuator.controller.current_limit_a,
            MachineModel::ServoAxis(model) => model.axis.controller.output_limit,
            _ => f64::INFINITY,
        }
    }

    /// Periods of the current in a turn of the motor.
    pub(crate) fn pole_pairs(&self) -> f64 {
        match &self.model {
            MachineModel::Actuator(model) => f64::from(model.actuator.motor.pole_pairs),
            _ => 1.0,
        }
    }

    /// Whether it is a machine with one shaft and no commutation.
    pub(crate) fn is_axis(&self) -> bool {
        matches!(self.model, MachineModel::ServoAxis(_))
    }

    /// Whether its drive signal is a voltage.
    pub(crate) fn drive_unit(&self) -> &'static str {
        match &self.model {
            MachineModel::ServoAxis(model) if model.axis.drive == Drive::Amplifier => "v",
            _ => "a",
        }
    }

    /// Runs the command of a recording, by its place among those compared.
    pub(crate) fn simulate(
        &self,
        state: &State,
        record: &Record,
        place: usize,
    ) -> Result<Prediction, GreyboxError> {
        let mut prediction = match self.prepare(state, record, place)? {
            Run::Actuator(run) => run.prediction(record),
            Run::Axis(run) => run.prediction(record),
            Run::None => Prediction::default(),
        };
        prediction.drive = finite(prediction.drive, record)?;
        Ok(prediction)
    }
}

/// Rate of comparison over the bandwidth of the control, and its bounds, Hz.
const COMPARED_OVER_BANDWIDTH: f64 = 8.0;
const COMPARED_HZ: (f64, f64) = (50.0, 500.0);

/// A static friction for a new kinetic one, in the old ratio.
fn kept(old_static: f64, old_kinetic: f64, kinetic: f64) -> f64 {
    if kinetic == old_kinetic {
        return old_static;
    }
    let ratio = if old_kinetic > 0.0 { old_static / old_kinetic } else { 1.0 };
    kinetic * ratio.max(1.0)
}

#[cfg(test)]
impl Machine {
    /// The axis of the tests.
    pub(crate) fn bench_top() -> Self {
        let text = include_str!("../tests/it/bench_top.toml");
        Self::new(&ema_sim::model_file::parse_machine(text).expect("the axis of the tests"))
    }
}
