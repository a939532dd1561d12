//! Monotone transformations of a scalar output.

use crate::error::SettingError;

/// An increasing map of an output, under which a Gaussian process may describe it better.
///
/// ```text
/// u = (y − c)/m
/// z = (u^λ − 1)/λ,   λ ≠ 0          z = ln u,   λ = 0
/// ln dz/dy = (λ − 1)·ln u − ln m
/// ```
///
/// `λ = 1` is the identity up to a shift and a unit, `λ = 0` the logarithm.
///
/// # Source
/// Box and Cox, Journal of the Royal Statistical Society B 26 (1964) 211, equation 4.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Transformation {
    /// The exponent `λ`.
    pub power: f64,
    /// The origin `c`, below every output.
    pub origin: f64,
    /// The unit `m`.
    pub unit: f64,
}

impl Transformation {
    /// No transformation.
    pub const IDENTITY: Self = Self { power: 1.0, origin: -1.0, unit: 1.0 };

    /// A transformation of outputs above `origin`.
    ///
    /// # Errors
    /// [`SettingError::OutOfRange`] when a number is not finite or the unit is not positive.
    pub fn new(power: f64, origin: f64, unit: f64) -> Result<Self, SettingError> {
        let rules = [
            ("power", power, power.is_finite(), "finite"),
            ("origin", origin, origin.is_finite(), "finite"),
            ("unit", unit, unit.is_finite() && unit > 0.0, "positive and finite"),
        ];
        match rules.into_iter().find(|(_, _, holds, _)| !holds) {
            Some((name, value, _, needs)) => Err(SettingError::OutOfRange { name, value, needs }),
            None => Ok(Self { power, origin, unit }),
        }
    }

    /// The transformed output; minus infinity or NaN at or below the origin, unless this is the
    /// identity.
    #[must_use]
    pub fn of(&self, output: f64) -> f64 {
        if self.power == 1.0 {
            return (output - self.origin) / self.unit - 1.0;
        }
        let ln = libm::log((output - self.origin) / self.unit);
        if self.power == 0.0 { ln } else { libm::expm1(self.power * ln) / self.power }
    }

    /// The output of a transformed one; NaN beyond the range of the map.
    #[must_use]
    pub fn back(&self, transformed: f64) -> f64 {
        if self.power == 1.0 {
            return self.origin + self.unit * (transformed + 1.0);
        }
        let ln = if self.power == 0.0 {
            transformed
        } else {
            libm::log1p(self.power * transformed) / self.power
        };
        self.origin + self.unit * libm::exp(ln)
    }

    /// `ln dz/dy` at an output.
    #[must_use]
    pub fn ln_slope(&self, output: f64) -> f64 {
        let ln_unit = libm::log(self.unit);
        if self.power == 1.0 {
            return -ln_unit;
        }
        (self.power - 1.0) * libm::log((output - self.origin) / self.unit) - ln_unit
    }
}

/// How a transformation follows from the outputs that it is to describe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum OutputForm {
    /// None.
    #[default]
    Identity,
    /// The logarithm of the outputs, for positive ones.
    Logarithm,
    /// A power of the height above the least output, in units of the median height.
    Height {
        /// The exponent; 0 is the logarithm.
        power: f64,
        /// Share of the median height that is added to every height; positive.
        added: f64,
    },
}

impl OutputForm {
    /// The forms that a choice is made from, the plain one first.
    pub const CANDIDATES: [Self; 6] = [
        Self::Identity,
        Self::Logarithm,
        Self::Height { power: 0.5, added: 0.1 },
        Self::Height { power: 0.0, added: 1.0 },
        Self::Height { power: 0.0, added: 0.1 },
        Self::Height { power: 0.0, added: 0.01 },
    ];

    /// The transformation for some outputs; `None` where this form has none for them.
    #[must_use]
    pub fn for_outputs(self, outputs: &[f64]) -> Option<Transformation> {
        if self == Self::Identity {
            return Some(Transformation::IDENTITY);
        }
        let mut sorted = outputs.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (&least, &median) = (sorted.first()?, sorted.get(sorted.len() / 2)?);
        let made = match self {
            Self::Height { power, added } => {
                let height = median - least;
                let varies = height > f64::EPSILON * least.abs().max(median.abs());
                varies.then(|| Transformation::new(power, least - added * height, height))?
            }
            _ => Transformation::new(0.0, 0.0, median),
        };
        made.ok().filter(|made| made.of(least).is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Logarithm, exponential and two products of numbers of order one.
    const ROUND_TRIP_REL: f64 = 1e-13;

    fn some() -> Vec<Transformation> {
        let outputs = [0.3, 1.0, 2.5, 700.0, 41.0];
        let forms = OutputForm::CANDIDATES.iter();
        let mut all: Vec<_> = forms.map(|form| form.for_outputs(&outputs).unwrap()).collect();
        all.push(Transformation::new(-0.3, -2.0, 5.0).unwrap());
        all
    }

    #[test]
    fn property_back_is_the_inverse() {
        for t in some() {
            for y in [0.31, 1.7, 12.0, 650.0] {
                let there = t.back(t.of(y));
                assert!((there / y - 1.0).abs() < ROUND_TRIP_REL, "{t:?} {y} {there}");
            }
        }
    }

    #[test]
    fn property_slopes_match_differences() {
        for t in some() {
            for y in [0.5_f64, 3.0, 200.0] {
                let h = 1e-5 * y;
                let slope = (t.of(y + h) - t.of(y - h)) / (2.0 * h);
                // central differences: h² truncation, ε/h rounding
                assert!((libm::log(slope) - t.ln_slope(y)).abs() < 1e-8, "{t:?} {y}");
            }
        }
    }

    #[test]
    fn outputs_that_do_not_vary_and_not_positive_ones_have_fewer() {
        let count = |outputs: &[f64]| {
            let forms = OutputForm::CANDIDATES.iter();
            forms.filter(|form| form.for_outputs(outputs).is_some()).count()
        };
        assert_eq!(count(&[2.0; 4]), 2);
        assert_eq!(count(&[]), 1);
        assert_eq!(count(&[-3.0, -1.0, 5.0]), 5);
        assert!(Transformation::new(0.0, 0.0, 0.0).is_err());
    }
}
