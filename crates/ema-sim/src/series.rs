//! Short Taylor series in time, the steps of the event-to-event integration.

/// `c_0 + c_1·t + … + c_4·t⁴`.
pub(crate) type Series = [f64; 5];

/// `1/m` for m = 1 to 4.
pub(crate) const RECIPROCALS: [f64; 4] = [1.0, 0.5, 1.0 / 3.0, 0.25];

/// Value at a time.
#[inline]
pub(crate) fn value(c: &Series, t: f64) -> f64 {
    // Estrin's grouping: half the depth of Horner's
    let square = t * t;
    (c[0] + c[1] * t) + square * ((c[2] + c[3] * t) + square * c[4])
}

/// Value at a time of a series that starts at zero.
#[inline]
pub(crate) fn value_from_zero(c: &Series, t: f64) -> f64 {
    let square = t * t;
    c[1] * t + square * ((c[2] + c[3] * t) + square * c[4])
}

/// A series less a constant.
#[inline]
pub(crate) fn less(series: &Series, by: f64) -> Series {
    let mut shifted = *series;
    shifted[0] -= by;
    shifted
}

/// First root in `(0, span]` of a series that changes sign there.
///
/// A series that starts at zero is divided by `t` first, so that its start does not count.
/// Safeguarded Newton, to rounding.
#[cold]
pub(crate) fn root(c: &Series, span: f64) -> f64 {
    let shifted;
    let c = if c[0] == 0.0 {
        shifted = [c[1], c[2], c[3], c[4], 0.0];
        &shifted
    } else {
        c
    };
    let (mut low, mut high) = (0.0, span);
    let start_positive = c[0] > 0.0;
    let mut t = span * (c[0] / (c[0] - value(c, span))).clamp(0.0, 1.0);
    for _ in 0..60 {
        let f = value(c, t);
        if f == 0.0 {
            break;
        }
        if (f > 0.0) == start_positive {
            low = t;
        } else {
            high = t;
        }
        let slope = ((4.0 * c[4] * t + 3.0 * c[3]) * t + 2.0 * c[2]) * t + c[1];
        let newton = t - f / slope;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        let step = (next - t).abs();
        t = next;
        // Newton's next step would be about the square of this one
        if step <= 1e-8 * span {
            break;
        }
    }
    t
}

/// When a turn that starts at zero has come past an angle; at once where that is zero.
#[cold]
pub(crate) fn reach(turn: &Series, by_rad: f64, span: f64) -> f64 {
    if by_rad == 0.0 { 0.0 } else { root(&less(turn, by_rad), span) }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;

    /// Rounding of a root within a span of one.
    const ROUNDING: f64 = 1e-15;

    #[test]
    fn root_of_a_cubic() {
        // (t − 0.3)·(t + 1)·(t + 2)
        let c = [-0.6, 1.1, 2.7, 1.0, 0.0];
        assert_abs_diff_eq!(root(&c, 1.0), 0.3, epsilon = ROUNDING);
    }

    #[test]
    fn a_zero_at_the_start_does_not_count() {
        // t·(0.25 − t)
        let c = [0.0, 0.25, -1.0, 0.0, 0.0];
        assert_abs_diff_eq!(root(&c, 1.0), 0.25, epsilon = ROUNDING);
    }
}
