use approx::assert_abs_diff_eq;
use reduction::{
    CompressionConfig, CompressionError, CompressionMap, DmdConfig, Encoder, Encoding, Grid,
    LengthError, Matrix, NoiseCovariance, NoiseModel, PartsError, Placement, RankRule, Regression,
    SensitivityError, Snapshots, SomConfig, SomError, TrainingData,
};

/// Signals of 240 values that depend smoothly on three parameters.
pub(crate) fn smooth_signals(count: usize) -> (Snapshots, Matrix) {
    let parameter = |snapshot: usize, index: usize| {
        // A Kronecker sequence: even, without chance.
        let steps = [0.618_033_988_749_895, 0.754_877_666_246_693, 0.569_840_290_998_053];
        (0.5 + snapshot as f64 * steps[index]).fract() * 0.1
    };
    let parameters = Matrix::from_fn(count, 3, parameter).unwrap();
    let snapshots = Snapshots::from_fn(240, count, |row, snapshot| {
        let x = row as f64 / 239.0;
        let p = [parameter(snapshot, 0), parameter(snapshot, 1), parameter(snapshot, 2)];
        (9.0 * x * x + p[0]).sin() * (1.0 + p[1]) + p[2] * (25.0 * x).tanh() + (p[0] * x).exp()
    })
    .unwrap();
    (snapshots, parameters)
}

const ENCODINGS: [Encoding; 11] = [
    Encoding::Points(Placement::DmdSom),
    Encoding::Points(Placement::PodSom),
    Encoding::Points(Placement::Qdeim),
    Encoding::Points(Placement::GreedyAOptimal),
    Encoding::Points(Placement::GreedyDOptimal),
    Encoding::Points(Placement::Uniform),
    Encoding::Points(Placement::Random),
    Encoding::ClusterMeans,
    Encoding::DynamicModes,
    Encoding::Modes,
    Encoding::Sensitivities,
];

pub(crate) fn config(encoding: Encoding) -> CompressionConfig {
    CompressionConfig {
        encoding,
        count: 12,
        som: SomConfig { grid: Grid::rectangular(4, 3), epochs: 20, ..SomConfig::default() },
        dmd: DmdConfig { rank: RankRule::Fixed(12), ..DmdConfig::default() },
        ..CompressionConfig::default()
    }
}

#[test]
fn every_encoding_fits_encodes_decodes_and_survives_its_parts() {
    let (snapshots, parameters) = smooth_signals(40);
    let model = NoiseModel::Stationary { autocovariance: vec![1e-6, 0.6e-6, 0.2e-6] };
    let noise = NoiseCovariance::new(&model, 240, 0.0).unwrap();
    for with_noise in [false, true] {
        let mut data = TrainingData::new(&snapshots).with_parameters(&parameters);
        if with_noise {
            data = data.with_noise(&noise);
        }
        for encoding in ENCODINGS {
            let map = CompressionMap::fit(&data, &config(encoding)).unwrap();
            assert!((1..=12).contains(&map.encoded_len()), "{encoding:?}");
            let mean_again = map.decode(&map.encode(map.mean()).unwrap()).unwrap();
            for (a, b) in mean_again.iter().zip(map.mean()) {
                assert!((a - b).abs() < 1e-9, "{encoding:?}");
            }
            let weights = map.weights();
            let by_weights = weights.transposed_times_vector(snapshots.snapshot(5));
            let encoded = map.encode(snapshots.snapshot(5)).unwrap();
            let scale = by_weights.iter().fold(1.0_f64, |top, v| top.max(v.abs()));
            for (a, b) in encoded.iter().zip(&by_weights) {
                assert!((a - b).abs() < 1e-12 * scale, "{encoding:?} {a} {b}");
            }
            let again = CompressionMap::from_parts(map.clone().into_parts()).unwrap();
            assert_eq!(again, map, "{encoding:?}");
        }
    }
}

#[test]
fn modes_decode_to_the_truncation_error() {
    let (snapshots, _) = smooth_signals(40);
    let map = CompressionMap::fit(&(&snapshots).into(), &config(Encoding::Modes)).unwrap();
    let tail: f64 = map.report().singular_values[map.encoded_len()..]
        .iter()
        .map(|value| value * value)
        .sum::<f64>()
        .sqrt();
    let mut squares = 0.0;
    for index in 0..snapshots.count() {
        let signal = snapshots.snapshot(index);
        let decoded = map.decode(&map.encode(signal).unwrap()).unwrap();
        squares += decoded.iter().zip(signal).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    }
    // Rounding of one projection of 40 signals of norm about 20.
    assert!(squares.sqrt() < tail + 1e-11, "{} against {tail}", squares.sqrt());
}

#[test]
fn points_are_distinct_increasing_and_seeded() {
    let (snapshots, _) = smooth_signals(40);
    let fit = |seed| {
        let mut config = config(Encoding::Points(Placement::DmdSom));
        config.som.seed = seed;
        CompressionMap::fit(&(&snapshots).into(), &config).unwrap()
    };
    let map = fit(1);
    let locations = map.locations().unwrap();
    assert_eq!(locations.len(), 12);
    assert!(locations.windows(2).all(|pair| pair[0] < pair[1]));
    assert_eq!(fit(1), map);
    assert_ne!(fit(2).locations(), map.locations());
    // The signals have fewer than 12 directions above rounding.
    assert!(map.report().dynamic_modes.is_some_and(|modes| (4..=12).contains(&modes)));
    assert_eq!(map.parts().snapshot_order, (0..40).collect::<Vec<_>>());
}

#[test]
fn bad_input_is_refused_with_its_numbers() {
    let (snapshots, parameters) = smooth_signals(40);
    let data: TrainingData<'_> = (&snapshots).into();
    let points = config(Encoding::Points(Placement::DmdSom));

    let fit = |config: &CompressionConfig| CompressionMap::fit(&data, config).unwrap_err();
    assert_eq!(
        fit(&CompressionConfig { count: 0, ..points.clone() }),
        CompressionError::Count { count: 0, locations: 240 }
    );
    assert_eq!(
        fit(&CompressionConfig { count: 241, ..points.clone() }),
        CompressionError::Count { count: 241, locations: 240 }
    );
    assert_eq!(
        fit(&CompressionConfig { count: 30, ..points.clone() }),
        CompressionError::Neurons { neurons: 12, count: 30 }
    );
    assert_eq!(fit(&config(Encoding::Sensitivities)), CompressionError::NoParameters);

    let alike = Snapshots::from_columns(&[[0.1, 0.2, 0.3]; 7]).unwrap();
    let modes = CompressionConfig { count: 2, ..config(Encoding::Modes) };
    assert_eq!(
        CompressionMap::fit(&(&alike).into(), &modes),
        Err(CompressionError::NoVariation { snapshots: 7 })
    );
    let one = Snapshots::from_columns(&[[0.1, 0.2, 0.3]]).unwrap();
    assert_eq!(
        CompressionMap::fit(&(&one).into(), &modes),
        Err(CompressionError::NoVariation { snapshots: 1 })
    );

    let few = Matrix::from_fn(3, 3, |row, column| (row * column) as f64).unwrap();
    assert_eq!(
        CompressionMap::fit(&data.with_parameters(&few), &config(Encoding::Sensitivities)),
        Err(CompressionError::Sensitivity(SensitivityError::Count { found: 3, expected: 40 }))
    );
    let (small, small_parameters) = smooth_signals(9);
    let quadratic =
        CompressionConfig { regression: Regression::Quadratic, ..config(Encoding::Sensitivities) };
    assert_eq!(
        CompressionMap::fit(
            &TrainingData::new(&small).with_parameters(&small_parameters),
            &quadratic
        ),
        Err(CompressionError::Sensitivity(SensitivityError::TooFewSnapshots {
            found: 9,
            needed: 10
        }))
    );
    let twice = Matrix::from_fn(40, 2, |row, _| parameters.get(row, 0)).unwrap();
    assert_eq!(
        CompressionMap::fit(&data.with_parameters(&twice), &config(Encoding::Sensitivities)),
        Err(CompressionError::Sensitivity(SensitivityError::Dependent { terms: 3, rank: 2 }))
    );
    let short = Snapshots::from_fn(10, 20, |row, column| ((row + 1) * column) as f64).unwrap();
    let crowded = CompressionConfig { count: 10, ..points };
    assert!(matches!(
        CompressionMap::fit(&(&short).into(), &crowded),
        Err(CompressionError::Neurons { .. })
    ));
    let samples = Matrix::from_fn(5, 2, |row, column| (row + column) as f64).unwrap();
    assert_eq!(
        reduction::Som::fit(&samples, &SomConfig::default()),
        Err(SomError::MoreNeuronsThanSamples { neurons: 30, samples: 5 })
    );
}

#[test]
fn zeros_and_constants_have_no_compression() {
    for value in [0.0, 0.1] {
        let constant = Snapshots::from_fn(50, 9, |_, _| value).unwrap();
        for encoding in ENCODINGS {
            let fitted = CompressionMap::fit(&(&constant).into(), &config(encoding));
            assert_eq!(fitted, Err(CompressionError::NoVariation { snapshots: 9 }), "{encoding:?}");
        }
    }
}

#[test]
fn signals_that_differ_by_a_constant_compress() {
    // Each signal flat, but not the same: one direction.
    let flat = Snapshots::from_fn(50, 9, |_, column| column as f64).unwrap();
    let map = CompressionMap::fit(&(&flat).into(), &config(Encoding::Modes)).unwrap();
    assert_eq!(map.encoded_len(), 1);
    let decoded = map.decode(&map.encode(flat.snapshot(4)).unwrap()).unwrap();
    for value in decoded {
        assert_abs_diff_eq!(value, 4.0, epsilon = 1e-13);
    }
}

#[test]
fn signals_of_another_length_are_refused() {
    let (snapshots, _) = smooth_signals(20);
    let map = CompressionMap::fit(&(&snapshots).into(), &config(Encoding::Modes)).unwrap();
    let expected = map.encoded_len();
    assert_eq!(map.encode(&[0.0; 239]), Err(LengthError { found: 239, expected: 240 }));
    assert_eq!(
        map.decode(&vec![0.0; expected + 1]),
        Err(LengthError { found: expected + 1, expected })
    );
}

#[test]
fn tampered_parts_are_refused() {
    let (snapshots, _) = smooth_signals(20);
    let config = config(Encoding::Points(Placement::Uniform));
    let parts = CompressionMap::fit(&(&snapshots).into(), &config).unwrap().into_parts();
    let tampered = |change: &dyn Fn(&mut reduction::CompressionParts)| {
        let mut parts = parts.clone();
        change(&mut parts);
        CompressionMap::from_parts(parts).unwrap_err()
    };
    assert_eq!(tampered(&|p| p.encoder = Encoder::Select(vec![])), PartsError::NothingKept);
    assert_eq!(
        tampered(&|p| p.encoder = Encoder::Select((0..11).chain([240]).collect())),
        PartsError::Location { location: 240, signal_len: 240 }
    );
    assert_eq!(
        tampered(&|p| p.encoder = Encoder::Select((0..11).chain([3]).collect())),
        PartsError::NotIncreasing { location: 3 }
    );
    assert_eq!(
        tampered(&|p| {
            p.encoder =
                Encoder::Average((0..12).map(|at| vec![at; usize::from(at != 5)]).collect());
        }),
        PartsError::EmptyGroup { group: 5 }
    );
    assert_eq!(tampered(&|p| p.mean[7] = f64::NAN), PartsError::NotFinite { index: 7 });
    assert_eq!(
        tampered(&|p| p.first_mode = vec![0.0; 3]),
        PartsError::FirstMode { found: 3, expected: 240 }
    );
    assert!(matches!(
        tampered(&|p| p.decoder = Matrix::from_fn(240, 5, |_, _| 0.0).unwrap()),
        PartsError::Shape { columns: 5, expected_columns: 12, .. }
    ));
}
