//! Friction of elastic elements before they slip.

/// Friction of elastic elements.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bristles {
    pub(super) deflection: f64,
    pub(super) damping: f64,
    pub(super) fall_speed: f64,
    pub(super) dahl: bool,
    /// Force of each element when the shaft was at `at`.
    pub(super) force: [f64; 4],
    pub(super) at: f64,
}

/// Level of dry friction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    pub(super) kinetic: f64,
    /// Friction that a stop holds.
    pub(super) fixed: f64,
}

/// Share of the friction that each element carries, and of the deflection at which it slips.
const ELEMENTS: [(f64, f64); 4] = [(0.3, 0.25), (0.3, 0.5), (0.2, 0.75), (0.2, 1.0)];

impl Bristles {
    /// Forces at an angle and speed, with kinetic and static friction.
    pub(super) fn forces(&self, angle: f64, speed: f64, level: Level) -> [f64; 4] {
        let Level { kinetic, fixed } = level;
        let x = speed / self.fall_speed;
        let rise = 1.0 + (fixed / kinetic.max(1e-12) - 1.0).max(0.0) / (1.0 + x * x);
        let turn = angle - self.at;
        if self.dahl {
            let most = kinetic * rise;
            let end = most.copysign(turn);
            let left = libm::exp(-turn.abs() / self.deflection);
            return [end + (self.force[0] - end) * left, 0.0, 0.0, 0.0];
        }
        core::array::from_fn(|n| {
            let (share, slip) = ELEMENTS[n];
            let most = share * kinetic * rise;
            (self.force[n] + share * kinetic / (slip * self.deflection) * turn).clamp(-most, most)
        })
    }

    pub(super) fn torque(&self, angle: f64, speed: f64, level: Level) -> f64 {
        let whole: f64 = self.forces(angle, speed, level).iter().sum();
        let resting = (1.0 - (whole / level.kinetic.max(1e-12)).abs()).clamp(0.0, 1.0);
        whole + self.damping * speed * resting
    }
}
