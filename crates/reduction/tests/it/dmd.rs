use approx::assert_abs_diff_eq;
use reduction::{Complex, Dmd, DmdConfig, DmdError, DmdKind, RankRule, Snapshots, SvdError};

/// The closed-form cases are conditioned below 10⁴ and solved backward stably
/// in some 10³·ε: 1e-9 is what the project asks for, and leaves a margin.
const CLOSED_FORM: f64 = 1e-9;

/// Two oscillating, decaying shapes: `Re(υ_1·λ_1^j) + Re(υ_2·λ_2^j)`.
fn two_mode_field() -> (Snapshots, [Complex; 2]) {
    let polar = |modulus: f64, turn: f64| Complex::new(modulus * turn.cos(), modulus * turn.sin());
    let lambda = [polar(0.99, 0.3), polar(0.9, 1.1)];
    let snapshots = Snapshots::from_fn(300, 20, |row, step| {
        let x = row as f64 / 300.0;
        let shapes =
            [Complex::new((3.0 * x).sin(), (5.0 * x).cos()), Complex::new(x * x, (-4.0 * x).exp())];
        let step = u32::try_from(step).unwrap();
        (0..2).map(|k| (shapes[k] * lambda[k].power(step)).re).sum()
    })
    .unwrap();
    (snapshots, lambda)
}

fn full(kind: DmdKind) -> DmdConfig {
    DmdConfig { rank: RankRule::Energy(1.0 - 1e-12), kind }
}

#[test]
fn closed_form_two_mode_field() {
    let (snapshots, lambda) = two_mode_field();
    for kind in [DmdKind::Projected, DmdKind::Exact] {
        let dmd = Dmd::fit(&snapshots, &full(kind)).unwrap();
        assert_eq!(dmd.rank(), 4, "{kind:?}");
        for (pair, expected) in lambda.iter().enumerate() {
            let found = dmd.eigenvalues()[2 * pair];
            assert!((found - *expected).modulus() < CLOSED_FORM, "{kind:?} {found:?}");
            assert_eq!(dmd.eigenvalues()[2 * pair + 1], found.conjugate(), "{kind:?}");
        }
        let again = dmd.reconstruct(20);
        for step in 0..20 {
            for (a, b) in again.column(step).iter().zip(snapshots.snapshot(step)) {
                assert!((a - b).abs() < CLOSED_FORM, "{kind:?} step {step}: {a} {b}");
            }
        }
    }
}

#[test]
fn property_modes_follow_their_conventions() {
    let (snapshots, _) = two_mode_field();
    for kind in [DmdKind::Projected, DmdKind::Exact] {
        let dmd = Dmd::fit(&snapshots, &full(kind)).unwrap();
        for index in 0..dmd.rank() {
            let mode = dmd.mode(index);
            let norm = mode.iter().map(|v| v.modulus().powi(2)).sum::<f64>().sqrt();
            assert!((norm - 1.0).abs() < 1e-12, "{kind:?} mode {index} has norm {norm}");
            let largest = mode.iter().fold(Complex::default(), |top, v| {
                if v.modulus() > top.modulus() { *v } else { top }
            });
            assert!(largest.re > 0.0 && largest.im.abs() < 1e-12, "{kind:?} {largest:?}");
        }
    }
}

#[test]
fn cutting_a_pair_in_half_is_refused() {
    let (snapshots, _) = two_mode_field();
    let dmd = Dmd::fit(&snapshots, &full(DmdKind::Projected)).unwrap();
    assert_eq!(dmd.leading_real_modes(3), Err(DmdError::PairCutInHalf { count: 3 }));
    assert_eq!(dmd.leading_real_modes(5), Err(DmdError::TooFewModes { wanted: 5, found: 4 }));
    assert_eq!(dmd.leading_real_modes(2).unwrap().columns(), 2);
}

#[test]
fn a_rank_that_would_halve_a_pair_keeps_pairs_whole() {
    let (snapshots, _) = two_mode_field();
    let dmd = Dmd::fit(&snapshots, &DmdConfig { rank: RankRule::Fixed(3), ..full(DmdKind::Exact) })
        .unwrap();
    assert_eq!(dmd.rank(), 3);
    let complex = dmd.eigenvalues().iter().filter(|value| value.im != 0.0).count();
    assert_eq!(complex % 2, 0);
}

#[test]
fn degenerate_sequences_give_errors_or_their_only_mode() {
    let one = Snapshots::from_columns(&[[1.0, 2.0, 3.0]]).unwrap();
    let config = DmdConfig::default();
    assert_eq!(Dmd::fit(&one, &config), Err(DmdError::TooFewSnapshots { found: 1 }));

    let zeros = Snapshots::from_columns(&[[0.0; 4], [0.0; 4], [0.0; 4]]).unwrap();
    assert_eq!(Dmd::fit(&zeros, &config), Err(DmdError::Svd(SvdError::Zero)));

    let constant = Snapshots::from_columns(&[[3.0, 4.0]; 6]).unwrap();
    let dmd = Dmd::fit(&constant, &config).unwrap();
    assert_eq!(dmd.rank(), 1);
    assert_abs_diff_eq!(dmd.eigenvalues()[0].re, 1.0, epsilon = CLOSED_FORM);
    assert_abs_diff_eq!(dmd.amplitudes()[0].re, 5.0, epsilon = CLOSED_FORM);
}

#[test]
fn a_mode_that_vanishes_keeps_its_direction() {
    // y_1 = 0: the only eigenvalue is 0, and the exact mode has no direction.
    let snapshots = Snapshots::from_columns(&[[3.0, 4.0], [0.0, 0.0]]).unwrap();
    for kind in [DmdKind::Projected, DmdKind::Exact] {
        let dmd = Dmd::fit(&snapshots, &full(kind)).unwrap();
        assert_eq!(dmd.eigenvalues(), [Complex::new(0.0, 0.0)], "{kind:?}");
        assert!((dmd.mode(0)[1].re - 0.8).abs() < CLOSED_FORM, "{kind:?}");
    }
}

#[test]
fn a_nilpotent_operator_gives_unit_modes() {
    // e_0 → e_1 → e_2 → 0: three eigenvalues 0 with one eigenvector.
    let mut columns = [[0.0; 6]; 4];
    for (step, column) in columns.iter_mut().take(3).enumerate() {
        column[step] = 1.0 + step as f64;
    }
    let snapshots = Snapshots::from_columns(&columns).unwrap();
    for kind in [DmdKind::Projected, DmdKind::Exact] {
        let dmd = Dmd::fit(&snapshots, &full(kind)).unwrap();
        assert_eq!(dmd.rank(), 3);
        for index in 0..3 {
            // A triple eigenvalue moves by the cube root of rounding.
            assert!(dmd.eigenvalues()[index].modulus() < 1e-4, "{kind:?}");
            let norm = dmd.mode(index).iter().map(|v| v.modulus().powi(2)).sum::<f64>().sqrt();
            assert!((norm - 1.0).abs() < 1e-12, "{kind:?} mode {index} has norm {norm}");
        }
    }
}

#[test]
fn the_order_of_snapshots_matters() {
    let (snapshots, _) = two_mode_field();
    let mut order: Vec<usize> = (0..20).collect();
    order.swap(3, 11);
    let straight = Dmd::fit(&snapshots, &full(DmdKind::Projected)).unwrap();
    let crossed = Dmd::fit(&snapshots.reordered(&order), &full(DmdKind::Projected)).unwrap();
    let moved = (straight.eigenvalues()[0] - crossed.eigenvalues()[0]).modulus();
    assert!(moved > 1e-3, "eigenvalue moved by {moved}");
}
