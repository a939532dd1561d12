//! Checks beyond the compiler's: edges between crates, paths named in the
//! documentation, licences, traces of a machine, length of sentences, help against schema, and
//! measures of the code.

mod circles;
mod lengths;
mod prose;
mod published_codes;
mod source;
mod summaries;
mod tuple_parameters;

mod dependencies;
mod help;

use std::{collections::BTreeSet, fs, path::Path, process::Command};

use anyhow::{Context, Result, bail};
use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, Package};
use validation::say;

use self::source::Source;

/// Crates that stand alone.
const LEAVES: [&str; 4] = ["ema-sim", "inference", "reduction", "gp-bayesopt"];

/// Crates that `fdi-core` joins.
const JOINED: [&str; 6] =
    ["recordings", "fdi-report", "ema-sim", "inference", "reduction", "gp-bayesopt"];

/// Crates that `validation` measures: everything but the program, which it runs.
const VALIDATED: [&str; 11] = [
    "experiments",
    "fdi-benches",
    "fdi-core",
    "fdi-report",
    "ema-sim",
    "gp-bayesopt",
    "greybox",
    "greybox-blind",
    "inference",
    "recordings",
    "reduction",
];

/// Edges that each crate of the workspace may have to others; a new edge comes with
/// a page in `docs/decisions/`.
const EDGES: [(&str, &[&str]); 14] = [
    ("recordings", &[]),
    ("fdi-report", &["recordings"]),
    ("ema-sim", &[]),
    ("inference", &[]),
    ("reduction", &[]),
    ("gp-bayesopt", &[]),
    ("fdi-core", &JOINED),
    ("greybox", &["ema-sim", "inference"]),
    ("own-model", &["ema-sim", "inference"]),
    ("experiments", &["fdi-core", "gp-bayesopt", "inference"]),
    ("fdi-cli", &["experiments", "fdi-core", "fdi-report", "greybox", "recordings"]),
    ("validation", &VALIDATED),
    // hides effects, and so knows nothing of the catalogue
    ("greybox-blind", &[]),
    // for tests alone
    ("skipped-tests", &[]),
];

/// Packages that may use anything; of those who use them only those in the table do.
const OUTSIDE: [&str; 2] = ["xtask", "fdi-benches"];

/// Crates that a leaf does not bring along unless a feature asks for them: files,
/// formats, terminals, networks, clocks.
const NOT_IN_LEAVES: &[&str] = &[
    "anstream",
    "anyhow",
    "bincode",
    "chrono",
    "clap",
    "csv",
    "flate2",
    "jiff",
    "memmap2",
    "reqwest",
    "schemars",
    "serde",
    "serde_core",
    "serde_json",
    "tempfile",
    "time",
    "tokio",
    "toml",
    "tracing",
    "zip",
];

/// Licences under which the tree may be built into the program.
const LICENCES: &[&str] = &[
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// A measure of the code; its file under `tidy` says how it counts.
struct Measure {
    name: &'static str,
    check: fn(&[Source]) -> Vec<String>,
}

const fn measure(name: &'static str, check: fn(&[Source]) -> Vec<String>) -> Measure {
    Measure { name, check }
}

const MEASURES: [Measure; 6] = [
    measure("circles of imports", circles::check),
    measure("long files", lengths::files),
    measure("long functions", lengths::functions),
    measure("tuple parameters", tuple_parameters::check),
    measure("summaries", summaries::check),
    measure("published codes", published_codes::check),
];

/// Tells every finding of every measure of the code.
pub(crate) fn measures(root: &Path) -> Result<()> {
    let sources = source::read(root, &committed(root)?)?;
    for Measure { name, check } in MEASURES {
        let findings = check(&sources);
        say(&format!("{name}: {} findings", findings.len()));
        for finding in findings {
            say(&format!("  {finding}"));
        }
    }
    Ok(())
}

/// Findings of every measure.
fn measured(sources: &[Source]) -> Vec<String> {
    MEASURES.iter().flat_map(|measure| (measure.check)(sources)).collect()
}

/// Runs all checks and tells everything that they find.
pub(crate) fn run(root: &Path) -> Result<()> {
    let metadata = MetadataCommand::new().current_dir(root).exec().context("cargo metadata")?;
    let mut problems = edges(&metadata);
    problems.extend(leaves(root)?);
    problems.extend(licences(&metadata));
    problems.extend(same_licences(root)?);
    problems.extend(dependencies::unused(root, &metadata)?);
    let files = committed(root)?;
    problems.extend(named_paths(root, &files));
    problems.extend(machine_paths(root, &files));
    problems.extend(unformatted(root, &files)?);
    problems.extend(prose::check(root, &files));
    problems.extend(help::check());
    problems.extend(measured(&source::read(root, &files)?));
    if problems.is_empty() {
        return Ok(());
    }
    bail!("{} problems\n{}", problems.len(), problems.join("\n"));
}

/// Folders of files that a macro declares as modules, so that `cargo fmt` does not reach them.
const DECLARED_BY_MACRO: [&str; 2] =
    ["crates/ema-sim/src/effect/catalogue/", "crates/recordings/src/reader/"];

/// Files declared by a macro that are not formatted.
fn unformatted(root: &Path, files: &[String]) -> Result<Option<String>> {
    let declared = |file: &&String| DECLARED_BY_MACRO.iter().any(|of| file.starts_with(of));
    let files: Vec<&String> = files.iter().filter(declared).collect();
    let formatted = Command::new("rustfmt")
        .args(["--edition", "2024", "--check", "-l"])
        .args(&files)
        .current_dir(root)
        .output()
        .context("rustfmt")?;
    let listed = String::from_utf8_lossy(&formatted.stdout);
    let remedy = "rustfmt --edition 2024 FILE...";
    Ok((!formatted.status.success()).then(|| format!("`{remedy}`:\n{listed}")))
}

/// Edges between packages of the workspace that should not be.
fn edges(metadata: &Metadata) -> Vec<String> {
    let mut problems = Vec::new();
    for package in metadata.workspace_packages() {
        let name = package.name.as_str();
        if OUTSIDE.contains(&name) {
            continue;
        }
        let Some((_, allowed)) = EDGES.iter().find(|(of, _)| *of == name) else {
            problems.push(format!("package `{name}` has no entry in the table of edges"));
            continue;
        };
        // tests may use more than the crate itself
        let used = package.dependencies.iter().filter(|used| used.kind == DependencyKind::Normal);
        for used in used.filter(|used| used.path.is_some()) {
            if !allowed.contains(&used.name.as_str()) {
                problems.push(format!("`{name}` depends on `{}`", used.name));
            }
        }
    }
    problems
}

/// Unwanted crates that the leaves bring along, without features and without tests.
fn leaves(root: &Path) -> Result<Vec<String>> {
    let mut problems = Vec::new();
    for leaf in LEAVES {
        let tree = Command::new(env!("CARGO"))
            .args(["tree", "--package", leaf, "--edges", "normal", "--prefix", "none"])
            .args(["--format", "{p}"])
            .current_dir(root)
            .output()
            .context("cargo tree")?;
        if !tree.status.success() {
            bail!("cargo tree: {}", String::from_utf8_lossy(&tree.stderr));
        }
        let tree = String::from_utf8(tree.stdout)?;
        let found: BTreeSet<&str> =
            tree.lines().filter_map(|line| line.split_whitespace().next()).collect();
        let unwanted = NOT_IN_LEAVES.iter().filter(|name| found.contains(**name));
        problems.extend(unwanted.map(|name| format!("`{leaf}` brings `{name}` along")));
    }
    Ok(problems)
}

/// Packages whose licence is not in the list.
fn licences(metadata: &Metadata) -> Vec<String> {
    let told = |package: &Package| match package.license.as_deref() {
        Some(licence) if allowed(licence) => None,
        Some(licence) => Some(format!("`{}` is under `{licence}`", package.name)),
        None => Some(format!("`{}` states no licence", package.name)),
    };
    metadata.packages.iter().filter_map(told).collect()
}

/// Where the list of `cargo deny` is another one.
fn same_licences(root: &Path) -> Result<Option<String>> {
    let deny: toml::Table = toml::from_str(&fs::read_to_string(root.join("deny.toml"))?)?;
    let listed =
        deny.get("licenses").and_then(|table| table.get("allow")).and_then(|list| list.as_array());
    let listed: BTreeSet<_> =
        listed.into_iter().flatten().filter_map(|entry| entry.as_str()).collect();
    let same = listed == LICENCES.iter().copied().collect();
    Ok((!same).then(|| "deny.toml allows other licences than `cargo xtask tidy`".to_owned()))
}

/// True where an SPDX expression can be met with the list. `AND` binds tighter than
/// `OR`; an old `/` means `OR`.
fn allowed(expression: &str) -> bool {
    let mut words =
        Words { rest: expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ") };
    let met = any(&mut words);
    met && words.next().is_none()
}

/// The words of an expression, an exception together with its licence.
struct Words {
    rest: String,
}

impl Words {
    fn peek(&self) -> Option<String> {
        let mut words = self.rest.split_whitespace();
        let first = words.next()?;
        match (words.next(), words.next()) {
            (Some("WITH"), Some(exception)) => Some(format!("{first} WITH {exception}")),
            _ => Some(first.to_owned()),
        }
    }

    fn next(&mut self) -> Option<String> {
        let word = self.peek()?;
        let mut rest = self.rest.as_str();
        for part in word.split(' ') {
            rest = rest.trim_start().strip_prefix(part).expect("the word stands there");
        }
        self.rest = rest.to_owned();
        Some(word)
    }

    fn take(&mut self, word: &str) -> bool {
        let found = self.peek().as_deref() == Some(word);
        if found {
            self.next();
        }
        found
    }
}

fn any(words: &mut Words) -> bool {
    let mut met = all(words);
    while words.take("OR") {
        met |= all(words);
    }
    met
}

fn all(words: &mut Words) -> bool {
    let mut met = one(words);
    while words.take("AND") {
        met &= one(words);
    }
    met
}

fn one(words: &mut Words) -> bool {
    if words.take("(") {
        let met = any(words);
        return words.take(")") && met;
    }
    words.next().is_some_and(|licence| LICENCES.contains(&licence.as_str()))
}

/// Files under version control, and new ones that are not ignored.
fn committed(root: &Path) -> Result<Vec<String>> {
    let listed = Command::new("git")
        .args(["ls-files", "--cached", "--others", "--exclude-standard", "-z"])
        .current_dir(root)
        .output()
        .context("git ls-files")?;
    if !listed.status.success() {
        bail!("git ls-files: {}", String::from_utf8_lossy(&listed.stderr));
    }
    let names = String::from_utf8(listed.stdout)?;
    Ok(names.split('\0').filter(|name| !name.is_empty()).map(str::to_owned).collect())
}

/// Paths of the repository that documentation or comments name and that do not exist.
fn named_paths(root: &Path, files: &[String]) -> Vec<String> {
    let top: BTreeSet<&str> =
        files.iter().filter_map(|file| file.split_once('/')).map(|(folder, _)| folder).collect();
    let mut problems = Vec::new();
    for page in files.iter().filter(|file| is_documentation(file)) {
        let Ok(text) = fs::read_to_string(root.join(page)) else { continue };
        let mut fenced = false;
        for (number, line) in text.lines().enumerate() {
            if line.trim_start().starts_with("```") {
                fenced = !fenced;
                continue;
            }
            for named in paths_in(line, fenced, &top) {
                if !exists(root, page, named) {
                    problems.push(format!("{page}:{}: no `{named}`", number + 1));
                }
            }
        }
    }
    problems
}

fn is_documentation(file: &str) -> bool {
    let ends_in = |with| Path::new(file).extension().is_some_and(|extension| extension == with);
    (ends_in("md") || ends_in("rs")) && !file.starts_with("changelog.d/") && file != "CHANGELOG.md"
}

/// Words of a line that begin with a folder of the repository: in backticks, as the
/// target of a link, or anywhere in a fenced block. Patterns and placeholders are
/// left out.
fn paths_in<'a>(line: &'a str, fenced: bool, top: &BTreeSet<&str>) -> Vec<&'a str> {
    let (from, every) = if fenced { (0, 1) } else { (1, 2) };
    let quoted = line.split('`').skip(from).step_by(every);
    let linked = line.match_indices("](").filter_map(|(at, _)| line[at + 2..].split(')').next());
    let is_path = |word: &&str| {
        let begins = word.split_once('/').is_some_and(|(folder, _)| top.contains(folder));
        begins && !word.contains(['*', '<', '{', '…', '$', '"', '[']) && !word.contains("NNNN")
    };
    let words = quoted.chain(linked).flat_map(|text| text.split_whitespace());
    words.map(|word| word.split('#').next().unwrap_or(word)).filter(is_path).collect()
}

/// True where a named path exists, from the root or from the page's own folder.
fn exists(root: &Path, page: &str, named: &str) -> bool {
    let beside = Path::new(page).parent().unwrap_or(Path::new(""));
    root.join(named).exists() || root.join(beside).join(named).exists()
}

/// Beginnings of absolute paths that only make sense on one machine; put together,
/// so that this file does not hold what it looks for.
const TRACES: [&str; 4] =
    [concat!("/ho", "me/"), concat!("/Use", "rs/"), concat!("/ro", "ot/"), concat!("/wo", "rk/")];

/// Lines that name a path of a machine.
fn machine_paths(root: &Path, files: &[String]) -> Vec<String> {
    let mut problems = Vec::new();
    for file in files {
        let Ok(text) = fs::read_to_string(root.join(file)) else { continue };
        for (number, line) in text.lines().enumerate() {
            if TRACES.iter().any(|trace| absolute(line, trace)) {
                problems.push(format!("{file}:{}: names a path of a machine", number + 1));
            }
        }
    }
    problems
}

/// True where `trace` stands in the line as the beginning of an absolute path.
fn absolute(line: &str, trace: &str) -> bool {
    line.match_indices(trace).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        before
            .is_none_or(|c| !c.is_alphanumeric() && !matches!(c, '.' | '_' | '-' | '/' | '}' | ')'))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn licence_expressions_are_read() {
        for good in [
            "MIT",
            "MIT OR GPL-3.0-only",
            "MIT/Apache-2.0",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
            "Apache-2.0 WITH LLVM-exception OR Apache-2.0 OR MIT",
            "GPL-2.0-only OR MIT AND Zlib",
        ] {
            assert!(allowed(good), "{good}");
        }
        for bad in [
            "GPL-3.0-only",
            "MIT AND GPL-3.0-only",
            "(MIT OR GPL-3.0-only) AND MPL-2.0",
            "",
            "MIT MIT",
        ] {
            assert!(!allowed(bad), "{bad}");
        }
    }

    #[test]
    fn named_paths_are_found() {
        let top = BTreeSet::from(["docs", "crates"]);
        let line =
            "see `docs/formats.md`, [this](docs/cli.md#fdi) and `cargo run -p x`, `docs/*.md`";
        assert_eq!(paths_in(line, false, &top), ["docs/formats.md", "docs/cli.md"]);
        let plain = "`src/lib.rs` and docs/plain.md";
        assert!(paths_in(plain, false, &top).is_empty());
        assert_eq!(paths_in(plain, true, &top), ["docs/plain.md"]);
    }

    #[test]
    fn traces_of_a_machine_are_told_from_words() {
        assert!(absolute("cd /opt/x", "/opt/"));
        assert!(absolute("\"/opt/x\"", "/opt/"));
        assert!(!absolute("a/opt/x and ../opt/y", "/opt/"));
    }
}
