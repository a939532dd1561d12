//! Steps of sensors and converters.

/// The nearest multiple of a step; the value itself without one.
#[inline]
pub(crate) fn quantised(value: f64, step: f64) -> f64 {
    if step > 0.0 { nearest(value, step) } else { value }
}

/// The nearest multiple of a step, without a branch and with the bits of [`quantised`].
#[inline(always)]
#[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
pub(crate) fn quantised_in_lane(value: f64, step: f64) -> f64 {
    let nearest = step * (value / step + 0.5).floor();
    if step > 0.0 { nearest } else { value }
}

fn nearest(value: f64, step: f64) -> f64 {
    step * libm::floor(value / step + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantised_is_the_nearest_step() {
        assert_eq!(quantised(0.26, 0.1), 0.1 * 3.0);
        assert_eq!(quantised(-0.24, 0.1), 0.1 * -2.0);
        assert_eq!(quantised(0.26, 0.0), 0.26);
        for (value, step) in [(0.26, 0.1), (-0.24, 0.1), (0.26, 0.0), (-1e300, 1e-9), (-0.0, 0.5)] {
            assert_eq!(
                quantised(value, step).to_bits(),
                quantised_in_lane(value, step).to_bits(),
                "{value} {step}"
            );
        }
    }
}
