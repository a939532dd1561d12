//! Signals shifted in time.

/// A signal some time later, straight between samples and constant beyond its ends.
pub(super) fn shifted(signal: &[f64], rate_hz: f64, later_s: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let shift = later_s * rate_hz;
    let at = |n: usize| {
        let place = (n as f64 - shift).clamp(0.0, last as f64);
        let before = place as usize;
        let next = signal[(before + 1).min(last)];
        signal[before] + (next - signal[before]) * (place - before as f64)
    };
    (0..signal.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_moves_a_signal_by_parts_of_a_sample() {
        let ramp: Vec<f64> = (0..10).map(f64::from).collect();
        let later = shifted(&ramp, 1000.0, 2.5e-3);
        assert_eq!((later[0], later[5], later[9]), (0.0, 2.5, 6.5));
        assert_eq!(shifted(&ramp, 1000.0, -1e-3)[3], 4.0);
    }
}
