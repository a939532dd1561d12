//! The causes that are looked for: wrong numbers, and what acts at the ports of a model.

use ema_sim::{Effect, EffectId, Geometry, MachineScales, Role, ShapeScales};

use crate::{
    model::{ModelError, Number, OwnModel},
    ports::Law,
    scales::Scales,
};

/// Effects of the catalogue that act on a shaft by its motion alone.
const ON_THE_SHAFT: [EffectId; 5] = [
    EffectId::Stribeck,
    EffectId::NonlinearViscous,
    EffectId::DirectionalFriction,
    EffectId::Imbalance,
    EffectId::Cogging,
];
/// Standard deviation of a cause's size over the torque of the machine: any size up to all of it.
const SIZE_OVER_TORQUE: f64 = 0.3;
/// The catalogue's typical sizes over the torque of a machine.
const TYPICAL_OVER_TORQUE: f64 = 0.03;
/// Standard deviation of a share.
const SHARE_STD: f64 = 0.3;
/// Standard deviation of a delay, in samples.
const DELAY_STD_SAMPLES: f64 = 10.0;
/// Delays that a scan tries, in standard deviations: half a sample to 16 samples. Signals are no
/// straight line in a delay.
const DELAYS: [f64; 6] = [0.05, 0.1, 0.2, 0.4, 0.8, 1.6];
/// Change of any other size that a scan tries, in standard deviations.
const SMALL: [f64; 1] = [0.05];
/// Largest order of a torque over the turn that is tried.
const MOST_ORDER: usize = 24;
/// Share of a period that a sample covers at the usual speed, at most: twice what resolves it.
const MOST_TURN_PER_SAMPLE: f64 = 0.25;

/// Where a cause enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CausePort {
    /// A number of the model.
    Number,
    /// Torque against the motion.
    Load,
    /// Between what the controller asks for and what the drive makes.
    Drive,
    /// The position that the controller sees.
    Sensor,
}

impl CausePort {
    /// The name in documents: `load`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Number => "number",
            Self::Load => "load",
            Self::Drive => "drive",
            Self::Sensor => "sensor",
        }
    }
}

/// Size of a cause.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Size {
    /// Key as in model files: `drag_n_m_s_per_rad`; of a number its own.
    pub(crate) key: String,
    /// Value without the cause.
    pub(crate) base: f64,
    /// Standard deviation of its change beforehand.
    pub(crate) std: f64,
    pub(crate) least: f64,
    pub(crate) most: f64,
    /// Changes that a scan tries, in standard deviations.
    pub(crate) trials: &'static [f64],
}

/// Cause that is looked for, with the shape in which it is tried.
#[derive(Clone, Debug)]
pub(crate) struct Cause {
    pub(crate) name: String,
    /// Symbol in the catalogue of effects.
    pub(crate) symbol: Option<&'static str>,
    pub(crate) port: CausePort,
    pub(crate) sizes: Vec<Size>,
    /// Numbers that are not fitted: order, exponent.
    pub(crate) shape: Vec<(&'static str, f64)>,
    /// Shapes of the same cause that are tried.
    pub(crate) shapes: usize,
    act: Act,
}

/// Place that the sizes of a cause change.
#[derive(Clone, Debug)]
enum Act {
    Number(usize),
    Law(fn(&[f64]) -> Law),
    Effect { effect: Effect, keys: Vec<&'static str> },
}

impl Cause {
    /// True where another one is the same cause in the same shape.
    pub(crate) fn is(&self, other: &Self) -> bool {
        self.name == other.name && self.shape == other.shape
    }

    /// The number of the model that it changes.
    pub(crate) fn number(&self) -> Option<usize> {
        if let Act::Number(place) = self.act { Some(place) } else { None }
    }

    /// Law at a port with these sizes.
    pub(crate) fn law(&self, sizes: &[f64]) -> Option<Law> {
        match &self.act {
            Act::Number(_) => None,
            Act::Law(law) => Some(law(sizes)),
            Act::Effect { effect, keys } => {
                let mut effect = effect.clone();
                for (key, size) in keys.iter().zip(sizes) {
                    // sizes stay within the catalogue's bounds: they are the bounds of the search
                    effect.set(key, *size).ok()?;
                }
                Some(Law::Effect(effect))
            }
        }
    }

    fn plain(name: &str, port: CausePort, sizes: Vec<Size>, law: fn(&[f64]) -> Law) -> Self {
        let (name, shape, act) = (name.to_owned(), Vec::new(), Act::Law(law));
        Self { name, symbol: None, port, sizes, shape, shapes: 1, act }
    }

    fn of_catalogue(mut self, symbol: &'static str) -> Self {
        self.symbol = Some(symbol);
        self
    }
}

impl Size {
    fn any(key: &str, std: f64) -> Self {
        let (least, most) = (f64::NEG_INFINITY, f64::INFINITY);
        Self { key: key.to_owned(), base: 0.0, std, least, most, trials: &SMALL }
    }

    fn late(key: &str, sample_s: f64) -> Self {
        let std = DELAY_STD_SAMPLES * sample_s;
        Self { least: 0.0, trials: &DELAYS, ..Self::any(key, std) }
    }

    fn within(key: &str, std: f64, [least, most]: [f64; 2]) -> Self {
        Self { least, most, ..Self::any(key, std) }
    }
}

/// Number of a model whose value is fitted with every set of causes.
pub(crate) fn rough(number: &Number) -> Option<Size> {
    let std = number.tolerance?;
    let Number { key, value, least, most, .. } = number;
    Some(Size { key: key.clone(), base: *value, std, least: *least, most: *most, trials: &SMALL })
}

/// All causes that a model can have.
pub(crate) fn menu(
    model: &dyn OwnModel,
    geometry: Geometry,
    scales: &Scales,
) -> Result<Vec<Cause>, ModelError> {
    let ports = model.ports();
    let mut causes = Vec::new();
    for (place, number) in model.numbers().iter().enumerate() {
        if number.tolerance.is_none() {
            causes.push(of_number(place, number)?);
        }
    }
    if ports.load && scales.torque > 0.0 {
        on_the_shaft(geometry, scales, &mut causes);
    }
    if ports.drive {
        in_the_drive(scales, &mut causes);
    }
    if ports.sensor {
        in_the_sensor(geometry, scales, &mut causes);
    }
    // a model whose numbers all have tolerances can still be adequate, or not
    if causes.is_empty() && model.numbers().is_empty() {
        return Err(ModelError::Nothing);
    }
    Ok(causes)
}

fn of_number(place: usize, number: &Number) -> Result<Cause, ModelError> {
    let Number { key, value, least, most, .. } = number;
    let std = number.suspected_std()?;
    let size =
        Size { key: key.clone(), base: *value, std, least: *least, most: *most, trials: &SMALL };
    Ok(Cause {
        name: format!("number {key}"),
        symbol: None,
        port: CausePort::Number,
        sizes: vec![size],
        shape: Vec::new(),
        shapes: 1,
        act: Act::Number(place),
    })
}

fn on_the_shaft(geometry: Geometry, scales: &Scales, causes: &mut Vec<Cause>) {
    let (torque, keys) = (SIZE_OVER_TORQUE * scales.torque, Keys::of(geometry));
    let port = CausePort::Load;
    let constant = Size::any(keys.torque, torque);
    let load = Cause::plain("constant load", port, vec![constant], |s| Law::ConstantTorque(s[0]));
    causes.push(load);
    // where nothing moves, nothing of the motion can be told
    if scales.speed == 0.0 || scales.travel == 0.0 {
        return;
    }
    let friction = Size::within(keys.friction, torque, [0.0, f64::INFINITY]);
    causes.push(Cause::plain("dry friction", port, vec![friction], |s| Law::DryFriction(s[0])));
    let drag = Size::any(keys.drag, torque / scales.speed);
    causes.push(Cause::plain("drag", port, vec![drag], |s| Law::Drag(s[0])));
    for id in ON_THE_SHAFT {
        let shapes = shapes(id, geometry, scales);
        let count = shapes.len();
        causes.extend(shapes.into_iter().map(|shape| of_effect(id, shape, count, scales)));
    }
}

/// An effect of the catalogue in one shape.
fn of_effect(id: EffectId, effect: Effect, shapes: usize, scales: &Scales) -> Cause {
    let (info, geometry) = (id.info(), effect.geometry());
    let machine = scales.machine();
    let (mut sizes, mut keys, mut shape) = (Vec::new(), Vec::new(), Vec::new());
    for parameter in info.parameters {
        let key = parameter.key(geometry);
        if parameter.role() != Role::Amplitude {
            shape.extend(effect.get(key).map(|value| (key, value)));
            continue;
        }
        let (least, most) = parameter.bounds();
        let std = parameter.typical_size(&machine) * (SIZE_OVER_TORQUE / TYPICAL_OVER_TORQUE);
        sizes.push(Size::within(key, std, [least, most]));
        keys.push(key);
    }
    Cause {
        name: info.name.to_owned(),
        symbol: Some(info.symbol),
        port: CausePort::Load,
        sizes,
        shape,
        shapes,
        act: Act::Effect { effect, keys },
    }
}

/// The shapes in which an effect is tried.
fn shapes(id: EffectId, geometry: Geometry, scales: &Scales) -> Vec<Effect> {
    let machine = ShapeScales { speed: scales.speed, undivided_inertia: None };
    let mut shapes = vec![Effect::new(id, geometry)];
    for parameter in id.info().parameters {
        let values = match parameter.role() {
            Role::Order => orders(scales),
            // a reference at the usual speed: its size is then a torque of this test
            Role::Shape(_) if parameter.key(geometry).starts_with("reference_speed") => {
                vec![scales.speed]
            }
            Role::Shape(_) => parameter.trials(geometry, &machine),
            _ => continue,
        };
        let key = parameter.key(geometry);
        let each = |value: &f64| {
            let value = *value;
            shapes.iter().filter_map(move |shape| shape.clone().with(key, value).ok()).collect()
        };
        shapes = values.iter().map(each).collect::<Vec<Vec<Effect>>>().concat();
    }
    // the first power of speed is drag, which stands in the menu
    shapes.retain(|shape| shape.get("viscous_exponent") != Some(1.0));
    shapes
}

/// Orders of which the travel shows a turn and the samples a wave.
fn orders(scales: &Scales) -> Vec<f64> {
    let periods = 2.0 * scales.travel / core::f64::consts::TAU;
    let turn = scales.speed * scales.sample_s / core::f64::consts::TAU;
    let shown = |order: &f64| order * periods >= 1.0 && order * turn <= MOST_TURN_PER_SAMPLE;
    // of order one is gravity
    (2..=MOST_ORDER).map(|order| order as f64).filter(shown).collect()
}

fn in_the_drive(scales: &Scales, causes: &mut Vec<Cause>) {
    let port = CausePort::Drive;
    let loss = Size::within("drive_loss_ratio", SHARE_STD, [-9.0, 0.95]);
    let gain = Cause::plain("drive gain", port, vec![loss], |s| Law::DriveLoss(s[0]));
    causes.push(gain.of_catalogue(EffectId::MagnetLoss.info().symbol));
    let late = Size::late("drive_delay_s", scales.sample_s);
    let delay = Cause::plain("drive delay", port, vec![late], |s| Law::DriveDelay(s[0]));
    causes.push(delay.of_catalogue(EffectId::ControllerMismatch.info().symbol));
}

fn in_the_sensor(geometry: Geometry, scales: &Scales, causes: &mut Vec<Cause>) {
    let (port, symbol) = (CausePort::Sensor, EffectId::PositionSensor.info().symbol);
    let gain = Size::within("sensor_gain_error_ratio", SHARE_STD, [-0.9, 9.0]);
    causes.push(Cause::plain("sensor gain", port, vec![gain], |s| Law::SensorGain(s[0])));
    let late = Size::late("sensor_delay_s", scales.sample_s);
    let delay = Cause::plain("sensor delay", port, vec![late], |s| Law::SensorDelay(s[0]));
    causes.push(delay.of_catalogue(symbol));
    if geometry == Geometry::Rotary && scales.travel > 0.0 {
        let waves = ["eccentricity_sin_rad", "eccentricity_cos_rad"];
        let waves = waves.map(|key| Size::any(key, 0.1 * scales.travel)).to_vec();
        let law = |s: &[f64]| Law::SensorEccentricity([s[0], s[1]]);
        causes.push(Cause::plain("sensor eccentricity", port, waves, law).of_catalogue(symbol));
    }
}

/// Keys of sizes in the units of a geometry.
struct Keys {
    friction: &'static str,
    drag: &'static str,
    torque: &'static str,
}

impl Keys {
    fn of(geometry: Geometry) -> Self {
        match geometry {
            Geometry::Rotary => {
                Self { friction: "friction_n_m", drag: "drag_n_m_s_per_rad", torque: "load_n_m" }
            }
            Geometry::Linear => {
                Self { friction: "friction_n", drag: "drag_n_s_per_m", torque: "load_n" }
            }
        }
    }
}

impl Scales {
    fn machine(&self) -> MachineScales {
        MachineScales {
            torque: self.torque,
            drive: self.torque,
            speed: self.speed,
            travel: self.travel,
            motor_travel: self.travel,
            sample_s: self.sample_s,
        }
    }
}
