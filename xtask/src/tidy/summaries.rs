//! Documentation whose first words cannot be read alone.
//!
//! How it counts:
//!
//! - The summary of an item is the first line of its documentation. Items are files, modules,
//!   types, fields, variants, functions, constants and macros outside tests, public or not.
//! - It may not begin with one of `BEGINNINGS`, as whole words: it would need the line above, or
//!   leave open what it is about.

use syn::{
    Attribute, Expr, Lit, Meta,
    spanned::Spanned,
    visit::{self, Visit},
};

use super::source::{Source, line_of};

/// Beginnings of a summary that lean on the line above.
const BEGINNINGS: [&str; 9] =
    ["The same", "What", "Whether", "Of", "It", "Its", "Those", "Their", "They"];

/// Summaries with such a beginning.
pub(crate) fn check(sources: &[Source]) -> Vec<String> {
    let mut problems = Vec::new();
    for source in sources {
        let mut summaries = Summaries { path: &source.path, problems: &mut problems };
        summaries.visit_file(&source.syntax);
    }
    problems
}

struct Summaries<'a> {
    path: &'a str,
    problems: &'a mut Vec<String>,
}

/// The text of a line of documentation.
fn line(attribute: &Attribute) -> Option<String> {
    let Meta::NameValue(pair) = &attribute.meta else { return None };
    let Expr::Lit(value) = &pair.value else { return None };
    let Lit::Str(text) = &value.lit else { return None };
    pair.path.is_ident("doc").then(|| text.value())
}

fn leaning(summary: &str) -> Option<&'static str> {
    BEGINNINGS.into_iter().find(|beginning| {
        let rest = summary.trim_start().strip_prefix(beginning);
        rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric()))
    })
}

impl Summaries<'_> {
    fn judge(&mut self, attributes: &[Attribute]) {
        let Some(first) = attributes.iter().find(|attribute| line(attribute).is_some()) else {
            return;
        };
        let Some(beginning) = line(first).as_deref().and_then(leaning) else { return };
        let at = line_of(first.span());
        self.problems.push(format!("{}:{at}: a summary begins with `{beginning}`", self.path));
    }
}

impl<'ast> Visit<'ast> for Summaries<'_> {
    fn visit_file(&mut self, file: &'ast syn::File) {
        self.judge(&file.attrs);
        visit::visit_file(self, file);
    }

    fn visit_item(&mut self, item: &'ast syn::Item) {
        self.judge(super::source::attributes(item));
        visit::visit_item(self, item);
    }

    fn visit_field(&mut self, field: &'ast syn::Field) {
        self.judge(&field.attrs);
        visit::visit_field(self, field);
    }

    fn visit_variant(&mut self, variant: &'ast syn::Variant) {
        self.judge(&variant.attrs);
        visit::visit_variant(self, variant);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        self.judge(&function.attrs);
        visit::visit_impl_item_fn(self, function);
    }

    fn visit_impl_item_const(&mut self, constant: &'ast syn::ImplItemConst) {
        self.judge(&constant.attrs);
    }

    fn visit_trait_item_fn(&mut self, function: &'ast syn::TraitItemFn) {
        self.judge(&function.attrs);
        visit::visit_trait_item_fn(self, function);
    }

    fn visit_trait_item_const(&mut self, constant: &'ast syn::TraitItemConst) {
        self.judge(&constant.attrs);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::source::tests::source;

    #[test]
    fn the_first_line_of_each_item_is_read() {
        let text = "//! A file.\n/// What it is.\nstruct A {\n    /// Offset.\n    /// Of something.\n    \
                    b: u8,\n    /// The same.\n    c: u8,\n}";
        let problems = check(&[source("lib.rs", text)]);
        assert_eq!(problems.len(), 2, "{problems:?}");
        assert!(problems[0].contains("lib.rs:2: ") && problems[1].contains("lib.rs:7: "));
    }

    #[test]
    fn pronouns_begin_no_summary() {
        for summary in ["It is told.", "Its name.", "Those of it.", "Their box.", "They go."] {
            assert!(leaning(summary).is_some(), "{summary}");
        }
        for summary in ["Item of a list.", "Iterations.", "Theirs is no word of ours."] {
            assert_eq!(leaning(summary), None, "{summary}");
        }
    }
}
