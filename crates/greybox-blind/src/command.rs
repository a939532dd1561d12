//! The menu of safe recordings: commands and known loads, sampled at 2 kHz.

use core::f64::consts::TAU;

use crate::{
    chance::Chance,
    machine::{Machine, RATE_HZ},
};

/// Command and load of a recording; both straight between samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Command, rad, from the start angle of a servo axis and from zero of the actuator's surface.
    pub command_rad: Vec<f64>,
    /// Load against positive motion, N·m.
    pub load_n_m: Vec<f64>,
}

/// An entry of the menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Move {
    /// Slow steps with smooth edges, up and down.
    Staircase,
    /// A sum of sines.
    MultiSine,
    /// A sine of rising frequency.
    Chirp,
    /// Straight there and back, at several speeds.
    Ramps,
    /// Trapezoids of speed with dwells.
    Trapezoids,
    /// A sine with steps of the load.
    LoadedSine,
    /// One way at a steady speed, from the first sample on.
    OneWay,
    /// There and back at one speed, from the first sample on.
    Triangle,
}

impl Move {
    /// The six of ordinary cases; the others tie effects to one another.
    pub const MENU: [Self; 6] = [
        Self::Staircase,
        Self::MultiSine,
        Self::Chirp,
        Self::Ramps,
        Self::Trapezoids,
        Self::LoadedSine,
    ];

    /// Name in truths.
    pub fn name(self) -> &'static str {
        match self {
            Self::Staircase => "staircase",
            Self::MultiSine => "multi-sine",
            Self::Chirp => "chirp",
            Self::Ramps => "ramps",
            Self::Trapezoids => "trapezoids",
            Self::LoadedSine => "loaded-sine",
            Self::OneWay => "one-way",
            Self::Triangle => "triangle",
        }
    }
}

/// Limits of commands for a machine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Travel either way, speed and acceleration, at the surface.
    travel: f64,
    speed: f64,
    acceleration: f64,
    pub(crate) load: f64,
}

impl Limits {
    pub(crate) fn of(machine: Machine) -> Self {
        match machine {
            Machine::Ema48 => Self { travel: 0.06, speed: 0.4, acceleration: 12.0, load: 40.0 },
            Machine::Servo => Self { travel: 8.0, speed: 45.0, acceleration: 1200.0, load: 0.2 },
        }
    }
}

/// Draws a course of a kind.
pub(crate) fn draw(kind: Move, machine: Machine, seconds: f64, chance: &mut Chance) -> Course {
    let limits = Limits::of(machine);
    let samples = libm::round(seconds * RATE_HZ) as usize;
    let rest_s = match kind {
        Move::OneWay | Move::Triangle => 0.0,
        _ => chance.between(0.35, 0.5),
    };
    let shape = shape(kind, &limits, seconds - rest_s, chance);
    let command_rad = (0..samples)
        .map(|n| {
            let time_s = n as f64 / RATE_HZ - rest_s;
            if time_s > 0.0 { shape(time_s) } else { 0.0 }
        })
        .collect();
    let loaded = kind == Move::LoadedSine;
    let load_n_m = if loaded { load_steps(&limits, samples, chance) } else { vec![0.0; samples] };
    Course { command_rad, load_n_m }
}

/// A load that changes in steps, both signs, after a second without.
pub(crate) fn load_steps(limits: &Limits, samples: usize, chance: &mut Chance) -> Vec<f64> {
    let mut load = vec![0.0; samples];
    let (mut next_s, mut now) = (1.0, 0.0);
    for (n, value) in load.iter_mut().enumerate() {
        if n as f64 / RATE_HZ >= next_s {
            now = limits.load * chance.one_of(&[-1.0, -0.6, 0.0, 0.4, 0.7, 1.0]);
            next_s += chance.between(0.5, 0.9);
        }
        *value = now;
    }
    load
}

type Shape = Box<dyn Fn(f64) -> f64>;

fn shape(kind: Move, limits: &Limits, seconds: f64, chance: &mut Chance) -> Shape {
    match kind {
        Move::Staircase => staircase(limits, seconds, chance),
        Move::MultiSine => multi_sine(limits, chance),
        Move::Chirp => chirp(limits, seconds, chance),
        Move::Ramps => ramps(limits, seconds, chance),
        Move::Trapezoids => trapezoids(limits, seconds, chance),
        Move::LoadedSine => {
            let hz = chance.between(0.4, 0.9);
            let size =
                limits.travel.min(0.5 * limits.speed / (TAU * hz)) * chance.between(0.7, 1.0);
            Box::new(move |t| size * libm::sin(TAU * hz * t))
        }
        Move::OneWay => {
            let speed = chance.sign() * limits.travel / seconds * chance.between(0.6, 1.0);
            Box::new(move |t| speed * t)
        }
        Move::Triangle => {
            let (periods, size) =
                (chance.between(1.2, 2.2), limits.travel * chance.between(0.5, 1.0));
            let period = seconds / periods;
            Box::new(move |t| {
                let phase = t / period - libm::floor(t / period);
                size * if phase < 0.25 {
                    4.0 * phase
                } else if phase < 0.75 {
                    2.0 - 4.0 * phase
                } else {
                    4.0 * phase - 4.0
                }
            })
        }
    }
}

/// From 0 to 1 without a jump of speed.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

fn staircase(limits: &Limits, seconds: f64, chance: &mut Chance) -> Shape {
    let levels = 3 + chance.index(3);
    let count = 4 * levels;
    let dwell = seconds / count as f64;
    let edge = dwell * chance.between(0.3, 0.7);
    // the smooth edge is steepest at 1.5 times its mean speed
    let step = (limits.travel * chance.between(0.5, 0.9) / levels as f64)
        .min(limits.speed * edge / 1.5)
        .min(limits.acceleration * edge * edge / 6.0)
        * chance.sign();
    Box::new(move |t| {
        let place = |n: f64| {
            // up, down through zero to the other side, and back
            let m = n - 4.0 * levels as f64 * libm::floor(n / (4.0 * levels as f64));
            let l = levels as f64;
            if m <= l {
                m
            } else if m <= 3.0 * l {
                2.0 * l - m
            } else {
                m - 4.0 * l
            }
        };
        let n = libm::floor(t / dwell);
        let within = smooth((t - n * dwell) / edge);
        step * (place(n) + (place(n + 1.0) - place(n)) * within)
    })
}

fn multi_sine(limits: &Limits, chance: &mut Chance) -> Shape {
    let count = 3 + chance.index(4);
    let tones: Vec<(f64, f64, f64)> = (0..count)
        .map(|_| {
            let hz = chance.log_between(0.2, 5.0);
            let share = 0.6 / count as f64;
            let most = (limits.travel * share)
                .min(limits.speed * share / (TAU * hz))
                .min(limits.acceleration * share / (TAU * hz * TAU * hz));
            (most * chance.between(0.5, 1.0), hz, chance.angle())
        })
        .collect();
    // faded in, so that it begins at rest
    let at_start: f64 = tones.iter().map(|(a, _, p)| a * libm::sin(*p)).sum();
    Box::new(move |t| {
        let sum: f64 = tones.iter().map(|(a, hz, p)| a * libm::sin(TAU * hz * t + p)).sum();
        (sum - at_start) * smooth(t / 0.4)
    })
}

fn chirp(limits: &Limits, seconds: f64, chance: &mut Chance) -> Shape {
    let (from, to) = (chance.between(0.1, 0.3), chance.between(3.0, 7.0));
    let size = (limits.travel * 0.7)
        .min(0.8 * limits.speed / (TAU * to))
        .min(limits.acceleration / (TAU * to * TAU * to))
        * chance.between(0.7, 1.0);
    Box::new(move |t| size * libm::sin(TAU * (from * t + 0.5 * (to - from) / seconds * t * t)))
}

fn ramps(limits: &Limits, seconds: f64, chance: &mut Chance) -> Shape {
    let mut knots = vec![(0.0, 0.0)];
    let (mut time, mut at, mut way) = (0.0, 0.0_f64, chance.sign());
    while time < seconds {
        let speed = limits.speed * chance.log_between(0.02, 0.6);
        let to = way * limits.travel * chance.between(0.2, 0.9);
        let takes = ((to - at).abs() / speed).clamp(0.15, 0.6 * seconds);
        time += takes;
        at = to;
        way = -way;
        knots.push((time, at));
    }
    Box::new(move |t| {
        let next = knots.partition_point(|(time, _)| *time <= t).min(knots.len() - 1).max(1);
        let ((t0, x0), (t1, x1)) = (knots[next - 1], knots[next]);
        x0 + (x1 - x0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
    })
}

fn trapezoids(limits: &Limits, seconds: f64, chance: &mut Chance) -> Shape {
    // each: start, length of the motion, from, to, share of acceleration
    let mut moves: Vec<(f64, f64, f64, f64, f64)> = Vec::new();
    let (mut time, mut at) = (0.0, 0.0_f64);
    while time < seconds {
        let to = limits.travel * chance.between(-0.9, 0.9);
        let share = chance.between(0.15, 0.4);
        let speed = limits.speed * chance.between(0.1, 0.6);
        let way = (to - at).abs().max(1e-9);
        let takes = (way / (speed * (1.0 - share)))
            .max(libm::sqrt(way / (share * (1.0 - share) * 0.5 * limits.acceleration)))
            .max(0.1);
        moves.push((time, takes, at, to, share));
        time += takes + chance.between(0.15, 0.4);
        at = to;
    }
    Box::new(move |t| {
        let before = moves.partition_point(|m| m.0 <= t).max(1) - 1;
        let (start, takes, from, to, share) = moves[before];
        let x = ((t - start) / takes).clamp(0.0, 1.0);
        let peak = 1.0 / (1.0 - share);
        let way = if x < share {
            0.5 * peak * x * x / share
        } else if x < 1.0 - share {
            peak * (x - 0.5 * share)
        } else {
            1.0 - 0.5 * peak * (1.0 - x) * (1.0 - x) / share
        };
        from + (to - from) * way
    })
}
