//! The generated pages under `docs/validation/`.
//!
//! A page is one file in this folder with two functions: `quick`, figures that
//! anyone can recompute in seconds (deterministic, compared by `--check`), and
//! `text`, the whole page as Markdown.

mod as_recorded;
mod bar;
mod bayesopt;
mod chance;
mod clocks;
mod compared;
mod cranfield;
mod detection_limits;
mod diagnosis;
mod experiments;
pub(crate) mod explaining;
mod fidelity;
mod figure;
mod load;
mod machine;
mod measured;
#[cfg(test)]
mod pieces;
mod planned;
mod plot;
mod real_recordings;
mod reduction;
mod section;
mod setup;
mod several;
mod signal_chain;
mod simulated_sets;
mod simulator;
mod units;
mod voltage;

use std::{fs, path::Path};

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};

use self::{
    figure::{Figure, Rendered},
    section::{Section, with_section},
};

/// The quick figures of a page as they are stored beside it.
#[derive(Debug, Serialize, Deserialize)]
struct Stored {
    figure: Vec<Figure>,
}

/// A generated page.
struct Page {
    name: &'static str,
    quick: fn() -> Result<Vec<Figure>>,
    text: fn(&[Figure]) -> Result<Rendered>,
}

/// Pages whose sections can be rebuilt one by one.
const SECTIONED: &[(&str, &[Section])] = &[
    ("experiments", experiments::SECTIONS),
    ("measured", measured::SECTIONS),
    ("planned", planned::SECTIONS),
    ("signal-chain", signal_chain::SECTIONS),
    ("units", units::SECTIONS),
    ("voltage", voltage::SECTIONS),
];

/// Every page, in the order of the paper's pipeline.
const PAGES: &[Page] = &[
    Page {
        name: "simulator",
        quick: simulator::quick,
        text: |f| simulator::text(f).map(Into::into),
    },
    Page {
        name: "reduction",
        quick: reduction::quick,
        text: |f| reduction::text(f).map(Into::into),
    },
    Page { name: "bayesopt", quick: bayesopt::quick, text: |f| bayesopt::text(f).map(Into::into) },
    Page {
        name: "diagnosis",
        quick: diagnosis::quick,
        text: |f| diagnosis::text(f).map(Into::into),
    },
    Page { name: "experiments", quick: experiments::quick, text: experiments::text },
    Page {
        name: "real-recordings",
        quick: real_recordings::quick,
        text: |f| real_recordings::text(f).map(Into::into),
    },
    Page {
        name: "as-recorded",
        quick: as_recorded::quick,
        text: |_| as_recorded::text().map(Into::into),
    },
    Page { name: "load", quick: load::quick, text: |_| load::text().map(Into::into) },
    Page { name: "clocks", quick: clocks::quick, text: |_| clocks::text().map(Into::into) },
    Page { name: "setup", quick: setup::quick, text: |_| setup::text().map(Into::into) },
    Page {
        name: "explaining",
        quick: explaining::quick,
        text: |_| explaining::text().map(Into::into),
    },
    Page {
        name: "simulated-sets",
        quick: simulated_sets::quick,
        text: |_| simulated_sets::text().map(Into::into),
    },
    Page {
        name: "strata",
        quick: simulated_sets::strata::quick,
        text: |_| simulated_sets::strata::text().map(Into::into),
    },
    Page { name: "fidelity", quick: fidelity::quick, text: |f| fidelity::text(f).map(Into::into) },
    Page { name: "planned", quick: planned::quick, text: |_| planned::text().map(Into::into) },
    Page { name: "tests", quick: several::quick, text: |_| several::text().map(Into::into) },
    Page { name: "voltage", quick: voltage::quick, text: |_| voltage::text().map(Into::into) },
    Page { name: "units", quick: units::quick, text: |_| units::text() },
    Page { name: "measured", quick: measured::quick, text: |f| measured::text(f).map(Into::into) },
    Page {
        name: "signal-chain",
        quick: signal_chain::quick,
        text: |_| signal_chain::text().map(Into::into),
    },
    Page {
        name: "detection-limits",
        quick: detection_limits::quick,
        text: |_| detection_limits::text().map(Into::into),
    },
    Page {
        name: "cranfield",
        quick: cranfield::quick,
        text: |_| cranfield::text().map(Into::into),
    },
];

/// Rebuilds the pages, or with `check` recomputes their quick figures.
///
/// # Errors
///
/// When there is no such page, a figure cannot be computed, or one is not what the page stores.
pub fn validate_pages(root: &Path, only: Option<&str>, check: bool) -> Result<()> {
    let folder = root.join("docs/validation");
    if let Some(name) = only
        && !PAGES.iter().any(|page| page.name == name)
    {
        let known: Vec<_> = PAGES.iter().map(|page| page.name).collect();
        bail!("no page `{name}`; the pages are {}", known.join(", "));
    }
    for page in PAGES.iter().filter(|page| only.is_none_or(|name| name == page.name)) {
        if let Some(lacks) = lacks(page) {
            if only.is_some() {
                bail!("page `{}`: {lacks}", page.name);
            }
            crate::terminal::say(&format!("page `{}` left as it is: {lacks}", page.name));
            continue;
        }
        let figures = (page.quick)().with_context(|| format!("figures of `{}`", page.name))?;
        let beside = folder.join(page.name).with_extension("toml");
        if check {
            compare(page.name, &figures, &beside)?;
            continue;
        }
        fs::create_dir_all(&folder)?;
        let rendered = (page.text)(&figures).with_context(|| format!("page `{}`", page.name))?;
        fs::write(folder.join(page.name).with_extension("md"), rendered.markdown)?;
        write_drawings(&folder, rendered.drawings)?;
        fs::write(&beside, toml::to_string_pretty(&Stored { figure: figures })?)?;
    }
    Ok(())
}

/// Rebuilds one section of a page.
///
/// # Errors
///
/// When there is no such section, or it cannot be computed.
pub fn validate_section(root: &Path, page: &str, name: &str) -> Result<()> {
    let sections = SECTIONED.iter().find(|(of, _)| *of == page).map_or(&[][..], |(_, all)| *all);
    let Some(section) = sections.iter().find(|section| section.name == name) else {
        let known: Vec<_> = sections.iter().map(|section| section.name).collect();
        bail!("page `{page}` has no section `{name}`; those that can be rebuilt are {known:?}");
    };
    let folder = root.join("docs/validation");
    let path = folder.join(page).with_extension("md");
    let mut rendered = Rendered::from(String::new());
    (section.write)(&mut rendered).with_context(|| format!("section `{name}`"))?;
    // read late: other sections may have been rebuilt meanwhile
    let whole = fs::read_to_string(&path)?;
    fs::write(path, with_section(&whole, &rendered.markdown)?)?;
    write_drawings(&folder, rendered.drawings)?;
    store_section(&folder, page, name)
}

/// Stores the quick figures of a section, those whose names begin with its own, and leaves the
/// others as they are.
fn store_section(folder: &Path, page: &str, section: &str) -> Result<()> {
    let of = PAGES.iter().find(|one| one.name == page).context("a page with sections")?;
    let beside = folder.join(page).with_extension("toml");
    let stored = stored(page, &beside)?;
    let now = (of.quick)().with_context(|| format!("figures of `{page}`"))?;
    let figure = now
        .into_iter()
        .filter_map(|figure| {
            let is_of_section = figure.id.starts_with(&format!("{section}-"));
            let was = stored.figure.iter().find(|was| was.id == figure.id).cloned();
            if is_of_section { Some(figure) } else { was }
        })
        .collect();
    Ok(fs::write(&beside, toml::to_string_pretty(&Stored { figure })?)?)
}

fn stored(page: &str, beside: &Path) -> Result<Stored> {
    let text = fs::read_to_string(beside)
        .with_context(|| format!("{}: run `cargo xtask validate {page}`", beside.display()))?;
    Ok(toml::from_str(&text)?)
}

fn write_drawings(folder: &Path, drawings: Vec<(String, String)>) -> Result<()> {
    for (name, svg) in drawings {
        fs::write(folder.join("figures").join(name), svg)?;
    }
    Ok(())
}

/// Data that a page needs and does not have here.
fn lacks(page: &Page) -> Option<&'static str> {
    (["measured", "signal-chain", "cranfield"].contains(&page.name) && measured::is_without_data())
        .then_some("`FDI_MEASURED_DATA` does not name the folder of measured recordings")
}

/// Compares recomputed figures with the stored ones; tells every one that differs.
fn compare(page: &str, now: &[Figure], beside: &Path) -> Result<()> {
    let stored = stored(page, beside)?;
    if stored.figure.len() != now.len() {
        bail!("page `{page}` stores {} figures, {} recomputed", stored.figure.len(), now.len());
    }
    let differs = |(was, is): (&Figure, &Figure)| {
        let agree = (was.value - is.value).abs() <= was.tolerance_rel * was.value.abs();
        (was.id != is.id || !agree).then(|| {
            format!(
                "`{}` was {} and is {} {} (tolerance {} relative)",
                was.id, was.value, is.value, is.unit, was.tolerance_rel
            )
        })
    };
    let differing: Vec<String> = stored.figure.iter().zip(now).filter_map(differs).collect();
    if !differing.is_empty() {
        bail!("page `{page}`: {}", differing.join("; "));
    }
    Ok(())
}
