//! Model files: an actuator as TOML text.
//!
//! ```toml
//! base = "ema-48"             # a preset; without it every parameter must be given
//! name = "left aileron"
//! faults = ["k1", "k2"]       # what this machine can have; all seven when left out
//!
//! [motor]
//! resistance-ohm = 1.1        # keys carry the unit; the rest comes from the base
//!
//! [tolerance.motor]           # relative half-widths of uncertain numbers
//! resistance-ohm = 0.05
//! inertia-kg-m2 = { sd = 0.03, level = "unit" }
//!
//! [tolerance.sensors]         # one table for each level
//! phase-offset-a = [{ sd = 0.02, level = "unit" }, { sd = 0.01, level = "session" }]
//! ```
//!
//! A tolerance is a half-width of the units, or a table with one of `sd` (normal) and `half-width`
//! (uniform) and a `level`: `type`, `unit` (where it is left out), `session` or `recording`.
//! [`UncertainNumber`] has the keys.
//!
//! What follows the temperature of the winding, and with which coefficient, 1/K, is a block of its
//! own; a coefficient may have a standard deviation between units:
//!
//! ```toml
//! [tolerance.test]
//! winding-temperature-k = { sd = 15.0, level = "session" }
//!
//! [temperature]
//! nominal-k = 293.15
//! back-emf-per-k = { value = -0.0011, sd = 0.0002 }
//! resistance-per-k = 0.0039
//! ```
//!
//! Shorted turns of k3 to k5 are gone unless a block closes them over a resistance, so that a current
//! circulates in them ([`ShortedTurns`](crate::ShortedTurns)):
//!
//! ```toml
//! [short-circuit]
//! resistance-ohm = 0.05       # of the fault; 0 is a bolted short circuit
//! leakage-ratio = 0.5         # share of leakage in a phase's inductance; 0.5 when left out
//! ```
//!
//! Levels of k1 to k6 from which the owner wants the machine watched, and acted on:
//!
//! ```toml
//! [action-levels]
//! k1 = { watch = 0.05, act = 0.1 }
//! ```
//!
//! A servo axis says so, and gives its own blocks ([`parse_machine`]):
//!
//! ```toml
//! kind = "servo-axis"
//! geometry = "linear"         # or "rotary"; the units of the keys follow
//!
//! [axis]
//! mass-kg = 95.1
//! viscous-n-s-per-m = 203.5
//! kinetic-friction-n = 20.4
//!
//! [drive]
//! kind = "amplifier"          # or "current", "winding"
//! force-constant-n-per-v = 35.15
//!
//! [controller]
//! sample-hz = 1000.0
//! position-gain-per-s = 160.18
//! speed-gain-v-s-per-m = 243.45
//! output-limit-v = 10.0
//! ```
//!
//! Effects follow in blocks, one each; taking them away gives back the base model:
//!
//! ```toml
//! [[effect]]
//! id = "E11"
//! parameters = { cogging-sin-n-m = 0.004, order = 24.0 }
//! interval-95 = { cogging-sin-n-m = [0.0038, 0.0042] }
//! ```
//!
//! Keys that are not known are refused, so that a slip of the pen changes nothing silently. The
//! text is all there is here; reading the disk is the caller's.

mod action_levels_block;
mod axis;
mod effect_block;
mod error;
mod machine;
mod reader;
mod short_circuit_block;
mod temperature_block;
mod tolerance_block;

pub use crate::presets::PRESETS;
pub use action_levels_block::{ActionLevel, StatedLevels};
pub use axis::{AxisModel, AxisTolerance};
pub use effect_block::{Annotation, EffectBlock};
pub use error::ModelFileError;
pub use machine::{FaultRefused, MachineModel, parse_machine, parse_machine_onto};

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use crate::{
    back_emf::BackEmfTable,
    effect::{Effect, Geometry},
    fault::FaultId,
    parameter::{Parameter, within},
    params::{Actuator, BackEmfShape, Commutation, PositionSensor},
    presets,
    temperature::TemperatureLaw,
    tolerance::{Tolerance, UncertainNumber},
};
use reader::{Reader, closest_of, document, entry, line_of, string};
use tolerance_block::{Line, Scatter};

/// Machine that a model file describes.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// The owner's name for the machine.
    pub name: Option<String>,
    /// Parameters of the machine.
    pub actuator: Actuator,
    /// The faults that it can have.
    pub faults: Vec<FaultId>,
    /// Numbers with a tolerance, and how far they scatter at each level.
    pub tolerance: Vec<Tolerance>,
    /// How numbers follow the temperature of the winding, where that is known.
    pub temperature: Option<TemperatureLaw>,
    /// Levels for decisions that its owner states.
    pub action_levels: StatedLevels,
    /// Effects besides the base model.
    pub effects: Vec<EffectBlock>,
}

impl Model {
    /// The effects that are switched on, for
    /// [`LowFidelity::with_effects`](crate::LowFidelity::with_effects).
    pub fn switched_on(&self) -> Vec<Effect> {
        self.effects.iter().map(|block| block.effect.clone()).collect()
    }
}

/// A parameter that is one of several names.
struct Choice {
    key: &'static str,
    names: &'static [&'static str],
    /// The names as a message lists them.
    expected: &'static str,
    /// Which of them holds where a file without a base leaves the key out.
    default: Option<usize>,
    get: fn(&Actuator) -> usize,
    set: fn(&mut Actuator, usize),
}

const SHAPES: [BackEmfShape; 2] = [BackEmfShape::Trapezoid, BackEmfShape::Sinusoid];
const COMMUTATIONS: [Commutation; 2] = [Commutation::SixStep, Commutation::FieldOriented];
const SENSORS: [PositionSensor; 2] = [PositionSensor::Surface, PositionSensor::MotorShaft];

/// The choice that may also be a table.
const SHAPE_KEY: &str = "motor.back-emf-shape";

/// Place of a value among those of a choice.
fn place<T: PartialEq>(values: &[T], value: &T) -> usize {
    values.iter().position(|known| known == value).unwrap_or(0)
}

/// All choices.
const CHOICES: [Choice; 3] = [
    Choice {
        key: SHAPE_KEY,
        names: &["trapezoid", "sinusoid"],
        expected: "\"trapezoid\" or \"sinusoid\"",
        default: None,
        // a table is written apart
        get: |actuator| place(&SHAPES, &actuator.motor.back_emf_shape),
        set: |actuator, n| actuator.motor.back_emf_shape = SHAPES[n],
    },
    Choice {
        key: "inverter.commutation",
        names: &["six-step", "field-oriented"],
        expected: "\"six-step\" or \"field-oriented\"",
        default: Some(0),
        get: |actuator| place(&COMMUTATIONS, &actuator.inverter.commutation),
        set: |actuator, n| actuator.inverter.commutation = COMMUTATIONS[n],
    },
    Choice {
        key: "controller.position-sensor",
        names: &["surface", "motor-shaft"],
        expected: "\"surface\" or \"motor-shaft\"",
        default: Some(0),
        get: |actuator| place(&SENSORS, &actuator.controller.position_sensor),
        set: |actuator, n| actuator.controller.position_sensor = SENSORS[n],
    },
];

impl From<Actuator> for Model {
    fn from(actuator: Actuator) -> Self {
        Self {
            name: None,
            actuator,
            faults: FaultId::ALL.to_vec(),
            tolerance: Vec::new(),
            temperature: None,
            action_levels: [None; 6],
            effects: Vec::new(),
        }
    }
}

/// Reads a model.
///
/// # Errors
///
/// [`ModelFileError`] naming line and key.
///
/// # Examples
///
/// ```
/// use ema_sim::{model_file, presets::EMA_48};
///
/// let model = model_file::parse("base = \"ema-48\"\n[motor]\nresistance-ohm = 1.1\n")?;
/// assert_eq!(model.actuator.motor.resistance_ohm, 1.1);
/// assert_eq!(model.actuator.transmission, EMA_48.transmission);
/// # Ok::<_, model_file::ModelFileError>(())
/// ```
pub fn parse(text: &str) -> Result<Model, ModelFileError> {
    let table = document(text)?;
    let base = match entry(&table, "base") {
        None => None,
        Some(value) => {
            let name = string(text, "base", value)?;
            let preset = PRESETS.iter().find(|(known, _)| *known == name);
            let (_, actuator) = preset.ok_or_else(|| ModelFileError::UnknownBase {
                line: line_of(text, value),
                base: name.to_owned(),
            })?;
            Some(Model::from(*actuator))
        }
    };
    Reader { text, complete: base.is_some() }.model(&table, base)
}

/// Reads a model whose `base` is another model; what the key says is not looked at.
///
/// # Errors
///
/// [`ModelFileError`] naming line and key.
pub fn parse_onto(text: &str, base: &Model) -> Result<Model, ModelFileError> {
    Reader { text, complete: true }.model(&document(text)?, Some(base.clone()))
}

/// The `base` that a text names, where it names one.
///
/// # Errors
///
/// [`ModelFileError`] when the text is not TOML or the base not a text.
pub fn base_of(text: &str) -> Result<Option<String>, ModelFileError> {
    let table = document(text)?;
    entry(&table, "base").map(|value| string(text, "base", value).map(str::to_owned)).transpose()
}

/// Writes a model, complete and without a base; [`parse`] gives it back bit for bit.
///
/// What is at the default of a key that may be left out is not written.
///
/// # Examples
///
/// ```
/// use ema_sim::{model_file, presets::EMA_48};
///
/// let text = model_file::write(&EMA_48.into());
/// assert_eq!(model_file::parse(&text)?.actuator, EMA_48);
/// # Ok::<_, model_file::ModelFileError>(())
/// ```
pub fn write(model: &Model) -> String {
    let mut lines = Vec::new();
    lines.extend(model.name.as_deref().map(name_line));
    if model.faults != FaultId::ALL {
        lines.push(faults_line(&model.faults));
    }
    let mut open_block = "";
    for parameter in Parameter::ALL {
        let (block, key) = split(parameter.key());
        if block != open_block {
            open_block = block;
            lines.push(format!("\n[{block}]"));
            lines.extend(choice_lines(block, &model.actuator));
        }
        let value = parameter.get(&model.actuator);
        if parameter.default_value() != Some(value) {
            lines.push(format!("{key} = {value:?}"));
        }
    }
    let mut tolerance = model.tolerance.clone();
    tolerance.sort_by_key(Tolerance::key);
    let written = tolerance.iter().map(|Tolerance { number, spread, level }| Line {
        path: number.key(),
        scatter: Scatter { spread: *spread, level: *level },
    });
    tolerance_block::write(&written.collect::<Vec<_>>(), &mut lines);
    temperature_block::write(model.temperature.as_ref(), &mut lines);
    short_circuit_block::write(model.actuator.motor.shorted_turns, &mut lines);
    action_levels_block::write(&model.action_levels, &mut lines);
    effect_block::write(&model.effects, &mut lines);
    lines.join("\n") + "\n"
}

/// The choices of a block that are not at their defaults.
fn choice_lines(block: &str, actuator: &Actuator) -> Vec<String> {
    let told = CHOICES.iter().filter(|choice| {
        split(choice.key).0 == block && choice.default != Some((choice.get)(actuator))
    });
    told.map(|choice| {
        if choice.key == SHAPE_KEY
            && let BackEmfShape::Tabulated(table) = &actuator.motor.back_emf_shape
        {
            let samples: Vec<_> = table.samples().iter().map(|x| format!("{x:?}")).collect();
            return format!("{} = [{}]", split(SHAPE_KEY).1, samples.join(", "));
        }
        format!("{} = \"{}\"", split(choice.key).1, choice.names[(choice.get)(actuator)])
    })
    .collect()
}

fn name_line(name: &str) -> String {
    format!("name = {}", toml::Value::from(name))
}

fn faults_line(faults: &[FaultId]) -> String {
    let names: Vec<_> = faults.iter().map(|fault| format!("\"{}\"", fault.symbol())).collect();
    format!("faults = [{}]", names.join(", "))
}

/// Block and field of a key.
fn split(key: &'static str) -> (&'static str, &'static str) {
    key.split_once('.').unwrap_or(("", key))
}

/// Keys at the top besides the blocks.
const TOP: [&str; 8] =
    ["base", "kind", "name", "faults", "temperature", "short-circuit", "action-levels", "effect"];

impl Reader<'_> {
    fn model(&self, table: &DeTable<'_>, base: Option<Model>) -> Result<Model, ModelFileError> {
        let mut model = base.unwrap_or_else(|| presets::EMA_48.into());
        let mut given = Vec::new();
        for (key, value) in table {
            match key.get_ref().as_ref() {
                "base" => {}
                "name" => model.name = Some(string(self.text, "name", value)?.to_owned()),
                "faults" => model.faults = self.faults(value)?,
                "kind" => {
                    let found = string(self.text, "kind", value)?;
                    if found != "actuator" {
                        let line = line_of(self.text, value);
                        return Err(ModelFileError::OtherMachine { line, found: found.to_owned() });
                    }
                }
                "effect" => model.effects.extend(self.effects(value, Geometry::Rotary)?),
                "tolerance" => {
                    for (block, inner) in self.table("tolerance", value)? {
                        self.tolerances(block.get_ref(), inner, &mut model.tolerance)?;
                    }
                }
                "temperature" => {
                    model.temperature = Some(self.temperature(value, model.temperature)?);
                }
                "short-circuit" => {
                    let turns = &mut model.actuator.motor.shorted_turns;
                    *turns = self.short_circuit(value, *turns)?;
                }
                "action-levels" => {
                    model.action_levels = self.action_levels(value, model.action_levels)?;
                }
                _ => self.block(key, value, &mut model.actuator, &mut given)?,
            }
        }
        self.check_temperature(table, &model)?;
        let needed = Parameter::ALL.iter().filter(|parameter| parameter.default_value().is_none());
        let chosen = CHOICES.iter().filter(|choice| choice.default.is_none());
        for key in needed.map(Parameter::key).chain(chosen.map(|choice| choice.key)) {
            if !self.complete && !given.contains(&key) {
                return Err(ModelFileError::Missing { key });
            }
        }
        model.actuator.check()?;
        Ok(model)
    }

    fn block(
        &self,
        at: &Spanned<toml::de::DeString<'_>>,
        value: &Spanned<DeValue<'_>>,
        actuator: &mut Actuator,
        given: &mut Vec<&'static str>,
    ) -> Result<(), ModelFileError> {
        let block = at.get_ref().as_ref();
        if !Parameter::ALL.iter().any(|parameter| split(parameter.key()).0 == block) {
            return Err(self.unknown(block, at));
        }
        for (key, value) in self.table(block, value)? {
            let path = format!("{block}.{}", key.get_ref());
            if path == SHAPE_KEY
                && let Some(list) = value.get_ref().as_array()
            {
                let samples = list.iter().map(|item| self.number(&path, item));
                let samples = samples.collect::<Result<Vec<_>, _>>()?;
                actuator.motor.back_emf_shape =
                    BackEmfShape::Tabulated(BackEmfTable::new(&samples)?);
                given.push(SHAPE_KEY);
                continue;
            }
            if let Some(choice) = CHOICES.iter().find(|choice| choice.key == path) {
                let name = string(self.text, &path, value)?;
                let known = choice.names.iter().position(|known| *known == name);
                let n = known
                    .ok_or_else(|| self.wrong(&path, choice.expected, value, name.to_owned()))?;
                (choice.set)(actuator, n);
                given.push(choice.key);
                continue;
            }
            let parameter = Parameter::find(&path).ok_or_else(|| self.unknown(&path, key))?;
            let number = self.number(&path, value)?;
            if parameter.key() == "motor.pole-pairs" {
                if libm::floor(number) != number {
                    return Err(self.wrong(&path, "a whole number", value, number.to_string()));
                }
                let (least, most) = parameter.bounds();
                within(parameter.key(), number, least, most)?;
            }
            parameter.set(actuator, number);
            given.push(parameter.key());
        }
        Ok(())
    }

    fn tolerances(
        &self,
        block: &str,
        value: &Spanned<DeValue<'_>>,
        tolerances: &mut Vec<Tolerance>,
    ) -> Result<(), ModelFileError> {
        for (key, value) in self.table("tolerance", value)? {
            let path = format!("{block}.{}", key.get_ref());
            let number =
                UncertainNumber::find(&path).ok_or_else(|| self.unknown_number(&path, key))?;
            let scatters = self.scatters(&path, value, number.is_relative())?;
            tolerances.retain(|earlier| earlier.number != number);
            let read = scatters.into_iter();
            tolerances.extend(read.map(|Scatter { spread, level }| Tolerance {
                number,
                spread,
                level,
            }));
        }
        Ok(())
    }

    fn faults(&self, value: &Spanned<DeValue<'_>>) -> Result<Vec<FaultId>, ModelFileError> {
        let expected = "a list of \"k1\" to \"k7\"";
        let list = value.get_ref().as_array().ok_or_else(|| {
            self.wrong("faults", expected, value, value.get_ref().type_str().to_owned())
        })?;
        let fault = |item: &Spanned<DeValue<'_>>| {
            let symbol = string(self.text, "faults", item)?;
            let known = FaultId::ALL.into_iter().find(|fault| fault.symbol() == symbol);
            known.ok_or_else(|| self.wrong("faults", expected, item, format!("\"{symbol}\"")))
        };
        list.iter().map(fault).collect()
    }

    /// Refuses a temperature that scatters where no law says what follows it.
    fn check_temperature(&self, table: &DeTable<'_>, model: &Model) -> Result<(), ModelFileError> {
        let scatters =
            |tolerance: &Tolerance| tolerance.number == UncertainNumber::WindingTemperature;
        if model.temperature.is_none() && model.tolerance.iter().any(scatters) {
            let at = table.iter().find(|(key, _)| key.get_ref() == "tolerance");
            return Err(match at {
                Some((_, value)) => self.wrong(
                    "tolerance.test.winding-temperature-k",
                    "a block `[temperature]` that says what follows it",
                    value,
                    "given without one".to_owned(),
                ),
                None => ModelFileError::Missing { key: "temperature.nominal-k" },
            });
        }
        Ok(())
    }

    fn unknown<T>(&self, key: &str, at: &Spanned<T>) -> ModelFileError {
        ModelFileError::UnknownKey {
            line: line_of(self.text, at),
            key: key.to_owned(),
            closest: closest(key),
        }
    }
}

/// The known key with the fewest edits, when they are few.
fn closest(key: &str) -> Option<&'static str> {
    let choices = CHOICES.iter().map(|choice| choice.key);
    let known = Parameter::ALL.iter().map(Parameter::key).chain(choices).chain(TOP);
    let blocks = Parameter::ALL.iter().map(|parameter| split(parameter.key()).0);
    closest_of(key, known.chain(blocks))
}
