//! Circles of imports between the files of a crate.
//!
//! How it counts:
//!
//! - A file uses another when a path outside its tests leads into the module of that file: paths
//!   that begin with `crate`, `self`, `super` or a child module, in `use` items and in code alike.
//! - A re-export (`pub use`, with or without a restriction) is no use of the file that it names.
//!   A path to a re-exported name uses the file in which the name is defined.
//! - A path to a name of the module itself is no use.
//! - A circle is a strongly connected component of this graph, found by Tarjan's algorithm.

use std::collections::{BTreeMap, BTreeSet};

use syn::{
    UseTree,
    visit::{self, Visit},
};

use super::source::Source;

/// Most files that may use one another in a circle.
const MOST_FILES: usize = 3;

/// Circles over too many files.
pub(crate) fn check(sources: &[Source]) -> Vec<String> {
    let packages: BTreeSet<&str> = sources.iter().map(|source| source.package.as_str()).collect();
    let mut problems = Vec::new();
    for package in packages {
        let files: Vec<&Source> = sources.iter().filter(|s| s.package == package).collect();
        for circle in circles(&uses(&files)) {
            if circle.len() > MOST_FILES {
                let names: Vec<&str> = circle.iter().map(|&file| inside(files[file])).collect();
                problems.push(format!(
                    "{package}: {} files use one another in a circle, expected {MOST_FILES} or \
                     fewer: {}",
                    circle.len(),
                    names.join(", ")
                ));
            }
        }
    }
    problems
}

fn inside(file: &Source) -> &str {
    file.path.split_once("/src/").map_or(file.path.as_str(), |(_, inside)| inside)
}

type Names = Vec<String>;

/// The crate as modules: which file each is in, and which names each passes on.
struct Modules {
    files: BTreeMap<Names, usize>,
    passed_on: BTreeMap<Names, BTreeMap<String, Names>>,
}

/// For each file the files that it uses.
fn uses(files: &[&Source]) -> Vec<BTreeSet<usize>> {
    let mut modules = Modules { files: BTreeMap::new(), passed_on: BTreeMap::new() };
    for (place, file) in files.iter().enumerate() {
        modules.files.insert(file.module.clone(), place);
    }
    let mut found = Vec::with_capacity(files.len());
    for file in files {
        let mut paths =
            Paths { module: file.module.clone(), uses: Vec::new(), exports: Vec::new() };
        paths.visit_file(&file.syntax);
        for (module, name, target) in std::mem::take(&mut paths.exports) {
            if let Some(target) = modules.absolute(&module, &target) {
                modules.passed_on.entry(module).or_default().insert(name, target);
            }
        }
        found.push(paths.uses);
    }
    let resolve = |(own, paths): (usize, &Vec<(Names, Names)>)| {
        let targets = paths.iter().filter_map(|(module, path)| {
            let path = modules.absolute(module, path)?;
            modules.file_of(&path, 0)
        });
        targets.filter(|&file| file != own).collect()
    };
    found.iter().enumerate().map(resolve).collect()
}

impl Modules {
    /// A path from the crate root; `None` where it leads out of the crate.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<Names> {
        let first = path.first()?.as_str();
        let mut base = match first {
            "crate" => Names::new(),
            "self" | "super" => module.to_vec(),
            _ => {
                let mut child = module.to_vec();
                child.push(first.to_owned());
                return self.files.contains_key(&child).then(|| [module, path].concat());
            }
        };
        let mut rest = path;
        while let Some((first, after)) = rest.split_first() {
            match first.as_str() {
                "crate" | "self" => {}
                "super" => {
                    base.pop()?;
                }
                _ => break,
            }
            rest = after;
        }
        base.extend(rest.iter().cloned());
        Some(base)
    }

    /// The file in which the last name of a path is defined.
    fn file_of(&self, path: &[String], depth: usize) -> Option<usize> {
        // a name that is passed on in a circle is defined nowhere
        if depth > 8 {
            return None;
        }
        for length in (0..=path.len()).rev() {
            let (module, rest) = path.split_at(length);
            let Some(&file) = self.files.get(module) else { continue };
            let passed = self.passed_on.get(module);
            if let Some((name, after)) = rest.split_first()
                && let Some(target) = passed.and_then(|names| names.get(name))
            {
                return self.file_of(&[target.as_slice(), after].concat(), depth + 1);
            }
            return Some(file);
        }
        None
    }
}

/// The paths of a file.
struct Paths {
    module: Names,
    uses: Vec<(Names, Names)>,
    exports: Vec<(Names, String, Names)>,
}

impl Paths {
    fn tree(&mut self, tree: &UseTree, before: &[String], exported: bool) {
        let with = |name: String| [before, &[name]].concat();
        match tree {
            UseTree::Path(path) => self.tree(&path.tree, &with(path.ident.to_string()), exported),
            UseTree::Name(name) if name.ident == "self" => {
                self.note(before.to_vec(), None, exported);
            }
            UseTree::Name(name) => self.note(with(name.ident.to_string()), None, exported),
            UseTree::Rename(to) => {
                let name = Some(to.rename.to_string());
                self.note(with(to.ident.to_string()), name, exported);
            }
            UseTree::Glob(_) => self.note(before.to_vec(), None, false),
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.tree(tree, before, exported);
                }
            }
        }
    }

    fn note(&mut self, path: Names, name: Option<String>, exported: bool) {
        let Some(name) = name.or_else(|| path.last().cloned()) else { return };
        if exported {
            self.exports.push((self.module.clone(), name, path));
        } else {
            self.uses.push((self.module.clone(), path));
        }
    }
}

impl<'ast> Visit<'ast> for Paths {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let exported = !matches!(item.vis, syn::Visibility::Inherited);
        self.tree(&item.tree, &[], exported);
    }

    fn visit_item_mod(&mut self, module: &'ast syn::ItemMod) {
        self.module.push(module.ident.to_string());
        visit::visit_item_mod(self, module);
        self.module.pop();
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Names = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if names.len() > 1 {
            self.uses.push((self.module.clone(), names));
        }
        visit::visit_path(self, path);
    }
}

/// Strongly connected components.
fn circles(uses: &[BTreeSet<usize>]) -> Vec<Vec<usize>> {
    let mut search = Tarjan {
        uses,
        index: vec![None; uses.len()],
        low: vec![0; uses.len()],
        on_stack: vec![false; uses.len()],
        stack: Vec::new(),
        count: 0,
        found: Vec::new(),
    };
    for file in 0..uses.len() {
        if search.index[file].is_none() {
            search.connect(file);
        }
    }
    search.found
}

struct Tarjan<'a> {
    uses: &'a [BTreeSet<usize>],
    index: Vec<Option<usize>>,
    low: Vec<usize>,
    on_stack: Vec<bool>,
    stack: Vec<usize>,
    count: usize,
    found: Vec<Vec<usize>>,
}

impl Tarjan<'_> {
    fn connect(&mut self, file: usize) {
        self.index[file] = Some(self.count);
        self.low[file] = self.count;
        self.count += 1;
        self.stack.push(file);
        self.on_stack[file] = true;
        for &used in &self.uses[file] {
            match self.index[used] {
                None => {
                    self.connect(used);
                    self.low[file] = self.low[file].min(self.low[used]);
                }
                Some(index) if self.on_stack[used] => {
                    self.low[file] = self.low[file].min(index);
                }
                Some(_) => {}
            }
        }
        if Some(self.low[file]) == self.index[file] {
            let begin = self.stack.iter().rposition(|&on| on == file).unwrap_or(0);
            let mut circle = self.stack.split_off(begin);
            for &member in &circle {
                self.on_stack[member] = false;
            }
            circle.sort_unstable();
            self.found.push(circle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::source::tests::source;

    fn ring(last: &str) -> Vec<Source> {
        vec![
            source("lib.rs", "mod a; mod b; mod c; mod d; pub use a::A;"),
            source("a.rs", "use crate::b::B; pub struct A;"),
            source("b.rs", "fn f() { crate::c::g(); }"),
            source("c.rs", "use super::d::D;"),
            source("d.rs", last),
        ]
    }

    #[test]
    fn a_circle_is_found_through_a_re_export() {
        let problems = check(&ring("use crate::A;"));
        assert_eq!(problems.len(), 1);
        assert!(problems[0].ends_with("a.rs, b.rs, c.rs, d.rs"), "{problems:?}");
    }

    #[test]
    fn uses_in_tests_and_of_other_crates_make_no_circle() {
        let text = "use other::A; #[cfg(test)] mod tests { use crate::a::A; }";
        assert!(check(&ring(text)).is_empty());
    }
}
