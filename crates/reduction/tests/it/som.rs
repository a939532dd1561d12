use approx::assert_abs_diff_eq;
use reduction::{
    Grid, Matrix, SampleOrder, Schedule, Som, SomConfig, SomError, SomStart, Training,
};

/// Rows on a plane sheet, bent through three dimensions.
fn sheet(side: usize) -> Matrix {
    Matrix::from_fn(side * side, 3, |row, feature| {
        let (u, v) = ((row / side) as f64 / side as f64, (row % side) as f64 / side as f64);
        [u, v, 0.3 * (3.0 * u).sin()][feature]
    })
    .unwrap()
}

fn config(grid: Grid, training: Training) -> SomConfig {
    SomConfig { grid, training, start: SomStart::PrincipalAxes, epochs: 60, ..SomConfig::default() }
}

const ONLINE: Training =
    Training::Online { rate: Schedule::inverse(0.5), order: SampleOrder::Shuffled };

#[test]
fn known_topology_of_a_sheet_is_kept() {
    let samples = sheet(24);
    for grid in [Grid::rectangular(6, 6), Grid::hexagonal(6, 6)] {
        for training in [ONLINE, Training::Batch] {
            let map = Som::fit(&samples, &config(grid, training)).unwrap();
            let torn = map.topographic_error(&samples).unwrap();
            assert!(torn < 0.1, "{grid:?} {training:?}: {torn}");
            // 36 square cells of a sheet of area above 1 leave a mean distance
            // to the centre of 0.38/6 at best.
            let error = map.quantisation_error(&samples).unwrap();
            assert!(error < 0.11, "{grid:?} {training:?}: {error}");
        }
    }
}

#[test]
fn four_separated_clusters_get_a_neuron_each() {
    let centres = [[0.0, 0.0], [10.0, 0.0], [0.0, 10.0], [10.0, 10.0]];
    let samples = Matrix::from_fn(80, 2, |row, feature| {
        centres[row % 4][feature] + 0.01 * (row as f64 * (1.0 + feature as f64)).sin()
    })
    .unwrap();
    for training in [ONLINE, Training::Batch] {
        let mut config = config(Grid::rectangular(2, 2), training);
        config.radius = Schedule { start: 1.0, decay: reduction::Decay::ExponentialTo(0.05) };
        let map = Som::fit(&samples, &config).unwrap();
        let winners = map.winners(&samples).unwrap();
        let mut four: Vec<usize> = winners[..4].to_vec();
        four.sort_unstable();
        assert_eq!(four, [0, 1, 2, 3], "{training:?}");
        assert!(winners.iter().enumerate().all(|(row, &winner)| winner == winners[row % 4]));
        assert!(map.quantisation_error(&samples).unwrap() < 0.02);
        // Diagonal neighbours count: (10 + 10 + 14.14)/3.
        for distance in map.u_matrix() {
            assert_abs_diff_eq!(distance, 11.38, epsilon = 0.05);
        }
    }
}

#[test]
fn closed_form_one_neuron_in_batch_is_the_mean() {
    let samples = sheet(10);
    let map = Som::fit(&samples, &config(Grid::rectangular(1, 1), Training::Batch)).unwrap();
    for feature in 0..3 {
        let mean = samples.column(feature).iter().sum::<f64>() / 100.0;
        assert_abs_diff_eq!(map.weights().get(0, feature), mean, epsilon = 1e-14);
    }
    assert_eq!(map.topographic_error(&samples).unwrap(), 0.0);
    assert_eq!(map.u_matrix(), [0.0]);
}

#[test]
fn same_seed_same_bits_other_seed_other_map() {
    let samples = sheet(12);
    let fit = |seed| {
        let config = SomConfig { seed, epochs: 5, ..SomConfig::default() };
        Som::fit(&samples, &config).unwrap()
    };
    assert_eq!(fit(3), fit(3));
    assert_ne!(fit(3), fit(4));
}

#[test]
fn a_map_wider_than_the_kernel_trains_as_a_narrow_one() {
    // 40 neurons span two blocks of the kernel: check against the plain loop.
    let samples = sheet(9);
    let grid = Grid::rectangular(8, 5);
    let start = Matrix::from_fn(40, 3, |j, f| (j as f64 * 0.7 + f as f64).sin()).unwrap();
    let config = SomConfig {
        grid,
        start: SomStart::Given(start.clone()),
        training: Training::Online { rate: Schedule::constant(0.3), order: SampleOrder::AsGiven },
        radius: Schedule::constant(1.1),
        epochs: 2,
        seed: 0,
    };
    let mut weights: Vec<Vec<f64>> = (0..40).map(|neuron| start.row(neuron)).collect();
    for _ in 0..2 {
        for row in 0..samples.rows() {
            let sample = samples.row(row);
            let distance =
                |w: &[f64]| -> f64 { w.iter().zip(&sample).map(|(a, b)| (a - b) * (a - b)).sum() };
            let winner = (0..40)
                .min_by(|&a, &b| distance(&weights[a]).total_cmp(&distance(&weights[b])))
                .unwrap();
            for (neuron, weight) in weights.iter_mut().enumerate() {
                let share =
                    0.3 * (-grid.distance_squared(winner, neuron) / (2.0 * 1.1 * 1.1)).exp();
                for (w, value) in weight.iter_mut().zip(&sample) {
                    *w += share * (value - *w);
                }
            }
        }
    }
    let map = Som::fit(&samples, &config).unwrap();
    for (neuron, weight) in weights.iter().enumerate() {
        assert_eq!(&map.weights().row(neuron), weight, "neuron {neuron}");
    }
}

#[test]
fn unsound_settings_are_refused() {
    let samples = sheet(6);
    let fit = |change: &dyn Fn(&mut SomConfig)| {
        let mut config = SomConfig::default();
        change(&mut config);
        Som::fit(&samples, &config).unwrap_err()
    };
    assert_eq!(
        fit(&|c| c.grid = Grid::rectangular(0, 5)),
        SomError::NoNeurons { rows: 0, columns: 5 }
    );
    assert_eq!(
        fit(&|c| c.grid = Grid::rectangular(37, 1)),
        SomError::MoreNeuronsThanSamples { neurons: 37, samples: 36 }
    );
    assert_eq!(fit(&|c| c.epochs = 0), SomError::NoEpochs);
    assert_eq!(fit(&|c| c.radius = Schedule::constant(0.0)), SomError::Radius { found: 0.0 });
    assert_eq!(
        fit(&|c| {
            c.training =
                Training::Online { rate: Schedule::constant(1.5), order: SampleOrder::Shuffled };
        }),
        SomError::LearningRate { found: 1.5 }
    );
    let start = Matrix::from_fn(2, 2, |_, _| 0.0).unwrap();
    assert_eq!(
        fit(&|c| c.start = SomStart::Given(start.clone())),
        SomError::StartShape { found_neurons: 2, found_features: 2, neurons: 30, features: 3 }
    );
    let map = Som::fit(&samples, &SomConfig { epochs: 1, ..SomConfig::default() }).unwrap();
    let narrow = Matrix::from_fn(4, 2, |_, _| 0.0).unwrap();
    assert_eq!(map.winners(&narrow), Err(SomError::Features { found: 2, expected: 3 }));
}

#[test]
fn constant_samples_make_a_map_of_that_constant() {
    let samples = Matrix::from_fn(40, 2, |_, feature| [0.1, -7.0][feature]).unwrap();
    for start in [SomStart::RandomSamples, SomStart::PrincipalAxes] {
        let config = SomConfig { start, epochs: 3, ..SomConfig::default() };
        let map = Som::fit(&samples, &config).unwrap();
        assert!(map.quantisation_error(&samples).unwrap() < 1e-14);
    }
}
