use reduction::{
    Matrix, RandomisedConfig, Snapshots, Svd, SvdError, leading_svd, randomised_svd, thin_svd,
};

/// The square of what the Gram matrix leaves of a right vector, 1e-6.
const SINGULAR_REL: f64 = 1e-11;
/// Rounding of a basis that a Householder factorisation makes.
const ORTHONORMAL: f64 = 1e-12;
/// Energy that the leading part may miss beside the best part of the same rank, over all of it.
const BEST_REL: f64 = 1e-11;

/// Columns whose singular values fall by a ratio each, in directions that a seed mixes.
fn falling(rows: usize, columns: usize, ratio: f64) -> Snapshots {
    let wave = |place: usize, along: usize, of: usize| {
        (std::f64::consts::PI * (along as f64 + 0.5) * place as f64 / of as f64).cos()
    };
    Snapshots::from_fn(rows, columns, |row, column| {
        (0..columns)
            .map(|n| {
                ratio.powi(n as i32)
                    * wave(n + 1, row, rows)
                    * wave(n, (7 * column + 3) % columns, columns)
            })
            .sum()
    })
    .unwrap()
}

fn defect(basis: &Matrix) -> f64 {
    let gram = basis.transposed_times(basis);
    let pairs = (0..gram.columns()).flat_map(|c| (0..gram.rows()).map(move |r| (r, c)));
    pairs.map(|(r, c)| (gram.get(r, c) - f64::from(u8::from(r == c))).abs()).fold(0.0, f64::max)
}

fn missed(snapshots: &Snapshots, svd: &Svd) -> f64 {
    let matrix = snapshots.matrix();
    let back = svd.reconstruct();
    let squares = matrix.values().iter().zip(back.values()).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt() / matrix.frobenius_norm()
}

#[test]
fn property_the_leading_part_is_that_of_the_whole() {
    // the wanted part ends at 1e-3, at 2e-4 and, beyond the Gram matrix's reach, at 1e-9
    for (rows, columns, rank, ratio) in [
        (400, 60, 20, 0.7),
        (400, 60, 20, 0.65),
        (400, 60, 20, 0.35),
        (60, 400, 20, 0.7),
        (200, 40, 39, 0.8),
    ] {
        let snapshots = falling(rows, columns.min(rows), ratio);
        let leading = leading_svd(&snapshots, rank).unwrap();
        let whole = thin_svd(&snapshots).unwrap();
        assert_eq!(leading.singular_values().len(), rank);
        for (found, exact) in leading.singular_values().iter().zip(whole.singular_values()) {
            let off = (found - exact).abs() / exact.max(1e-3 * whole.singular_values()[0]);
            assert!(off < SINGULAR_REL, "{rows}x{columns}, {ratio}: {off:e}");
        }
        assert!(defect(leading.left()) < ORTHONORMAL && defect(leading.right()) < ORTHONORMAL);
        let cut = whole.truncated(reduction::RankRule::Fixed(rank)).unwrap();
        let (found, best) = (missed(&snapshots, &leading), missed(&snapshots, &cut));
        assert!(found < best + BEST_REL, "{rows}x{columns}, {ratio}: {found:e} {best:e}");
    }
}

#[test]
fn small_matrices_are_decomposed_without_random_directions() {
    let snapshots = falling(400, 60, 0.7);
    let config = RandomisedConfig { rank: 20, ..RandomisedConfig::default() };
    let fast = randomised_svd(&snapshots, &config).unwrap();
    assert_eq!(fast, leading_svd(&snapshots, 20).unwrap());
    let large = falling(400, 160, 0.9);
    // 44 directions and ten more are above a third of the columns, 43 and ten are not
    let all = RandomisedConfig { rank: 44, ..config };
    assert_eq!(randomised_svd(&large, &all).unwrap(), leading_svd(&large, 44).unwrap());
    let some = RandomisedConfig { rank: 43, ..config };
    assert_ne!(randomised_svd(&large, &some).unwrap(), leading_svd(&large, 43).unwrap());
    // the anti-test: from 150 columns on the seed decides the last bits
    let of = |seed| randomised_svd(&large, &RandomisedConfig { seed, ..config }).unwrap();
    assert_ne!(of(1), of(2));
}

#[test]
fn nothing_asked_for_is_refused_and_zeros_are_decomposed() {
    assert_eq!(leading_svd(&falling(9, 6, 0.5), 0), Err(SvdError::RankZero));
    let zero = Snapshots::from_fn(30, 12, |_, _| 0.0).unwrap();
    assert!(leading_svd(&zero, 3).unwrap().singular_values().iter().all(|s| *s == 0.0));
    assert_eq!(leading_svd(&falling(30, 12, 0.5), 99).unwrap().singular_values().len(), 12);
}
