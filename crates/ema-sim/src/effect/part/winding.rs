//! Changes between supply and winding: warmth, inductance, dead time, a source's resistance.

use libm::{exp, tanh};

/// Changes between supply and winding.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WindingEffects {
    /// Relative rise of the resistance over temperature.
    pub(crate) rise_per_k: f64,
    /// Steady temperature over heat.
    pub(crate) kelvin_per_w: f64,
    /// Time constant of the temperature.
    pub(crate) thermal_s: f64,
    /// Present temperature above the cold winding's.
    pub(crate) warm_k: f64,
    pub(crate) inductance_henry: f64,
    /// Voltage lost by dead time, and the current from which on it is lost.
    pub(crate) dead_v: f64,
    pub(crate) dead_a: f64,
    /// Resistance of the supply.
    pub(crate) source_ohm: f64,
    /// True where any of them is there.
    pub(crate) any: bool,
}

/// The electrical circuit of a segment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Circuit {
    pub(crate) resistance_ohm: f64,
    /// Inductance over the segment's length.
    pub(crate) inductive_ohm: f64,
    /// Resistance of the supply.
    pub(crate) source_ohm: f64,
    pub(crate) dead_v: f64,
}

impl WindingEffects {
    /// The circuit in the next span; without effects on it, nothing.
    pub(crate) fn circuit(
        &self,
        resistance_ohm: f64,
        current_a: f64,
        span_s: f64,
    ) -> Option<Circuit> {
        self.any.then(|| Circuit {
            resistance_ohm: resistance_ohm * self.warmth_ratio(),
            inductive_ohm: self.inductance_henry / span_s,
            source_ohm: self.source_ohm,
            dead_v: if self.dead_v > 0.0 {
                self.dead_v * tanh(current_a / self.dead_a)
            } else {
                0.0
            },
        })
    }

    /// Resistance of the winding over that of the cold one.
    pub(crate) fn warmth_ratio(&self) -> f64 {
        1.0 + self.rise_per_k * self.warm_k
    }

    /// Resistance of the winding over that of the cold one a time ahead, under a heat.
    pub(crate) fn warmth_ratio_in(&self, ahead_s: f64, heat_w: f64) -> f64 {
        if self.rise_per_k == 0.0 {
            return 1.0;
        }
        let rate = (self.kelvin_per_w * heat_w - self.warm_k) / self.thermal_s;
        1.0 + self.rise_per_k * (self.warm_k + rate * ahead_s)
    }

    /// Warms the winding over a span: the exact solution under a constant heat.
    pub(crate) fn warm(&mut self, span_s: f64, heat_w: f64) {
        if self.rise_per_k > 0.0 {
            let towards = self.kelvin_per_w * heat_w;
            self.warm_k += (towards - self.warm_k) * (1.0 - exp(-span_s / self.thermal_s));
        }
    }
}
