//! `[[effect]]` blocks: an effect with what is known of its numbers.

use std::collections::BTreeSet;

use toml::{Spanned, de::DeValue};

use super::{
    error::ModelFileError,
    reader::{Reader, line_of, string},
};
use crate::{
    effect::{Coordinate, Curve, CurveKind, Effect, EffectId, EffectParameter, Geometry, Role},
    valid_range::{RangeOf, ValidRange},
};

/// An effect as a model file holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectBlock {
    /// The effect.
    pub effect: Effect,
    /// The owner's name for it, where that differs from the catalogue.
    pub name: Option<String>,
    /// 95 % intervals of its numbers, by the key of the effect's parameter; of a key that comes
    /// twice the first is written.
    pub interval_95: Vec<(String, [f64; 2])>,
    /// Further statements of the file, in order: `status`, `alternatives`, `valid-range`,
    /// `evidence`, `faults`, `provenance`. All are kept and written back;
    /// [`valid_range`](Self::valid_range) alone is looked at.
    pub annotations: Vec<(String, Annotation)>,
}

/// A value that a model file carries along.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Annotation {
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
    /// Yes or no.
    Flag(bool),
    /// Several values.
    List(Vec<Self>),
    /// Values by name, in order.
    Table(Vec<(String, Self)>),
}

/// Keys of a block that are carried along.
const CARRIED: [&str; 6] =
    ["status", "alternatives", "valid-range", "evidence", "faults", "provenance"];
/// Keys of a block.
const KNOWN: &str = "id, name, port, parameters, curve, interval-95, status, alternatives, \
                     valid-range, evidence, faults or provenance";

impl From<Effect> for EffectBlock {
    fn from(effect: Effect) -> Self {
        Self { effect, name: None, interval_95: Vec::new(), annotations: Vec::new() }
    }
}

impl EffectBlock {
    /// Where the effect is known to hold: what `valid-range` says of `speed`, `position` and
    /// `load`.
    pub fn valid_range(&self) -> Option<ValidRange> {
        let (_, range) = self.annotations.iter().find(|(key, _)| key == "valid-range")?;
        let Annotation::Table(entries) = range else { return None };
        let of = |of: RangeOf| {
            let (_, pair) = entries.iter().find(|(key, _)| key == of.name())?;
            match pair {
                Annotation::List(pair) => match &pair[..] {
                    [Annotation::Number(low), Annotation::Number(high)] => Some([*low, *high]),
                    _ => None,
                },
                _ => None,
            }
        };
        let (speed, position) = (of(RangeOf::Speed), of(RangeOf::Position));
        Some(ValidRange { speed, position, load: of(RangeOf::Load) })
    }
}

/// A key as a model file writes it.
fn written(parameter: &EffectParameter, geometry: Geometry) -> String {
    format!("`{}`", parameter.key(geometry).replace('_', "-"))
}

fn is_size(effect: EffectId, geometry: Geometry, key: &str) -> bool {
    let name = key.replace('-', "_");
    let mut parameters = effect.info().parameters.iter();
    parameters.any(|p| p.role() == Role::Amplitude && p.key(geometry) == name)
}

/// The sizes of an effect, as an error names them.
pub(super) fn sizes(effect: EffectId, geometry: Geometry) -> String {
    let parameters = effect.info().parameters.iter();
    let sizes = parameters.filter(|parameter| parameter.role() == Role::Amplitude);
    sizes.map(|parameter| written(parameter, geometry)).collect::<Vec<_>>().join(" or ")
}

/// The effect's other numbers, which have defaults.
pub(super) fn shapes(effect: EffectId, geometry: Geometry) -> String {
    let parameters = effect.info().parameters.iter();
    let others = parameters.filter(|parameter| parameter.role() != Role::Amplitude);
    let told: Vec<_> = others.map(|parameter| written(parameter, geometry)).collect();
    if told.is_empty() { String::new() } else { format!(", and {} if need be", told.join(", ")) }
}

impl Reader<'_> {
    pub(super) fn effects(
        &self,
        value: &Spanned<DeValue<'_>>,
        geometry: Geometry,
    ) -> Result<Vec<EffectBlock>, ModelFileError> {
        let found = || value.get_ref().type_str().to_owned();
        let blocks = value
            .get_ref()
            .as_array()
            .ok_or_else(|| self.wrong("effect", "`[[effect]]` blocks", value, found()))?;
        blocks.iter().map(|block| self.effect(block, geometry)).collect()
    }

    fn effect(
        &self,
        value: &Spanned<DeValue<'_>>,
        geometry: Geometry,
    ) -> Result<EffectBlock, ModelFileError> {
        let table = self.table("effect", value)?;
        let part = |wanted: &str| {
            table.iter().find(|(key, _)| key.get_ref().as_ref() == wanted).map(|(_, value)| value)
        };
        let id = part("id").ok_or_else(|| ModelFileError::UnknownEffect {
            line: line_of(self.text, value),
            id: "without an id".to_owned(),
        })?;
        let symbol = string(self.text, "effect.id", id)?;
        let known = EffectId::find(symbol).ok_or_else(|| ModelFileError::UnknownEffect {
            line: line_of(self.text, value),
            id: symbol.to_owned(),
        })?;
        let takes_curve = known.info().takes_curve;
        let effect = match part("curve").filter(|_| takes_curve) {
            Some(curve) => Effect::with_curve(known, self.curve(curve)?, geometry),
            None => Effect::new(known, geometry),
        };
        let mut block = EffectBlock::from(effect);
        for (key, value) in table {
            match key.get_ref().as_ref() {
                "id" => {}
                "curve" if takes_curve => {}
                "name" => {
                    let name = string(self.text, "effect.name", value)?;
                    block.name = (name != known.info().name).then(|| name.to_owned());
                }
                "port" => {
                    let port = string(self.text, "effect.port", value)?;
                    if port != known.info().port.name() {
                        let expected = known.info().port.name();
                        return Err(self.wrong("effect.port", expected, value, port.to_owned()));
                    }
                }
                "parameters" => self.parameters(value, &mut block.effect)?,
                "interval-95" => block.interval_95 = self.intervals(value, &block.effect)?,
                "valid-range" => {
                    self.valid_range(value)?;
                    block.annotations.push(("valid-range".to_owned(), self.annotation(value)?));
                }
                carried if CARRIED.contains(&carried) => {
                    block.annotations.push((carried.to_owned(), self.annotation(value)?));
                }
                other => {
                    let found = format!("`{other}`");
                    return Err(self.wrong("effect", KNOWN, value, found));
                }
            }
        }
        let line = line_of(self.text, id);
        if takes_curve && block.effect.curve().is_none() {
            return Err(ModelFileError::Curveless { line });
        }
        // a size that is given as zero is meant
        let sized =
            part("parameters").and_then(|table| table.get_ref().as_table()).is_some_and(|table| {
                table.iter().any(|(key, _)| is_size(known, geometry, key.get_ref()))
            });
        if !sized && block.effect.is_off() {
            return Err(ModelFileError::Sizeless { line, effect: known, geometry });
        }
        Ok(block)
    }

    /// Refuses a range of something else, or one that is empty.
    fn valid_range(&self, value: &Spanned<DeValue<'_>>) -> Result<(), ModelFileError> {
        let key = "effect.valid-range";
        for (of, range) in self.table(key, value)? {
            let name = of.get_ref();
            if !RangeOf::ALL.iter().any(|known| known.name() == name.as_ref()) {
                let found = format!("`{name}`");
                return Err(self.wrong(key, "speed, position or load", range, found));
            }
            let [low, high] = self.pair(key, range)?;
            if low > high {
                let found = format!("{low} to {high}");
                return Err(self.wrong(key, "the least and the largest value", range, found));
            }
        }
        Ok(())
    }

    fn parameters(
        &self,
        value: &Spanned<DeValue<'_>>,
        effect: &mut Effect,
    ) -> Result<(), ModelFileError> {
        for (key, value) in self.table("effect.parameters", value)? {
            let name = key.get_ref().replace('-', "_");
            let number = self.number(&format!("effect.parameters.{}", key.get_ref()), value)?;
            effect.set(&name, number).map_err(|error| ModelFileError::Effect {
                line: line_of(self.text, value),
                error,
            })?;
        }
        Ok(())
    }

    fn intervals(
        &self,
        value: &Spanned<DeValue<'_>>,
        effect: &Effect,
    ) -> Result<Vec<(String, [f64; 2])>, ModelFileError> {
        let table = self.table("effect.interval-95", value)?;
        let one = |(key, value): (&Spanned<toml::de::DeString<'_>>, &Spanned<DeValue<'_>>)| {
            let name = key.get_ref().replace('-', "_");
            if effect.get(&name).is_none() {
                let effect = effect.id();
                let error = crate::EffectError::UnknownKey { effect, key: name };
                return Err(ModelFileError::Effect { line: line_of(self.text, key), error });
            }
            Ok((name, self.pair("effect.interval-95", value)?))
        };
        table.iter().map(one).collect()
    }

    fn curve(&self, value: &Spanned<DeValue<'_>>) -> Result<Curve, ModelFileError> {
        let table = self.table("effect.curve", value)?;
        let (mut over, mut kind) = (None, CurveKind::Torque);
        let mut points = Vec::new();
        for (key, value) in table {
            match key.get_ref().as_ref() {
                "over" => over = Some(self.choice("effect.curve.over", value, &Coordinate::ALL)?),
                "acts-as" => kind = self.choice("effect.curve.acts-as", value, &CurveKind::ALL)?,
                "points" => {
                    let found = || value.get_ref().type_str().to_owned();
                    let list = value.get_ref().as_array().ok_or_else(|| {
                        self.wrong("effect.curve.points", "a list of pairs", value, found())
                    })?;
                    for point in list {
                        points.push(self.pair("effect.curve.points", point)?);
                    }
                }
                other => {
                    let expected = "over, acts-as or points";
                    return Err(self.wrong("effect.curve", expected, value, other.to_owned()));
                }
            }
        }
        let over = over.ok_or_else(|| {
            let expected = "a table with `over`, the coordinate";
            self.wrong("effect.curve", expected, value, "one without it".to_owned())
        })?;
        Curve::new(over, kind, points).map_err(|error| {
            self.wrong("effect.curve.points", "points in order", value, error.to_string())
        })
    }

    pub(super) fn choice<T: Copy>(
        &self,
        key: &str,
        value: &Spanned<DeValue<'_>>,
        choices: &[(&'static str, T)],
    ) -> Result<T, ModelFileError> {
        let name = string(self.text, key, value)?;
        let known = choices.iter().find(|(known, _)| *known == name);
        let (_, choice) = known.ok_or_else(|| {
            let names: Vec<_> = choices.iter().map(|(name, _)| format!("`{name}`")).collect();
            let found = format!("`{name}`, which is none of {}", names.join(", "));
            self.wrong(key, "a known name", value, found)
        })?;
        Ok(*choice)
    }

    fn pair(&self, key: &str, value: &Spanned<DeValue<'_>>) -> Result<[f64; 2], ModelFileError> {
        let found = || value.get_ref().type_str().to_owned();
        match value.get_ref().as_array().map(AsRef::as_ref) {
            Some([a, b]) => Ok([self.number(key, a)?, self.number(key, b)?]),
            _ => Err(self.wrong(key, "a list of two numbers", value, found())),
        }
    }

    fn annotation(&self, value: &Spanned<DeValue<'_>>) -> Result<Annotation, ModelFileError> {
        Ok(match value.get_ref() {
            DeValue::String(text) => Annotation::Text(text.to_string()),
            DeValue::Boolean(flag) => Annotation::Flag(*flag),
            DeValue::Datetime(date) => Annotation::Text(date.to_string()),
            DeValue::Array(list) => Annotation::List(
                list.iter().map(|item| self.annotation(item)).collect::<Result<_, _>>()?,
            ),
            DeValue::Table(table) => {
                let mut entries = Vec::new();
                for (key, value) in table {
                    entries.push((key.get_ref().to_string(), self.annotation(value)?));
                }
                Annotation::Table(entries)
            }
            DeValue::Integer(_) | DeValue::Float(_) => {
                Annotation::Number(self.number("effect", value)?)
            }
        })
    }
}

/// Writes blocks.
pub(super) fn write(blocks: &[EffectBlock], lines: &mut Vec<String>) {
    for block in blocks {
        let (effect, info) = (&block.effect, block.effect.id().info());
        let geometry = effect.geometry();
        lines.push("\n[[effect]]".to_owned());
        lines.push(format!("id = \"{}\"", info.symbol));
        let name = block.name.as_deref().unwrap_or(info.name);
        lines.push(format!("name = {}", toml::Value::from(name)));
        lines.push(format!("port = \"{}\"", info.port.name()));
        let number = |(parameter, value): (&crate::EffectParameter, &f64)| {
            format!("{} = {value:?}", kebab(parameter.key(geometry)))
        };
        let numbers: Vec<_> = info.parameters.iter().zip(effect.values()).map(number).collect();
        lines.push(format!("parameters = {{ {} }}", numbers.join(", ")));
        if let Some(curve) = effect.curve() {
            lines.push(curve_line(curve));
        }
        if !block.interval_95.is_empty() {
            let interval =
                |(key, [a, b]): &(String, [f64; 2])| format!("{} = [{a:?}, {b:?}]", kebab(key));
            let mut written = BTreeSet::new();
            let first = block.interval_95.iter().filter(|(key, _)| written.insert(key.as_str()));
            let intervals: Vec<_> = first.map(interval).collect();
            lines.push(format!("interval-95 = {{ {} }}", intervals.join(", ")));
        }
        for (key, annotation) in &block.annotations {
            lines.push(format!("{key} = {}", annotation.written()));
        }
    }
}

fn curve_line(curve: &Curve) -> String {
    let name = |over| Coordinate::ALL.iter().find(|(_, c)| *c == over).map_or("", |(n, _)| n);
    let kind = CurveKind::ALL.iter().find(|(_, k)| *k == curve.kind()).map_or("", |(n, _)| n);
    let points: Vec<_> = curve.points().iter().map(|[x, y]| format!("[{x:?}, {y:?}]")).collect();
    format!(
        "curve = {{ over = \"{}\", acts-as = \"{kind}\", points = [{}] }}",
        name(curve.over()),
        points.join(", ")
    )
}

fn kebab(key: &str) -> String {
    key.replace('_', "-")
}

impl Annotation {
    fn written(&self) -> String {
        match self {
            Self::Number(number) => format!("{number:?}"),
            Self::Text(text) => toml::Value::from(text.as_str()).to_string(),
            Self::Flag(flag) => flag.to_string(),
            Self::List(items) => {
                let items: Vec<_> = items.iter().map(Self::written).collect();
                format!("[{}]", items.join(", "))
            }
            Self::Table(entries) => {
                let entry = |(key, value): &(String, Self)| {
                    format!("{} = {}", toml::Value::from(key.as_str()), value.written())
                };
                let entries: Vec<_> = entries.iter().map(entry).collect();
                format!("{{ {} }}", entries.join(", "))
            }
        }
    }
}
