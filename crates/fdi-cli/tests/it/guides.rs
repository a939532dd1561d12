//! Guides as they stand: their fenced blocks, run one after another.

use std::{env, path::Path, process::Command};

use crate::commands::whole;

/// The fenced blocks of a guide in a language, in their order.
pub(crate) fn blocks(guide: &'static str, language: &str) -> Vec<&'static str> {
    let fence = format!("```{language}\n");
    let after = guide.split(fence.as_str()).skip(1);
    after.map(|text| text.split_once("```").expect("a closed block").0).collect()
}

/// Runs the lines of a block with `fdi` as the program under test; all have to succeed.
pub(crate) fn run(folder: &Path, block: &str) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_fdi"));
    let folders = [program.parent().unwrap().to_owned()];
    let own = env::var_os("PATH").unwrap_or_default();
    let path = env::join_paths(folders.into_iter().chain(env::split_paths(&own))).unwrap();
    let mut shell = Command::new("sh");
    shell.args(["-ec", block]).current_dir(folder).env("PATH", path);
    let said = shell.output().unwrap();
    assert!(said.status.success(), "{block}\n{}", whole(&said));
    whole(&said)
}
