//! Motor shaft, gear, dry friction, backlash and end stops: one inertia with kinematic play.
//!
//! ```text
//! J·ω' = T_m − F_d·sgn ω − c·ω − T_l
//! θ_u  = clamp(θ_u, θ_m/i_g − b/2, θ_m/i_g + b/2)
//! ```
//!
//! The dry friction has four states: stopped and staying, stopped and breaking away, moving on,
//! moving and stopping. All are instants of the solution here, found between steps and not rounded
//! to one.
//!
//! # Source
//!
//! Borello and Dalla Vedova, IJEIT 3(8), 2014; see `docs/models/transmission.md`.

use crate::{
    fault::PhysicalFaults,
    params::Actuator,
    scenario::Scenario,
    series::{RECIPROCALS, Series, reach},
    winding::Shaft,
};

/// Which way the shaft moves; sticking is a state of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Backward,
    Stuck,
    Forward,
}

impl Direction {
    /// −1, 0 or 1.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Backward => -1.0,
            Self::Stuck => 0.0,
            Self::Forward => 1.0,
        }
    }
}

/// Where the surface of an actuator starts: neutral in a sum, down to the sign of a zero.
pub(crate) const START_RAD: f64 = -0.0;

/// Half of a play that is never crossed.
const BOUNDLESS_RAD: f64 = 1e30;

/// Which flank of the play carries the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contact {
    /// Neither: the surface stays where it was left.
    Free,
    /// The motor pushes the surface up.
    Upper,
    /// The motor pushes the surface down.
    Lower,
}

/// Torques against the moving shaft, on the motor side.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_field_names, reason = "the unit belongs to the name")]
pub(crate) struct Torques {
    /// Dry friction and what effects add.
    pub(crate) friction_n_m: f64,
    /// The load's own.
    pub(crate) load_n_m: f64,
    /// Loss of the gear under the load.
    pub(crate) gear_n_m: f64,
}

/// Dry friction of the two directions (backward, forward), and a torque against positive motion.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_field_names, reason = "the unit belongs to the name")]
pub(crate) struct FrictionState {
    pub(crate) kinetic_n_m: [f64; 2],
    pub(crate) static_n_m: [f64; 2],
    pub(crate) against_n_m: f64,
}

/// Parts that a drive train is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parts {
    pub(crate) inertia_kg_m2: f64,
    pub(crate) viscous_n_m_s_per_rad: f64,
    pub(crate) kinetic_n_m: f64,
    pub(crate) static_n_m: f64,
    /// Torque against positive motion, whichever way the shaft moves.
    pub(crate) offset_n_m: f64,
    pub(crate) gear_ratio: f64,
    /// Half of the play, on the motor side.
    pub(crate) half_play_rad: f64,
    /// Stop of the surface.
    pub(crate) stop_rad: f64,
    pub(crate) efficiency_ratio: f64,
    /// Load on the surface.
    pub(crate) load_n_m: f64,
    /// Dry friction of the surface, behind the play.
    pub(crate) surface_friction_n_m: f64,
    /// Place of the surface in the play at the start, −1 to 1.
    pub(crate) side_ratio: f64,
    pub(crate) speed_rad_per_s: f64,
}

/// State and constants of the drive train; angles on the motor side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DriveTrain {
    pub(crate) inertia_kg_m2: f64,
    pub(crate) viscous_n_m_s_per_rad: f64,
    /// `1/(m·J)`, for coefficient m = 1 to 4.
    per_inertia: [f64; 4],
    /// Friction and torque besides load and viscous drag.
    friction: FrictionState,
    /// Friction and torque without effects.
    nominal: FrictionState,
    efficiency_ratio: f64,
    per_gear_ratio: f64,
    half_play_rad: f64,
    stop_rad: f64,
    /// Load and surface friction through a gear without losses, and what the motor feels of
    /// both in either direction.
    load_n_m: f64,
    surface_friction_n_m: f64,
    load_forward_n_m: f64,
    load_backward_n_m: f64,
    /// Motor angle from its start.
    pub(crate) angle_rad: f64,
    pub(crate) speed_rad_per_s: f64,
    pub(crate) direction: Direction,
    contact: Contact,
    /// Surface angle times the gear ratio, valid while the contact is free.
    left_at_rad: f64,
}

/// A mark that a turning shaft crosses.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Crossing {
    /// The end of the sector, forward or backward.
    Sector(i64),
    /// A bound of [`DriveTrain::bounds_rad`].
    Bound,
}

impl DriveTrain {
    /// The marks crossed on the way to a motor angle, with when: the end of a sector, and a bound.
    pub(crate) fn crossings(
        &self,
        turn: &Series,
        to_rad: f64,
        sector_rad: [f64; 2],
        span_s: f64,
    ) -> impl Iterator<Item = (Crossing, f64)> {
        let passed = |(low, high): (f64, f64)| {
            if to_rad > high {
                Some((1, high))
            } else if to_rad < low {
                Some((-1, low))
            } else {
                None
            }
        };
        let when_s = |angle_rad: f64| reach(turn, angle_rad - self.angle_rad, span_s);
        let sector =
            passed(sector_rad.into()).map(|(step, at)| (Crossing::Sector(step), when_s(at)));
        let bound = passed(self.bounds_rad()).map(|(_, at)| (Crossing::Bound, when_s(at)));
        sector.into_iter().chain(bound)
    }

    /// The drive train at the start of a test.
    pub(crate) fn new(actuator: &Actuator, faults: &PhysicalFaults, scenario: &Scenario) -> Self {
        let t = &actuator.transmission;
        Self::of(&Parts {
            inertia_kg_m2: actuator.total_inertia_kg_m2(),
            viscous_n_m_s_per_rad: actuator.motor.viscous_n_m_s_per_rad,
            kinetic_n_m: t.kinetic_friction_n_m * faults.friction_ratio + scenario.brake_n_m,
            static_n_m: t.static_friction_n_m * faults.friction_ratio + scenario.brake_n_m,
            offset_n_m: 0.0,
            gear_ratio: t.gear_ratio,
            half_play_rad: 0.5 * t.backlash_rad * faults.backlash_ratio * t.gear_ratio,
            stop_rad: t.stop_rad,
            efficiency_ratio: t.efficiency_ratio,
            load_n_m: scenario.load_n_m,
            surface_friction_n_m: t.surface_friction_n_m,
            side_ratio: scenario.backlash_side_ratio,
            speed_rad_per_s: scenario.initial.motor_speed_rad_per_s,
        })
    }

    /// A drive train of parts.
    pub(crate) fn of(parts: &Parts) -> Self {
        let nominal = FrictionState {
            kinetic_n_m: [parts.kinetic_n_m; 2],
            static_n_m: [parts.static_n_m; 2],
            against_n_m: parts.offset_n_m,
        };
        let mut train = Self {
            inertia_kg_m2: parts.inertia_kg_m2,
            viscous_n_m_s_per_rad: parts.viscous_n_m_s_per_rad,
            per_inertia: RECIPROCALS.map(|r| r / parts.inertia_kg_m2),
            friction: nominal,
            nominal,
            efficiency_ratio: parts.efficiency_ratio,
            per_gear_ratio: 1.0 / parts.gear_ratio,
            half_play_rad: parts.half_play_rad,
            stop_rad: parts.stop_rad * parts.gear_ratio,
            load_n_m: 0.0,
            surface_friction_n_m: parts.surface_friction_n_m / parts.gear_ratio,
            load_forward_n_m: 0.0,
            load_backward_n_m: 0.0,
            angle_rad: 0.0,
            speed_rad_per_s: 0.0,
            direction: Direction::Stuck,
            contact: Contact::Free,
            left_at_rad: -parts.side_ratio * parts.half_play_rad,
        };
        train.reflect(parts.load_n_m / parts.gear_ratio);
        train.set_going(parts.speed_rad_per_s);
        if train.direction == Direction::Stuck {
            // a load beyond the static friction moves the shaft before any current does
            train.stand_still(0.0);
        }
        train
    }

    /// Takes a load on the motor side.
    fn reflect(&mut self, reflected_n_m: f64) {
        let (against, along) = (1.0 / self.efficiency_ratio, self.efficiency_ratio);
        self.load_n_m = reflected_n_m;
        let forward = reflected_n_m + self.surface_friction_n_m;
        let backward = reflected_n_m - self.surface_friction_n_m;
        self.load_forward_n_m = forward * if forward > 0.0 { against } else { along };
        self.load_backward_n_m = backward * if backward < 0.0 { against } else { along };
    }

    /// Takes another load on the surface.
    pub(crate) fn set_load(&mut self, load_n_m: f64) {
        self.reflect(load_n_m * self.per_gear_ratio);
    }

    /// Takes the surface off the shaft, which keeps an inertia; returns the load, on the motor
    /// side, that goes with it.
    pub(crate) fn set_free(&mut self, inertia_kg_m2: f64) -> f64 {
        let load_n_m = self.load_n_m;
        self.inertia_kg_m2 = inertia_kg_m2;
        self.per_inertia = RECIPROCALS.map(|r| r / inertia_kg_m2);
        self.reflect(0.0);
        (self.contact, self.half_play_rad, self.left_at_rad) = (Contact::Free, BOUNDLESS_RAD, 0.0);
        load_n_m
    }

    /// Kinetic and static friction without effects.
    pub(crate) fn nominal_friction_n_m(&self) -> [f64; 2] {
        [self.nominal.kinetic_n_m[1], self.nominal.static_n_m[1]]
    }

    /// Friction and torque without effects.
    pub(crate) fn nominal_friction(&self) -> FrictionState {
        self.nominal
    }

    /// Friction and torque as effects make them.
    pub(crate) fn friction(&self) -> FrictionState {
        self.friction
    }

    /// Takes on what effects make of friction and torque.
    pub(crate) fn set_friction(&mut self, friction: FrictionState) {
        self.friction = friction;
    }

    /// The load that the shaft carries now, on the motor side and through a gear without losses.
    pub(crate) fn carried_load_n_m(&self) -> f64 {
        if self.contact == Contact::Free { 0.0 } else { self.load_n_m }
    }

    /// Starts the shaft at rest with a speed.
    fn set_going(&mut self, speed_rad_per_s: f64) {
        if speed_rad_per_s != 0.0 {
            self.speed_rad_per_s = speed_rad_per_s;
            self.break_away(if speed_rad_per_s > 0.0 {
                Direction::Forward
            } else {
                Direction::Backward
            });
        }
    }

    /// Angle of the surface.
    pub(crate) fn surface_rad(&self) -> f64 {
        self.surface_rad_at(self.angle_rad)
    }

    /// Angle of the surface with the motor at another angle and the contact unchanged.
    pub(crate) fn surface_rad_at(&self, angle_rad: f64) -> f64 {
        let on_motor_side = match self.contact {
            Contact::Free => self.left_at_rad,
            Contact::Upper => angle_rad - self.half_play_rad,
            Contact::Lower => angle_rad + self.half_play_rad,
        };
        on_motor_side * self.per_gear_ratio
    }

    /// The surface as long as the contact lasts: whether it follows the motor (1 or 0), the
    /// angle to add, and the ratio that takes their sum to the surface.
    pub(crate) fn surface_line(&self) -> (f64, f64, f64) {
        let (follows, offset_rad) = match self.contact {
            Contact::Free => (0.0, self.left_at_rad),
            Contact::Upper => (1.0, -self.half_play_rad),
            Contact::Lower => (1.0, self.half_play_rad),
        };
        (follows, offset_rad, self.per_gear_ratio)
    }

    /// Torque on the moving shaft besides the motor's and the viscous one.
    pub(crate) fn external_n_m(&self) -> f64 {
        -self.direction.sign() * self.kinetic_n_m()
            - self.felt_load_n_m()
            - self.friction.against_n_m
    }

    /// Load and surface friction as the moving shaft feels them.
    pub(crate) fn felt_load_n_m(&self) -> f64 {
        match self.contact {
            Contact::Free => 0.0,
            Contact::Upper => self.load_forward_n_m,
            Contact::Lower => self.load_backward_n_m,
        }
    }

    /// Kinetic friction of the present direction.
    fn kinetic_n_m(&self) -> f64 {
        self.friction.kinetic_n_m[usize::from(self.direction != Direction::Backward)]
    }

    /// The shaft's equation in the present state.
    pub(crate) fn shaft(&self) -> Shaft {
        let rests = self.direction == Direction::Stuck;
        Shaft {
            per_inertia: if rests { [0.0; 4] } else { self.per_inertia },
            external_n_m: self.external_n_m(),
            viscous_n_m_s_per_rad: self.viscous_n_m_s_per_rad,
        }
    }

    /// Kinetic energy of the moving masses.
    pub(crate) fn kinetic_j(&self) -> f64 {
        0.5 * self.inertia_kg_m2 * self.speed_rad_per_s * self.speed_rad_per_s
    }

    /// The parts of the torque against the moving shaft.
    pub(crate) fn torques(&self) -> Torques {
        let (load_n_m, surface_n_m, whole_n_m) = match self.contact {
            Contact::Free => (0.0, 0.0, 0.0),
            Contact::Upper => (self.load_n_m, self.surface_friction_n_m, self.load_forward_n_m),
            Contact::Lower => (self.load_n_m, -self.surface_friction_n_m, self.load_backward_n_m),
        };
        Torques {
            friction_n_m: self.direction.sign() * self.kinetic_n_m()
                + self.friction.against_n_m
                + surface_n_m,
            load_n_m,
            gear_n_m: whole_n_m - load_n_m - surface_n_m,
        }
    }

    /// Motor angles, from the start, at which something changes while moving as now.
    pub(crate) fn bounds_rad(&self) -> (f64, f64) {
        let most = self.stop_rad + self.half_play_rad;
        match self.contact {
            Contact::Free => {
                (self.left_at_rad - self.half_play_rad, self.left_at_rad + self.half_play_rad)
            }
            Contact::Upper => (f64::NEG_INFINITY, most),
            Contact::Lower => (-most, f64::INFINITY),
        }
    }

    /// Motor torques between which a shaft at rest stays there.
    pub(crate) fn breakaway_n_m(&self) -> (f64, f64) {
        let [static_backward, static_forward] = self.friction.static_n_m;
        let (backward, forward) = self.holding_n_m();
        let against = self.friction.against_n_m;
        (-static_backward + backward + against, static_forward + forward + against)
    }

    /// Torques that hold a shaft at rest beside its static friction, backward and forward: the
    /// load where a flank touches, infinite at a stop.
    pub(crate) fn holding_n_m(&self) -> (f64, f64) {
        let most = self.stop_rad + self.half_play_rad;
        let (low, high) =
            (self.left_at_rad - self.half_play_rad, self.left_at_rad + self.half_play_rad);
        let forward = if self.angle_rad >= most {
            f64::INFINITY
        } else if self.angle_rad >= high {
            self.load_forward_n_m
        } else {
            0.0
        };
        let backward = if self.angle_rad <= -most {
            f64::NEG_INFINITY
        } else if self.angle_rad <= low {
            self.load_backward_n_m
        } else {
            0.0
        };
        (backward, forward)
    }

    /// The shaft has come to zero speed: the surface is left where it is, and the motor torque
    /// decides whether the shaft sticks.
    pub(crate) fn stand_still(&mut self, motor_n_m: f64) {
        self.left_at_rad = match self.contact {
            Contact::Free => self.left_at_rad,
            Contact::Upper => self.angle_rad - self.half_play_rad,
            Contact::Lower => self.angle_rad + self.half_play_rad,
        };
        self.contact = Contact::Free;
        self.speed_rad_per_s = 0.0;
        self.direction = Direction::Stuck;
        let (backward, forward) = self.breakaway_n_m();
        if motor_n_m > forward {
            self.break_away(Direction::Forward);
        } else if motor_n_m < backward {
            self.break_away(Direction::Backward);
        }
    }

    /// The shaft at rest starts to move; flanks that touch go along.
    pub(crate) fn break_away(&mut self, direction: Direction) {
        self.direction = direction;
        let (low, high) =
            (self.left_at_rad - self.half_play_rad, self.left_at_rad + self.half_play_rad);
        if direction == Direction::Forward && self.angle_rad >= high {
            self.contact = Contact::Upper;
        } else if direction == Direction::Backward && self.angle_rad <= low {
            self.contact = Contact::Lower;
        }
    }

    /// The shaft has reached a bound of [`bounds_rad`](Self::bounds_rad): the play closes, or
    /// the surface meets its stop and the shaft with it, without bouncing.
    pub(crate) fn reach_bound(&mut self, motor_n_m: f64) {
        match self.contact {
            Contact::Free if self.direction == Direction::Forward => self.contact = Contact::Upper,
            Contact::Free => self.contact = Contact::Lower,
            Contact::Upper | Contact::Lower => self.stand_still(motor_n_m),
        }
    }
}
