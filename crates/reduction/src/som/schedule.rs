/// A quantity that shrinks from epoch to epoch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    /// Value in the first epoch.
    pub start: f64,
    /// How it goes on.
    pub decay: Decay,
}

/// How a [`Schedule`] goes on after the first epoch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Decay {
    /// Stays at its start.
    Constant,
    /// `start·(1 + 2t/T)⁻¹`, a third of the start after the last epoch
    /// (`MiniSom`'s `asymptotic_decay`).
    Inverse,
    /// Straight to this value in the last epoch.
    LinearTo(f64),
    /// By a constant factor to this value in the last epoch.
    ExponentialTo(f64),
}

impl Schedule {
    /// A schedule that stays at `value`.
    pub const fn constant(value: f64) -> Self {
        Self { start: value, decay: Decay::Constant }
    }

    /// A schedule with [`Decay::Inverse`].
    pub const fn inverse(start: f64) -> Self {
        Self { start, decay: Decay::Inverse }
    }

    /// Value in epoch `epoch` of `epochs`.
    pub fn at(&self, epoch: usize, epochs: usize) -> f64 {
        let fraction = epoch as f64 / (epochs.max(2) - 1) as f64;
        match self.decay {
            Decay::Constant => self.start,
            Decay::Inverse => self.start / (1.0 + epoch as f64 / (epochs as f64 / 2.0)),
            Decay::LinearTo(end) => self.start + (end - self.start) * fraction,
            Decay::ExponentialTo(end) => self.start * (end / self.start).powf(fraction),
        }
    }

    /// Tells whether start and end are positive and finite.
    pub(crate) fn is_positive(&self) -> bool {
        let end = match self.decay {
            Decay::Constant | Decay::Inverse => self.start,
            Decay::LinearTo(end) | Decay::ExponentialTo(end) => end,
        };
        [self.start, end].iter().all(|value| value.is_finite() && *value > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::{Decay, Schedule};

    #[test]
    fn schedules_end_where_they_say() {
        for (decay, last) in [
            (Decay::Constant, 2.0),
            (Decay::Inverse, 2.0 / 2.8),
            (Decay::LinearTo(0.5), 0.5),
            (Decay::ExponentialTo(0.5), 0.5),
        ] {
            let schedule = Schedule { start: 2.0, decay };
            assert_eq!(schedule.at(0, 10), 2.0);
            assert!((schedule.at(9, 10) - last).abs() < 1e-15, "{decay:?}");
        }
    }
}
