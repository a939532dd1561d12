//! Comparison of the answers of two programs: `cargo xtask same-answers`.
//!
//! Both programs run the same commands on the same files, each in a folder of its own, and every
//! product is compared byte by byte. A change that only moves code leaves all of them identical. With
//! `--renames` the published words of [`RENAMES`] count as equal.

mod commands;
mod difference;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};

use self::{
    commands::{Asked, commands},
    difference::{first_difference, shown},
};
use crate::terminal::say;

/// Call of the task.
const USAGE: &str = "\
cargo xtask same-answers OTHER_FDI [--renames] [--fdi PROGRAM]
  OTHER_FDI  the program that this one is compared with, say of the commit before a change
  --renames  count the published words that were renamed as equal
  --fdi      the program of this commit (default: built with --release)";

/// Published words that were renamed: of each row either program may use any.
const RENAMES: &[&[&str]] = &[
    // the default method is generalised least squares and is called so
    &["composite", "gls"],
    // one code stood for these facts; each has a code of its own
    &[
        "\"outside-training\"",
        "\"start-angle-not-learnt\"",
        "\"emulator-replaced\"",
        "\"phases-sampled-slowly\"",
        "\"noise-above-bundle\"",
        "\"noise-hides-levels\"",
        "\"start-estimated\"",
        "\"start-suspected\"",
    ],
    // one code stood for no eccentricity and for an angle known within an electrical turn
    &["\"phase-undetermined\"", "\"electrical-turn-unknown\""],
    // the use of references has a code of its own
    &["\"bundle-of-another-model\"", "\"reference-used\""],
];

/// Fields whose values say which program wrote them, not what it found.
const STAMPS: [&str; 3] = ["\"schema_version\"", "\"tool\"", "\"config_sha256\""];

struct Options {
    other: PathBuf,
    renames: bool,
    fdi: Option<PathBuf>,
}

impl Options {
    fn parse(arguments: &[&str]) -> Result<Self> {
        let mut other = None;
        let (mut renames, mut fdi) = (false, None);
        let mut rest = arguments.iter();
        while let Some(&argument) = rest.next() {
            match argument {
                "--renames" => renames = true,
                "--fdi" => {
                    let program = rest.next().with_context(|| format!("`--fdi`\n{USAGE}"))?;
                    fdi = Some(program.into());
                }
                flag if flag.starts_with('-') => bail!("unknown flag `{flag}`\n{USAGE}"),
                program if other.is_none() => other = Some(program.into()),
                more => bail!("a second program `{more}`\n{USAGE}"),
            }
        }
        let other = other.with_context(|| format!("no program to compare with\n{USAGE}"))?;
        Ok(Self { other, renames, fdi })
    }
}

/// Runs the commands with both programs and compares what they write; one line a command.
///
/// # Errors
///
/// When a program does not start, a file cannot be written, or a product differs.
pub fn same_answers(root: &Path, arguments: &[&str]) -> Result<()> {
    let options = Options::parse(arguments)?;
    let own = match &options.fdi {
        Some(program) => program.clone(),
        None => crate::blind::built(root)?,
    };
    let programs = [
        Program::new(&options.other, root).context("the other program")?,
        Program::new(&own, root).context("this program")?,
    ];
    let commands = commands(&programs.each_ref().map(Program::folder))?;
    let mut different = 0;
    for asked in &commands {
        let [other, own] = [programs[0].run(asked)?, programs[1].run(asked)?];
        let same = other
            .iter()
            .zip(&own)
            .map(|(other, own)| compared(other, own, options.renames))
            .find_map(|difference| difference);
        match same {
            None => say(&format!("identical  {}", asked.name)),
            Some(difference) => {
                different += 1;
                say(&format!("differs    {}: {difference}", asked.name));
            }
        }
    }
    if different > 0 {
        bail!("{different} of {} commands differ", commands.len());
    }
    say(&format!("all {} commands are identical", commands.len()));
    Ok(())
}

/// A program with the folder that it works in.
struct Program {
    file: PathBuf,
    folder: tempfile::TempDir,
    /// The program knows the word `gls`.
    says_gls: bool,
}

/// A product of a command.
struct Product {
    of: String,
    bytes: Vec<u8>,
}

impl Program {
    fn new(file: &Path, root: &Path) -> Result<Self> {
        let file = file.canonicalize().with_context(|| file.display().to_string())?;
        let folder = tempfile::tempdir()?;
        for inputs in ["commands", "models", "recordings"] {
            let to = folder.path().join(inputs);
            fs::create_dir(&to)?;
            for entry in fs::read_dir(root.join("fixtures").join(inputs))? {
                let entry = entry?;
                fs::copy(entry.path(), to.join(entry.file_name()))?;
            }
        }
        let help = Command::new(&file).args(["diagnose", "--help"]).output()?;
        let says_gls = String::from_utf8_lossy(&help.stdout).contains("gls");
        Ok(Self { file, folder, says_gls })
    }

    fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The products of a command: messages, standard output, and its files.
    fn run(&self, asked: &Asked) -> Result<Vec<Product>> {
        let gls = if self.says_gls { "gls" } else { "composite" };
        let arguments = asked.arguments.iter().map(|argument| argument.replace("{gls}", gls));
        let output = Command::new(&self.file)
            .args(arguments)
            .args(["--stable", "--quiet"])
            .current_dir(self.folder())
            .env_clear()
            .output()
            .with_context(|| self.file.display().to_string())?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            bail!("`{} {}`: {}: {said}", self.file.display(), asked.name, output.status);
        }
        let messages = String::from_utf8_lossy(&output.stderr);
        let mut products = vec![
            Product { of: "messages".to_owned(), bytes: messages.into_owned().into_bytes() },
            Product { of: "standard output".to_owned(), bytes: output.stdout },
        ];
        for file in &asked.files {
            let bytes = fs::read(self.folder().join(file))
                .with_context(|| format!("`{} {}`", self.file.display(), asked.name))?;
            products.push(Product { of: file.clone(), bytes });
        }
        Ok(products)
    }
}

/// The first difference of two products, told; `None` where there is none.
fn compared(other: &Product, own: &Product, renames: bool) -> Option<String> {
    let both = [&other.bytes, &own.bytes];
    let [other_bytes, own_bytes] =
        both.map(|bytes| if renames { renamed(bytes) } else { bytes.clone() });
    let place = first_difference(&other_bytes, &own_bytes)?;
    Some(format!("{}, {}", other.of, shown(&other_bytes, &own_bytes, place)))
}

/// A product with the first of the words for a fact in place of each, and without stamps.
fn renamed(bytes: &[u8]) -> Vec<u8> {
    let Ok(text) = std::str::from_utf8(bytes) else { return bytes.to_vec() };
    let mut text = STAMPS.iter().fold(text.to_owned(), |text, stamp| without_values(&text, stamp));
    for words in RENAMES {
        let [first, rest @ ..] = words else { continue };
        for word in rest {
            text = text.replace(word, first);
        }
    }
    text.into_bytes()
}

/// A text without the values behind a key of JSON: up to the next comma, bracket or line's end.
fn without_values(text: &str, key: &str) -> String {
    let mut parts = text.split(key);
    let mut kept = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find([',', '}', '\n']).unwrap_or(part.len());
        kept.push_str(key);
        kept.push_str(&part[end..]);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn product(text: &str) -> Product {
        Product { of: "standard output".to_owned(), bytes: text.as_bytes().to_vec() }
    }

    #[test]
    fn renamed_words_are_equal_where_that_is_asked() {
        let (other, own) = (
            product("{\n  \"schema_version\": 1,\n  \"method\": \"composite\"\n}"),
            product("{\n  \"schema_version\": 2,\n  \"method\": \"gls\"\n}"),
        );
        assert_eq!(compared(&other, &own, true), None);
        let compact = product("{\"schema_version\":1,\"seed\":0}");
        let newer = product("{\"schema_version\":2,\"seed\":0}");
        assert_eq!(compared(&compact, &newer, true), None);
        let other_seed = product("{\"schema_version\":2,\"seed\":1}");
        assert!(compared(&compact, &other_seed, true).is_some());
        let told = compared(&other, &own, false).unwrap();
        assert!(told.starts_with("standard output, byte 22, line 2: "), "{told}");
        assert!(told.contains("`  \"schema_version\": 1,`"), "{told}");
    }

    #[test]
    fn flags_are_read() {
        let options = Options::parse(&["old/fdi", "--renames"]).unwrap();
        assert!(options.renames && options.other == Path::new("old/fdi"));
        assert!(Options::parse(&["--renames"]).is_err());
        assert!(Options::parse(&["a", "b"]).is_err());
    }
}
