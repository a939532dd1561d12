//! Damage that machines in service are assumed to have.
//!
//! ```text
//! k₁ … k₅:   p(k) = (1 − ε)·e^(−k/m)/m + ε·e^(−k/(10·m))/(10·m)         m: half the level for watching
//! (x, y):    p = (1 − ε)·N(0, s²) + ε·N(0, (10·s)²)                     P(ρ > level) = e^(−2) of the first
//! ```
//!
//! Most machines have less damage of a kind than is watched; one in fifty ([`SEVERE_SHARE`]) has damage of
//! another order. Without the second part a recording that shows twice the level for acting would be
//! doubted: an exponential has one machine in ten thousand millions there.

use fdi_report::{ActionLevels, BACKLASH_GAIN, FRICTION_GAIN, FaultId, Limits};

/// Share of the machines in service whose damage of a kind is of another order.
pub const SEVERE_SHARE: f64 = 0.02;
/// Size of that damage over that of the other machines.
pub const SEVERE_TIMES: f64 = 10.0;
/// Chance that one of the other machines has damage of a kind above the level at which it is watched.
const ABOVE_WATCH: f64 = 0.135_335_283_236_612_7;
/// Least friction or play that an answer is taken to say, over that as built.
const LEAST_SHARE: f64 = 0.05;
/// Kinds of damage: k1 to k5, and the eccentricity.
pub(super) const KINDS: usize = 6;

/// Kind of the damage of a coordinate.
pub(super) fn kind_of(index: usize) -> usize {
    index.min(KINDS - 1)
}

/// One coordinate of the damage, as it is drawn, with one part of its prior.
#[derive(Clone, Copy)]
pub(super) enum Coordinate {
    /// `u = ln(1 + gain·k)`, `k` exponential with a rate.
    Share { gain: f64, rate: f64 },
    /// `u = k`, exponential with a rate.
    Level { rate: f64 },
    /// `u` a coordinate of the eccentricity, normal with a precision.
    Eccentricity { precision: f64 },
}

impl Coordinate {
    /// The coordinate of that index in `FaultCoordinates::NAMES`, of machines with severe damage of this
    /// kind or of the others.
    pub(super) fn of(index: usize, levels: &ActionLevels, is_severe: bool) -> Self {
        let times = if is_severe { SEVERE_TIMES } else { 1.0 };
        let watch = times * levels.watch[kind_of(index)];
        if index >= KINDS - 1 {
            let spread = watch / (-2.0 * ABOVE_WATCH.ln()).sqrt();
            return Self::Eccentricity { precision: spread.powi(-2) };
        }
        let rate = -ABOVE_WATCH.ln() / watch;
        match index {
            0 => Self::Share { gain: FRICTION_GAIN, rate },
            1 => Self::Share { gain: BACKLASH_GAIN, rate },
            _ => Self::Level { rate },
        }
    }

    pub(super) fn scaled(self, level: f64) -> f64 {
        match self {
            Self::Share { gain, .. } => (1.0 + gain * level).max(LEAST_SHARE).ln(),
            _ => level,
        }
    }

    /// `du/dk` at a level.
    pub(super) fn slope(self, level: f64) -> f64 {
        match self {
            Self::Share { gain, .. } => gain / (1.0 + gain * level).max(LEAST_SHARE),
            _ => 1.0,
        }
    }

    pub(super) fn level(self, u: f64) -> f64 {
        match self {
            Self::Share { gain, .. } => u.exp_m1() / gain,
            _ => u,
        }
    }

    /// Logarithm of the prior's density in `u`, up to what both of its parts have in common, with its first
    /// two derivatives.
    pub(super) fn ln_prior(self, u: f64) -> [f64; 3] {
        match self {
            Self::Share { gain, rate } => {
                // a decay of what is beyond none, so that the scale of the exponential is its rate
                let decay = rate / gain * u.exp();
                [rate.ln() + rate / gain + u - decay, 1.0 - decay, -decay]
            }
            Self::Level { rate } => [rate.ln() - rate * u, -rate, 0.0],
            Self::Eccentricity { precision } => {
                [0.5 * precision.ln() - 0.5 * precision * u * u, -precision * u, -precision]
            }
        }
    }

    /// The parabola of the logarithm of the prior's density around `at`, at `u`.
    pub(super) fn near(self, at: f64, u: f64) -> f64 {
        let [summit, slope, curvature] = self.ln_prior(at);
        let off = u - at;
        summit + slope * off + 0.5 * curvature * off * off
    }

    /// True where it has no sign.
    pub(super) fn is_cut(self) -> bool {
        !matches!(self, Self::Eccentricity { .. })
    }

    /// The nearest value that exists.
    pub(super) fn existing(self, u: f64) -> f64 {
        if self.is_cut() { u.max(0.0) } else { u }
    }
}

/// Probability that a machine in service has damage of a kind above its levels.
pub(super) fn prior_above(id: FaultId, watch: f64, act: f64) -> Limits {
    let part = |limit: f64, times: f64| {
        let share = limit / (times * watch);
        ABOVE_WATCH.powf(if id == FaultId::K6 { share * share } else { share })
    };
    let above = |limit: f64| {
        (1.0 - SEVERE_SHARE) * part(limit, 1.0) + SEVERE_SHARE * part(limit, SEVERE_TIMES)
    };
    Limits { watch: above(watch), act: above(act) }
}
