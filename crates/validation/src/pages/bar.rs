//! Words for what is asked of a figure.

/// Says whether what is asked for was found.
pub(super) fn met(is_met: bool) -> &'static str {
    if is_met { "met" } else { "**missed**" }
}
