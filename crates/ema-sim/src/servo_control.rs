//! The controller of a servo axis: a sampled cascade of position and speed.

mod lanes;

pub(crate) use lanes::{Asked, AxisLane};

use crate::{bounds::within, quantisation::quantised};

/// Stage between the controller's output and the motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Drive {
    /// A current loop without lag: the output is a current, `T = k·I`.
    Current,
    /// An amplifier that makes a current of a voltage: the output is a voltage, `T = k·U`.
    Amplifier,
    /// The winding itself: the output is a voltage, `R·I = U − k·ω`, `T = k·I`.
    Winding,
}

/// Where the position is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Feedback {
    /// Before the backlash.
    Motor,
    /// After it.
    Load,
}

/// Position and speed cascade of a servo axis; `x` is the measured position, `v` the speed.
///
/// ```text
/// v_ref = sat(K_p·e + K_i·∫e + K_d·e', v_max)       e = x_ref − x
/// u     = sat(K_v·(v_ref − v) + ξ, u_max)           ξ' = K_ξ·(v_ref − v)
/// ```
///
/// Both integrals rest while `u` is saturated. Gains that are zero leave their part out: P, PI,
/// PID. Speeds are those of the axis, or the difference of positions `n` samples apart over
/// their time, as drives that have an encoder alone compute them.
///
/// # Source
///
/// Cascades of EMPS (Janot, Gautier, Brunot 2019) and of common servo drives; see
/// `docs/models/servo-axis.md`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisController {
    /// Rate of the cascade.
    pub sample_hz: f64,
    /// `K_p`, 1/s.
    pub position_gain_per_s: f64,
    /// `K_i`, 1/s².
    pub position_integral_per_s2: f64,
    /// `K_d`.
    pub position_derivative_ratio: f64,
    /// `v_max`, rad/s or m/s.
    pub speed_limit: f64,
    /// `K_v`, A or V over rad/s or m/s.
    pub speed_gain: f64,
    /// `K_ξ`, A or V over rad or m.
    pub speed_integral: f64,
    /// `u_max`, A or V.
    pub output_limit: f64,
    /// Samples between the positions whose difference is the speed; 0 measures speed itself.
    pub speed_samples: u32,
    /// Step of the encoder, rad or m.
    pub encoder_step: f64,
    /// Where the position is measured.
    pub feedback: Feedback,
}

/// A cascade as it runs.
#[derive(Clone, Debug)]
pub(crate) struct AxisCascade {
    law: AxisController,
    tick_s: f64,
    integrals: Integrals,
    last_error: Option<f64>,
    /// The latest positions, newest first.
    positions: Vec<f64>,
}

impl AxisCascade {
    /// The cascade of an axis that came with a constant speed.
    pub(crate) fn new(law: &AxisController, position: f64, speed: f64, output: f64) -> Self {
        let tick_s = 1.0 / law.sample_hz;
        let before = |n: u32| quantised(position - speed * tick_s * f64::from(n), law.encoder_step);
        Self {
            law: *law,
            tick_s,
            integrals: Integrals { position: 0.0, speed: output },
            last_error: None,
            positions: (1..=law.speed_samples.max(1)).map(before).collect(),
        }
    }

    /// The speed that the controller takes, and the position with the encoder's steps.
    fn measured(&mut self, position: f64, speed: f64) -> (f64, f64) {
        let position = quantised(position, self.law.encoder_step);
        let samples = self.law.speed_samples as usize;
        if samples == 0 {
            return (position, speed);
        }
        let span_s = self.tick_s * samples as f64;
        let speed = (position - self.positions[samples - 1]) / span_s;
        self.positions.rotate_right(1);
        self.positions[0] = position;
        (position, speed)
    }

    /// One tick in position control.
    pub(crate) fn position(&mut self, command: f64, position: f64, speed: f64) -> f64 {
        let (position, speed) = self.measured(position, speed);
        let error = command - position;
        let before = self.last_error.replace(error).unwrap_or(error);
        self.integrals.position(&self.law, self.tick_s, [error, before], speed)
    }

    /// One tick in speed control.
    pub(crate) fn speed(&mut self, command: f64, position: f64, speed: f64) -> f64 {
        let (_, speed) = self.measured(position, speed);
        self.integrals.regulate(&self.law, self.tick_s, command, speed).0
    }
}

/// Integral parts of a cascade.
#[derive(Clone, Copy, Debug)]
struct Integrals {
    position: f64,
    speed: f64,
}

impl Integrals {
    /// The output by the errors of the position, now and a tick before, and the speed.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    fn position(
        &mut self,
        law: &AxisController,
        tick_s: f64,
        [error, before]: [f64; 2],
        speed: f64,
    ) -> f64 {
        let rate = (error - before) / tick_s;
        let wanted =
            law.position_gain_per_s * error + self.position + law.position_derivative_ratio * rate;
        let step = law.position_integral_per_s2 * tick_s * error;
        let (output, saturated) =
            self.regulate(law, tick_s, within(wanted, law.speed_limit), speed);
        self.position = if saturated { self.position } else { self.position + step };
        output
    }

    /// The output by the speed asked for and the speed, and whether it is at its limit.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    fn regulate(
        &mut self,
        law: &AxisController,
        tick_s: f64,
        reference: f64,
        speed: f64,
    ) -> (f64, bool) {
        let error = reference - speed;
        let wanted = law.speed_gain * error + self.speed;
        let saturated = wanted.abs() >= law.output_limit;
        let step = law.speed_integral * tick_s * error;
        self.speed = if saturated { self.speed } else { self.speed + step };
        (within(wanted, law.output_limit), saturated)
    }
}
