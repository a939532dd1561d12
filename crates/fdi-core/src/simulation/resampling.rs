//! Signals at other rates.

/// A signal at another rate, straight between its samples.
pub fn resampled(signal: &[f64], from_hz: f64, to_hz: f64) -> Vec<f64> {
    if from_hz == to_hz {
        return signal.to_vec();
    }
    let last = signal.len().saturating_sub(1);
    let count = (last as f64 * to_hz / from_hz).floor() as usize + 1;
    (0..count)
        .map(|n| {
            let place = (n as f64 * from_hz / to_hz).min(last as f64);
            let before = (place.floor() as usize).min(last.saturating_sub(1));
            let share = place - before as f64;
            signal[before] + share * (signal[(before + 1).min(last)] - signal[before])
        })
        .collect()
}
