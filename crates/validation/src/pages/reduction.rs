//! `docs/validation/reduction.md`: the compression against closed forms, PyDMD,
//! MiniSom and numpy.

mod encodings;
mod filter;
mod leading;

use std::fmt::Write as _;

use anyhow::{Result, ensure};
use ema_sim::{FaultCoordinates, Imperfections, PhysicalFaults};
use fdi_core::{
    Dataset, DatasetRequest, Experiment, ReferenceDesign, default_noise_a, unit_noise_covariance,
};
use reduction::{
    Complex, Dmd, DmdConfig, DmdKind, Grid, Matrix, NoiseCovariance, NoiseModel, RankRule,
    SampleOrder, Schedule, Snapshots, Som, SomConfig, SomStart, StreamingConfig, StreamingSvd,
    Training, thin_svd,
};

use super::{bar::met, figure::Figure};

/// Figures at the level of rounding: another machine's may be this many times
/// as large without a word; the bar they are held to is far above.
const ROUNDING_REL: f64 = 1e3;

/// Figures of the page, in its order: name, unit, bar.
struct Line {
    id: &'static str,
    what: &'static str,
    bar: f64,
}

const CLOSED_FORMS: [Line; 6] = [
    Line {
        id: "svd-reconstruction",
        what: "thin SVD of 400 × 60 waves: `‖X − UΣVᵀ‖ ÷ ‖X‖`",
        bar: 1e-11,
    },
    Line { id: "svd-orthogonality", what: "the same: largest entry of `UᵀU − 1`", bar: 1e-11 },
    Line {
        id: "dmd-projected-eigenvalues",
        what: "two-mode field, projected DMD: largest error of an eigenvalue",
        bar: 1e-9,
    },
    Line {
        id: "dmd-exact-eigenvalues",
        what: "two-mode field, exact DMD: largest error of an eigenvalue",
        bar: 1e-9,
    },
    Line {
        id: "dmd-reconstruction",
        what: "two-mode field, exact DMD: largest error of a reconstructed value",
        bar: 1e-9,
    },
    Line {
        id: "streaming-modes",
        what: "streamed against direct SVD, 2000 × 500, 30 modes: largest distance of a mode",
        bar: 1e-8,
    },
];

const TOPOLOGY: [Line; 2] = [
    Line {
        id: "som-online-topographic",
        what: "bent sheet on 6 × 6 neurons, online: fraction of samples torn",
        bar: 0.1,
    },
    Line {
        id: "som-batch-topographic",
        what: "bent sheet on 6 × 6 neurons, batch: fraction of samples torn",
        bar: 0.1,
    },
];

const PEERS: [Line; 5] = [
    Line {
        id: "numpy-singular-values",
        what: "numpy, singular values: largest difference relative to the first",
        bar: 1e-13,
    },
    Line { id: "pydmd-eigenvalues", what: "PyDMD, eigenvalues, ranks 4 and 9", bar: 1e-10 },
    Line {
        id: "pydmd-modes",
        what: "PyDMD, amplitude times mode at three locations, ranks 4 and 9",
        bar: 1e-10,
    },
    Line {
        id: "minisom-online",
        what: "MiniSom, weights after 12 epochs online, 4 × 3 square and 5 × 3 hexagonal",
        bar: 1e-12,
    },
    Line { id: "minisom-batch", what: "MiniSom, weights after 12 epochs in batch", bar: 1e-12 },
];

/// The figures that anyone can recompute in a second.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let mut values = svd_errors()?;
    values.extend(dmd_errors()?);
    values.push(streaming_error()?);
    values.extend(topographic_errors()?);
    values.push(numpy_difference()?);
    values.extend(pydmd_differences()?);
    values.extend(minisom_differences()?);
    values.extend(leading::errors()?);
    let lines = CLOSED_FORMS.iter().chain(&TOPOLOGY).chain(&PEERS).chain(&leading::LINES);
    lines
        .zip(values)
        .map(|(line, value)| {
            ensure!(value <= line.bar, "`{}` is {value:e}, above {:e}", line.id, line.bar);
            let rounding = line.bar < 1e-6;
            Ok(Figure {
                id: line.id.to_owned(),
                value,
                tolerance_rel: if rounding { ROUNDING_REL } else { 0.2 },
                unit: "1".to_owned(),
            })
        })
        .collect()
}

/// The whole page.
pub(super) fn text(figures: &[Figure]) -> Result<String> {
    let mut page = String::from(
        "# Validation of the compression\n\n\
         Written by `cargo xtask validate reduction`; do not edit. The figures of the first three\n\
         tables are recomputed by `cargo xtask validate --check`.\n",
    );
    section(&mut page, "Closed forms", "error", &CLOSED_FORMS, figures)?;
    section(&mut page, "Known topology", "fraction", &TOPOLOGY, figures)?;
    section(&mut page, "Other software on the same numbers", "difference", &PEERS, figures)?;
    writeln!(
        page,
        "\nThe scripts and their outputs are under `fixtures/references/pydmd` ({}) and\n\
         `fixtures/references/minisom` ({}). Rank rules: the energy ranks at 0.5, 0.9, 0.99 and\n\
         0.9999 and the optimal hard threshold equal PyDMD's on the same matrix\n\
         (`versus_pydmd_rank_rules`).",
        versions(include_str!("../../../../fixtures/references/pydmd/versions.txt")),
        versions(include_str!("../../../../fixtures/references/minisom/versions.txt")),
    )?;
    section(&mut page, "Leading singular values", "error", &leading::LINES, figures)?;
    leading::section(&mut page)?;
    speed(&mut page)?;
    streaming(&mut page)?;
    page.push_str(&on_reference_signals()?);
    page.push_str(BAD_INPUT);
    Ok(page)
}

fn section(
    page: &mut String,
    title: &str,
    quantity: &str,
    lines: &[Line],
    figures: &[Figure],
) -> Result<()> {
    writeln!(page, "\n## {title}\n\n| what | {quantity} | bar |\n|---|--:|--:|")?;
    for line in lines {
        let figure = figures.iter().find(|figure| figure.id == line.id);
        let value = figure.map_or(f64::NAN, |figure| figure.value);
        ensure!(value.is_finite(), "no figure `{}`", line.id);
        if line.bar < 1e-6 {
            writeln!(page, "| {} | {value:.1e} | {:.0e} |", line.what, line.bar)?;
        } else {
            writeln!(page, "| {} | {value:.3} | {} |", line.what, line.bar)?;
        }
    }
    Ok(())
}

fn versions(text: &str) -> String {
    text.lines().collect::<Vec<_>>().join(", ")
}

/// One timing of `benches/peers/reduction/recorded.txt`.
struct Timing<'a> {
    who: &'a str,
    job: &'a str,
    shape: &'a str,
    minimum_ms: f64,
    median_ms: f64,
}

fn timings(text: &str) -> Result<Vec<Timing<'_>>> {
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            ensure!(words.len() == 6, "timing `{line}` has not six words");
            Ok(Timing {
                who: words[0],
                job: words[1],
                shape: words[2],
                minimum_ms: words[4].parse()?,
                median_ms: words[5].parse()?,
            })
        })
        .collect()
}

/// Job, what the table calls it, peer, and how many times the peer's time over
/// ours is asked for.
const SPEED: [(&str, &str, &str, f64); 6] = [
    ("thin-svd", "thin SVD", "numpy", 1.0),
    ("exact-dmd-30", "exact DMD, rank 30", "PyDMD", 3.0),
    ("projected-dmd-30", "projected DMD, rank 30", "PyDMD", 3.0),
    ("som-online-100-epochs", "SOM, 30 neurons, 100 epochs, online", "MiniSom", 30.0),
    ("som-batch-100-epochs", "SOM, 30 neurons, 100 epochs, batch", "numpy", 1.0),
    ("som-batch-100-epochs", "SOM, 30 neurons, 100 epochs, batch", "MiniSom", 1.0),
];

fn speed(page: &mut String) -> Result<()> {
    let recorded = include_str!("../../../../benches/peers/reduction/recorded.txt");
    let timings = timings(recorded)?;
    let comments: Vec<&str> = recorded.lines().filter_map(|line| line.strip_prefix("# ")).collect();
    writeln!(
        page,
        "\n## Speed\n\n\
         One run of `benches/peers/reduction/compare.sh`, everything on one thread; time on the\n\
         processor in milliseconds, minimum · median of the runs. numpy and PyDMD ran before and\n\
         after this crate; their faster figure counts. Ratio: peer's minimum over ours. {}.\n\n\
         | job | shape | this crate | peer | peer's time | ratio | asked for | |\n\
         |---|---|--:|---|--:|--:|--:|---|",
        comments.join("; ")
    )?;
    for (job, name, peer, asked) in SPEED {
        let ours = timings.iter().filter(|timing| timing.who == "reduction" && timing.job == job);
        for ours in ours {
            let theirs = timings
                .iter()
                .filter(|timing| timing.job == job && timing.shape == ours.shape)
                .filter(|timing| timing.who.trim_start_matches("again-") == peer)
                .min_by(|a, b| a.minimum_ms.total_cmp(&b.minimum_ms));
            let Some(theirs) = theirs else { continue };
            let ratio = theirs.minimum_ms / ours.minimum_ms;
            let verdict = met(ratio >= asked);
            writeln!(
                page,
                "| {name} | {} | {:.1} · {:.1} | {peer} | {:.1} · {:.1} | {ratio:.1} | {asked} | {verdict} |",
                ours.shape, ours.minimum_ms, ours.median_ms, theirs.minimum_ms, theirs.median_ms,
            )?;
        }
    }
    Ok(())
}

fn streaming(page: &mut String) -> Result<()> {
    let recorded = include_str!("../../../../benches/peers/reduction/stream.txt");
    let value = |key: &str| -> Result<&str> {
        recorded
            .lines()
            .find_map(|line| line.strip_prefix(key)?.strip_prefix(' '))
            .ok_or_else(|| anyhow::anyhow!("no `{key}` in the recorded stream"))
    };
    let peak: f64 = value("stream-peak-mib")?.parse()?;
    let (worst_mode, worst_value) = (value("worst-mode-30")?, value("worst-value-rel-30")?);
    writeln!(
        page,
        "\n## Streaming\n\n\
         One run of `cargo run --release -p fdi-benches --example reduction_stream`: decaying waves\n\
         over a floor of pseudo-noise, {} snapshots made 100 at a time, 60 directions carried. The\n\
         direct decomposition held all of them ({} MiB peak, {} s).\n\n\
         | what | figure | bar | |\n\
         |---|--:|--:|---|\n\
         | peak resident memory of the process while streaming, MiB | {peak} | 1024 | {} |\n\
         | largest distance of the 30 leading modes to the direct ones | {worst_mode} | 1e-8 | {} |\n\
         | largest relative difference of their singular values | {worst_value} | 1e-8 | {} |\n\
         | what the fit itself said a mode can be off | {} | | |\n\
         | time, s | {} | | |",
        value("shape")?,
        value("direct-peak-mib")?,
        value("direct-seconds")?,
        met(peak < 1024.0),
        met(worst_mode.parse::<f64>()? < 1e-8),
        met(worst_value.parse::<f64>()? < 1e-8),
        value("worst-mode-bound-30")?,
        value("stream-seconds")?,
    )?;
    writeln!(
        page,
        "\nThe thirtieth singular value is {} of the first. What a stream loses is the square of what\n\
         it drops: a set whose spectrum does not fall beyond the directions carried is not reproduced\n\
         to 1e-8, and `StreamedSvd::mode_error` says so.",
        value("sigma-30-over-1")?
    )?;
    Ok(())
}

/// The encodings on the reference dataset that a bundle is learnt from.
fn on_reference_signals() -> Result<String> {
    let experiment = Experiment::chirp();
    let dataset = Dataset::generate(
        &experiment,
        &DatasetRequest {
            design: ReferenceDesign::Incipient,
            conditions: 100,
            seed: DATASET_SEED,
            imperfections: Imperfections::NONE,
            jobs: 1,
        },
    )?;
    let snapshots = Snapshots::from_columns(&dataset.signals_a)?;
    let levels: Vec<_> = dataset.conditions.iter().map(|condition| condition.levels).collect();
    let faults = Matrix::from_columns(&levels)?.transposed();
    let noise = sensor_noise(&experiment, snapshots.locations())?;
    let reference = encodings::Reference { snapshots: &snapshots, faults: &faults, noise: &noise };
    let mut text = encoding_tables(&reference, &experiment, &dataset)?;
    text.push_str(&filter::section(&experiment, &faults)?);
    text.push_str(&encodings::figure_section(&reference)?);
    Ok(text)
}

/// Costs of encodings, with the sensitivities of both simulators and with regressed ones.
fn encoding_tables(
    reference: &encodings::Reference<'_>,
    experiment: &Experiment,
    dataset: &Dataset,
) -> Result<String> {
    let high = experiment.high_fidelity(0.0, Imperfections::NONE)?;
    let of_high = encodings::simulated_cases(reference.faults, |point| {
        let faults = PhysicalFaults::from(&FaultCoordinates(*point));
        experiment.high_fidelity_signal(&high, &faults)
    })?;
    let mut monitor = experiment.monitor(0.0)?;
    let of_monitor = encodings::simulated_cases(reference.faults, |point| {
        monitor.signal(&FaultCoordinates(*point))
    })?;
    let regressed = encodings::regressed_cases(reference)?;
    let mut text = String::new();
    writeln!(
        text,
        "\n## What an encoding costs\n\n\
         {} signals of {} values: the dataset `incipient` of the chirp experiment, seed {DATASET_SEED}, electronics\n\
         without imperfections, SHA-256 `{}…`. Noise: white, {} A on each phase sample, through\n\
         the envelope's filter. Inflation: least standard deviation of a fault from the encoded\n\
         numbers over that from the whole filtered signal (Cramér-Rao), median over the cases; where chance is in\n\
         the encoding, median and range over {} seeds. Information: mean share kept over all\n\
         directions of the faults. Eccentricity counts as two cartesian parameters. Encodings are learnt\n\
         on the same signals; nothing was tuned on the tables.\n\n\
         A diagnosis looks at the whole filtered envelope unless told otherwise (`--encoding full`), which\n\
         inflates nothing: 1.00 for every fault by definition (asked for: at most {}). `points`, `cluster-means`,\n\
         `modes` (30) and `sensitivities` (linear) are one flag away; below the tables is what they cost at most.\n\
         These signals are of ideal electronics; the embedded bundle's are of real ones and another seed, so that\n\
         `fdi bundle show` has other figures: it says what each costs for the bundle at hand.\n\n\
         ### Sensitivities of the high-fidelity model\n\n\
         Central differences of the model that made the signals, {} to each side of each condition's\n\
         levels: no encoding is judged by what it was learnt from. k2 depends on that step in high fidelity (below), so that its\n\
         column holds for this step alone.",
        reference.snapshots.count(),
        reference.snapshots.locations(),
        &dataset.sha256()[..16],
        default_noise_a(&experiment.actuator),
        encodings::SEEDS,
        encodings::DEFAULT_BAR,
        encodings::STEP,
    )?;
    let by_high = encodings::table(reference, &of_high)?;
    text.push_str(&by_high.text);
    text.push_str(
        "\n### Sensitivities of the monitoring model\n\n\
         The same differences of the model that a diagnosis runs, which `fdi bundle show` takes for its own signals.\n",
    );
    let by_monitor = encodings::table(reference, &of_monitor)?;
    text.push_str(&by_monitor.text);
    text.push_str(
        "\n### Sensitivities from the signals alone\n\n\
         A quadratic regression of the same signals on the faults, which needs no simulator: the row\n\
         of quadratic sensitivities is near 1 by construction.\n",
    );
    text.push_str(&encodings::table(reference, &regressed)?.text);
    encodings::bars(&mut text, &[by_high, by_monitor])?;
    text.push_str(include_str!("reduction/encodings.md"));
    Ok(text)
}

/// The command line's default.
const DATASET_SEED: u64 = 0;

/// White noise on the phases after the envelope's filter.
fn sensor_noise(experiment: &Experiment, samples: usize) -> Result<NoiseCovariance> {
    let rate_hz = experiment.actuator.controller.sample_hz;
    let unit = unit_noise_covariance(experiment, rate_hz);
    let noise_a = default_noise_a(&experiment.actuator);
    let band =
        |lag: usize| (0..samples - lag).map(|at| noise_a.powi(2) * unit.at(at + lag, at)).collect();
    let bands = (0..=unit.half_band().min(samples - 1)).map(band).collect();
    Ok(NoiseCovariance::new(&NoiseModel::Banded(bands), samples, 0.0)?)
}

const BAD_INPUT: &str = "
## Bad input

| input | outcome | test |
|---|---|---|
| NaN or infinity | `MatrixError::NotFinite` with row and column | `a_value_that_is_not_finite_is_found` |
| one snapshot | `DmdError::TooFewSnapshots`, `CompressionError::NoVariation` | `degenerate_sequences_give_errors_or_their_only_mode`, `bad_input_is_refused_with_its_numbers` |
| more neurons than rows | `SomError::MoreNeuronsThanSamples` | `unsound_settings_are_refused` |
| rank-deficient | the numerical rank is kept, whatever was asked for | `rank_deficient_snapshots_keep_their_rank` |
| all zero | `SvdError::Zero`, `CompressionError::NoVariation` | `unsound_rules_and_zeros_are_refused`, `zeros_and_constants_have_no_compression` |
| constant signals | DMD: one mode of eigenvalue 1; compression: `CompressionError::NoVariation` | `degenerate_sequences_give_errors_or_their_only_mode`, `zeros_and_constants_have_no_compression` |
| a conjugate pair cut in half | `DmdError::PairCutInHalf` | `cutting_a_pair_in_half_is_refused` |
| a rank between the two of a pair | the reduced operator is real: pairs stay whole | `a_rank_that_would_halve_a_pair_keeps_pairs_whole` |
| signal of another length | `LengthError` | `signals_of_another_length_are_refused` |
| parts that do not fit one another | `PartsError` | `tampered_parts_are_refused` |
";

fn svd_errors() -> Result<Vec<f64>> {
    let snapshots = waves(400, 60)?;
    let svd = thin_svd(&snapshots)?;
    let gram = svd.left().transposed_times(svd.left());
    let defect = (0..60)
        .flat_map(|column| (0..60).map(move |row| (row, column)))
        .map(|(row, column)| (gram.get(row, column) - f64::from(u8::from(row == column))).abs())
        .fold(0.0, f64::max);
    let again = svd.reconstruct();
    let pairs = again.values().iter().zip(snapshots.matrix().values());
    let error = pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    Ok(vec![error / snapshots.matrix().frobenius_norm(), defect])
}

fn dmd_errors() -> Result<Vec<f64>> {
    let polar = |modulus: f64, turn: f64| Complex::new(modulus * turn.cos(), modulus * turn.sin());
    let lambda = [polar(0.99, 0.3), polar(0.9, 1.1)];
    let snapshots = Snapshots::from_fn(300, 20, |row, step| {
        let x = row as f64 / 300.0;
        let shapes =
            [Complex::new((3.0 * x).sin(), (5.0 * x).cos()), Complex::new(x * x, (-4.0 * x).exp())];
        (0..2).map(|k| (shapes[k] * lambda[k].power(step as u32)).re).sum()
    })?;
    let fit = |kind| Dmd::fit(&snapshots, &DmdConfig { rank: RankRule::Energy(1.0 - 1e-12), kind });
    let error = |dmd: &Dmd| {
        (0..2).map(|k| (dmd.eigenvalues()[2 * k] - lambda[k]).modulus()).fold(0.0, f64::max)
    };
    let (projected, exact) = (fit(DmdKind::Projected)?, fit(DmdKind::Exact)?);
    let again = exact.reconstruct(20);
    let pairs = again.values().iter().zip(snapshots.matrix().values());
    let reconstruction = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    Ok(vec![error(&projected), error(&exact), reconstruction])
}

fn streaming_error() -> Result<f64> {
    let snapshots = waves(2000, 500)?;
    let mut stream = StreamingSvd::new(StreamingConfig { rank: 60, block: 40 })?;
    stream.push(&snapshots)?;
    let (streamed, direct) = (stream.finish()?, thin_svd(&snapshots)?);
    Ok((0..30)
        .map(|index| {
            let pairs = streamed.left().column(index).iter().zip(direct.left().column(index));
            pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        })
        .fold(0.0, f64::max))
}

/// Decaying waves over pseudo-noise of 10⁻⁶.
fn waves(rows: usize, columns: usize) -> Result<Snapshots> {
    Ok(Snapshots::from_fn(rows, columns, |row, column| {
        let (i, j) = (row as f64, column as f64);
        let (x, t) = (i / rows as f64, j / columns as f64);
        let waves: f64 = (1..25)
            .map(f64::from)
            .map(|k| 0.8_f64.powf(k) * (6.0 * k * x + 11.0 * k * t + k * k).sin())
            .sum();
        waves + 1e-6 * (12.9898 * i + 78.233 * j + 0.37 * i * j).sin()
    })?)
}

fn topographic_errors() -> Result<Vec<f64>> {
    let sheet = Matrix::from_fn(576, 3, |row, feature| {
        let (u, v) = ((row / 24) as f64 / 24.0, (row % 24) as f64 / 24.0);
        [u, v, 0.3 * (3.0 * u).sin()][feature]
    })?;
    let online = Training::Online { rate: Schedule::inverse(0.5), order: SampleOrder::Shuffled };
    [online, Training::Batch]
        .into_iter()
        .map(|training| {
            let config = SomConfig {
                grid: Grid::rectangular(6, 6),
                start: SomStart::PrincipalAxes,
                training,
                epochs: 60,
                ..SomConfig::default()
            };
            Ok(Som::fit(&sheet, &config)?.topographic_error(&sheet)?)
        })
        .collect()
}

fn numbers(text: &str) -> Result<Vec<Vec<f64>>> {
    let line = |line: &str| line.split(' ').map(|number| Ok(number.parse()?)).collect();
    text.lines().map(line).collect()
}

/// `field` of `fixtures/references/pydmd/generate.py`.
fn pydmd_field() -> Result<Snapshots> {
    Ok(Snapshots::from_fn(60, 16, |row, column| {
        let (x, t) = (row as f64 / 60.0, column as f64);
        let waves: f64 = (1..7)
            .map(f64::from)
            .map(|k| {
                let phase = 2.0 * std::f64::consts::PI * k * x + 0.61 * k * t + 0.2 * k * k;
                0.8_f64.powf(k) * phase.sin() * (-0.05 * k * t).exp()
            })
            .sum();
        waves + 0.02 * (17.0 * x * (1.0 + t)).sin()
    })?)
}

fn numpy_difference() -> Result<f64> {
    let table = numbers(include_str!("../../../../fixtures/references/pydmd/singular-values.txt"))?;
    let svd = thin_svd(&pydmd_field()?)?;
    let pairs = svd.singular_values().iter().zip(&table);
    Ok(pairs.map(|(found, line)| (found - line[0]).abs()).fold(0.0, f64::max) / table[0][0])
}

fn pydmd_differences() -> Result<Vec<f64>> {
    let tables = [
        (DmdKind::Exact, include_str!("../../../../fixtures/references/pydmd/exact-rank-4.txt")),
        (DmdKind::Exact, include_str!("../../../../fixtures/references/pydmd/exact-rank-9.txt")),
        (
            DmdKind::Projected,
            include_str!("../../../../fixtures/references/pydmd/projected-rank-4.txt"),
        ),
        (
            DmdKind::Projected,
            include_str!("../../../../fixtures/references/pydmd/projected-rank-9.txt"),
        ),
    ];
    let (mut eigenvalues, mut modes) = (0.0_f64, 0.0_f64);
    for (kind, text) in tables {
        let table = numbers(text)?;
        let config = DmdConfig { rank: RankRule::Fixed(table.len()), kind };
        let dmd = Dmd::fit(&pydmd_field()?, &config)?;
        for (index, line) in table.iter().enumerate() {
            let expected = |at: usize| Complex::new(line[2 * at], line[2 * at + 1]);
            eigenvalues = eigenvalues.max((dmd.eigenvalues()[index] - expected(0)).modulus());
            for (at, location) in [0, 7, 31].into_iter().enumerate() {
                let found = dmd.mode(index)[location] * dmd.amplitudes()[index];
                modes = modes.max((found - expected(at + 1)).modulus());
            }
        }
    }
    Ok(vec![eigenvalues, modes])
}

fn minisom_differences() -> Result<Vec<f64>> {
    let online = Training::Online { rate: Schedule::inverse(0.5), order: SampleOrder::AsGiven };
    let square = minisom_difference(
        Grid::rectangular(4, 3),
        online,
        include_str!("../../../../fixtures/references/minisom/online-rectangular-4x3.txt"),
        |theirs| theirs,
    )?;
    let hexagonal = minisom_difference(
        Grid::hexagonal(5, 3),
        online,
        include_str!("../../../../fixtures/references/minisom/online-hexagonal-3x5.txt"),
        |theirs| theirs % 5 * 3 + theirs / 5,
    )?;
    let batch = minisom_difference(
        Grid::rectangular(4, 3),
        Training::Batch,
        include_str!("../../../../fixtures/references/minisom/batch-rectangular-4x3.txt"),
        |theirs| theirs,
    )?;
    Ok(vec![square.max(hexagonal), batch])
}

/// Largest difference of a weight to `fixtures/references/minisom/generate.py`,
/// whose neuron `x·ny + y` is ours at `place`.
fn minisom_difference(
    grid: Grid,
    training: Training,
    text: &str,
    place: fn(usize) -> usize,
) -> Result<f64> {
    let samples = Matrix::from_fn(90, 3, |i, f| {
        (0.37 * i as f64 * (f as f64 + 1.0)).sin() + 0.01 * i as f64 * f as f64
    })?;
    let neurons = grid.neurons();
    let mut start = vec![0.0; neurons * 3];
    for (theirs, feature) in (0..neurons).flat_map(|neuron| (0..3).map(move |f| (neuron, f))) {
        start[feature * neurons + place(theirs)] =
            (1.3 * theirs as f64 + 0.7 * feature as f64).cos();
    }
    let config = SomConfig {
        grid,
        start: SomStart::Given(Matrix::from_column_major(neurons, 3, start)?),
        training,
        radius: Schedule::inverse(1.5),
        epochs: 12,
        seed: 0,
    };
    let map = Som::fit(&samples, &config)?;
    let table = numbers(text)?;
    let mut worst = 0.0_f64;
    for (theirs, line) in table[..neurons].iter().enumerate() {
        for (feature, expected) in line.iter().enumerate() {
            worst = worst.max((map.weights().get(place(theirs), feature) - expected).abs());
        }
    }
    Ok(worst)
}
