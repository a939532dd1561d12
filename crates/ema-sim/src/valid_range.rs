//! Where an effect is known to hold, and where a simulation has been.

use crate::{
    effect::Geometry,
    servo_axis::AxisTrace,
    trace::{HighFidelityTrace, LowFidelityTrace},
};

/// Quantity of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RangeOf {
    /// Speed of the motor, of a servo axis its own.
    Speed,
    /// Position of the surface, of a servo axis its own.
    Position,
    /// Load on the surface or axis, positive against positive motion.
    Load,
}

impl RangeOf {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Speed, Self::Position, Self::Load];

    /// Key in the `valid-range` of a model file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Position => "position",
            Self::Load => "load",
        }
    }

    /// Unit in a machine that turns or slides.
    pub fn unit(self, geometry: Geometry) -> &'static str {
        match (self, geometry) {
            (Self::Speed, Geometry::Rotary) => "rad/s",
            (Self::Speed, Geometry::Linear) => "m/s",
            (Self::Position, Geometry::Rotary) => "rad",
            (Self::Position, Geometry::Linear) => "m",
            (Self::Load, Geometry::Rotary) => "N·m",
            (Self::Load, Geometry::Linear) => "N",
        }
    }
}

/// Least and largest value, SI; `None` where nothing is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ValidRange {
    /// Range of the motor's speed.
    pub speed: Option<[f64; 2]>,
    /// Range of the surface's position.
    pub position: Option<[f64; 2]>,
    /// Range of the load.
    pub load: Option<[f64; 2]>,
}

/// Least and largest value in a simulation, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisitedRange {
    /// Range of the motor's speed.
    pub speed: [f64; 2],
    /// Range of the surface's position.
    pub position: [f64; 2],
    /// Range of the load.
    pub load: [f64; 2],
}

/// A simulation that went beyond what is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Departure {
    /// In what.
    pub of: RangeOf,
    /// Range that is known.
    pub valid: [f64; 2],
    /// Where it went.
    pub visited: [f64; 2],
}

impl ValidRange {
    /// The range of a quantity.
    pub fn get(&self, of: RangeOf) -> Option<[f64; 2]> {
        match of {
            RangeOf::Speed => self.speed,
            RangeOf::Position => self.position,
            RangeOf::Load => self.load,
        }
    }

    /// Ranges that a simulation left.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{RangeOf, ValidRange, VisitedRange};
    ///
    /// let known = ValidRange { speed: Some([-55.0, 55.0]), ..ValidRange::default() };
    /// let visited = VisitedRange::of(&[-20.0, 60.0], &[0.0, 0.1], 2.0);
    /// let left = known.left_by(&visited);
    /// assert_eq!((left[0].of, left[0].visited), (RangeOf::Speed, [-20.0, 60.0]));
    /// ```
    pub fn left_by(&self, visited: &VisitedRange) -> Vec<Departure> {
        let left = |of: RangeOf| {
            let (valid, visited) = (self.get(of)?, visited.get(of));
            let outside = visited[0] < valid[0] || visited[1] > valid[1];
            outside.then_some(Departure { of, valid, visited })
        };
        RangeOf::ALL.into_iter().filter_map(left).collect()
    }
}

impl VisitedRange {
    /// The ranges of two channels, under a constant load; of an empty channel zero.
    pub fn of(speed: &[f64], position: &[f64], load: f64) -> Self {
        Self { speed: range(speed), position: range(position), load: [load; 2] }
    }

    /// The range of a quantity.
    pub fn get(&self, of: RangeOf) -> [f64; 2] {
        match of {
            RangeOf::Speed => self.speed,
            RangeOf::Position => self.position,
            RangeOf::Load => self.load,
        }
    }
}

fn range(values: &[f64]) -> [f64; 2] {
    let wider = |[low, high]: [f64; 2], x: &f64| [low.min(*x), high.max(*x)];
    let first = values.first().copied().unwrap_or(0.0);
    values.iter().fold([first; 2], wider)
}

impl HighFidelityTrace {
    /// Where the machine has been, under a constant load.
    pub fn visited_range(&self, load_n_m: f64) -> VisitedRange {
        VisitedRange::of(&self.motor_speed_rad_per_s, &self.surface_angle_rad, load_n_m)
    }
}

impl LowFidelityTrace {
    /// Where the machine has been, under a constant load.
    pub fn visited_range(&self, load_n_m: f64) -> VisitedRange {
        VisitedRange::of(&self.motor_speed_rad_per_s, &self.surface_angle_rad, load_n_m)
    }
}

impl AxisTrace {
    /// Where the axis has been, under a constant load.
    pub fn visited_range(&self, load: f64) -> VisitedRange {
        VisitedRange::of(&self.speed, &self.position, load)
    }
}
