//! Cost of each encoding of a set of reference signals in the accuracy of the
//! seven faults.

use std::f64::consts::PI;
use std::fmt::Write as _;

use anyhow::{Context, Result};
use reduction::{
    BoundCase, CompressionConfig, CompressionMap, Encoding, EncodingBounds, Matrix, ModeFigure,
    NoiseCovariance, Placement, PointRule, Regression, Sensitivities, Snapshots, TrainingData,
};

use crate::{median::median, pages::bar::met};

/// Largest inflation of any bound that a default encoding may have.
pub(super) const DEFAULT_BAR: f64 = 1.15;
/// Chances taken for encodings with a seed.
pub(super) const SEEDS: u64 = 10;
/// An extremum of the first mode stands out by this share of its range.
const PROMINENCE_RATIO: f64 = 0.05;
pub(super) const FAULTS: usize = 7;

/// Reference signals, the faults they were simulated with, and the noise that
/// measured ones carry.
pub(super) struct Reference<'a> {
    pub(super) snapshots: &'a Snapshots,
    /// `k1 … k7`, one row a snapshot.
    pub(super) faults: &'a Matrix,
    pub(super) noise: &'a NoiseCovariance,
}

/// Thirty modes, the leading short encoding that a bundle offers.
fn modes_config() -> CompressionConfig {
    CompressionConfig { encoding: Encoding::Modes, count: 30, ..CompressionConfig::default() }
}

/// The paper's encoding.
fn paper_config(seed: u64) -> CompressionConfig {
    with_seed(CompressionConfig::default(), seed)
}

fn with_seed(mut config: CompressionConfig, seed: u64) -> CompressionConfig {
    config.som.seed = seed;
    config.seed = seed;
    config
}

/// Eccentricity as two cartesian parameters: `k6·cos φ`, `k6·sin φ` with
/// `φ = (2·k7 − 1)·π`.
fn cartesian(faults: &[f64]) -> [f64; FAULTS] {
    let phase = (2.0 * faults[6] - 1.0) * PI;
    let mut result = [0.0; FAULTS];
    result[..5].copy_from_slice(&faults[..5]);
    result[5] = faults[5] * phase.cos();
    result[6] = faults[5] * phase.sin();
    result
}

/// Change of `k1 … k7` per unit of the cartesian parameters.
pub(super) fn derivatives(faults: &[f64]) -> Result<Matrix> {
    let phase = (2.0 * faults[6] - 1.0) * PI;
    let turn = 2.0 * PI * faults[5];
    Ok(Matrix::from_fn(FAULTS, FAULTS, |fault, parameter| match (fault, parameter) {
        (5, 5) => phase.cos(),
        (5, 6) => phase.sin(),
        (6, 5) => -phase.sin() / turn,
        (6, 6) => phase.cos() / turn,
        (5 | 6, _) | (_, 5 | 6) => 0.0,
        _ => f64::from(u8::from(fault == parameter)),
    })?)
}

/// A case at each reference signal that has an eccentricity, its sensitivities
/// from a quadratic regression of all signals on the cartesian parameters.
pub(super) fn regressed_cases(reference: &Reference<'_>) -> Result<Vec<BoundCase>> {
    let parameters = parameters(reference.faults)?;
    let fit = Sensitivities::regress(reference.snapshots, &parameters, Regression::Quadratic)?;
    judged_rows(reference.faults)
        .map(|row| (reference.faults.row(row), parameters.row(row)))
        .map(|(faults, point)| {
            let sensitivities = fit.at(&point)?;
            Ok(BoundCase { sensitivities, derivatives: Some(derivatives(&faults)?) })
        })
        .collect()
}

/// Conditions that have an eccentricity, whose direction can be judged.
pub(super) fn judged_rows(faults: &Matrix) -> impl Iterator<Item = usize> + '_ {
    (0..faults.rows()).filter(|&row| faults.get(row, 5) > 0.0)
}

/// Half the step of the central differences, in fault levels.
pub(super) const STEP: f64 = 1e-3;

/// Change of a simulated signal per unit of each cartesian parameter at a condition's faults,
/// one parameter a column.
pub(super) fn differences(
    faults: &[f64],
    step: f64,
    mut simulate: impl FnMut(&[f64; FAULTS]) -> Vec<f64>,
) -> Result<Matrix> {
    let centre = cartesian(faults);
    let columns: Vec<Vec<f64>> = (0..FAULTS)
        .map(|parameter| {
            let mut side = |sign: f64| {
                let mut moved = centre;
                moved[parameter] += sign * step;
                simulate(&moved)
            };
            let (up, down) = (side(1.0), side(-1.0));
            up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect()
        })
        .collect();
    Ok(Matrix::from_columns(&columns)?)
}

/// A case at each condition, its sensitivities those of a simulator.
pub(super) fn simulated_cases(
    faults: &Matrix,
    mut simulate: impl FnMut(&[f64; FAULTS]) -> Vec<f64>,
) -> Result<Vec<BoundCase>> {
    judged_rows(faults)
        .map(|row| faults.row(row))
        .map(|faults| {
            let sensitivities = differences(&faults, STEP, &mut simulate)?;
            Ok(BoundCase { sensitivities, derivatives: Some(derivatives(&faults)?) })
        })
        .collect()
}

fn parameters(faults: &Matrix) -> Result<Matrix> {
    let rows: Vec<[f64; FAULTS]> =
        (0..faults.rows()).map(|row| cartesian(&faults.row(row))).collect();
    Ok(Matrix::from_columns(&rows)?.transposed())
}

/// One line of the table: an encoding, with each of its seeds.
struct Judged {
    name: &'static str,
    kept: usize,
    runs: Vec<EncodingBounds>,
}

/// Encodings that a bundle offers beside the whole signal.
const OFFERED: [&str; 4] = [PAPERS, "cluster means", "modes, 30", "sensitivities, linear"];
const PAPERS: &str = "points: dynamic modes + map (the paper's)";

fn encodings() -> Vec<(&'static str, CompressionConfig, bool)> {
    let base = CompressionConfig::default();
    let points = |placement| CompressionConfig {
        encoding: Encoding::Points(placement),
        ..CompressionConfig::default()
    };
    let sensitivities = |regression| CompressionConfig {
        encoding: Encoding::Sensitivities,
        regression,
        ..CompressionConfig::default()
    };
    vec![
        (PAPERS, points(Placement::DmdSom), true),
        ("points: singular modes + map", points(Placement::PodSom), true),
        ("points: Q-DEIM", points(Placement::Qdeim), false),
        ("points: greedy A-optimal", points(Placement::GreedyAOptimal), false),
        ("points: greedy D-optimal", points(Placement::GreedyDOptimal), false),
        ("points: uniform", points(Placement::Uniform), false),
        ("points: random", points(Placement::Random), true),
        (
            "cluster means",
            CompressionConfig { encoding: Encoding::ClusterMeans, ..base.clone() },
            true,
        ),
        (
            "modes, 10",
            CompressionConfig { encoding: Encoding::Modes, count: 10, ..base.clone() },
            false,
        ),
        ("modes, 30", CompressionConfig { encoding: Encoding::Modes, ..base.clone() }, false),
        ("modes, 60", CompressionConfig { encoding: Encoding::Modes, count: 60, ..base }, false),
        ("sensitivities, linear", sensitivities(Regression::Linear), false),
        ("sensitivities, quadratic", sensitivities(Regression::Quadratic), false),
    ]
}

/// The table of encodings, judged at some cases.
pub(super) struct Table {
    pub(super) text: String,
    /// Largest inflation of a fault's bound by each encoding.
    worst: Vec<(&'static str, f64)>,
}

/// Largest cost of the encodings that a bundle offers in some tables, against the bar.
pub(super) fn bars(page: &mut String, tables: &[Table]) -> Result<()> {
    writeln!(
        page,
        "\n### Encodings that are one flag away\n\n\
         The larger of the two simulators' worst inflations.\n\n\
         | encoding | inflation | at most | |\n|---|--:|--:|---|"
    )?;
    for name in OFFERED {
        let of = |table: &Table| table.worst.iter().find(|(of, _)| *of == name).map(|one| one.1);
        let found: Option<Vec<f64>> = tables.iter().map(of).collect();
        let most = largest(&found.context(name)?);
        writeln!(page, "| {name} | {most:.2} | {DEFAULT_BAR} | {} |", met(most <= DEFAULT_BAR))?;
    }
    Ok(())
}

/// Judges each encoding, and thirty modes case by case.
pub(super) fn table(reference: &Reference<'_>, cases: &[BoundCase]) -> Result<Table> {
    let parameters = parameters(reference.faults)?;
    let data = TrainingData::new(reference.snapshots)
        .with_parameters(&parameters)
        .with_noise(reference.noise);
    let judge = |config: &CompressionConfig| -> Result<(usize, EncodingBounds)> {
        let map = CompressionMap::fit(&data, config)?;
        Ok((map.encoded_len(), EncodingBounds::of(&map, reference.noise, cases)?))
    };
    let modes = judge(&modes_config()).context("thirty modes")?.1;
    let (mut text, mut worst) = (String::new(), Vec::new());
    head(&mut text, reference, &modes)?;
    for (name, config, seeded) in encodings() {
        let seeds = if seeded { SEEDS } else { 1 };
        let judged: Vec<(usize, EncodingBounds)> = (0..seeds)
            .map(|seed| judge(&with_seed(config.clone(), seed)))
            .collect::<Result<_>>()
            .context(name)?;
        let kept = judged.iter().map(|(kept, _)| *kept).max().unwrap_or(0);
        let runs = judged.into_iter().map(|(_, bounds)| bounds).collect();
        worst.push((name, line(&mut text, &Judged { name, kept, runs })?));
    }
    text.push_str(&verdict(reference, &modes)?);
    Ok(Table { text, worst })
}

/// Cost of thirty modes in the median and in the worst single case, by name.
fn verdict(reference: &Reference<'_>, modes: &EncodingBounds) -> Result<String> {
    let middle = largest(&modes.median_inflation());
    let (mut worst, mut fault, mut case) = (0.0, 0, 0);
    for row in 0..FAULTS {
        let pairs = modes.deviations.row(row).into_iter().zip(modes.whole.row(row));
        for (column, (kept, whole)) in pairs.enumerate() {
            if kept / whole > worst {
                (worst, fault, case) = (kept / whole, row, column);
            }
        }
    }
    let row = judged_rows(reference.faults).nth(case).context("a case has its condition")?;
    let levels: Vec<String> =
        reference.faults.row(row).iter().map(|level| format!("{level:.4}")).collect();
    Ok(format!(
        "\nThirty modes inflate the bound of no fault by more than {middle:.3} in the median of the cases\n\
         ({} {DEFAULT_BAR}). The worst single case of any fault is k{} at condition {} of the dataset\n\
         (k1 … k7 = {}): {worst:.3}.\n",
        if middle <= DEFAULT_BAR { "within" } else { "above" },
        fault + 1,
        row + 1,
        levels.join(", "),
    ))
}

fn head(page: &mut String, reference: &Reference<'_>, modes: &EncodingBounds) -> Result<()> {
    writeln!(
        page,
        "\n| encoding | numbers | information | k1 | k2 | k3 | k4 | k5 | k6 | k7 | worst |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
    )?;
    let locations = reference.snapshots.locations();
    write!(page, "| whole signal, least deviation | {locations} | 1")?;
    for fault in 0..FAULTS {
        write!(page, " | {:.1e}", median(&modes.whole.row(fault)))?;
    }
    writeln!(page, " | |")?;
    let ones = " 1.00 |".repeat(FAULTS + 1);
    writeln!(page, "| full: the whole signal (a bundle's default) | {locations} | 1.000 |{ones}")?;
    Ok(())
}

/// Writes a line; returns the worst inflation that it tells.
fn line(page: &mut String, judged: &Judged) -> Result<f64> {
    let Judged { name, kept, runs } = judged;
    let information: Vec<f64> = runs.iter().map(|run| median(&run.information)).collect();
    write!(page, "| {name} | {kept} | {:.3}", median(&information))?;
    for fault in 0..FAULTS {
        let inflation: Vec<f64> = runs.iter().map(|run| run.median_inflation()[fault]).collect();
        write!(page, " | {:.2}", median(&inflation))?;
    }
    let mut worst: Vec<f64> = runs.iter().map(|run| largest(&run.median_inflation())).collect();
    worst.sort_by(f64::total_cmp);
    let middle = median(&worst);
    if runs.len() > 1 {
        writeln!(page, " | {middle:.2} ({:.2} to {:.2}) |", worst[0], worst[worst.len() - 1])?;
    } else {
        writeln!(page, " | {middle:.2} |")?;
    }
    Ok(middle)
}

/// How the paper's points lie to the extrema of the first dynamic mode.
pub(super) fn figure_section(reference: &Reference<'_>) -> Result<String> {
    let locations = reference.snapshots.locations();
    let mut page = String::from(
        "\n## Points and extrema\n\n\
         The paper's figure 5 says that the points lie on extrema of the first dynamic mode. From the\n\
         embedded chirp bundle (`fdi bundle show --figure FILE.svg`):\n\n\
         ![First dynamic mode of the incipient chirp signals with the thirty points on it](figures/figure-5.svg)\n\n\
         Mean distance of the 30 points to the nearest extremum, in samples, the same for points placed anywhere\n\
         (and how much thirty such points scatter, one standard deviation), the share of the extrema with a point\n\
         within half a uniform step, and the distance when each neuron keeps the location of the row nearest to\n\
         it instead of its own location component (`PointRule::NearestRow`).\n\n\
         | seed | extrema | distance | by chance | extrema with a point | distance, nearest rows |\n\
         |--:|--:|--:|--:|--:|--:|\n",
    );
    let (mut found, mut nearest, mut by_chance) = (0.0, 0.0, 0.0);
    for seed in 0..SEEDS {
        let config = paper_config(seed);
        let figure_of = |config: &CompressionConfig| -> Result<ModeFigure> {
            let map = CompressionMap::fit(&reference.snapshots.into(), config)?;
            ModeFigure::of(&map, PROMINENCE_RATIO).context("the map keeps points")
        };
        let figure = figure_of(&config)?;
        let rows =
            figure_of(&CompressionConfig { point_rule: PointRule::NearestRow, ..config.clone() })?;
        writeln!(
            page,
            "| {seed} | {} | {:.1} | {:.1} ± {:.1} | {:.2} | {:.1} |",
            figure.extrema.len(),
            figure.mean_distance_to_extremum(),
            figure.mean_distance_by_chance(),
            scatter_by_chance(&figure),
            figure.extrema_covered(locations / (2 * config.count)),
            rows.mean_distance_to_extremum(),
        )?;
        found += figure.mean_distance_to_extremum() / SEEDS as f64;
        nearest += rows.mean_distance_to_extremum() / SEEDS as f64;
        by_chance += figure.mean_distance_by_chance() / SEEDS as f64;
    }
    let verdict = if found < 0.5 * by_chance { "do" } else { "do not" };
    writeln!(
        page,
        "\nOver the seeds the points are {found:.1} samples from an extremum, {by_chance:.1} by chance: on\n\
         these signals, with the scaling of decision 0022, they {verdict} gather on the extrema of the first mode;\n\
         with nearest rows it is {nearest:.1}. What the map places evenly is all thirty modes and the time together,\n\
         of which the first mode is one column in thirty-one."
    )?;
    page.push_str(include_str!("points.md"));
    Ok(page)
}

/// Standard deviation of the mean distance of as many points, each placed anywhere.
fn scatter_by_chance(figure: &ModeFigure) -> f64 {
    let distances: Vec<f64> = (0..figure.mode.len())
        .map(|at| figure.extrema.iter().map(|&e| e.abs_diff(at)).min().unwrap_or(0) as f64)
        .collect();
    let count = distances.len() as f64;
    let mean = distances.iter().sum::<f64>() / count;
    let variance = distances.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / count;
    (variance / figure.points.len().max(1) as f64).sqrt()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use reduction::NoiseModel;

    use super::*;

    /// Smooth signals of seven parameters in filtered noise: no actuator, only
    /// the shape of the data.
    fn synthetic() -> (Snapshots, Matrix, NoiseCovariance) {
        // A Kronecker sequence: even, without chance.
        let step = |fault: usize| [2.0_f64, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0][fault].sqrt();
        let faults = Matrix::from_fn(100, FAULTS, |snapshot, fault| {
            let place = (0.5 + (snapshot + 1) as f64 * step(fault)).fract();
            if fault == 6 { place } else { 0.005 + 0.05 * place }
        })
        .unwrap();
        let snapshots = Snapshots::from_fn(300, 100, |row, snapshot| {
            let x = row as f64 / 299.0;
            let p = cartesian(&faults.row(snapshot));
            let wave = (40.0 * x * (1.0 + x)).sin();
            wave * (1.0 + p[0] * x)
                + p[1] * (40.0 * x * (1.0 + x) + 1.0).cos().tanh()
                + p[2] * wave * (1.0 + (9.0 * x).cos())
                + p[3] * wave * (1.0 + (9.0 * x + 2.1).cos())
                + p[4] * wave * (1.0 + (9.0 * x + 4.2).cos())
                + p[5] * (23.0 * x).sin()
                + p[6] * (23.0 * x).cos()
                + 3.0 * p[0] * p[5] * x
        })
        .unwrap();
        let autocovariance =
            (0..20).map(f64::from).map(|lag| 1e-6 * (1.0 + lag) * (-0.9 * lag).exp()).collect();
        let model = NoiseModel::Stationary { autocovariance };
        let noise = NoiseCovariance::new(&model, 300, 1e-9).unwrap();
        (snapshots, faults, noise)
    }

    #[test]
    fn the_table_judges_every_encoding() {
        let (snapshots, faults, noise) = synthetic();
        let reference = Reference { snapshots: &snapshots, faults: &faults, noise: &noise };
        let cases = regressed_cases(&reference).unwrap();
        assert_eq!(cases.len(), 100);
        let page = table(&reference, &cases).unwrap().text;
        assert_eq!(page.lines().filter(|line| line.starts_with('|')).count(), 17);
        let information = |name: &str| -> f64 {
            let line = page.lines().find(|line| line.contains(name)).unwrap();
            line.split('|').nth(3).unwrap().trim().parse().unwrap()
        };
        assert!(information("sensitivities, quadratic") > 0.999);
        assert!(information("modes, 30") > information("points: uniform"));
        assert!(information("points: uniform") < 0.9);
        let figure = figure_section(&reference).unwrap();
        assert_eq!(figure.lines().filter(|line| line.starts_with('|')).count(), 12);
    }

    #[test]
    fn derivatives_of_the_polar_faults_match_differences() {
        const STEP: f64 = 1e-7;
        let faults = [0.01, 0.02, 0.03, 0.04, 0.05, 0.03, 0.8];
        let inverse = derivatives(&faults).unwrap();
        for fault in 0..FAULTS {
            let mut moved = faults;
            moved[fault] += STEP;
            let (from, to) = (cartesian(&faults), cartesian(&moved));
            let change: Vec<f64> = to.iter().zip(from).map(|(b, a)| (b - a) / STEP).collect();
            let back = inverse.times_vector(&change);
            for (other, value) in back.iter().enumerate() {
                let expected = f64::from(u8::from(other == fault));
                // Truncation of the difference: 10 (second derivative) times the step.
                assert!((value - expected).abs() < 1e-5, "{fault} {other}: {value}");
            }
        }
    }
}
