//! Drawings of the workspace for `docs/ARCHITECTURE.md`, made from the code.

mod crates;
mod svg;
mod way;

use std::path::Path;

use anyhow::Result;

/// File names below `docs/figures`, with the drawings.
pub(crate) fn drawings(root: &Path) -> Result<Vec<(&'static str, String)>> {
    Ok(vec![
        ("crates.svg", crates::drawing(root)?),
        ("way-of-a-recording.svg", way::drawing(root)?),
    ])
}
