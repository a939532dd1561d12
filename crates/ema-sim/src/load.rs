//! Loads on the surface: a constant moment alone, a recording, or the air.

use std::sync::Arc;

use crate::simulation_error::SimulationError;

/// Moment on the surface besides the constant one of the scenario, positive against positive
/// motion.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Load {
    /// None.
    #[default]
    None,
    /// Samples at a fixed rate, straight between them and constant after the last.
    Recorded {
        /// Moments (of a linear axis: forces).
        values_n_m: Vec<f64>,
        /// Rate of the samples.
        rate_hz: f64,
    },
    /// Hinge moment of a surface that steers an aircraft.
    Aerodynamic(HingeMoment),
}

/// Hinge moment through the linearised longitudinal motion of an aircraft.
///
/// ```text
/// H = q·S·c·(C_h0 + C_hα·α + C_hδ·δ)
/// x' = A·x + B·δ,   x = (V, α, θ, q) about trim, δ the surface's angle about trim
/// ```
///
/// # Source
///
/// `A`, `B`: the F-16 of Stevens and Lewis at 502 ft/s, sea level, centre of gravity at 0.30
/// of the chord (stable), re-linearised from `AeroBenchVVPython`. That model has no hinge moment: the coefficients are
/// this project's choice, see `docs/models/loads.md`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HingeMoment {
    /// Dynamic pressure times surface area times chord.
    pub scale_n_m: f64,
    /// Coefficient at trim, `C_h0`.
    pub bias: f64,
    /// Over the change of the angle of attack, `C_hα`.
    pub per_attack_rad: f64,
    /// Over the surface's angle, `C_hδ`.
    pub per_surface_rad: f64,
    /// Gust: change of the angle of attack that the air itself brings.
    pub gust_rad: f64,
}

impl HingeMoment {
    /// The F-16 at 502 ft/s with a small surface: 0.5 N·m at trim.
    pub const F16: Self = Self {
        scale_n_m: 71.7,
        bias: 0.5 / 71.7,
        per_attack_rad: -0.1,
        per_surface_rad: -0.3,
        gust_rad: 0.0,
    };
}

/// State matrix; speed in ft/s, angles in rad.
const A: [[f64; 4]; 4] = [
    [-0.020_246, 7.8769, -32.17, -0.654_00],
    [-0.000_254, -1.015_76, 0.0, 0.904_83],
    [0.0, 0.0, 0.0, 1.0],
    [0.0, -2.487_75, 0.0, -1.386_17],
];
/// Input column for a degree of elevator.
const B_PER_DEGREE: [f64; 4] = [0.170_23, -0.002_151, 0.0, -0.182_43];

impl Load {
    /// Refuses numbers out of bounds.
    pub(crate) fn check(&self) -> Result<(), SimulationError> {
        let bounded = |field, value: f64, most: f64| {
            if value.abs() <= most {
                Ok(())
            } else {
                Err(SimulationError::Scenario { field, value, least: -most, most })
            }
        };
        match self {
            Self::None => Ok(()),
            Self::Recorded { values_n_m, rate_hz } => {
                if !(f64::MIN_POSITIVE..=1e9).contains(rate_hz) {
                    let (field, value) = ("load.rate-hz", *rate_hz);
                    let (least, most) = (f64::MIN_POSITIVE, 1e9);
                    return Err(SimulationError::Scenario { field, value, least, most });
                }
                values_n_m.iter().try_for_each(|value| bounded("load.values-n-m", *value, 1e6))
            }
            Self::Aerodynamic(h) => {
                bounded("load.scale-n-m", h.scale_n_m, 1e6)?;
                bounded("load.bias", h.bias, 1e3)?;
                bounded("load.per-attack-rad", h.per_attack_rad, 1e3)?;
                bounded("load.per-surface-rad", h.per_surface_rad, 1e3)?;
                bounded("load.gust-rad", h.gust_rad, 1.0)
            }
        }
    }

    /// Largest size of the load while the surface is between stops, and the angle of attack within
    /// a radian of trim.
    pub(crate) fn most_n_m(&self, stop_rad: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Recorded { values_n_m, .. } => {
                values_n_m.iter().fold(0.0, |most, value| value.abs().max(most))
            }
            Self::Aerodynamic(h) => {
                let attack = h.per_attack_rad.abs() * (1.0 + h.gust_rad.abs());
                h.scale_n_m.abs() * (h.bias.abs() + attack + h.per_surface_rad.abs() * stop_rad)
            }
        }
    }
}

/// A load as it runs beside a machine, from tick to tick.
#[derive(Clone, Debug)]
pub(crate) struct LoadRun {
    load: Arc<Load>,
    constant_n_m: f64,
    /// The load last told by [`changed_n_m`](Self::changed_n_m).
    told_n_m: Option<f64>,
    time_s: f64,
    /// Motion of the aircraft about trim.
    state: [f64; 4],
}

impl LoadRun {
    pub(crate) fn new(load: &Arc<Load>, constant_n_m: f64) -> Self {
        let load = Arc::clone(load);
        Self { load, constant_n_m, told_n_m: None, time_s: 0.0, state: [0.0; 4] }
    }

    /// True for a load that changes at all.
    pub(crate) fn varies(&self) -> bool {
        *self.load != Load::None
    }

    /// True for a load that depends on where the surface is.
    pub(crate) fn feels_surface(&self) -> bool {
        matches!(*self.load, Load::Aerodynamic(_))
    }

    /// The load now where it is not, bit for bit, the one told before.
    pub(crate) fn changed_n_m(&mut self, surface_rad: f64) -> Option<f64> {
        let now_n_m = self.now_n_m(surface_rad);
        let same = self.told_n_m.is_some_and(|told_n_m| told_n_m.to_bits() == now_n_m.to_bits());
        self.told_n_m = Some(now_n_m);
        (!same).then_some(now_n_m)
    }

    /// The load now, at an angle of the surface.
    pub(crate) fn now_n_m(&self, surface_rad: f64) -> f64 {
        let own_n_m = match &*self.load {
            Load::None => 0.0,
            Load::Recorded { values_n_m, rate_hz } => {
                // never negative, so that cutting it off is its floor
                let place = self.time_s * rate_hz;
                let before = place as usize;
                match (values_n_m.get(before), values_n_m.get(before + 1)) {
                    (Some(a), Some(b)) => a + (b - a) * (place - before as f64),
                    _ => values_n_m.last().copied().unwrap_or(0.0),
                }
            }
            Load::Aerodynamic(h) => {
                let attack = self.state[1] + h.gust_rad;
                // the air pushes the surface one way; against positive motion is the other
                let steering = h.per_attack_rad * attack + h.per_surface_rad * surface_rad;
                h.scale_n_m * (h.bias - steering)
            }
        };
        self.constant_n_m + own_n_m
    }

    /// Goes on by a tick with the surface where it is.
    pub(crate) fn advance(&mut self, surface_rad: f64, span_s: f64) {
        self.time_s += span_s;
        if self.feels_surface() {
            let elevator_deg = surface_rad.to_degrees();
            let rate = |x: &[f64; 4]| -> [f64; 4] {
                core::array::from_fn(|i| {
                    let row: f64 = A[i].iter().zip(x).map(|(a, x)| a * x).sum();
                    row + B_PER_DEGREE[i] * elevator_deg
                })
            };
            // the aircraft's fastest mode is 1.9 rad/s: two stages to 1e-12 a tick
            let k1 = rate(&self.state);
            let middle: [f64; 4] = core::array::from_fn(|i| self.state[i] + 0.5 * span_s * k1[i]);
            let k2 = rate(&middle);
            for (x, k) in self.state.iter_mut().zip(k2) {
                *x += span_s * k;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    /// Rounding of an interpolated moment, N·m.
    const ROUNDING_N_M: f64 = 1e-12;
    /// Error of a step of the aircraft's motion, over the attack that it makes.
    const STEP_REL: f64 = 1e-6;

    #[test]
    fn a_recorded_load_is_straight_between_samples() {
        let load = Load::Recorded { values_n_m: vec![0.0, 2.0, 1.0], rate_hz: 10.0 };
        let mut run = LoadRun::new(&Arc::new(load), 0.5);
        run.advance(0.0, 0.05);
        assert_abs_diff_eq!(run.now_n_m(0.0), 1.5, epsilon = ROUNDING_N_M);
        run.advance(0.0, 1.0);
        assert_abs_diff_eq!(run.now_n_m(0.0), 1.5, epsilon = ROUNDING_N_M);
    }

    /// A held surface brings the short period to rest where A and B say.
    #[test]
    fn law_the_aircraft_settles_where_its_matrices_say() {
        let mut run = LoadRun::new(&Arc::new(Load::Aerodynamic(HingeMoment::F16)), 0.0);
        let surface_rad = 1e-3;
        assert_abs_diff_eq!(run.now_n_m(0.0), 0.5, epsilon = ROUNDING_N_M);
        // the stiffness alone at first: 0.3·71.7 N·m/rad
        assert_abs_diff_eq!(run.now_n_m(surface_rad) - 0.5, 21.51e-3, epsilon = ROUNDING_N_M);
        for _ in 0..300_000 {
            run.advance(surface_rad, 1e-2);
        }
        // x' = 0: q = 0, α = −B₄·δ/A₄₂, δ in degrees
        let attack = -B_PER_DEGREE[3] * surface_rad.to_degrees() / A[3][1];
        assert_abs_diff_eq!(run.state[1], attack, epsilon = STEP_REL * attack.abs());
        assert_abs_diff_eq!(run.state[3], 0.0, epsilon = 1e-9);
    }
}
