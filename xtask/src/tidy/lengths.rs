//! Lengths of files and functions.
//!
//! How it counts:
//!
//! - A file has all its lines, tests included. Above 800 it says why in a line of its head,
//!   `//! Longer than 800 lines: REASON`.
//! - A function has the lines from the one with `fn` to its closing brace, signature included,
//!   documentation and attributes left out. Functions without a body and tests do not count.

use syn::{
    spanned::Spanned,
    visit::{self, Visit},
};

use super::source::{Source, line_of};

/// Most lines of a file without a reason.
const FILE_LINES: usize = 800;
/// Beginning of the reason.
const REASON: &str = "//! Longer than 800 lines: ";
/// Most lines of a function.
const FUNCTION_LINES: usize = 80;

/// Files that are too long and do not say why.
pub(crate) fn files(sources: &[Source]) -> Vec<String> {
    let told = |source: &Source| {
        let head =
            source.text.lines().take_while(|line| line.starts_with("//!") || line.is_empty());
        head.into_iter().any(|line| line.strip_prefix(REASON).is_some_and(|why| !why.is_empty()))
    };
    let over = |source: &&Source| source.text.lines().count() > FILE_LINES && !told(source);
    let problem = |source: &Source| {
        let count = source.text.lines().count();
        format!("{}: {count} lines, expected {FILE_LINES} or fewer, or a reason", source.path)
    };
    sources.iter().filter(over).map(problem).collect()
}

/// Functions that are too long.
pub(crate) fn functions(sources: &[Source]) -> Vec<String> {
    let mut problems = Vec::new();
    for source in sources {
        let mut lengths = Lengths { path: &source.path, problems: &mut problems };
        lengths.visit_file(&source.syntax);
    }
    problems
}

struct Lengths<'a> {
    path: &'a str,
    problems: &'a mut Vec<String>,
}

impl Lengths<'_> {
    fn judge(&mut self, signature: &syn::Signature, body: &syn::Block) {
        let first = line_of(signature.fn_token.span());
        let count = body.brace_token.span.close().end().line + 1 - first;
        if count > FUNCTION_LINES {
            self.problems.push(format!(
                "{}:{first}: `{}` has {count} lines, expected {FUNCTION_LINES} or fewer",
                self.path, signature.ident
            ));
        }
    }
}

impl<'ast> Visit<'ast> for Lengths<'_> {
    fn visit_item_fn(&mut self, function: &'ast syn::ItemFn) {
        self.judge(&function.sig, &function.block);
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        self.judge(&function.sig, &function.block);
        visit::visit_impl_item_fn(self, function);
    }

    fn visit_trait_item_fn(&mut self, function: &'ast syn::TraitItemFn) {
        if let Some(body) = &function.default {
            self.judge(&function.sig, body);
        }
        visit::visit_trait_item_fn(self, function);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::source::tests::source;

    #[test]
    fn functions_are_measured_from_fn_to_the_brace() {
        let body =
            |lines: usize| format!("/// Doc.\n#[inline]\nfn f() {{\n{}}}\n", "\n".repeat(lines));
        assert!(functions(&[source("lib.rs", &body(78))]).is_empty());
        let problems = functions(&[source("lib.rs", &body(79))]);
        assert_eq!(problems, ["crates/a/src/lib.rs:3: `f` has 81 lines, expected 80 or fewer"]);
    }

    #[test]
    fn a_long_file_gives_a_reason() {
        let lines = "\n".repeat(801);
        assert_eq!(files(&[source("a.rs", &format!("//! A.\n{lines}"))]).len(), 1);
        let told = format!("//! A.\n//! Longer than 800 lines: one table.\n{lines}");
        assert!(files(&[source("a.rs", &told)]).is_empty());
    }
}
