//! Effects at work: what they add to a run, with the states that they have.
//!
//! Torques that change with the state are held over a segment at their value in its predicted
//! middle, which is of second order in its length; segments are cut where an effect is quicker
//! than the controller's tick.

use crate::{
    bounds::larger,
    drive_train::{Direction, DriveTrain, FrictionState},
    effect::{
        Effect,
        law::EffectLaw,
        part::{
            MachineNumbers, Parts, SHORTEST_RATIO,
            bristles::Bristles,
            delay::HeldReference,
            elastic_shaft::{ElasticShaft, ShaftState},
            sensor::{CurrentSensor, PositionWave},
            winding::WindingEffects,
        },
        rescaling::Rescaling,
        shaft_load::{Moment, ShaftLoad},
    },
    waveform::Waveform,
    winding::LocalQuadratic,
};

/// Least share of its torque constant that saturation leaves a motor.
const LEAST_SATURATED_RATIO: f64 = 0.1;
/// Speed below which the turn of a segment does not bound its length, rad/s.
pub(crate) const SLOWEST: f64 = 1e-9;

/// The state that an effect depends on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Instant {
    pub(crate) motor_rad: f64,
    pub(crate) speed_rad_per_s: f64,
    pub(crate) motor_n_m: f64,
}

/// Angle and speed of the motor's shaft, from the start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotorState {
    pub(crate) angle_rad: f64,
    pub(crate) speed_rad_per_s: f64,
}

impl MotorState {
    /// The shaft of a drive train.
    pub(crate) fn of(train: &DriveTrain) -> Self {
        Self { angle_rad: train.angle_rad, speed_rad_per_s: train.speed_rad_per_s }
    }

    /// The shaft seen from the surface, through a gear.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    pub(crate) fn at_surface(self, per_gear_ratio: f64) -> ShaftState {
        ShaftState {
            angle_rad: self.angle_rad * per_gear_ratio,
            speed_rad_per_s: self.speed_rad_per_s * per_gear_ratio,
        }
    }
}

/// Effects of a run.
#[derive(Clone, Debug)]
pub(crate) struct Extension {
    effects: Vec<Effect>,
    parts: Parts,
    time_s: f64,
    /// Time since the motor has commutated last; longer than any test before it has.
    since_commutation_s: f64,
}

impl Extension {
    /// Effects that are on, and their changes in the drive train; nothing when none is.
    pub(crate) fn of(
        effects: &[Effect],
        machine: &MachineNumbers,
        train: &mut DriveTrain,
        finer: f64,
    ) -> Option<Box<Self>> {
        let effects: Vec<Effect> = effects.iter().filter(|e| !e.is_off()).cloned().collect();
        if effects.is_empty() {
            return None;
        }
        let mut parts = Parts::none(machine, train.nominal_friction_n_m());
        for effect in &effects {
            effect.law(|law| law.install(&mut parts));
        }
        if let Some(shaft) = &mut parts.elastic_shaft {
            let r = machine.per_gear_ratio;
            shaft.angle_rad = train.surface_rad();
            shaft.load_n_m = train.set_free(parts.motor_inertia_kg_m2) / r;
            shaft.speed_rad_per_s = train.speed_rad_per_s * r;
        }
        parts.refine(finer);
        Some(Box::new(Self { effects, parts, time_s: 0.0, since_commutation_s: f64::MAX }))
    }

    /// The longest segment at a speed.
    #[inline]
    pub(crate) fn longest_s(&self, speed_rad_per_s: f64) -> f64 {
        let (mut longest_s, mut longest_rad) = (self.parts.longest_s, self.parts.longest_rad);
        if let Some(bristles) = &self.parts.bristles
            && !bristles.is_steady(speed_rad_per_s)
        {
            longest_s = longest_s.min(bristles.longest_s);
            longest_rad = longest_rad.min(bristles.longest_rad);
        }
        if longest_rad < f64::INFINITY {
            longest_s = longest_s.min(longest_rad / speed_rad_per_s.abs().max(SLOWEST));
        }
        longest_s.max(self.shortest_s())
    }

    /// No segment is cut shorter.
    pub(crate) fn shortest_s(&self) -> f64 {
        SHORTEST_RATIO * self.parts.machine.tick_s
    }

    /// Angle by which the commutation is early, of the rotor.
    pub(crate) fn commutation_lead_rad(&self, pole_pairs: f64) -> f64 {
        self.parts.commutation.map_or(0.0, |c| c.offset_rad / pole_pairs)
    }

    /// True where the surface moves on its own.
    pub(crate) fn is_compliant(&self) -> bool {
        self.parts.elastic_shaft.is_some()
    }

    /// The elastic shaft.
    pub(crate) fn elastic_shaft(&self) -> Option<&ElasticShaft> {
        self.parts.elastic_shaft.as_ref()
    }

    /// Leaves the motion of an elastic shaft to the machine; true where there is one.
    pub(crate) fn hand_over_surface(&mut self) -> bool {
        if let Some(shaft) = &mut self.parts.elastic_shaft {
            shaft.followed = true;
        }
        self.is_compliant()
    }

    /// Takes over where the machine has moved the surface to.
    pub(crate) fn put_surface(&mut self, angle_rad: f64, speed_rad_per_s: f64) {
        if let Some(shaft) = &mut self.parts.elastic_shaft {
            (shaft.angle_rad, shaft.speed_rad_per_s) = (angle_rad, speed_rad_per_s);
        }
    }

    /// Position of the surface.
    pub(crate) fn position_rad(&self, train: &DriveTrain, motor_rad: f64) -> f64 {
        self.position_in(train, 0.0) + self.error_rad(motor_rad)
    }

    /// Motion of the surface from the start, without the error of the gear.
    pub(crate) fn moved_rad(&self, train: &DriveTrain) -> f64 {
        self.moved_in(train, 0.0)
    }

    /// Takes a new load on the surface.
    pub(crate) fn set_load(&mut self, load_n_m: f64) {
        if let Some(shaft) = &mut self.parts.elastic_shaft {
            shaft.load_n_m = load_n_m;
        }
    }

    /// Puts on the shaft what the effects do in the middle of the next span.
    pub(crate) fn act(
        &mut self,
        train: &mut DriveTrain,
        now: &Instant,
        acceleration: f64,
        span_s: f64,
    ) {
        let half_s = if train.direction == Direction::Stuck { 0.0 } else { 0.5 * span_s };
        let at = self.middle(train, now, acceleration, half_s);
        let nominal = train.nominal_friction();
        let mut load = ShaftLoad::new(nominal.against_n_m);
        for effect in &self.effects {
            effect.load(&at, &mut load);
        }
        let mut friction = with_effects(nominal, &load);
        let turn_rad = at.motor_rad - now.motor_rad;
        if let Some(bristles) = &mut self.parts.bristles {
            bend(bristles, &mut friction, turn_rad, at.speed_rad_per_s);
        }
        if let Some(shaft) = &self.parts.elastic_shaft {
            let r = self.parts.machine.per_gear_ratio;
            if !shaft.followed {
                let from =
                    MotorState { angle_rad: train.angle_rad, speed_rad_per_s: now.speed_rad_per_s };
                let to = MotorState {
                    angle_rad: train.angle_rad + turn_rad,
                    speed_rad_per_s: at.speed_rad_per_s,
                };
                let surface = shaft.predicted(from.at_surface(r), half_s);
                let passed = shaft.passed_n_m(to.at_surface(r), surface);
                feel(shaft, &mut friction, r, passed, train.direction.sign());
            } else if span_s == 0.0 && now.speed_rad_per_s == 0.0 {
                // what holds a shaft that has just come to rest
                let motor = ShaftState { angle_rad: train.angle_rad * r, speed_rad_per_s: 0.0 };
                let passed = shaft.passed_n_m(motor, shaft.state());
                feel(shaft, &mut friction, r, passed, 0.0);
            }
        }
        train.set_friction(friction);
    }

    /// The state in the middle of a span, predicted from its start.
    #[inline]
    fn middle(&self, train: &DriveTrain, now: &Instant, acceleration: f64, half_s: f64) -> Moment {
        let (mut motor_rad, mut speed_rad_per_s) = (now.motor_rad, now.speed_rad_per_s);
        if train.direction != Direction::Stuck {
            let to = now.speed_rad_per_s + acceleration * half_s;
            let mean = now.speed_rad_per_s + 0.5 * acceleration * half_s;
            let sign = train.direction.sign();
            speed_rad_per_s = if to * sign > 0.0 { to } else { 0.0 };
            motor_rad += mean * half_s;
        }
        let machine = &self.parts.machine;
        Moment {
            motor_rad,
            speed_rad_per_s,
            position_rad: self.position_in(train, motor_rad - now.motor_rad),
            time_s: self.time_s + half_s,
            motor_n_m: now.motor_n_m,
            load_n_m: match &self.parts.elastic_shaft {
                Some(shaft) => shaft.load_n_m * machine.per_gear_ratio,
                None => train.carried_load_n_m(),
            },
            per_gear_ratio: machine.per_gear_ratio,
            since_commutation_s: self.since_commutation_s + half_s,
        }
    }

    /// Goes on in time with the machine's motion over a span.
    pub(crate) fn advance(&mut self, span_s: f64, from: MotorState, to: MotorState, heat_w: f64) {
        self.time_s += span_s;
        let turn_rad = to.angle_rad - from.angle_rad;
        if let Some(bristles) = &mut self.parts.bristles {
            let mean = 0.5 * (from.speed_rad_per_s + to.speed_rad_per_s);
            bristles.deflection_rad = bristles.turned(turn_rad, mean);
        }
        if let Some(shaft) = &mut self.parts.elastic_shaft
            && !shaft.followed
        {
            let r = self.parts.machine.per_gear_ratio;
            shaft.advance(from.at_surface(r), to.at_surface(r), span_s);
        }
        self.since_commutation_s += span_s;
        self.parts.winding.warm(span_s, heat_w);
    }

    /// Takes over where a machine that was run elsewhere stands in time.
    pub(crate) fn put_time(&mut self, time_s: f64, since_commutation_s: f64) {
        (self.time_s, self.since_commutation_s) = (time_s, since_commutation_s);
    }

    /// Time since the motor has commutated last.
    pub(crate) fn since_commutation_s(&self) -> f64 {
        self.since_commutation_s
    }

    /// The effects that are on.
    pub(crate) fn effects(&self) -> &[Effect] {
        &self.effects
    }

    /// Parts with a state, and the length of segments that they ask for.
    pub(crate) fn parts(&self) -> &Parts {
        &self.parts
    }

    /// The parts, to be changed.
    pub(crate) fn parts_mut(&mut self) -> &mut Parts {
        &mut self.parts
    }

    /// Time from the start.
    pub(crate) fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Takes note that the motor has commutated.
    pub(crate) fn commutated(&mut self) {
        self.since_commutation_s = 0.0;
    }

    /// Effects between supply and winding.
    pub(crate) fn winding(&self) -> &WindingEffects {
        &self.parts.winding
    }

    /// Torque constant at a current over that without current.
    pub(crate) fn saturation_ratio(&self, current_a: f64) -> f64 {
        let mut ratio = 1.0;
        for per_a2 in &self.parts.saturations_per_a2 {
            ratio *= (1.0 - per_a2 * current_a * current_a).max(LEAST_SATURATED_RATIO);
        }
        ratio
    }

    /// True where the circuit of a segment depends on its current.
    pub(crate) fn has_own_circuit(&self) -> bool {
        !self.parts.saturations_per_a2.is_empty() || self.parts.winding.source_ohm > 0.0
    }

    /// The back-EMF's wave, where effects move it or the sectors.
    pub(crate) fn waveform(&self) -> Option<Waveform> {
        self.parts.commutation.filter(|c| c.shaped).map(|c| c.wave)
    }

    /// The coupling with saturation and the shape of the back-EMF.
    #[inline]
    pub(crate) fn coupling(
        &self,
        mut coupling: LocalQuadratic,
        current_a: f64,
        shape: impl Fn(&Waveform) -> [f64; 2],
    ) -> LocalQuadratic {
        if !self.parts.saturations_per_a2.is_empty() {
            let factor = self.saturation_ratio(current_a);
            coupling = coupling.map(|k| factor * k);
        }
        if let Some(errors) = self.parts.commutation.as_ref().filter(|c| c.shaped) {
            let [ratio, slope] = shape(&errors.wave);
            // a product of two local series, the ratio's second power left out
            coupling = [
                coupling[0] * ratio,
                coupling[1] * ratio + coupling[0] * slope,
                coupling[2] * ratio + coupling[1] * slope,
            ];
        }
        coupling
    }

    /// The current that its sensor shows, once a tick.
    #[inline(never)]
    pub(crate) fn shown_current_a(&mut self, current_a: f64) -> f64 {
        self.read_current_a(current_a, self.parts.machine.tick_s)
    }

    /// The sensor of the current, where it errs.
    pub(crate) fn current_sensor(&self) -> Option<&CurrentSensor> {
        self.parts.current_sensor.as_ref()
    }

    /// The current that its sensor shows a period after it was read last.
    pub(crate) fn read_current_a(&mut self, current_a: f64, period_s: f64) -> f64 {
        match &mut self.parts.current_sensor {
            Some(sensor) => sensor.read_a(current_a, period_s),
            None => current_a,
        }
    }

    /// The current that flows when its sensor's reading is held at a set-point.
    pub(crate) fn regulated_a(&self, reference_a: f64) -> f64 {
        match &self.parts.current_sensor {
            Some(sensor) => sensor.regulated_a(reference_a),
            None => reference_a,
        }
    }

    /// The position that its sensor shows, given that of the surface, once a tick; with the error
    /// of the gear.
    pub(crate) fn shown_of_rad(&mut self, position_rad: f64, motor_rad: f64) -> f64 {
        self.read_position_rad(position_rad + self.error_rad(motor_rad), motor_rad)
    }

    /// The position that its sensor shows, once a tick; with the error of the gear.
    #[inline(never)]
    pub(crate) fn shown_position_rad(&mut self, train: &DriveTrain, motor_rad: f64) -> f64 {
        self.shown_of_rad(self.position_in(train, 0.0), motor_rad)
    }

    /// The position that its sensor shows, a tick after it was read last.
    pub(crate) fn read_position_rad(&mut self, position_rad: f64, motor_rad: f64) -> f64 {
        let tick_s = self.parts.machine.tick_s;
        match &mut self.parts.position_sensor {
            Some(sensor) => sensor.read_rad(position_rad, motor_rad, tick_s),
            None => position_rad,
        }
    }

    /// Position of the surface after a small turn of the motor, from where it is now.
    fn position_in(&self, train: &DriveTrain, turn_rad: f64) -> f64 {
        self.parts.machine.start_position_rad + self.moved_in(train, turn_rad)
    }

    /// Motion of the surface from the start, after a small turn of the motor.
    fn moved_in(&self, train: &DriveTrain, turn_rad: f64) -> f64 {
        match &self.parts.elastic_shaft {
            Some(shaft) => shaft.angle_rad,
            None => train.surface_rad_at(train.angle_rad + turn_rad),
        }
    }

    fn error_rad(&self, motor_rad: f64) -> f64 {
        let at = |wave: &PositionWave| wave.at(motor_rad);
        self.parts.position_waves.iter().map(at).sum()
    }

    /// Set-points to hold in this tick, each with its share of it.
    pub(crate) fn delayed(&mut self, reference: f64) -> [HeldReference; 2] {
        match &mut self.parts.delay {
            Some(delay) => delay.pass(reference),
            None => HeldReference::undelayed(reference),
        }
    }
}

/// Friction with what effects add; of no direction below zero, the static at least the kinetic.
#[inline(always)]
#[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
pub(crate) fn with_effects(nominal: FrictionState, load: &ShaftLoad) -> FrictionState {
    let mut friction = FrictionState { against_n_m: load.against_n_m, ..nominal };
    for side in 0..2 {
        let [kinetic_n_m, static_n_m] = load.dry_n_m[side];
        friction.kinetic_n_m[side] =
            larger(friction.kinetic_n_m[side] * load.friction_ratio + kinetic_n_m, 0.0);
        friction.static_n_m[side] = larger(
            friction.static_n_m[side] * load.friction_ratio + static_n_m,
            friction.kinetic_n_m[side],
        );
    }
    friction
}

/// Puts bristles in the place of dry friction.
fn bend(bristles: &mut Bristles, friction: &mut FrictionState, turn_rad: f64, speed: f64) {
    let side = usize::from(speed >= 0.0);
    bristles.level_n_m = [friction.kinetic_n_m[side], friction.static_n_m[side]];
    friction.against_n_m += bristles.torque_n_m(turn_rad, speed);
    (friction.kinetic_n_m, friction.static_n_m) = ([0.0; 2], [0.0; 2]);
}

/// Lets the motor feel the torque that an elastic shaft passes, with the gear's losses; `sign` is
/// that of the motor's direction, zero at rest.
#[inline(always)]
#[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
pub(crate) fn feel(
    shaft: &ElasticShaft,
    friction: &mut FrictionState,
    per_gear_ratio: f64,
    passed_n_m: f64,
    sign: f64,
) {
    let r = per_gear_ratio;
    let [backward, forward] = [-1.0, 1.0].map(|sign| shaft.felt_n_m(passed_n_m, sign) * r);
    let moving = if sign < 0.0 { backward } else { forward };
    // at rest the gear's losses hold the shaft either way
    let (rests, held) = (sign == 0.0, passed_n_m * r);
    friction.against_n_m += if rests { held } else { moving };
    friction.static_n_m[0] += if rests { held - backward } else { 0.0 };
    friction.static_n_m[1] += if rests { forward - held } else { 0.0 };
}

/// Factors on constants of the machine that effects ask for.
pub(crate) fn rescaling(effects: &[Effect]) -> Rescaling {
    let mut machine = Rescaling::NONE;
    for effect in effects {
        effect.law(|law: &dyn EffectLaw| law.rescale(&mut machine));
    }
    machine
}
