//! Two-step lookahead against expected improvement in pairs, and why scalar searches stop where they do.

mod case;
mod comparison;
mod domain;
mod kept;
mod setting;

use std::path::Path;

use anyhow::{Result, ensure};
use experiments::{EvaluationRequest, Protocol, SeededSearches};

use self::{
    case::{COMPARED, Case, SEEDS, View, marks},
    kept::{Header, Kept, brief},
    setting::{SEED, request},
};
use crate::{
    median::median,
    pages::figure::{Figure, Rendered},
};

/// Conditions that are searched between two times of writing.
const PIECE: usize = 4;
/// Seeded results agree to rounding; medians of them to this.
const SEEDED_REL: f64 = 1e-3;
/// Seeds of the quick figures.
const QUICK_SEEDS: usize = 2;

/// The section.
pub(super) fn lookahead(page: &mut Rendered) -> Result<()> {
    let mut kept = kept()?;
    for case in case::all() {
        search(&case, &mut kept)?;
    }
    kept.sort()?;
    comparison::write(page, &kept)?;
    domain::write(page, &kept)?;
    page.markdown.push_str(
        "\nWhat follows from these figures stands in `docs/decisions/0126-two-step-lookahead-and-the-domain.md`.\n",
    );
    Ok(())
}

fn kept() -> Result<Kept> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let pairs = [SEEDS; COMPARED.len()];
    Kept::read(&root, Header { seed: SEED, conditions: SEEDS, pairs })
}

/// Makes the searches of a case that are not kept yet.
fn search(case: &Case, kept: &mut Kept) -> Result<()> {
    let missing = kept.missing(case);
    if missing.is_empty() {
        return Ok(());
    }
    let request = request(case.problem, case.contenders, None);
    let searches = SeededSearches::prepare(&request)?.seen(case.view.view());
    for piece in missing.chunks(PIECE) {
        kept.add(case, &searches.run(piece, marks(case.problem))?)?;
    }
    Ok(())
}

/// The first evaluations of the first seeds anew, which must be those that are kept, and the median
/// differences of all that is kept.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let kept = kept()?;
    let mut figures = Vec::new();
    for problem in [Protocol::Bench, Protocol::Low] {
        let evaluations = marks(problem)[1];
        let request = EvaluationRequest {
            max_evaluations: Some(evaluations),
            ..request(problem, &case::PAIR, None)
        };
        let mut searches = SeededSearches::prepare(&request)?;
        for view in [View::Whole, View::Incipient] {
            searches = searches.seen(view.view());
            let case = Case { problem, view, contenders: &case::PAIR, seeds: SEEDS };
            let seeds: Vec<usize> = (0..QUICK_SEEDS).collect();
            let found = searches.run(&seeds, &[])?;
            for (place, contender) in case::PAIR.iter().enumerate() {
                let name = format!("{}-{}-{}", problem.name(), view.name(), contender.name());
                let mut discrepancies = Vec::new();
                for of_seed in &found {
                    let end = of_seed.searches[place].points.last().copied();
                    let now = brief(end.map_or(f64::NAN, |point| point.discrepancy_a));
                    let line = kept.of(&case, contender.name()).find(|l| l.seed == of_seed.index);
                    let was = line.and_then(|line| line.after(evaluations)).map(|point| point[1]);
                    ensure!(
                        was.is_none_or(|was| (was - now).abs() <= SEEDED_REL * was),
                        "{name}, seed {}: kept {was:?} A after {evaluations} evaluations, now {now} A",
                        of_seed.index
                    );
                    discrepancies.push(now);
                }
                let id = format!("lookahead-{name}-discrepancy-after-{evaluations}");
                figures.push(seeded(id, median(&discrepancies), "A"));
            }
        }
    }
    for case in &COMPARED {
        let name = format!("{}-{}", case.problem.name(), case.view.name());
        let differences = comparison::differences(&kept, case);
        if differences.is_empty() {
            continue;
        }
        figures.push(seeded(
            format!("lookahead-{name}-median-difference"),
            median(&differences),
            "%",
        ));
    }
    Ok(figures)
}

fn seeded(id: String, value: f64, unit: &str) -> Figure {
    Figure { id, value, tolerance_rel: SEEDED_REL, unit: unit.to_owned() }
}
