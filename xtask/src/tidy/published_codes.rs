//! Published codes that nothing gives, or that nobody explains.
//!
//! How it counts:
//!
//! - A published code is a variant of a public enum of `crates/fdi-report` that is serialised and
//!   whose variants have no fields.
//! - It is documented when it has a doc comment.
//! - It is given when an expression `ENUM::VARIANT` stands outside tests and outside the enum's own
//!   `impl` blocks in the file of its definition: in code, or among the arguments of a macro that
//!   are expressions. A pattern and the arguments of `matches!` are no expressions.
//! - Enums that number things or are what a user chooses from, listed in `WHOLE`, are given as a whole.

use std::collections::BTreeSet;

use syn::{
    Expr, Type,
    parse::Parser,
    punctuated::Punctuated,
    visit::{self, Visit},
};

use super::source::{Source, line_of};

/// The crate of the published types.
const PUBLISHED: &str = "crates/fdi-report";

/// Enums that are given as a whole: every answer lists all faults, every bundle all encodings, and
/// `fdi schema` takes any form.
const WHOLE: [&str; 4] = ["Encoding", "FaultId", "Schema", "ToleranceUse"];

/// A code: its enum, its name, and where it is defined.
struct Code {
    of: String,
    name: String,
    path: String,
    line: usize,
    documented: bool,
}

/// Codes that are not documented or never given.
pub(crate) fn check(sources: &[Source]) -> Vec<String> {
    let codes: Vec<Code> =
        sources.iter().filter(|s| s.package == PUBLISHED).flat_map(codes).collect();
    let mut given = BTreeSet::new();
    for source in sources {
        let mut visitor =
            Given { path: &source.path, within: None, codes: &codes, found: &mut given };
        visitor.visit_file(&source.syntax);
    }
    let mut problems = Vec::new();
    for code in &codes {
        let Code { of, name, path, line, documented } = code;
        if !documented {
            problems
                .push(format!("{path}:{line}: `{of}::{name}` is published without documentation"));
        }
        if !WHOLE.contains(&of.as_str()) && !given.contains(&(of.clone(), name.clone())) {
            problems.push(format!("{path}:{line}: `{of}::{name}` is published and never given"));
        }
    }
    problems
}

/// The codes that a file defines.
fn codes(source: &Source) -> Vec<Code> {
    let enums = source.syntax.items.iter().filter_map(|item| match item {
        syn::Item::Enum(of) if is_published(of) => Some(of),
        _ => None,
    });
    let code = |of: &syn::ItemEnum, variant: &syn::Variant| Code {
        of: of.ident.to_string(),
        name: variant.ident.to_string(),
        path: source.path.clone(),
        line: line_of(variant.ident.span()),
        documented: variant.attrs.iter().any(|attribute| attribute.path().is_ident("doc")),
    };
    enums
        .flat_map(|of| of.variants.iter().map(move |v| (of, v)))
        .map(|(of, v)| code(of, v))
        .collect()
}

fn is_published(of: &syn::ItemEnum) -> bool {
    let serialised = of.attrs.iter().any(|attribute| match &attribute.meta {
        syn::Meta::List(list) if list.path.is_ident("derive") => {
            list.tokens.to_string().contains("Serialize")
        }
        _ => false,
    });
    let plain = of.variants.iter().all(|variant| variant.fields.is_empty());
    serialised && plain && matches!(of.vis, syn::Visibility::Public(_))
}

struct Given<'a> {
    path: &'a str,
    /// Type whose `impl` this is.
    within: Option<String>,
    codes: &'a [Code],
    found: &'a mut BTreeSet<(String, String)>,
}

impl<'ast> Visit<'ast> for Given<'_> {
    fn visit_item_impl(&mut self, block: &'ast syn::ItemImpl) {
        let Type::Path(of) = block.self_ty.as_ref() else {
            return visit::visit_item_impl(self, block);
        };
        let name = of.path.segments.last().map(|segment| segment.ident.to_string());
        let before = std::mem::replace(&mut self.within, name);
        visit::visit_item_impl(self, block);
        self.within = before;
    }

    fn visit_pat(&mut self, pattern: &'ast syn::Pat) {
        // the paths of a pattern are no expressions
        if !matches!(pattern, syn::Pat::Path(_)) {
            visit::visit_pat(self, pattern);
        }
    }

    fn visit_expr_path(&mut self, path: &'ast syn::ExprPath) {
        let mut names = path.path.segments.iter().rev().map(|segment| segment.ident.to_string());
        let (Some(name), Some(of)) = (names.next(), names.next()) else { return };
        let of = if of == "Self" { self.within.clone().unwrap_or_default() } else { of };
        let own = |code: &Code| {
            code.of == of && code.path == self.path && self.within.as_ref() == Some(&of)
        };
        if !self.codes.iter().any(own) {
            self.found.insert((of, name));
        }
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        if call.path.is_ident("matches") {
            return;
        }
        let arguments = Punctuated::<Expr, syn::Token![,]>::parse_terminated;
        let Ok(arguments) = arguments.parse2(call.tokens.clone()) else { return };
        // the tree lives no longer than this call: its paths are taken at once
        let mut inner = Given {
            path: self.path,
            within: self.within.clone(),
            codes: self.codes,
            found: &mut *self.found,
        };
        for argument in &arguments {
            inner.visit_expr(argument);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::source::parse;

    fn found(user: &str) -> Vec<String> {
        let published = "#[derive(Serialize)] pub enum Code { /// One.\nA, /// Two.\nB } \
                         impl Code { const ALL: [Self; 2] = [Self::A, Self::B]; }";
        let file = |package: &str, text: &str| {
            parse(&format!("{package}/src/lib.rs"), package, "lib.rs", text.to_owned())
        };
        let sources = [file(PUBLISHED, published), file("crates/b", user)];
        check(&sources.map(|source| source.expect("the text is Rust")))
    }

    #[test]
    fn a_code_is_given_by_an_expression() {
        assert_eq!(found("fn f() { g(Code::A); vec![Code::B]; }"), Vec::<String>::new());
        let problems = found("fn f(c: Code) -> bool { g(Code::A); matches!(c, Code::B) }");
        assert_eq!(problems.len(), 1, "{problems:?}");
        assert!(problems[0].ends_with("`Code::B` is published and never given"));
        assert_eq!(found("fn f(c: Code) { match c { Code::A | Code::B => {} } }").len(), 2);
    }
}
