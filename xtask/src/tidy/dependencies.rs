//! Dependencies that are declared and not used.

use std::{collections::BTreeSet, fs, path::Path};

use anyhow::{Context, Result};
use cargo_metadata::{Dependency, DependencyKind, Metadata, Package};

/// Folders of a package whose code ships with it.
const SHIPPED: [&str; 1] = ["src"];

/// Folders of a package that hold code at all.
const ALL: [&str; 4] = ["src", "tests", "benches", "examples"];

/// Dependencies that no code of their package names, and entries of the workspace's table that no
/// package takes.
///
/// A normal dependency has to be named in `src` outside of comments, a build dependency in
/// `build.rs`, a dependency of tests anywhere, examples in comments included. Named means
/// `name::…` or `use name`; a package that brings a feature of another along says so by
/// `use name as _`.
pub(super) fn unused(root: &Path, metadata: &Metadata) -> Result<Vec<String>> {
    let mut problems = Vec::new();
    let mut taken = BTreeSet::new();
    for package in metadata.workspace_packages() {
        taken.extend(package.dependencies.iter().map(|dependency| dependency.name.clone()));
        problems.extend(unused_by(package)?);
    }
    let manifest: toml::Table = toml::from_str(&fs::read_to_string(root.join("Cargo.toml"))?)?;
    let listed = manifest
        .get("workspace")
        .and_then(|workspace| workspace.get("dependencies"))
        .and_then(|table| table.as_table())
        .context("Cargo.toml has no table workspace.dependencies")?;
    for (key, entry) in listed {
        let name = entry.get("package").and_then(|name| name.as_str()).unwrap_or(key);
        let ours = entry.get("path").is_some();
        if !ours && !taken.contains(name) {
            problems.push(format!("Cargo.toml lists `{key}`, which no package takes"));
        }
    }
    Ok(problems)
}

/// Dependencies that the code of one package does not name.
fn unused_by(package: &Package) -> Result<Vec<String>> {
    let folder = package.manifest_path.parent().context("a manifest lies in a folder")?;
    let text_of = |folders: &[&str]| -> Result<String> {
        let mut text = String::new();
        for name in folders {
            read(folder.join(name).as_std_path(), &mut text)?;
        }
        Ok(text)
    };
    let everything = text_of(&ALL)?;
    let shipped = without_comments(&text_of(&SHIPPED)?);
    let build = fs::read_to_string(folder.join("build.rs")).unwrap_or_default();
    let is_used = |dependency: &Dependency| {
        let name = dependency.rename.as_ref().unwrap_or(&dependency.name).replace('-', "_");
        match dependency.kind {
            DependencyKind::Development => names(&everything, &name),
            DependencyKind::Build => names(&build, &name),
            _ => names(&shipped, &name),
        }
    };
    let not_itself = package.dependencies.iter().filter(|used| used.name != package.name.as_str());
    Ok(not_itself
        .filter(|dependency| !is_used(dependency))
        .map(|dependency| format!("`{}` does not name `{}`", package.name, dependency.name))
        .collect())
}

/// Joins the Rust files of a folder and those below it.
fn read(folder: &Path, text: &mut String) -> Result<()> {
    let Ok(entries) = fs::read_dir(folder) else { return Ok(()) };
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() {
            read(&path, text)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            text.push_str(&fs::read_to_string(&path)?);
        }
    }
    Ok(())
}

/// The lines that are code.
fn without_comments(text: &str) -> String {
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    code.flat_map(|line| [line, "\n"]).collect()
}

/// True where `name::` or `use name` stands in the text as a word.
fn names(text: &str, name: &str) -> bool {
    let in_word = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(name).any(|(at, _)| {
        let (before, after) = (&text[..at], &text[at + name.len()..]);
        let begins = before.chars().next_back().is_none_or(|c| !in_word(c));
        let path = after.starts_with("::");
        let import = before.ends_with("use ") && !after.starts_with(in_word);
        begins && (path || import)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_a_path_or_an_import() {
        for used in ["a::b();", "use a;", "use a as _;", "pub use a::{B};", "<a::B as C>::d"] {
            assert!(names(used, "a"), "{used}");
        }
        for unused in ["b::a();", "use ab::c;", "// a", "use b_a::c;", "let a = 1;", ""] {
            assert!(!names(unused, "a"), "{unused}");
        }
    }

    #[test]
    fn comments_are_not_code() {
        let text = "//! uses a::b\nfn f() {\n    // a::b\n    c::d();\n}\n";
        assert!(!names(&without_comments(text), "a"));
        assert!(names(&without_comments(text), "c"));
    }
}
