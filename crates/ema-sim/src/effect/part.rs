//! Parts with a state that effects put into a machine, and the length of segments that they ask
//! for.

pub(crate) mod bristles;
pub(crate) mod commutation;
pub(crate) mod delay;
pub(crate) mod elastic_shaft;
pub(crate) mod sensor;
pub(crate) mod winding;

use crate::effect::part::{
    bristles::Bristles,
    commutation::CommutationErrors,
    delay::Delay,
    elastic_shaft::ElasticShaft,
    sensor::{CurrentSensor, PositionSensor, PositionWave},
    winding::WindingEffects,
};

/// Phase of a periodic effect that a segment covers at most; the midpoint rule's error in a
/// sine is then below a thousandth of it.
pub(crate) const LONGEST_PHASE_RAD: f64 = 0.15;
/// Share of a tick below which no segment is cut, so that any number within bounds ends a run.
pub(crate) const SHORTEST_RATIO: f64 = 1e-3;
/// Order or rate below which an effect bounds no segment.
const SLOWEST: f64 = 1e-9;

/// Numbers of the machine that effects need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MachineNumbers {
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

/// Parts that effects have put into a machine.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    pub(crate) machine: MachineNumbers,
    /// Kinetic and static friction of the machine without effects.
    pub(crate) friction_n_m: [f64; 2],
    /// Longest segment, and its longest turn.
    pub(crate) longest_s: f64,
    pub(crate) longest_rad: f64,
    pub(crate) bristles: Option<Bristles>,
    pub(crate) elastic_shaft: Option<ElasticShaft>,
    /// Inertia that stays on the motor's shaft when an elastic one takes the surface off it.
    pub(crate) motor_inertia_kg_m2: f64,
    /// Errors of the gear's ratio.
    pub(crate) position_waves: Vec<PositionWave>,
    /// Relative loss of the torque constant over the square of the current, of each effect.
    pub(crate) saturations_per_a2: Vec<f64>,
    pub(crate) winding: WindingEffects,
    pub(crate) commutation: Option<CommutationErrors>,
    pub(crate) current_sensor: Option<CurrentSensor>,
    pub(crate) position_sensor: Option<PositionSensor>,
    pub(crate) delay: Option<Delay>,
}

impl Parts {
    /// No parts yet, in a machine with kinetic and static friction.
    pub(crate) fn none(machine: &MachineNumbers, friction_n_m: [f64; 2]) -> Self {
        Self {
            machine: *machine,
            friction_n_m,
            longest_s: machine.tick_s,
            longest_rad: f64::INFINITY,
            bristles: None,
            elastic_shaft: None,
            motor_inertia_kg_m2: machine.inertia_kg_m2,
            position_waves: Vec::new(),
            saturations_per_a2: Vec::new(),
            winding: WindingEffects::default(),
            commutation: None,
            current_sensor: None,
            position_sensor: None,
            delay: None,
        }
    }

    /// Bounds the length of segments.
    pub(crate) fn bound_span_s(&mut self, longest_s: f64) {
        self.longest_s = self.longest_s.min(longest_s);
    }

    /// Bounds the motor's turn in a segment.
    pub(crate) fn bound_turn_rad(&mut self, longest_rad: f64) {
        self.longest_rad = self.longest_rad.min(longest_rad);
    }

    /// Bounds the motor's turn so that a wave of an order is resolved.
    pub(crate) fn resolve_order(&mut self, order: f64) {
        self.bound_turn_rad(LONGEST_PHASE_RAD / order.max(SLOWEST));
    }

    /// Bounds the length of segments so that a wave of a frequency, rad/s, is resolved.
    pub(crate) fn resolve_frequency(&mut self, rad_per_s: f64) {
        self.bound_span_s(LONGEST_PHASE_RAD / rad_per_s.max(SLOWEST));
    }

    /// The errors of commutation and back-EMF, to be changed.
    pub(crate) fn commutation_errors(&mut self) -> &mut CommutationErrors {
        self.commutation.get_or_insert(CommutationErrors::NONE)
    }

    /// Cuts segments to a share of their length.
    pub(crate) fn refine(&mut self, ratio: f64) {
        self.longest_s *= ratio;
        self.longest_rad *= ratio;
        if let Some(bristles) = &mut self.bristles {
            bristles.longest_s *= ratio;
            bristles.longest_rad *= ratio;
        }
    }
}
