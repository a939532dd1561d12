//! Numbers that carry three partial derivatives.

use std::ops::{Add, Div, Mul, Sub};

use crate::normal::{LN_SQRT_TAU, ln_distribution};

/// A value with its derivatives by three variables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dual {
    pub(crate) value: f64,
    pub(crate) slope: [f64; 3],
}

impl Dual {
    /// Variable number `index`.
    pub(crate) fn variable(value: f64, index: usize) -> Self {
        let mut slope = [0.0; 3];
        slope[index] = 1.0;
        Self { value, slope }
    }

    fn chain(self, value: f64, factor: f64) -> Self {
        Self { value, slope: self.slope.map(|s| factor * s) }
    }
}

/// Operations of a formula, so that it is written once for values and for slopes.
pub(crate) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// A number that depends on nothing.
    fn constant(value: f64) -> Self;
    /// The value.
    fn value(self) -> f64;
    /// `eˣ`.
    fn exp(self) -> Self;
    /// `ln x`.
    fn ln(self) -> Self;
    /// `√x`.
    fn sqrt(self) -> Self;
    /// `ln Φ(x)`.
    fn ln_distribution(self) -> Self;

    /// The larger of a value and a constant.
    fn at_least(self, floor: f64) -> Self {
        if self.value() < floor { Self::constant(floor) } else { self }
    }
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn value(self) -> f64 {
        self
    }

    fn exp(self) -> Self {
        libm::exp(self)
    }

    fn ln(self) -> Self {
        libm::log(self)
    }

    fn sqrt(self) -> Self {
        self.sqrt()
    }

    fn ln_distribution(self) -> Self {
        ln_distribution(self)
    }
}

impl Number for Dual {
    fn constant(value: f64) -> Self {
        Self { value, slope: [0.0; 3] }
    }

    fn value(self) -> f64 {
        self.value
    }

    fn exp(self) -> Self {
        let e = libm::exp(self.value);
        self.chain(e, e)
    }

    fn ln(self) -> Self {
        self.chain(libm::log(self.value), 1.0 / self.value)
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }

    fn ln_distribution(self) -> Self {
        let ln_cdf = ln_distribution(self.value);
        // φ/Φ in logarithms: both underflow in the tail
        let ratio = libm::exp(-0.5 * self.value * self.value - LN_SQRT_TAU - ln_cdf);
        self.chain(ln_cdf, ratio)
    }
}

impl Add for Dual {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let slope = std::array::from_fn(|i| self.slope[i] + other.slope[i]);
        Self { value: self.value + other.value, slope }
    }
}

impl Sub for Dual {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + other.chain(-other.value, -1.0)
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule")]
impl Mul for Dual {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let slope =
            std::array::from_fn(|i| self.slope[i] * other.value + self.value * other.slope[i]);
        Self { value: self.value * other.value, slope }
    }
}

#[expect(clippy::suspicious_arithmetic_impl, reason = "the quotient rule")]
impl Div for Dual {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let slope = std::array::from_fn(|i| (self.slope[i] - value * other.slope[i]) / other.value);
        Self { value, slope }
    }
}
