//! Bristles and elastic shafts of machines side by side.

use crate::{
    bounds::{larger, smaller},
    drive_train::FrictionState,
    effect::part::{
        Parts,
        bristles::Bristles,
        elastic_shaft::{ElasticShaft, ShaftState},
    },
    extension::{MotorState, SLOWEST, feel},
    lane_exp::exp_of_lanes,
    wide::Wide,
};

use super::numbers::Friction;

/// Motion of the motors over a segment or to its middle.
#[derive(Clone, Copy)]
pub(super) struct Turning<'a, const N: usize> {
    pub(super) from_rad: &'a Wide<N>,
    pub(super) from_rad_per_s: &'a Wide<N>,
    pub(super) turn_rad: &'a Wide<N>,
    pub(super) to_rad_per_s: &'a Wide<N>,
    /// Time that it takes.
    pub(super) span_s: &'a Wide<N>,
    /// Lanes in which it goes on: 1, else 0.
    pub(super) is_on: &'a [u64; N],
}

impl<const N: usize> Turning<'_, N> {
    #[inline(always)]
    fn from(&self, lane: usize) -> MotorState {
        MotorState { angle_rad: self.from_rad[lane], speed_rad_per_s: self.from_rad_per_s[lane] }
    }

    #[inline(always)]
    fn to(&self, lane: usize) -> MotorState {
        MotorState {
            angle_rad: self.from_rad[lane] + self.turn_rad[lane],
            speed_rad_per_s: self.to_rad_per_s[lane],
        }
    }
}

/// Bristles of each lane.
#[derive(Clone, Debug)]
pub(super) struct BristleLanes<const N: usize> {
    distance_rad: Wide<N>,
    damping: Wide<N>,
    stribeck_rad_per_s: Wide<N>,
    deflection_rad: Wide<N>,
    level_n_m: [Wide<N>; 2],
    /// Levels before the segment.
    before_n_m: [Wide<N>; 2],
    longest_s: Wide<N>,
    longest_rad: Wide<N>,
}

impl<const N: usize> BristleLanes<N> {
    pub(super) fn none() -> Self {
        let zero = [0.0; N];
        Self {
            distance_rad: zero,
            damping: zero,
            stribeck_rad_per_s: zero,
            deflection_rad: zero,
            level_n_m: [zero; 2],
            before_n_m: [zero; 2],
            longest_s: zero,
            longest_rad: zero,
        }
    }

    /// Takes over the bristles of a lane.
    pub(super) fn put(&mut self, lane: usize, of: &Bristles) {
        self.distance_rad[lane] = of.distance_rad;
        self.damping[lane] = of.damping;
        self.stribeck_rad_per_s[lane] = of.stribeck_rad_per_s;
        self.deflection_rad[lane] = of.deflection_rad;
        (self.level_n_m[0][lane], self.level_n_m[1][lane]) = of.level_n_m.into();
        self.longest_s[lane] = of.longest_s;
        self.longest_rad[lane] = of.longest_rad;
    }

    /// Gives a lane its bristles as they were before the segment.
    pub(super) fn give_back(&self, lane: usize, to: &mut Bristles) {
        to.deflection_rad = self.deflection_rad[lane];
        to.level_n_m = [self.before_n_m[0][lane], self.before_n_m[1][lane]];
    }

    #[inline(always)]
    fn of(&self, lane: usize) -> Bristles {
        Bristles {
            distance_rad: self.distance_rad[lane],
            damping: self.damping[lane],
            stribeck_rad_per_s: self.stribeck_rad_per_s[lane],
            deflection_rad: self.deflection_rad[lane],
            level_n_m: [self.level_n_m[0][lane], self.level_n_m[1][lane]],
            longest_s: self.longest_s[lane],
            longest_rad: self.longest_rad[lane],
        }
    }

    /// Exponentials by which bristles slide steadily at speeds.
    #[inline(always)]
    fn decayed(&self, speeds: &Wide<N>) -> Wide<N> {
        let argument = |lane: usize| self.of(lane).steady_argument(speeds[lane]);
        exp_of_lanes(&core::array::from_fn(argument))
    }

    /// Bounds the length of segments while the bristles bend, given that of the other parts, its
    /// turn and the shortest.
    #[inline(always)]
    pub(super) fn bound(
        &mut self,
        speeds: &Wide<N>,
        [longest_s, longest_rad, shortest_s]: [&Wide<N>; 3],
    ) -> Wide<N> {
        self.before_n_m = self.level_n_m;
        let decayed = self.decayed(speeds);
        core::array::from_fn(|lane| {
            let (bristles, speed) = (self.of(lane), speeds[lane]);
            let is_steady = bristles.is_steady_at(speed, bristles.steady_of(decayed[lane]));
            let bent_s = smaller(longest_s[lane], bristles.longest_s);
            let bent_rad = smaller(longest_rad[lane], bristles.longest_rad);
            let span_s = if is_steady { longest_s[lane] } else { bent_s };
            let turn_rad = if is_steady { longest_rad[lane] } else { bent_rad };
            let turning_s = turn_rad / larger(speed.abs(), SLOWEST);
            larger(smaller(span_s, turning_s), shortest_s[lane])
        })
    }

    /// Puts bristles in the place of dry friction, in the middle of a segment.
    #[inline(always)]
    pub(super) fn bend(&mut self, turning: &Turning<'_, N>, friction: &mut Friction<N>) {
        let speeds = turning.to_rad_per_s;
        for lane in 0..N {
            let forward = speeds[lane] >= 0.0;
            let of = |sides: &[Wide<N>; 2]| if forward { sides[1][lane] } else { sides[0][lane] };
            let level = [of(&friction.kinetic_n_m), of(&friction.static_n_m)];
            let is_on = turning.is_on[lane] != 0;
            for part in 0..2 {
                let old = self.level_n_m[part][lane];
                self.level_n_m[part][lane] = if is_on { level[part] } else { old };
            }
        }
        let decayed = self.decayed(speeds);
        let steady: Wide<N> = core::array::from_fn(|lane| self.of(lane).steady_of(decayed[lane]));
        let bent = self.bent(turning.turn_rad, &steady);
        for lane in 0..N {
            let torque_n_m = self.of(lane).torque_of(bent[lane], steady[lane], speeds[lane]);
            friction.against_n_m[lane] += torque_n_m;
            for side in 0..2 {
                friction.kinetic_n_m[side][lane] = 0.0;
                friction.static_n_m[side][lane] = 0.0;
            }
        }
    }

    /// Deflections after turns, with those at which sliding is steady.
    #[inline(always)]
    fn bent(&self, turn_rad: &Wide<N>, steady: &Wide<N>) -> Wide<N> {
        let argument = |lane: usize| Bristles::bent_argument(turn_rad[lane], steady[lane]);
        let decayed: Wide<N> = exp_of_lanes(&core::array::from_fn(argument));
        core::array::from_fn(|lane| {
            self.of(lane).bent_of(turn_rad[lane], steady[lane], decayed[lane])
        })
    }

    /// Takes the bristles to the end of a segment.
    #[inline(always)]
    pub(super) fn turn(&mut self, turning: &Turning<'_, N>) {
        let mean = core::array::from_fn(|lane| {
            0.5 * (turning.from_rad_per_s[lane] + turning.to_rad_per_s[lane])
        });
        let decayed = self.decayed(&mean);
        let steady: Wide<N> = core::array::from_fn(|lane| self.of(lane).steady_of(decayed[lane]));
        // as far as the rounded angles say
        let turn_rad =
            core::array::from_fn(|lane| turning.to(lane).angle_rad - turning.from(lane).angle_rad);
        let bent = self.bent(&turn_rad, &steady);
        for lane in 0..N {
            let old = self.deflection_rad[lane];
            self.deflection_rad[lane] = if turning.is_on[lane] != 0 { bent[lane] } else { old };
        }
    }
}

/// Elastic shafts of each lane, with their surfaces.
#[derive(Clone, Debug)]
pub(super) struct ShaftLanes<const N: usize> {
    per_gear_ratio: Wide<N>,
    stiffness: Wide<N>,
    damping: Wide<N>,
    inertia: Wide<N>,
    half_play_rad: Wide<N>,
    efficiency_ratio: Wide<N>,
    pub(super) angle_rad: Wide<N>,
    speed_rad_per_s: Wide<N>,
    load_n_m: Wide<N>,
}

impl<const N: usize> ShaftLanes<N> {
    pub(super) fn none() -> Self {
        let (zero, one) = ([0.0; N], [1.0; N]);
        Self {
            per_gear_ratio: one,
            stiffness: zero,
            damping: zero,
            inertia: one,
            half_play_rad: zero,
            efficiency_ratio: one,
            angle_rad: zero,
            speed_rad_per_s: zero,
            load_n_m: zero,
        }
    }

    /// Takes over the shaft of a lane.
    pub(super) fn put(&mut self, lane: usize, parts: &Parts, of: &ElasticShaft) {
        self.per_gear_ratio[lane] = parts.machine.per_gear_ratio;
        self.stiffness[lane] = of.stiffness;
        self.damping[lane] = of.damping;
        self.inertia[lane] = of.inertia;
        self.half_play_rad[lane] = of.half_play_rad;
        self.efficiency_ratio[lane] = of.efficiency_ratio;
        self.angle_rad[lane] = of.angle_rad;
        self.speed_rad_per_s[lane] = of.speed_rad_per_s;
        self.load_n_m[lane] = of.load_n_m;
    }

    /// Gives a lane its surface back.
    pub(super) fn give_back(&self, lane: usize, to: &mut ElasticShaft) {
        (to.angle_rad, to.speed_rad_per_s) = (self.angle_rad[lane], self.speed_rad_per_s[lane]);
    }

    #[inline(always)]
    fn of(&self, lane: usize) -> ElasticShaft {
        ElasticShaft {
            stiffness: self.stiffness[lane],
            damping: self.damping[lane],
            inertia: self.inertia[lane],
            half_play_rad: self.half_play_rad[lane],
            efficiency_ratio: self.efficiency_ratio[lane],
            angle_rad: self.angle_rad[lane],
            speed_rad_per_s: self.speed_rad_per_s[lane],
            load_n_m: self.load_n_m[lane],
            followed: false,
        }
    }

    /// Puts another load on a lane's surface.
    pub(super) fn set_load(&mut self, lane: usize, load_n_m: f64) {
        self.load_n_m[lane] = load_n_m;
    }

    /// Load of a lane's surface, on the motor side.
    #[inline(always)]
    pub(super) fn load_n_m(&self, lane: usize) -> f64 {
        self.load_n_m[lane] * self.per_gear_ratio[lane]
    }

    /// Lets the motors feel what the shafts pass in the middle of a segment.
    #[inline(always)]
    pub(super) fn pass(
        &self,
        turning: &Turning<'_, N>,
        sign: &Wide<N>,
        friction: &mut Friction<N>,
    ) {
        for lane in 0..N {
            let (shaft, r) = (self.of(lane), self.per_gear_ratio[lane]);
            let from = turning.from(lane).at_surface(r);
            let surface: ShaftState = shaft.predicted(from, turning.span_s[lane]);
            let passed_n_m = shaft.passed_n_m(turning.to(lane).at_surface(r), surface);
            let mut of: FrictionState = friction.of(lane);
            feel(&shaft, &mut of, r, passed_n_m, sign[lane]);
            friction.put(lane, &of);
        }
    }

    /// Takes the surfaces to the end of a segment.
    #[inline(always)]
    pub(super) fn turn(&mut self, turning: &Turning<'_, N>) {
        for lane in 0..N {
            let (mut shaft, r) = (self.of(lane), self.per_gear_ratio[lane]);
            let (from, to) = (turning.from(lane).at_surface(r), turning.to(lane).at_surface(r));
            shaft.advance(from, to, turning.span_s[lane]);
            let is_on = turning.is_on[lane] != 0;
            let (angle_rad, speed) = (self.angle_rad[lane], self.speed_rad_per_s[lane]);
            self.angle_rad[lane] = if is_on { shaft.angle_rad } else { angle_rad };
            self.speed_rad_per_s[lane] = if is_on { shaft.speed_rad_per_s } else { speed };
        }
    }
}
