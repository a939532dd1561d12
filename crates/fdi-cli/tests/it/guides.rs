//! Guides as they stand: their fenced blocks, run one after another.
//!
//! [`check`] holds a guide to what the program prints:
//!
//! - Blocks of `sh` are run in their order in one folder. A line `NAME="..."` of one holds in all
//!   later ones. One fails only where what it printed is shown, and shown to begin with `error:`.
//! - A block of `text` is what the block of `sh` before it printed, word for word, on standard
//!   output and standard error in the order they came. A line `…` stands for one line or more that
//!   are left out.
//! - Blocks of `toml` and `csv` are what a file holds, and not looked at. No other blocks are taken.

use std::{
    env, fs,
    os::unix::fs::symlink,
    path::Path,
    process::{Command, Output},
};

use crate::commands::whole;

/// Line of a `text` block that stands for printed lines left out.
const LEFT_OUT: &str = "…";

/// The fenced blocks of a guide, each with its language, in their order.
fn fenced(guide: &str) -> Vec<(&str, &str)> {
    let mut parts = guide.split("```").skip(1);
    let mut found = Vec::new();
    while let Some(block) = parts.next() {
        assert!(parts.next().is_some(), "a block that is not closed: {block}");
        found.push(block.split_once('\n').expect("a language"));
    }
    found
}

/// The fenced blocks of a guide in a language, in their order.
pub(crate) fn blocks(guide: &'static str, language: &str) -> Vec<&'static str> {
    fenced(guide).into_iter().filter(|(of, _)| *of == language).map(|(_, block)| block).collect()
}

/// Output of a block of shell commands, with `fdi` as the program under test, up to one that fails.
fn shell(folder: &Path, block: &str) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_fdi"));
    let folders = [program.parent().unwrap().to_owned()];
    let own = env::var_os("PATH").unwrap_or_default();
    let path = env::join_paths(folders.into_iter().chain(env::split_paths(&own))).unwrap();
    let mut shell = Command::new("sh");
    shell.args(["-ec", block]).current_dir(folder).env("PATH", path);
    shell.output().unwrap()
}

/// Runs the lines of a block with `fdi` as the program under test; all have to succeed.
pub(crate) fn run(folder: &Path, block: &str) -> String {
    let said = shell(folder, block);
    assert!(said.status.success(), "{block}\n{}", whole(&said));
    whole(&said)
}

/// Compares the lines that a guide shows with those printed; [`LEFT_OUT`] matches one or more.
fn is_printed(shown: &[&str], printed: &[&str]) -> bool {
    match shown {
        [] => printed.is_empty(),
        [LEFT_OUT, rest @ ..] => (1..=printed.len()).any(|n| is_printed(rest, &printed[n..])),
        [line, rest @ ..] => printed.first() == Some(line) && is_printed(rest, &printed[1..]),
    }
}

fn is_all_printed(shown: &str, printed: &str) -> bool {
    let lines = |text| str::lines(text).collect::<Vec<_>>();
    is_printed(&lines(shown), &lines(printed))
}

/// Tells whether a line of shell sets a variable: `NAME="..."`.
fn sets_variable(line: &str) -> bool {
    let name = line.split_once("=\"").map_or("", |(name, _)| name);
    !name.is_empty() && name.chars().all(|letter| letter.is_ascii_uppercase())
}

/// A block that is right would be wrong with any one of its digits changed.
fn assert_each_digit_counts(shown: &str, printed: &str) {
    for (place, digit) in shown.char_indices().filter(|(_, letter)| letter.is_ascii_digit()) {
        let other = if digit == '7' { "8" } else { "7" };
        let changed = format!("{}{other}{}", &shown[..place], &shown[place + 1..]);
        assert!(!is_all_printed(&changed, printed), "nothing sees a change of\n{changed}");
    }
}

/// Text that a block of shell commands printed on both streams, and whether all of them succeeded.
fn printed(folder: &Path, block: &str) -> (String, bool) {
    let said = shell(folder, &format!("exec 2>&1\n{block}"));
    (String::from_utf8(said.stdout).unwrap(), said.status.success())
}

/// Runs a guide in a folder, in which the repository's `fixtures` are from then on.
pub(crate) fn check(guide: &str, folder: &Path) {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    symlink(fs::canonicalize(fixtures).unwrap(), folder.join("fixtures")).unwrap();
    let mut variables = String::new();
    let mut blocks = fenced(guide).into_iter().peekable();
    while let Some((language, block)) = blocks.next() {
        match language {
            "sh" => {
                let (said, succeeded) = printed(folder, &format!("{variables}{block}"));
                let shown = blocks.next_if(|(language, _)| *language == "text");
                let shown = shown.map(|(_, shown)| shown);
                let may_fail = shown.is_some_and(|shown| shown.starts_with("error:"));
                assert_ne!(succeeded, may_fail, "{block}\n{said}");
                if let Some(shown) = shown {
                    assert!(is_all_printed(shown, &said), "shown:\n{shown}\nprinted:\n{said}");
                    assert_each_digit_counts(shown, &said);
                }
                for line in block.lines().filter(|line| sets_variable(line)) {
                    variables.extend([line, "\n"]);
                }
            }
            "toml" | "csv" => {}
            _ => panic!("no command before it prints this `{language}`:\n{block}"),
        }
    }
}

#[test]
fn what_is_left_out_is_a_line_or_more() {
    let printed = "a 1\nb 2\nc 3\n";
    for shown in ["a 1\nb 2\nc 3\n", "…\nc 3\n", "a 1\n…\nc 3\n", "a 1\n…\n", "…\nb 2\n…\n"]
    {
        assert!(is_all_printed(shown, printed), "{shown}");
    }
    for shown in ["", "a 1\n", "a 1\nc 3\n", "…\na 1\n…\n", "a 1\nb 2\nc 3\n…\n", "c 3\n…\n"]
    {
        assert!(!is_all_printed(shown, printed), "{shown}");
    }
}
