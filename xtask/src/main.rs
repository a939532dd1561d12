//! Development tasks of the workspace: `cargo xtask …`.

mod validate;

use anyhow::{Result, bail};

fn main() -> Result<()> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["validate"] => validate::run(&root, None, false),
        ["validate", "--check"] => validate::run(&root, None, true),
        ["validate", page] => validate::run(&root, Some(page), false),
        other => bail!("unknown task {other:?}"),
    }
}
