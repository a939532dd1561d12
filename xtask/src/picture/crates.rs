//! The crates of the workspace by layer, with an arrow from each to what it uses.
//!
//! Names, descriptions and edges are those of `cargo metadata`. A crate stands above all that it
//! uses. An arrow that follows from others is left out, and so is a crate that only tests use. The
//! columns are chosen so that no arrow runs behind a box.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use anyhow::{Context, Result};
use cargo_metadata::{DependencyKind, MetadataCommand};

use super::svg::{Svg, TextBox, wrapped};

const WIDTH: f64 = 196.0;
const COLUMN: f64 = 220.0;
const ROW: f64 = 172.0;
const HEIGHT: f64 = 120.0;
const MARGIN: f64 = 20.0;
/// Characters of a line in a box.
const CHARACTERS: usize = 30;
/// Fill of a published crate, and of one for the workspace alone.
const FILLS: [&str; 2] = ["#e8f0fb", "#f3f0e6"];

/// Column of each crate, from the left; parts of a column are allowed.
const COLUMNS: [(&str, f64); 15] = [
    ("xtask", 3.8),
    ("validation", 3.2),
    ("fdi-cli", 4.4),
    ("experiments", 1.8),
    ("fdi-benches", 0.6),
    ("fdi-core", 1.2),
    ("fdi-report", 0.3),
    ("greybox", 4.4),
    ("own-model", 6.3),
    ("recordings", 0.0),
    ("gp-bayesopt", 0.95),
    ("reduction", 1.9),
    ("ema-sim", 2.85),
    ("inference", 3.8),
    ("greybox-blind", 5.4),
];

/// A crate of the workspace.
struct Member {
    description: String,
    published: bool,
    uses: BTreeSet<String>,
}

type Members = BTreeMap<String, Member>;

/// The drawing.
pub(super) fn drawing(root: &Path) -> Result<String> {
    let members = members(root)?;
    let rows = rows(&members);
    let most = COLUMNS.iter().map(|(_, column)| *column).fold(0.0, f64::max);
    let width = 2.0 * MARGIN + most * COLUMN + WIDTH;
    let height = 2.0 * MARGIN + (rows.len() as f64 - 1.0) * ROW + HEIGHT + 24.0;
    let mut svg = Svg::new(width, height);
    let mut places = BTreeMap::new();
    for (row, names) in rows.iter().enumerate() {
        for name in names {
            let column = COLUMNS.iter().find(|(of, _)| of == name);
            let (_, column) = column.with_context(|| format!("`{name}` has no column here"))?;
            places.insert(name.as_str(), [MARGIN + column * COLUMN, MARGIN + row as f64 * ROW]);
        }
    }
    for (name, [left, top]) in &places {
        let mut direct = direct(&members, name);
        direct.sort_by(|a, b| places[a.as_str()][0].total_cmp(&places[b.as_str()][0]));
        for (place, used) in direct.iter().enumerate() {
            let [to_left, to_top] = places[used.as_str()];
            let spread = (place as f64 + 1.0) / (direct.len() as f64 + 1.0);
            svg.down([left + spread * WIDTH, top + HEIGHT], [to_left + WIDTH / 2.0, to_top]);
        }
    }
    for (name, [left, top]) in &places {
        let member = &members[*name];
        svg.text_box(&TextBox {
            left: *left,
            top: *top,
            width: WIDTH,
            height: HEIGHT,
            title: name,
            lines: &wrapped(&member.description, CHARACTERS),
            fill: FILLS[usize::from(!member.published)],
        });
    }
    svg.label(
        MARGIN,
        height - 12.0,
        "Arrows point to what a crate uses; one that follows from others is left out, as are crates that only tests use. Blue: published. Yellow: for the workspace alone.",
    );
    Ok(svg.finish("The crates of the workspace and what each uses"))
}

fn members(root: &Path) -> Result<Members> {
    let metadata = MetadataCommand::new().current_dir(root).exec().context("cargo metadata")?;
    let packages = metadata.workspace_packages();
    let known: BTreeSet<&str> = packages.iter().map(|package| package.name.as_str()).collect();
    let member = |package: &&cargo_metadata::Package| {
        let normal = package.dependencies.iter().filter(|used| used.kind == DependencyKind::Normal);
        let within = normal.map(|used| used.name.as_str()).filter(|name| known.contains(name));
        let member = Member {
            description: package.description.clone().unwrap_or_default(),
            published: package.publish.as_ref().is_none_or(|registries| !registries.is_empty()),
            uses: within.map(str::to_owned).collect(),
        };
        (package.name.to_string(), member)
    };
    let mut all: Members = packages.iter().map(member).collect();
    let used: BTreeSet<String> = all.values().flat_map(|member| member.uses.clone()).collect();
    // what neither uses nor is used stands in tests alone
    all.retain(|name, member| !member.uses.is_empty() || used.contains(name));
    Ok(all)
}

/// The crates by layer, the users first; those that nothing uses stand just above what they use.
fn rows(members: &Members) -> Vec<Vec<String>> {
    let mut rows: Vec<Vec<String>> = Vec::new();
    for name in members.keys() {
        let depth = depth(members, name);
        while rows.len() <= depth {
            rows.push(Vec::new());
        }
        rows[depth].push(name.clone());
    }
    rows.reverse();
    rows
}

/// Length of the longest way down from a crate.
fn depth(members: &Members, name: &str) -> usize {
    members[name].uses.iter().map(|used| 1 + depth(members, used)).max().unwrap_or(0)
}

/// Crates that a crate uses and none of the others that it uses does.
fn direct(members: &Members, name: &str) -> Vec<String> {
    let uses = &members[name].uses;
    let follows =
        |used: &str| uses.iter().any(|other| other != used && reaches(members, other, used));
    uses.iter().filter(|used| !follows(used)).cloned().collect()
}

fn reaches(members: &Members, from: &str, to: &str) -> bool {
    members[from].uses.iter().any(|used| used == to || reaches(members, used, to))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_and_arrows_follow_the_uses() {
        let member = |uses: &[&str]| Member {
            description: String::new(),
            published: true,
            uses: uses.iter().map(|name| (*name).to_owned()).collect(),
        };
        let members = Members::from([
            ("a".to_owned(), member(&["b", "c"])),
            ("b".to_owned(), member(&["c"])),
            ("c".to_owned(), member(&[])),
        ]);
        assert_eq!(rows(&members), [["a"], ["b"], ["c"]]);
        assert_eq!(direct(&members, "a"), ["b"]);
    }
}
