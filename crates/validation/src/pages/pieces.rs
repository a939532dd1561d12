//! Pieces of pages that people write, and the commit whose figures each of them judges.
//!
//! A conclusion on a generated page is made of numbers, or it stands in a piece, a file `FOLDER/*.md`
//! beside the generators. How the rule is decided:
//!
//! - A piece names a commit by seven digits of its hash, or it is listed in [`OF_METHOD`].
//! - A piece of [`OF_METHOD`] says how figures are made; it has none of the words of [`JUDGING`].
//! - A generator has none of the [`JUDGING`] words in its code, but for the lines in [`MADE_OF_NUMBERS`].
//! - The committed page holds each piece word for word, so that words and commit move together.

use std::{fs, path::Path};

/// Pieces that say how figures are made, and nothing of what came out.
const OF_METHOD: [&str; 60] = [
    "as_recorded/columns.md",
    "as_recorded/head.md",
    "as_recorded/limits.md",
    "as_recorded/quadrature.md",
    "bayesopt/head.md",
    "bayesopt/limits.md",
    "bayesopt/problems.md",
    "bayesopt/speed.md",
    "clocks/head.md",
    "clocks/limits.md",
    "cranfield/head.md",
    "cranfield/limits.md",
    "cranfield/table.md",
    "detection_limits/head.md",
    "explaining/head.md",
    "fidelity/diagnosis.md",
    "fidelity/found.md",
    "fidelity/head.md",
    "load/head.md",
    "load/limits.md",
    "measured/again.md",
    "measured/compared.md",
    "measured/delay.md",
    "measured/elsewhere.md",
    "measured/emps.md",
    "measured/head.md",
    "measured/laas.md",
    "measured/limits.md",
    "measured/loop.md",
    "measured/map.md",
    "measured/peers.md",
    "measured/peers_names.md",
    "measured/residual.md",
    "measured/rivals.md",
    "measured/scan.md",
    "measured/speed.md",
    "measured/table.md",
    "measured/undecided.md",
    "planned/head.md",
    "planned/limits.md",
    "real_recordings/head.md",
    "real_recordings/references.md",
    "setup/head.md",
    "setup/limits.md",
    "signal_chain/elsewhere.md",
    "signal_chain/emps.md",
    "signal_chain/head.md",
    "signal_chain/laas.md",
    "signal_chain/limits.md",
    "simulated_sets/head.md",
    "simulated_sets/hidden.md",
    "simulated_sets/limits.md",
    "simulated_sets/off.md",
    "simulator/limits.md",
    "strata/head.md",
    "strata/limits.md",
    "tests/head.md",
    "tests/limits.md",
    "voltage/head.md",
    "voltage/limits.md",
];

/// Words of a verdict on figures.
const JUDGING: [&str; 10] = [
    "**missed**",
    ": met",
    "is met",
    "are met",
    "misses",
    "miss their",
    "does not help",
    "do not show",
    "beats",
    "**does not",
];

/// Beginnings of lines of code that choose such a word by a number.
const MADE_OF_NUMBERS: [&str; 1] = ["if is_met {"];

fn pages() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src/pages"))
}

/// Files of a kind under the pages, by their path from there, with what they hold.
fn files(kind: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders = vec![pages().to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|of| of == kind) {
                let name = path.strip_prefix(pages()).unwrap().display().to_string();
                found.push((name, fs::read_to_string(path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

/// A text names a commit by seven digits of its hash.
fn names_a_commit(text: &str) -> bool {
    text.split("commit `").skip(1).any(|rest| {
        let hash = rest.split('`').next().unwrap_or_default();
        hash.len() == 7 && hash.bytes().all(|byte| byte.is_ascii_hexdigit())
    })
}

fn judging_word(text: &str) -> Option<&'static str> {
    let ends = |at: usize| !text[at..].starts_with(char::is_alphanumeric);
    JUDGING.into_iter().find(|word| text.match_indices(word).any(|(at, _)| ends(at + word.len())))
}

/// Reason against a piece, if there is one.
fn fault(name: &str, text: &str) -> Option<String> {
    if names_a_commit(text) {
        return None;
    }
    if !OF_METHOD.contains(&name) {
        return Some(format!("`{name}` names no commit whose figures it judges"));
    }
    judging_word(text).map(|word| format!("`{name}` says \"{word}\" of no commit"))
}

#[test]
fn a_piece_that_judges_names_its_commit() {
    let pieces = files("md");
    let faults: Vec<String> = pieces.iter().filter_map(|(name, text)| fault(name, text)).collect();
    assert!(faults.is_empty(), "{faults:#?}");
    for name in OF_METHOD {
        assert!(pieces.iter().any(|(of, _)| of == name), "no piece `{name}`");
    }
}

/// Anti-test: the rule finds what it forbids.
#[test]
fn a_piece_that_judges_without_a_commit_is_found() {
    assert!(fault("measured/new.md", "The fall is 3 V.").is_some());
    assert!(fault("measured/new.md", "By commit `0a1b2c3` the fall is 3 V.").is_none());
    assert!(fault("measured/head.md", "Two threads.").is_none());
    assert!(fault("measured/head.md", "The bar is **missed**.").is_some());
    assert!(!names_a_commit("commit `of today`"));
    assert_eq!(judging_word("the bars: met"), Some(": met"));
    assert_eq!(judging_word("write: metaheuristics"), None);
}

#[test]
fn generators_write_verdicts_of_numbers_alone() {
    for (name, text) in files("rs") {
        if name == "pieces.rs" {
            continue;
        }
        let code = text.split("#[cfg(test)]").next().unwrap();
        let lines = code.lines().map(str::trim_start).filter(|line| !line.starts_with("//"));
        for line in lines.filter(|line| !MADE_OF_NUMBERS.iter().any(|of| line.starts_with(of))) {
            assert_eq!(judging_word(line), None, "{name}: `{line}`");
        }
    }
}

#[test]
fn committed_pages_hold_the_pieces_word_for_word() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for (name, piece) in files("md") {
        let page = name.split('/').next().unwrap().replace('_', "-");
        let page = root.join("docs/validation").join(page).with_extension("md");
        let text = fs::read_to_string(&page).unwrap();
        assert!(text.contains(&piece), "{} does not hold `{name}`", page.display());
    }
}
