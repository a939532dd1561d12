//! The box that is searched, and what kind of number each input is.

#[cfg(feature = "serde")]
mod layout;

use crate::error::BoundsError;

/// Kind of number that an input is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum InputKind {
    /// A number on an interval.
    Linear,
    /// A number on a circle: the upper limit is the lower one again.
    Periodic,
    /// The radius of a polar pair; at radius zero its angle has no effect.
    PolarRadius {
        /// Index of the angle.
        angle: usize,
    },
    /// The angle of a polar pair, periodic over its interval.
    PolarAngle {
        /// Index of the radius.
        radius: usize,
    },
}

/// A box of inputs, each an interval, a circle or half of a polar pair.
///
/// # Examples
///
/// ```
/// use gp_bayesopt::{Bounds, InputKind};
///
/// let bounds = Bounds::new(&[0.0, -180.0], &[2.0, 180.0])?.with_periodic(1)?;
/// assert_eq!(bounds.kind(1), InputKind::Periodic);
/// assert_eq!(bounds.project(&[3.0, 190.0])?, [2.0, -170.0]);
/// # Ok::<_, gp_bayesopt::BoundsError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "layout::Layout", into = "layout::Layout"))]
pub struct Bounds {
    lower: Vec<f64>,
    upper: Vec<f64>,
    kinds: Vec<InputKind>,
}

/// Limits of a search, one pair for each coordinate.
#[derive(Clone, Debug)]
pub(crate) struct Walls {
    pub(crate) lower: Vec<f64>,
    pub(crate) upper: Vec<f64>,
}

impl Walls {
    /// Steps from a point that reach the limits.
    pub(crate) fn seen_from(&self, point: &[f64]) -> Self {
        Self {
            lower: self.lower.iter().zip(point).map(|(l, x)| l - x).collect(),
            upper: self.upper.iter().zip(point).map(|(u, x)| u - x).collect(),
        }
    }
}

impl Bounds {
    /// A box of linear inputs.
    ///
    /// # Errors
    /// [`BoundsError::Empty`], [`BoundsError::LengthMismatch`], or
    /// [`BoundsError::NotAnInterval`] unless every `lower < upper`, both finite.
    pub fn new(lower: &[f64], upper: &[f64]) -> Result<Self, BoundsError> {
        if lower.is_empty() {
            return Err(BoundsError::Empty);
        }
        if lower.len() != upper.len() {
            return Err(BoundsError::LengthMismatch { lower: lower.len(), upper: upper.len() });
        }
        for (input, (&lower, &upper)) in lower.iter().zip(upper).enumerate() {
            if !(lower.is_finite()
                && upper.is_finite()
                && lower < upper
                && (upper - lower).is_finite())
            {
                return Err(BoundsError::NotAnInterval { input, lower, upper });
            }
        }
        let kinds = vec![InputKind::Linear; lower.len()];
        Ok(Self { lower: lower.to_vec(), upper: upper.to_vec(), kinds })
    }

    /// The unit cube.
    ///
    /// # Errors
    /// [`BoundsError::Empty`] for dimension zero.
    pub fn unit(dimension: usize) -> Result<Self, BoundsError> {
        Self::new(&vec![0.0; dimension], &vec![1.0; dimension])
    }

    /// Makes an input periodic: its interval is one turn.
    ///
    /// # Errors
    /// [`BoundsError::NoSuchInput`]; [`BoundsError::PairTaken`] when it is half of a polar pair.
    pub fn with_periodic(mut self, input: usize) -> Result<Self, BoundsError> {
        match self.kinds.get(input) {
            None => Err(BoundsError::NoSuchInput { input, dimension: self.dimension() }),
            Some(InputKind::Linear | InputKind::Periodic) => {
                self.kinds[input] = InputKind::Periodic;
                Ok(self)
            }
            Some(_) => Err(BoundsError::PairTaken { radius: input, angle: input }),
        }
    }

    /// Joins two inputs to a polar pair. A surrogate then sees the radius, as
    /// a fraction of its interval, times cosine and sine of the angle, so that
    /// the seam and the centre disappear.
    ///
    /// # Errors
    /// [`BoundsError::NoSuchInput`]; [`BoundsError::PairTaken`] unless both are linear
    /// inputs and differ.
    pub fn with_polar(mut self, radius: usize, angle: usize) -> Result<Self, BoundsError> {
        let dimension = self.dimension();
        for input in [radius, angle] {
            if input >= dimension {
                return Err(BoundsError::NoSuchInput { input, dimension });
            }
        }
        let free = |i: usize| self.kinds[i] == InputKind::Linear;
        if radius == angle || !free(radius) || !free(angle) {
            return Err(BoundsError::PairTaken { radius, angle });
        }
        self.kinds[radius] = InputKind::PolarRadius { angle };
        self.kinds[angle] = InputKind::PolarAngle { radius };
        Ok(self)
    }

    /// Number of inputs.
    pub fn dimension(&self) -> usize {
        self.lower.len()
    }

    /// Lower limits.
    pub fn lower(&self) -> &[f64] {
        &self.lower
    }

    /// Upper limits.
    pub fn upper(&self) -> &[f64] {
        &self.upper
    }

    /// The kind of input `input`.
    ///
    /// # Panics
    /// When `input` is out of range.
    pub fn kind(&self, input: usize) -> InputKind {
        self.kinds[input]
    }

    /// Width of input `input`; for a circle, its period.
    ///
    /// # Panics
    /// When `input` is out of range.
    pub fn width(&self, input: usize) -> f64 {
        self.upper[input] - self.lower[input]
    }

    /// Tells whether input `input` lies on a circle.
    ///
    /// # Panics
    /// When `input` is out of range.
    pub fn wraps(&self, input: usize) -> bool {
        matches!(self.kinds[input], InputKind::Periodic | InputKind::PolarAngle { .. })
    }

    /// Refuses a point that is not finite or has the wrong length.
    ///
    /// # Errors
    /// [`BoundsError::Dimension`], [`BoundsError::NotFinite`].
    pub fn check(&self, point: &[f64]) -> Result<(), BoundsError> {
        if point.len() != self.dimension() {
            return Err(BoundsError::Dimension { expected: self.dimension(), found: point.len() });
        }
        match point.iter().position(|v| !v.is_finite()) {
            Some(input) => Err(BoundsError::NotFinite { input, value: point[input] }),
            None => Ok(()),
        }
    }

    /// Tells whether a point lies in the box.
    pub fn contains(&self, point: &[f64]) -> bool {
        point.len() == self.dimension()
            && (0..point.len()).all(|i| self.lower[i] <= point[i] && point[i] <= self.upper[i])
    }

    /// The nearest point of the box: clamped, on circles wrapped.
    ///
    /// # Errors
    /// Those of [`Self::check`].
    pub fn project(&self, point: &[f64]) -> Result<Vec<f64>, BoundsError> {
        self.check(point)?;
        Ok((0..point.len()).map(|i| self.project_input(i, point[i])).collect())
    }

    /// One coordinate, clamped or wrapped.
    pub(crate) fn project_input(&self, input: usize, value: f64) -> f64 {
        let (lower, upper) = (self.lower[input], self.upper[input]);
        if self.wraps(input) && !(lower..=upper).contains(&value) {
            let width = upper - lower;
            let turns = ((value - lower) / width).floor();
            return (value - turns * width).clamp(lower, upper);
        }
        value.clamp(lower, upper)
    }

    /// A point of the box as fractions of the intervals.
    pub(crate) fn to_unit(&self, point: &[f64]) -> Vec<f64> {
        (0..point.len()).map(|i| (point[i] - self.lower[i]) / self.width(i)).collect()
    }

    /// Limits for a search in fractions: circles may be crossed by half a
    /// turn, and a polar pair whose radius starts at zero through its centre.
    pub(crate) fn unit_walls(&self) -> Walls {
        let d = self.dimension();
        let low = |i: usize| match self.kinds[i] {
            InputKind::Linear => 0.0,
            InputKind::Periodic | InputKind::PolarAngle { .. } => -0.5,
            InputKind::PolarRadius { .. } => {
                if self.lower[i] == 0.0 {
                    -1.0
                } else {
                    0.0
                }
            }
        };
        let high = |i: usize| if self.wraps(i) { 1.5 } else { 1.0 };
        Walls { lower: (0..d).map(low).collect(), upper: (0..d).map(high).collect() }
    }

    /// Brings fractions back into the unit cube: a negative radius turns its
    /// angle by half, circles wrap, the rest is clamped.
    pub(crate) fn wrap_unit(&self, mut unit: Vec<f64>) -> Vec<f64> {
        for i in 0..unit.len() {
            if let InputKind::PolarRadius { angle } = self.kinds[i]
                && unit[i] < 0.0
                && self.lower[i] == 0.0
            {
                unit[i] = -unit[i];
                unit[angle] += 0.5;
            }
        }
        for i in 0..unit.len() {
            if self.wraps(i) && !(0.0..=1.0).contains(&unit[i]) {
                unit[i] -= unit[i].floor();
            }
            unit[i] = unit[i].clamp(0.0, 1.0);
        }
        unit
    }

    /// Fractions of the intervals as a point of the box.
    pub(crate) fn at_unit(&self, unit: &[f64]) -> Vec<f64> {
        (0..unit.len())
            .map(|i| (self.lower[i] + unit[i] * self.width(i)).clamp(self.lower[i], self.upper[i]))
            .collect()
    }
}
