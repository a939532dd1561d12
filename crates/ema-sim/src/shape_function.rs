//! The monitoring model's shape functions for a field-oriented drive.
//!
//! ```text
//! i_j = I·sin x_j,  x_j = θ_e − δ_j       the current loop's doing, whatever the machine
//! Σ k_j·i_j   = k_p·F_ecc·F_sc·I           F_sc = Σ N_j·sin² x_j
//! Σ R_j·i_j²  = R_p·F_sc·I²
//! ```
//!
//! Another shape `f` than the sine has `Σ N_j·f(x_j)·sin x_j` in place of the torque's `F_sc`.
//! With sines `F_sc = ½·Σ N_j − ½·Σ N_j·cos 2x_j`, so that it turns twice a pole pair and is
//! 3/2 in a healthy machine.
//!
//! # Source
//!
//! Derived here from the equations of `docs/models/motor.md`; see `docs/models/low-fidelity.md`.

use core::f64::consts::TAU;

use crate::{
    back_emf::Spline,
    fault::PhysicalFaults,
    field_oriented::PhaseAngles,
    params::{Actuator, BackEmfShape, Commutation},
    winding::{LocalQuadratic, times},
};

/// `F_sc` of a field-oriented drive.
#[derive(Clone, Debug)]
pub(crate) struct ShapeFunction {
    turns: [f64; 3],
    /// The shape where it is not a sine.
    spline: Option<Spline>,
    back_emf_v_s_per_rad: f64,
    resistance_ohm: f64,
    pole_pairs: f64,
    mean: f64,
    /// Amplitudes of `cos 2θ_e` and `sin 2θ_e`.
    wave: (f64, f64),
}

impl ShapeFunction {
    /// Shape function of a field-oriented drive; `None` for six steps, whose shape is a staircase.
    pub(crate) fn new(actuator: &Actuator, faults: &PhysicalFaults) -> Option<Self> {
        if actuator.inverter.commutation == Commutation::SixStep {
            return None;
        }
        let turns = faults.healthy_turns_frac;
        // cos 2x_j = cos 2θ_e·cos 2δ_j + sin 2θ_e·sin 2δ_j, and 2δ_j is −δ_j but for a turn
        let phases = PhaseAngles::of(0.0);
        let sum = |by: &[f64; 3]| (0..3).map(|j| turns[j] * by[j]).sum::<f64>();
        let spline = match &actuator.motor.back_emf_shape {
            BackEmfShape::Tabulated(table) => Some(table.spline()),
            _ => None,
        };
        Some(Self {
            turns,
            spline,
            back_emf_v_s_per_rad: actuator.motor.back_emf_v_s_per_rad,
            resistance_ohm: actuator.motor.resistance_ohm,
            pole_pairs: f64::from(actuator.motor.pole_pairs),
            mean: 0.5 * turns.iter().sum::<f64>(),
            wave: (-0.5 * sum(&phases.cos), -0.5 * sum(&phases.sin)),
        })
    }

    /// Time in which [`near`](Self::near) stays good to 1e-4 of the wave's amplitude.
    #[inline]
    pub(crate) fn longest_s(&self, speed_rad_per_s: f64) -> f64 {
        0.1 / (2.0 * self.pole_pairs * speed_rad_per_s.abs())
    }

    /// Torque over current and turns near a motor angle.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    pub(crate) fn near(&self, motor_rad: f64, gap: &LocalQuadratic) -> Near {
        let turns = if self.wave == (0.0, 0.0) {
            [self.mean, 0.0, 0.0]
        } else {
            let rate = 2.0 * self.pole_pairs;
            let (sin, cos) = libm::sincos(rate * motor_rad);
            turns_near([self.mean, self.wave.0, self.wave.1], rate, sin, cos)
        };
        let tabulated = self.spline.as_ref().map(|spline| self.tabulated(spline, motor_rad));
        let shape = tabulated.unwrap_or(turns).map(|f| self.back_emf_v_s_per_rad * f);
        Near { coupling: times(&shape, gap), turns }
    }

    /// Resistance that a share of turns leaves.
    #[inline]
    pub(crate) fn resistance_ohm(&self, near: &Near) -> f64 {
        self.resistance_ohm * near.turns[0]
    }

    /// Numbers of the function, where the shape is a sine.
    pub(crate) fn wave(&self) -> Option<Wave> {
        self.spline.is_none().then_some(Wave {
            mean: self.mean,
            amplitude: self.wave,
            rate: 2.0 * self.pole_pairs,
            back_emf_v_s_per_rad: self.back_emf_v_s_per_rad,
            resistance_ohm: self.resistance_ohm,
        })
    }

    /// `Σ N_j·f(x_j)·sin x_j` near a motor angle.
    #[inline(never)]
    fn tabulated(&self, spline: &Spline, motor_rad: f64) -> LocalQuadratic {
        let p = self.pole_pairs;
        let angles = PhaseAngles::of(p * motor_rad);
        let mut sum = [0.0; 3];
        for (phase, turns) in self.turns.iter().enumerate() {
            let [f0, f1, f2, _] = spline.near(p * motor_rad - TAU / 3.0 * phase as f64);
            let (s, c) = (angles.sin[phase], angles.cos[phase]);
            let product = times(&[f0, p * f1, p * p * f2], &[s, p * c, -0.5 * p * p * s]);
            for (total, part) in sum.iter_mut().zip(product) {
                *total += turns * part;
            }
        }
        sum
    }
}

/// The equivalent machine near an angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    /// Torque over current, `v`.
    pub(crate) coupling: LocalQuadratic,
    /// `F_sc` of the heat.
    pub(crate) turns: LocalQuadratic,
}

/// `F_sc` of sines, and what it multiplies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wave {
    pub(crate) mean: f64,
    /// Amplitudes of `cos 2θ_e` and `sin 2θ_e`.
    pub(crate) amplitude: (f64, f64),
    /// `2·P`.
    pub(crate) rate: f64,
    pub(crate) back_emf_v_s_per_rad: f64,
    pub(crate) resistance_ohm: f64,
}

/// `F_sc` near an angle from mean, amplitudes, rate, and sine and cosine of twice the electrical
/// angle.
#[inline(always)]
#[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
pub(crate) fn turns_near(
    [mean, of_cos, of_sin]: [f64; 3],
    rate: f64,
    sin: f64,
    cos: f64,
) -> LocalQuadratic {
    let value = of_cos * cos + of_sin * sin;
    let slope = of_sin * cos - of_cos * sin;
    [mean + value, rate * slope, -0.5 * rate * rate * value]
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::{HealthState, presets::BENCH};

    /// Rounding of a sum over three phases, N·m/A and Ω.
    const TORQUE: f64 = 1e-14;
    const OHM: f64 = 1e-13;
    /// Error of central differences: h² times the next derivatives, 8³ and 8⁴.
    const SLOPE: f64 = 1e-6;
    const BEND: f64 = 1e-5;

    #[test]
    fn law_torque_and_heat_of_a_sinusoidal_current() {
        let health = HealthState::new([0.0, 0.0, 0.3, 0.1, 0.0, 0.0, 0.5]).unwrap();
        let faults = PhysicalFaults::from(&health);
        let shape = ShapeFunction::new(&BENCH, &faults).unwrap();
        for step in 0..40 {
            let motor_rad = 0.17 * f64::from(step) - 3.0;
            let at = |motor_rad: f64| -> f64 {
                (0..3)
                    .map(|j| {
                        let x = 4.0 * motor_rad - TAU / 3.0 * j as f64;
                        faults.healthy_turns_frac[j] * x.sin() * x.sin()
                    })
                    .sum()
            };
            let near = shape.near(motor_rad, &[1.0, 0.0, 0.0]);
            let (torque, ohm) = (near.coupling, shape.resistance_ohm(&near));
            let k = BENCH.motor.back_emf_v_s_per_rad;
            assert_abs_diff_eq!(torque[0], k * at(motor_rad), epsilon = TORQUE);
            assert_abs_diff_eq!(ohm, BENCH.motor.resistance_ohm * at(motor_rad), epsilon = OHM);
            let h = 1e-4;
            let slope = k * (at(motor_rad + h) - at(motor_rad - h)) / (2.0 * h);
            let bend = k * (at(motor_rad + h) - 2.0 * at(motor_rad) + at(motor_rad - h)) / (h * h);
            // central differences miss terms of h² times the next derivatives, 8³ and 8⁴
            assert_abs_diff_eq!(torque[1], slope, epsilon = SLOPE);
            assert_abs_diff_eq!(2.0 * torque[2], bend, epsilon = BEND);
        }
    }
}
