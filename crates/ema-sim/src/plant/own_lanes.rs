//! Runs of machines of their own side by side, with effects and commands of their own, a lane each.
//!
//! A segment in which nothing happens is the same arithmetic for each lane, written once more for
//! arrays, so that the compiler takes several lanes at a time; so is what effects add to friction
//! and torque. What a sensor shows that errs the run's own effects say, lane by lane. A lane in which
//! something happens (commutation, standstill, contact, a stop, the supply's limit) is taken to
//! the end of the tick by its own [`Run`]. Operations and their order are those of the run, and
//! nothing is fused: both give the same bits at any vector width.
#![expect(
    clippy::inline_always,
    reason = "the loop is compiled once for each instruction set, which inlining makes possible"
)]
#![expect(
    clippy::needless_bitwise_bool,
    reason = "a branch would keep the loop from being taken in vectors"
)]

mod springs;

use pulp::{Arch, NullaryFnOnce};

use crate::{
    bounds::{larger, smaller},
    drive_train::FrictionState,
    effect::{
        Effect,
        catalogue::EffectId,
        lanes::{Adding, EffectLanes, Moments, ShaftLoads},
        part::Parts,
    },
    extension::{Extension, with_effects},
    series::{value, value_from_zero},
    winding::{RotorAngle, Shaft, gap_of},
};

use self::springs::{BristleLanes, ShaftLanes, Turning};
use super::{LEAST_LEFT, Motion, REFRESH_TICKS, Run};

/// A number of each lane.
pub(crate) type Wide<const N: usize> = [f64; N];

/// Speed below which the turn of a segment does not bound its length, rad/s.
const SLOWEST: f64 = 1e-9;

/// State of the machines that a controller sees at a tick.
#[derive(Clone, Debug)]
pub(crate) struct Seen<const N: usize> {
    pub(crate) command: Wide<N>,
    /// Position of the surface as its sensor shows it.
    pub(crate) shown_rad: Wide<N>,
    /// Motion of the surface from the start, without errors.
    pub(crate) moved_rad: Wide<N>,
    /// Angle and speed of the motor from the start.
    pub(crate) angle_rad: Wide<N>,
    pub(crate) speed_rad_per_s: Wide<N>,
}

/// The controllers of all lanes.
pub(crate) trait LaneControl<const N: usize> {
    /// Set-points of a tick.
    fn decide(&mut self, seen: &Seen<N>, references: &mut Wide<N>);
}

/// Numbers of a lane that no tick changes.
#[derive(Clone, Debug)]
struct Fixed<const N: usize> {
    /// Longest segment, its longest turn, and the shortest segment.
    longest_s: Wide<N>,
    longest_rad: Wide<N>,
    shortest_s: Wide<N>,
    limit_v: Wide<N>,
    most_speed: Wide<N>,
    viscous_n_m_s_per_rad: Wide<N>,
    start_angle_rad: Wide<N>,
    start_position_rad: Wide<N>,
    per_gear_ratio: Wide<N>,
    eccentricity_cos: Wide<N>,
    eccentricity_sin: Wide<N>,
    /// What the current sensor in the loop makes of a set-point: less an offset, over a gain.
    offset_a: Wide<N>,
    gain: Wide<N>,
}

/// State that lasts from event to event.
#[derive(Clone, Debug)]
struct Lasting<const N: usize> {
    /// `surface = (follows·angle + offset)/i_g`.
    follows: Wide<N>,
    offset_rad: Wide<N>,
    /// Direction of the motion, 0 at rest.
    sign: Wide<N>,
    /// `1/(m·J)`; zero while the shaft rests.
    per_inertia: [Wide<N>; 4],
    felt_load_n_m: Wide<N>,
    carried_load_n_m: Wide<N>,
    /// Motor angles between which nothing changes.
    low_rad: Wide<N>,
    high_rad: Wide<N>,
    /// What holds a shaft at rest beside its friction; of a moving one nothing does.
    holding_n_m: [Wide<N>; 2],
    /// `2·k_p·F_sc` and `2·R_p·F_sc` of the sector.
    constant: Wide<N>,
    resistance_ohm: Wide<N>,
}

/// The state that a segment changes.
#[derive(Clone, Debug)]
struct Moving<const N: usize> {
    angle_rad: Wide<N>,
    speed_rad_per_s: Wide<N>,
    sin: Wide<N>,
    cos: Wide<N>,
    current_a: Wide<N>,
    external_n_m: Wide<N>,
    time_s: Wide<N>,
    since_commutation_s: Wide<N>,
    /// What is left of the time for which the set-point is held.
    left_s: Wide<N>,
}

/// The next segment as if nothing happened in it.
#[derive(Clone, Debug)]
struct Ahead<const N: usize> {
    span_s: Wide<N>,
    coupling: [Wide<N>; 3],
    wanted_a: Wide<N>,
    motor_n_m: Wide<N>,
    needed_v: Wide<N>,
    /// Time and turn to its middle, and the state there.
    half_s: Wide<N>,
    half_rad: Wide<N>,
    middle: Moments<N>,
    /// Turn to its end, and the state there.
    turn_rad: Wide<N>,
    speed_rad_per_s: Wide<N>,
    external_n_m: Wide<N>,
    /// Lanes that are taken along, and those in which nothing happens: 1, else 0.
    is_on: [u64; N],
    passes: [u64; N],
}

/// Dry friction of the two directions (backward, forward), and the torque against positive motion.
#[derive(Clone, Debug)]
#[expect(clippy::struct_field_names, reason = "the unit belongs to the name")]
struct Friction<const N: usize> {
    kinetic_n_m: [Wide<N>; 2],
    static_n_m: [Wide<N>; 2],
    against_n_m: Wide<N>,
}

/// Lanes that ask more than arithmetic.
#[derive(Clone, Debug, Default)]
struct Asking {
    /// With errors of the position.
    misplaced: Vec<usize>,
    /// With a current sensor that errs.
    sensing: Vec<usize>,
    delayed: Vec<usize>,
    loaded: Vec<usize>,
}

/// Runs side by side.
#[derive(Clone, Debug)]
pub(crate) struct OwnLanes<const N: usize, C> {
    control: C,
    tick_s: f64,
    fixed: Fixed<N>,
    lasting: Lasting<N>,
    moving: Moving<N>,
    ahead: Ahead<N>,
    friction: Friction<N>,
    /// Friction without effects.
    nominal: Friction<N>,
    /// Effects, the same in all lanes but for their numbers, and parts that they have put in.
    effects: Vec<EffectLanes<N>>,
    bristles: Option<BristleLanes<N>>,
    shafts: Option<ShaftLanes<N>>,
    arch: Arch,
    seen: Seen<N>,
    shown_current_a: Wide<N>,
    /// Set-points of a tick, each with its share of it.
    held: [Wide<N>; 2],
    shares: [Wide<N>; 2],
    asking: Asking,
    runs: Vec<Run>,
    /// Ticks after which a lane is not taken along.
    ends: [usize; N],
}

impl Run {
    /// True where a tick of the run is no more than lanes can do.
    pub(crate) fn joins_lanes(&self) -> bool {
        let plain_parts = |extension: &Extension| {
            let parts = extension.parts();
            let has_curve = extension.effects().iter().any(|effect| effect.curve().is_some());
            !has_curve
                && !parts.winding.any
                && parts.saturations_per_a2.is_empty()
                && parts.commutation.is_none()
        };
        let [kinetic_n_m, static_n_m] = self.train.nominal_friction_n_m();
        self.cuts == 1
            && self.shape.is_none()
            && !self.voltage_driven
            && kinetic_n_m <= static_n_m
            && self.load.as_ref().is_none_or(|load| !load.feels_surface())
            && self.extension.as_ref().is_none_or(|extension| plain_parts(extension))
    }
}

impl Run {
    /// The effects that are on.
    pub(super) fn effects(&self) -> Vec<EffectId> {
        let effects = self.extension.as_ref().map_or(&[][..], |extension| extension.effects());
        effects.iter().map(Effect::id).collect()
    }
}

/// The effects of runs that have the same ones.
fn effects_of<const N: usize>(runs: &[Run]) -> Vec<EffectLanes<N>> {
    let of = |run: &Run| run.extension.as_ref().map_or(&[][..], |e| e.effects()).to_vec();
    let Some(first) = runs.first() else { return Vec::new() };
    let mut effects: Vec<EffectLanes<N>> = of(first).iter().filter_map(Effect::in_lanes).collect();
    for lane in 0..N {
        let run = &runs[lane.min(runs.len() - 1)];
        for (lanes, effect) in effects.iter_mut().zip(of(run)) {
            lanes.put(lane, effect.all_values());
        }
    }
    effects
}

impl<const N: usize, C: LaneControl<N>> OwnLanes<N, C> {
    /// At most `N` runs that [join lanes](Run::joins_lanes) and have the same effects, with so many
    /// ticks each.
    pub(crate) fn of(runs: Vec<Run>, control: C, tick_s: f64, ticks: &[usize]) -> Self {
        let has = |of: &dyn Fn(&Parts) -> bool| {
            runs.iter().any(|run| run.extension.as_ref().is_some_and(|e| of(e.parts())))
        };
        let mut lanes = Self {
            control,
            tick_s,
            fixed: Fixed::of(&runs, tick_s),
            lasting: Lasting::none(),
            moving: Moving::none(),
            ahead: Ahead::none(),
            friction: Friction::none(),
            nominal: Friction::none(),
            effects: effects_of(&runs),
            bristles: has(&|p| p.bristles.is_some()).then(BristleLanes::none),
            shafts: has(&|p| p.elastic_shaft.is_some()).then(ShaftLanes::none),
            arch: Arch::new(),
            seen: Seen::none(),
            shown_current_a: [0.0; N],
            held: [[0.0; N]; 2],
            shares: [[1.0; N], [0.0; N]],
            asking: Asking::of(&runs),
            ends: core::array::from_fn(|lane| ticks.get(lane).copied().unwrap_or(0)),
            runs,
        };
        for lane in 0..N {
            // the last fills what is left of the lanes, so that nothing there is out of the ordinary
            let of = lane.min(lanes.runs.len().saturating_sub(1));
            let nominal = lanes.runs[of].train.nominal_friction();
            lanes.nominal.put(lane, &nominal);
            lanes.take_over(lane, of);
        }
        lanes
    }

    /// Currents as their sensors showed them before the last tick.
    pub(crate) fn shown_current_a(&self) -> &Wide<N> {
        &self.shown_current_a
    }

    /// Outputs of the controllers in the last tick.
    pub(crate) fn output(&self) -> &Wide<N> {
        &self.held[0]
    }

    /// Ticks that each lane has made before it ended.
    pub(crate) fn ends(&self) -> &[usize; N] {
        &self.ends
    }

    /// One tick of all lanes.
    #[inline(always)]
    pub(crate) fn tick(&mut self, tick: usize, commands: &Wide<N>) {
        self.begin(tick);
        self.show(commands);
        self.control.decide(&self.seen, &mut self.held[0]);
        if self.asking.delayed.is_empty() {
            self.hold(tick, 0);
        } else {
            self.pass_delays();
            self.hold(tick, 0);
            self.hold(tick, 1);
        }
    }

    /// Fresh sines, and the loads, as in [`Run::begin_tick`].
    #[inline(always)]
    fn begin(&mut self, tick: usize) {
        if tick.is_multiple_of(REFRESH_TICKS) {
            self.refresh(tick);
        }
        if !self.asking.loaded.is_empty() {
            self.take_loads();
        }
    }

    #[inline(never)]
    fn refresh(&mut self, tick: usize) {
        let moving = &mut self.moving;
        for (lane, run) in self.runs.iter_mut().enumerate() {
            if tick >= self.ends[lane] {
                continue;
            }
            if run.winding.eccentric {
                let rotor = RotorAngle::new(run.start_angle_rad + moving.angle_rad[lane]);
                (moving.sin[lane], moving.cos[lane]) = (rotor.sin, rotor.cos);
            }
            run.guard.watch(tick as f64 * self.tick_s, moving.speed_rad_per_s[lane]);
            if run.guard.has_passed() {
                self.ends[lane] = self.ends[lane].min(tick + 1);
            }
        }
    }

    /// Takes what changes of the loads over.
    #[inline(never)]
    fn take_loads(&mut self) {
        for &lane in &self.asking.loaded {
            let run = &mut self.runs[lane];
            let Some(load) = &mut run.load else { continue };
            if let Some(now_n_m) = load.changed_n_m(0.0) {
                match &mut run.extension {
                    Some(extension) if extension.is_compliant() => extension.set_load(now_n_m),
                    _ => run.train.set_load(now_n_m),
                }
                // where the surface stands decides what it feels
                run.train.angle_rad = self.moving.angle_rad[lane];
                self.lasting.feel(lane, run);
                if let Some(shafts) = &mut self.shafts {
                    shafts.set_load(lane, now_n_m);
                }
                self.moving.external_n_m[lane] = self.external_n_m(lane);
            }
            let Some(load) = &mut self.runs[lane].load else { continue };
            load.advance(0.0, self.tick_s);
        }
    }

    /// Torque on the shaft besides the motor's and the viscous one.
    #[inline(always)]
    fn external_n_m(&self, lane: usize) -> f64 {
        let sign = self.lasting.sign[lane];
        let friction = &self.friction;
        let kinetic_n_m = friction.kinetic_n_m[usize::from(sign >= 0.0)][lane];
        -sign * kinetic_n_m - self.lasting.felt_load_n_m[lane] - friction.against_n_m[lane]
    }

    /// What the sensors show.
    #[inline(always)]
    fn show(&mut self, commands: &Wide<N>) {
        let Self { fixed, lasting, moving, seen, .. } = self;
        for lane in 0..N {
            let angle_rad = moving.angle_rad[lane];
            let moved_rad = (angle_rad * lasting.follows[lane] + lasting.offset_rad[lane])
                * fixed.per_gear_ratio[lane];
            seen.command[lane] = commands[lane];
            seen.moved_rad[lane] = moved_rad;
            seen.shown_rad[lane] = fixed.start_position_rad[lane] + moved_rad;
            seen.angle_rad[lane] = angle_rad;
            seen.speed_rad_per_s[lane] = moving.speed_rad_per_s[lane];
            self.shown_current_a[lane] = moving.current_a[lane];
        }
        self.misplace();
        for &lane in &self.asking.sensing {
            if let Some(extension) = &mut self.runs[lane].extension {
                let shown_a = extension.shown_current_a(self.moving.current_a[lane]);
                self.shown_current_a[lane] = shown_a;
            }
        }
    }

    /// What sensors of the position show that sit behind an elastic shaft, or that err.
    #[inline(always)]
    fn misplace(&mut self) {
        let Self { fixed, moving, seen, .. } = self;
        if let Some(shafts) = &self.shafts {
            seen.moved_rad = shafts.angle_rad;
            for lane in 0..N {
                seen.shown_rad[lane] = fixed.start_position_rad[lane] + seen.moved_rad[lane];
            }
        }
        for &lane in &self.asking.misplaced {
            let Some(extension) = &mut self.runs[lane].extension else { continue };
            let motor_rad = fixed.start_angle_rad[lane] + moving.angle_rad[lane];
            seen.shown_rad[lane] = extension.shown_of_rad(seen.shown_rad[lane], motor_rad);
        }
    }

    /// Lets set-points pass the delays that controllers have.
    #[inline(never)]
    fn pass_delays(&mut self) {
        for &lane in &self.asking.delayed {
            if let Some(extension) = &mut self.runs[lane].extension {
                let held = extension.delayed(self.held[0][lane]);
                for (part, held) in held.iter().enumerate() {
                    self.held[part][lane] = held.value;
                    self.shares[part][lane] = held.share;
                }
            }
        }
    }

    /// Holds set-points for their share of the tick.
    #[inline(always)]
    fn hold(&mut self, tick: usize, part: usize) {
        for lane in 0..N {
            let share = if tick < self.ends[lane] { self.shares[part][lane] } else { 0.0 };
            self.moving.left_s[lane] = share * self.tick_s;
        }
        while self.is_any_on() {
            self.look_ahead();
            self.regulate(part);
            if !self.effects.is_empty() {
                self.find_middle();
                self.act();
            }
            self.glide();
            self.spring();
            self.arrive();
            if self.ahead.is_on != self.ahead.passes {
                for lane in 0..N {
                    if self.ahead.is_on[lane] != self.ahead.passes[lane] {
                        self.finish(lane, tick, part);
                    }
                }
            }
        }
    }

    /// Whether anything is left of the time for which any set-point is held.
    #[inline(always)]
    fn is_any_on(&mut self) -> bool {
        let least_s = LEAST_LEFT * self.tick_s;
        for lane in 0..N {
            self.ahead.is_on[lane] = u64::from(self.moving.left_s[lane] > least_s);
        }
        self.ahead.is_on.iter().fold(0, |any, on| any | on) != 0
    }

    /// Length of the next segment.
    #[inline(always)]
    fn look_ahead(&mut self) {
        let Self { fixed, moving, ahead, .. } = self;
        if self.effects.is_empty() {
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
    fn regulate(&mut self, part: usize) {
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
    fn find_middle(&mut self) {
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
    fn act(&mut self) {
        let Self { lasting, moving, ahead, friction, nominal, .. } = self;
        let at = &ahead.middle;
        // a load that changes is felt beside the friction of a lane's own last segment
        let before = (!self.asking.loaded.is_empty()).then(|| friction.clone());
        let mut loads = ShaftLoads::new(nominal.against_n_m);
        for effect in &self.effects {
            self.arch.dispatch(Adding { effect, at, loads: &mut loads });
        }
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
    fn glide(&mut self) {
        let Self { fixed, lasting, moving, ahead, friction, .. } = self;
        for lane in 0..N {
            let sign = lasting.sign[lane];
            let [backward, forward] = [0, 1].map(|side: usize| friction.kinetic_n_m[side][lane]);
            let kinetic_n_m = if sign >= 0.0 { forward } else { backward };
            let against_n_m = friction.against_n_m[lane];
            let external_n_m = -sign * kinetic_n_m - lasting.felt_load_n_m[lane] - against_n_m;
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
    fn spring(&mut self) {
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
    fn arrive(&mut self) {
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

    /// Takes a lane in which something happens to the end of the time for which its set-point is
    /// held.
    #[inline(never)]
    fn finish(&mut self, lane: usize, tick: usize, part: usize) {
        let (run, moving) = (&mut self.runs[lane], &self.moving);
        let (reference, left_s) = (self.held[part][lane], moving.left_s[lane]);
        run.train.angle_rad = moving.angle_rad[lane];
        run.train.speed_rad_per_s = moving.speed_rad_per_s[lane];
        (run.rotor.sin, run.rotor.cos) = (moving.sin[lane], moving.cos[lane]);
        run.current_a = moving.current_a[lane];
        run.shaft.external_n_m = moving.external_n_m[lane];
        if let Some(mut extension) = run.extension.take() {
            extension.put_time(moving.time_s[lane], moving.since_commutation_s[lane]);
            let parts = extension.parts_mut();
            if let (Some(lanes), Some(bristles)) = (&self.bristles, &mut parts.bristles) {
                lanes.give_back(lane, bristles);
            }
            if let (Some(lanes), Some(shaft)) = (&self.shafts, &mut parts.elastic_shaft) {
                lanes.give_back(lane, shaft);
            }
            run.hold_with(&mut extension, reference, left_s, self.tick_s);
            run.extension = Some(extension);
        } else {
            run.advance_plain(reference, left_s);
        }
        if run.guard.has_passed() {
            self.ends[lane] = self.ends[lane].min(tick + 1);
        }
        self.take_over(lane, lane);
    }

    /// Takes over the state of a lane's run.
    fn take_over(&mut self, lane: usize, of: usize) {
        let (run, moving) = (&self.runs[of], &mut self.moving);
        moving.angle_rad[lane] = run.train.angle_rad;
        moving.speed_rad_per_s[lane] = run.train.speed_rad_per_s;
        (moving.sin[lane], moving.cos[lane]) = (run.rotor.sin, run.rotor.cos);
        moving.current_a[lane] = run.current_a;
        moving.external_n_m[lane] = run.shaft.external_n_m;
        if let Some(extension) = &run.extension {
            moving.time_s[lane] = extension.time_s();
            moving.since_commutation_s[lane] = extension.since_commutation_s();
            let parts = extension.parts();
            if let (Some(lanes), Some(bristles)) = (&mut self.bristles, &parts.bristles) {
                lanes.put(lane, bristles);
            }
            if let (Some(lanes), Some(shaft)) = (&mut self.shafts, &parts.elastic_shaft) {
                lanes.put(lane, parts, shaft);
            }
        }
        moving.left_s[lane] = 0.0;
        self.friction.put(lane, &run.train.friction());
        self.lasting.take_over(lane, run);
    }
}

impl<const N: usize> Fixed<N> {
    fn of(runs: &[Run], tick_s: f64) -> Self {
        let of = |number: &dyn Fn(&Run) -> f64| {
            core::array::from_fn(|lane| runs.get(lane).or(runs.last()).map_or(0.0, number))
        };
        let parts = |run: &Run, of: &dyn Fn(&Parts) -> f64, plain: f64| {
            run.extension.as_ref().map_or(plain, |extension| of(extension.parts()))
        };
        let in_loop = |parts: &Parts| parts.current_sensor.filter(|sensor| sensor.in_loop);
        Self {
            longest_s: of(&|run| parts(run, &|p| p.longest_s, tick_s)),
            longest_rad: of(&|run| parts(run, &|p| p.longest_rad, f64::INFINITY)),
            shortest_s: of(&|run| run.extension.as_ref().map_or(0.0, |e| e.shortest_s())),
            limit_v: of(&|run| run.limit_v),
            most_speed: of(&|run| match run.extension {
                Some(_) => run.guard.most(),
                None => f64::INFINITY,
            }),
            viscous_n_m_s_per_rad: of(&|run| run.train.viscous_n_m_s_per_rad),
            start_angle_rad: of(&|run| run.start_angle_rad),
            start_position_rad: of(&|run| run.start_position_rad),
            per_gear_ratio: of(&|run| run.train.surface_line().2),
            eccentricity_cos: of(&|run| run.winding.eccentricity()[0]),
            eccentricity_sin: of(&|run| run.winding.eccentricity()[1]),
            offset_a: of(&|run| {
                parts(run, &|p| in_loop(p).map_or(0.0, |sensor| sensor.offset_a), 0.0)
            }),
            gain: of(&|run| {
                parts(run, &|p| in_loop(p).map_or(1.0, |s| 1.0 + s.gain_error_ratio), 1.0)
            }),
        }
    }
}

impl<const N: usize> Lasting<N> {
    fn none() -> Self {
        let zero = [0.0; N];
        Self {
            follows: zero,
            offset_rad: zero,
            sign: zero,
            per_inertia: [zero; 4],
            felt_load_n_m: zero,
            carried_load_n_m: zero,
            low_rad: zero,
            high_rad: zero,
            holding_n_m: [zero; 2],
            constant: zero,
            resistance_ohm: zero,
        }
    }

    /// Takes over what lasts of a lane's run.
    fn take_over(&mut self, lane: usize, run: &Run) {
        (self.follows[lane], self.offset_rad[lane], _) = run.train.surface_line();
        self.sign[lane] = run.train.direction.sign();
        for (wide, per_inertia) in self.per_inertia.iter_mut().zip(run.shaft.per_inertia) {
            wide[lane] = per_inertia;
        }
        (self.low_rad[lane], self.high_rad[lane]) = run.window_rad;
        let sector = run.sectors[run.sector.place()];
        (self.constant[lane], self.resistance_ohm[lane]) = sector;
        self.feel(lane, run);
    }

    /// Takes over the load that a lane's shaft feels.
    fn feel(&mut self, lane: usize, run: &Run) {
        self.felt_load_n_m[lane] = run.train.felt_load_n_m();
        self.carried_load_n_m[lane] = run.train.carried_load_n_m();
        (self.holding_n_m[0][lane], self.holding_n_m[1][lane]) = run.train.holding_n_m();
    }
}

impl<const N: usize> Moving<N> {
    fn none() -> Self {
        let zero = [0.0; N];
        Self {
            angle_rad: zero,
            speed_rad_per_s: zero,
            sin: zero,
            cos: zero,
            current_a: zero,
            external_n_m: zero,
            time_s: zero,
            since_commutation_s: zero,
            left_s: zero,
        }
    }
}

impl<const N: usize> Ahead<N> {
    fn none() -> Self {
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

impl<const N: usize> Friction<N> {
    fn none() -> Self {
        let zero = [0.0; N];
        Self { kinetic_n_m: [zero; 2], static_n_m: [zero; 2], against_n_m: zero }
    }

    /// The friction of a lane.
    #[inline(always)]
    fn of(&self, lane: usize) -> FrictionState {
        let of = |sides: &[Wide<N>; 2]| [sides[0][lane], sides[1][lane]];
        FrictionState {
            kinetic_n_m: of(&self.kinetic_n_m),
            static_n_m: of(&self.static_n_m),
            against_n_m: self.against_n_m[lane],
        }
    }

    /// Takes over the friction of a lane.
    #[inline(always)]
    fn put(&mut self, lane: usize, of: &FrictionState) {
        for side in 0..2 {
            self.kinetic_n_m[side][lane] = of.kinetic_n_m[side];
            self.static_n_m[side][lane] = of.static_n_m[side];
        }
        self.against_n_m[lane] = of.against_n_m;
    }
}

impl<const N: usize> Seen<N> {
    fn none() -> Self {
        let zero = [0.0; N];
        Self {
            command: zero,
            shown_rad: zero,
            moved_rad: zero,
            angle_rad: zero,
            speed_rad_per_s: zero,
        }
    }
}

impl Asking {
    fn of(runs: &[Run]) -> Self {
        let with = |asks: &dyn Fn(&Run) -> bool| {
            let runs = runs.iter().enumerate();
            runs.filter(|(_, run)| asks(run)).map(|(lane, _)| lane).collect()
        };
        let parts = |run: &Run, ask: &dyn Fn(&Parts) -> bool| {
            run.extension.as_ref().is_some_and(|extension| ask(extension.parts()))
        };
        Self {
            misplaced: with(&|run| {
                let errs = |p: &Parts| !p.position_waves.is_empty() || p.position_sensor.is_some();
                parts(run, &errs)
            }),
            sensing: with(&|run| parts(run, &|p| p.current_sensor.is_some())),
            delayed: with(&|run| parts(run, &|p| p.delay.is_some())),
            loaded: with(&|run| run.load.is_some()),
        }
    }
}

/// Signal that is kept of lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// The current as its sensor shows it.
    Current,
    /// The controller's output.
    Output,
}

/// Ticks whose values are gathered before they are handed out.
const GATHERED: usize = 64;

/// A run of all lanes, each on its own command; every `step`-th value is kept.
pub(crate) struct SideBySide<'a, const N: usize, C> {
    pub(crate) lanes: OwnLanes<N, C>,
    pub(crate) commands: &'a [&'a [f64]],
    pub(crate) kept: Kept,
    pub(crate) step: usize,
}

impl<const N: usize, C: LaneControl<N>> NullaryFnOnce for SideBySide<'_, N, C> {
    type Output = Vec<Vec<f64>>;

    /// The signal of each lane; NaN from where a shaft is driven away.
    #[inline(always)]
    fn call(self) -> Vec<Vec<f64>> {
        let Self { mut lanes, commands, kept, step } = self;
        let most = commands.iter().map(|command| command.len()).max().unwrap_or(0);
        let room = |command: &&[f64]| Vec::with_capacity(command.len().div_ceil(step) + GATHERED);
        let mut values: Vec<Vec<f64>> = commands.iter().map(room).collect();
        let mut gathered = [[0.0; N]; GATHERED];
        let mut rows = 0;
        let mut command = [0.0; N];
        for tick in 0..most {
            for (now, command) in command.iter_mut().zip(commands) {
                *now = command.get(tick).copied().unwrap_or(*now);
            }
            lanes.tick(tick, &command);
            if tick.is_multiple_of(step) {
                gathered[rows] = match kept {
                    Kept::Current => *lanes.shown_current_a(),
                    Kept::Output => *lanes.output(),
                };
                rows += 1;
            }
            if rows == GATHERED || tick + 1 == most {
                hand_out(&gathered[..rows], &mut values);
                rows = 0;
            }
        }
        for ((values, command), end) in values.iter_mut().zip(commands).zip(lanes.ends()) {
            values.truncate(end.div_ceil(step));
            values.resize(command.len().div_ceil(step), f64::NAN);
        }
        values
    }
}

/// Hands rows of all lanes out to each.
fn hand_out<const N: usize>(rows: &[[f64; N]], values: &mut [Vec<f64>]) {
    for (lane, values) in values.iter_mut().enumerate() {
        values.extend(rows.iter().map(|row| row[lane]));
    }
}
