//! A surface of its own behind an elastic shaft, in the same series as winding and motor.
//!
//! ```text
//! J_m·ω_m' = T_m − F − c·ω_m − φ·τ/i_g      φ = 1/η where the motor drives, η where it is driven
//! J_u·ω_u' = τ − T_load                     τ = K·(θ_m/i_g − θ_u ∓ b/2) + c_s·(ω_m/i_g − ω_u)
//! ```
//!
//! A flank of the play pushes and never pulls: it takes hold where twist and torque are both
//! beyond zero, and lets go where its torque comes to zero. Both are instants of the solution.
//!
//! # Source
//!
//! Two-mass mechanics of motulator, and `ElastoBacklash` of the Modelica Standard Library; see
//! `docs/models/effects.md`.

use super::{Run, Step, event::Event};
use crate::{
    drive_train::Direction,
    effect::part::elastic_shaft::ElasticShaft,
    probe::{Probe, SurfaceSegment},
    series::{RECIPROCALS, Series, less, root, value},
    winding::{
        Coupling, CubicTerms, LoopVolts, SectorWinding, Segment, SegmentStart, Shaft, first,
        second, third,
    },
};

/// Which flank of the play holds the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flank {
    Loose,
    Upper,
    Lower,
}

impl Flank {
    /// 1, −1, or 0 for none.
    fn sign(self) -> f64 {
        match self {
            Self::Loose => 0.0,
            Self::Upper => 1.0,
            Self::Lower => -1.0,
        }
    }
}

/// The circuit that a segment is solved for.
pub(super) struct Loops {
    /// Voltages of the positive and the idle leg against the negative one.
    pub(super) volts: LoopVolts,
    /// True where the idle phase is open.
    pub(super) open: bool,
    pub(super) cubic: Option<CubicTerms>,
}

/// The elastic shaft at the beginning of a segment.
#[derive(Clone, Copy)]
pub(super) struct Spring {
    shaft: ElasticShaft,
    flank: Flank,
    direction: Direction,
    /// Twist of the shaft and its rate, at the surface.
    twist: (f64, f64),
    per_gear_ratio: f64,
}

/// Surface and torque over a segment.
struct Motion {
    angle: Series,
    speed: Series,
    torque: Series,
}

impl Spring {
    /// Torque at the motor's gear over that on the surface, for a motion.
    fn felt_ratio(&self, direction: f64) -> f64 {
        let efficiency_ratio = self.shaft.efficiency_ratio;
        if self.flank.sign() * direction > 0.0 { 1.0 / efficiency_ratio } else { efficiency_ratio }
    }

    /// Coefficient m of a flank's torque, from those of twist and rate.
    fn torque(&self, m: usize, twist: f64, rate: f64) -> f64 {
        let sign = self.flank.sign();
        if sign == 0.0 {
            return 0.0;
        }
        let play = if m == 0 { sign * self.shaft.half_play_rad } else { 0.0 };
        self.shaft.stiffness * (twist - play) + self.shaft.damping * rate
    }

    /// Goes on by a coefficient of the surface's motion, with the motor's turn and speed.
    fn go_on(&self, m: usize, motion: &mut Motion, turn: f64, speed: f64) -> f64 {
        let r = self.per_gear_ratio;
        let (mut twist, mut rate) = (r * turn - motion.angle[m], r * speed - motion.speed[m]);
        if m == 0 {
            (twist, rate) = self.twist;
        }
        motion.torque[m] = self.torque(m, twist, rate);
        if m < 4 {
            let load_n_m = if m == 0 { self.shaft.load_n_m } else { 0.0 };
            motion.angle[m + 1] = motion.speed[m] * RECIPROCALS[m];
            motion.speed[m + 1] =
                (motion.torque[m] - load_n_m) * RECIPROCALS[m] / self.shaft.inertia;
        }
        motion.torque[m]
    }

    fn still(&self) -> Motion {
        let mut motion = Motion { angle: [0.0; 5], speed: [0.0; 5], torque: [0.0; 5] };
        motion.speed[0] = self.shaft.speed_rad_per_s;
        motion
    }

    /// The surface's turn in a segment that is solved.
    fn motion(&self, segment: &Segment) -> Motion {
        let mut motion = self.still();
        for m in 0..5 {
            self.go_on(m, &mut motion, segment.turn[m], segment.speed[m]);
        }
        motion
    }

    /// Twist beyond the play on the side of a flank, and that flank's torque, both positive
    /// where it pushes.
    fn beyond(&self, flank: Flank, segment: &Segment, motion: &Motion) -> [Series; 2] {
        let (sign, r) = (flank.sign(), self.per_gear_ratio);
        let mut twist: Series = [0.0; 5];
        let mut rate: Series = [0.0; 5];
        for m in 0..5 {
            twist[m] = sign * (r * segment.turn[m] - motion.angle[m]);
            rate[m] = sign * (r * segment.speed[m] - motion.speed[m]);
        }
        twist[0] = sign * self.twist.0 - self.shaft.half_play_rad;
        rate[0] = sign * self.twist.1;
        let (stiffness, damping) = (self.shaft.stiffness, self.shaft.damping);
        [twist, core::array::from_fn(|m| stiffness * twist[m] + damping * rate[m])]
    }

    /// Winding, motor and surface from now on.
    pub(super) fn solve(
        &self,
        at: &SectorWinding,
        shaft: &Shaft,
        coupling: &Coupling,
        loops: &Loops,
        start: SegmentStart,
    ) -> Segment {
        let (x0, y0, w0) = (start.positive_a, start.idle_a, start.speed_rad_per_s);
        let (mut x, mut y, mut w, mut turn) = ([0.0; 5], [0.0; 5], [0.0; 5], [0.0; 5]);
        (x[0], y[0], w[0]) = (x0, y0, w0);
        let (mut a, mut b) = ([0.0; 4], [0.0; 4]);
        let mut motion = self.still();
        let felt = self.felt_ratio(self.direction.sign()) * self.per_gear_ratio;
        let [pair, idle] = coupling.loops();
        let (bent_a, bent_b) = loops.cubic.map_or((0.0, 0.0), |cubic| cubic.loops());
        let product = |k: &[f64; 4], of: &Series, m: usize| -> f64 {
            (0..=m).map(|n| k[n] * of[m - n]).sum()
        };
        let (mut volts, mut external) = (loops.volts, shaft.external_n_m);
        for m in 0..4 {
            let near = |k: &[f64; 3], cubic: f64| match m {
                0 => k[0],
                1 => first(k, w0),
                2 => second(k, w0, turn[2]),
                _ => third(k, cubic, &turn),
            };
            (a[m], b[m]) = (near(pair, bent_a), near(idle, bent_b));
            let driven = LoopVolts {
                pair_v: volts.pair_v - product(&a, &w, m),
                idle_v: volts.idle_v - product(&b, &w, m),
            };
            (x[m + 1], y[m + 1]) = at.loop_rates(driven, [x[m], y[m]], m, loops.open);
            let torque = product(&a, &x, m) + product(&b, &y, m) + external
                - shaft.viscous_n_m_s_per_rad * w[m]
                - felt * self.go_on(m, &mut motion, turn[m], w[m]);
            w[m + 1] = torque * shaft.per_inertia[m];
            turn[m + 1] = w[m] * RECIPROCALS[m];
            (volts, external) = (LoopVolts { pair_v: 0.0, idle_v: 0.0 }, 0.0);
        }
        Segment { positive: x, idle: y, speed: w, turn }
    }
}

impl<P: Probe> Run<P> {
    /// The elastic shaft as it stands; none where the surface goes with the motor.
    pub(super) fn spring(&self) -> Option<Spring> {
        let shaft = *self.extension.as_ref()?.elastic_shaft()?;
        let r = 1.0 / self.gear_ratio;
        let (motor_rad, speed) = (self.train.angle_rad, self.train.speed_rad_per_s);
        let twist = (r * motor_rad - shaft.angle_rad, r * speed - shaft.speed_rad_per_s);
        let direction = self.train.direction;
        Some(Spring { shaft, flank: self.flank?, direction, twist, per_gear_ratio: r })
    }

    /// Motor torques at rest less what the shaft asks for before it lets the motor go backward
    /// and forward.
    #[cold]
    pub(super) fn less_spring(&self, torque: &Series, segment: &Segment) -> [Series; 2] {
        let Some(spring) = self.spring() else { return [*torque; 2] };
        let motion = spring.motion(segment);
        [-1.0, 1.0].map(|direction| {
            let felt = spring.felt_ratio(direction) * spring.per_gear_ratio;
            core::array::from_fn(|m| torque[m] - felt * motion.torque[m])
        })
    }

    /// A flank that takes hold or lets go within a span, and when.
    #[cold]
    pub(super) fn flank_event(&self, segment: &Segment, span_s: f64) -> Option<(Event, f64)> {
        let spring = self.spring()?;
        let motion = spring.motion(segment);
        let when = |series: &Series| if series[0] >= 0.0 { 0.0 } else { root(series, span_s) };
        if spring.flank != Flank::Loose {
            let [_, torque] = spring.beyond(spring.flank, segment, &motion);
            let released = less(&torque.map(|c| -c), 0.0);
            let lets_go = value(&torque, span_s) < 0.0;
            return lets_go.then(|| (Event::Flank(Flank::Loose), when(&released)));
        }
        [Flank::Upper, Flank::Lower].into_iter().find_map(|flank| {
            let both = spring.beyond(flank, segment, &motion);
            let holds = both.iter().all(|series| value(series, span_s) > 0.0);
            holds.then(|| (Event::Flank(flank), when(&both[0]).max(when(&both[1]))))
        })
    }

    /// Moves the surface to the end of a segment, before the motor does.
    #[cold]
    pub(super) fn move_surface(&mut self, step: &Step, span_s: f64) {
        let Some(spring) = self.spring() else { return };
        let motion = spring.motion(&step.segment);
        let turn_rad = value(&motion.angle, span_s);
        let speed_rad_per_s = value(&motion.speed, span_s);
        let sign = spring.flank.sign();
        let r = spring.per_gear_ratio;
        let end_twist = spring.twist.0 + r * value(&step.segment.turn, span_s) - turn_rad;
        let beyond_rad = sign * (end_twist - sign * spring.shaft.half_play_rad);
        self.probe.surface(
            &SurfaceSegment {
                motor_speed: step.segment.speed,
                speed: motion.speed,
                torque: motion.torque,
                per_gear_ratio: r,
                gear_loss_ratio: spring.felt_ratio(spring.direction.sign()) - 1.0,
                load_n_m: spring.shaft.load_n_m,
                inertia_kg_m2: spring.shaft.inertia,
                stiffness_n_m_per_rad: spring.shaft.stiffness,
                damping_n_m_s_per_rad: spring.shaft.damping,
                beyond_rad: if sign == 0.0 { 0.0 } else { beyond_rad },
            },
            span_s,
        );
        if let Some(extension) = &mut self.extension {
            extension.put_surface(spring.shaft.angle_rad + turn_rad, speed_rad_per_s);
        }
    }

    /// A flank takes hold or lets go.
    pub(super) fn change_flank(&mut self, flank: Flank) {
        let Some(spring) = self.spring() else { return };
        self.flank = Some(flank);
        // what is left in the shaft that lets go becomes heat in it
        let of = |flank: Flank| {
            let beyond_rad = spring.twist.0 - flank.sign() * spring.shaft.half_play_rad;
            let held = f64::from(flank != Flank::Loose);
            0.5 * held * spring.shaft.stiffness * beyond_rad * beyond_rad
        };
        self.probe.released(of(spring.flank) - of(flank));
    }
}
