//! `docs/validation/bayesopt.md`: how good and how fast `gp-bayesopt` is.

use std::{fmt::Write as _, thread};

use anyhow::{Context, Result, ensure};
use fdi_benches::bayesopt::{
    Level, METHODS, Method, Problem, Run, Start, held_out, inversion, local_runs_to_truth, run,
};
use gp_bayesopt::{Acquisition, Bounds, GaussianProcess, GpOptions};

use super::{bar::met, figure::Figure};

/// Error levels of the tables.
const LEVELS: [(&str, Level); 4] = [
    ("5 %", Level::Mean(0.05)),
    ("1 %", Level::Mean(0.01)),
    ("0.1 %", Level::Mean(0.001)),
    ("all < 0.1 %", Level::Worst(0.001)),
];

/// Methods that need more evaluations than this run on the first ten seeds.
const EXPENSIVE: usize = 10_000;

const TRAIN: &str = include_str!("../../../../fixtures/references/sklearn/train.csv");

/// Median with failures as infinite, smallest and largest success, successes.
struct Spread {
    median: Option<usize>,
    quartiles: (Option<usize>, Option<usize>),
    reached: usize,
}

impl Spread {
    fn of(runs: &[Run], level: Level) -> Self {
        let mut counts: Vec<usize> =
            runs.iter().map(|r| r.evaluations_to(level).unwrap_or(usize::MAX)).collect();
        counts.sort_unstable();
        let at = |i: usize| (counts[i] != usize::MAX).then_some(counts[i]);
        let n = counts.len();
        Self {
            median: at(n / 2),
            quartiles: (at(n / 4), at(3 * n / 4)),
            reached: counts.iter().filter(|c| **c != usize::MAX).count(),
        }
    }

    fn cell(&self, runs: usize) -> String {
        let number = |v: Option<usize>| v.map_or("-".to_owned(), |v| v.to_string());
        let (low, high) = self.quartiles;
        format!(
            "{} [{}, {}] {}/{runs}",
            number(self.median),
            number(low),
            number(high),
            self.reached
        )
    }
}

/// The runs of a method on its seeds, two at a time; the order of seeds is kept.
fn runs(method: &Method, problem: &Problem, seeds: usize) -> Vec<Run> {
    let half = seeds.div_ceil(2);
    let some = |from: usize, to: usize| -> Vec<Run> {
        (from..to).map(|seed| run(method, problem, seed)).collect()
    };
    thread::scope(|scope| {
        let first = scope.spawn(|| some(0, half));
        let mut rest = some(half, seeds);
        let mut all = first.join().expect("a method panicked");
        all.append(&mut rest);
        all
    })
}

fn method(name: &str, start: Start) -> Result<Method> {
    let found = METHODS.iter().find(|m| m.name == name && m.start == start);
    found.copied().with_context(|| format!("no method `{name}`"))
}

/// Figures that take seconds: medians on the development problem with small
/// budgets, and two of the Gaussian process.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let problem = inversion();
    let mut figures = Vec::new();
    for (id, name, start, seeds) in [
        ("lm-near-evaluations-to-0.1-percent", "lm", Start::Near, 50),
        ("composite-near-evaluations-to-0.1-percent", "composite", Start::Near, 15),
        ("composite-blind-evaluations-to-0.1-percent", "composite", Start::Blind, 15),
    ] {
        let short = method(name, start)?.with_budget(45);
        let all = runs(&short, &problem, seeds);
        let spread = Spread::of(&all, Level::Mean(0.001));
        let value = spread.median.context("half of the seeds reach the level")? as f64;
        // the simulator's sines may differ by an ulp between platforms
        figures.push(Figure { id: id.into(), value, tolerance_rel: 0.1, unit: "1".into() });
    }
    let gp = stored_fit()?;
    figures.push(Figure {
        id: "fit-ln-likelihood".into(),
        value: gp.report().ln_likelihood,
        tolerance_rel: 1e-6,
        unit: "1".into(),
    });
    let far = Acquisition::LogExpectedImprovement.of_prediction(1e10, 1.0, 0.0)?;
    figures.push(Figure {
        id: "ln-expected-improvement-at-z-minus-1e10".into(),
        value: far,
        tolerance_rel: 1e-12,
        unit: "1".into(),
    });
    Ok(figures)
}

/// The stored regression case, fitted with the defaults.
fn stored_fit() -> Result<GaussianProcess> {
    let rows: Vec<Vec<f64>> = TRAIN
        .lines()
        .map(|line| line.split(',').map(str::parse).collect())
        .collect::<Result<_, _>>()?;
    let points: Vec<Vec<f64>> = rows.iter().map(|r| r[..7].to_vec()).collect();
    let values: Vec<f64> = rows.iter().map(|r| r[7]).collect();
    Ok(GaussianProcess::fit(&Bounds::unit(7)?, &points, &values, &GpOptions::default())?)
}

/// The whole page.
pub(super) fn text(figures: &[Figure]) -> Result<String> {
    let mut page = String::from(include_str!("bayesopt/head.md"));
    for figure in figures {
        writeln!(page, "| {} | {} | {} |", figure.id, figure.value, figure.tolerance_rel)?;
    }
    page.push_str(include_str!("bayesopt/problems.md"));
    let (mut tables, mut scalar) = (String::new(), String::new());
    for problem in std::iter::once(inversion()).chain(held_out()) {
        table(&mut page, &mut tables, &mut scalar, &problem)?;
    }
    page.push_str(include_str!("bayesopt/first_run.md"));
    page.push_str(&tables);
    hardness(&mut page)?;
    page.push_str(include_str!("bayesopt/scalar.md"));
    page.push_str(&scalar);
    page.push_str(include_str!("bayesopt/speed.md"));
    times(&mut page)?;
    page.push_str(include_str!("bayesopt/limits.md"));
    Ok(page)
}

/// Largest median of the evaluations that is asked of `composite` for 0.1 %, near and blind.
const ASKED: [(Start, usize); 2] = [(Start::Near, 20), (Start::Blind, 35)];
/// Share of the seeds that is asked for within the method's budget.
const ASKED_SEEDS_FRAC: f64 = 0.95;

/// Evaluations to each level, one row a method; bars of `composite` to `bars`, scalar criteria also
/// to `scalar`.
fn table(
    bars: &mut String,
    page: &mut String,
    scalar: &mut String,
    problem: &Problem,
) -> Result<()> {
    writeln!(page, "\n### `{}`\n", problem.name)?;
    write!(page, "| method | start | budget |")?;
    for (name, _) in LEVELS {
        write!(page, " {name} |")?;
    }
    writeln!(page, " best norm, median |\n|---|---|---|---|---|---|---|---|")?;
    for method in METHODS {
        let seeds = if method.budget > EXPENSIVE { 10 } else { problem.truths.len() };
        let all = runs(method, problem, seeds);
        let start = start_name(method.start);
        write!(page, "| {} | {start} | {} |", method.name, method.budget)?;
        for (_, level) in LEVELS {
            let spread = Spread::of(&all, level);
            write!(page, " {} |", spread.cell(seeds))?;
            if method.name == "composite" && level == Level::Mean(0.001) {
                bar(bars, problem.name, method.start, &spread, seeds)?;
            }
        }
        let norms = quantiles(all.iter().map(|r| r.best).collect());
        writeln!(page, " {:.2e} |", norms[1])?;
        if method.budget == 100 {
            let errors = quantiles(all.iter().map(Run::mean_error).collect());
            writeln!(
                scalar,
                "| `{}` | {} | {:.3e} [{:.3e}, {:.3e}] | {:.0} % [{:.0}, {:.0}] |",
                problem.name,
                method.name,
                norms[1],
                norms[0],
                norms[2],
                100.0 * errors[1],
                100.0 * errors[0],
                100.0 * errors[2]
            )?;
        }
    }
    Ok(())
}

fn start_name(start: Start) -> &'static str {
    if start == Start::Near { "near" } else { "blind" }
}

/// A row of what is asked of `composite`.
fn bar(
    bars: &mut String,
    problem: &str,
    start: Start,
    spread: &Spread,
    seeds: usize,
) -> Result<()> {
    let asked = ASKED.iter().find(|(of, _)| *of == start).context("a bar for each start")?.1;
    let is_quick = spread.median.is_some_and(|median| median <= asked);
    let reached_frac = spread.reached as f64 / seeds as f64;
    let median = spread.median.map_or("-".to_owned(), |median| median.to_string());
    writeln!(
        bars,
        "| `{problem}` | {} | {median} | {asked} | {} | {} of {seeds} | {} |",
        start_name(start),
        met(is_quick),
        spread.reached,
        met(reached_frac >= ASKED_SEEDS_FRAC),
    )?;
    Ok(())
}

/// Truths and starts on each that local runs are counted over.
const LOCAL_RUNS: (usize, usize) = (20, 50);

/// A budget of the composite method beyond that of the tables.
const LONGER_BUDGET: usize = 200;

/// How many basins a problem has, and what a longer budget gives.
fn hardness(page: &mut String) -> Result<()> {
    page.push_str(include_str!("bayesopt/hardness.md"));
    writeln!(
        page,
        "| problem | local runs that end at the truth | composite, 80 | composite, {LONGER_BUDGET} |\n\
         |---|---|---|---|"
    )?;
    let composite = method("composite", Start::Blind)?;
    for problem in std::iter::once(inversion()).chain(held_out()) {
        let (reached, all) = local_runs_to_truth(&problem, LOCAL_RUNS.0, LOCAL_RUNS.1);
        let share = 100.0 * reached as f64 / all as f64;
        let seeds = problem.truths.len();
        let at = |budget: usize| {
            let all = runs(&composite.with_budget(budget), &problem, seeds);
            Spread::of(&all, Level::Mean(0.001))
        };
        let usual = at(composite.budget);
        let cell = usual.cell(seeds);
        // a run takes the same way whatever its budget
        let longer =
            if usual.reached == seeds { cell.clone() } else { at(LONGER_BUDGET).cell(seeds) };
        let name = problem.name;
        writeln!(page, "| `{name}` | {reached} of {all} ({share:.1} %) | {cell} | {longer} |")?;
    }
    Ok(())
}

/// Lower quartile, median and upper quartile.
fn quantiles(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    [values[n / 4], values[n / 2], values[3 * n / 4]]
}

/// Most time of the clock for each job of this crate, ms.
const TARGETS: [(&str, f64); 5] = [
    ("fit", 25.0),
    ("log-ei", 5.0),
    ("two-step", 20.0),
    ("composite", 2.0),
    ("composite-warm", 2.0),
];

/// One job of one peer.
struct Timing {
    job: String,
    peer: String,
    wall_ms: f64,
    cpu_ms: f64,
    quality: String,
}

/// The stored timings; a job that ran twice counts with its faster run.
fn stored_timings(text: &str) -> Result<Vec<Timing>> {
    let mut timings: Vec<Timing> = Vec::new();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        ensure!(cells.len() == 5, "timing `{line}` has not five cells");
        let (wall_ms, cpu_ms): (f64, f64) = (cells[2].parse()?, cells[3].parse()?);
        match timings.iter_mut().find(|t| t.job == cells[0] && t.peer == cells[1]) {
            Some(known) => {
                ensure!(known.quality == cells[4], "`{line}`: {} before", known.quality);
                known.wall_ms = known.wall_ms.min(wall_ms);
                known.cpu_ms = known.cpu_ms.min(cpu_ms);
            }
            None => timings.push(Timing {
                job: cells[0].to_owned(),
                peer: cells[1].to_owned(),
                wall_ms,
                cpu_ms,
                quality: cells[4].to_owned(),
            }),
        }
    }
    Ok(timings)
}

/// The stored timings, this crate's against its targets.
fn times(page: &mut String) -> Result<()> {
    let machine = include_str!("../../../../benches/peers/bayesopt/machine.txt");
    let timings = stored_timings(include_str!("../../../../benches/peers/bayesopt/results.csv"))?;
    let peers = timings.iter().filter(|t| t.peer != "gp-bayesopt");
    let mut waits: Vec<f64> = peers.map(|t| t.wall_ms / t.cpu_ms).collect();
    waits.sort_by(f64::total_cmp);
    let (least, most) = waits.first().zip(waits.last()).context("a peer's timing")?;
    writeln!(
        page,
        "{}. Wall time of the peers over their processor time: {least:.1} to {most:.1}.\n",
        machine.lines().collect::<Vec<_>>().join("; ")
    )?;
    writeln!(
        page,
        "| job | peer | wall ms, least | CPU ms, least | quality | target, wall ms | |\n\
         |---|---|--:|--:|--:|--:|---|"
    )?;
    for t in timings {
        let target = TARGETS.iter().find(|(job, _)| t.peer == "gp-bayesopt" && *job == t.job);
        let verdict = target.map_or(String::from(" | "), |(_, limit)| {
            format!("{limit} | {}", met(t.wall_ms <= *limit))
        });
        let Timing { job, peer, wall_ms, cpu_ms, quality } = t;
        writeln!(page, "| {job} | {peer} | {wall_ms:.1} | {cpu_ms:.1} | {quality} | {verdict} |")?;
    }
    Ok(())
}
