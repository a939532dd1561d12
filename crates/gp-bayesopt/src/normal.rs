//! The standard normal law, stable in both tails.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// `ln √(2π)`.
pub(crate) const LN_SQRT_TAU: f64 = 0.918_938_533_204_672_8;

/// Below `−TAIL` the continued fractions take over. Above, the direct form
/// loses at most `TAIL²` roundings to cancellation.
const TAIL: f64 = 5.0;

/// Terms of the continued fractions. Their error falls like
/// `exp(−2·t·√(2N))`: below 1e-27 at `t = 5`, `N = 20`.
const TERMS: u32 = 20;

/// The density `φ(z)`.
pub(crate) fn density(z: f64) -> f64 {
    libm::exp(-0.5 * z * z) / (2.0 * PI).sqrt()
}

/// The distribution function `Φ(z)`.
pub(crate) fn distribution(z: f64) -> f64 {
    0.5 * libm::erfc(-z * FRAC_1_SQRT_2)
}

/// `ln Φ(z)`, finite wherever `z²` is.
pub(crate) fn ln_distribution(z: f64) -> f64 {
    if z < -TAIL {
        -0.5 * z * z - LN_SQRT_TAU + libm::log(mills_ratio(-z))
    } else if z < TAIL {
        libm::log(distribution(z))
    } else {
        libm::log1p(-distribution(-z))
    }
}

/// Mills's ratio `R(t) = Φ(−t)/φ(t)` for `t ≥ 5`, by Laplace's continued
/// fraction `1/(t + 1/(t + 2/(t + …)))`.
pub(crate) fn mills_ratio(t: f64) -> f64 {
    1.0 / (t + 1.0 * mills_remainder(t))
}

/// `S(t) = 1/(t + 2/(t + 3/(t + …)))` for `t ≥ 5`, so that `1 − t·R = R·S`
/// without cancellation.
pub(crate) fn mills_remainder(t: f64) -> f64 {
    let tail = (2..TERMS).rev().fold(t, |below, k| t + f64::from(k) / below);
    1.0 / tail
}

/// `h(z) = φ(z) + z·Φ(z)`, the expected improvement of a unit normal.
pub(crate) fn improvement(z: f64) -> f64 {
    if z < -TAIL {
        density(z) * mills_ratio(-z) * mills_remainder(-z)
    } else {
        density(z) + z * distribution(z)
    }
}

/// `ln h(z)` with its derivative `Φ/h` and the ratio `φ/h`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LnImprovement {
    pub(crate) value: f64,
    pub(crate) distribution_ratio: f64,
    pub(crate) density_ratio: f64,
}

/// `ln h(z)`, finite and monotone while `z²` is finite.
///
/// For `z < −5`: `h = φ·R·S` with the continued fractions of [`mills_ratio`]
/// and [`mills_remainder`]; nothing cancels. The need for the logarithm is
/// argued by Ament et al., `NeurIPS` 2023; the fractions are ours.
pub(crate) fn ln_improvement(z: f64) -> LnImprovement {
    if z < -TAIL {
        let (ratio, remainder) = (mills_ratio(-z), mills_remainder(-z));
        return LnImprovement {
            value: -0.5 * z * z - LN_SQRT_TAU + libm::log(ratio) + libm::log(remainder),
            distribution_ratio: 1.0 / remainder,
            density_ratio: 1.0 / (ratio * remainder),
        };
    }
    let (phi, cdf) = (density(z), distribution(z));
    let h = phi + z * cdf;
    LnImprovement { value: libm::log(h), distribution_ratio: cdf / h, density_ratio: phi / h }
}

/// The quantile `Φ⁻¹(p)` for `0 < p < 1`.
///
/// Source: Wichura, Applied Statistics 37 (1988) 477, algorithm AS 241.
pub(crate) fn quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180_625 - q * q;
        return q * ratio(r, &CENTRE);
    }
    let tail = if q < 0.0 { p } else { 1.0 - p };
    let r = (-libm::log(tail)).sqrt();
    let z = if r <= 5.0 { ratio(r - 1.6, &MIDDLE) } else { ratio(r - 5.0, &FAR) };
    if q < 0.0 { -z } else { z }
}

/// A ratio of two polynomials of degree seven, numerator first.
fn ratio(r: f64, polynomials: &[[f64; 8]; 2]) -> f64 {
    let [above, below] =
        polynomials.each_ref().map(|c| c.iter().rev().fold(0.0, |sum, &c| sum * r + c));
    above / below
}

const CENTRE: [[f64; 8]; 2] = [
    [
        3.387_132_872_796_366_5,
        1.331_416_678_917_843_8e2,
        1.971_590_950_306_551_3e3,
        1.373_169_376_550_946e4,
        4.592_195_393_154_987e4,
        6.726_577_092_700_87e4,
        3.343_057_558_358_813e4,
        2.509_080_928_730_122_7e3,
    ],
    [
        1.0,
        4.231_333_070_160_091e1,
        6.871_870_074_920_579e2,
        5.394_196_021_424_751e3,
        2.121_379_430_158_66e4,
        3.930_789_580_009_271e4,
        2.872_908_573_572_194_3e4,
        5.226_495_278_852_854e3,
    ],
];

const MIDDLE: [[f64; 8]; 2] = [
    [
        1.423_437_110_749_683_5,
        4.630_337_846_156_546,
        5.769_497_221_460_691,
        3.647_848_324_763_204_5,
        1.270_458_252_452_368_4,
        2.417_807_251_774_506e-1,
        2.272_384_498_926_918_4e-2,
        7.745_450_142_783_414e-4,
    ],
    [
        1.0,
        2.053_191_626_637_759,
        1.676_384_830_183_803_8,
        6.897_673_349_851e-1,
        1.481_039_764_274_800_8e-1,
        1.519_866_656_361_645_7e-2,
        5.475_938_084_995_345e-4,
        1.050_750_071_644_416_9e-9,
    ],
];

const FAR: [[f64; 8]; 2] = [
    [
        6.657_904_643_501_103,
        5.463_784_911_164_114,
        1.784_826_539_917_291_3,
        2.965_605_718_285_048_7e-1,
        2.653_218_952_657_612_4e-2,
        1.242_660_947_388_078_4e-3,
        2.711_555_568_743_487_6e-5,
        2.010_334_399_292_288_1e-7,
    ],
    [
        1.0,
        5.998_322_065_558_88e-1,
        1.369_298_809_227_358e-1,
        1.487_536_129_085_061_5e-2,
        7.868_691_311_456_133e-4,
        1.846_318_317_510_054_8e-5,
        1.421_511_758_316_446e-7,
        2.044_263_103_389_94e-15,
    ],
];

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// erfc of libm is good to 1 ulp, its argument to 1 ulp: relative error of
    /// Φ(−z) up to z²ε, 4e-15 at z = 4.
    const ROUND_TRIP_REL: f64 = 1e-13;

    #[test]
    fn property_quantile_inverts_the_distribution() {
        for p in [1e-300, 1e-12, 1e-4, 0.02, 0.3, 0.5, 0.9, 0.999] {
            let back = distribution(quantile(p));
            // z²ε grows to 3e-13 at p = 1e-300
            assert!((back / p - 1.0).abs() < 5.0 * ROUND_TRIP_REL, "{p}: {back}");
        }
    }

    /// Both sides round a handful of times; the direct form of h loses up to
    /// a factor h/φ of 27 at z = −5.
    const TAIL_REL: f64 = 2e-14;

    #[test]
    fn versus_mpmath_tails() {
        let table = include_str!("../../../fixtures/references/normal/tails.csv");
        for line in table.lines().skip(1) {
            let v: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            let close = |ours: f64, theirs: f64| {
                assert!(
                    (ours - theirs).abs() < TAIL_REL * theirs.abs().max(1e-5),
                    "{line}: {ours}"
                );
            };
            close(ln_distribution(v[0]), v[1]);
            close(ln_improvement(v[0]).value, v[2]);
        }
    }

    #[test]
    fn property_both_branches_meet() {
        for (a, b) in [
            (ln_improvement(-TAIL - 1e-12), ln_improvement(-TAIL + 1e-12)),
            (ln_improvement(-TAIL - 1e-9), ln_improvement(-TAIL + 1e-9)),
        ] {
            // the direct branch loses h/φ ~ 1/26 of its digits
            assert_abs_diff_eq!(a.value, b.value, epsilon = 2e-8);
            assert_abs_diff_eq!(a.distribution_ratio / b.distribution_ratio, 1.0, epsilon = 1e-8);
            assert_abs_diff_eq!(a.density_ratio / b.density_ratio, 1.0, epsilon = 1e-8);
        }
    }

    #[test]
    fn property_ln_improvement_is_finite_and_monotone_over_two_hundred_decades() {
        let mut zs: Vec<f64> = (-100..=100).map(|e| libm::exp10(f64::from(e))).collect();
        let mut all: Vec<f64> = zs.iter().rev().map(|z| -z).collect();
        all.append(&mut zs);
        let mut last = f64::NEG_INFINITY;
        for z in all {
            let now = ln_improvement(z);
            assert!(now.value.is_finite() && now.value >= last, "{z}: {} < {last}", now.value);
            assert!(now.distribution_ratio.is_finite() && now.density_ratio.is_finite(), "{z}");
            last = now.value;
        }
    }
}
