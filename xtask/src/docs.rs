//! Reference pages that are generated from the code.

use std::{fs, path::Path};

use anyhow::{Context, Result, bail};

/// A generated page: where it is and what makes it.
type Page = (&'static str, fn() -> String);

/// Every generated page.
const PAGES: &[Page] =
    &[("docs/cli.md", fdi_cli::reference), ("docs/config.md", fdi_cli::config_reference)];

/// Rebuilds the pages, or with `check` compares them.
pub(crate) fn run(root: &Path, check: bool) -> Result<()> {
    for (page, text) in PAGES {
        let path = root.join(page);
        if !check {
            fs::create_dir_all(path.parent().expect("pages are in folders"))?;
            fs::write(&path, text())?;
        } else if fs::read_to_string(&path).with_context(|| (*page).to_owned())? != text() {
            bail!("{page} is not what `cargo xtask docs` makes");
        }
    }
    Ok(())
}
