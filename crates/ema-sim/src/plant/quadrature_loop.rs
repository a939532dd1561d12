//! The current loop of a field-oriented drive along the q axis, in the monitoring model.
//!
//! ```text
//! L·i' = K_p·(r − i) + x − R·i − v      x' = K_i·(r − i)      K_p = L·ω_c,  K_i = R·ω_c
//! v    = ⅔·v(θ)·ω + (⅔·F_sc − 1)·R·i    back-EMF, and the drop that unequal phases add
//! ```
//!
//! The gains cancel the winding's pole. With `d = x − R·i − v`, by which the integral is behind
//! what it has to drive, the loop falls into a chain:
//!
//! ```text
//! d' = −d·R/L − v'          i' = ω_c·(r − i) + d/L
//! ```
//!
//! The set-point is followed with `1/ω_c`, and a wave of voltage is answered by a current. Over a
//! segment `v` and `d` are Taylor series; what of the current decays with `1/ω_c` is the
//! exponential's polynomial through five points of the longest segment.
//!
//! # Source
//!
//! Gains: `field_oriented`; derived here, see `docs/models/low-fidelity.md`.

use crate::{
    params::{Actuator, Commutation},
    series::{Series, value},
    shape_function::Near,
    winding::{LocalQuadratic, Shaft, first, second},
};

/// Times at which the polynomial is the exponential, over the longest segment: extrema of a
/// Chebyshev polynomial.
const NODES: [f64; 5] = [0.0, 0.146_446_609_406_726_24, 0.5, 0.853_553_390_593_273_8, 1.0];
/// Coefficients of the polynomial through `s⁵` at the nodes, from the first power on.
const FIFTH: [f64; 4] = [-0.0625, 0.6875, -2.125, 2.5];
/// Longest segment over the loop's time constant, and over the winding's: the exponential is good
/// to 3e-5 and the series of `d` to 3e-3 of what has to settle, which is itself a hundredth of the
/// current.
const LOOP_RATIO: f64 = 1.0;
const WINDING_RATIO: f64 = 0.5;

/// Numbers of the loop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QuadratureLoop {
    /// `ω_c`.
    bandwidth: f64,
    /// `1/ω_c`.
    settling_s: f64,
    /// Coefficients of `e^(−ω_c·t)` from the first power on.
    decay: [f64; 4],
    /// These coefficients over those of the exponential's own series, from the second power on.
    fit: [f64; 3],
    /// Coefficients of `t⁵`.
    pub(crate) fifth: [f64; 4],
    /// `R/L` and `1/L` of the nominal winding.
    per_winding_s: f64,
    per_henry: f64,
    resistance_ohm: f64,
    /// Third coefficient over the first of what turns twice a pole pair, `−(2·P)²/6`.
    cubic_ratio: f64,
    /// Longest segment.
    pub(crate) longest_s: f64,
}

/// State of the loop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoopState {
    pub(crate) current_a: f64,
    /// `d`, by which the integral is behind.
    pub(crate) behind_v: f64,
}

/// The loop's answer over a segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answer {
    pub(crate) current: Series,
    behind: Series,
}

impl Answer {
    /// The state at a time of the segment.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    pub(crate) fn at(&self, at_s: f64) -> LoopState {
        LoopState { current_a: value(&self.current, at_s), behind_v: value(&self.behind, at_s) }
    }
}

impl QuadratureLoop {
    /// Current loop of a field-oriented drive; `None` for six steps.
    pub(crate) fn new(actuator: &Actuator) -> Option<Self> {
        if actuator.inverter.commutation == Commutation::SixStep {
            return None;
        }
        let bandwidth = core::f64::consts::TAU * actuator.inverter.current_bandwidth_hz;
        let motor = &actuator.motor;
        let per_winding_s = motor.resistance_ohm / motor.inductance_henry;
        let tick_s = 1.0 / actuator.controller.sample_hz;
        let parts = (bandwidth * tick_s / LOOP_RATIO).max(per_winding_s * tick_s / WINDING_RATIO);
        // a tick of a loop in one part is not cut by rounding
        let longest_s = tick_s / libm::ceil(parts * (1.0 - 1e-9)).max(1.0);
        let decay = decay(bandwidth, longest_s);
        let square = bandwidth * bandwidth;
        let own = [0.5 * square, -square * bandwidth / 6.0, square * square / 24.0];
        Some(Self {
            bandwidth,
            settling_s: 1.0 / bandwidth,
            decay,
            fit: core::array::from_fn(|n| decay[n + 1] / own[n]),
            fifth: fifth(longest_s),
            per_winding_s,
            per_henry: 1.0 / motor.inductance_henry,
            resistance_ohm: motor.resistance_ohm,
            cubic_ratio: -libm::pow(2.0 * f64::from(motor.pole_pairs), 2.0) / 6.0,
            longest_s,
        })
    }

    /// The state at the start of a test: no current, and an integral against the back-EMF.
    pub(crate) fn start(integral_v: f64, emf_v: f64) -> LoopState {
        LoopState { current_a: 0.0, behind_v: integral_v - 2.0 / 3.0 * emf_v }
    }

    /// The current over the next segment, with the set-point held.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    pub(crate) fn answer(
        &self,
        now: LoopState,
        reference_a: f64,
        near: &Near,
        shaft: &Shaft,
        speed: f64,
    ) -> Answer {
        let Near { coupling: k, turns: n } = near;
        let LoopState { current_a: i0, behind_v: d0 } = now;
        let (j, c) = (&shaft.per_inertia, shaft.viscous_n_m_s_per_rad);
        let i1 = self.bandwidth * (reference_a - i0) + d0 * self.per_henry;
        let w1 = (k[0] * i0 + shaft.external_n_m - c * speed) * j[0];
        let half_w1 = 0.5 * w1;
        let (k1, k2) = (first(k, speed), second(k, speed, half_w1));
        let w2 = (k1 * i0 + k[0] * i1 - c * w1) * j[1];
        let (n1, n2) = (first(n, speed), second(n, speed, half_w1));
        let more = n[0] - 1.5;
        let (ohm, g) = (2.0 / 3.0 * self.resistance_ohm, self.per_winding_s);
        let v1 = 2.0 / 3.0 * (k1 * speed + k[0] * w1) + ohm * (n1 * i0 + more * i1);
        let d1 = -g * d0 - v1;
        let i2 = 0.5 * (d1 * self.per_henry - self.bandwidth * i1);
        let shown2 = i2 * self.fit[0];
        let w3 = (k2 * i0 + k1 * i1 + k[0] * shown2 - c * w2) * j[2];
        let v2 = 2.0 / 3.0 * (k2 * speed + k1 * w1 + k[0] * w2)
            + ohm * (n2 * i0 + n1 * i1 + more * shown2);
        let d2 = -0.5 * g * d1 - v2;
        let third = |a: &LocalQuadratic| {
            let bend = self.cubic_ratio * a[1] * speed * speed + 2.0 * a[2] * half_w1;
            a[1] * (1.0 / 3.0) * w2 + bend * speed
        };
        let i3 = 1.0 / 3.0 * (d2 * self.per_henry - self.bandwidth * i2);
        let shown3 = i3 * self.fit[1];
        let w4 = (k2 * i1 + k1 * shown2 + k[0] * shown3 - c * w3) * j[3];
        let v3 = 2.0 / 3.0 * (third(k) * speed + k2 * w1 + k1 * w2 + k[0] * w3)
            + ohm * (third(n) * i0 + n2 * i1 + n1 * shown2 + more * shown3);
        let d3 = -1.0 / 3.0 * g * d2 - v3;
        let shown4 = 0.25 * (d3 * self.per_henry - self.bandwidth * i3) * self.fit[2];
        let v4 = 2.0 / 3.0 * (k2 * w2 + k1 * w3 + k[0] * w4) + ohm * (n1 * shown3 + more * shown4);
        let d4 = -0.25 * g * d3 - v4;
        // the current that d drives, without what decays
        let s4 = d4 * self.per_henry * self.settling_s;
        let s3 = (d3 * self.per_henry - 4.0 * s4) * self.settling_s;
        let s2 = (d2 * self.per_henry - 3.0 * s3) * self.settling_s;
        let s1 = (d1 * self.per_henry - 2.0 * s2) * self.settling_s;
        let s0 = reference_a + (d0 * self.per_henry - s1) * self.settling_s;
        let rest = i0 - s0;
        let p = &self.decay;
        Answer {
            current: [i0, s1 + rest * p[0], s2 + rest * p[1], s3 + rest * p[2], s4 + rest * p[3]],
            behind: [d0, d1, d2, d3, d4],
        }
    }
}

/// Coefficients, from the first power on, of the polynomial through `e^(−rate·t)` at the nodes of
/// a span.
fn decay(rate: f64, span_s: f64) -> [f64; 4] {
    // Newton's divided differences over the nodes, multiplied out
    let mut table = NODES.map(|node| libm::exp(-rate * span_s * node));
    for order in 1..5 {
        for n in (order..5).rev() {
            table[n] = (table[n] - table[n - 1]) / (NODES[n] - NODES[n - order]);
        }
    }
    let mut powers = [table[4], 0.0, 0.0, 0.0, 0.0];
    for n in (0..4).rev() {
        for m in (1..5).rev() {
            powers[m] = powers[m - 1] - NODES[n] * powers[m];
        }
        powers[0] = table[n] - NODES[n] * powers[0];
    }
    let mut scale = 1.0;
    core::array::from_fn(|n| {
        scale /= span_s;
        powers[n + 1] * scale
    })
}

/// Coefficients of the polynomial through `t⁵` at the nodes of a span.
fn fifth(span_s: f64) -> [f64; 4] {
    let mut scale = span_s;
    let mut coefficients = FIFTH;
    for coefficient in coefficients.iter_mut().rev() {
        *coefficient *= scale;
        scale *= span_s;
    }
    coefficients
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets::BENCH;

    /// Interpolation at five points: `rate⁵/120` times the nodes' product, 2.6e-3.
    const DECAY: f64 = 3e-6;
    /// Current against finest steps, A, of a set-point that steps by 1 A: a hundred times what it
    /// does in a tick of the tests.
    const CURRENT_A: f64 = 1e-5;
    /// Voltage that the integral is behind against finest steps, V, of that set-point: the series'
    /// next coefficient.
    const BEHIND_V: f64 = 5e-5;

    #[test]
    fn the_polynomial_is_the_exponential() {
        let (rate, span_s) = (6283.0, 1e-4);
        let p = decay(rate, span_s);
        for step in 0..=50 {
            let t = span_s * f64::from(step) / 50.0;
            let found = value(&[1.0, p[0], p[1], p[2], p[3]], t);
            assert!((found - (-rate * t).exp()).abs() < DECAY, "{found} at {t}");
        }
    }

    #[test]
    fn the_fifth_power_is_met_at_the_nodes() {
        let (span_s, mut power) = (1e-4, 1.0);
        let p = fifth(span_s);
        for node in NODES {
            let t = span_s * node;
            power = value(&[0.0, p[0], p[1], p[2], p[3]], t) / span_s.powi(5);
            assert!((power - node.powi(5)).abs() < 1e-15, "{power} at {node}");
        }
        assert!((power - 1.0).abs() < 1e-15);
    }

    #[test]
    fn law_the_answer_solves_the_loop_beside_a_turning_shaft() {
        let of = QuadratureLoop::new(&BENCH).unwrap();
        let near = Near { coupling: [0.075, 0.01, -0.3], turns: [1.48, 0.1, -2.0] };
        let shaft = Shaft {
            per_inertia: crate::series::RECIPROCALS.map(|r| r / BENCH.total_inertia_kg_m2()),
            external_n_m: -0.03,
            viscous_n_m_s_per_rad: 3e-5,
        };
        let start = LoopState { current_a: 1.7, behind_v: -0.02 };
        let (speed, reference_a, span_s) = (70.0, 2.7, 1e-4);
        let (r, l, w) = (of.resistance_ohm, 1.0 / of.per_henry, of.bandwidth);
        // x, i, ω, θ by small explicit midpoint steps
        let emf = |turn: f64, speed: f64| {
            let k = &near.coupling;
            2.0 / 3.0 * (k[0] + turn * (k[1] + turn * k[2])) * speed
        };
        let drop = |turn: f64, i: f64| {
            let n = &near.turns;
            (2.0 / 3.0 * (n[0] + turn * (n[1] + turn * n[2])) - 1.0) * r * i
        };
        let rates = |[x, i, speed, turn]: [f64; 4]| {
            let torque_n_m = 1.5 * emf(turn, 1.0) * i + shaft.external_n_m;
            let v = emf(turn, speed) + drop(turn, i);
            [
                r * w * (reference_a - i),
                w * (reference_a - i) + (x - r * i - v) / l,
                (torque_n_m - shaft.viscous_n_m_s_per_rad * speed) * shaft.per_inertia[0],
                speed,
            ]
        };
        let x = start.behind_v + r * start.current_a + emf(0.0, speed) + drop(0.0, start.current_a);
        let mut state = [x, start.current_a, speed, 0.0];
        let steps = 4000;
        let h = span_s / f64::from(steps);
        for _ in 0..steps {
            let k1 = rates(state);
            let middle = core::array::from_fn(|n| state[n] + 0.5 * h * k1[n]);
            let k2 = rates(middle);
            state = core::array::from_fn(|n| state[n] + h * k2[n]);
        }
        let end = of.answer(start, reference_a, &near, &shaft, speed).at(span_s);
        assert!((end.current_a - state[1]).abs() < CURRENT_A, "{} {}", end.current_a, state[1]);
        let behind_v = state[0] - r * state[1] - emf(state[3], state[2]) - drop(state[3], state[1]);
        assert!((end.behind_v - behind_v).abs() < BEHIND_V, "{} {behind_v}", end.behind_v);
    }
}
