//! The paired comparison: tables and the figure of pairs.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    Contender, EvaluationRequest, PairedComparison, SeededSearch, SeededSearches, holm,
};

use super::{
    case::{COMPARED, Case, marks, monitor},
    kept::{Kept, Line},
    setting::request,
};
use crate::{
    median::median,
    pages::{
        figure::Rendered,
        plot::{Decades, Drawing, Panel, Place},
    },
    processor::processor_s,
};

/// Name of the figure.
const FIGURE: &str = "lookahead-pairs.svg";
/// Size of one of its panels, px.
const PANEL: [f64; 2] = [320.0, 300.0];
/// Errors below this are drawn at it, %.
const LEAST_PERCENT: f64 = 1e-2;

/// Seeds whose times are taken.
const TIMED_SEEDS: usize = 3;

const METHODS: [Contender; 2] = super::case::PAIR;

fn pairs<'a>(kept: &'a Kept, case: &'a Case) -> Vec<(&'a Line, &'a Line)> {
    kept.pairs(case, METHODS.map(Contender::name))
}

/// Mean error of two-step lookahead less that of expected improvement, by seed, percentage points.
pub(super) fn differences(kept: &Kept, case: &Case) -> Vec<f64> {
    pairs(kept, case).iter().map(|(ei, two)| two.error() - ei.error()).collect()
}

/// Writes the comparison.
pub(super) fn write(page: &mut Rendered, kept: &Kept) -> Result<()> {
    page.markdown.push_str(INTRODUCTION);
    errors(&mut page.markdown, kept)?;
    discrepancies(&mut page.markdown, kept)?;
    on_the_way(&mut page.markdown, kept)?;
    at_equal_time(&mut page.markdown, kept)?;
    page.drawings.push((FIGURE.to_owned(), figure(kept)));
    Ok(())
}

fn compared(differences: &[f64]) -> Result<PairedComparison> {
    PairedComparison::of(differences).context("no pair of finite searches")
}

/// A p value with two digits.
fn p(value: f64) -> String {
    if value < 1e-3 { format!("{value:.1e}") } else { format!("{value:.3}") }
}

/// A case with what its pairs say.
struct Row<'a> {
    case: &'a Case,
    pairs: Vec<(&'a Line, &'a Line)>,
    found: PairedComparison,
    /// The p values of sign test and signed ranks after Holm's correction over the table.
    corrected: [f64; 2],
}

impl Row<'_> {
    fn median(&self, pick: fn(&Line) -> f64) -> [f64; 2] {
        let of = |values: Vec<f64>| median(&values);
        [
            of(self.pairs.iter().map(|(ei, _)| pick(ei)).collect()),
            of(self.pairs.iter().map(|(_, two)| pick(two)).collect()),
        ]
    }
}

fn table(kept: &Kept, difference: impl Fn(&Line, &Line) -> f64) -> Result<Vec<Row<'_>>> {
    let mut rows = Vec::new();
    for case in &COMPARED {
        let pairs = pairs(kept, case);
        if pairs.is_empty() {
            continue;
        }
        let differences: Vec<f64> = pairs.iter().map(|(a, b)| difference(a, b)).collect();
        let found = compared(&differences).with_context(|| format!("{case:?}"))?;
        rows.push(Row { case, pairs, found, corrected: [1.0; 2] });
    }
    let tests: [fn(&PairedComparison) -> f64; 2] =
        [|found| found.sign_p, |found| found.signed_rank_p];
    for (test, p_of) in tests.into_iter().enumerate() {
        let p_values: Vec<f64> = rows.iter().map(|row| p_of(&row.found)).collect();
        for (row, corrected) in rows.iter_mut().zip(holm(&p_values)) {
            row.corrected[test] = corrected;
        }
    }
    Ok(rows)
}

fn errors(page: &mut String, kept: &Kept) -> Result<()> {
    writeln!(
        page,
        "\nMean error $e$ at the end, %; the difference is two-step EI less EI, in percentage points:\n\n\
         | monitor | domain | seeds | EI, median | two-step EI, median | median difference [95 %] | two-step EI better | sign test, p | after Holm | signed ranks, p | after Holm |\n\
         | --- | --- | --: | --: | --: | --: | --: | --: | --: | --: | --: |"
    )?;
    for row in table(kept, |ei, two| two.error() - ei.error())? {
        let ([ei, two], Row { case, pairs, found, corrected }) = (row.median(Line::error), row);
        writeln!(
            page,
            "| {} | {} | {} | {:.2} | {:.2} | {:+.2} [{:+.2}, {:+.2}] | {:.1} % | {} | {} | {} | {} |",
            monitor(case.problem),
            case.view.label(),
            pairs.len(),
            ei,
            two,
            found.median,
            found.interval[0],
            found.interval[1],
            100.0 * found.share_below(),
            p(found.sign_p),
            p(corrected[0]),
            p(found.signed_rank_p),
            p(corrected[1]),
        )?;
    }
    Ok(())
}

fn discrepancies(page: &mut String, kept: &Kept) -> Result<()> {
    writeln!(
        page,
        "\nLeast discrepancy δ, which is what both minimise; the tests are of ln(δ of two-step EI / δ of EI):\n\n\
         | monitor | domain | EI, median, A | two-step EI, median, A | median ratio [95 %] | two-step EI better | sign test, p | after Holm | signed ranks, p | after Holm |\n\
         | --- | --- | --: | --: | --: | --: | --: | --: | --: | --: |"
    )?;
    let ratio = |ei: &Line, two: &Line| (two.discrepancy() / ei.discrepancy()).ln();
    for row in table(kept, ratio)? {
        let ([ei, two], Row { case, found, corrected, .. }) = (row.median(Line::discrepancy), row);
        writeln!(
            page,
            "| {} | {} | {:.2e} | {:.2e} | {:.2} [{:.2}, {:.2}] | {:.1} % | {} | {} | {} | {} |",
            monitor(case.problem),
            case.view.label(),
            ei,
            two,
            found.median.exp(),
            found.interval[0].exp(),
            found.interval[1].exp(),
            100.0 * found.share_below(),
            p(found.sign_p),
            p(corrected[0]),
            p(found.signed_rank_p),
            p(corrected[1]),
        )?;
    }
    Ok(())
}

fn on_the_way(page: &mut String, kept: &Kept) -> Result<()> {
    writeln!(
        page,
        "\nShare of the seeds at which two-step EI has the smaller δ after some evaluations; the first points are the same for both,\n\
         ties count half:\n\n\
         | monitor | domain | after (evaluations): share |\n| --- | --- | --- |"
    )?;
    for case in &COMPARED {
        let pairs = pairs(kept, case);
        if pairs.is_empty() {
            continue;
        }
        let mut shares = Vec::new();
        for &mark in marks(case.problem) {
            let at = |line: &Line| line.after(mark).map(|point| point[1]);
            let differences: Vec<f64> =
                pairs.iter().filter_map(|(ei, two)| Some(at(two)? - at(ei)?)).collect();
            shares.push(format!("{mark}: {:.0} %", 100.0 * compared(&differences)?.share_below()));
        }
        writeln!(
            page,
            "| {} | {} | {} |",
            monitor(case.problem),
            case.view.label(),
            shares.join(", ")
        )?;
    }
    Ok(())
}

/// A search's time on the processor, by evaluations.
struct Timed {
    evaluations: usize,
    time_s: f64,
}

/// Processor times of the first seeds of a case, for each method after every tenth evaluation.
fn timed(case: &Case) -> Result<[Vec<Timed>; 2]> {
    let request =
        EvaluationRequest { jobs: 1, ..request(case.problem, &METHODS, Some(&processor_s)) };
    let searches = SeededSearches::prepare(&request)?.seen(case.view.view());
    let seeds: Vec<usize> = (0..TIMED_SEEDS).collect();
    let every: Vec<usize> = (1..=15).map(|tenth| 10 * tenth).collect();
    let found = searches.run(&seeds, &every)?;
    let of = |method: usize| -> Vec<Timed> {
        let points = |search: &SeededSearch| search.points.len();
        let count = found.iter().map(|s| points(&s.searches[method])).min().unwrap_or(0);
        let at = |place: usize| {
            let of_seed = found.iter().map(|s| s.searches[method].points[place]);
            let times: Vec<f64> = of_seed.clone().map(|point| point.time_s).collect();
            let evaluations = of_seed.map(|point| point.evaluations).max().unwrap_or(0);
            Timed { evaluations, time_s: median(&times) }
        };
        (0..count).map(at).collect()
    };
    Ok([of(0), of(1)])
}

fn at_equal_time(page: &mut String, kept: &Kept) -> Result<()> {
    writeln!(
        page,
        "\nTime of a search on the processor, proposals and simulations together, median of {TIMED_SEEDS} seeds on one thread; how far two-step EI is when EI ends;\n\
         and the pairs at the last mark that it has passed by then, and at the next one, which it has not. These p values are not corrected:\n\n\
         | monitor | domain | EI, s | two-step EI, s | evaluations of two-step EI by then | compared after | median difference of e [95 %] | two-step EI better | signed ranks, p | at the next mark: two-step EI better | signed ranks, p |\n\
         | --- | --- | --: | --: | --: | --: | --: | --: | --: | --: | --: |"
    )?;
    for case in COMPARED.iter().filter(|case| !pairs(kept, case).is_empty()) {
        let [ei, two] = timed(case)?;
        let last = |timed: &[Timed]| timed.last().map_or(f64::NAN, |point| point.time_s);
        let by_then = two.iter().take_while(|point| point.time_s <= last(&ei)).last();
        let by_then = by_then.map_or(0, |point| point.evaluations);
        let marks = marks(case.problem);
        let mark = marks.iter().copied().take_while(|&mark| mark <= by_then).last();
        let mark = mark.unwrap_or(marks[0]);
        let at = |mark: usize| {
            let pairs = pairs(kept, case);
            let less = |(ei, two): &(&Line, &Line)| Some(two.after(mark)?[2] - ei.error());
            compared(&pairs.iter().filter_map(less).collect::<Vec<f64>>())
        };
        let found = at(mark)?;
        let next = match marks.iter().copied().find(|&one| one > mark) {
            Some(next) => {
                let found = at(next)?;
                format!("{next}: {:.1} % | {}", 100.0 * found.share_below(), p(found.signed_rank_p))
            }
            None => " | ".to_owned(),
        };
        writeln!(
            page,
            "| {} | {} | {:.2} | {:.2} | {by_then} | {mark} | {:+.2} [{:+.2}, {:+.2}] | {:.1} % | {} | {next} |",
            monitor(case.problem),
            case.view.label(),
            last(&ei),
            last(&two),
            found.median,
            found.interval[0],
            found.interval[1],
            100.0 * found.share_below(),
            p(found.signed_rank_p),
        )?;
    }
    writeln!(
        page,
        "\nA point is a seed; above the diagonal EI ended with the smaller mean error, below it two-step EI did. Errors below\n\
         {LEAST_PERCENT} % are drawn at {LEAST_PERCENT} %.\n\n\
         ![mean error of two-step EI against that of EI, by seed, a panel for each monitor and domain](figures/{FIGURE})"
    )?;
    Ok(())
}

fn figure(kept: &Kept) -> String {
    let [width, height] = PANEL;
    let title = "Mean error at the end: two-step EI against EI, a point for each seed";
    let mut drawing = Drawing::new([3.0 * width, 2.0 * height + 30.0], title);
    drawing.text([16.0, 22.0], "font-size=\"15\"", title);
    let searched = COMPARED.iter().filter(|case| !pairs(kept, case).is_empty());
    for (place, case) in searched.enumerate() {
        let pairs = pairs(kept, case);
        let places: Vec<Place> = pairs
            .iter()
            .map(|(ei, two)| [ei.error().max(LEAST_PERCENT), two.error().max(LEAST_PERCENT)])
            .collect();
        let axis = Decades::around(places.iter().flatten().copied());
        // a problem is a column, a domain a row
        let corner = [width * (place / 2) as f64, 30.0 + height * (place % 2) as f64];
        let panel = Panel {
            frame: [corner[0], corner[1], width, height],
            x: axis,
            y: axis,
            title: format!("{}, {}", monitor(case.problem), case.view.label()),
            labels: ["e of EI, %", "e of two-step EI, %"],
        };
        panel.axes(&mut drawing);
        panel.points(&mut drawing, &places);
        panel.curve(&mut drawing, 5, &[[LEAST_PERCENT / 1e3; 2], [1e9; 2]]);
    }
    drawing.finish()
}

const INTRODUCTION: &str = "
## Two-step lookahead against expected improvement

Setting `clean`, budgets as above (150 evaluations for seven faults, 50 for two). A seed is one condition of the design `test` (200 of each
problem, root seed 1) and one initial Sobol' design. Both methods get the same, so that they are compared in pairs. The statistic is the mean error *e*
over the faults, eq. 20, at the end of a search. Intervals are of order statistics, exact by the binomial law. Sign test and Wilcoxon's signed-rank test
are exact and two-sided; each test's p values are corrected for the six comparisons of a table by Holm's method. All searches are kept in
`docs/validation/lookahead.jsonl`, whose first line says how many pairs of each case it holds (high fidelity over [0, 1] takes some ten times as long as low fidelity). Searches
that it lacks of these are made first; `--check` makes the first evaluations of two seeds of low fidelity and of the bench anew.
";
