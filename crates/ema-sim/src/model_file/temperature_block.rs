//! The law of temperature in model files.

use toml::{Spanned, de::DeValue};

use super::{
    error::ModelFileError,
    reader::{Reader, closest_of, line_of},
};
use crate::temperature::{TemperatureLaw, ThermalCoefficient, ThermalNumber};

const NOMINAL: &str = "nominal-k";
/// Temperatures that a winding may have, K.
const RANGE_K: [f64; 2] = [150.0, 600.0];
/// Largest coefficient, 1/K.
const MOST_PER_K: f64 = 0.1;

impl Reader<'_> {
    /// The law in a block; what it leaves out is the base's.
    pub(super) fn temperature(
        &self,
        value: &Spanned<DeValue<'_>>,
        base: Option<TemperatureLaw>,
    ) -> Result<TemperatureLaw, ModelFileError> {
        let mut nominal_k = base.map(|law| law.nominal_k);
        let mut coefficients = base.map(|law| law.coefficients).unwrap_or_default();
        for (key, value) in self.table("temperature", value)? {
            let name = key.get_ref().as_ref();
            let path = format!("temperature.{name}");
            let number = ThermalNumber::ALL.into_iter().find(|number| number.key() == name);
            match number {
                Some(number) => {
                    coefficients[number as usize] = self.coefficient(&path, value)?;
                }
                None if name == NOMINAL => {
                    nominal_k = Some(self.within(&path, value, RANGE_K, "150 to 600 K")?);
                }
                None => {
                    let known = ThermalNumber::ALL.map(ThermalNumber::key).into_iter();
                    let closest = closest_of(name, known.chain([NOMINAL]));
                    let line = line_of(self.text, key);
                    return Err(ModelFileError::UnknownKey { line, key: path, closest });
                }
            }
        }
        let nominal_k =
            nominal_k.ok_or(ModelFileError::Missing { key: "temperature.nominal-k" })?;
        Ok(TemperatureLaw { nominal_k, coefficients })
    }

    /// A number, or a table of `value` and `sd`.
    fn coefficient(
        &self,
        path: &str,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<ThermalCoefficient, ModelFileError> {
        let bounds = |least| [least, MOST_PER_K];
        let size = |path: &str, value: &Spanned<DeValue<'_>>, least| {
            self.within(path, value, bounds(least), "a share per kelvin of at most 0.1")
        };
        let DeValue::Table(table) = value.get_ref() else {
            return Ok(ThermalCoefficient {
                per_k: size(path, value, -MOST_PER_K)?,
                std_per_k: 0.0,
            });
        };
        let (mut per_k, mut std_per_k) = (None, 0.0);
        for (key, value) in table {
            let inner = format!("{path}.{}", key.get_ref());
            match key.get_ref().as_ref() {
                "value" => per_k = Some(size(&inner, value, -MOST_PER_K)?),
                "sd" => std_per_k = size(&inner, value, 0.0)?,
                name => {
                    let closest = closest_of(name, ["value", "sd"].into_iter());
                    let line = line_of(self.text, key);
                    return Err(ModelFileError::UnknownKey { line, key: inner, closest });
                }
            }
        }
        let missing = || self.wrong(path, "a table with `value`", value, "without it".to_owned());
        Ok(ThermalCoefficient { per_k: per_k.ok_or_else(missing)?, std_per_k })
    }

    fn within(
        &self,
        path: &str,
        value: &Spanned<DeValue<'_>>,
        [least, most]: [f64; 2],
        expected: &'static str,
    ) -> Result<f64, ModelFileError> {
        let number = self.number(path, value)?;
        if (least..=most).contains(&number) {
            Ok(number)
        } else {
            Err(self.wrong(path, expected, value, number.to_string()))
        }
    }
}

/// Adds the block of a law.
pub(super) fn write(law: Option<&TemperatureLaw>, lines: &mut Vec<String>) {
    let Some(law) = law else { return };
    lines.push("\n[temperature]".to_owned());
    lines.push(format!("{NOMINAL} = {:?}", law.nominal_k));
    for number in ThermalNumber::ALL {
        let ThermalCoefficient { per_k, std_per_k } = law.coefficient(number);
        let key = number.key();
        if std_per_k > 0.0 {
            lines.push(format!("{key} = {{ value = {per_k:?}, sd = {std_per_k:?} }}"));
        } else if per_k != 0.0 {
            lines.push(format!("{key} = {per_k:?}"));
        }
    }
}
