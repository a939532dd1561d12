//! Steps of sensors and converters.

/// The nearest multiple of a step; the value itself without one.
#[inline]
pub(crate) fn quantised(value: f64, step: f64) -> f64 {
    if step > 0.0 { nearest(value, step) } else { value }
}

#[cold]
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
    }
}
