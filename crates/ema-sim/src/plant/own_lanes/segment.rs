//! A segment of all lanes, as if nothing happened in it.
#![expect(
    clippy::inline_always,
    reason = "the loop is compiled once for each instruction set, which inlining makes possible"
)]
#![expect(
    clippy::needless_bitwise_bool,
    reason = "a branch would keep the loop from being taken in vectors"
)]

use crate::{
    bounds::{larger, smaller},
    effect::lanes::{Moments, ShaftLoads},
    extension::{SLOWEST, with_effects},
    plant::Motion,
    series::{value, value_from_zero},
    wide::Wide,
    winding::{RotorAngle, Shaft, gap_of},
};

use super::{OwnLanes, springs::Turning};

/// The next segment as if nothing happened in it.
#[derive(Clone, Debug)]
pub(super) struct Ahead<const N: usize> {
    pub(super) span_s: Wide<N>,
    pub(super) coupling: [Wide<N>; 3],
    pub(super) wanted_a: Wide<N>,
    pub(super) motor_n_m: Wide<N>,
    pub(super) needed_v: Wide<N>,
    /// Time and turn to its middle, and the state there.
    pub(super) half_s: Wide<N>,
    pub(super) half_rad: Wide<N>,
    pub(super) middle: Moments<N>,
    /// Turn to its end, and the state there.
    pub(super) turn_rad: Wide<N>,
    pub(super) speed_rad_per_s: Wide<N>,
    pub(super) external_n_m: Wide<N>,
    /// Lanes that are taken along, and those in which nothing happens: 1, else 0.
    pub(super) is_on: [u64; N],
    pub(super) passes: [u64; N],
}

impl<const N: usize> Ahead<N> {
    pub(super) fn none() -> Self {
        let zero = [0.0; N];
        Self {
            span_s: zero,
            coupling: [zero; 3],
            wanted_a: zero,
            motor_n_m: zero,
            needed_v: zero,
            half_s: zero,
            half_rad: zero,
            middle: Moments::none(),
            turn_rad: zero,
            speed_rad_per_s: zero,
            external_n_m: zero,
            is_on: [0; N],
            passes: [0; N],
        }
    }
}

impl<const N: usize, C> OwnLanes<N, C> {
    /// Length of the next segment.
    #[inline(always)]
    pub(super) fn look_ahead(&mut self) {
        let Self { fixed, moving, ahead, .. } = self;
        if self.effects.is_none() {
            ahead.span_s = moving.left_s;
            return;
        }
        for lane in 0..N {
            let speed = moving.speed_rad_per_s[lane].abs();
            let turning_s = fixed.longest_rad[lane] / larger(speed, SLOWEST);
            let longest_s =
                larger(smaller(fixed.longest_s[lane], turning_s), fixed.shortest_s[lane]);
            ahead.span_s[lane] = smaller(moving.left_s[lane], longest_s);
        }
        if let Some(bristles) = &mut self.bristles {
            let bounds = [&fixed.longest_s, &fixed.longest_rad, &fixed.shortest_s];
            let longest_s = bristles.bound(&moving.speed_rad_per_s, bounds);
            for lane in 0..N {
                ahead.span_s[lane] = smaller(moving.left_s[lane], longest_s[lane]);
            }
        }
    }

    /// The currents that the set-points ask for, with what they make and need.
    #[inline(always)]
    pub(super) fn regulate(&mut self, part: usize) {
        let Self { fixed, lasting, moving, ahead, .. } = self;
        ahead.wanted_a = self.held[part];
        if !self.asking.sensing.is_empty() {
            for lane in 0..N {
                let offset_a = fixed.offset_a[lane];
                ahead.wanted_a[lane] = (ahead.wanted_a[lane] - offset_a) / fixed.gain[lane];
            }
        }
        for lane in 0..N {
            let rotor = RotorAngle { motor_rad: 0.0, sin: moving.sin[lane], cos: moving.cos[lane] };
            let eccentricity = [fixed.eccentricity_cos[lane], fixed.eccentricity_sin[lane]];
            let [k0, k1, k2] = gap_of(eccentricity, &rotor).map(|g| lasting.constant[lane] * g);
            ahead.coupling[0][lane] = k0;
            ahead.coupling[1][lane] = k1;
            ahead.coupling[2][lane] = k2;
            let wanted_a = ahead.wanted_a[lane];
            let emf_v = k0 * moving.speed_rad_per_s[lane];
            ahead.needed_v[lane] = lasting.resistance_ohm[lane] * wanted_a + emf_v;
            ahead.motor_n_m[lane] = k0 * wanted_a;
        }
    }

    /// The state in the middle of the next segment, as [`Extension`] predicts it.
    #[inline(always)]
    pub(super) fn find_middle(&mut self) {
        let Self { fixed, lasting, moving, ahead, .. } = self;
        for lane in 0..N {
            let speed = moving.speed_rad_per_s[lane];
            let sign = lasting.sign[lane];
            let drag_n_m = fixed.viscous_n_m_s_per_rad[lane] * speed;
            let rate = (ahead.motor_n_m[lane] + moving.external_n_m[lane] - drag_n_m)
                * lasting.per_inertia[0][lane];
            let rests = sign == 0.0;
            let half_s = if rests { 0.0 } else { 0.5 * ahead.span_s[lane] };
            let to = speed + rate * half_s;
            let mean = speed + 0.5 * rate * half_s;
            let moved = if to * sign > 0.0 { to } else { 0.0 };
            let now_rad = fixed.start_angle_rad[lane] + moving.angle_rad[lane];
            let motor_rad = if rests { now_rad } else { now_rad + mean * half_s };
            let turn_rad = motor_rad - now_rad;
            ahead.half_s[lane] = half_s;
            ahead.half_rad[lane] = turn_rad;
            let middle = &mut ahead.middle;
            middle.motor_rad[lane] = motor_rad;
            middle.speed_rad_per_s[lane] = if rests { speed } else { moved };
            let on_motor_side = (moving.angle_rad[lane] + turn_rad) * lasting.follows[lane]
                + lasting.offset_rad[lane];
            middle.position_rad[lane] =
                fixed.start_position_rad[lane] + on_motor_side * fixed.per_gear_ratio[lane];
            middle.time_s[lane] = moving.time_s[lane] + half_s;
            middle.motor_n_m[lane] = ahead.motor_n_m[lane];
            middle.load_n_m[lane] = lasting.carried_load_n_m[lane];
            middle.since_commutation_s[lane] = moving.since_commutation_s[lane] + half_s;
        }
        ahead.middle.per_gear_ratio = fixed.per_gear_ratio;
        if let Some(shafts) = &self.shafts {
            for lane in 0..N {
                ahead.middle.position_rad[lane] =
                    fixed.start_position_rad[lane] + shafts.angle_rad[lane];
                ahead.middle.load_n_m[lane] = shafts.load_n_m(lane);
            }
        }
    }

    /// Puts on the shafts what the effects do in the middle of the segment.
    #[inline(always)]
    pub(super) fn act(&mut self) {
        let Self { lasting, moving, ahead, friction, nominal, .. } = self;
        let at = &ahead.middle;
        // a load that changes is felt beside the friction of a lane's own last segment
        let before = (!self.asking.loaded.is_empty()).then(|| friction.clone());
        let mut loads = ShaftLoads::new(nominal.against_n_m);
        self.effects.act(self.vectors, &self.runs, at, &mut loads);
        for lane in 0..N {
            friction.put(lane, &with_effects(nominal.of(lane), &loads.of(lane)));
        }
        let turning = Turning {
            from_rad: &moving.angle_rad,
            from_rad_per_s: &moving.speed_rad_per_s,
            turn_rad: &ahead.half_rad,
            to_rad_per_s: &at.speed_rad_per_s,
            span_s: &ahead.half_s,
            is_on: &ahead.is_on,
        };
        if let Some(bristles) = &mut self.bristles {
            bristles.bend(&turning, friction);
        }
        if let Some(shafts) = &self.shafts {
            shafts.pass(&turning, &lasting.sign, friction);
        }
        if let Some(before) = before {
            let is_off = |lane: &usize| ahead.is_on[*lane] == 0;
            (0..N).filter(is_off).for_each(|lane| friction.put(lane, &before.of(lane)));
        }
    }

    /// Speed and turn at the end of the segment, and the lanes in which nothing happens.
    #[inline(always)]
    pub(super) fn glide(&mut self) {
        let Self { fixed, lasting, moving, ahead, friction, .. } = self;
        for lane in 0..N {
            let sign = lasting.sign[lane];
            let external_n_m = friction.external_n_m(lane, lasting);
            let shaft = Shaft {
                per_inertia: [0, 1, 2, 3].map(|m: usize| lasting.per_inertia[m][lane]),
                external_n_m,
                viscous_n_m_s_per_rad: fixed.viscous_n_m_s_per_rad[lane],
            };
            let coupling = [0, 1, 2].map(|m: usize| ahead.coupling[m][lane]);
            let (wanted_a, speed) = (ahead.wanted_a[lane], moving.speed_rad_per_s[lane]);
            let motion = Motion::at_current(&shaft, &coupling, wanted_a, speed);
            let span_s = ahead.span_s[lane];
            let to_speed = value(&motion.speed, span_s);
            let turn_rad = value_from_zero(&motion.turn, span_s);
            let to_rad = moving.angle_rad[lane] + turn_rad;
            let goes = (to_speed * sign > 0.0)
                & (to_rad <= lasting.high_rad[lane])
                & (to_rad >= lasting.low_rad[lane])
                & (to_speed.abs() <= fixed.most_speed[lane]);
            let motor_n_m = ahead.motor_n_m[lane];
            let against_n_m = friction.against_n_m[lane];
            let least = -friction.static_n_m[0][lane] + lasting.holding_n_m[0][lane] + against_n_m;
            let most = friction.static_n_m[1][lane] + lasting.holding_n_m[1][lane] + against_n_m;
            let rests = (sign == 0.0) & (motor_n_m <= most) & (motor_n_m >= least);
            let passes = (goes | rests) & (ahead.needed_v[lane].abs() <= fixed.limit_v[lane]);
            ahead.passes[lane] = ahead.is_on[lane] & u64::from(passes);
            ahead.speed_rad_per_s[lane] = to_speed;
            ahead.turn_rad[lane] = turn_rad;
            ahead.external_n_m[lane] = external_n_m;
        }
    }

    /// Takes bristles and elastic shafts to the end of the segment.
    #[inline(always)]
    pub(super) fn spring(&mut self) {
        let Self { moving, ahead, .. } = self;
        let turning = Turning {
            from_rad: &moving.angle_rad,
            from_rad_per_s: &moving.speed_rad_per_s,
            turn_rad: &ahead.turn_rad,
            to_rad_per_s: &ahead.speed_rad_per_s,
            span_s: &ahead.span_s,
            is_on: &ahead.passes,
        };
        if let Some(bristles) = &mut self.bristles {
            bristles.turn(&turning);
        }
        if let Some(shafts) = &mut self.shafts {
            shafts.turn(&turning);
        }
    }

    /// Takes the state at the end of the segment where nothing happened in it.
    #[inline(always)]
    pub(super) fn arrive(&mut self) {
        let Self { moving, ahead, .. } = self;
        for lane in 0..N {
            let passes = ahead.passes[lane] != 0;
            let (turn_rad, span_s) = (ahead.turn_rad[lane], ahead.span_s[lane]);
            let (sin, cos) = (moving.sin[lane], moving.cos[lane]);
            let mut rotor = RotorAngle { motor_rad: 0.0, sin, cos };
            rotor.turn(turn_rad);
            let to = |new: f64, old: f64| if passes { new } else { old };
            let angle_rad = moving.angle_rad[lane];
            moving.sin[lane] = to(rotor.sin, sin);
            moving.cos[lane] = to(rotor.cos, cos);
            moving.angle_rad[lane] = to(angle_rad + turn_rad, angle_rad);
            moving.speed_rad_per_s[lane] =
                to(ahead.speed_rad_per_s[lane], moving.speed_rad_per_s[lane]);
            moving.current_a[lane] = to(ahead.wanted_a[lane], moving.current_a[lane]);
            moving.external_n_m[lane] = to(ahead.external_n_m[lane], moving.external_n_m[lane]);
            let taken_s = if passes { span_s } else { 0.0 };
            moving.time_s[lane] += taken_s;
            moving.since_commutation_s[lane] += taken_s;
            moving.left_s[lane] -= taken_s;
        }
    }
}
