//! Friction and torque that effects add to the moving shaft.

/// State of the machine in the middle of a segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    pub(crate) motor_rad: f64,
    pub(crate) speed_rad_per_s: f64,
    /// Position of the surface, without the errors of gear and sensor.
    pub(crate) position_rad: f64,
    /// Time from the start of the test.
    pub(crate) time_s: f64,
    /// Torque of the motor at the start of the segment.
    pub(crate) motor_n_m: f64,
    /// Load that the shaft carries, on the motor side of a gear without losses.
    pub(crate) load_n_m: f64,
    /// Reciprocal of the gear ratio.
    pub(crate) per_gear_ratio: f64,
    /// Time since the motor has commutated last.
    pub(crate) since_commutation_s: f64,
}

/// Sum of what effects add to the moving shaft.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShaftLoad {
    /// Torque against positive motion, whichever way the shaft moves.
    pub(crate) against_n_m: f64,
    /// Factor on the machine's own dry friction.
    pub(crate) friction_ratio: f64,
    /// Dry friction added, backward and forward, each kinetic and static.
    pub(crate) dry_n_m: [[f64; 2]; 2],
}

impl ShaftLoad {
    /// The load without effects, with the machine's own torque.
    #[inline]
    pub(crate) fn new(against_n_m: f64) -> Self {
        Self { against_n_m, friction_ratio: 1.0, dry_n_m: [[0.0; 2]; 2] }
    }

    /// Adds dry friction, kinetic and static, in both directions.
    #[inline]
    pub(crate) fn rub(&mut self, n_m: f64) {
        self.dry_n_m = self.dry_n_m.map(|pair| pair.map(|t| t + n_m));
    }

    /// Adds kinetic friction in both directions.
    #[inline]
    pub(crate) fn rub_in_motion(&mut self, n_m: f64) {
        self.dry_n_m[0][0] += n_m;
        self.dry_n_m[1][0] += n_m;
    }

    /// Adds dry friction forward and takes it away backward.
    #[inline]
    pub(crate) fn rub_forward(&mut self, n_m: f64) {
        self.dry_n_m[0] = self.dry_n_m[0].map(|t| t - n_m);
        self.dry_n_m[1] = self.dry_n_m[1].map(|t| t + n_m);
    }
}

/// State of a shaft at which an effect is asked for its torque; of a linear axis m, m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftMoment {
    /// Position, rad.
    pub position: f64,
    /// Speed, rad/s.
    pub speed: f64,
    /// Time from the start of the test, s.
    pub time_s: f64,
}

/// Torque that an effect adds on a shaft that moves; N·m, of a linear axis N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftTorque {
    /// Torque against positive motion, whichever way the shaft moves.
    pub against: f64,
    /// Kinetic dry friction, backward and forward.
    pub dry: [f64; 2],
}
