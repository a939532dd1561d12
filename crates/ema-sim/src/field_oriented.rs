//! The digital current loop of the field-oriented drive, in the rotor's axes.
//!
//! ```text
//! i_q = ⅔·Σ i_j·sin(θ_e − δ_j)      i_d = −⅔·Σ i_j·cos(θ_e − δ_j)      δ_j = 0°, 120°, 240°
//! u   = K_p·e + x,  |u| ≤ V_dc/2    x' = K_i·e, held while limited     e = (0, I_ref) − (i_d, i_q)
//! v_j = u_q·sin(θ_e − δ_j) − u_d·cos(θ_e − δ_j)
//! K_p = L·ω_c,  K_i = R·ω_c
//! ```
//!
//! Amplitudes are those of the phases; `e_j = k_p·ω·sin(θ_e − δ_j)`, so that the torque of a
//! healthy machine is `1.5·k_p·i_q`. Sampled once a carrier period, acting in the next, without
//! decoupling of the axes and without an advance of the angle for the delay.
//!
//! # Source
//!
//! Park's transformation with constant amplitudes; gains that cancel the winding's pole; see
//! `docs/models/inverter.md`.

use crate::{
    current_loop::CURRENT_NOISE_STREAM, noise::NoiseSource, params::Actuator, phase::PerPhase,
    scenario::Scenario, winding::RotorAngle,
};

/// Half of the root of three.
const HALF_ROOT_3: f64 = 0.866_025_403_784_438_6;

/// Sine and cosine of `θ_e − δ_j` for the three phases.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhaseAngles {
    pub(crate) sin: PerPhase,
    pub(crate) cos: PerPhase,
}

impl PhaseAngles {
    /// At an electrical angle.
    pub(crate) fn of(electrical_rad: f64) -> Self {
        let (sin, cos) = libm::sincos(electrical_rad);
        Self::from_sines(sin, cos)
    }

    /// At an electrical angle near a known one, good to 1e-10; afresh where it is not near.
    #[inline]
    pub(crate) fn near(known: &RotorAngle, electrical_rad: f64) -> Self {
        let turn_rad = electrical_rad - known.motor_rad;
        if turn_rad.abs() > 0.1 {
            return Self::of(electrical_rad);
        }
        let mut rotor = *known;
        rotor.turn(turn_rad);
        Self::from_sines(rotor.sin, rotor.cos)
    }

    #[inline]
    fn from_sines(s: f64, c: f64) -> Self {
        let (half_s, half_c) = (-0.5 * s, -0.5 * c);
        let (across_s, across_c) = (HALF_ROOT_3 * s, HALF_ROOT_3 * c);
        Self {
            sin: [s, half_s - across_c, half_s + across_c],
            cos: [c, half_c + across_s, half_c - across_s],
        }
    }

    /// A quantity of the phases in the rotor's axes, `(d, q)`.
    pub(crate) fn axes_of(&self, phases: &PerPhase) -> (f64, f64) {
        let along = |by: &PerPhase| by[0] * phases[0] + by[1] * phases[1] + by[2] * phases[2];
        (-2.0 / 3.0 * along(&self.cos), 2.0 / 3.0 * along(&self.sin))
    }

    /// A quantity in the rotor's axes as one of the phases.
    pub(crate) fn phases_of(&self, d: f64, q: f64) -> PerPhase {
        core::array::from_fn(|j| q * self.sin[j] - d * self.cos[j])
    }
}

/// The current loop of the field-oriented drive.
pub(crate) struct FieldOriented {
    pub(crate) period_s: f64,
    pole_pairs: f64,
    gain: f64,
    integral_step: f64,
    limit_v: f64,
    integral_v: (f64, f64),
    /// Potentials of the legs in the next period over half of the supply, −1 to 1.
    pub(crate) pending: PerPhase,
    /// Voltage along the quadrature axis in the next period, V.
    pub(crate) pending_q_v: f64,
    noise_half_width_a: f64,
    noise: NoiseSource,
}

impl FieldOriented {
    pub(crate) fn new(actuator: &Actuator, scenario: &Scenario) -> Self {
        let inverter = &actuator.inverter;
        let bandwidth = core::f64::consts::TAU * inverter.current_bandwidth_hz;
        let period_s = 1.0 / inverter.carrier_hz;
        let noisy = scenario.imperfections.controller_noise;
        Self {
            period_s,
            pole_pairs: f64::from(actuator.motor.pole_pairs),
            gain: actuator.motor.inductance_henry * bandwidth,
            integral_step: actuator.motor.resistance_ohm * bandwidth * period_s,
            limit_v: 0.5 * inverter.bus_voltage_v,
            integral_v: (0.0, scenario.initial.current_integral_v),
            pending: [0.0; 3],
            pending_q_v: 0.0,
            noise_half_width_a: if noisy {
                actuator.sensing.current_noise_half_width_a
            } else {
                0.0
            },
            noise: NoiseSource::new(scenario.seed ^ CURRENT_NOISE_STREAM),
        }
    }

    /// One period: what to apply now, computed in the period before.
    pub(crate) fn step(
        &mut self,
        reference_a: f64,
        currents_a: &PerPhase,
        motor_rad: f64,
    ) -> PerPhase {
        let angles = PhaseAngles::of(self.pole_pairs * motor_rad);
        let (d, q) = angles.axes_of(&self.measured_a(currents_a));
        let error = (-d, reference_a - q);
        let wanted_v =
            (self.gain * error.0 + self.integral_v.0, self.gain * error.1 + self.integral_v.1);
        let size_v = libm::hypot(wanted_v.0, wanted_v.1);
        let mut share = 1.0 / self.limit_v;
        if size_v < self.limit_v {
            self.integral_v.0 += self.integral_step * error.0;
            self.integral_v.1 += self.integral_step * error.1;
        } else {
            share = 1.0 / size_v;
        }
        self.pending_q_v = self.limit_v * share * wanted_v.1;
        let next = angles.phases_of(share * wanted_v.0, share * wanted_v.1);
        core::mem::replace(&mut self.pending, next.map(|u| u.clamp(-1.0, 1.0)))
    }

    /// Readings of the sensors of the phases A and B; C follows from the star.
    fn measured_a(&mut self, currents_a: &PerPhase) -> PerPhase {
        if self.noise_half_width_a == 0.0 {
            return *currents_a;
        }
        let [a, b, _] = *currents_a;
        let a = a + self.noise_half_width_a * self.noise.symmetric();
        let b = b + self.noise_half_width_a * self.noise.symmetric();
        [a, b, -(a + b)]
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use approx::assert_abs_diff_eq;

    use super::*;

    /// Rounding of sines and their sums.
    const ROUNDING: f64 = 1e-14;
    /// Error of the rotation to a near angle.
    const NEAR: f64 = 1e-10;

    #[test]
    fn the_axes_are_the_phases_turned() {
        for step in 0..50 {
            let theta_e = 0.37 * f64::from(step) - 9.0;
            let angles = PhaseAngles::of(theta_e);
            for j in 0..3 {
                let x = theta_e - TAU / 3.0 * j as f64;
                assert_abs_diff_eq!(angles.sin[j], x.sin(), epsilon = ROUNDING);
                assert_abs_diff_eq!(angles.cos[j], x.cos(), epsilon = ROUNDING);
            }
            let near = PhaseAngles::near(&RotorAngle::new(theta_e - 0.09), theta_e);
            for j in 0..3 {
                assert_abs_diff_eq!(angles.sin[j], near.sin[j], epsilon = NEAR);
                assert_abs_diff_eq!(angles.cos[j], near.cos[j], epsilon = NEAR);
            }
            let (d, q) = angles.axes_of(&angles.phases_of(-0.3, 1.7));
            assert_abs_diff_eq!(d, -0.3, epsilon = ROUNDING);
            assert_abs_diff_eq!(q, 1.7, epsilon = ROUNDING);
        }
    }
}
