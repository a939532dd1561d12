//! Files that can be read to their end.

use std::{
    fs::{self, Metadata},
    path::Path,
};

use anyhow::{Result, bail};

/// Refuses what would be waited for, or read without end.
pub(crate) fn require_file(path: &Path) -> Result<()> {
    let is_strange = |found: Metadata| !found.is_file() && !found.is_dir();
    // an empty file wherever there are devices
    let is_empty = path == Path::new("/dev/null");
    if !is_empty && fs::metadata(path).is_ok_and(is_strange) {
        bail!("`{}` is not a regular file", path.display());
    }
    Ok(())
}
