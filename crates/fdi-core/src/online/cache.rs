//! Results that are kept for the next recording, under keys that say all that they depend on.

use std::{
    collections::BTreeMap,
    fmt,
    sync::{Arc, Mutex, MutexGuard},
};

use crate::online::noise_grid::{LevelKey, NoiseLevel};

/// Values by key, each made when first asked for.
///
/// Threads that ask for one key wait for the first of them; other keys are not held up.
pub(crate) struct Kept<K, V> {
    slots: Mutex<Slots<K, V>>,
    most: usize,
}

/// Place of a value that may still have to be made.
type Slot<V> = Mutex<Option<V>>;

/// Places by key, each with the turn in which it was asked for last.
struct Slots<K, V> {
    by_key: BTreeMap<K, (u64, Arc<Slot<V>>)>,
    turn: u64,
}

impl<K: Copy + Ord, V: Clone> Kept<K, V> {
    /// Room for a number of values; one more, and that is forgotten which was not asked for longest.
    pub(crate) fn at_most(most: usize) -> Self {
        Self { slots: Mutex::new(Slots { by_key: BTreeMap::new(), turn: 0 }), most }
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
        let Slots { by_key, turn } = &mut *slots;
        if by_key.len() >= self.most
            && !by_key.contains_key(&key)
            && let Some(oldest) = by_key.iter().min_by_key(|(_, (turn, _))| *turn).map(|(k, _)| *k)
        {
            by_key.remove(&oldest);
        }
        *turn += 1;
        let (last, slot) = by_key.entry(key).or_default();
        *last = *turn;
        Arc::clone(slot)
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
    /// Model of the reference signal itself.
    Signal,
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

/// Noise of the sensors: the level of the grid and the rate of the phase samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct NoiseKey {
    level: LevelKey,
    rate: RateKey,
}

impl NoiseKey {
    pub(crate) fn new(phase_rate_hz: f64, level: NoiseLevel) -> Self {
        Self { level: level.key(), rate: RateKey::new(phase_rate_hz) }
    }
}

/// Covariance of a residual: the learnt error and the noise of the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct LikelihoodKey {
    error: ErrorId,
    noise: NoiseKey,
}

impl LikelihoodKey {
    pub(crate) fn new(error: ErrorId, phase_rate_hz: f64, level: NoiseLevel) -> Self {
        Self { error, noise: NoiseKey::new(phase_rate_hz, level) }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn a_value_is_made_once_and_the_one_not_asked_for_longest_is_forgotten() {
        let kept = Kept::at_most(2);
        let mut made = Vec::new();
        for key in [1, 2, 1, 3, 1, 2, 2] {
            let Ok(value) = kept.get(key, || {
                made.push(key);
                Ok::<_, Infallible>(10 * key)
            });
            assert_eq!(value, 10 * key);
        }
        assert_eq!(made, [1, 2, 3, 2]);
    }

    #[test]
    fn a_failure_is_not_kept() {
        let kept = Kept::at_most(1);
        assert_eq!(kept.get(0, || Err::<u8, _>("no")), Err("no"));
        assert_eq!(kept.get(0, || Ok::<_, &str>(7)), Ok(7));
        assert_eq!(kept.get(0, || Err("no")), Ok(7));
    }
}
