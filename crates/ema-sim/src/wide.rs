//! A number of each of several runs that go side by side.

/// A number of each lane.
pub(crate) type Wide<const N: usize> = [f64; N];

/// What each of the items has; the last one fills what is left of the lanes, so that nothing there
/// is out of the ordinary. The default without items.
pub(crate) fn of_each<const N: usize, T, U: Default>(items: &[T], has: impl Fn(&T) -> U) -> [U; N] {
    core::array::from_fn(|lane| items.get(lane).or(items.last()).map_or_else(U::default, &has))
}
