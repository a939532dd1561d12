//! Runs side by side, a lane each, every one with a machine, effects and a command of its own.
//!
//! A segment in which nothing happens is the same arithmetic for each lane, written once more for
//! arrays, so that the compiler takes several lanes at a time. What effects add to friction and
//! torque is written so as well. Three things go lane by lane:
//!
//! - a lane in which something happens (commutation, standstill, contact, a stop, the supply's
//!   limit) is taken to the end of the tick by its own [`Run`];
//! - errors of a sensor, delays and loads that change are asked of the run's own effects and load;
//! - the sines of the rotor are taken afresh every so many ticks.
//!
//! Operations and their order are those of the run, and nothing is fused: both give the same bits
//! at any vector width (`docs/decisions/0128-effects-side-by-side.md`).
#![expect(
    clippy::inline_always,
    reason = "the loop is compiled once for each instruction set, which inlining makes possible"
)]

mod kept;
mod numbers;
mod segment;
mod springs;

pub(super) use kept::SideBySide;
pub(crate) use kept::{GATHERED, Kept};

use crate::{
    effect::{
        Effect,
        lanes::{Adding, EffectLanes, Moments, ShaftLoads},
        part::Parts,
    },
    extension::Extension,
    vectors::Vectors,
    wide::Wide,
    winding::RotorAngle,
};

use self::{
    numbers::{Fixed, Friction, Lasting, Moving},
    segment::Ahead,
    springs::{BristleLanes, ShaftLanes},
};
use super::{LEAST_LEFT, REFRESH_TICKS, Run};

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

/// Effects of all lanes.
#[derive(Clone, Debug)]
enum Effects<const N: usize> {
    None,
    /// Alike in all lanes but for their numbers.
    Same(Vec<EffectLanes<N>>),
    /// Each run has its own.
    OfEach,
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
    /// Effects that add to friction and torque, and parts that they have put in.
    effects: Effects<N>,
    bristles: Option<BristleLanes<N>>,
    shafts: Option<ShaftLanes<N>>,
    vectors: Vectors,
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

    /// True where a run with other effects may go beside it: it has some, and none with lanes of its
    /// own.
    pub(super) fn may_differ_in_effects(&self) -> bool {
        let has_lanes = |extension: &Extension| {
            extension.parts().bristles.is_some() || extension.is_compliant()
        };
        let extension = self.extension.as_ref();
        !self.effects().is_empty() && !extension.is_some_and(|extension| has_lanes(extension))
    }

    /// True where the effects of another one differ in their numbers alone.
    pub(super) fn has_effects_of(&self, other: &Self) -> bool {
        self.effects().iter().map(Effect::id).eq(other.effects().iter().map(Effect::id))
    }

    /// The effects that are on.
    fn effects(&self) -> &[Effect] {
        self.extension.as_ref().map_or(&[], |extension| extension.effects())
    }
}

impl<const N: usize> Effects<N> {
    fn of(runs: &[Run]) -> Self {
        let Some(first) = runs.first() else { return Self::None };
        if runs.iter().any(|run| !run.has_effects_of(first)) {
            return Self::OfEach;
        }
        let mut effects: Vec<EffectLanes<N>> =
            first.effects().iter().filter_map(Effect::in_lanes).collect();
        for lane in 0..N {
            let run = &runs[lane.min(runs.len() - 1)];
            for (lanes, effect) in effects.iter_mut().zip(run.effects()) {
                lanes.put(lane, effect.all_values());
            }
        }
        if effects.is_empty() { Self::None } else { Self::Same(effects) }
    }

    fn is_none(&self) -> bool {
        matches!(self, Self::None)
    }

    /// Adds what they do to the loads of all lanes.
    #[inline(always)]
    fn act(&self, vectors: Vectors, runs: &[Run], at: &Moments<N>, loads: &mut ShaftLoads<N>) {
        match self {
            Self::None => {}
            Self::Same(effects) => {
                for effect in effects {
                    Adding { effect, at, loads }.by(vectors);
                }
            }
            Self::OfEach => act_of_each(runs, at, loads),
        }
    }
}

/// Adds what each run's own effects do to its load.
#[inline(never)]
fn act_of_each<const N: usize>(runs: &[Run], at: &Moments<N>, loads: &mut ShaftLoads<N>) {
    for (lane, run) in runs.iter().enumerate() {
        let mut load = loads.of(lane);
        for effect in run.effects() {
            effect.load(&at.of(lane), &mut load);
        }
        loads.put(lane, &load);
    }
}

impl<const N: usize, C: LaneControl<N>> OwnLanes<N, C> {
    /// At most `N` runs that [join lanes](Run::joins_lanes), with so many ticks each. They have the
    /// same effects, or all [may differ](Run::may_differ_in_effects) in them.
    pub(crate) fn of(
        runs: Vec<Run>,
        control: C,
        tick_s: f64,
        ticks: &[usize],
        vectors: Vectors,
    ) -> Self {
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
            effects: Effects::of(&runs),
            bristles: has(&|p| p.bristles.is_some()).then(BristleLanes::none),
            shafts: has(&|p| p.elastic_shaft.is_some()).then(ShaftLanes::none),
            vectors,
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

    /// Angles of the motors before the last tick, with those at the start.
    pub(crate) fn motor_angle_rad(&self) -> Wide<N> {
        core::array::from_fn(|lane| self.fixed.start_angle_rad[lane] + self.seen.angle_rad[lane])
    }

    /// Speeds of the motors before the last tick.
    pub(crate) fn motor_speed_rad_per_s(&self) -> &Wide<N> {
        &self.seen.speed_rad_per_s
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
            let changed_n_m = run.load.as_mut().and_then(|load| load.changed_n_m(0.0));
            if let Some(now_n_m) = changed_n_m {
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
                self.moving.external_n_m[lane] = self.friction.external_n_m(lane, &self.lasting);
            }
            if let Some(load) = &mut self.runs[lane].load {
                load.advance(0.0, self.tick_s);
            }
        }
    }

    /// Reads the sensors of all lanes.
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

    /// Reads sensors of the position that sit behind an elastic shaft, or that err.
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
            if !self.effects.is_none() {
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

    /// True where anything is left of the time for which any set-point is held.
    #[inline(always)]
    fn is_any_on(&mut self) -> bool {
        let least_s = LEAST_LEFT * self.tick_s;
        for lane in 0..N {
            self.ahead.is_on[lane] = u64::from(self.moving.left_s[lane] > least_s);
        }
        self.ahead.is_on.iter().fold(0, |any, on| any | on) != 0
    }

    /// Takes a lane in which something happens to the end of the time for which its set-point is
    /// held.
    #[inline(never)]
    fn finish(&mut self, lane: usize, tick: usize, part: usize) {
        let run = &mut self.runs[lane];
        let (reference, left_s) = (self.held[part][lane], self.moving.left_s[lane]);
        self.moving.give_back(lane, run);
        if let Some(mut extension) = run.extension.take() {
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

    /// Takes over the state of the run at a place into a lane.
    fn take_over(&mut self, lane: usize, place: usize) {
        let run = &self.runs[place];
        self.moving.take_over(lane, run);
        if let Some(extension) = &run.extension {
            let parts = extension.parts();
            if let (Some(lanes), Some(bristles)) = (&mut self.bristles, &parts.bristles) {
                lanes.put(lane, bristles);
            }
            if let (Some(lanes), Some(shaft)) = (&mut self.shafts, &parts.elastic_shaft) {
                lanes.put(lane, parts, shaft);
            }
        }
        self.friction.put(lane, &run.train.friction());
        self.lasting.take_over(lane, run);
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
