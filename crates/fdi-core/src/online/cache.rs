//! Results that are kept for the next recording, under keys that say all that they depend on.

use std::{
    collections::BTreeMap,
    fmt,
    sync::{Arc, Mutex, MutexGuard},
};

/// Values by key, each made when first asked for.
///
/// Threads that ask for one key wait for the first of them; other keys are not held up.
pub(crate) struct Kept<K, V> {
    slots: Mutex<BTreeMap<K, Arc<Slot<V>>>>,
    most: usize,
}

/// Place of a value that may still have to be made.
type Slot<V> = Mutex<Option<V>>;

impl<K: Copy + Ord, V: Clone> Kept<K, V> {
    /// Room for a number of values; one more and the others are forgotten.
    pub(crate) fn at_most(most: usize) -> Self {
        Self { slots: Mutex::new(BTreeMap::new()), most }
    }

    /// Value of a key, made where it is not kept.
    ///
    /// # Errors
    ///
    /// The errors of `make`; nothing is kept then.
    pub(crate) fn get<E>(&self, key: K, make: impl FnOnce() -> Result<V, E>) -> Result<V, E> {
        let slot = self.slot(key);
        let mut value = locked(&slot);
        if let Some(value) = &*value {
            return Ok(value.clone());
        }
        let made = make()?;
        *value = Some(made.clone());
        Ok(made)
    }

    /// Takes a value for a key in place of what would be made.
    pub(crate) fn put(&self, key: K, value: V) {
        *locked(&self.slot(key)) = Some(value);
    }

    fn slot(&self, key: K) -> Arc<Slot<V>> {
        let mut slots = locked(&self.slots);
        if slots.len() >= self.most && !slots.contains_key(&key) {
            slots.clear();
        }
        Arc::clone(slots.entry(key).or_default())
    }
}

impl<K, V> fmt::Debug for Kept<K, V> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Kept").field("most", &self.most).finish_non_exhaustive()
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().expect("no thread panics while it makes a kept value")
}

/// Learnt error that a likelihood is formed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ErrorId {
    /// Low-fidelity model, start angle of the bundle.
    Incipient,
    /// Low-fidelity model, any start angle.
    Turned,
    /// High-fidelity model, start angle of the bundle.
    HighOwnStart,
    /// High-fidelity model, any start angle.
    HighAnyStart,
}

/// Rate of the phase samples, by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RateKey {
    phase_rate_bits: u64,
}

impl RateKey {
    pub(crate) fn new(phase_rate_hz: f64) -> Self {
        Self { phase_rate_bits: phase_rate_hz.to_bits() }
    }
}

/// Noise of the sensors: its level and the rate of the phase samples, by their bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct NoiseKey {
    noise_bits: u64,
    rate: RateKey,
}

impl NoiseKey {
    pub(crate) fn new(phase_rate_hz: f64, noise_a: f64) -> Self {
        Self { noise_bits: noise_a.to_bits(), rate: RateKey::new(phase_rate_hz) }
    }
}

/// Covariance of a residual: the learnt error and the noise of the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LikelihoodKey {
    error: ErrorId,
    noise: NoiseKey,
}

impl LikelihoodKey {
    pub(crate) fn new(error: ErrorId, phase_rate_hz: f64, noise_a: f64) -> Self {
        Self { error, noise: NoiseKey::new(phase_rate_hz, noise_a) }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn a_value_is_made_once_and_forgotten_when_there_are_too_many() {
        let kept = Kept::at_most(2);
        let mut made = 0;
        for key in [1, 2, 1, 2, 3, 3, 1] {
            let Ok(value) = kept.get(key, || {
                made += 1;
                Ok::<_, Infallible>(10 * key)
            });
            assert_eq!(value, 10 * key);
        }
        assert_eq!(made, 4);
    }

    #[test]
    fn a_failure_is_not_kept() {
        let kept = Kept::at_most(1);
        assert_eq!(kept.get(0, || Err::<u8, _>("no")), Err("no"));
        assert_eq!(kept.get(0, || Ok::<_, &str>(7)), Ok(7));
        assert_eq!(kept.get(0, || Err("no")), Ok(7));
    }

    #[test]
    fn levels_that_differ_in_their_last_bit_are_kept_apart() {
        let key = |noise_a: f64| LikelihoodKey::new(ErrorId::Turned, 10e3, noise_a);
        assert_eq!(key(0.02), key(0.02));
        assert_ne!(key(0.02), key(0.02f64.next_up()));
    }
}
