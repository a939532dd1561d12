//! Units that a file states for its columns, and what makes SI of them.

use std::f64::consts::{PI, TAU};

use super::{
    RecordError,
    column_map::{Entry, Target},
};

/// Units by the SI unit that they are of: how programs write them, without blanks, and their size.
const UNITS: &[(&str, &[(&str, f64)])] = &[
    ("A", &[("A", 1.0), ("amp", 1.0), ("amps", 1.0), ("ampere", 1.0), ("amperes", 1.0)]),
    ("A", &[("mA", 1e-3), ("milliampere", 1e-3), ("uA", 1e-6), ("µA", 1e-6), ("kA", 1e3)]),
    ("V", &[("V", 1.0), ("volt", 1.0), ("volts", 1.0), ("mV", 1e-3), ("kV", 1e3)]),
    ("s", &[("s", 1.0), ("sec", 1.0), ("second", 1.0), ("seconds", 1.0), ("min", 60.0)]),
    ("s", &[("ms", 1e-3), ("msec", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("ns", 1e-9)]),
    ("rad", &[("rad", 1.0), ("radian", 1.0), ("radians", 1.0), ("mrad", 1e-3)]),
    ("rad", &[("deg", PI / 180.0), ("degree", PI / 180.0), ("degrees", PI / 180.0)]),
    ("rad", &[("°", PI / 180.0), ("rev", TAU), ("turn", TAU), ("turns", TAU)]),
    ("rad/s", &[("rad/s", 1.0), ("deg/s", PI / 180.0), ("°/s", PI / 180.0), ("rps", TAU)]),
    ("rad/s", &[("rpm", TAU / 60.0), ("1/min", TAU / 60.0), ("rev/min", TAU / 60.0)]),
    ("m", &[("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("µm", 1e-6), ("cm", 1e-2)]),
    ("m/s", &[("m/s", 1.0), ("mm/s", 1e-3), ("cm/s", 1e-2)]),
    ("N", &[("N", 1.0), ("kN", 1e3), ("mN", 1e-3), ("newton", 1.0)]),
    ("N·m", &[("N·m", 1.0), ("Nm", 1.0), ("N*m", 1.0), ("N.m", 1.0), ("N-m", 1.0)]),
    ("N·m", &[("mNm", 1e-3), ("mN·m", 1e-3), ("kNm", 1e3), ("Ncm", 1e-2)]),
    ("K", &[("K", 1.0), ("kelvin", 1.0)]),
];

/// SI unit of what a column is taken for.
pub(super) fn si_unit(target: Target) -> &'static str {
    match target {
        Target::Time => "s",
        Target::Channel(name) => name.unit(),
    }
}

/// Names of the degree Celsius, the one unit that has its zero elsewhere.
const CELSIUS: [&str; 5] = ["°C", "degC", "℃", "C", "Celsius"];
/// Zero of the Celsius scale, K.
const ZERO_CELSIUS_K: f64 = 273.15;

/// Scale that makes SI of the numbers of a column: `factor·number + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub(super) factor: f64,
    /// In the SI unit.
    pub(super) offset: f64,
}

impl Scale {
    /// Numbers as they are.
    pub(super) const ONE: Self = Self::by(1.0);

    pub(super) const fn by(factor: f64) -> Self {
        Self { factor, offset: 0.0 }
    }

    pub(super) fn of(self, number: f64) -> f64 {
        let product = number * self.factor;
        // a sum with zero would lose the sign of a zero
        if self.offset == 0.0 { product } else { product + self.offset }
    }

    /// One scale, and another after it.
    pub(super) fn then(self, next: Self) -> Self {
        Self { factor: self.factor * next.factor, offset: next.of(self.offset) }
    }
}

/// Scale from the stated unit to this SI unit; `None` where the unit is not known as one of that
/// kind. A pure number takes any.
pub(super) fn scale(stated: &str, si: &str) -> Option<Scale> {
    if si == "1" {
        return Some(Scale::ONE);
    }
    let mut plain: String = stated.chars().filter(|letter| !letter.is_whitespace()).collect();
    plain = plain.replace('\u{3bc}', "µ");
    let plain = plain.trim_matches(['[', ']', '(', ')']);
    let alike = UNITS.iter().filter(|(of, _)| *of == si).flat_map(|(_, names)| names.iter());
    let word = |name: &str| name.chars().count() > 2;
    // `mA` and `MA` differ in more than style, words do not
    let same = |name: &str| name == plain || word(name) && name.eq_ignore_ascii_case(plain);
    if si == "K" && CELSIUS.iter().any(|name| same(name)) {
        return Some(Scale { factor: 1.0, offset: ZERO_CELSIUS_K });
    }
    alike.clone().find(|(name, _)| same(name)).map(|(_, factor)| Scale::by(*factor))
}

/// Tells whether a text is a unit of some kind.
pub(super) fn is_known(stated: &str) -> bool {
    UNITS.iter().any(|(si, _)| scale(stated, si).is_some())
}

/// Scale that makes SI of a column, negative for one that a map subtracts, and the notice of a unit that is not the SI unit or whose scale
/// a map replaces.
///
/// # Errors
/// [`RecordError::UnitUnknown`] for a unit that is not known as one of the channel, without a factor
/// in the map.
pub(super) fn stated_scale(
    column: &str,
    unit: Option<&str>,
    target: Target,
    mapped: Option<&Entry>,
) -> Result<(Scale, Option<StatedUnit>), RecordError> {
    let sign = Scale::by(if mapped.is_some_and(|entry| entry.is_subtracted) { -1.0 } else { 1.0 });
    let mapped = mapped.and_then(|entry| entry.scale);
    let Some(unit) = unit.map(str::trim).filter(|unit| !unit.is_empty() && *unit != "-") else {
        return Ok((mapped.unwrap_or(Scale::ONE).then(sign), None));
    };
    let expected = si_unit(target);
    let own = scale(unit, expected);
    let scale = mapped.or(own).ok_or_else(|| RecordError::UnitUnknown {
        column: column.to_owned(),
        unit: unit.to_owned(),
        channel: target.column(),
        expected,
    })?;
    let is_told = scale != Scale::ONE || own != Some(scale);
    let (column, unit, is_mapped) = (column.to_owned(), unit.to_owned(), mapped.is_some());
    let Scale { factor, offset } = scale;
    let stated = StatedUnit { column, unit, factor, offset, is_mapped };
    Ok((scale.then(sign), is_told.then_some(stated)))
}

/// A column whose file states a unit that is not the SI unit of its channel.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedUnit {
    /// The column.
    pub column: String,
    /// The unit, as the file states it.
    pub unit: String,
    /// Factor that the column was multiplied by.
    pub factor: f64,
    /// Number that was added to the product, in the SI unit.
    pub offset: f64,
    /// True where a [`ColumnMap`](super::ColumnMap) gave these; it goes before the unit.
    pub is_mapped: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_known_by_their_kind() {
        for (stated, si, expected) in [
            ("A", "A", Some(1.0)),
            ("[mA]", "A", Some(1e-3)),
            ("m A", "A", Some(1e-3)),
            ("MA", "A", None),
            ("Ampere", "A", Some(1.0)),
            ("\u{3bc}s", "s", Some(1e-6)),
            ("ms", "s", Some(1e-3)),
            ("V", "A", None),
            ("deg", "rad", Some(PI / 180.0)),
            ("RPM", "rad/s", Some(TAU / 60.0)),
            ("Nm", "N·m", Some(1.0)),
            ("counts", "A", None),
            ("counts", "1", Some(1.0)),
        ] {
            assert_eq!(scale(stated, si), expected.map(Scale::by), "{stated} as {si}");
        }
        for celsius in ["°C", "[degC]", "C"] {
            assert_eq!(scale(celsius, "K").map(|scale| scale.of(20.0)), Some(293.15), "{celsius}");
        }
        assert_eq!(scale("C", "A"), None);
    }
}
