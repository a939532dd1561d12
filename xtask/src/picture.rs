//! Drawings of the workspace and its models, made from the code.

mod actuator;
mod crates;
mod svg;
mod way;

use std::path::Path;

use anyhow::Result;

/// File names below `docs/figures`, with the drawings.
pub(crate) fn drawings(root: &Path) -> Result<Vec<(&'static str, String)>> {
    Ok(vec![
        ("actuator.svg", actuator::drawing(root)?),
        ("crates.svg", crates::drawing(root)?),
        ("way-of-a-recording.svg", way::drawing(root)?),
    ])
}
