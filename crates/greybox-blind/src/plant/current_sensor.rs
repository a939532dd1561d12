//! The current as its sensor shows it.

use super::delay::late;
use crate::effect::{Form, Hidden};

/// The current sensor.
pub(super) struct Reading {
    gain: f64,
    offset: f64,
    late_s: f64,
    past: Vec<f64>,
}

impl Reading {
    pub(super) fn new(hidden: &[Hidden]) -> Self {
        let mut reading = Self { gain: 1.0, offset: 0.0, late_s: 0.0, past: Vec::new() };
        for effect in hidden {
            match effect.form {
                Form::ReadingGain => reading.gain += effect.size,
                Form::ReadingOffset => reading.offset += effect.size,
                Form::ReadingLate => reading.late_s += effect.size,
                _ => {}
            }
        }
        reading
    }

    pub(super) fn of(&mut self, current: f64, tick_s: f64) -> f64 {
        let seen = self.gain * current + self.offset;
        if self.late_s == 0.0 {
            return seen;
        }
        self.past.push(seen);
        late(&self.past, self.late_s / tick_s)
    }
}
