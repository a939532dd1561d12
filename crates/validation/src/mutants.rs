//! Breaks the program, one way after another, and tells which test sees it first: `cargo xtask mutants`.

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};

use crate::terminal::say;

/// A way in which the program may be broken: one place of one file has another text.
struct Mutant {
    name: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
}

const EXPLAIN: &str = "crates/greybox/src/explain.rs";

const MUTANTS: [Mutant; 9] = [
    Mutant {
        name: "a name is never given",
        file: "crates/greybox/src/search.rs",
        from: "let Some(winner) = accepted.first().cloned() else {",
        to: "let Some(winner) = accepted.first().filter(|_| false).cloned() else {",
    },
    Mutant {
        name: "one effect at most is named",
        file: EXPLAIN,
        from: "most_effects: 3,",
        to: "most_effects: 1,",
    },
    Mutant {
        name: "ties are never stated",
        file: EXPLAIN,
        from: "let (ties, last_ties) = (search.ties, search.last_ties);",
        to: "let (ties, last_ties) = (Vec::<Rival>::new(), Vec::<Rival>::new());",
    },
    Mutant {
        name: "the gain is stated a fifth as large",
        file: EXPLAIN,
        from: "holdout_gain_nats: found.rival.claim.gain.nats,",
        to: "holdout_gain_nats: 0.2 * found.rival.claim.gain.nats,",
    },
    Mutant {
        name: "the residual after the extension is stated a fifth smaller",
        file: EXPLAIN,
        from: "Some([&nominal, &now].map(Seen::held_out_rms))",
        to: "Some([nominal.held_out_rms(), 0.8 * now.held_out_rms()])",
    },
    Mutant {
        name: "nothing is ever said to be unknown",
        file: EXPLAIN,
        from: "|| is_more_there;",
        to: "&& false;",
    },
    Mutant {
        name: "recordings held out are fitted too",
        file: EXPLAIN,
        from: "let machine = with_suspects(",
        to: "let mut recordings = recordings;\n    \
             recordings.train.extend(recordings.holdout.clone());\n    \
             let machine = with_suspects(",
    },
    Mutant {
        name: "intervals of fault levels are half as wide",
        file: "crates/greybox/src/interval.rs",
        from: "[end(-Z_95), end(Z_95)]",
        to: "[end(-0.5 * Z_95), end(0.5 * Z_95)]",
    },
    Mutant {
        name: "the seal is opened before the answer",
        file: "crates/fdi-cli/tests/it/sealed/seal.rs",
        from: "if !folder.join(ANSWER).exists() {",
        to: "if false {",
    },
];

const PAGE: &str = "docs/validation/mutants.md";

/// Has the tests run on each mutant, in a copy of the repository, and writes their page.
///
/// # Errors
///
/// When the tests fail without a mutant, no test sees one, or a copy cannot be made.
pub fn break_the_program(root: &Path) -> Result<()> {
    let folder = root.join("target/mutants");
    let copy = copied(root, &folder.join("copy"))?;
    let target = folder.join("target");
    if let [failed, ..] = &failing(&copy, &target)?[..] {
        bail!("`{failed}` fails without a mutant");
    }
    let mut page = String::from(include_str!("mutants.md"));
    let mut unseen = Vec::new();
    for Mutant { name, file, from, to } in &MUTANTS {
        let path = copy.join(file);
        let sound = fs::read_to_string(&path).with_context(|| (*file).to_owned())?;
        fs::write(&path, broken(&sound, from, to).with_context(|| format!("{name}: {file}"))?)?;
        let seen_by = failing(&copy, &target).with_context(|| (*name).to_owned())?;
        fs::write(&path, sound)?;
        say(&format!("{name}: {}", seen_by.join(", ")));
        let tests: Vec<String> = seen_by.iter().map(|test| format!("`{test}`")).collect();
        let _ = writeln!(page, "| {name} | `{file}` | {} |", tests.join(", "));
        if seen_by.is_empty() {
            unseen.push(*name);
        }
    }
    if !unseen.is_empty() {
        bail!("no test sees that {}", unseen.join("; that "));
    }
    fs::write(root.join(PAGE), page)?;
    say(PAGE);
    Ok(())
}

/// A text with one place, which it has once, replaced.
fn broken(sound: &str, from: &str, to: &str) -> Result<String> {
    match sound.matches(from).count() {
        1 => Ok(sound.replacen(from, to, 1)),
        count => bail!("`{from}` stands there {count} times"),
    }
}

/// Copies what git knows of the repository, as it stands, into a folder.
fn copied(root: &Path, copy: &Path) -> Result<PathBuf> {
    if copy.exists() {
        fs::remove_dir_all(copy)?;
    }
    let list = ["ls-files", "-z", "--cached", "--others", "--exclude-standard"];
    let output = Command::new("git").args(list).current_dir(root).output().context("git")?;
    for name in String::from_utf8(output.stdout)?.split_terminator('\0') {
        let (from, to) = (root.join(name), copy.join(name));
        // what was removed and not committed
        if from.exists() {
            fs::create_dir_all(to.parent().context("a folder")?)?;
            fs::copy(from, to).with_context(|| name.to_owned())?;
        }
    }
    Ok(copy.to_owned())
}

/// Tests that hide and find, by what their names have in common: the quickest first.
const TESTS: [&str; 4] = [
    "sealed::seal::",
    "sealed::nothing_is_fitted_to_what_is_held_out",
    "sealed::the_gain_claimed_is_that_of_the_extended_model",
    "sealed::what_is_hidden_is_found_and_what_is_not_is_not",
];

/// Names of the first of the tests that fail in a copy; none where all pass.
fn failing(copy: &Path, target: &Path) -> Result<Vec<String>> {
    for test in TESTS {
        let output = Command::new(env!("CARGO"))
            .args(["test", "--package", "fdi-cli", "--test", "it", "--", test])
            .env("CARGO_TARGET_DIR", target)
            .current_dir(copy)
            .output()
            .context("cargo test")?;
        let text = String::from_utf8_lossy(&output.stdout);
        if !text.contains("test result:") {
            bail!("no tests ran:\n{}", String::from_utf8_lossy(&output.stderr));
        }
        let failed =
            |line: &str| Some(line.strip_prefix("test ")?.strip_suffix(" ... FAILED")?.to_owned());
        let failed: Vec<String> = text.lines().filter_map(failed).collect();
        if !failed.is_empty() {
            return Ok(failed);
        }
        if !output.status.success() {
            bail!("`{test}` ended without a result:\n{text}");
        }
        // a test that was renamed would pass for one that sees nothing
        if text.contains("running 0 tests") {
            bail!("there is no test `{test}`");
        }
    }
    Ok(Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mutant_breaks_one_place_of_the_program() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        for Mutant { name, file, from, to } in &MUTANTS {
            let sound = fs::read_to_string(root.join(file)).unwrap();
            let mutant = broken(&sound, from, to).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_ne!(sound, mutant, "{name}");
        }
    }
}
