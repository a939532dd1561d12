//! Short Taylor series in time, the steps of the event-to-event integration.

/// Coefficients kept: a polynomial of degree four.
pub(crate) const TERMS: usize = 5;

/// `c_0 + c_1·t + … + c_4·t⁴`.
pub(crate) type Series = [f64; TERMS];

/// Value at a time.
#[inline]
pub(crate) fn value(c: &Series, t: f64) -> f64 {
    (((c[4] * t + c[3]) * t + c[2]) * t + c[1]) * t + c[0]
}

/// First root in `(0, span]` of a series that changes sign there.
///
/// A series that starts at zero is divided by `t` first, so that its start does not count.
/// Safeguarded Newton; to the last bits of `span`.
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
        if (next - t).abs() <= 1e-15 * span {
            t = next;
            break;
        }
        t = next;
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn root_of_a_cubic() {
        // (t − 0.3)·(t + 1)·(t + 2)
        let c = [-0.6, 1.1, 2.7, 1.0, 0.0];
        assert!((root(&c, 1.0) - 0.3).abs() < 1e-15);
    }

    #[test]
    fn a_zero_at_the_start_does_not_count() {
        // t·(0.25 − t)
        let c = [0.0, 0.25, -1.0, 0.0, 0.0];
        assert!((root(&c, 1.0) - 0.25).abs() < 1e-15);
    }
}
