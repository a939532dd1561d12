//! Phases, sectors and the six-step commutation pattern.

use core::f64::consts::{FRAC_PI_3, FRAC_PI_6};

/// One value for each of the phases A, B, C.
pub type PerPhase = [f64; 3];

/// The 60° sector of the six-step pattern that holds an electrical angle.
///
/// Sector `n` covers `[30° + 60°·n, 90° + 60°·n)`; the count goes on over the turns, so that a
/// crossing is a step of one.
///
/// ```text
/// n mod 6     0      1      2      3      4      5
/// conducts  A+B−   A+C−   B+C−   B+A−   C+A−   C+B−
/// idle        C      B      A      C      B      A
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sector(i64);

/// Phase that carries `+I` in each sector.
const POSITIVE: [usize; 6] = [0, 0, 1, 1, 2, 2];
/// Phase that carries `−I` in each sector.
const NEGATIVE: [usize; 6] = [1, 2, 2, 0, 0, 1];

impl Sector {
    /// The sector of an electrical angle.
    pub fn of_electrical_angle(theta_e_rad: f64) -> Self {
        Self(libm::floor((theta_e_rad - FRAC_PI_6) / FRAC_PI_3) as i64)
    }

    /// Sector from 1 to 6 within the electrical turn, as Hall sensors tell it.
    pub fn from_hall_state(state: u8) -> Option<Self> {
        (1..=6).contains(&state).then(|| Self(i64::from(state) - 1))
    }

    /// Running number of the sector.
    pub fn number(self) -> i64 {
        self.0
    }

    /// The sector `steps` further.
    #[must_use]
    pub(crate) fn shifted(self, steps: i64) -> Self {
        Self(self.0 + steps)
    }

    /// The sector at a place within the electrical turn.
    pub(crate) fn from_place(place: usize) -> Self {
        Self(place as i64)
    }

    /// Motor angles, from a start angle, at which the sector begins and ends.
    pub(crate) fn span_rad(self, pole_pairs: f64, start_angle_rad: f64) -> (f64, f64) {
        let at = |sector: Self| sector.begin_rad() / pole_pairs - start_angle_rad;
        (at(self), at(self.shifted(1)))
    }

    /// Place within the electrical turn, 0 to 5.
    pub(crate) fn place(self) -> usize {
        self.0.rem_euclid(6) as usize
    }

    /// Electrical angle at which the sector begins.
    pub(crate) fn begin_rad(self) -> f64 {
        FRAC_PI_6 + FRAC_PI_3 * self.0 as f64
    }

    /// Phase that carries `+I`.
    pub fn positive_phase(self) -> usize {
        POSITIVE[self.place()]
    }

    /// Phase that carries `−I`.
    pub fn negative_phase(self) -> usize {
        NEGATIVE[self.place()]
    }

    /// Phase without current.
    pub fn idle_phase(self) -> usize {
        3 - self.positive_phase() - self.negative_phase()
    }

    /// The six-step pattern `s_j`: +1, −1 or 0 for each phase.
    pub fn pattern(self) -> PerPhase {
        let mut s = [0.0; 3];
        s[self.positive_phase()] = 1.0;
        s[self.negative_phase()] = -1.0;
        s
    }
}

/// Follows the phase that goes on conducting through commutation.
///
/// Two neighbouring sectors share one conducting phase. Its current, with the sign of the
/// pattern, is continuous when the motor commutates, whichever way it turns; the other phase's
/// is not. Until the first commutation the positive phase is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContinuingPhase {
    sector: Sector,
    phase: usize,
    sign: f64,
}

impl ContinuingPhase {
    /// Starts in a sector.
    pub fn new(sector: Sector) -> Self {
        Self { sector, phase: sector.positive_phase(), sign: 1.0 }
    }

    /// Takes note of the present sector.
    pub fn update(&mut self, sector: Sector) {
        if sector == self.sector {
            return;
        }
        let before = self.sector;
        self.sector = sector;
        let positive = sector.positive_phase();
        let keeps = if before.positive_phase() == positive {
            Some((positive, 1.0))
        } else if before.negative_phase() == sector.negative_phase() {
            Some((sector.negative_phase(), -1.0))
        } else {
            None
        };
        (self.phase, self.sign) = keeps.unwrap_or((positive, 1.0));
    }

    /// The signed envelope `s_j·i_j` of the continuing phase.
    pub fn current_a(&self, phases_a: &PerPhase) -> f64 {
        self.sign * phases_a[self.phase]
    }

    /// Index of the continuing phase.
    pub fn phase(&self) -> usize {
        self.phase
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pattern_is_the_sign_of_the_flat_tops() {
        // s(x) = +1 on [30°, 150°), −1 on [210°, 330°), of phase j at x = θ − 120°·j
        for degree in 0..360 {
            let theta = f64::from(degree) + 0.5;
            let pattern = Sector::of_electrical_angle(theta.to_radians()).pattern();
            for (j, s) in pattern.iter().enumerate() {
                let x = (theta - 120.0 * j as f64).rem_euclid(360.0);
                let want = if (30.0..150.0).contains(&x) {
                    1.0
                } else if (210.0..330.0).contains(&x) {
                    -1.0
                } else {
                    0.0
                };
                assert_eq!(*s, want, "phase {j} at {theta}°");
            }
        }
    }

    #[test]
    fn the_continuing_phase_conducts_before_and_after_a_step() {
        for n in -7..7 {
            for step in [-1, 1] {
                let before = Sector(n);
                let after = before.shifted(step);
                let mut follow = ContinuingPhase::new(before);
                follow.update(after);
                assert_ne!(follow.phase(), before.idle_phase());
                assert_ne!(follow.phase(), after.idle_phase());
                let mut i = [0.0; 3];
                i[follow.phase()] = before.pattern()[follow.phase()];
                assert_eq!(follow.current_a(&i), 1.0);
            }
        }
    }
}
