//! Properties over generated snapshots.

use proptest::prelude::*;
use reduction::{
    CompressionConfig, CompressionMap, Dmd, DmdConfig, DmdKind, Encoding, Grid, Matrix,
    MatrixError, Placement, RankRule, Snapshots, Som, SomConfig, thin_svd,
};

fn snapshots() -> impl Strategy<Value = Snapshots> {
    (2..30_usize, 2..12_usize).prop_flat_map(|(rows, columns)| {
        prop::collection::vec(-1e3..1e3_f64, rows * columns)
            .prop_map(move |values| Snapshots::from_column_major(rows, columns, values).unwrap())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn svd_keeps_the_norm_and_reconstructs(snapshots in snapshots()) {
        let svd = thin_svd(&snapshots).unwrap();
        let norm = snapshots.matrix().frobenius_norm();
        let from_values = svd.singular_values().iter().map(|s| s * s).sum::<f64>().sqrt();
        prop_assert!((norm - from_values).abs() <= 1e-12 * norm);
        let again = svd.reconstruct();
        for (a, b) in again.values().iter().zip(snapshots.matrix().values()) {
            prop_assert!((a - b).abs() <= 1e-12 * norm);
        }
    }

    #[test]
    fn dmd_scales_with_the_snapshots(snapshots in snapshots(), scale in 0.5..20.0_f64) {
        let config = DmdConfig { rank: RankRule::Fixed(1), kind: DmdKind::Exact };
        let Ok(dmd) = Dmd::fit(&snapshots, &config) else { return Ok(()) };
        let scaled = Snapshots::from_fn(snapshots.locations(), snapshots.count(), |row, column| {
            scale * snapshots.snapshot(column)[row]
        })
        .unwrap();
        let again = Dmd::fit(&scaled, &config).unwrap();
        // Eigenvalues of a random operator of norm about 1 and rank 1.
        let error = (dmd.eigenvalues()[0] - again.eigenvalues()[0]).modulus();
        prop_assert!(error <= 1e-9 * (1.0 + dmd.eigenvalues()[0].modulus()), "{error:e}");
    }

    #[test]
    fn quantisation_never_exceeds_the_spread(snapshots in snapshots(), seed in 0..100_u64) {
        let samples = snapshots.matrix();
        let config = SomConfig {
            grid: Grid::hexagonal(1, 2),
            training: reduction::Training::Batch,
            epochs: 4,
            seed,
            ..SomConfig::default()
        };
        let map = Som::fit(samples, &config).unwrap();
        // Batch weights are weighted means of the samples.
        for feature in 0..samples.columns() {
            let column = samples.column(feature);
            let low = column.iter().copied().fold(f64::INFINITY, f64::min);
            let high = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            for neuron in 0..2 {
                let weight = map.weights().get(neuron, feature);
                prop_assert!(weight >= low - 1e-9 && weight <= high + 1e-9);
            }
        }
    }

    #[test]
    fn encoding_is_linear_and_points_pick_values(snapshots in snapshots(), count in 1..6_usize) {
        let count = count.min(snapshots.locations());
        let uniform = CompressionConfig {
            encoding: Encoding::Points(Placement::Uniform),
            count,
            ..CompressionConfig::default()
        };
        let map = CompressionMap::fit(&(&snapshots).into(), &uniform).unwrap();
        let signal = snapshots.snapshot(1);
        let picked: Vec<f64> = map.locations().unwrap().iter().map(|&at| signal[at]).collect();
        prop_assert_eq!(map.encode(signal).unwrap(), picked);

        let modes = CompressionConfig { encoding: Encoding::Modes, ..uniform };
        let map = CompressionMap::fit(&(&snapshots).into(), &modes).unwrap();
        let doubled: Vec<f64> = signal.iter().map(|value| 2.0 * value).collect();
        let (one, two) = (map.encode(signal).unwrap(), map.encode(&doubled).unwrap());
        for (a, b) in one.iter().zip(&two) {
            prop_assert_eq!(2.0 * a, *b);
        }
    }

    #[test]
    fn a_value_that_is_not_finite_is_found(
        rows in 1..9_usize,
        columns in 1..9_usize,
        at in 0..81_usize,
        bad in prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
    ) {
        let at = at % (rows * columns);
        let mut values = vec![1.0; rows * columns];
        values[at] = bad;
        prop_assert_eq!(
            Snapshots::from_column_major(rows, columns, values.clone()),
            Err(MatrixError::NotFinite { row: at % rows, column: at / rows })
        );
        prop_assert!(Matrix::from_column_major(rows, columns, values).is_err());
    }
}
