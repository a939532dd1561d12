//! Effects at work: what they add to a run, with the states that they have.
//!
//! Torques that change with the state are held over a segment at their value in its predicted
//! middle, which is of second order in its length; segments are cut where an effect is quicker
//! than the controller's tick.

use core::f64::consts::TAU;
use std::collections::VecDeque;

use libm::{exp, floor, pow, sqrt, tanh};

use super::{
    Coordinate, CurveKind, Effect, EffectError, EffectId, Geometry, MOST_PARAMETERS,
    footing::Footing, strength::Strength,
};
use crate::{
    controller::quantised,
    drive_train::{Direction, DriveTrain},
    lane_sine::sincos_of,
    params::{self, Actuator, PositionSensor},
    scenario::Scenario,
    waveform::Waveform,
    winding::LocalQuadratic,
};

/// A model that effects act in, with what it cannot take.
#[derive(Clone, Debug)]
pub(crate) struct Host {
    pub(crate) name: &'static str,
    pub(crate) geometry: Geometry,
    pub(crate) refused: Vec<(EffectId, &'static str)>,
    pub(crate) strength: Strength,
    pub(crate) footing: Footing,
    /// Where the surface stops; none where nothing stops it.
    pub(crate) stop_rad: Option<f64>,
}

const NO_SECTORS: &str = "a field-oriented drive has no sectors";
const OWN_SHAPE: &str = "a field-oriented drive takes its shape of back-EMF from a table";
const MOTOR_ENCODER: &str = "the loop is closed on the motor's shaft, not on the surface";
const RUBBING_SURFACE: &str = "the friction of the surface is not modelled behind a spring";

impl Host {
    /// A model of an actuator, which refuses some effects itself and others for its machine.
    pub(crate) fn of_actuator(
        name: &'static str,
        actuator: &Actuator,
        scenario: &Scenario,
        refused: &[(EffectId, &'static str)],
    ) -> Self {
        let mut refused = refused.to_vec();
        if actuator.inverter.commutation == params::Commutation::FieldOriented {
            refused.extend([
                (EffectId::BackEmfShape, OWN_SHAPE),
                (EffectId::CommutationOverlap, NO_SECTORS),
                (EffectId::HallOffset, NO_SECTORS),
            ]);
        }
        if actuator.controller.position_sensor == PositionSensor::MotorShaft {
            refused.push((EffectId::PositionSensor, MOTOR_ENCODER));
        }
        if actuator.transmission.surface_friction_n_m > 0.0 {
            refused.push((EffectId::Compliance, RUBBING_SURFACE));
        }
        let (c, t) = (&actuator.controller, &actuator.transmission);
        let peak_n_m = actuator.torque_constant_n_m_per_a() * c.current_limit_a;
        let inertia_kg_m2 = actuator.total_inertia_kg_m2();
        let moved = (inertia_kg_m2, t.gear_ratio);
        let limits = (actuator.equivalent_supply_v(), c.current_limit_a);
        let strength = Strength::new(peak_n_m, moved, 1.0 / c.sample_hz, limits);
        let footing = Footing {
            gains: [c.position_gain_per_s, c.speed_gain_a_s_per_rad, c.speed_integral_a_per_rad],
            dry_friction: t.static_friction_n_m > 0.0 || scenario.brake_n_m > 0.0,
            regulated: false,
            measured: true,
        };
        let (geometry, stop_rad) = (Geometry::Rotary, Some(t.stop_rad));
        Self { name, geometry, refused, strength, footing, stop_rad }
    }

    /// Refuses effects that the model has no place for.
    pub(crate) fn check(&self, effects: &[Effect]) -> Result<(), EffectError> {
        for (place, effect) in effects.iter().enumerate() {
            let id = effect.id();
            if effect.geometry() != self.geometry {
                return Err(EffectError::WrongGeometry { effect: id, found: effect.geometry() });
            }
            if let Some((_, reason)) = self.refused.iter().find(|(refused, _)| *refused == id) {
                return Err(EffectError::NotInModel { effect: id, model: self.name, reason });
            }
            let again = effects[..place].iter().any(|earlier| earlier.id() == id);
            if again && ONCE.contains(&id) {
                return Err(EffectError::Twice { effect: id });
            }
            self.strength.check(effect, self.stop_rad)?;
            self.footing.check(effect, effects, self.name)?;
        }
        Ok(())
    }
}

/// Effects with a state of their own, or on one number of the machine.
const ONCE: [EffectId; 13] = [
    EffectId::Presliding,
    EffectId::Compliance,
    EffectId::MagnetLoss,
    EffectId::ResistanceDrift,
    EffectId::InductanceEddy,
    EffectId::DeadTime,
    EffectId::BusSag,
    EffectId::CurrentSensor,
    EffectId::PositionSensor,
    EffectId::ControllerMismatch,
    EffectId::BackEmfShape,
    EffectId::CommutationOverlap,
    EffectId::HallOffset,
];

/// The state that an effect depends on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Instant {
    pub(crate) motor_rad: f64,
    pub(crate) speed_rad_per_s: f64,
    pub(crate) motor_n_m: f64,
}

/// The machine's numbers that effects need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Machine {
    pub(crate) inertia_kg_m2: f64,
    pub(crate) per_gear_ratio: f64,
    pub(crate) load_inertia_kg_m2: f64,
    pub(crate) efficiency_ratio: f64,
    pub(crate) half_play_rad: f64,
    pub(crate) tick_s: f64,
    /// Position at the start, from which the drive train counts.
    pub(crate) start_position_rad: f64,
    /// Electrical periods a turn.
    pub(crate) pole_pairs: f64,
}

/// Effects of a run.
#[derive(Clone, Debug)]
pub(crate) struct Extension {
    effects: Vec<Effect>,
    time_s: f64,
    /// Longest segment, and its longest turn.
    longest_s: f64,
    longest_rad: f64,
    presliding: Option<Presliding>,
    compliant: Option<Compliant>,
    /// `[a, b, n]` of each transmission error.
    errors: Vec<[f64; 3]>,
    /// `a` of each saturation.
    saturations: Vec<f64>,
    winding: WindingEffects,
    commutation: Option<Commutation>,
    current_sensor: Option<[f64; MOST_PARAMETERS]>,
    shown_a: Option<f64>,
    position_sensor: Option<[f64; MOST_PARAMETERS]>,
    lagged_rad: Option<f64>,
    delay: Option<Delay>,
    tick_s: f64,
    per_gear_ratio: f64,
    start_position_rad: f64,
}

/// Bristles in place of dry friction.
#[derive(Clone, Copy, Debug)]
struct Presliding {
    distance_rad: f64,
    damping: f64,
    stribeck: f64,
    deflection_rad: f64,
    /// Kinetic and static friction of the present direction.
    level_n_m: [f64; 2],
    /// Longest segment, and its longest turn, while the bristles bend.
    longest_s: f64,
    longest_rad: f64,
}

impl Presliding {
    /// `g(ω)/σ0`, the deflection at which sliding is steady.
    fn steady_rad(&self, speed: f64) -> f64 {
        let [kinetic, fixed] = self.level_n_m;
        let ratio = speed / self.stribeck;
        let g = kinetic + (fixed - kinetic).max(0.0) * exp(-ratio * ratio);
        if kinetic > 0.0 { self.distance_rad * g / kinetic } else { self.distance_rad }
    }

    /// Whether the bristles have bent as far as they do at a speed: they follow it from there,
    /// however long the segment, until the motion turns.
    fn is_steady(&self, speed: f64) -> bool {
        let steady = self.steady_rad(speed).copysign(speed);
        speed != 0.0 && (self.deflection_rad - steady).abs() < STEADY_RATIO * steady.abs()
    }

    /// The deflection after a turn.
    fn turned(&self, turn_rad: f64, speed: f64) -> f64 {
        if turn_rad == 0.0 {
            self.deflection_rad
        } else {
            self.bent(turn_rad, self.steady_rad(speed))
        }
    }

    /// The deflection after a turn, with the one at which sliding is steady.
    fn bent(&self, turn_rad: f64, steady_rad: f64) -> f64 {
        if turn_rad == 0.0 {
            return self.deflection_rad;
        }
        let steady = steady_rad.copysign(turn_rad);
        steady + (self.deflection_rad - steady) * exp(-(turn_rad / steady).abs())
    }

    fn torque_n_m(&self, turn_rad: f64, speed: f64) -> f64 {
        let steady_rad = self.steady_rad(speed);
        let deflection = self.bent(turn_rad, steady_rad);
        let slip = deflection / steady_rad;
        let rate = speed - speed.abs() * slip;
        self.level_n_m[0] / self.distance_rad * deflection + self.damping * rate
    }
}

/// The surface behind an elastic shaft; angles at the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Compliant {
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) inertia: f64,
    pub(crate) half_play_rad: f64,
    pub(crate) efficiency_ratio: f64,
    pub(crate) angle_rad: f64,
    pub(crate) speed_rad_per_s: f64,
    pub(crate) load_n_m: f64,
    /// Whether the machine moves the surface itself.
    followed: bool,
}

impl Compliant {
    /// Torque that the shaft passes to a surface at an angle and speed.
    fn passed_n_m(&self, motor: (f64, f64), surface: (f64, f64)) -> f64 {
        let twist = motor.0 - surface.0;
        let beyond = twist - twist.clamp(-self.half_play_rad, self.half_play_rad);
        if beyond == 0.0 {
            return 0.0;
        }
        let spring = self.stiffness * beyond;
        let damped = spring + self.damping * (motor.1 - surface.1);
        // a flank pushes and never pulls
        if damped * spring > 0.0 { damped } else { 0.0 }
    }

    /// Torque against the motor side, still at the surface.
    fn felt_n_m(&self, passed_n_m: f64, speed: f64) -> f64 {
        if passed_n_m * speed > 0.0 {
            passed_n_m / self.efficiency_ratio
        } else if passed_n_m * speed < 0.0 {
            passed_n_m * self.efficiency_ratio
        } else {
            passed_n_m
        }
    }

    /// The surface after a span, with the shaft's torque as at the start of it.
    fn predicted(&self, motor: (f64, f64), span_s: f64) -> (f64, f64) {
        let torque = self.passed_n_m(motor, (self.angle_rad, self.speed_rad_per_s));
        let rate = (torque - self.load_n_m) / self.inertia;
        let turn = self.speed_rad_per_s * span_s + 0.5 * rate * span_s * span_s;
        (self.angle_rad + turn, self.speed_rad_per_s + rate * span_s)
    }

    /// Moves the surface over a span in which the motor side went from one state to another.
    fn advance(&mut self, from: (f64, f64), to: (f64, f64), span_s: f64) {
        let now = (self.angle_rad, self.speed_rad_per_s);
        let guess = self.predicted(from, span_s);
        let mean = 0.5 * (self.passed_n_m(from, now) + self.passed_n_m(to, guess));
        let rate = (mean - self.load_n_m) / self.inertia;
        self.angle_rad += self.speed_rad_per_s * span_s + 0.5 * rate * span_s * span_s;
        self.speed_rad_per_s += rate * span_s;
    }
}

/// What changes between supply and winding.
#[derive(Clone, Copy, Debug, Default)]
struct WindingEffects {
    rise_per_k: f64,
    kelvin_per_w: f64,
    thermal_s: f64,
    warm_k: f64,
    inductance_henry: f64,
    dead_v: f64,
    dead_a: f64,
    source_ohm: f64,
    any: bool,
}

/// The electrical circuit of a segment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Circuit {
    pub(crate) resistance_ohm: f64,
    /// Inductance over the segment's length.
    pub(crate) inductive_ohm: f64,
    /// Resistance of the supply.
    pub(crate) source_ohm: f64,
    pub(crate) dead_v: f64,
}

/// Effects on commutation and the shape of the back-EMF.
#[derive(Clone, Copy, Debug)]
struct Commutation {
    wave: Waveform,
    offset_rad: f64,
    dip_ratio: f64,
    dip_s: f64,
    since_s: f64,
    shaped: bool,
}

/// Set-points under way.
#[derive(Clone, Debug)]
struct Delay {
    ticks: usize,
    /// Part of a tick for which the older of two acts.
    share: f64,
    queue: VecDeque<f64>,
}

impl Extension {
    /// Effects that are on, and what they change in the drive train; nothing when none is.
    pub(crate) fn of(
        effects: &[Effect],
        machine: &Machine,
        train: &mut DriveTrain,
        finer: f64,
    ) -> Option<Box<Self>> {
        let effects: Vec<Effect> = effects.iter().filter(|e| !e.is_off()).cloned().collect();
        if effects.is_empty() {
            return None;
        }
        let mut extension = Self {
            effects: Vec::new(),
            time_s: 0.0,
            longest_s: machine.tick_s,
            longest_rad: f64::INFINITY,
            presliding: None,
            compliant: None,
            errors: Vec::new(),
            saturations: Vec::new(),
            winding: WindingEffects::default(),
            commutation: None,
            current_sensor: None,
            shown_a: None,
            position_sensor: None,
            lagged_rad: None,
            delay: None,
            tick_s: machine.tick_s,
            per_gear_ratio: machine.per_gear_ratio,
            start_position_rad: machine.start_position_rad,
        };
        for effect in effects {
            extension.take(&effect, machine, train);
            extension.effects.push(effect);
        }
        extension.longest_s *= finer;
        extension.longest_rad *= finer;
        if let Some(bristles) = &mut extension.presliding {
            bristles.longest_s *= finer;
            bristles.longest_rad *= finer;
        }
        Some(Box::new(extension))
    }

    fn take(&mut self, effect: &Effect, machine: &Machine, train: &mut DriveTrain) {
        let v = effect.values;
        let turn = |order: f64| LONGEST_PHASE_RAD / order.max(1e-9);
        match effect.id() {
            EffectId::Presliding => {
                let friction = train.nominal_friction_n_m();
                let stiffness = friction[0] / v[0];
                // the bristles and the inertia swing at this rate
                let swing = sqrt(stiffness / machine.inertia_kg_m2);
                self.presliding = Some(Presliding {
                    distance_rad: v[0],
                    damping: v[1],
                    stribeck: v[2],
                    deflection_rad: 0.0,
                    level_n_m: friction,
                    longest_s: LONGEST_PHASE_RAD / swing,
                    longest_rad: 0.25 * v[0],
                });
            }
            EffectId::Compliance => self.soften(v, machine, train),
            EffectId::TransmissionError => {
                self.longest_rad = self.longest_rad.min(turn(v[2]));
                self.errors.push([v[0], v[1], v[2]]);
            }
            EffectId::Saturation => self.saturations.push(v[0]),
            EffectId::Cogging | EffectId::CurrentRipple => {
                self.longest_rad = self.longest_rad.min(turn(v[2]));
            }
            EffectId::WornRegion => {
                let width = v[2] / self.per_gear_ratio;
                self.longest_rad = self.longest_rad.min(LONGEST_PHASE_RAD * width);
            }
            EffectId::Vibration => {
                self.longest_s = self.longest_s.min(LONGEST_PHASE_RAD / (TAU * v[2]).max(1e-9));
            }
            EffectId::ResistanceDrift => {
                let w = &mut self.winding;
                (w.rise_per_k, w.kelvin_per_w, w.thermal_s, w.any) = (v[0], v[1], v[2], true);
            }
            EffectId::InductanceEddy => {
                (self.winding.inductance_henry, self.winding.any) = (v[0], true);
                if v[0] > 0.0 {
                    self.longest_s = self.longest_s.min(0.25 * machine.tick_s);
                }
            }
            EffectId::DeadTime => {
                let w = &mut self.winding;
                (w.dead_v, w.dead_a, w.any) = (v[0], v[1], true);
            }
            EffectId::BusSag => (self.winding.source_ohm, self.winding.any) = (v[0], true),
            EffectId::CurrentSensor => self.current_sensor = Some(v),
            EffectId::PositionSensor => self.position_sensor = Some(v),
            EffectId::ControllerMismatch if v[4] > 0.0 => {
                let ticks = v[4] / machine.tick_s;
                let whole = floor(ticks);
                let queue = VecDeque::from(vec![0.0; whole as usize + 1]);
                self.delay = Some(Delay { ticks: whole as usize, share: ticks - whole, queue });
            }
            EffectId::BackEmfShape | EffectId::CommutationOverlap | EffectId::HallOffset => {
                let c = self.commutation.get_or_insert(Commutation::NONE);
                match effect.id() {
                    EffectId::BackEmfShape => {
                        c.wave = Waveform { flat_loss_rad: v[0], fifth: v[1], seventh: v[2] };
                    }
                    EffectId::CommutationOverlap => (c.dip_ratio, c.dip_s) = (v[0], v[1]),
                    _ => c.offset_rad = v[0],
                }
                c.shaped |= effect.id() != EffectId::CommutationOverlap;
                let electrical = 0.1 / machine.pole_pairs;
                self.longest_rad = self.longest_rad.min(electrical);
                if c.dip_ratio > 0.0 {
                    self.longest_s = self.longest_s.min(0.1 * c.dip_s);
                }
            }
            EffectId::Tabulated => {
                if let Some(curve) = effect.curve() {
                    let spacing = curve.spacing();
                    match curve.over() {
                        Coordinate::MotorAngle => {
                            self.longest_rad = self.longest_rad.min(spacing);
                        }
                        Coordinate::Position => {
                            let turn = spacing / self.per_gear_ratio;
                            self.longest_rad = self.longest_rad.min(turn);
                        }
                        Coordinate::Time => self.longest_s = self.longest_s.min(spacing),
                        Coordinate::Speed => {}
                    }
                }
            }
            _ => {}
        }
    }

    /// Sets the surface free of the motor's shaft and ties it by a spring.
    fn soften(&mut self, v: [f64; MOST_PARAMETERS], machine: &Machine, train: &mut DriveTrain) {
        let inertia = if v[2] > 0.0 { v[2] } else { machine.load_inertia_kg_m2 };
        let reflected = inertia * machine.per_gear_ratio * machine.per_gear_ratio;
        let motor_inertia = if v[2] > 0.0 && machine.load_inertia_kg_m2 == 0.0 {
            machine.inertia_kg_m2 - reflected
        } else {
            let own = machine.load_inertia_kg_m2 * machine.per_gear_ratio * machine.per_gear_ratio;
            machine.inertia_kg_m2 - own
        };
        let motor_inertia = motor_inertia.max(1e-6 * machine.inertia_kg_m2);
        let inertia = inertia.max(1e-12);
        let stiffness = 1.0 / v[0];
        let motor_at_surface = motor_inertia / (machine.per_gear_ratio * machine.per_gear_ratio);
        // a shaft that the shortest segments cannot follow is as good as rigid
        let per_mass = 1.0 / inertia + 1.0 / motor_at_surface;
        let fastest = LONGEST_SWING_RAD / (SHORTEST_RATIO * machine.tick_s);
        let stiffness = stiffness.min(fastest * fastest / per_mass);
        let swing = sqrt(stiffness * per_mass);
        self.longest_s = self.longest_s.min(LONGEST_SWING_RAD / swing);
        let damping = v[1].min(LONGEST_DECAY / (SHORTEST_RATIO * machine.tick_s * per_mass));
        self.longest_s = self.longest_s.min(LONGEST_DECAY / (damping * per_mass).max(1e-9));
        let angle_rad = train.surface_rad();
        let load_n_m = train.set_free(motor_inertia) / machine.per_gear_ratio;
        self.compliant = Some(Compliant {
            stiffness,
            damping,
            inertia,
            half_play_rad: machine.half_play_rad,
            efficiency_ratio: machine.efficiency_ratio,
            angle_rad,
            speed_rad_per_s: train.speed_rad_per_s * machine.per_gear_ratio,
            load_n_m,
            followed: false,
        });
    }

    /// The longest segment at a speed.
    #[inline]
    pub(crate) fn longest_s(&self, speed_rad_per_s: f64) -> f64 {
        let (mut longest_s, mut longest_rad) = (self.longest_s, self.longest_rad);
        if let Some(bristles) = &self.presliding
            && !bristles.is_steady(speed_rad_per_s)
        {
            longest_s = longest_s.min(bristles.longest_s);
            longest_rad = longest_rad.min(bristles.longest_rad);
        }
        if longest_rad < f64::INFINITY {
            longest_s = longest_s.min(longest_rad / speed_rad_per_s.abs().max(1e-9));
        }
        longest_s.max(self.shortest_s())
    }

    /// No segment is cut shorter.
    pub(crate) fn shortest_s(&self) -> f64 {
        SHORTEST_RATIO * self.tick_s
    }

    /// Angle by which the commutation is early, of the rotor.
    pub(crate) fn commutation_lead_rad(&self, pole_pairs: f64) -> f64 {
        self.commutation.map_or(0.0, |c| c.offset_rad / pole_pairs)
    }

    /// Whether the surface moves on its own.
    pub(crate) fn is_compliant(&self) -> bool {
        self.compliant.is_some()
    }

    /// The elastic shaft.
    pub(crate) fn compliant(&self) -> Option<&Compliant> {
        self.compliant.as_ref()
    }

    /// Leaves the motion of an elastic shaft to the machine; whether there is one.
    pub(crate) fn hand_over_surface(&mut self) -> bool {
        if let Some(compliant) = &mut self.compliant {
            compliant.followed = true;
        }
        self.is_compliant()
    }

    /// Where the machine has moved the surface to.
    pub(crate) fn put_surface(&mut self, angle_rad: f64, speed_rad_per_s: f64) {
        if let Some(compliant) = &mut self.compliant {
            (compliant.angle_rad, compliant.speed_rad_per_s) = (angle_rad, speed_rad_per_s);
        }
    }

    /// Position of the surface.
    pub(crate) fn position_rad(&self, train: &DriveTrain, motor_rad: f64) -> f64 {
        self.position_in(train, 0.0) + self.error_rad(motor_rad)
    }

    /// What the surface has moved from the start, without the error of the gear.
    pub(crate) fn moved_rad(&self, train: &DriveTrain) -> f64 {
        self.moved_in(train, 0.0)
    }

    /// A new load on the surface.
    pub(crate) fn set_load(&mut self, load_n_m: f64) {
        if let Some(compliant) = &mut self.compliant {
            compliant.load_n_m = load_n_m;
        }
    }

    /// Puts on the shaft what the effects do in the middle of the next span.
    pub(crate) fn burden(
        &mut self,
        train: &mut DriveTrain,
        now: &Instant,
        acceleration: f64,
        span_s: f64,
    ) {
        let moving = train.direction != Direction::Stuck;
        let half_s = if moving { 0.5 * span_s } else { 0.0 };
        let mut middle = *now;
        if moving {
            let to = now.speed_rad_per_s + acceleration * half_s;
            let mean = now.speed_rad_per_s + 0.5 * acceleration * half_s;
            let sign = train.direction.sign();
            middle.speed_rad_per_s = if to * sign > 0.0 { to } else { 0.0 };
            middle.motor_rad += mean * half_s;
        }
        let position = self.position_in(train, middle.motor_rad - now.motor_rad);
        let time_s = self.time_s + half_s;
        let load_n_m = match &self.compliant {
            Some(compliant) => compliant.load_n_m * self.per_gear_ratio,
            None => train.carried_load_n_m(),
        };
        let mut burden = train.nominal_burden();
        let mut factor = 1.0;
        let mut dry = [[0.0; 2]; 2];
        for effect in &self.effects {
            let v = &effect.values;
            let w = middle.speed_rad_per_s;
            let mut both = |torque: f64| dry = dry.map(|pair| pair.map(|t| t + torque));
            match effect.id() {
                EffectId::Stribeck => {
                    let kinetic = v[0] * exp(-power(w.abs() / v[1], v[2]));
                    dry[0][0] += kinetic;
                    dry[1][0] += kinetic;
                }
                EffectId::NonlinearViscous => {
                    burden.against_n_m += (v[0] * power(w.abs() / v[1], v[2])).copysign(w * v[0]);
                }
                EffectId::DirectionalFriction => {
                    dry[0] = dry[0].map(|t| t - v[0]);
                    dry[1] = dry[1].map(|t| t + v[0]);
                    burden.against_n_m += v[1] * w.abs();
                }
                EffectId::LoadFriction => {
                    both((v[0] * now.motor_n_m - v[1] * load_n_m).abs());
                }
                EffectId::WornRegion => {
                    let off = (position - v[1]) / v[2];
                    both(v[0] * exp(-0.5 * off * off));
                }
                EffectId::FrictionDrift => factor *= 1.0 - v[0] * (1.0 - exp(-time_s / v[1])),
                EffectId::TransmissionError => {
                    let (sin, cos) = sincos_of(v[2] * middle.motor_rad);
                    let slope = v[2] * (v[0] * cos - v[1] * sin);
                    burden.against_n_m += slope * load_n_m / self.per_gear_ratio;
                }
                EffectId::Imbalance => {
                    let (sin, cos) = sincos_of(position);
                    burden.against_n_m += v[0] * sin + v[1] * cos + v[2] * position;
                }
                EffectId::Cogging => {
                    let (sin, cos) = sincos_of(v[2] * middle.motor_rad);
                    burden.against_n_m += v[0] * sin + v[1] * cos;
                }
                EffectId::CurrentRipple => {
                    let (sin, cos) = sincos_of(v[2] * middle.motor_rad);
                    burden.against_n_m -= now.motor_n_m * (v[0] * sin + v[1] * cos);
                }
                EffectId::InductanceEddy => burden.against_n_m += v[1] * w,
                EffectId::Vibration => {
                    let (sin, cos) = sincos_of(TAU * v[2] * time_s);
                    burden.against_n_m += v[0] * sin + v[1] * cos;
                }
                EffectId::CommutationOverlap => {
                    if let Some(c) = &self.commutation {
                        let dip = c.dip_ratio * exp(-(c.since_s + half_s) / c.dip_s);
                        burden.against_n_m += now.motor_n_m * dip;
                    }
                }
                EffectId::Tabulated => {
                    let Some(curve) = effect.curve() else { continue };
                    let y = v[0]
                        * match curve.over() {
                            Coordinate::MotorAngle if effect.geometry() == Geometry::Rotary => {
                                curve.around(middle.motor_rad)
                            }
                            Coordinate::MotorAngle => curve.at(middle.motor_rad),
                            Coordinate::Speed => curve.at(w),
                            Coordinate::Position => curve.at(position),
                            Coordinate::Time => curve.at(time_s),
                        };
                    match curve.kind() {
                        CurveKind::Torque => burden.against_n_m += y,
                        CurveKind::Friction => both(y),
                    }
                }
                _ => {}
            }
        }
        for (side, extra) in dry.iter().enumerate() {
            burden.kinetic_n_m[side] = (burden.kinetic_n_m[side] * factor + extra[0]).max(0.0);
            burden.static_n_m[side] =
                (burden.static_n_m[side] * factor + extra[1]).max(burden.kinetic_n_m[side]);
        }
        let turn_rad = middle.motor_rad - now.motor_rad;
        if let Some(bristles) = &mut self.presliding {
            let side = usize::from(middle.speed_rad_per_s >= 0.0);
            bristles.level_n_m = [burden.kinetic_n_m[side], burden.static_n_m[side]];
            burden.against_n_m += bristles.torque_n_m(turn_rad, middle.speed_rad_per_s);
            (burden.kinetic_n_m, burden.static_n_m) = ([0.0; 2], [0.0; 2]);
        }
        if let Some(c) = &self.compliant
            && !c.followed
        {
            let r = self.per_gear_ratio;
            let angle_rad = train.angle_rad;
            let from = (angle_rad * r, now.speed_rad_per_s * r);
            let to = ((angle_rad + turn_rad) * r, middle.speed_rad_per_s * r);
            let passed = c.passed_n_m(to, c.predicted(from, half_s));
            let felt = [-1.0, 1.0].map(|sign| c.felt_n_m(passed, sign) * r);
            match train.direction {
                Direction::Backward => burden.against_n_m += felt[0],
                Direction::Forward => burden.against_n_m += felt[1],
                Direction::Stuck => {
                    // at rest the gear's losses hold the shaft either way
                    burden.against_n_m += passed * r;
                    burden.static_n_m[0] += passed * r - felt[0];
                    burden.static_n_m[1] += felt[1] - passed * r;
                }
            }
        }
        if let Some(c) = &self.compliant
            && c.followed
            && span_s == 0.0
            && now.speed_rad_per_s == 0.0
        {
            // what holds a shaft that has just come to rest
            let r = self.per_gear_ratio;
            let motor = (train.angle_rad * r, 0.0);
            let passed = c.passed_n_m(motor, (c.angle_rad, c.speed_rad_per_s));
            let felt = [-1.0, 1.0].map(|sign| c.felt_n_m(passed, sign) * r);
            burden.against_n_m += passed * r;
            burden.static_n_m[0] += passed * r - felt[0];
            burden.static_n_m[1] += felt[1] - passed * r;
        }
        train.carry(burden);
    }

    /// Goes on in time with what the machine did.
    pub(crate) fn advance(&mut self, span_s: f64, from: (f64, f64), to: (f64, f64), heat_w: f64) {
        self.time_s += span_s;
        let turn_rad = to.0 - from.0;
        if let Some(bristles) = &mut self.presliding {
            bristles.deflection_rad = bristles.turned(turn_rad, 0.5 * (from.1 + to.1));
        }
        if let Some(c) = &mut self.compliant
            && !c.followed
        {
            let r = self.per_gear_ratio;
            c.advance((from.0 * r, from.1 * r), (to.0 * r, to.1 * r), span_s);
        }
        if let Some(c) = &mut self.commutation {
            c.since_s += span_s;
        }
        let w = &mut self.winding;
        if w.rise_per_k > 0.0 {
            let towards = w.kelvin_per_w * heat_w;
            w.warm_k += (towards - w.warm_k) * (1.0 - exp(-span_s / w.thermal_s));
        }
    }

    /// Time from the start.
    pub(crate) fn time_s(&self) -> f64 {
        self.time_s
    }

    /// The motor has commutated.
    pub(crate) fn commutated(&mut self) {
        if let Some(c) = &mut self.commutation {
            c.since_s = 0.0;
        }
    }

    /// The circuit in the next span; without effects on it, nothing.
    pub(crate) fn circuit(
        &self,
        resistance_ohm: f64,
        current_a: f64,
        span_s: f64,
    ) -> Option<Circuit> {
        let w = &self.winding;
        w.any.then(|| Circuit {
            resistance_ohm: resistance_ohm * self.warmth_ratio(),
            inductive_ohm: w.inductance_henry / span_s,
            source_ohm: w.source_ohm,
            dead_v: if w.dead_v > 0.0 { w.dead_v * tanh(current_a / w.dead_a) } else { 0.0 },
        })
    }

    /// Whether the winding has an inductance.
    pub(crate) fn inductive(&self) -> bool {
        self.winding.inductance_henry > 0.0
    }

    /// What a current leaves of the torque constant.
    pub(crate) fn saturation_ratio(&self, current_a: f64) -> f64 {
        let mut ratio = 1.0;
        for per_a2 in &self.saturations {
            ratio *= (1.0 - per_a2 * current_a * current_a).max(0.1);
        }
        ratio
    }

    /// Resistance of the winding over that of the cold one.
    pub(crate) fn warmth_ratio(&self) -> f64 {
        1.0 + self.winding.rise_per_k * self.winding.warm_k
    }

    /// The same a time ahead, under a heat.
    pub(crate) fn warmth_ratio_in(&self, ahead_s: f64, heat_w: f64) -> f64 {
        let w = &self.winding;
        if w.rise_per_k == 0.0 {
            return 1.0;
        }
        let rate = (w.kelvin_per_w * heat_w - w.warm_k) / w.thermal_s;
        1.0 + w.rise_per_k * (w.warm_k + rate * ahead_s)
    }

    /// Resistance of the supply.
    pub(crate) fn source_ohm(&self) -> f64 {
        self.winding.source_ohm
    }

    /// Whether the circuit of a segment depends on its current.
    pub(crate) fn has_own_circuit(&self) -> bool {
        !self.saturations.is_empty() || self.winding.source_ohm > 0.0
    }

    /// The back-EMF's wave, where effects move it or the sectors.
    pub(crate) fn waveform(&self) -> Option<Waveform> {
        self.commutation.filter(|c| c.shaped).map(|c| c.wave)
    }

    /// The coupling with saturation and the shape of the back-EMF.
    #[inline]
    pub(crate) fn coupling(
        &self,
        mut coupling: LocalQuadratic,
        current_a: f64,
        shape: impl Fn(&Waveform) -> [f64; 2],
    ) -> LocalQuadratic {
        if !self.saturations.is_empty() {
            let factor = self.saturation_ratio(current_a);
            coupling = coupling.map(|k| factor * k);
        }
        if let Some(c) = self.commutation.as_ref().filter(|c| c.shaped) {
            let [ratio, slope] = shape(&c.wave);
            // a product of two local series, the ratio's second power left out
            coupling = [
                coupling[0] * ratio,
                coupling[1] * ratio + coupling[0] * slope,
                coupling[2] * ratio + coupling[1] * slope,
            ];
        }
        coupling
    }

    /// What the current sensor shows, once a tick.
    #[cold]
    pub(crate) fn shown_current_a(&mut self, current_a: f64) -> f64 {
        self.read_current_a(current_a, self.tick_s)
    }

    /// Whether the current's sensor errs, and whether the current loop uses it.
    pub(crate) fn current_sensor(&self) -> Option<bool> {
        self.current_sensor.map(|[_, _, _, in_loop, _]| in_loop > 0.5)
    }

    /// What the current sensor shows a period after it was read last.
    pub(crate) fn read_current_a(&mut self, current_a: f64, period_s: f64) -> f64 {
        let Some([gain, offset, lag, ..]) = self.current_sensor else { return current_a };
        let seen = (1.0 + gain) * current_a + offset;
        let before = self.shown_a.unwrap_or(seen);
        let shown = lagging(before, seen, lag, period_s);
        self.shown_a = Some(shown);
        shown
    }

    /// The current that flows when its sensor's reading is held at a set-point.
    pub(crate) fn regulated_a(&self, reference_a: f64) -> f64 {
        match self.current_sensor {
            Some([gain, offset, _, in_loop, _]) if in_loop > 0.5 => {
                (reference_a - offset) / (1.0 + gain)
            }
            _ => reference_a,
        }
    }

    /// What the position sensor shows, once a tick; with the error of the gear.
    #[cold]
    pub(crate) fn shown_position_rad(&mut self, train: &DriveTrain, motor_rad: f64) -> f64 {
        let position = self.position_in(train, 0.0) + self.error_rad(motor_rad);
        self.read_position_rad(position, motor_rad)
    }

    /// What the position sensor shows of a position, a tick after it was read last.
    pub(crate) fn read_position_rad(&mut self, position: f64, motor_rad: f64) -> f64 {
        let Some([lag, a, b, step, _]) = self.position_sensor else { return position };
        let (sin, cos) = if (a, b) == (0.0, 0.0) { (0.0, 1.0) } else { sincos_of(motor_rad) };
        let seen = position + a * sin + b * cos;
        let before = self.lagged_rad.unwrap_or(seen);
        let shown = lagging(before, seen, lag, self.tick_s);
        self.lagged_rad = Some(shown);
        quantised(shown, step)
    }

    /// Position of the surface after a small turn of the motor, from where it is now.
    fn position_in(&self, train: &DriveTrain, turn_rad: f64) -> f64 {
        self.start_position_rad + self.moved_in(train, turn_rad)
    }

    /// The same from the start.
    fn moved_in(&self, train: &DriveTrain, turn_rad: f64) -> f64 {
        match &self.compliant {
            Some(compliant) => compliant.angle_rad,
            None => train.surface_rad_at(train.angle_rad + turn_rad),
        }
    }

    fn error_rad(&self, motor_rad: f64) -> f64 {
        let wave = |[a, b, n]: &[f64; 3]| {
            let (sin, cos) = sincos_of(n * motor_rad);
            a * sin + b * cos
        };
        self.errors.iter().map(wave).sum()
    }

    /// Set-points to hold in this tick, each with its share of it.
    pub(crate) fn delayed(&mut self, reference: f64) -> [(f64, f64); 2] {
        let Some(delay) = &mut self.delay else { return [(reference, 1.0), (reference, 0.0)] };
        delay.queue.push_back(reference);
        let older = delay.queue[delay.queue.len() - 2 - delay.ticks];
        let newer = delay.queue[delay.queue.len() - 1 - delay.ticks];
        while delay.queue.len() > delay.ticks + 1 {
            delay.queue.pop_front();
        }
        [(older, delay.share), (newer, 1.0 - delay.share)]
    }
}

/// Phase of a periodic effect that a segment covers at most; the midpoint rule's error in a
/// sine is then below a thousandth of it.
const LONGEST_PHASE_RAD: f64 = 0.15;
/// Distance from the steady deflection of bristles, over it, within which they follow the speed.
const STEADY_RATIO: f64 = 1e-3;
/// Share of a tick below which no segment is cut, so that any number within bounds ends a run.
const SHORTEST_RATIO: f64 = 1e-3;
/// Phase of the elastic shaft's swing that a segment covers at most.
const LONGEST_SWING_RAD: f64 = 0.05;
/// Share of the elastic shaft's time of decay that a segment covers at most.
const LONGEST_DECAY: f64 = 0.2;

/// A power of a number that is not negative; the usual ones without a logarithm.
#[inline]
fn power(base: f64, exponent: f64) -> f64 {
    if exponent == 2.0 {
        base * base
    } else if exponent == 1.0 {
        base
    } else if exponent == 0.5 {
        sqrt(base)
    } else if exponent == 1.5 {
        base * sqrt(base)
    } else if exponent == 2.5 {
        base * base * sqrt(base)
    } else {
        pow(base, exponent)
    }
}

/// A first-order lag over a tick; without lag the input itself.
fn lagging(before: f64, input: f64, lag_s: f64, tick_s: f64) -> f64 {
    if lag_s > 0.0 { input + (before - input) * exp(-tick_s / lag_s) } else { input }
}

impl Commutation {
    const NONE: Self = Self {
        wave: Waveform { flat_loss_rad: 0.0, fifth: 0.0, seventh: 0.0 },
        offset_rad: 0.0,
        dip_ratio: 0.0,
        dip_s: 1.0,
        since_s: f64::MAX,
        shaped: false,
    };
}

/// The machine's numbers with what effects make of them: gains, limit, torque constant.
pub(crate) fn reshaped(actuator: &Actuator, effects: &[Effect]) -> Actuator {
    let mut changed = *actuator;
    for effect in effects {
        let v = effect.values;
        match effect.id() {
            EffectId::MagnetLoss => changed.motor.back_emf_v_s_per_rad *= 1.0 - v[0],
            EffectId::ControllerMismatch => {
                let c = &mut changed.controller;
                c.position_gain_per_s *= 1.0 + v[0];
                c.speed_gain_a_s_per_rad *= 1.0 + v[1];
                c.speed_integral_a_per_rad *= 1.0 + v[2];
                c.current_limit_a *= 1.0 + v[3];
            }
            _ => {}
        }
    }
    changed
}
