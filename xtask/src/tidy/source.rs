//! Rust sources of the workspace, parsed.
//!
//! How it counts:
//!
//! - A source is a file `src/**/*.rs` of a package of the workspace (`crates/*`, `benches`, `xtask`).
//!   Files below `tests` and `benches` are tests and measurements.
//! - Tests within a source are left out: items and blocks under `#[cfg(test)]` or `#[test]`.

use std::{fs, path::Path};

use anyhow::{Context, Result};
use syn::visit_mut::{self, VisitMut};

/// A source file without its tests.
pub(crate) struct Source {
    /// Path from the root of the repository.
    pub(crate) path: String,
    /// Folder of the package.
    pub(crate) package: String,
    /// Names of the modules from the crate root down; empty for `lib.rs` and `main.rs`.
    pub(crate) module: Vec<String>,
    /// The whole text, tests included.
    pub(crate) text: String,
    /// The syntax without tests.
    pub(crate) syntax: syn::File,
}

/// Parses the sources among some files of the repository.
pub(crate) fn read(root: &Path, files: &[String]) -> Result<Vec<Source>> {
    let mut sources = Vec::new();
    for path in files {
        let Some((package, inside)) = split(path) else { continue };
        let Ok(text) = fs::read_to_string(root.join(path)) else { continue };
        sources.push(parse(path, package, inside, text)?);
    }
    Ok(sources)
}

/// Parses one file.
pub(crate) fn parse(path: &str, package: &str, inside: &str, text: String) -> Result<Source> {
    let mut syntax = syn::parse_file(&text).with_context(|| path.to_owned())?;
    WithoutTests.visit_file_mut(&mut syntax);
    Ok(Source {
        path: path.to_owned(),
        package: package.to_owned(),
        module: module_of(inside),
        text,
        syntax,
    })
}

/// Line of the beginning of a piece of syntax, from 1.
pub(crate) fn line_of(span: proc_macro2::Span) -> usize {
    span.start().line
}

/// A path's package and the rest of the path below the package's `src`.
fn split(path: &str) -> Option<(&str, &str)> {
    let is_rust = Path::new(path).extension().is_some_and(|extension| extension == "rs");
    let (package, inside) = path.split_once("/src/")?;
    let known = package.starts_with("crates/") || matches!(package, "benches" | "xtask");
    (is_rust && known).then_some((package, inside))
}

/// The modules that a path below `src` names.
fn module_of(inside: &str) -> Vec<String> {
    let stem = inside.strip_suffix(".rs").unwrap_or(inside);
    let mut names: Vec<String> = stem.split('/').map(str::to_owned).collect();
    if names.last().is_some_and(|last| last == "mod") || matches!(stem, "lib" | "main") {
        names.pop();
    }
    names
}

struct WithoutTests;

impl VisitMut for WithoutTests {
    fn visit_file_mut(&mut self, file: &mut syn::File) {
        file.items.retain(|item| !is_test(attributes(item)));
        visit_mut::visit_file_mut(self, file);
    }

    fn visit_item_mod_mut(&mut self, module: &mut syn::ItemMod) {
        if let Some((_, items)) = &mut module.content {
            items.retain(|item| !is_test(attributes(item)));
        }
        visit_mut::visit_item_mod_mut(self, module);
    }

    fn visit_item_impl_mut(&mut self, block: &mut syn::ItemImpl) {
        block.items.retain(|item| match item {
            syn::ImplItem::Fn(function) => !is_test(&function.attrs),
            syn::ImplItem::Const(constant) => !is_test(&constant.attrs),
            _ => true,
        });
        visit_mut::visit_item_impl_mut(self, block);
    }
}

/// Attributes of an item.
pub(crate) fn attributes(item: &syn::Item) -> &[syn::Attribute] {
    match item {
        syn::Item::Const(item) => &item.attrs,
        syn::Item::Enum(item) => &item.attrs,
        syn::Item::Fn(item) => &item.attrs,
        syn::Item::Impl(item) => &item.attrs,
        syn::Item::Macro(item) => &item.attrs,
        syn::Item::Mod(item) => &item.attrs,
        syn::Item::Static(item) => &item.attrs,
        syn::Item::Struct(item) => &item.attrs,
        syn::Item::Trait(item) => &item.attrs,
        syn::Item::Type(item) => &item.attrs,
        syn::Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::Path(path) => path.is_ident("test"),
        syn::Meta::List(list) if list.path.is_ident("cfg") => {
            matches!(list.tokens.to_string().as_str(), "test" | "doctest")
        }
        _ => false,
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A source of a crate `a`.
    pub(crate) fn source(inside: &str, text: &str) -> Source {
        parse(&format!("crates/a/src/{inside}"), "crates/a", inside, text.to_owned())
            .expect("the text is Rust")
    }

    #[test]
    fn modules_are_read_off_paths() {
        assert!(module_of("lib.rs").is_empty());
        assert_eq!(module_of("reader/csv.rs"), ["reader", "csv"]);
        assert_eq!(split("crates/a/src/b.rs"), Some(("crates/a", "b.rs")));
        assert_eq!(split("crates/a/tests/it/b.rs"), None);
    }

    #[test]
    fn tests_are_left_out() {
        let text = "fn a() {} #[cfg(test)] mod tests { fn b() {} } #[test] fn c() {}";
        assert_eq!(source("lib.rs", text).syntax.items.len(), 1);
    }
}
