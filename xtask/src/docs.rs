//! Reference pages that are generated from the code.

use std::{fs, path::Path};

use anyhow::{Context, Result, bail};

use crate::picture;

/// A generated page: where it is and what makes it.
type Page = (&'static str, fn() -> String);

/// Every generated page.
const PAGES: &[Page] =
    &[("docs/cli.md", fdi_cli::reference), ("docs/config.md", fdi_cli::config_reference)];

/// Rebuilds the pages and the drawings of the workspace, or with `check` compares them.
pub(crate) fn run(root: &Path, check: bool) -> Result<()> {
    for (page, text) in PAGES {
        write_or_compare(root, page, &text(), check)?;
    }
    for (name, svg) in picture::drawings(root)? {
        write_or_compare(root, &format!("docs/figures/{name}"), &svg, check)?;
    }
    Ok(())
}

fn write_or_compare(root: &Path, page: &str, text: &str, check: bool) -> Result<()> {
    let path = root.join(page);
    if !check {
        fs::create_dir_all(path.parent().expect("pages are in folders"))?;
        fs::write(&path, text)?;
    } else if fs::read_to_string(&path).with_context(|| page.to_owned())? != text {
        bail!("{page} is not what `cargo xtask docs` makes");
    }
    Ok(())
}
