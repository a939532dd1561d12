use approx::assert_abs_diff_eq;
use reduction::{
    RandomisedConfig, Snapshots, StreamingConfig, StreamingError, StreamingSvd, Svd, SvdError,
    randomised_svd, thin_svd,
};

/// Decaying waves over a floor of pseudo-noise, as a filtered measurement has.
fn waves(rows: usize, columns: usize, floor: f64) -> Snapshots {
    Snapshots::from_fn(rows, columns, |row, column| {
        let (x, t) = (row as f64 / rows as f64, column as f64 / columns as f64);
        let signal: f64 = (1..25)
            .map(f64::from)
            .map(|k| 0.75_f64.powf(k) * (6.0 * k * x + 11.0 * k * t + k * k).sin())
            .sum();
        signal
            + floor
                * (12.9898 * row as f64 + 78.233 * column as f64 + 0.37 * (row * column) as f64)
                    .sin()
    })
    .unwrap()
}

fn streamed(
    snapshots: &Snapshots,
    rank: usize,
    block: usize,
    at_a_time: usize,
) -> reduction::StreamedSvd {
    let mut stream = StreamingSvd::new(StreamingConfig { rank, block }).unwrap();
    let all: Vec<usize> = (0..snapshots.count()).collect();
    for indices in all.chunks(at_a_time) {
        stream.push(&snapshots.reordered(indices)).unwrap();
    }
    stream.finish().unwrap()
}

/// Sine of the angle between two unit vectors, without cancellation.
fn sine(one: &[f64], other: &[f64]) -> f64 {
    let cosine: f64 = one.iter().zip(other).map(|(a, b)| a * b).sum();
    one.iter().zip(other).map(|(a, b)| (a * cosine.signum() - b).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn streaming_agrees_with_the_direct_svd() {
    let snapshots = waves(400, 300, 1e-9);
    let direct = thin_svd(&snapshots).unwrap();
    for (block, at_a_time) in [(20, 1), (64, 37), (300, 300), (1000, 300)] {
        let streamed = streamed(&snapshots, 60, block, at_a_time);
        assert_eq!(streamed.snapshots(), 300);
        for index in 0..30 {
            let (found, expected) =
                (streamed.singular_values()[index], direct.singular_values()[index]);
            assert!((found - expected).abs() < 1e-8 * expected, "block {block} σ_{index}");
            let angle = sine(streamed.left().column(index), direct.left().column(index));
            assert!(angle < 1e-8, "block {block} mode {index}: {angle:e}");
        }
    }
}

#[test]
fn property_streaming_error_stays_below_its_reported_bound() {
    // A floor that truncation does take something from.
    let snapshots = waves(200, 240, 1e-3);
    let direct = thin_svd(&snapshots).unwrap();
    let streamed = streamed(&snapshots, 30, 30, 240);
    assert!(streamed.dropped() > 0.0);
    let mut bounded = 0;
    for index in 0..20 {
        let (found, expected) =
            (streamed.singular_values()[index], direct.singular_values()[index]);
        let rounding = 1e-13 * direct.singular_values()[0].powi(2);
        assert!(expected * expected - found * found <= streamed.dropped() + rounding);
        assert!(found <= expected * (1.0 + 1e-13));
        if let Some(bound) = streamed.mode_error(index) {
            let angle = sine(streamed.left().column(index), direct.left().column(index));
            // The chord of an angle is at most √2 of its sine below 90°.
            assert!(angle <= bound * 2.0_f64.sqrt() + 1e-11, "mode {index}: {angle:e} {bound:e}");
            bounded += 1;
        }
    }
    assert!(bounded >= 10, "only {bounded} modes have a bound");
}

#[test]
fn streaming_refuses_what_it_cannot_take() {
    assert_eq!(
        StreamingSvd::new(StreamingConfig { rank: 0, block: 5 }).unwrap_err(),
        StreamingError::Config { rank: 0, block: 5 }
    );
    let stream = StreamingSvd::new(StreamingConfig { rank: 3, block: 5 }).unwrap();
    assert_eq!(stream.finish().unwrap_err(), StreamingError::Nothing);
    let mut stream = StreamingSvd::new(StreamingConfig { rank: 3, block: 5 }).unwrap();
    stream.push(&waves(10, 2, 0.0)).unwrap();
    assert_eq!(
        stream.push(&waves(11, 2, 0.0)),
        Err(StreamingError::Locations { found: 11, expected: 10 })
    );
    let mut zeros = StreamingSvd::new(StreamingConfig { rank: 3, block: 5 }).unwrap();
    zeros.push(&Snapshots::from_fn(10, 8, |_, _| 0.0).unwrap()).unwrap();
    assert_eq!(zeros.finish().unwrap_err(), StreamingError::Svd(SvdError::Zero));
}

#[test]
fn streaming_of_fewer_locations_than_directions_is_exact() {
    let snapshots = waves(8, 50, 1e-3);
    let streamed = streamed(&snapshots, 30, 7, 3);
    let direct = thin_svd(&snapshots).unwrap();
    assert_eq!(streamed.singular_values().len(), 8);
    assert_eq!(streamed.dropped(), 0.0);
    for (found, expected) in streamed.singular_values().iter().zip(direct.singular_values()) {
        assert_abs_diff_eq!(found, expected, epsilon = 1e-12 * direct.singular_values()[0]);
    }
}

fn worst_sine(one: &Svd, other: &Svd, count: usize) -> f64 {
    (0..count)
        .map(|index| sine(one.left().column(index), other.left().column(index)))
        .fold(0.0, f64::max)
}

#[test]
fn randomised_svd_agrees_and_power_iterations_sharpen_it() {
    let snapshots = waves(300, 200, 1e-3);
    let direct = thin_svd(&snapshots).unwrap();
    let error = |power_iterations, seed| {
        let config = RandomisedConfig { rank: 12, oversampling: 6, power_iterations, seed };
        worst_sine(&randomised_svd(&snapshots, &config).unwrap(), &direct, 8)
    };
    // Convergence as documented, times 100 for the draw and the gaps between
    // modes (seeded; the factor of these five draws stays below 10).
    let ratio = direct.singular_values()[18] / direct.singular_values()[7];
    for seed in 0..5 {
        for power_iterations in [0, 2, 4, 8] {
            let rate = ratio.powi(2 * i32::try_from(power_iterations).unwrap() + 1);
            let found = error(power_iterations, seed);
            assert!(found < 100.0 * rate + 1e-11, "seed {seed}, {power_iterations}: {found:e}");
        }
        assert!(error(0, seed) > 1e5 * error(8, seed), "seed {seed}");
    }
    let config = RandomisedConfig { rank: 0, ..RandomisedConfig::default() };
    assert_eq!(randomised_svd(&snapshots, &config), Err(SvdError::RankZero));
    let all = RandomisedConfig { rank: 500, ..RandomisedConfig::default() };
    assert_eq!(randomised_svd(&waves(20, 9, 1e-3), &all).unwrap().singular_values().len(), 9);
}
