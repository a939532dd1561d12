//! Numbers of a text that a program of single precision has written with all digits.

/// Numbers that may all be of single precision.
pub(super) struct SinglePrecision {
    are_all: bool,
    largest: f64,
}

impl Default for SinglePrecision {
    fn default() -> Self {
        Self { are_all: true, largest: 0.0 }
    }
}

impl SinglePrecision {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "what does not come back is of double precision"
    )]
    pub(super) fn look_at(&mut self, number: f64) {
        self.are_all &= f64::from(number as f32) == number;
        self.largest = self.largest.max(number.abs());
    }

    /// A unit in the last place of the largest, or 0.
    pub(super) fn quantum(&self) -> f64 {
        if self.are_all { f64::from(f32::EPSILON) * self.largest } else { 0.0 }
    }
}
