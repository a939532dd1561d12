//! The surface behind an elastic shaft with play.
//!
//! ```text
//! J_u·θ'' = τ − T_load     τ = K·d + c·(ω_m/i_g − θ')    d the twist beyond the play
//! ```
//!
//! # Source
//!
//! Two-mass mechanics of motulator; the play as in `ElastoBacklash` of the Modelica Standard
//! Library, whose flanks push and never pull.
#![expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]

use crate::bounds::within;

/// Angle and speed of a shaft, at the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShaftState {
    pub(crate) angle_rad: f64,
    pub(crate) speed_rad_per_s: f64,
}

/// The surface behind an elastic shaft; angles at the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElasticShaft {
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) inertia: f64,
    pub(crate) half_play_rad: f64,
    pub(crate) efficiency_ratio: f64,
    pub(crate) angle_rad: f64,
    pub(crate) speed_rad_per_s: f64,
    pub(crate) load_n_m: f64,
    /// True where the machine moves the surface itself.
    pub(crate) followed: bool,
}

impl ElasticShaft {
    /// The surface as it stands.
    #[inline(always)]
    pub(crate) fn state(&self) -> ShaftState {
        ShaftState { angle_rad: self.angle_rad, speed_rad_per_s: self.speed_rad_per_s }
    }

    /// Torque that the shaft passes from a motor to a surface.
    #[inline(always)]
    pub(crate) fn passed_n_m(&self, motor: ShaftState, surface: ShaftState) -> f64 {
        let twist = motor.angle_rad - surface.angle_rad;
        let beyond = twist - within(twist, self.half_play_rad);
        let spring = self.stiffness * beyond;
        let damped = spring + self.damping * (motor.speed_rad_per_s - surface.speed_rad_per_s);
        // a flank pushes and never pulls
        if damped * spring > 0.0 { damped } else { 0.0 }
    }

    /// Torque against the motor side, still at the surface.
    #[inline(always)]
    pub(crate) fn felt_n_m(&self, passed_n_m: f64, speed: f64) -> f64 {
        let along = passed_n_m * speed;
        let driven = passed_n_m / self.efficiency_ratio;
        let driving = if along < 0.0 { passed_n_m * self.efficiency_ratio } else { passed_n_m };
        if along > 0.0 { driven } else { driving }
    }

    /// The surface after a span, with the shaft's torque as at the start of it.
    #[inline(always)]
    pub(crate) fn predicted(&self, motor: ShaftState, span_s: f64) -> ShaftState {
        let torque = self.passed_n_m(motor, self.state());
        let rate = (torque - self.load_n_m) / self.inertia;
        let turn = self.speed_rad_per_s * span_s + 0.5 * rate * span_s * span_s;
        ShaftState {
            angle_rad: self.angle_rad + turn,
            speed_rad_per_s: self.speed_rad_per_s + rate * span_s,
        }
    }

    /// Moves the surface over a span in which the motor side went from one state to another.
    #[inline(always)]
    pub(crate) fn advance(&mut self, from: ShaftState, to: ShaftState, span_s: f64) {
        let now = self.state();
        let guess = self.predicted(from, span_s);
        let mean = 0.5 * (self.passed_n_m(from, now) + self.passed_n_m(to, guess));
        let rate = (mean - self.load_n_m) / self.inertia;
        self.angle_rad += self.speed_rad_per_s * span_s + 0.5 * rate * span_s * span_s;
        self.speed_rad_per_s += rate * span_s;
    }
}
