//! Numbers that several owners read.

use std::{fmt, ops::Deref, sync::Arc};

/// Numbers that are shared and never change: a vector, or what another owner holds.
///
/// Channels keep their samples in it, so that an array of another program or language becomes a
/// channel without a copy.
///
/// ```
/// use recordings::SharedNumbers;
///
/// let numbers = SharedNumbers::from(vec![1.0, 2.0]);
/// assert_eq!(numbers.clone().as_ptr(), numbers.as_ptr());
/// ```
#[derive(Clone)]
pub struct SharedNumbers(Arc<dyn AsRef<[f64]> + Send + Sync>);

impl SharedNumbers {
    /// Numbers of an owner that keeps them where and as they are.
    pub fn of(owner: impl AsRef<[f64]> + Send + Sync + 'static) -> Self {
        Self(Arc::new(owner))
    }
}

impl From<Vec<f64>> for SharedNumbers {
    fn from(numbers: Vec<f64>) -> Self {
        Self::of(numbers)
    }
}

impl From<&[f64]> for SharedNumbers {
    fn from(numbers: &[f64]) -> Self {
        Self::of(numbers.to_vec())
    }
}

impl FromIterator<f64> for SharedNumbers {
    fn from_iter<I: IntoIterator<Item = f64>>(numbers: I) -> Self {
        numbers.into_iter().collect::<Vec<f64>>().into()
    }
}

impl Deref for SharedNumbers {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        (*self.0).as_ref()
    }
}

impl PartialEq for SharedNumbers {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

impl fmt::Debug for SharedNumbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self[..].fmt(f)
    }
}
