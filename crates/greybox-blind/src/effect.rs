//! Effects that can be hidden: those of the catalogue in forms of this crate's own, and some that
//! no catalogue has. Torques are against positive motion, on the motor's shaft.

use core::f64::consts::{PI, TAU};

use libm::{cos, exp, pow, sin, sqrt};

use crate::{
    chance::Chance,
    machine::{Machine, Numbers},
};

/// An effect: a form of unit size, and its size.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hidden {
    /// Catalogue symbol, or `X1` to `X6` for what is outside.
    pub(crate) symbol: &'static str,
    pub(crate) form: Form,
    /// Amplitude, in the unit of the form.
    pub(crate) size: f64,
}

/// One wave over an angle with an overtone: `sin(n·x + φ) + b·sin(2·n·x + ψ)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wave {
    pub(crate) order: f64,
    pub(crate) phase: f64,
    pub(crate) overtone: f64,
    pub(crate) overtone_phase: f64,
}

impl Wave {
    pub(crate) fn at(&self, x: f64) -> f64 {
        sin(self.order * x + self.phase)
            + self.overtone * sin(2.0 * self.order * x + self.overtone_phase)
    }

    /// Slope over the angle.
    pub(crate) fn slope(&self, x: f64) -> f64 {
        self.order * cos(self.order * x + self.phase)
            + 2.0 * self.order * self.overtone * cos(2.0 * self.order * x + self.overtone_phase)
    }
}

/// A bump of friction: centre, half-width, height.
pub(crate) type Bump = (f64, f64, f64);

/// Action of an effect per unit of its size `a`; `s` is the sign of the speed `ω`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Form {
    /// `a·s/(1 + (ω/ω_s)²)`, N·m.
    Lorentzian { speed: f64 },
    /// Friction falling with speed by a table, straight between, N·m.
    FallingTable { knots: [(f64, f64); 5] },
    /// `a·s·|ω/ω_0|ⁿ`, N·m.
    Power { speed: f64, exponent: f64 },
    /// `a·(ω/ω_c)/(1 + (ω/ω_c)²)^m`, N·m: thinning grease.
    Thinning { speed: f64, exponent: f64 },
    /// Dry friction more by `a` forward, less by it backward, N·m.
    UnequalDry,
    /// `a·|ω|/ω_0`, N·m.
    UnequalDrag { speed: f64 },
    /// `a·s·(√(T² + c²) − c)`, of the load's torque on the motor's side; no unit.
    RubbingLoad { corner: f64 },
    /// Elastic friction of four elements that slip one after another; rad.
    FourElements { damping: f64, fall_speed: f64 },
    /// Dahl's friction; rad.
    Dahl { damping: f64, fall_speed: f64 },
    /// Bumps of friction over the surface's position, N·m.
    Worn { bumps: Vec<Bump>, cosine: bool },
    /// Dry friction times `1 − a·(warmth)` with two time constants; no unit.
    Warming { fast_s: f64, slow_s: f64 },
    /// Elastic shaft between motor and load, hardening; rad/N·m.
    Elastic { load_share: f64, damping_ratio: f64, hardening: f64 },
    /// The position behind the gear is off by a wave over the motor's angle; rad.
    GearError(Wave),
    /// `a·sin(θ + φ)` of the surface, N·m.
    Pendulum { phase: f64 },
    /// `a·(x + h·x³)`, `x` position over a travel, N·m.
    Spring { travel: f64, hardening: f64 },
    /// A wave over the motor's angle, modulated over the turn by 10 %, N·m.
    Cogs { wave: Wave, modulation_phase: f64 },
    /// Torque times `1 + a·wave`; no unit.
    TorqueWave(Wave),
    /// Torque constant over `√(1 + a·I²)`; 1/A².
    Saturating,
    /// Torque constant times `1 − a`.
    WeakMagnet,
    /// The current sensor's reading times `1 + a`.
    ReadingGain,
    /// … plus `a`, A.
    ReadingOffset,
    /// … late by `a`, s.
    ReadingLate,
    /// The position sensor is late by `a`, s.
    PositionLate,
    /// The position sensor's disc is off centre, with an overtone; rad.
    Disc(Wave),
    /// Gains of the loop off: shares of `a` on position gain, speed gain and integral.
    Gains { shares: [f64; 3] },
    /// The output acts later by `a`, s.
    OutputLate,
    /// `a·(sin(2π·f·t + φ) + 0.15·sin(4π·f·t + ψ))`, phases new in each recording; N·m.
    Shaking { hz: f64 },
    /// The back-EMF's shape: `(1 − a)` of the trapezoid and `a` of a sine.
    RoundedEmf,
    /// Torque falls by `a` after a commutation and comes back along a cosine.
    Dip { length_s: f64 },
    /// Hall marks off by `a` times shares, electrical rad.
    Halls { shares: [f64; 3] },
    /// `a·(ω/ω_0)·sin(2π·x/L + φ)`: no catalogue has it; N·m.
    PositionTimesSpeed { length: f64, phase: f64, speed: f64 },
    /// Random pulses of torque, N·m.
    Pulses { per_s: f64, length_s: f64 },
    /// A load that jumps between two values, N·m.
    Telegraph { dwell_s: f64 },
    /// A load that follows a chaotic oscillator, N·m.
    Chaotic { rate: f64 },
    /// Play in the position's path that closes with speed; rad.
    RatePlay { speed: f64 },
    /// Torque constant with hysteresis in the current: `T = k·(I − a·play(I))`.
    HystereticTorque { width_a: f64 },
}

/// Catalogue effects that are hidden in a machine.
pub(crate) fn catalogue(machine: Machine) -> &'static [&'static str] {
    match machine {
        Machine::Ema48 => &[
            "E01", "E02", "E03", "E04", "E05", "E06", "E07", "E09", "E10", "E11", "E12", "E13",
            "E14", "E19", "E22", "E23", "E24", "E25",
        ],
        Machine::Servo => &[
            "E01", "E02", "E03", "E04", "E05", "E06", "E07", "E08", "E09", "E10", "E11", "E12",
            "E13", "E14", "E19", "E20", "E21", "E22",
        ],
    }
}

/// Effects outside the catalogue.
pub(crate) const OUTSIDE: [&str; 6] = ["X1", "X2", "X3", "X4", "X5", "X6"];

/// Scale of an effect as far as it depends on the machine.
struct Scale {
    /// A speed in the middle of what recordings have, motor side.
    speed: f64,
    travel: f64,
    dry: f64,
    load: f64,
    current: f64,
    orders: [f64; 4],
    ripple_orders: [f64; 2],
    deflection: (f64, f64),
}

impl Scale {
    fn of(machine: Machine) -> Self {
        match machine {
            Machine::Ema48 => Self {
                speed: 80.0,
                travel: 0.04,
                dry: 0.03,
                load: 0.08,
                current: 3.0,
                orders: [12.0, 18.0, 24.0, 36.0],
                ripple_orders: [24.0, 12.0],
                deflection: (4e-3, 0.04),
            },
            Machine::Servo => Self {
                speed: 15.0,
                travel: 5.0,
                dry: 0.035,
                load: 0.2,
                current: 2.0,
                orders: [6.0, 12.0, 18.0, 24.0],
                ripple_orders: [24.0, 18.0],
                deflection: (8e-3, 0.08),
            },
        }
    }
}

/// Draws the form of an effect, and the largest size that is physical: of an elastic shaft and of
/// motion before sliding the size itself.
pub(crate) fn draw(symbol: &str, numbers: &Numbers, chance: &mut Chance) -> (Form, f64) {
    let machine = numbers.machine;
    let scale = Scale::of(machine);
    match symbol {
        "E01" | "E02" | "E03" | "E04" | "E05" | "E06" | "E07" => rubbing(symbol, &scale, chance),
        "E08" | "E09" | "E10" | "E20" | "E21" | "E22" => moving(symbol, &scale, numbers, chance),
        "E11" | "E12" | "E13" | "E14" | "E19" | "E23" | "E24" | "E25" => {
            turning(symbol, &scale, chance)
        }
        _ => outside(symbol, &scale, numbers, chance),
    }
}

fn rubbing(symbol: &str, scale: &Scale, chance: &mut Chance) -> (Form, f64) {
    match symbol {
        "E01" if chance.chance(0.7) => {
            (Form::Lorentzian { speed: scale.speed * chance.log_between(0.02, 0.25) }, scale.dry)
        }
        "E01" => {
            let speed = scale.speed * chance.log_between(0.03, 0.25);
            let mut height = 1.0;
            let knots = [0.0, 0.5, 1.0, 2.0, 4.0].map(|at| {
                let knot = (at * speed, height);
                height *= chance.between(0.25, 0.6);
                knot
            });
            (Form::FallingTable { knots }, scale.dry)
        }
        "E02" if chance.chance(0.6) => {
            let exponent = if chance.chance(0.5) {
                chance.between(0.3, 0.7)
            } else {
                chance.between(1.5, 2.4)
            };
            (Form::Power { speed: scale.speed, exponent }, scale.dry)
        }
        "E02" => {
            let speed = scale.speed * chance.log_between(0.1, 0.5);
            (Form::Thinning { speed, exponent: chance.between(0.35, 0.75) }, 2.0 * scale.dry)
        }
        "E03" if chance.chance(0.5) => (Form::UnequalDry, 0.4 * scale.dry),
        "E03" => (Form::UnequalDrag { speed: scale.speed }, 0.6 * scale.dry),
        "E04" => (Form::RubbingLoad { corner: scale.load * chance.between(0.005, 0.03) }, 0.25),
        "E05" => {
            let (fall_speed, damping) =
                (scale.speed * chance.log_between(0.004, 0.03), chance.between(0.2, 0.5));
            let form = if chance.chance(0.6) {
                Form::FourElements { damping, fall_speed }
            } else {
                Form::Dahl { damping, fall_speed }
            };
            (form, chance.log_between(scale.deflection.0, scale.deflection.1))
        }
        "E06" => {
            let cosine = chance.chance(0.6);
            let count = if cosine { 1 } else { 3 };
            let bumps = (0..count)
                .map(|_| {
                    let centre = scale.travel * chance.between(-0.7, 0.7);
                    let width = scale.travel * chance.between(0.15, 0.5);
                    (centre, width, if cosine { 1.0 } else { chance.between(0.4, 1.0) })
                })
                .collect();
            (Form::Worn { bumps, cosine }, scale.dry)
        }
        _ => {
            let fast_s = chance.log_between(0.4, 1.5);
            (Form::Warming { fast_s, slow_s: fast_s * chance.between(2.0, 6.0) }, 0.5)
        }
    }
}

fn moving(symbol: &str, scale: &Scale, numbers: &Numbers, chance: &mut Chance) -> (Form, f64) {
    let servo = numbers.machine == Machine::Servo;
    match symbol {
        "E08" => {
            let load_share = chance.between(0.3, 0.6);
            let (damping_ratio, hardening) = (chance.between(0.03, 0.1), chance.between(0.0, 0.3));
            let inertia = numbers.inertia();
            let both = load_share * (1.0 - load_share) * inertia;
            let swing = TAU * chance.log_between(80.0, 400.0);
            (Form::Elastic { load_share, damping_ratio, hardening }, 1.0 / (both * swing * swing))
        }
        "E09" => {
            let order =
                if servo { chance.one_of(&[3.0, 5.0, 8.0]) } else { 1.0 + chance.index(3) as f64 };
            (Form::GearError(wave(order, 0.15, chance)), if servo { 0.01 } else { 1e-4 })
        }
        "E10" if chance.chance(0.5) => (Form::Pendulum { phase: chance.angle() }, 1.5 * scale.dry),
        "E10" => {
            let hardening = chance.between(0.0, 0.2);
            (Form::Spring { travel: scale.travel, hardening }, 1.5 * scale.dry)
        }
        "E20" if chance.chance(0.5) => (Form::PositionLate, 4e-3),
        "E20" => (Form::Disc(wave(1.0, 0.1, chance)), 0.02),
        "E21" if chance.chance(0.4) => (Form::OutputLate, 3e-3),
        "E21" => {
            let mut shares = [0.0; 3];
            shares[chance.index(3)] = chance.sign();
            (Form::Gains { shares }, 0.5)
        }
        _ => (Form::Shaking { hz: chance.log_between(4.0, 60.0) }, scale.dry),
    }
}

fn turning(symbol: &str, scale: &Scale, chance: &mut Chance) -> (Form, f64) {
    match symbol {
        "E11" => {
            let wave = wave(chance.one_of(&scale.orders), chance.between(0.0, 0.35), chance);
            (Form::Cogs { wave, modulation_phase: chance.angle() }, 0.5 * scale.dry)
        }
        "E12" => {
            let order = chance.one_of(&scale.ripple_orders);
            (Form::TorqueWave(wave(order, chance.between(0.0, 0.3), chance)), 0.15)
        }
        "E13" => (Form::Saturating, 0.6 / (scale.current * scale.current)),
        "E14" => (Form::WeakMagnet, 0.25),
        "E19" => match chance.index(3) {
            0 => (Form::ReadingOffset, 0.3),
            1 => (Form::ReadingGain, 0.2),
            _ => (Form::ReadingLate, 5e-3),
        },
        "E23" => (Form::RoundedEmf, 0.9),
        "E24" => (Form::Dip { length_s: chance.log_between(3e-4, 2e-3) }, 0.8),
        _ => {
            let shares = [0.0; 3].map(|_| chance.between(0.85, 1.15));
            (Form::Halls { shares }, 0.4)
        }
    }
}

fn outside(symbol: &str, scale: &Scale, numbers: &Numbers, chance: &mut Chance) -> (Form, f64) {
    match symbol {
        "X1" => {
            let length = scale.travel * chance.between(0.5, 1.2);
            let phase = chance.angle();
            (Form::PositionTimesSpeed { length, phase, speed: scale.speed }, 2.0 * scale.dry)
        }
        "X2" => {
            let per_s = chance.log_between(1.0, 8.0);
            (Form::Pulses { per_s, length_s: chance.log_between(0.01, 0.08) }, 2.0 * scale.dry)
        }
        "X3" => (Form::Telegraph { dwell_s: chance.log_between(0.08, 0.5) }, scale.dry),
        "X4" => (Form::Chaotic { rate: chance.log_between(5.0, 30.0) }, scale.dry),
        "X5" => {
            let most = if numbers.machine == Machine::Servo { 0.03 } else { 1e-3 };
            (Form::RatePlay { speed: scale.speed * chance.between(0.3, 1.0) }, most)
        }
        _ => (Form::HystereticTorque { width_a: scale.current * chance.between(0.1, 0.3) }, 0.5),
    }
}

/// A wave of an order with random phases.
pub(crate) fn wave(order: f64, overtone: f64, chance: &mut Chance) -> Wave {
    Wave { order, phase: chance.angle(), overtone, overtone_phase: chance.angle() }
}

/// Where the machine stands, for the torques of effects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Here {
    pub(crate) time_s: f64,
    /// Motor angle, absolute, and speed.
    pub(crate) motor: f64,
    pub(crate) speed: f64,
    /// Position of the surface.
    pub(crate) position: f64,
    pub(crate) torque: f64,
    /// Load carried, on the motor's side and at the surface.
    pub(crate) load: f64,
    pub(crate) surface_load: f64,
    /// Since the last commutation.
    pub(crate) commutated_s: f64,
}

/// Forces that rub and push: dry friction besides the machine's own in both directions (backward,
/// forward), a factor on the machine's, and a torque against positive motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Burden {
    pub(crate) dry: [f64; 2],
    pub(crate) factor: f64,
    pub(crate) against: f64,
}

impl Burden {
    pub(crate) const NONE: Self = Self { dry: [0.0; 2], factor: 1.0, against: 0.0 };

    fn rub(&mut self, torque: f64) {
        self.dry[0] += torque;
        self.dry[1] += torque;
    }
}

impl Form {
    /// Tells whether it puts other physics in place of the machine's, so that its energy is no
    /// power of
    /// its size.
    pub(crate) fn replaces(&self) -> bool {
        matches!(
            self,
            Self::FourElements { .. }
                | Self::Dahl { .. }
                | Self::Elastic { .. }
                | Self::RatePlay { .. }
        )
    }
}

impl Hidden {
    /// Adds what the effect does at a state; what has a memory is the run's.
    pub(crate) fn act(&self, here: &Here, burden: &mut Burden) {
        let (a, w) = (self.size, here.speed);
        match &self.form {
            Form::Lorentzian { speed } => burden.rub(a / (1.0 + (w / speed) * (w / speed))),
            Form::FallingTable { knots } => burden.rub(a * table(knots, w.abs())),
            Form::Power { speed, exponent } => {
                burden.against += (a * pow((w / speed).abs(), *exponent)).copysign(w);
            }
            Form::Thinning { speed, exponent } => {
                let x = w / speed;
                burden.against += a * x / pow(1.0 + x * x, *exponent);
            }
            Form::UnequalDry => {
                burden.dry[0] -= a;
                burden.dry[1] += a;
            }
            Form::UnequalDrag { speed } => burden.against += a * (w / speed).abs(),
            Form::RubbingLoad { corner } => {
                burden.rub(a * (sqrt(here.load * here.load + corner * corner) - corner));
            }
            Form::Worn { bumps, cosine } => {
                burden.rub(a * bumps.iter().map(|b| bump(b, here.position, *cosine)).sum::<f64>());
            }
            Form::Warming { fast_s, slow_s } => {
                let cold = 0.6 * exp(-here.time_s / fast_s) + 0.4 * exp(-here.time_s / slow_s);
                burden.factor *= 1.0 - a * (1.0 - cold);
            }
            Form::GearError(wave) => {
                burden.against += a * wave.slope(here.motor) * here.surface_load;
            }
            Form::Pendulum { phase } => burden.against += a * sin(here.position + phase),
            Form::Spring { travel, hardening } => {
                let x = here.position / travel;
                burden.against += a * (x + hardening * x * x * x);
            }
            Form::Cogs { wave, modulation_phase } => {
                let modulation = 1.0 + 0.1 * sin(here.motor + modulation_phase);
                burden.against += a * modulation * wave.at(here.motor);
            }
            Form::TorqueWave(wave) => burden.against -= a * here.torque * wave.at(here.motor),
            Form::Dip { length_s } if here.commutated_s < *length_s => {
                let dip = 0.5 + 0.5 * cos(PI * here.commutated_s / length_s);
                burden.against += a * here.torque * dip;
            }
            Form::PositionTimesSpeed { length, phase, speed } => {
                burden.against += a * w / speed * sin(TAU * here.position / length + phase);
            }
            _ => {}
        }
    }

    /// The torque constant's factor at a current.
    pub(crate) fn constant_factor(&self, current: f64) -> f64 {
        match self.form {
            Form::Saturating => 1.0 / sqrt(1.0 + self.size * current * current),
            Form::WeakMagnet => 1.0 - self.size,
            _ => 1.0,
        }
    }

    /// Tells whether the torque constant depends on the sector besides its turns.
    pub(crate) fn by_sector(&self) -> bool {
        matches!(self.form, Form::RoundedEmf | Form::Dip { .. } | Form::Halls { .. })
    }

    /// The shape of its form in numbers, for the truth.
    pub(crate) fn words(&self) -> String {
        format!("{:?}", self.form)
    }
}

fn table(knots: &[(f64, f64)], x: f64) -> f64 {
    let next = knots.partition_point(|(at, _)| *at <= x);
    if next == knots.len() {
        // on as the last piece falls
        let (at, height) = knots[next - 1];
        return height * exp(-(x - at) / at);
    }
    let ((x0, y0), (x1, y1)) = (knots[next.max(1) - 1], knots[next.max(1)]);
    y0 + (y1 - y0) * (x - x0) / (x1 - x0)
}

fn bump(&(centre, width, height): &Bump, x: f64, cosine: bool) -> f64 {
    let off = ((x - centre) / width).abs();
    match (off < 1.0, cosine) {
        (false, _) => 0.0,
        (true, true) => height * (0.5 + 0.5 * cos(PI * off)),
        (true, false) => {
            let inside = 1.0 - off * off;
            height * inside * inside
        }
    }
}
