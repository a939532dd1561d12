//! Winding, shaft and drive train from event to event, with nothing rounded to a step.
//!
//! Events are the switching instants of the legs, sector changes, the end of freewheeling,
//! standstill and breakaway, the play closing and the end stops. Between events the winding and
//! the shaft follow a Taylor series (`winding`).

mod comparators;
mod dead_time;
mod elastic;
mod electric;
mod event;
mod shorted;
mod three_legs;

use elastic::Flank;
use event::Event;

use crate::{
    controller::Measured,
    drive_train::{Direction, DriveTrain, START_RAD},
    effect::{
        Effect,
        part::{MachineNumbers, delay::HeldReference},
    },
    event_limit::EventLimit,
    extension::{Extension, Instant, MotorState},
    fault::PhysicalFaults,
    load::LoadRun,
    params::{Actuator, BackEmfShape},
    phase::{PerPhase, Sector},
    probe::{Circuit, Probe},
    scenario::Scenario,
    series::value,
    shorted_loops::ShortedLoops,
    speed_guard::SpeedGuard,
    trace::HighFidelityTrace,
    waveform::Corners,
    winding::{
        AirGap, Coupling, CubicTerms, LegVolts, LoopVolts, RotorAngle, RotorFrame, SectorWinding,
        Segment, SegmentStart, Shaft, Winding,
    },
};

/// Events in a hold of the legs beyond which they are put off; in ordinary motion there are a
/// handful.
const MOST_IN_A_HOLD: u32 = 1 << 10;
/// Turn after which the air gap's series is centred anew, should a tick bring more.
const GAP_REACH_RAD: f64 = 0.05;

/// State of a run.
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own, read in a hot loop")]
pub(crate) struct Run<P> {
    winding: Winding,
    train: DriveTrain,
    /// Effects, where there are any.
    extension: Option<Box<Extension>>,
    /// The shaft's equation in the present state of the drive train.
    shaft: Shaft,
    half_bus_v: f64,
    /// A segment is cut at this length, where its series would lose accuracy.
    longest_s: f64,
    start_angle_rad: f64,
    /// Currents of the positive and the idle phase of the sector; the negative one carries the rest.
    positive_a: f64,
    idle_a: f64,
    rotor: RotorAngle,
    gap: AirGap,
    /// The rotor in electrical angle, taken afresh each carrier period where all legs are
    /// connected.
    electrical: RotorAngle,
    sector: Sector,
    at: SectorWinding,
    /// True where the negative phase goes on from the sector before, the positive one into the
    /// next.
    begins_with_negative: bool,
    /// Motor angles from the start between which the sector lasts.
    sector_rad: (f64, f64),
    /// Motor angles from the start between which neither sector nor contact changes.
    window_rad: (f64, f64),
    /// Angle of the rotor by which effects make the commutation early.
    lead_rad: f64,
    /// Corners of the back-EMF that are not where sectors end, and where the next ones are.
    corners: Option<Corners>,
    corner_rad: (f64, f64),
    /// Resistance of the winding over that of the cold one.
    warmth_ratio: f64,
    /// True where effects make the circuit of a segment depend on its current, or the surface move
    /// on its own.
    own_circuit: bool,
    /// Which flank holds the surface, where it moves on its own behind an elastic shaft.
    flank: Option<Flank>,
    /// Shorted turns in which a current circulates, where there are any.
    shorted: Option<Box<ShortedLoops>>,
    gear_ratio: f64,
    /// Error of the current's sensor.
    sensor_error_a: f64,
    /// Sample of the electronics at the last seam of two carrier periods.
    pub(crate) sample: Sample,
    /// True after a diode that opened by no more than rounding has blocked again at once.
    blocked: bool,
    /// Potentials of the legs while all three are connected.
    legs_v: PerPhase,
    /// True where sectors mean nothing: all legs connected, and a back-EMF without corners.
    whole_turn: bool,
    pub(crate) segments: u64,
    /// Guard against a shaft that is driven away.
    pub(crate) guard: SpeedGuard,
    pub(crate) probe: P,
}

/// A segment with what it was solved from.
struct Step {
    segment: Segment,
    coupling: Coupling,
    /// Sign of the idle phase's current through its diodes, 0 when none conducts.
    diode: f64,
    /// Potentials of the legs of the positive and the negative phase.
    pair: LegVolts,
    /// Potential of the idle leg while it is connected.
    idle_v: f64,
}

/// Sample of the electronics.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sample {
    pub(crate) currents_a: PerPhase,
    pub(crate) feedback_a: f64,
    /// Motor angle from the start.
    pub(crate) angle_rad: f64,
    speed_rad_per_s: f64,
    surface_rad: f64,
}

impl Sample {
    /// The part of it that the cascade measures.
    pub(crate) fn measured(&self) -> Measured {
        Measured {
            surface_rad: self.surface_rad,
            motor_rad: self.angle_rad,
            speed_rad_per_s: self.speed_rad_per_s,
        }
    }
}

/// Length of the edges of a carrier period.
fn edge_s(duty: f64, period_s: f64) -> f64 {
    0.25 * (1.0 - duty.abs()) * period_s
}

/// Angle and speed of the motor, and the heat of the cold winding, at an instant.
struct Mark {
    shaft: MotorState,
    heat_w: f64,
}

/// State at the end of a span.
struct End {
    positive_a: f64,
    idle_a: f64,
    speed_rad_per_s: f64,
    turn_rad: f64,
}

impl End {
    #[inline]
    fn of(segment: &Segment, at_s: f64) -> Self {
        Self {
            positive_a: value(&segment.positive, at_s),
            idle_a: value(&segment.idle, at_s),
            speed_rad_per_s: value(&segment.speed, at_s),
            turn_rad: value(&segment.turn, at_s),
        }
    }
}

impl<P: Probe> Run<P> {
    /// The machine at the start of a test; `connected` when no leg is ever open.
    pub(crate) fn new(
        actuator: &Actuator,
        scenario: &Scenario,
        faults: &PhysicalFaults,
        probe: P,
        connected: bool,
    ) -> Self {
        let shorted = ShortedLoops::of(&actuator.motor, faults).map(Box::new);
        let faults = &actuator.motor.shorted_turns.left_in_phases(faults);
        let winding = Winding::new(&actuator.motor, faults);
        let mut longest_s = longest_segment_s(actuator, faults);
        if let Some(loops) = &shorted {
            longest_s = longest_s.min(loops.longest_s(1.0 / actuator.inverter.carrier_hz));
        }
        let train = DriveTrain::new(actuator, faults, scenario);
        let start_angle_rad = scenario.start_angle_rad;
        let sector = Sector::of_electrical_angle(start_angle_rad * winding.pole_pairs());
        let rotor = RotorAngle::new(start_angle_rad);
        let mut run = Self {
            longest_s: longest_s * probe.longest_segment_ratio(),
            shaft: train.shaft(),
            train,
            extension: None,
            half_bus_v: 0.5 * actuator.inverter.bus_voltage_v,
            start_angle_rad,
            positive_a: 0.0,
            idle_a: 0.0,
            rotor,
            gap: winding.air_gap(&rotor),
            electrical: RotorAngle::new(start_angle_rad * winding.pole_pairs()),
            sector,
            at: *winding.sector(sector),
            begins_with_negative: true,
            winding,
            sector_rad: (0.0, 0.0),
            window_rad: (0.0, 0.0),
            lead_rad: 0.0,
            corners: None,
            corner_rad: (f64::NEG_INFINITY, f64::INFINITY),
            warmth_ratio: 1.0,
            own_circuit: shorted.is_some(),
            flank: None,
            shorted,
            gear_ratio: actuator.transmission.gear_ratio,
            sensor_error_a: 0.0,
            sample: Sample::default(),
            blocked: false,
            legs_v: [1.0, -1.0, -1.0].map(|sign| sign * 0.5 * actuator.inverter.bus_voltage_v),
            whole_turn: connected && actuator.motor.back_emf_shape != BackEmfShape::Trapezoid,
            segments: 0,
            guard: SpeedGuard::OFF,
            probe,
        };
        run.enter(sector);
        run.take_sample();
        run
    }

    /// The electronics sample the present state.
    pub(crate) fn take_sample(&mut self) {
        self.sample = self.sample_now();
    }

    /// Takes effects on.
    pub(crate) fn add_effects(
        &mut self,
        actuator: &Actuator,
        faults: &PhysicalFaults,
        effects: &[Effect],
    ) {
        let t = &actuator.transmission;
        let machine = MachineNumbers {
            inertia_kg_m2: actuator.total_inertia_kg_m2(),
            per_gear_ratio: 1.0 / t.gear_ratio,
            load_inertia_kg_m2: t.surface_inertia_kg_m2,
            efficiency_ratio: t.efficiency_ratio,
            half_play_rad: 0.5 * t.backlash_rad * faults.backlash_ratio,
            tick_s: 1.0 / actuator.controller.sample_hz,
            start_position_rad: START_RAD,
            pole_pairs: f64::from(actuator.motor.pole_pairs),
        };
        self.extension = Extension::of(effects, &machine, &mut self.train, 1.0);
        if self.extension.is_some() {
            self.rewire();
            self.renew();
        }
    }

    /// Looks whether the shaft is driven away; with effects each segment is looked at.
    pub(crate) fn look_at_speed(&mut self, time_s: f64) {
        self.guard.watch(time_s, self.train.speed_rad_per_s);
    }

    /// Takes the load of the next tick.
    pub(crate) fn take_load(&mut self, load: &mut LoadRun, tick_s: f64) {
        let motor_rad = self.start_angle_rad + self.train.angle_rad;
        let surface_rad = match &self.extension {
            None => self.train.surface_rad(),
            Some(extension) => extension.position_rad(&self.train, motor_rad),
        };
        let now_n_m = load.now_n_m(surface_rad);
        match &mut self.extension {
            Some(extension) if extension.is_compliant() => extension.set_load(now_n_m),
            _ => self.train.set_load(now_n_m),
        }
        load.advance(surface_rad, tick_s);
        self.renew();
    }

    /// Replaces the sampled position by the one that its sensor shows, once a tick.
    pub(crate) fn show_surface(&mut self) {
        if let Some(extension) = &mut self.extension {
            let motor_rad = self.start_angle_rad + self.sample.angle_rad;
            let surface_rad = self.sample.surface_rad;
            self.sample.surface_rad = extension.read_position_rad(surface_rad, motor_rad);
        }
    }

    /// Set-points to hold in this tick, each with its share of it.
    pub(crate) fn delayed(&mut self, reference_a: f64) -> [HeldReference; 2] {
        match &mut self.extension {
            None => HeldReference::undelayed(reference_a),
            Some(extension) => extension.delayed(reference_a),
        }
    }

    /// Puts what effects do in a span on the shaft; returns the span, shorter where they ask.
    #[inline]
    fn take_effects_in(&mut self, span_s: f64) -> f64 {
        if self.extension.is_none() { span_s } else { self.take_effects(span_s, None) }
    }

    /// Effects of the next span, or, at an event, of the state with another speed.
    #[cold]
    fn take_effects(&mut self, span_s: f64, speed_rad_per_s: Option<f64>) -> f64 {
        let Some(mut extension) = self.extension.take() else { return span_s };
        let speed = speed_rad_per_s.unwrap_or(self.train.speed_rad_per_s);
        let span_s = span_s.min(extension.longest_s(speed));
        let motor_rad = self.start_angle_rad + self.train.angle_rad;
        let coupling = self.coupling(motor_rad, self.along(self.train.angle_rad));
        let saturation = extension.saturation_ratio(self.amplitude_a(self.positive_a, self.idle_a));
        let terminal_n_m = coupling.torque_now_n_m(self.positive_a, self.idle_a);
        let motor_n_m = saturation * (terminal_n_m + self.circulating_now_n_m());
        let drag_n_m = self.shaft.viscous_n_m_s_per_rad * speed;
        let rate = (motor_n_m + self.shaft.external_n_m - drag_n_m) * self.shaft.per_inertia[0];
        let instant = Instant { motor_rad, speed_rad_per_s: speed, motor_n_m };
        let reach_s = if speed_rad_per_s.is_some() { 0.0 } else { span_s };
        extension.act(&mut self.train, &instant, rate, reach_s);
        let warmth_ratio = extension.winding().warmth_ratio_in(0.5 * reach_s, self.copper_w());
        if warmth_ratio != self.warmth_ratio {
            self.warmth_ratio = warmth_ratio;
            self.at = self.winding.sector(self.sector).warmed(warmth_ratio);
        }
        self.extension = Some(extension);
        self.shaft = self.train.shaft();
        span_s
    }

    /// Where the machine stands before a segment.
    #[inline]
    fn mark(&self) -> Mark {
        let heat_w = if self.extension.is_some() { self.copper_w() } else { 0.0 };
        Mark { shaft: MotorState::of(&self.train), heat_w }
    }

    /// Goes on in time with the effects.
    #[inline]
    fn advance_effects(&mut self, span_s: f64, from: &Mark) {
        if self.extension.is_some() {
            let heat_w = 0.5 * (from.heat_w + self.copper_w());
            let to = MotorState::of(&self.train);
            if let Some(extension) = &mut self.extension {
                extension.advance(span_s, from.shaft, to, heat_w);
                self.guard.watch(extension.time_s(), to.speed_rad_per_s);
            }
        }
    }

    /// The first edge of the first carrier period, whose duty is zero.
    pub(crate) fn first_edge(&mut self, period_s: f64) {
        self.hold(edge_s(0.0, period_s), LegVolts::both(-self.half_bus_v));
    }

    /// Centres the air gap's series on the rotor; from time to time with its sines taken afresh,
    /// so that their rotation does not drift.
    pub(crate) fn centre_gap(&mut self, afresh: bool) {
        if self.winding.eccentric {
            let motor_rad = self.start_angle_rad + self.train.angle_rad;
            if afresh {
                self.rotor = RotorAngle::new(motor_rad);
            } else {
                self.rotor.turn(motor_rad - self.rotor.motor_rad);
            }
            self.gap = self.winding.air_gap(&self.rotor);
        }
    }

    /// Centres the air gap's series again once the rotor has turned far from it.
    #[inline]
    fn follow_gap(&mut self) {
        let motor_rad = self.start_angle_rad + self.train.angle_rad;
        if (motor_rad - self.rotor.motor_rad).abs() > GAP_REACH_RAD {
            self.centre_gap(false);
        }
    }

    /// Centres both on the rotor at the beginning of a period with all legs connected.
    fn follow_rotor(&mut self) {
        self.follow_gap();
        let motor_rad = self.start_angle_rad + self.train.angle_rad;
        self.electrical = RotorAngle::new(motor_rad * self.winding.pole_pairs());
    }

    fn sample_now(&self) -> Sample {
        let (positive_a, idle_a) = (self.positive_a, self.idle_a);
        let speed_rad_per_s = self.train.speed_rad_per_s;
        let mut sample =
            self.sample_at(&End { positive_a, idle_a, speed_rad_per_s, turn_rad: 0.0 });
        if let Some(extension) = &self.extension {
            let motor_rad = self.start_angle_rad + self.train.angle_rad;
            sample.surface_rad = extension.position_rad(&self.train, motor_rad);
        }
        sample
    }

    /// The sample in a segment without events; a shaft at rest has no speed and no turn in it.
    #[inline]
    fn sample_at(&self, seam: &End) -> Sample {
        let angle_rad = self.train.angle_rad + seam.turn_rad;
        Sample {
            currents_a: self.phases_a(seam.positive_a, seam.idle_a),
            feedback_a: self.feedback_a(seam, self.along(angle_rad)),
            angle_rad,
            speed_rad_per_s: seam.speed_rad_per_s,
            surface_rad: self.train.surface_rad_at(angle_rad),
        }
    }

    pub(crate) fn record(&mut self, command_rad: f64, trace: &mut HighFidelityTrace) {
        let (sample, shown_a) = (&self.sample, self.shown_a());
        trace.command_rad.push(command_rad);
        for (channel, current_a) in trace.phase_currents_a.iter_mut().zip(shown_a) {
            channel.push(current_a);
        }
        let error_a = |phase: usize| shown_a[phase] - sample.currents_a[phase];
        self.probe.tick(&[error_a(0), error_a(1), error_a(2)]);
        trace.motor_angle_rad.push(self.start_angle_rad + sample.angle_rad);
        trace.motor_speed_rad_per_s.push(sample.speed_rad_per_s);
        trace.surface_angle_rad.push(sample.surface_rad);
    }

    /// Feedback of the current loop: the phase in the middle third of its conduction, which
    /// goes on conducting through the commutation nearest to the rotor.
    ///
    /// The measured phase changes at the middle of a sector, where the idle phase has no
    /// back-EMF and hence no current, so that the feedback is continuous.
    #[inline]
    fn feedback_a(&self, at: &End, along: f64) -> f64 {
        if self.begins_with_negative == (along < 0.5) {
            at.positive_a + at.idle_a
        } else {
            at.positive_a
        }
    }

    /// Currents of the phases A, B, C from those of the sector's roles.
    #[inline]
    fn phases_a(&self, positive_a: f64, idle_a: f64) -> PerPhase {
        let mut currents_a = [0.0; 3];
        currents_a[self.at.positive] = positive_a;
        currents_a[self.at.idle] = idle_a;
        currents_a[self.at.negative] = -(positive_a + idle_a);
        currents_a
    }

    /// Place in the sector, 0 to 1.
    #[inline]
    fn along(&self, angle_rad: f64) -> f64 {
        (angle_rad - self.sector_rad.0) * self.winding.sectors_per_rad()
    }

    fn enter(&mut self, sector: Sector) {
        let currents_a = self.phases_a(self.positive_a, self.idle_a);
        self.sector = sector;
        self.at = *self.winding.sector(sector);
        if self.warmth_ratio != 1.0 {
            self.at = self.at.warmed(self.warmth_ratio);
        }
        self.begins_with_negative = sector.place().is_multiple_of(2);
        self.positive_a = currents_a[self.at.positive];
        self.idle_a = currents_a[self.at.idle];
        self.sector_rad = if self.whole_turn {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            sector.span_rad(self.winding.pole_pairs(), self.start_angle_rad + self.lead_rad)
        };
        self.renew();
    }

    /// Takes over what the drive train's state decides.
    fn renew(&mut self) {
        self.shaft = self.train.shaft();
        let bound = self.train.bounds_rad();
        self.window_rad = (self.sector_rad.0.max(bound.0), self.sector_rad.1.min(bound.1));
        if self.corners.is_some() {
            let (window, corner) = (self.window_rad, self.corner_rad);
            self.window_rad = (window.0.max(corner.0), window.1.min(corner.1));
        }
    }

    /// One carrier period from the end of its first edge on: the legs of the positive and the
    /// negative phase with duties `(1 ± u)/2`, both centred, up to the end of the next period's
    /// first edge. What the electronics sample at the seam is left in [`Self::sample`].
    ///
    /// ```text
    ///  −V −V │ active │ +V +V │ active │ −V −V ┊ −V −V │ …
    ///  edge            centre             edge  seam
    /// ```
    pub(crate) fn carrier_period(&mut self, duty: f64, next_duty: f64, period_s: f64) {
        let (v, u) = (self.half_bus_v, duty.abs());
        let high_v = if duty < 0.0 { -v } else { v };
        let active = LegVolts { positive_v: high_v, negative_v: -high_v };
        let active_s = 0.5 * u * period_s;
        self.follow_gap();
        self.hold(active_s, active);
        self.hold(0.5 * (1.0 - u) * period_s, LegVolts::both(v));
        self.hold(active_s, active);
        self.hold_over_seam(edge_s(duty, period_s), edge_s(next_duty, period_s));
    }

    /// Both legs at the lower rail to the seam of two carrier periods and on.
    ///
    /// Mostly one segment covers both; where something happens in it, it is cut at the seam.
    fn hold_over_seam(&mut self, before_s: f64, after_s: f64) {
        let (span_s, legs) = (before_s + after_s, LegVolts::both(-self.half_bus_v));
        // with effects the sample is taken between two segments
        if span_s <= self.longest_s && self.extension.is_none() && !self.own_circuit {
            let (step, end) = self.solve::<false>(span_s, legs);
            if !self.interrupted::<false>(&step, &end, span_s) {
                let seam = End::of(&step.segment, before_s);
                self.sample = self.sample_at(&seam);
                self.observe::<false>(&step, span_s);
                self.commit(&end);
                return;
            }
        }
        self.hold(before_s, legs);
        self.sample = self.sample_now();
        self.hold(after_s, legs);
    }

    /// Holds the legs of the positive and the negative phase at their potentials for a time.
    fn hold(&mut self, span_s: f64, legs: LegVolts) {
        if self.own_circuit {
            self.hold_own(span_s, legs);
        } else {
            self.hold_as::<false>(span_s, legs);
        }
    }

    #[cold]
    fn hold_own(&mut self, span_s: f64, legs: LegVolts) {
        self.hold_as::<true>(span_s, legs);
    }

    /// Holds the legs; `OWN` where effects make the circuit depend on its current or free the
    /// surface.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the path without effects pays nothing for them")]
    fn hold_as<const OWN: bool>(&mut self, span_s: f64, legs: LegVolts) {
        let (mut left_s, mut event_limit) = (span_s, EventLimit::over(span_s, MOST_IN_A_HOLD));
        while left_s > 0.0 {
            let span_s = self.take_effects_in(left_s.min(self.longest_s));
            let from = self.mark();
            let (step, mut end) = self.solve::<OWN>(span_s, legs);
            if self.interrupted::<OWN>(&step, &end, span_s) {
                let (event, at_s) = self.first_event(&step, &end, span_s);
                self.blocked = event == Event::FreewheelEnd && at_s <= 0.0;
                let at_s = event_limit.put_off(at_s, span_s);
                end = End::of(&step.segment, at_s);
                self.observe::<OWN>(&step, at_s);
                self.commit(&end);
                self.advance_effects(at_s, &from);
                self.handle(event, self.torque_n_m::<OWN>(&step, at_s));
                left_s -= at_s;
            } else {
                self.observe::<OWN>(&step, span_s);
                self.commit(&end);
                self.advance_effects(span_s, &from);
                left_s -= span_s;
                self.blocked = false;
            }
        }
    }

    /// The solution from now, and the state that it reaches after a span if nothing happens.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the step is large and would be copied")]
    fn solve<const OWN: bool>(&mut self, span_s: f64, legs: LegVolts) -> (Step, End) {
        if OWN {
            return self.solve_own_circuit(span_s, legs);
        }
        self.solve_with(self.coupling_now(), self.half_bus_v, span_s, legs)
    }

    /// The coupling of the two loops near the rotor's angle.
    #[inline]
    fn coupling_now(&self) -> Coupling {
        let (angle_rad, start_rad) = (self.train.angle_rad, self.start_angle_rad);
        self.coupling(start_rad + angle_rad, self.along(angle_rad))
    }

    /// Motor torque at a time of a segment.
    #[inline]
    fn torque_n_m<const OWN: bool>(&self, step: &Step, at_s: f64) -> f64 {
        let torque_n_m = step.coupling.torque_n_m(&step.segment, at_s);
        if OWN { torque_n_m + self.circulating_n_m(&step.segment, at_s) } else { torque_n_m }
    }

    /// The solution from now with a given coupling and supply.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the step is large and would be copied")]
    fn solve_with(
        &self,
        coupling: Coupling,
        half_bus_v: f64,
        span_s: f64,
        legs: LegVolts,
    ) -> (Step, End) {
        let diode = self.diode(&coupling, half_bus_v, legs);
        let start = self.segment_start();
        let segment = if diode == 0.0 {
            Segment::pair(&self.at, &self.shaft, &coupling, legs.pair_v(), start)
        } else {
            let idle_v = -diode * half_bus_v;
            let loops = LoopVolts { pair_v: legs.pair_v(), idle_v: idle_v - legs.negative_v };
            Segment::three(&self.at, &self.shaft, &coupling, loops, start)
        };
        let end = End::of(&segment, span_s);
        (Step { segment, coupling, diode, pair: legs, idle_v: -diode * half_bus_v }, end)
    }

    #[inline]
    fn observe<const OWN: bool>(&mut self, step: &Step, span_s: f64) {
        let Step { pair, idle_v, .. } = *step;
        let (at, warmth_ratio) = (&self.at, self.warmth_ratio);
        let shorted = if OWN { self.shorted.as_deref() } else { None };
        let circuit = Circuit { legs: pair, idle_v, connected: false, at, warmth_ratio, shorted };
        self.probe.segment(&step.segment, span_s, &circuit, &self.train);
        self.segments += 1;
        if OWN {
            self.move_surface(step, span_s);
            self.move_loops(span_s);
        }
    }

    #[inline]
    fn observe_connected<const OWN: bool>(&mut self, step: &Step, span_s: f64) {
        let Step { pair, idle_v, .. } = *step;
        let (at, warmth_ratio) = (&self.at, self.warmth_ratio);
        let shorted = if OWN { self.shorted.as_deref() } else { None };
        let circuit = Circuit { legs: pair, idle_v, connected: true, at, warmth_ratio, shorted };
        self.probe.segment(&step.segment, span_s, &circuit, &self.train);
        self.segments += 1;
        if OWN {
            self.move_surface(step, span_s);
            self.move_loops(span_s);
        }
    }

    /// The solution from now with all three legs connected.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the step is large and would be copied")]
    fn solve_connected<const OWN: bool>(&mut self, span_s: f64) -> Step {
        if OWN {
            return self.solve_own_connected(span_s);
        }
        let (coupling, cubic) = self.connected_coupling();
        self.solve_connected_with(coupling, cubic, self.legs_v)
    }

    /// The coupling while all legs are connected.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the coupling is large and would be copied")]
    fn connected_coupling(&self) -> (Coupling, Option<CubicTerms>) {
        let (angle_rad, start_rad) = (self.train.angle_rad, self.start_angle_rad);
        let motor_rad = start_rad + angle_rad;
        if self.whole_turn {
            let rotor = self.rotor_frame();
            let (coupling, cubic) = self.winding.smooth_coupling(&self.at, rotor, motor_rad);
            (coupling, Some(cubic))
        } else {
            (self.coupling(motor_rad, self.along(angle_rad)), None)
        }
    }

    /// The solution from now with all three legs connected at given potentials.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the step is large and would be copied")]
    fn solve_connected_with(
        &self,
        coupling: Coupling,
        cubic: Option<CubicTerms>,
        legs_v: PerPhase,
    ) -> Step {
        let SectorWinding { positive, negative, idle, .. } = self.at;
        let low_v = legs_v[negative];
        let loops = LoopVolts { pair_v: legs_v[positive] - low_v, idle_v: legs_v[idle] - low_v };
        let start = self.segment_start();
        let mut segment = Segment::three(&self.at, &self.shaft, &coupling, loops, start);
        if let Some(cubic) = cubic {
            segment.bend(&self.at, &self.shaft, &coupling, cubic);
        }
        let pair = LegVolts { positive_v: legs_v[positive], negative_v: low_v };
        Step { segment, coupling, diode: 0.0, pair, idle_v: legs_v[idle] }
    }

    #[inline]
    fn rotor_frame(&self) -> RotorFrame<'_> {
        RotorFrame { gap: &self.gap, electrical: &self.electrical }
    }

    /// Currents and speed from which the next segment starts.
    #[inline]
    fn segment_start(&self) -> SegmentStart {
        SegmentStart {
            positive_a: self.positive_a,
            idle_a: self.idle_a,
            speed_rad_per_s: self.train.speed_rad_per_s,
        }
    }

    #[inline]
    fn coupling(&self, motor_rad: f64, along: f64) -> Coupling {
        self.winding.coupling(&self.at, self.rotor_frame(), motor_rad, along)
    }

    /// Back-EMF of the pair.
    fn pair_emf_v(&self) -> f64 {
        if let Some(open_v) = self.shorted_pair_v() {
            return open_v;
        }
        let motor_rad = self.start_angle_rad + self.train.angle_rad;
        let along = self.along(self.train.angle_rad);
        let coupling = self.coupling(motor_rad, along);
        coupling.pair_emf_v(self.train.speed_rad_per_s)
    }

    /// Sign of the idle phase's current through its diodes, 0 when none conducts.
    ///
    /// A current that flows goes on; without one, a diode begins to conduct where the open
    /// terminal would leave the rails.
    #[inline]
    fn diode(&self, coupling: &Coupling, half_bus_v: f64, legs: LegVolts) -> f64 {
        if self.idle_a != 0.0 {
            return self.idle_a.signum();
        }
        let speed = self.train.speed_rad_per_s;
        let open_v = coupling.open_terminal_v(&self.at, legs, self.positive_a, speed);
        self.diode_at(open_v, half_bus_v)
    }

    /// Sign of that current, given the potential of the open terminal.
    #[inline]
    fn diode_at(&self, open_v: f64, half_bus_v: f64) -> f64 {
        if self.idle_a != 0.0 {
            return self.idle_a.signum();
        }
        let beyond = if open_v > half_bus_v {
            -1.0
        } else if open_v < -half_bus_v {
            1.0
        } else {
            return 0.0;
        };
        if self.blocked { 0.0 } else { beyond }
    }

    /// Moves the state to the end of a segment.
    #[inline]
    fn commit(&mut self, end: &End) {
        self.positive_a = end.positive_a;
        self.idle_a = end.idle_a;
        if self.train.direction != Direction::Stuck {
            self.train.speed_rad_per_s = end.speed_rad_per_s;
            self.train.angle_rad += end.turn_rad;
        }
    }
}

/// Longest segment that four orders of the series solve to 1e-6 of its change: a share of the
/// shortest time in the machine (winding, winding against inertia, turn of a sector).
///
/// The winding's rates are bounded by the largest `R_j/L_j`, which grows as `1/N_j`.
fn longest_segment_s(actuator: &Actuator, faults: &PhysicalFaults) -> f64 {
    let motor = &actuator.motor;
    let most_turns = faults.healthy_turns_frac.iter().copied().fold(0.0, f64::max);
    let least_turns = faults.healthy_turns_frac.iter().copied().fold(1.0, f64::min);
    let winding_s = motor.inductance_henry / motor.resistance_ohm * least_turns;
    let strongest = motor.torque_constant_n_m_per_a() * most_turns * 2.0;
    let inductance_henry = 2.0 * motor.inductance_henry * least_turns * least_turns;
    let swing_s = libm::sqrt(inductance_henry * actuator.total_inertia_kg_m2()) / strongest;
    let weakest = motor.torque_constant_n_m_per_a() * least_turns;
    let electrical_rad_per_s =
        f64::from(motor.pole_pairs) * actuator.inverter.bus_voltage_v / weakest;
    (0.15 * winding_s).min(0.3 * swing_s).min(0.2 / electrical_rad_per_s)
}
