//! Commands of simulated sets.

use core::f64::consts::TAU;

use crate::pages::chance::Chance;

/// Largest angle of the surface, rad.
const AMPLITUDE_RAD: f64 = 0.02;
/// Time in which a swing rises from rest, s.
const RISE_S: f64 = 0.2;
/// Length of a command, s.
pub(super) const SECONDS: f64 = 2.0;
/// Rate at which it is given, Hz.
pub(super) const RATE_HZ: f64 = 2000.0;
/// Time between two steps of a staircase and of a step itself, s.
const STAIR_S: f64 = 0.25;
const STEP_S: f64 = 0.1;
/// Sines of a sum, and of a recorded wandering.
const SINES: usize = 4;
const WANDERING_SINES: usize = 8;

/// Time from one fast step, and from one reversal, to the next: least and most, s.
const FAST_STEP_S: [f64; 2] = [0.08, 0.2];
const REVERSAL_S: [f64; 2] = [0.1, 0.4];
/// Speeds between reversals, rad/s.
const REVERSED_RAD_PER_S: [f64; 2] = [0.01, 0.06];

/// Kind of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Course {
    Chirp,
    Sine,
    MultiSine,
    Staircase,
    Wandering,
    /// Jumps from level to level.
    FastSteps,
    /// One speed after another, each against the one before.
    Reversals,
}

impl Course {
    /// Kinds of the sets that effects are hidden in.
    pub(super) const OF_SETS: [Self; 5] =
        [Self::Chirp, Self::Sine, Self::MultiSine, Self::Staircase, Self::Wandering];

    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Chirp => "chirp",
            Self::Sine => "sine",
            Self::MultiSine => "multi-sine",
            Self::Staircase => "staircase",
            Self::Wandering => "recorded",
            Self::FastSteps => "fast steps",
            Self::Reversals => "reversals",
        }
    }

    /// A command of the kind, rad, at [`RATE_HZ`].
    pub(super) fn draw(self, chance: &mut Chance) -> Vec<f64> {
        match self {
            Self::Chirp => {
                let (from_hz, to_hz) = (chance.between(0.5, 1.0), chance.between(4.0, 6.0));
                let growth = (to_hz - from_hz) / SECONDS;
                sampled(|t| {
                    let (hz, turns) = (from_hz + growth * t, from_hz * t + 0.5 * growth * t * t);
                    rise(t) * of_pace(hz) * (TAU * turns).sin()
                })
            }
            Self::Sine => {
                let hz = chance.between(1.0, 6.0);
                sampled(|t| rise(t) * of_pace(hz) * (TAU * hz * t).sin())
            }
            Self::MultiSine => sum(SINES, [0.5, 6.0], chance),
            Self::Staircase => staircase(chance),
            Self::Wandering => sum(WANDERING_SINES, [0.3, 1.5], chance),
            Self::FastSteps => fast_steps(chance),
            Self::Reversals => reversals(chance),
        }
    }
}

/// Amplitude of a sine so that fast ones need no more speed than slow ones, rad.
fn of_pace(hz: f64) -> f64 {
    AMPLITUDE_RAD / (1.0 + hz)
}

/// Smooth rise from 0 to 1.
fn rise(t: f64) -> f64 {
    smooth(t / RISE_S)
}

fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

fn sampled(at: impl FnMut(f64) -> f64) -> Vec<f64> {
    let samples = (SECONDS * RATE_HZ) as usize + 1;
    (0..samples).map(|n| n as f64 / RATE_HZ).map(at).collect()
}

/// Sum of sines of frequencies and phases that are drawn.
fn sum(count: usize, [least_hz, most_hz]: [f64; 2], chance: &mut Chance) -> Vec<f64> {
    let sine = |_| {
        let hz = chance.between(least_hz, most_hz);
        (hz, TAU * chance.uniform(), chance.between(0.3, 1.0))
    };
    let sines: Vec<(f64, f64, f64)> = (0..count).map(sine).collect();
    let of = |t: f64| {
        let one = |(hz, phase, size): &(f64, f64, f64)| {
            size * of_pace(*hz) * (TAU * hz * t + phase).sin()
        };
        rise(t) * sines.iter().map(one).sum::<f64>()
    };
    sampled(of)
}

/// Levels that are drawn, from one to the next without a jump.
fn staircase(chance: &mut Chance) -> Vec<f64> {
    let stairs = (SECONDS / STAIR_S) as usize;
    let level = |_| chance.between(-AMPLITUDE_RAD, AMPLITUDE_RAD);
    let levels: Vec<f64> = std::iter::once(0.0).chain((0..=stairs).map(level)).collect();
    sampled(|t| {
        let stair = (t / STAIR_S) as usize;
        let (from, to) = (levels[stair], levels[stair + 1]);
        from + (to - from) * smooth((t - stair as f64 * STAIR_S) / STEP_S)
    })
}

/// Levels that are drawn, each held for a time that is drawn too.
fn fast_steps(chance: &mut Chance) -> Vec<f64> {
    let (mut level, mut until_s) = (0.0, FAST_STEP_S[1]);
    sampled(|t| {
        if t >= until_s {
            level = chance.between(-AMPLITUDE_RAD, AMPLITUDE_RAD);
            until_s += chance.between(FAST_STEP_S[0], FAST_STEP_S[1]);
        }
        level
    })
}

/// Back and forth, at a speed and for a time that are drawn anew each way.
fn reversals(chance: &mut Chance) -> Vec<f64> {
    let [slowest, fastest] = REVERSED_RAD_PER_S;
    let (mut place, mut speed, mut until_s) = (0.0, 0.0, RISE_S);
    let mut way = if chance.uniform() < 0.5 { 1.0 } else { -1.0 };
    sampled(|t| {
        if t >= until_s {
            way = -way;
            speed = way * chance.between(slowest, fastest);
            until_s += chance.between(REVERSAL_S[0], REVERSAL_S[1]);
        }
        place += speed / RATE_HZ;
        place
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_begin_at_rest_and_follow_from_the_seed() {
        let more = [Course::FastSteps, Course::Reversals];
        for course in Course::OF_SETS.into_iter().chain(more) {
            let [a, b, other] = [1, 1, 2].map(|seed| course.draw(&mut Chance::new(seed)));
            assert!(a == b && a != other, "{}", course.word());
            assert!(a[0] == 0.0 && (a[1] - a[0]).abs() < 1e-5, "{}", course.word());
            assert!(a.iter().all(|x| x.abs() < 4.0 * AMPLITUDE_RAD), "{}", course.word());
        }
    }
}
