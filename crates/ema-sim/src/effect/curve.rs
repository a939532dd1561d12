//! A measured curve: the effect of which only its values are known.

/// Coordinate of a measured curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Coordinate {
    /// Angle of the rotor, repeated every turn; of a linear axis its position, not repeated.
    MotorAngle,
    /// Speed of the motor or axis.
    Speed,
    /// Position of the surface or axis.
    Position,
    /// Time from the start.
    Time,
}

impl Coordinate {
    /// All coordinates with their names in model files.
    pub const ALL: [(&'static str, Self); 4] = [
        ("motor-angle", Self::MotorAngle),
        ("speed", Self::Speed),
        ("position", Self::Position),
        ("time", Self::Time),
    ];
}

/// How the values of a curve act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CurveKind {
    /// Against positive motion, whichever way the machine moves.
    Torque,
    /// Against the motion: dry friction, whichever way the machine moves.
    Friction,
}

impl CurveKind {
    /// All kinds with their names in model files.
    pub const ALL: [(&'static str, Self); 2] =
        [("torque", Self::Torque), ("friction", Self::Friction)];
}

/// A measured torque or force over a coordinate: straight between points, constant beyond them;
/// over the rotor's angle repeated every turn.
///
/// # Examples
///
/// ```
/// use ema_sim::{Coordinate, Curve, CurveKind};
///
/// let curve = Curve::new(Coordinate::Speed, CurveKind::Torque, vec![[-1.0, 0.2], [1.0, 0.4]])?;
/// assert!((curve.at(0.5) - 0.35).abs() < 1e-15);
/// # Ok::<_, ema_sim::CurveError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    over: Coordinate,
    kind: CurveKind,
    points: Vec<[f64; 2]>,
}

/// Points that make no curve.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CurveError {
    /// At least one point is needed.
    #[error("a curve needs at least one point")]
    Empty,
    /// A coordinate is not above the one before it, or a number is not finite.
    #[error("point {place} of a curve is not finite or not beyond the one before it")]
    Order {
        /// Which point, from 0.
        place: usize,
    },
}

impl Curve {
    /// A curve through points of coordinate and value, in SI units.
    ///
    /// # Errors
    ///
    /// [`CurveError`] without points, or where the coordinates do not rise.
    pub fn new(
        over: Coordinate,
        kind: CurveKind,
        points: Vec<[f64; 2]>,
    ) -> Result<Self, CurveError> {
        if points.is_empty() {
            return Err(CurveError::Empty);
        }
        let mut before = f64::NEG_INFINITY;
        for (place, [x, y]) in points.iter().enumerate() {
            if !x.is_finite() || !y.is_finite() || *x <= before {
                return Err(CurveError::Order { place });
            }
            before = *x;
        }
        Ok(Self { over, kind, points })
    }

    /// Coordinate that it runs over.
    pub fn over(&self) -> Coordinate {
        self.over
    }

    /// How it acts.
    pub fn kind(&self) -> CurveKind {
        self.kind
    }

    /// Points of coordinate and value.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The value at a coordinate.
    pub fn at(&self, x: f64) -> f64 {
        let above = self.points.partition_point(|point| point[0] <= x);
        match (above.checked_sub(1).map(|n| self.points[n]), self.points.get(above)) {
            (Some([x0, y0]), Some([x1, y1])) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
            (Some([_, y]), None) => y,
            (None, Some([_, y])) => *y,
            (None, None) => 0.0,
        }
    }

    /// The value at a rotor angle, repeated every turn from the first point on.
    pub(crate) fn around(&self, angle_rad: f64) -> f64 {
        use core::f64::consts::TAU;
        let ([first, start], [last, end]) = (self.points[0], self.points[self.points.len() - 1]);
        let turns = libm::floor((angle_rad - first) / TAU);
        let x = angle_rad - turns * TAU;
        if x > last && last < first + TAU {
            return end + (start - end) * (x - last) / (first + TAU - last);
        }
        self.at(x)
    }

    /// Least distance between points.
    pub(crate) fn spacing(&self) -> f64 {
        self.points.windows(2).map(|pair| pair[1][0] - pair[0][0]).fold(f64::INFINITY, f64::min)
    }

    /// True for a torque that can act with the motion, at a scale.
    pub(crate) fn can_feed(&self, scale: f64) -> bool {
        if self.kind != CurveKind::Torque || scale == 0.0 || self.is_zero() {
            return false;
        }
        let with_motion = |x: f64| scale * self.at(x) * x < 0.0;
        self.over != Coordinate::Speed
            || self.at(0.0) != 0.0
            || self.points.iter().any(|point| with_motion(point[0]))
            || [-1.0, 1.0].iter().any(|sign| with_motion(sign * f64::MAX.sqrt()))
    }

    /// Largest value of either sign.
    pub(crate) fn largest(&self) -> f64 {
        self.points.iter().fold(0.0_f64, |most, point| most.max(point[1].abs()))
    }

    /// True where every value is zero.
    pub(crate) fn is_zero(&self) -> bool {
        self.points.iter().all(|point| point[1] == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use core::f64::consts::TAU;

    /// Rounding of a turn taken off an angle, over the curve's slope.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn a_curve_over_the_turn_closes() {
        let points = vec![[0.0, 0.0], [1.0, 2.0], [5.0, -1.0]];
        let curve = Curve::new(Coordinate::MotorAngle, CurveKind::Torque, points).unwrap();
        for turn in -2..3 {
            let x = f64::from(turn) * TAU;
            assert_abs_diff_eq!(curve.around(x + 0.5), 1.0, epsilon = ROUNDING);
            let between = 5.0 + 0.5 * (TAU - 5.0);
            assert_abs_diff_eq!(curve.around(x + between), -0.5, epsilon = ROUNDING);
        }
    }

    #[test]
    fn points_out_of_order_are_refused() {
        let made = |points| Curve::new(Coordinate::Speed, CurveKind::Torque, points);
        assert_eq!(made(Vec::new()), Err(CurveError::Empty));
        assert_eq!(made(vec![[0.0, 1.0], [0.0, 1.0]]), Err(CurveError::Order { place: 1 }));
        assert_eq!(made(vec![[f64::NAN, 1.0]]), Err(CurveError::Order { place: 0 }));
    }
}
