//! Section of the page: what each compression leaves of a diagnosis.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    AblationRequest, AblationScore, Compression, EvaluationSetting, evaluate_compressions,
};
use fdi_core::{
    ema_sim::Imperfections,
    report::{CompressionCurve, CompressionPanel, FaultEvaluation, compression_figure_svg},
};
use reduction::{CompressionConfig, Encoding, Grid, Placement};

use super::{CLEAN, REAL, SEED, noisy, quiet, seeded};
use crate::{
    pages::figure::{Figure, Rendered},
    processor::jobs,
};

/// Test conditions of each setting.
const CONDITIONS: usize = 100;
/// Test conditions of the figures that are compared.
const QUICK_CONDITIONS: usize = 20;
/// Maps trained for each number of points; each has its own points.
const MAP_SEEDS: u64 = 5;
/// Rows and columns of the maps.
const GRIDS: [[usize; 2]; 6] = [[2, 5], [4, 5], [5, 6], [5, 10], [7, 10], [10, 10]];
/// Number of points of the paper.
const PAPERS_POINTS: usize = 30;
/// Settings: title, electronics, and whether the sensors have noise.
const SETTINGS: [(&str, Imperfections, bool); 3] = [
    ("No noise", CLEAN, false),
    ("Sensor noise", CLEAN, true),
    ("Sensor noise, real electronics", REAL, true),
];

/// Short names of ways.
const RAW: &str = "raw";
const WHOLE: &str = "whole signal";
const DYNAMIC_MODES: &str = "dynamic modes";
const PAPERS: &str = "the paper's points";
const EQUAL_STEPS: &str = "equal steps";
const QDEIM: &str = "Q-DEIM";
const INFORMATIVE: &str = "informative points";
const SINGULAR_MODES: &str = "singular modes";
/// Ways beside the paper's that keep thirty numbers.
const OF_THIRTY: [&str; 5] = [DYNAMIC_MODES, QDEIM, INFORMATIVE, EQUAL_STEPS, SINGULAR_MODES];

/// A way of compressing, with the numbers that it keeps in turn.
struct Way {
    name: &'static str,
    /// Name in the figure and in the conclusion.
    short: &'static str,
    /// One for each number of numbers, with as many as there are seeds.
    compressions: Vec<Vec<Compression>>,
}

/// One row: a way with a number of numbers, in one setting.
struct Row {
    numbers: usize,
    /// A score a seed; all but maps have one.
    scores: Vec<AblationScore>,
}

pub(super) fn section(page: &mut Rendered) -> Result<()> {
    let ways = ways();
    let scored = SETTINGS
        .into_iter()
        .map(|(title, imperfections, is_noisy)| {
            let setting =
                if is_noisy { noisy(imperfections, 10_000.0, 100) } else { quiet(imperfections) };
            scored(title, EvaluationSetting { sparse_snapshots: 0, ..setting }, &ways)
        })
        .collect::<Result<Vec<Scored<'_>>>>()?;
    let panels: Vec<_> = scored.iter().map(Scored::panel).collect::<Result<_>>()?;
    let svg = compression_figure_svg(&panels).context("nothing was compressed")?;
    let text = &mut page.markdown;
    writeln!(
        text,
        "{HEAD}\n![average error of the diagnosis against the numbers looked at, one panel a setting](figures/{FIGURE})\n"
    )?;
    page.drawings.push((FIGURE.to_owned(), svg));
    table(text, &scored)?;
    writeln!(text, "\n### What each step costs\n")?;
    scored.iter().try_for_each(|one| one.conclude(text))?;
    conclude_in_all(text, &scored)
}

/// The errors of few conditions by the whole signal and by the paper's points.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let papers = Compression::Map(Box::default());
    let request = AblationRequest {
        setting: EvaluationSetting { sparse_snapshots: 0, ..noisy(REAL, 10_000.0, 100) },
        conditions: QUICK_CONDITIONS,
        compressions: &[Compression::Full, papers],
        seed: SEED,
        jobs: jobs(),
    };
    let scores = evaluate_compressions(&request)?;
    let figure = |(id, score): (&str, &AblationScore)| {
        seeded(format!("ablation-{id}-average"), score.average_percent, "%")
    };
    Ok(["full", "points"].into_iter().zip(&scores).map(figure).collect())
}

fn ways() -> Vec<Way> {
    let map = |config: CompressionConfig| Compression::Map(Box::new(config));
    let with = |encoding, count| CompressionConfig { encoding, count, ..Default::default() };
    let counts = || GRIDS.into_iter().map(|[rows, columns]| rows * columns);
    let points = |placement: Placement| {
        let of = |count| vec![map(with(Encoding::Points(placement), count))];
        counts().map(of).collect()
    };
    let one = |encoding, count| vec![vec![map(with(encoding, count))]];
    let mapped = |[rows, columns]: [usize; 2]| {
        let of = |seed| {
            let mut config = with(Encoding::Points(Placement::DmdSom), rows * columns);
            config.som.grid = Grid { rows, columns, ..config.som.grid };
            config.som.seed = seed;
            map(config)
        };
        (0..MAP_SEEDS).map(of).collect()
    };
    let modes = [10, 20, 30, 50, 70, 99];
    vec![
        Way {
            name: "raw: every phase sample, no filter",
            short: RAW,
            compressions: vec![vec![Compression::Raw]],
        },
        Way {
            name: "full: the whole filtered signal (a bundle's default)",
            short: WHOLE,
            compressions: vec![vec![Compression::Full]],
        },
        Way {
            name: "dynamic modes alone (the paper's first step)",
            short: DYNAMIC_MODES,
            compressions: one(Encoding::DynamicModes, PAPERS_POINTS),
        },
        Way {
            name: "dynamic modes + map: points (the paper's two steps)",
            short: PAPERS,
            compressions: GRIDS.into_iter().map(mapped).collect(),
        },
        Way { name: "points: Q-DEIM", short: QDEIM, compressions: points(Placement::Qdeim) },
        Way {
            name: "points: informative (greedy A-optimal)",
            short: INFORMATIVE,
            compressions: points(Placement::GreedyAOptimal),
        },
        Way {
            name: "points: equal steps",
            short: EQUAL_STEPS,
            compressions: points(Placement::Uniform),
        },
        Way {
            name: "singular modes of the whitened signals",
            short: SINGULAR_MODES,
            compressions: modes
                .into_iter()
                .map(|count| vec![map(with(Encoding::Modes, count))])
                .collect(),
        },
    ]
}

/// Scores of every way in a setting.
struct Scored<'a> {
    title: &'static str,
    ways: &'a [Way],
    /// A row a number of numbers, ways in turn.
    rows: Vec<Vec<Row>>,
}

fn scored<'a>(
    title: &'static str,
    setting: EvaluationSetting,
    ways: &'a [Way],
) -> Result<Scored<'a>> {
    let all = || ways.iter().flat_map(|way| &way.compressions).flatten();
    let compressions: Vec<Compression> = all().cloned().collect();
    let request = AblationRequest {
        setting,
        conditions: CONDITIONS,
        compressions: &compressions,
        seed: SEED,
        jobs: jobs(),
    };
    let mut scores = evaluate_compressions(&request)?.into_iter();
    let mut row = |each: &Vec<Compression>| {
        let scores: Vec<AblationScore> = scores.by_ref().take(each.len()).collect();
        Row { numbers: scores.first().map_or(0, |score| score.numbers), scores }
    };
    let rows = ways.iter().map(|way| way.compressions.iter().map(&mut row).collect()).collect();
    Ok(Scored { title, ways, rows })
}

impl Row {
    /// The score whose average error is the middle one of the seeds.
    fn middle(&self) -> Result<&AblationScore> {
        let mut sorted: Vec<&AblationScore> = self.scores.iter().collect();
        sorted.sort_by(|a, b| a.average_percent.total_cmp(&b.average_percent));
        sorted.get(sorted.len() / 2).copied().context("a row has no score")
    }

    /// Average error of the middle seed, %, and the range over the seeds where there are several.
    fn average(&self) -> Result<String> {
        let averages = || self.scores.iter().map(|score| score.average_percent);
        let (least, most) =
            (averages().fold(f64::INFINITY, f64::min), averages().fold(0.0, f64::max));
        let middle = digits(self.middle()?.average_percent);
        Ok(match self.scores.len() {
            1 => middle,
            _ => format!("{middle} ({} to {})", digits(least), digits(most)),
        })
    }
}

impl Scored<'_> {
    /// The score of a way with a number of numbers, the first row unless one is asked for.
    fn at(&self, short: &str, numbers: Option<usize>) -> Result<&AblationScore> {
        let place = self.ways.iter().position(|way| way.short == short).context("no such way")?;
        let is_asked = |row: &&Row| numbers.is_none_or(|numbers| row.numbers == numbers);
        self.rows[place].iter().find(is_asked).context("no such row")?.middle()
    }

    fn panel(&self) -> Result<CompressionPanel> {
        let curve = |(way, rows): (&Way, &Vec<Row>)| {
            let point = |row: &Row| {
                let score = row.middle()?;
                Ok((score.numbers, score.average_percent))
            };
            let points = rows.iter().map(point).collect::<Result<_>>()?;
            Ok(CompressionCurve { name: way.short.to_owned(), points })
        };
        Ok(CompressionPanel {
            title: self.title.to_owned(),
            whole_percent: self.at(WHOLE, None)?.average_percent,
            curves: self.ways.iter().zip(&self.rows).map(curve).collect::<Result<_>>()?,
        })
    }

    /// Cost of the steps of the paper, and which thirty numbers leave least, in words that the
    /// numbers choose.
    fn conclude(&self, text: &mut String) -> Result<()> {
        let whole = self.at(WHOLE, None)?;
        let thirty = Some(PAPERS_POINTS);
        let (modes, papers) = (self.at(DYNAMIC_MODES, None)?, self.at(PAPERS, thirty)?);
        let cost = |score: &AblationScore, of: &AblationScore| {
            let (ratio, [low, high]) = score.ratio_to(of, SEED);
            format!("{ratio:.2} ({low:.2} to {high:.2})")
        };
        let other = |short| Ok((short, self.at(short, thirty)?));
        let others = OF_THIRTY.into_iter().map(other).collect::<Result<Vec<_>>>()?;
        let least = self.least_of_thirty()?;
        let each: Vec<String> =
            others.iter().map(|(short, score)| format!("{short} {}", cost(score, whole))).collect();
        let steps = self.at(EQUAL_STEPS, thirty)?;
        let beside_steps = match least {
            EQUAL_STEPS => String::new(),
            _ => format!(", and {} times the error of points in equal steps", cost(papers, steps)),
        };
        writeln!(
            text,
            "**{}.** Average error over that of the whole filtered signal: raw {}. The first step, thirty dynamic modes, costs a factor of\n\
             {}; the second, thirty points in place of these modes, another {}, together {}:\n\
             the {} step is the dearer one. Thirty other numbers: {}.\n\
             Of these {} leave least; the paper's points leave {} times as much{beside_steps}: {}.\n\
             A hundred points of the map leave {}.\n",
            self.title,
            cost(self.at(RAW, None)?, whole),
            cost(modes, whole),
            cost(papers, modes),
            cost(papers, whole),
            if self.is_second_dearer()? { "second" } else { "first" },
            each.join(", "),
            least,
            cost(papers, self.at(least, thirty)?),
            told_apart(papers, steps),
            cost(self.at(PAPERS, Some(100))?, whole),
        )?;
        Ok(())
    }

    /// True where the second of the paper's two steps raises the error by more than the first.
    fn is_second_dearer(&self) -> Result<bool> {
        let (whole, modes) = (self.at(WHOLE, None)?, self.at(DYNAMIC_MODES, None)?);
        let papers = self.at(PAPERS, Some(PAPERS_POINTS))?;
        Ok(modes.ratio_to(whole, SEED).0 <= papers.ratio_to(modes, SEED).0)
    }

    /// Thirty other numbers that leave least.
    fn least_of_thirty(&self) -> Result<&'static str> {
        let average = |short| Ok((short, self.at(short, Some(PAPERS_POINTS))?.average_percent));
        let averages = OF_THIRTY.into_iter().map(average).collect::<Result<Vec<_>>>()?;
        let least = averages.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(least.context("other ways")?.0)
    }
}

/// Adds the conclusion over all settings, in words that the numbers choose.
fn conclude_in_all(text: &mut String, scored: &[Scored<'_>]) -> Result<()> {
    let each = |of: &dyn Fn(&Scored<'_>) -> Result<String>| -> Result<String> {
        Ok(scored.iter().map(of).collect::<Result<Vec<_>>>()?.join(", "))
    };
    let over = |short, count, of: &'static str| {
        move |one: &Scored<'_>| {
            let (ratio, _) = one.at(short, count)?.ratio_to(one.at(of, None)?, SEED);
            Ok(format!("{ratio:.2}"))
        }
    };
    let thirty = Some(PAPERS_POINTS);
    let dearer = scored.iter().map(Scored::is_second_dearer).collect::<Result<Vec<_>>>()?;
    let seconds = dearer.iter().filter(|&&is_second| is_second).count();
    let titles: Vec<&str> = scored.iter().map(|one| one.title).collect();
    writeln!(
        text,
        "**In all.** In the settings *{}*, in turn, the first step of the paper's compression multiplies the error by {},\n\
         the second by {}: the second is the dearer one in {seconds} of {}. The paper's thirty points leave {} times the error\n\
         of the whole signal. Where thirty numbers have to do, those that leave least are {}.\n",
        titles.join("*, *"),
        each(&over(DYNAMIC_MODES, None, WHOLE))?,
        each(&over(PAPERS, thirty, DYNAMIC_MODES))?,
        scored.len(),
        each(&over(PAPERS, thirty, WHOLE))?,
        each(&|one| Ok(one.least_of_thirty()?.to_owned()))?,
    )?;
    Ok(())
}

/// Use of a map beside another way of placing points, as far as the conditions tell.
fn told_apart(one: &AblationScore, other: &AblationScore) -> &'static str {
    let (_, [low, high]) = one.ratio_to(other, SEED);
    match (low > 1.0, high < 1.0) {
        (true, _) => "a map is not needed to place them",
        (_, true) => "the map places them better",
        _ => "not told apart",
    }
}

/// Every row with its averages in each setting; the last columns are of the last setting.
fn table(text: &mut String, scored: &[Scored<'_>]) -> Result<()> {
    let last = scored.last().context("a setting")?;
    write!(text, "| looked at | numbers |")?;
    for one in scored {
        write!(text, " {}: average, % | over full |", one.title)?;
    }
    writeln!(
        text,
        " dearest fault, over full | coverage, % |\n| --- | --: |{} --- | --: |",
        " --- | --- |".repeat(scored.len())
    )?;
    for (place, way) in last.ways.iter().enumerate() {
        for row in 0..way.compressions.len() {
            write!(text, "| {} | {} |", way.name, last.rows[place][row].numbers)?;
            for one in scored {
                let row = &one.rows[place][row];
                let (ratio, [low, high]) = row.middle()?.ratio_to(one.at(WHOLE, None)?, SEED);
                write!(text, " {} | {ratio:.2} ({low:.2} to {high:.2}) |", row.average()?)?;
            }
            let score = last.rows[place][row].middle()?;
            let (fault, ratio) = dearest(score, last.at(WHOLE, None)?)?;
            let coverage = 100.0 * score.coverage_95;
            let silent = match score.undetermined {
                0 => String::new(),
                count => format!(", {count} without an answer"),
            };
            writeln!(text, " {fault} {ratio:.2} | {coverage:.1}{silent} |")?;
        }
    }
    Ok(())
}

/// The fault whose median error grows most over that of the whole signal, and how much.
fn dearest(score: &AblationScore, whole: &AblationScore) -> Result<(String, f64)> {
    let ratio = |(one, all): (&FaultEvaluation, &FaultEvaluation)| {
        let of = |fault: &FaultEvaluation| Some(fault.error_abs?.median);
        Some((one.id.to_string(), of(one)? / of(all)?))
    };
    let ratios = score.faults.iter().zip(&whole.faults).filter_map(ratio);
    ratios.max_by(|a, b| a.1.total_cmp(&b.1)).context("no fault has an error")
}

/// Three digits that count.
fn digits(value: f64) -> String {
    let decimals = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 5);
    format!("{value:.*}", decimals as usize)
}

const FIGURE: &str = "compression.svg";

const HEAD: &str = "\n## What the compression leaves of a diagnosis\n\n\
The chirp of EMA-48, 100 test conditions, 100 reference signals (`incipient`) in the same setting, phases at 10 kHz; sensor noise is 20 mA rms on each\n\
phase sample and 12 bits over ±20 A. The estimator is the same in every row, generalised least squares with the learnt error of the\n\
low-fidelity model and the noise told, on the numbers that the row keeps (`Diagnoser::with_compression`). So a row differs from `full`\n\
by what it does not look at. *Average*: mean over k1 to k7 of the median of eq. 20; points of the paper's map depend on its seed, and the row is the middle\n\
one of five maps with their range. *Over full*: average over that of `full` on the same conditions, with the interval that\n\
holds 95 % of 1000 draws of the conditions. *Coverage*: share of the 95 % intervals of k1 to k6 that hold the truth, and *dearest fault*, in the last setting.\n\
A filter that averages out what the sensors add comes before `full` and not before `raw`. Thirty dynamic modes enter every map; singular modes are of signals whitened by the noise of the sensors. The dashed line of the figure is the whole signal.\n";
