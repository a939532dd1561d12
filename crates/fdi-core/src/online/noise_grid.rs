//! Noise levels in steps: what is made for a step serves all levels about it.
//!
//! ```text
//! ln(σ_k/A) = k·h,   |ln σ − ln σ_k| ≤ h/2
//! ```

/// Step of the grid, `h`: `GridFactor` is good to 1e-3 within half of it.
const STEP_LN: f64 = 0.05;
/// Levels of the grid that have one level of the folds (`folds`).
const LEVELS_OF_FOLDS: f64 = 2.0;
/// Levels below this are far below the floor of every covariance, and have no grid, A.
const QUIETEST_A: f64 = 1e-6;

/// A noise level with the level of the grid that it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NoiseLevel {
    key: LevelKey,
    level_a: f64,
    grid_a: f64,
}

/// Level of the grid, or a level of its own by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum LevelKey {
    Step(i32),
    Own(u64),
}

impl NoiseLevel {
    /// A level with the nearest one of the grid.
    pub(crate) fn near(level_a: f64) -> Self {
        if level_a.is_nan() || level_a < QUIETEST_A {
            return Self::own(level_a);
        }
        let step = (level_a.ln() / STEP_LN).round();
        Self { key: LevelKey::Step(step as i32), level_a, grid_a: (step * STEP_LN).exp() }
    }

    /// The level at which folds of the reference errors are made for this one.
    pub(crate) fn of_folds(self) -> Self {
        match self.key {
            LevelKey::Step(step) => {
                let coarse = (f64::from(step) / LEVELS_OF_FOLDS).round() * LEVELS_OF_FOLDS;
                Self::near((coarse * STEP_LN).exp())
            }
            LevelKey::Own(_) => self,
        }
    }

    /// A level that stands for itself.
    pub(crate) fn own(level_a: f64) -> Self {
        Self { key: LevelKey::Own(level_a.to_bits()), level_a, grid_a: level_a }
    }

    /// Name of the level of the grid.
    pub(crate) fn key(self) -> LevelKey {
        self.key
    }

    /// Variance at the level of the grid, A².
    pub(crate) fn grid_variance_a2(self) -> f64 {
        self.grid_a * self.grid_a
    }

    /// Variance beyond that of the grid's level, A².
    pub(crate) fn excess_a2(self) -> f64 {
        match self.key {
            LevelKey::Step(_) => (self.level_a - self.grid_a) * (self.level_a + self.grid_a),
            LevelKey::Own(_) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_at_most_half_a_step_from_its_grid() {
        let mut level_a: f64 = 1e-5;
        while level_a < 10.0 {
            let level = NoiseLevel::near(level_a);
            let away = (level.level_a / level.grid_a).ln().abs();
            assert!(away <= 0.5 * STEP_LN + 1e-12, "{level:?}");
            let folds = level.of_folds();
            assert!(
                (level.level_a / folds.grid_a).ln().abs() <= 1.5 * STEP_LN + 1e-12,
                "{level:?}"
            );
            assert_eq!(folds.of_folds(), folds);
            let sum_a2 = level.grid_variance_a2() + level.excess_a2();
            assert!((sum_a2 / (level_a * level_a) - 1.0).abs() < 1e-12, "{level:?}");
            level_a *= 1.013;
        }
    }

    #[test]
    fn levels_of_one_step_share_its_key_and_no_others_do() {
        assert_eq!(NoiseLevel::near(0.0200).key(), NoiseLevel::near(0.0201).key());
        assert_ne!(NoiseLevel::near(0.0200).key(), NoiseLevel::near(0.0212).key());
        assert_ne!(NoiseLevel::own(0.02).key(), NoiseLevel::own(0.02f64.next_up()).key());
        assert_eq!(NoiseLevel::near(0.0).excess_a2(), 0.0);
    }
}
