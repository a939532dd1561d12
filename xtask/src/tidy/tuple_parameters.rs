//! Functions with a parameter of tuple type.
//!
//! How it counts:
//!
//! - Functions and methods outside tests count, with or without a body. Closures do not, nor
//!   methods of `impl TRAIT for TYPE`, whose parameters the trait imposes.
//! - A parameter is of tuple type when its type, references and slices taken off, is a tuple that
//!   is not empty. `Option<(f64, f64)>` is none.
//! - The share is taken over the workspace.

use syn::{
    Type,
    visit::{self, Visit},
};

use super::source::{Source, line_of};

/// Functions of a thousand that may have a parameter of tuple type.
const PER_MILLE: usize = 10;

/// The functions, where there are too many.
pub(crate) fn check(sources: &[Source]) -> Vec<String> {
    let (mut count, mut found) = (0, Vec::new());
    for source in sources {
        let mut functions = Functions { path: &source.path, count: 0, found: &mut found };
        functions.visit_file(&source.syntax);
        count += functions.count;
    }
    if found.is_empty() || 1000 * found.len() < PER_MILLE * count {
        return Vec::new();
    }
    let head = format!(
        "{} of {count} functions have a parameter of tuple type, expected less than {} %",
        found.len(),
        PER_MILLE / 10
    );
    [vec![head], found].concat()
}

struct Functions<'a> {
    path: &'a str,
    count: usize,
    found: &'a mut Vec<String>,
}

impl Functions<'_> {
    fn judge(&mut self, signature: &syn::Signature) {
        self.count += 1;
        let tupled = signature.inputs.iter().any(|input| match input {
            syn::FnArg::Typed(typed) => is_tuple(&typed.ty),
            syn::FnArg::Receiver(_) => false,
        });
        if tupled {
            let line = line_of(signature.fn_token.span);
            self.found.push(format!("{}:{line}: `{}` takes a tuple", self.path, signature.ident));
        }
    }
}

fn is_tuple(of: &Type) -> bool {
    match of {
        Type::Tuple(tuple) => !tuple.elems.is_empty(),
        Type::Reference(reference) => is_tuple(&reference.elem),
        Type::Slice(slice) => is_tuple(&slice.elem),
        Type::Paren(inner) => is_tuple(&inner.elem),
        _ => false,
    }
}

impl<'ast> Visit<'ast> for Functions<'_> {
    fn visit_item_fn(&mut self, function: &'ast syn::ItemFn) {
        self.judge(&function.sig);
        visit::visit_item_fn(self, function);
    }

    fn visit_item_impl(&mut self, block: &'ast syn::ItemImpl) {
        for item in &block.items {
            if let syn::ImplItem::Fn(function) = item {
                if block.trait_.is_none() {
                    self.judge(&function.sig);
                }
                self.visit_block(&function.block);
            }
        }
    }

    fn visit_trait_item_fn(&mut self, function: &'ast syn::TraitItemFn) {
        self.judge(&function.sig);
        visit::visit_trait_item_fn(self, function);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::source::tests::source;

    #[test]
    fn tuples_are_told_from_what_holds_them() {
        let tupled = |parameter: &str| {
            !check(&[source("lib.rs", &format!("fn f(x: {parameter}) {{}}"))]).is_empty()
        };
        assert!(tupled("(f64, f64)") && tupled("&[(usize, f64)]"));
        assert!(!tupled("Option<(f64, f64)>") && !tupled("()"));
    }

    #[test]
    fn traits_impose_theirs() {
        let text = "impl From<(f64, f64)> for A { fn from((x, y): (f64, f64)) -> Self { A } }";
        assert!(check(&[source("lib.rs", text)]).is_empty());
    }
}
