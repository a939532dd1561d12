//! A number of each of several runs that go side by side.

/// A number of each lane.
pub(crate) type Wide<const N: usize> = [f64; N];

/// A value of each of the items, a lane each. The last item fills the lanes that are left, so that
/// nothing there is out of the ordinary; without items all are the default.
pub(crate) fn of_each<const N: usize, T, U: Default>(items: &[T], has: impl Fn(&T) -> U) -> [U; N] {
    core::array::from_fn(|lane| items.get(lane).or(items.last()).map_or_else(U::default, &has))
}
