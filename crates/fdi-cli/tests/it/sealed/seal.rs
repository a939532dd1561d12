//! Three processes: one draws a case and writes down the hash of its truth, one answers on the files
//! alone, and one draws the truth again and opens it. Before, no file holds it; a model that a
//! simulation needs to draw a case is in a folder that is gone when the first process ends.
//!
//! The first and the third are this program of tests, started anew with the name of one of the two
//! tests below and the case in its environment; without a case both test themselves.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use greybox_blind::sha256_hex;

use super::case::{Kind, Name, Truth};

/// Variables that name the case, and the folder that the processes share.
const CASE: &str = "FDI_SEALED_CASE";
const FOLDER: &str = "FDI_SEALED_FOLDER";

/// Files of that folder: what whoever answers sees, the seal, the answer and the truth.
const SEEN: &str = "case";
const SEAL: &str = "seal";
const ANSWER: &str = "answer.json";
const TRUTH: &str = "truth.json";

/// A case of which the hash of the truth is written down.
pub(crate) struct Sealed {
    name: Name,
    folder: tempfile::TempDir,
}

/// A case whose answer is written down.
pub(crate) struct Answered(Sealed);

impl Sealed {
    /// Has the case drawn by a process of its own.
    pub(crate) fn draw(name: Name) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let drawn = process("a_case_is_drawn_without_its_truth", name, folder.path());
        assert!(drawn.status.success(), "{name}: {}", said(&drawn));
        Self { name, folder }
    }

    /// Recordings, their roles and the nominal model.
    pub(crate) fn seen(&self) -> PathBuf {
        self.folder.path().join(SEEN)
    }

    /// Writes the answer down.
    pub(crate) fn answered(self, answer: &[u8]) -> Answered {
        fs::write(self.folder.path().join(ANSWER), answer).unwrap();
        Answered(self)
    }
}

impl Answered {
    /// Has the truth opened by a process of its own.
    pub(crate) fn open(&self) -> Truth {
        let Sealed { name, folder } = &self.0;
        let opened = process("a_truth_is_opened_once_there_is_an_answer", *name, folder.path());
        assert!(opened.status.success(), "{name}: {}", said(&opened));
        let truth = fs::read_to_string(folder.path().join(TRUTH)).unwrap();
        serde_json::from_str(&truth).unwrap()
    }
}

/// Runs one of the two tests below for a case.
fn process(test: &str, name: Name, folder: &Path) -> Output {
    let mut command = Command::new(env::current_exe().unwrap());
    command.args(["--exact", &format!("sealed::seal::{test}"), "--nocapture"]);
    command.env(CASE, name.to_string()).env(FOLDER, folder).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// The case that this process was started for.
#[expect(clippy::disallowed_methods, reason = "a process of the tests is told its case")]
fn asked_for() -> Option<(Name, PathBuf)> {
    let name = env::var(CASE).ok()?;
    Some((Name::read(&name).unwrap(), env::var_os(FOLDER).unwrap().into()))
}

#[test]
fn a_case_is_drawn_without_its_truth() {
    let of_this_test = tempfile::tempdir().unwrap();
    let a_case = Name { kind: Kind::HighFidelity { hides: true }, number: 1 };
    let (name, folder) = asked_for().unwrap_or((a_case, of_this_test.path().to_owned()));
    let case = name.draw();
    fs::write(folder.join(SEAL), sha256_hex(case.truth().as_bytes())).unwrap();
    case.write(&folder.join(SEEN));
    for file in fs::read_dir(folder.join(SEEN)).unwrap() {
        let file = file.unwrap();
        let text = fs::read_to_string(file.path()).unwrap();
        match file.file_name().to_str().unwrap() {
            "nominal.toml" => assert_eq!(text, case.nominal(), "{name}"),
            "roles.toml" => assert_eq!(text.lines().count(), 3, "{text}"),
            recording => assert_tells_nothing(recording, &text),
        }
    }
    assert!(!folder.join(TRUTH).exists());
}

/// A recording has a name of a number alone, and no more beside its samples than how it was made.
fn assert_tells_nothing(name: &str, text: &str) {
    const KEYS: [&str; 4] = ["command", "rate-hz", "envelope", "start-angle-rad"];
    let number = name.strip_prefix("rec").and_then(|name| name.strip_suffix(".csv"));
    assert!(number.is_some_and(|number| number.parse::<u8>().is_ok()), "{name}");
    for line in text.lines().filter_map(|line| line.strip_prefix("# ")) {
        let key = line.split(" = ").next().unwrap_or_default();
        assert!(KEYS.contains(&key), "{name}: {line}");
    }
}

#[test]
fn a_truth_is_opened_once_there_is_an_answer() {
    if let Some((name, folder)) = asked_for() {
        return open(name, &folder).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |file: &str| folder.path().join(file);
    let [name, other] =
        [1, 2].map(|number| Name { kind: Kind::HighFidelity { hides: true }, number });
    fs::write(at(SEAL), sha256_hex(name.draw().truth().as_bytes())).unwrap();
    assert_eq!(open(name, folder.path()), Err("no answer is written down"));
    fs::write(at(ANSWER), "{}").unwrap();
    assert_eq!(open(other, folder.path()), Err("the truth is not the one that was sealed"));
    assert!(!at(TRUTH).exists());
    open(name, folder.path()).unwrap();
    assert_eq!(fs::read_to_string(at(TRUTH)).unwrap(), name.draw().truth());
}

/// Draws the truth again and writes it beside its answer.
fn open(name: Name, folder: &Path) -> Result<(), &'static str> {
    if !folder.join(ANSWER).exists() {
        return Err("no answer is written down");
    }
    let truth = name.draw().truth();
    if sha256_hex(truth.as_bytes()) != fs::read_to_string(folder.join(SEAL)).unwrap() {
        return Err("the truth is not the one that was sealed");
    }
    fs::write(folder.join(TRUTH), truth).unwrap();
    Ok(())
}
