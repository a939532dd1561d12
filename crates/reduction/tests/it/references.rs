//! Agreement with `PyDMD` and `MiniSom` on the same numbers; the scripts, their
//! versions and their outputs are under `fixtures/references`.

use approx::assert_abs_diff_eq;
use reduction::{
    Complex, Dmd, DmdConfig, DmdKind, Grid, Matrix, RankRule, SampleOrder, Schedule, Snapshots,
    Som, SomConfig, SomStart, Training, thin_svd,
};

/// Eigenvalues and modes of a well separated spectrum (rank 4) are determined to
/// some 10³·ε, those of rank 9 (singular values down to 10⁻² of the first) to
/// some 10⁵·ε; the same formula differs by an ulp between mathematics libraries.
const DMD_ABS: f64 = 1e-10;
/// Twelve epochs of 90 updates, each a contraction, with formulas of one ulp.
const SOM_ABS: f64 = 1e-12;

fn numbers(text: &str) -> Vec<Vec<f64>> {
    text.lines()
        .map(|line| line.split(' ').map(|number| number.parse().unwrap()).collect())
        .collect()
}

/// `field` of `fixtures/references/pydmd/generate.py`.
fn field() -> Snapshots {
    Snapshots::from_fn(60, 16, |row, column| {
        let (x, t) = (row as f64 / 60.0, column as f64);
        let waves: f64 = (1..7)
            .map(f64::from)
            .map(|k| {
                let phase = 2.0 * std::f64::consts::PI * k * x + 0.61 * k * t + 0.2 * k * k;
                0.8_f64.powf(k) * phase.sin() * (-0.05 * k * t).exp()
            })
            .sum();
        waves + 0.02 * (17.0 * x * (1.0 + t)).sin()
    })
    .unwrap()
}

#[test]
fn versus_pydmd_eigenvalues_modes_and_amplitudes() {
    let tables = [
        (DmdKind::Exact, 4, include_str!("../../../../fixtures/references/pydmd/exact-rank-4.txt")),
        (DmdKind::Exact, 9, include_str!("../../../../fixtures/references/pydmd/exact-rank-9.txt")),
        (
            DmdKind::Projected,
            4,
            include_str!("../../../../fixtures/references/pydmd/projected-rank-4.txt"),
        ),
        (
            DmdKind::Projected,
            9,
            include_str!("../../../../fixtures/references/pydmd/projected-rank-9.txt"),
        ),
    ];
    for (kind, rank, text) in tables {
        let config = DmdConfig { rank: RankRule::Fixed(rank), kind };
        let dmd = Dmd::fit(&field(), &config).unwrap();
        let table = numbers(text);
        assert_eq!(dmd.rank(), table.len());
        for (index, line) in table.iter().enumerate() {
            let eigenvalue = dmd.eigenvalues()[index];
            let expected: Vec<Complex> =
                line.chunks(2).map(|pair| Complex::new(pair[0], pair[1])).collect();
            let error = (eigenvalue - expected[0]).modulus();
            assert!(error < DMD_ABS, "{kind:?} {rank} eigenvalue {index}: {error:e}");
            for (location, expected) in [0, 7, 31].into_iter().zip(&expected[1..]) {
                let found = dmd.mode(index)[location] * dmd.amplitudes()[index];
                let error = (found - *expected).modulus();
                assert!(error < DMD_ABS, "{kind:?} {rank} mode {index} at {location}: {error:e}");
            }
        }
    }
}

#[test]
fn versus_numpy_singular_values() {
    let table = numbers(include_str!("../../../../fixtures/references/pydmd/singular-values.txt"));
    let svd = thin_svd(&field()).unwrap();
    for (found, expected) in svd.singular_values().iter().zip(&table) {
        // Absolute error of singular values is a modest multiple of ε·σ₁.
        assert_abs_diff_eq!(*found, expected[0], epsilon = 1e-13 * table[0][0]);
    }
}

#[test]
fn versus_pydmd_rank_rules() {
    let svd = thin_svd(&field()).unwrap();
    for line in include_str!("../../../../fixtures/references/pydmd/ranks.txt").lines() {
        let words: Vec<&str> = line.split(' ').collect();
        let rule = match words[0] {
            "energy" => RankRule::Energy(words[1].parse().unwrap()),
            _ => RankRule::OptimalHardThreshold,
        };
        assert_eq!(svd.rank(rule).unwrap(), words[2].parse::<usize>().unwrap(), "{rule:?}");
    }
}

/// Trains as `fixtures/references/minisom/generate.py` does. `place` gives the
/// neuron that MiniSom calls `x·ny + y`.
fn compare_map(grid: Grid, training: Training, text: &str, place: impl Fn(usize) -> usize) {
    let samples = Matrix::from_fn(90, 3, |i, f| {
        (0.37 * i as f64 * (f as f64 + 1.0)).sin() + 0.01 * i as f64 * f as f64
    })
    .unwrap();
    let neurons = grid.neurons();
    let mut start = vec![0.0; neurons * 3];
    for theirs in 0..neurons {
        for feature in 0..3 {
            start[feature * neurons + place(theirs)] =
                (1.3 * theirs as f64 + 0.7 * feature as f64).cos();
        }
    }
    let config = SomConfig {
        grid,
        start: SomStart::Given(Matrix::from_column_major(neurons, 3, start).unwrap()),
        training,
        radius: Schedule::inverse(1.5),
        epochs: 12,
        seed: 0,
    };
    let map = Som::fit(&samples, &config).unwrap();
    let table = numbers(text);
    for (theirs, expected) in table[..neurons].iter().enumerate() {
        for (feature, expected) in expected.iter().enumerate() {
            let error = (map.weights().get(place(theirs), feature) - expected).abs();
            assert!(error < SOM_ABS, "neuron {theirs} feature {feature}: {error:e}");
        }
    }
    let quality = &table[neurons];
    assert_abs_diff_eq!(map.quantisation_error(&samples).unwrap(), quality[0], epsilon = SOM_ABS);
    assert_abs_diff_eq!(map.topographic_error(&samples).unwrap(), quality[1], epsilon = SOM_ABS);
}

const ONLINE: Training =
    Training::Online { rate: Schedule::inverse(0.5), order: SampleOrder::AsGiven };

#[test]
fn versus_minisom_online_rectangular() {
    let text = include_str!("../../../../fixtures/references/minisom/online-rectangular-4x3.txt");
    compare_map(Grid::rectangular(4, 3), ONLINE, text, |theirs| theirs);
}

#[test]
fn versus_minisom_online_hexagonal() {
    let text = include_str!("../../../../fixtures/references/minisom/online-hexagonal-3x5.txt");
    // MiniSom's rows are its second index.
    compare_map(Grid::hexagonal(5, 3), ONLINE, text, |theirs| theirs % 5 * 3 + theirs / 5);
}

#[test]
fn versus_minisom_batch() {
    let text = include_str!("../../../../fixtures/references/minisom/batch-rectangular-4x3.txt");
    compare_map(Grid::rectangular(4, 3), Training::Batch, text, |theirs| theirs);
}
