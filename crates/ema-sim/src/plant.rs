//! The machine at a given set-point, from event to event: the low-fidelity actuator and the
//! servo axis.

mod groups;
mod lanes;
mod own_lanes;
mod quadrature_loop;
mod regulated;

use std::sync::Arc;

pub(crate) use groups::{Group, LaneLaw, Member};
pub(crate) use lanes::{Lanes, NARROW, WIDTH};
pub(crate) use own_lanes::{GATHERED, Kept, LaneControl, Seen};

use self::{quadrature_loop::QuadratureLoop, regulated::RegulatedSegment};

use crate::{
    drive_train::{Crossing, Direction, DriveTrain, START_RAD},
    effect::{
        Effect,
        part::{MachineNumbers, SHORTEST_RATIO, winding::Circuit},
    },
    event_limit::EventLimit,
    extension::{Extension, Instant, MotorState},
    fault::PhysicalFaults,
    load::{Load, LoadRun},
    params::Actuator,
    phase::{PerPhase, Sector},
    scenario::Scenario,
    series::{RECIPROCALS, Series, root, value, value_from_zero},
    shape_function::ShapeFunction,
    speed_guard::SpeedGuard,
    waveform::Waveform,
    winding::{LocalQuadratic, RotorAngle, Shaft, Winding, first, second},
};

/// Ticks after which the rotor's sines are taken afresh; rotating them drifts by 1e-16 a tick.
const REFRESH_TICKS: usize = 64;

/// Share of a tick that is no segment with effects.
const LEAST_LEFT: f64 = 1e-9;
/// Events in a tick beyond which they are put off; in ordinary motion there are a handful.
const MOST_IN_A_TICK: u32 = 1 << 12;

/// State of a run.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    winding: Winding,
    /// `2·k_p·F_sc` and `2·R_p·F_sc` for the six sectors.
    sectors: [(f64, f64); 6],
    /// Shape function in place of the six sectors, in a field-oriented drive.
    shape: Option<ShapeFunction>,
    /// Current loop of a field-oriented drive, and by how much its integral is behind.
    quadrature_loop: Option<QuadratureLoop>,
    behind_v: f64,
    /// Share of healthy turns, for the shape of the back-EMF.
    turns_frac: PerPhase,
    /// Largest voltage of the equivalent machine.
    limit_v: f64,
    /// True where the set-point is a voltage on the winding.
    voltage_driven: bool,
    pub(crate) start_angle_rad: f64,
    /// Position of the surface at the start, from which the drive train counts.
    start_position_rad: f64,
    pub(crate) train: DriveTrain,
    /// Effects, and a load that changes, where there are any.
    extension: Option<Box<Extension>>,
    load: Option<Box<LoadRun>>,
    /// Parts that a tick is cut into, one but in a check.
    cuts: u32,
    /// The shaft's equation in the present state of the drive train.
    shaft: Shaft,
    rotor: RotorAngle,
    sector: Sector,
    /// Motor angles from the start between which the sector lasts.
    sector_rad: (f64, f64),
    /// Motor angles from the start between which neither sector nor contact changes.
    window_rad: (f64, f64),
    pub(crate) current_a: f64,
    pub(crate) segments: u64,
    /// Guard against a shaft that is driven away.
    pub(crate) guard: SpeedGuard,
}

/// Cause of a segment's end.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Event {
    Tick,
    Standstill,
    Sector(i64),
    Bound,
}

impl From<Crossing> for Event {
    fn from(crossing: Crossing) -> Self {
        match crossing {
            Crossing::Sector(step) => Self::Sector(step),
            Crossing::Bound => Self::Bound,
        }
    }
}

/// Additions to a run besides machine, test and faults.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Additions<'a> {
    pub(crate) effects: &'a [Effect],
    pub(crate) load: &'a Arc<Load>,
    /// Share of the longest segment: of a tick, or of what effects allow.
    pub(crate) finer: f64,
}

impl Run {
    /// The actuator of the low-fidelity model.
    pub(crate) fn new(
        actuator: &Actuator,
        scenario: &Scenario,
        faults: &PhysicalFaults,
        additions: &Additions<'_>,
    ) -> Self {
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
        let mut run = Self::of(
            Winding::new(&actuator.motor, faults),
            DriveTrain::new(actuator, faults, scenario),
            shape_of_sectors(actuator, faults),
            actuator.equivalent_supply_v(),
            scenario.start_angle_rad,
        );
        run.shape = ShapeFunction::new(actuator, faults);
        run.turns_frac = faults.healthy_turns_frac;
        run.guard = SpeedGuard::of_actuator(actuator, scenario, faults, additions.load);
        run.add(&machine, additions, scenario.load_n_m);
        let lead_rad = run.lead_rad();
        let electrical = (run.start_angle_rad + lead_rad) * run.winding.pole_pairs();
        run.enter(Sector::of_electrical_angle(electrical));
        run.start_loop(actuator, scenario);
        run
    }

    /// A machine without commutation, whose set-point makes a torque, or through the resistance
    /// of its winding a current.
    pub(crate) fn of_axis(
        train: DriveTrain,
        constant: f64,
        resistance_ohm: Option<f64>,
        limit: f64,
        start_position: f64,
    ) -> Self {
        let sectors = [(constant, resistance_ohm.unwrap_or(0.0)); 6];
        // without a gear the motor is where the load is
        let mut run = Self::of(Winding::plain(), train, sectors, f64::INFINITY, start_position);
        run.start_position_rad = start_position;
        run.sector_rad = (f64::NEG_INFINITY, f64::INFINITY);
        if resistance_ohm.is_some() {
            (run.voltage_driven, run.limit_v) = (true, limit);
        }
        run.renew();
        run
    }

    fn of(
        winding: Winding,
        train: DriveTrain,
        sectors: [(f64, f64); 6],
        limit_v: f64,
        start_angle_rad: f64,
    ) -> Self {
        Self {
            winding,
            sectors,
            shape: None,
            quadrature_loop: None,
            behind_v: 0.0,
            turns_frac: [1.0; 3],
            limit_v,
            voltage_driven: false,
            start_angle_rad,
            start_position_rad: START_RAD,
            shaft: train.shaft(),
            train,
            extension: None,
            load: None,
            cuts: 1,
            rotor: RotorAngle::new(start_angle_rad),
            sector: Sector::from_place(0),
            sector_rad: (0.0, 0.0),
            window_rad: (0.0, 0.0),
            current_a: 0.0,
            segments: 0,
            guard: SpeedGuard::OFF,
        }
    }

    /// Takes effects and a load on.
    pub(crate) fn add(
        &mut self,
        machine: &MachineNumbers,
        additions: &Additions<'_>,
        constant_load_n_m: f64,
    ) {
        let train = &mut self.train;
        self.extension = Extension::of(additions.effects, machine, train, additions.finer);
        // effects have segments of their own, which are cut
        self.cuts =
            if self.extension.is_some() { 1 } else { libm::ceil(1.0 / additions.finer) as u32 };
        let load = LoadRun::new(additions.load, constant_load_n_m);
        self.load = load.varies().then(|| Box::new(load));
        self.renew();
    }

    /// Begins a tick, before the controller acts: fresh sines, the load.
    #[inline]
    pub(crate) fn begin_tick(&mut self, tick: usize, tick_s: f64) {
        if tick.is_multiple_of(REFRESH_TICKS) {
            self.refresh();
            self.guard.watch(tick as f64 * tick_s, self.train.speed_rad_per_s);
        }
        if self.load.is_some() {
            self.take_load(tick_s);
        }
    }

    #[inline(never)]
    fn take_load(&mut self, tick_s: f64) {
        if let Some(mut load) = self.load.take() {
            let surface_rad = if load.feels_surface() { self.surface_rad() } else { 0.0 };
            if let Some(now_n_m) = load.changed_n_m(surface_rad) {
                match &mut self.extension {
                    Some(extension) if extension.is_compliant() => extension.set_load(now_n_m),
                    _ => self.train.set_load(now_n_m),
                }
                self.shaft.external_n_m = self.train.external_n_m();
            }
            load.advance(surface_rad, tick_s);
            self.load = Some(load);
        }
    }

    /// Position of the surface as it is.
    fn surface_rad(&self) -> f64 {
        match &self.extension {
            None => self.start_position_rad + self.train.surface_rad(),
            Some(extension) => extension.position_rad(&self.train, self.motor_rad()),
        }
    }

    /// Position of the surface as its sensor shows it; once a tick.
    #[inline]
    pub(crate) fn shown_surface_rad(&mut self) -> f64 {
        match &mut self.extension {
            None => self.start_position_rad + self.train.surface_rad(),
            Some(extension) => {
                let motor_rad = self.start_angle_rad + self.train.angle_rad;
                extension.shown_position_rad(&self.train, motor_rad)
            }
        }
    }

    /// Lag of the load behind the motor: backlash and twist.
    pub(crate) fn before_play_rad(&self) -> f64 {
        let load_rad = match &self.extension {
            None => self.train.surface_rad(),
            Some(extension) => extension.moved_rad(&self.train),
        };
        self.train.angle_rad - load_rad
    }

    /// Current as its sensor shows it; once a tick.
    #[inline]
    pub(crate) fn shown_current_a(&mut self) -> f64 {
        match &mut self.extension {
            None => self.current_a,
            Some(extension) => extension.shown_current_a(self.current_a),
        }
    }

    /// Torque of the motor now.
    pub(crate) fn motor_n_m(&self) -> f64 {
        self.sectors[self.sector.place()].0 * self.current_a
    }

    fn motor_rad(&self) -> f64 {
        self.start_angle_rad + self.train.angle_rad
    }

    fn lead_rad(&self) -> f64 {
        let pole_pairs = self.winding.pole_pairs();
        self.extension.as_ref().map_or(0.0, |e| e.commutation_lead_rad(pole_pairs))
    }

    /// Takes the sines afresh, so that their rotation does not drift.
    fn refresh(&mut self) {
        if self.winding.eccentric {
            self.rotor = RotorAngle::new(self.start_angle_rad + self.train.angle_rad);
        }
    }

    fn enter(&mut self, sector: Sector) {
        self.sector = sector;
        let start_rad = match &self.extension {
            None => self.start_angle_rad,
            Some(_) => self.start_angle_rad + self.lead_rad(),
        };
        self.sector_rad = if self.shape.is_some() {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            sector.span_rad(self.winding.pole_pairs(), start_rad)
        };
        self.renew();
    }

    /// Torque over current near the rotor's angle, and the resistance there.
    fn equivalent(&self) -> (LocalQuadratic, f64) {
        match &self.shape {
            Some(shape) => {
                let near = self.near(shape);
                (near.coupling, shape.resistance_ohm(&near))
            }
            None => self.equivalent_of_sector(),
        }
    }

    /// Torque over current and resistance where the six sectors hold.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    fn equivalent_of_sector(&self) -> (LocalQuadratic, f64) {
        let gap = self.winding.gap(&self.rotor);
        let (torque_constant, resistance_ohm) = self.sectors[self.sector.place()];
        (gap.map(|g| torque_constant * g), resistance_ohm)
    }

    /// Time in which [`equivalent`](Self::equivalent) stays good.
    #[inline]
    fn longest_s(&self, speed_rad_per_s: f64) -> f64 {
        self.shape.as_ref().map_or(f64::INFINITY, |shape| shape.longest_s(speed_rad_per_s))
    }

    /// Takes over what the drive train's state decides.
    fn renew(&mut self) {
        self.shaft = self.train.shaft();
        let bound = self.train.bounds_rad();
        self.window_rad = (self.sector_rad.0.max(bound.0), self.sector_rad.1.min(bound.1));
    }

    /// Holds the set-point for a tick.
    #[inline]
    pub(crate) fn advance(&mut self, reference: f64, span_s: f64) {
        if self.cuts > 1 {
            self.advance_finely(reference, span_s);
        } else {
            self.advance_whole(reference, span_s);
        }
    }

    #[cold]
    fn advance_finely(&mut self, reference: f64, span_s: f64) {
        for _ in 0..self.cuts {
            self.advance_whole(reference, span_s / f64::from(self.cuts));
        }
    }

    #[inline]
    fn advance_whole(&mut self, reference: f64, span_s: f64) {
        if self.extension.is_some() || self.voltage_driven {
            self.advance_with_effects(reference, span_s);
        } else if self.shape.is_some() {
            self.advance_regulated(reference, span_s);
        } else {
            self.advance_plain(reference, span_s);
        }
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    fn advance_plain(&mut self, reference_a: f64, span_s: f64) {
        let (mut left_s, mut event_limit) = (span_s, EventLimit::over(span_s, MOST_IN_A_TICK));
        while left_s > 0.0 {
            let (coupling, resistance_ohm) = self.equivalent_of_sector();
            let emf_v = coupling[0] * self.train.speed_rad_per_s;
            let needed_v = resistance_ohm * reference_a + emf_v;
            let saturated = needed_v.abs() > self.limit_v;
            let applied_v = self.limit_v.copysign(needed_v);
            self.current_a =
                if saturated { (applied_v - emf_v) / resistance_ohm } else { reference_a };
            if self.train.direction == Direction::Stuck {
                self.train.stand_still(coupling[0] * self.current_a);
                if self.train.direction == Direction::Stuck {
                    return;
                }
                self.renew();
            }
            let speed = self.train.speed_rad_per_s;
            let motion = if saturated {
                Motion::at_voltage(&self.shaft, &coupling, resistance_ohm, applied_v, speed)
            } else {
                Motion::at_current(&self.shaft, &coupling, reference_a, speed)
            };
            left_s -= self.follow(&motion, left_s, &coupling, &mut event_limit);
        }
    }

    /// A tick with effects, or driven by voltage.
    #[inline(never)]
    fn advance_with_effects(&mut self, reference: f64, span_s: f64) {
        let Some(mut extension) = self.extension.take() else {
            return self.advance_by_voltage(reference, span_s);
        };
        for held in extension.delayed(reference) {
            self.hold_with(&mut extension, held.value, held.share * span_s, span_s);
        }
        self.extension = Some(extension);
    }

    /// Holds a set-point with effects for what is left of a tick.
    fn hold_with(&mut self, extension: &mut Extension, value: f64, mut left_s: f64, span_s: f64) {
        let least_s = LEAST_LEFT * span_s;
        let mut event_limit = EventLimit::over(span_s, MOST_IN_A_TICK);
        while left_s > least_s && !self.guard.has_passed() {
            left_s -= self.extended_segment(extension, value, left_s, &mut event_limit);
        }
    }

    #[inline(never)]
    fn advance_by_voltage(&mut self, reference_v: f64, span_s: f64) {
        let (mut left_s, mut event_limit) = (span_s, EventLimit::over(span_s, MOST_IN_A_TICK));
        while left_s > 0.0 {
            let (constant, resistance_ohm) = self.sectors[0];
            let coupling = [constant, 0.0, 0.0];
            let applied_v = reference_v.clamp(-self.limit_v, self.limit_v);
            let emf_v = constant * self.train.speed_rad_per_s;
            self.current_a = (applied_v - emf_v) / resistance_ohm;
            if self.train.direction == Direction::Stuck {
                self.train.stand_still(constant * self.current_a);
                if self.train.direction == Direction::Stuck {
                    return;
                }
                self.renew();
            }
            let speed = self.train.speed_rad_per_s;
            let motion =
                Motion::at_voltage(&self.shaft, &coupling, resistance_ohm, applied_v, speed);
            left_s -= self.follow(&motion, left_s, &coupling, &mut event_limit);
        }
    }

    /// One segment with effects; returns its length.
    #[inline(never)]
    fn extended_segment(
        &mut self,
        extension: &mut Extension,
        reference: f64,
        left_s: f64,
        event_limit: &mut EventLimit,
    ) -> f64 {
        let speed = self.train.speed_rad_per_s;
        let shaped_s = self.longest_s(speed).max(extension.shortest_s());
        let span_s = left_s.min(extension.longest_s(speed)).min(shaped_s);
        let (plain, resistance_ohm) = self.equivalent();
        let wanted_a =
            if self.voltage_driven { self.current_a } else { extension.regulated_a(reference) };
        let asked = Asked { reference, wanted_a };
        let coupled = |current_a: f64| {
            let coupling =
                extension.coupling(plain, current_a, |wave| self.wave_ratio(wave, span_s));
            let drive = self.driven(extension, asked, span_s, &coupling, resistance_ohm);
            (coupling, drive)
        };
        let (mut coupling, mut drive) = coupled(wanted_a);
        if drive.applied_v.is_some() && !self.voltage_driven {
            (coupling, drive) = coupled(self.current_a);
        }
        if let Some(law) = self.quadrature_loop {
            if drive.applied_v.is_none() {
                let span_s = span_s.min(law.longest_s);
                let segment = RegulatedSegment { wanted_a, span_s, coupling, resistance_ohm };
                return self.regulated_with_effects(extension, &law, &segment, event_limit);
            }
            self.behind_v = 0.0;
        }
        let before_a = self.current_a;
        self.current_a = drive.current_a;
        let rising = extension.winding().inductance_henry > 0.0 && drive.applied_v.is_some();
        let torque_a = if rising { 0.5 * (before_a + drive.current_a) } else { drive.current_a };
        let motor_n_m = coupling[0] * torque_a;
        self.take_effects(extension, motor_n_m, span_s);
        let heat_w = resistance_ohm * torque_a * torque_a;
        let from = MotorState { angle_rad: self.train.angle_rad, speed_rad_per_s: speed };
        if self.train.direction == Direction::Stuck {
            self.train.stand_still(motor_n_m);
            if self.train.direction == Direction::Stuck {
                extension.advance(span_s, from, from, heat_w);
                return span_s;
            }
            self.renew();
            self.take_effects(extension, motor_n_m, span_s);
        }
        let motion = match drive.applied_v {
            Some(applied_v) if !rising => {
                Motion::at_voltage(&self.shaft, &coupling, drive.resistance_ohm, applied_v, speed)
            }
            _ => Motion::at_current(&self.shaft, &coupling, torque_a, speed),
        };
        let (event, taken_s) = self.glide(&motion, span_s, event_limit);
        self.end_segment(extension, SegmentEnd { event, taken_s, from, heat_w, motor_n_m });
        taken_s
    }

    /// Takes the effects to the end of a segment, and handles its event.
    fn end_segment(&mut self, extension: &mut Extension, end: SegmentEnd) {
        let SegmentEnd { event, taken_s, from, heat_w, motor_n_m } = end;
        let to = MotorState::of(&self.train);
        extension.advance(taken_s, from, to, heat_w);
        self.guard.watch(extension.time_s(), to.speed_rad_per_s);
        if event != Event::Tick {
            if matches!(event, Event::Sector(_)) {
                extension.commutated();
            } else {
                // at rest friction and torques are others than on the way there
                let speed_rad_per_s =
                    if event == Event::Standstill { 0.0 } else { to.speed_rad_per_s };
                let instant = Instant { speed_rad_per_s, ..self.instant(motor_n_m) };
                extension.act(&mut self.train, &instant, 0.0, 0.0);
            }
            self.handle_with(event, motor_n_m, extension);
        }
    }

    /// Current and, where the supply is all used, voltage of the next segment, with the set-point
    /// and the current that is wanted.
    #[inline]
    fn driven(
        &self,
        extension: &Extension,
        asked: Asked,
        span_s: f64,
        coupling: &LocalQuadratic,
        resistance_ohm: f64,
    ) -> Driven {
        let Asked { reference, wanted_a } = asked;
        let emf_v = coupling[0] * self.train.speed_rad_per_s;
        let bus_v = self.limit_v;
        let c = extension
            .winding()
            .circuit(resistance_ohm, wanted_a, span_s)
            .unwrap_or(Circuit { resistance_ohm, ..Circuit::default() });
        let limit_v = (bus_v - c.source_ohm * wanted_a.abs()).max(0.0);
        let (applied_v, ohm) = if self.voltage_driven {
            (reference.clamp(-limit_v, limit_v), c.resistance_ohm)
        } else {
            let rise_v = c.inductive_ohm * (wanted_a - self.current_a);
            let needed_v = c.resistance_ohm * wanted_a + rise_v + emf_v + c.dead_v;
            if needed_v.abs() <= limit_v {
                let resistance_ohm = c.resistance_ohm;
                return Driven { current_a: wanted_a, applied_v: None, resistance_ohm };
            }
            // all of the supply, less what its own resistance takes
            (bus_v.copysign(needed_v), c.resistance_ohm + c.source_ohm)
        };
        let net_v = applied_v - c.dead_v;
        let carried_v = c.inductive_ohm * self.current_a;
        Driven {
            current_a: (net_v - emf_v + carried_v) / (ohm + c.inductive_ohm),
            applied_v: Some(net_v),
            resistance_ohm: ohm,
        }
    }

    fn instant(&self, motor_n_m: f64) -> Instant {
        Instant {
            motor_rad: self.motor_rad(),
            speed_rad_per_s: self.train.speed_rad_per_s,
            motor_n_m,
        }
    }

    /// Puts the effects' torques of the next span on the shaft.
    fn take_effects(&mut self, extension: &mut Extension, motor_n_m: f64, span_s: f64) {
        let instant = self.instant(motor_n_m);
        let shaft = &self.shaft;
        let drag_n_m = shaft.viscous_n_m_s_per_rad * instant.speed_rad_per_s;
        let rate = (motor_n_m + shaft.external_n_m - drag_n_m) * shaft.per_inertia[0];
        extension.act(&mut self.train, &instant, rate, span_s);
        self.shaft.external_n_m = self.train.external_n_m();
    }

    /// The back-EMF of the conducting pair over that of flat tops, and its mean slope over the
    /// motor's angle in the next span, which ends with the sector.
    fn wave_ratio(&self, wave: &Waveform, span_s: f64) -> [f64; 2] {
        use core::f64::consts::TAU;
        let (p, n) = (self.sector.positive_phase(), self.sector.negative_phase());
        let (np, nn) = (self.turns_frac[p], self.turns_frac[n]);
        let ratio = |angle_rad: f64| {
            let electrical = (self.start_angle_rad + angle_rad) * self.winding.pole_pairs();
            let of = |phase: usize| wave.at(electrical - TAU / 3.0 * phase as f64);
            (np * of(p) - nn * of(n)) / (np + nn)
        };
        let from_rad = self.train.angle_rad;
        let to_rad = from_rad + self.train.speed_rad_per_s * span_s;
        let turn_rad = to_rad.clamp(self.sector_rad.0, self.sector_rad.1) - from_rad;
        let now = ratio(from_rad);
        let slope =
            if turn_rad.abs() > 1e-9 { (ratio(from_rad + turn_rad) - now) / turn_rad } else { 0.0 };
        [now, slope]
    }

    /// Follows a motion to its first event or the end of a span; returns the time taken.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    fn follow(
        &mut self,
        motion: &Motion,
        span_s: f64,
        coupling: &LocalQuadratic,
        event_limit: &mut EventLimit,
    ) -> f64 {
        let (event, at_s) = self.glide(motion, span_s, event_limit);
        if event != Event::Tick {
            self.handle(event, coupling[0] * self.current_a);
        }
        at_s
    }

    /// Moves along a motion to its first event or the end of a span.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    fn glide(
        &mut self,
        motion: &Motion,
        span_s: f64,
        event_limit: &mut EventLimit,
    ) -> (Event, f64) {
        let (mut speed, mut turn_rad) =
            (value(&motion.speed, span_s), value_from_zero(&motion.turn, span_s));
        let (mut event, mut at_s) = (Event::Tick, span_s);
        let to_rad = self.train.angle_rad + turn_rad;
        if speed * self.train.direction.sign() <= 0.0
            || to_rad > self.window_rad.1
            || to_rad < self.window_rad.0
        {
            (event, at_s) = self.first_event(motion, span_s, speed, to_rad);
            at_s = event_limit.put_off(at_s, span_s);
            (speed, turn_rad) = (value(&motion.speed, at_s), value(&motion.turn, at_s));
        }
        self.train.speed_rad_per_s = speed;
        self.train.angle_rad += turn_rad;
        if self.winding.eccentric {
            self.rotor.turn(turn_rad);
        }
        self.segments += 1;
        (event, at_s)
    }

    fn first_event(&self, motion: &Motion, span_s: f64, speed: f64, to_rad: f64) -> (Event, f64) {
        let mut first = (Event::Tick, span_s);
        let mut offer = |event, at_s: f64| {
            if at_s < first.1 {
                first = (event, at_s);
            }
        };
        if speed * self.train.direction.sign() <= 0.0 {
            offer(Event::Standstill, root(&motion.speed, span_s));
        }
        let sector_rad = self.sector_rad.into();
        for (crossing, at_s) in self.train.crossings(&motion.turn, to_rad, sector_rad, span_s) {
            offer(crossing.into(), at_s);
        }
        first
    }

    /// Handles an event while the effects are taken out; the lead of the commutation is theirs.
    fn handle_with(&mut self, event: Event, torque_n_m: f64, extension: &Extension) {
        self.handle(event, torque_n_m);
        if matches!(event, Event::Sector(_)) {
            let pole_pairs = self.winding.pole_pairs();
            let lead_rad = extension.commutation_lead_rad(pole_pairs);
            let start_rad = self.start_angle_rad + lead_rad;
            self.sector_rad = self.sector.span_rad(pole_pairs, start_rad);
            self.renew();
        }
    }

    fn handle(&mut self, event: Event, torque_n_m: f64) {
        match event {
            Event::Tick => {}
            Event::Standstill => self.train.stand_still(torque_n_m),
            Event::Sector(step) => {
                self.train.angle_rad = if step > 0 { self.sector_rad.1 } else { self.sector_rad.0 };
                self.enter(self.sector.shifted(step));
            }
            Event::Bound => {
                let (low, high) = self.train.bounds_rad();
                let forward = self.train.direction == Direction::Forward;
                self.train.angle_rad = if forward { high } else { low };
                self.train.reach_bound(torque_n_m);
            }
        }
        self.renew();
    }
}

/// `2·k_p·F_sc` and `2·R_p·F_sc` for the six sectors.
fn shape_of_sectors(actuator: &Actuator, faults: &PhysicalFaults) -> [(f64, f64); 6] {
    let (motor, turns) = (&actuator.motor, faults.healthy_turns_frac);
    core::array::from_fn(|place| {
        let sector = Sector::from_place(place);
        let share = 0.5 * (turns[sector.positive_phase()] + turns[sector.negative_phase()]);
        (motor.torque_constant_n_m_per_a() * share, 2.0 * motor.resistance_ohm * share)
    })
}

/// Set-point of a segment, and the current that is wanted for it.
#[derive(Clone, Copy)]
struct Asked {
    reference: f64,
    wanted_a: f64,
}

/// End of a segment with effects.
#[derive(Clone, Copy)]
struct SegmentEnd {
    event: Event,
    taken_s: f64,
    /// The motor at the segment's start.
    from: MotorState,
    heat_w: f64,
    motor_n_m: f64,
}

/// How the drive acts in a segment.
struct Driven {
    current_a: f64,
    /// Voltage at resistance and back-EMF, where the supply is all used.
    applied_v: Option<f64>,
    resistance_ohm: f64,
}

/// The shaft from now to the next event.
struct Motion {
    speed: Series,
    turn: Series,
}

impl Motion {
    /// With the set-point reached.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    fn at_current(shaft: &Shaft, v: &LocalQuadratic, current_a: f64, w0: f64) -> Self {
        let (j, c) = (&shaft.per_inertia, shaft.viscous_n_m_s_per_rad);
        let w1 = (v[0] * current_a + shaft.external_n_m - c * w0) * j[0];
        let d2 = 0.5 * w1;
        let w2 = (first(v, w0) * current_a - c * w1) * j[1];
        let w3 = (second(v, w0, d2) * current_a - c * w2) * j[2];
        Self {
            speed: [w0, w1, w2, w3, -c * w3 * j[3]],
            turn: [0.0, w0, d2, w2 * (1.0 / 3.0), 0.25 * w3],
        }
    }

    /// With the supply all used: `I = (V − v·ω)/R`.
    fn at_voltage(
        shaft: &Shaft,
        v: &LocalQuadratic,
        resistance_ohm: f64,
        applied_v: f64,
        w0: f64,
    ) -> Self {
        let mut speed = [w0, 0.0, 0.0, 0.0, 0.0];
        let mut turn = [0.0, w0, 0.0, 0.0, 0.0];
        let (mut k, mut current) = ([0.0; 4], [0.0; 4]);
        let (mut source, mut external) = (applied_v, shaft.external_n_m);
        for m in 0..4 {
            k[m] = match m {
                0 => v[0],
                1 => first(v, turn[1]),
                2 => second(v, turn[1], turn[2]),
                _ => 0.0,
            };
            let emf: f64 = (0..=m).map(|n| k[n] * speed[m - n]).sum();
            current[m] = (source - emf) / resistance_ohm;
            let torque: f64 = (0..=m).map(|n| k[n] * current[m - n]).sum();
            speed[m + 1] =
                (torque + external - shaft.viscous_n_m_s_per_rad * speed[m]) * shaft.per_inertia[m];
            if m < 3 {
                turn[m + 2] = speed[m + 1] * RECIPROCALS[m + 1];
            }
            (source, external) = (0.0, 0.0);
        }
        Self { speed, turn }
    }
}
