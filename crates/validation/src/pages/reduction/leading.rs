//! The leading singular values by the Gram route: accuracy over the fall of the spectrum, and speed.

use std::{fmt::Write as _, iter};

use anyhow::{Context, Result, ensure};
use reduction::{Matrix, RankRule, Snapshots, Svd, leading_svd, thin_svd};

use super::{super::bar::met, Line};

pub(super) const LINES: [Line; 3] = [
    Line {
        id: "leading-values",
        what: "thirty of 2000 × 100, σ₃₀/σ₁ from 0.1 to 2e-4: largest relative error of a singular value",
        bar: 1e-11,
    },
    Line {
        id: "leading-angle",
        what: "the same, σ₃₁ half of σ₃₀: sine of the largest angle between the found and the true left space",
        bar: 5e-7,
    },
    Line {
        id: "leading-whole",
        what: "σ₃₀/σ₁ = 1e-5: largest difference from the whole decomposition, which is taken there",
        bar: 1e-15,
    },
];

/// Size of the matrices, and the singular values that are wanted.
const ROWS: usize = 2000;
const COLUMNS: usize = 100;
const WANTED: usize = 30;
/// Last wanted singular value over the first; the last two are beyond the route's reach.
const FALLS: [f64; 6] = [1e-1, 1e-2, 1e-3, 2e-4, 5e-5, 1e-5];
/// How many of the falls are within its reach.
const WITHIN: usize = 4;
/// First unwanted singular value over the last wanted one.
const GAPS: [f64; 2] = [0.5, 0.99];

/// Figures of [`LINES`].
pub(super) fn errors() -> Result<Vec<f64>> {
    let cases: Vec<Case> =
        FALLS[..WITHIN].iter().map(|&fall| Case::of(fall, GAPS[0])).collect::<Result<_>>()?;
    let largest = |of: fn(&Case) -> f64| cases.iter().map(of).fold(0.0, f64::max);
    let beyond = Case::of(FALLS[FALLS.len() - 1], GAPS[0])?;
    ensure!(
        cases.iter().all(|case| !case.is_whole),
        "a case within reach was not by the Gram matrix"
    );
    Ok(vec![
        largest(|case| case.values),
        largest(|case| case.left),
        if beyond.is_whole { 0.0 } else { 1.0 },
    ])
}

/// Errors at one fall of the spectrum.
struct Case {
    /// True where the whole decomposition was made.
    is_whole: bool,
    /// Largest relative error of a singular value, and that of the whole decomposition.
    values: f64,
    values_of_whole: f64,
    /// Sines of the largest angle to the true left and right space, and of the whole decomposition's left one.
    left: f64,
    right: f64,
    left_of_whole: f64,
}

impl Case {
    fn of(fall: f64, gap: f64) -> Result<Self> {
        let known = Known::new(fall, gap)?;
        let found = leading_svd(&known.snapshots, WANTED)?;
        let whole = thin_svd(&known.snapshots)?.truncated(RankRule::Fixed(WANTED))?;
        let values = |svd: &Svd| {
            let pairs = svd.singular_values().iter().zip(&known.values);
            pairs.map(|(found, exact)| (found / exact - 1.0).abs()).fold(0.0, f64::max)
        };
        Ok(Self {
            is_whole: found == whole,
            values: values(&found),
            values_of_whole: values(&whole),
            left: sine(&known.left, found.left())?,
            right: sine(&known.right, found.right())?,
            left_of_whole: sine(&known.left, whole.left())?,
        })
    }
}

/// A matrix whose decomposition is known: cosines as vectors, singular values that fall by one ratio
/// to the last wanted one, and by as much again beyond the gap.
struct Known {
    snapshots: Snapshots,
    values: Vec<f64>,
    left: Matrix,
    right: Matrix,
}

impl Known {
    fn new(fall: f64, gap: f64) -> Result<Self> {
        let value = |place: usize| {
            let wanted = fall.powf(place.min(WANTED - 1) as f64 / (WANTED - 1) as f64);
            let beyond = place.saturating_sub(WANTED - 1);
            if beyond == 0 { wanted } else { wanted * gap * 0.97_f64.powi(beyond as i32 - 1) }
        };
        let values: Vec<f64> = (0..COLUMNS).map(value).collect();
        let left = cosines(ROWS, COLUMNS)?;
        let right = cosines(COLUMNS, COLUMNS)?;
        let scaled = Matrix::from_fn(ROWS, COLUMNS, |row, at| left.get(row, at) * values[at])?;
        let matrix = scaled.times(&right.transposed());
        Ok(Self {
            snapshots: Snapshots::from(matrix),
            values: values[..WANTED].to_vec(),
            left: leading(&left)?,
            right: leading(&right)?,
        })
    }
}

fn leading(vectors: &Matrix) -> Result<Matrix> {
    Ok(Matrix::from_fn(vectors.rows(), WANTED, |row, column| vectors.get(row, column))?)
}

/// The first vectors of the discrete cosine transform, orthonormal; their order is mixed so that
/// neighbours in the spectrum are not neighbours in frequency.
fn cosines(length: usize, count: usize) -> Result<Matrix> {
    Ok(Matrix::from_fn(length, count, |row, column| {
        let frequency = (37 * column) % count;
        let scale = if frequency == 0 { 1.0 } else { 2.0 };
        let phase = std::f64::consts::PI * (row as f64 + 0.5) * frequency as f64 / length as f64;
        (scale / length as f64).sqrt() * phase.cos()
    })?)
}

/// Sine of the largest principal angle between the spaces of two orthonormal sets.
fn sine(exact: &Matrix, found: &Matrix) -> Result<f64> {
    let seen = exact.times(&exact.transposed_times(found));
    let missed =
        Matrix::from_fn(found.rows(), found.columns(), |r, c| found.get(r, c) - seen.get(r, c))?;
    Ok(thin_svd(&Snapshots::from(missed))?.singular_values()[0])
}

/// The section.
pub(super) fn section(page: &mut String) -> Result<()> {
    writeln!(
        page,
        "\nBy the fall of the spectrum, against vectors and values that are known; *gap*: σ₃₁/σ₃₀. The angle depends on the gap, the values do not.\n\n\
         | σ₃₀/σ₁ | gap | way | values, relative | the whole decomposition's | left space, sine | right space, sine | the whole decomposition's left |\n\
         |--:|--:|---|--:|--:|--:|--:|--:|"
    )?;
    for gap in GAPS {
        for fall in FALLS {
            let case = Case::of(fall, gap)?;
            writeln!(
                page,
                "| {fall:.0e} | {gap} | {} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {:.1e} |",
                if case.is_whole { "whole" } else { "Gram matrix" },
                case.values,
                case.values_of_whole,
                case.left,
                case.right,
                case.left_of_whole,
            )?;
        }
    }
    page.push_str(
        "\nBelow 1e-4, for more than a third of the columns and for matrices wider than high `leading_svd` makes the whole decomposition\n\
         and cuts it. `randomised_svd` takes this route below 150 columns and for more than a third of them. Dynamic modes do not take it\n\
         (`docs/decisions/0127-leading-singular-values-by-the-gram-matrix.md`).\n",
    );
    speed(page)
}

/// One line of `benches/peers/reduction/leading.txt`.
struct Turn<'a> {
    threads: &'a str,
    who: &'a str,
    job: &'a str,
    shape: &'a str,
    wall_ms: f64,
    processor_ms: f64,
}

fn turns(text: &str) -> Result<Vec<Turn<'_>>> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            ensure!(words.len() == 9, "turn `{line}` has not nine words");
            Ok(Turn {
                threads: words[1],
                who: words[2],
                job: words[3],
                shape: words[4],
                wall_ms: words[6].parse()?,
                processor_ms: words[8].parse()?,
            })
        })
        .collect()
}

/// Ratio of numpy's time over ours that is asked for.
const ASKED: f64 = 3.0;

fn speed(page: &mut String) -> Result<()> {
    let recorded = include_str!("../../../../../benches/peers/reduction/leading.txt");
    let turns = turns(recorded)?;
    let comments: Vec<&str> = recorded.lines().filter_map(|line| line.strip_prefix("# ")).collect();
    writeln!(
        page,
        "\nOne run of `benches/peers/reduction/leading.sh`: numpy and this crate in five turns, one after the other. Least time of all\n\
         runs in milliseconds, on the processor for one thread and by the clock for numpy's own choice of threads; this crate takes one thread in both. *Turns*: least and largest\n\
         ratio of a turn. The machine had other work: numpy's own two threads waited for each other, and its time with one thread counts where it is the shorter. *numpy, Gram matrix*: `eigh` of XᵀX without the second decomposition, for comparison. The matrix is that of the speed table. {}.\n\n\
         | shape | threads of numpy | numpy, whole SVD | numpy, Gram matrix | this crate, whole | this crate, leading 30 | numpy's whole over leading 30 | turns | asked for | |\n\
         |---|---|--:|--:|--:|--:|--:|--:|--:|---|",
        comments.join("; ")
    )?;
    for shape in ["5000x100", "20000x100"] {
        for threads in ["1", "default"] {
            let by_processor = threads == "1";
            let times = |threads: &str, who: &str, job: &str| -> Vec<f64> {
                let is = |turn: &&Turn<'_>| {
                    (turn.threads, turn.who, turn.job, turn.shape) == (threads, who, job, shape)
                };
                let time = |t: &Turn<'_>| {
                    if by_processor { t.processor_ms } else { t.wall_ms }
                };
                turns.iter().filter(is).map(time).collect()
            };
            row(page, shape, threads, &times)?;
        }
    }
    Ok(())
}

/// One row: times of a shape with one number of threads.
fn row(
    page: &mut String,
    shape: &str,
    threads: &str,
    times: &dyn Fn(&str, &str, &str) -> Vec<f64>,
) -> Result<()> {
    let least =
        |values: Vec<f64>| values.into_iter().reduce(f64::min).context("no turn is recorded");
    let ours = times(threads, "reduction", "leading-svd-30");
    // numpy with one thread counts where its own choice is slower
    let one = times("1", "numpy", "thin-svd");
    let theirs: Vec<f64> =
        times(threads, "numpy", "thin-svd").iter().zip(&one).map(|(a, b)| a.min(*b)).collect();
    let ratios = iter::zip(&theirs, &ours).map(|(theirs, ours)| theirs / ours);
    let (low, high) =
        ratios.fold((f64::INFINITY, 0.0f64), |(low, high), r| (low.min(r), high.max(r)));
    let ratio = least(theirs)? / least(ours)?;
    writeln!(
        page,
        "| {shape} | {threads} | {:.1} | {:.1} | {:.1} | {:.1} | {ratio:.1} | {low:.1} to {high:.1} | {ASKED} | {} |",
        least(times(threads, "numpy", "thin-svd"))?,
        least(times(threads, "numpy", "gram-30"))?,
        least(times(threads, "reduction", "thin-svd"))?,
        least(times(threads, "reduction", "leading-svd-30"))?,
        met(ratio >= ASKED),
    )?;
    Ok(())
}
