//! Covariance functions of the squared scaled distance.

#![expect(
    clippy::inline_always,
    reason = "kernels are compiled once for each instruction set, which inlining makes possible"
)]

/// A stationary covariance with one length scale for each input.
///
/// With `r² = Σ_j ((z_j − z'_j)/ℓ_j)²` and unit variance:
///
/// | kind | value |
/// |---|---|
/// | squared exponential | `exp(−r²/2)` |
/// | Matérn 3/2 | `(1 + √3·r)·exp(−√3·r)` |
/// | Matérn 5/2 | `(1 + √5·r + 5r²/3)·exp(−√5·r)` |
///
/// # Source
/// Rasmussen and Williams, Gaussian Processes for Machine Learning (2006),
/// equations 4.9 and 4.17. The FREEDOM paper uses the squared exponential.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Kernel {
    /// Infinitely smooth; the paper's choice.
    #[default]
    SquaredExponential,
    /// Once differentiable.
    Matern32,
    /// Twice differentiable.
    Matern52,
}

impl Kernel {
    /// Replaces each `r²` by the covariance, and writes `−2·∂k/∂(r²)` to `slope`.
    #[inline(always)]
    pub(crate) fn evaluate(self, r2: &mut [f64], slope: &mut [f64]) {
        let slope = &mut slope[..r2.len()];
        match self {
            Self::SquaredExponential => {
                for (r2, slope) in r2.iter_mut().zip(slope) {
                    *r2 = exp_negative(-0.5 * *r2);
                    *slope = *r2;
                }
            }
            Self::Matern32 => {
                for (r2, slope) in r2.iter_mut().zip(slope) {
                    let a = (3.0 * *r2).sqrt();
                    let e = exp_negative(-a);
                    *r2 = (1.0 + a) * e;
                    *slope = 3.0 * e;
                }
            }
            Self::Matern52 => {
                for (r2, slope) in r2.iter_mut().zip(slope) {
                    let a = (5.0 * *r2).sqrt();
                    let e = exp_negative(-a);
                    *r2 = (1.0 + a + a * a * (1.0 / 3.0)) * e;
                    *slope = (5.0 / 3.0) * (1.0 + a) * e;
                }
            }
        }
    }
}

/// `exp(x)` for `x ≤ 0`, the same bits on every machine and vector width.
///
/// Reduction by `n·ln 2` in two parts and the Taylor polynomial of degree 13
/// on `|r| ≤ ½·ln 2`, whose remainder is below 5e-18; zero below −708.
#[inline(always)]
pub(crate) fn exp_negative(x: f64) -> f64 {
    const LN2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    // adding this leaves the rounded integer in the low bits
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const C: [f64; 12] = [
        1.0 / 6_227_020_800.0,
        1.0 / 479_001_600.0,
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
    ];
    let inside = x.max(-708.0);
    let shifted = inside * std::f64::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (inside - n * LN2_HIGH) - n * LN2_LOW;
    let mut p = C[0];
    for c in &C[1..] {
        p = p * r + c;
    }
    let value = (p * r) * r + r + 1.0;
    let power = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52));
    if x < -708.0 { 0.0 } else { value * power }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reduction, Horner and the final product round a few times each.
    const EXP_REL: f64 = 4.0 * f64::EPSILON;

    #[test]
    fn versus_libm_exponential() {
        let mut x = 0.0;
        while x > -707.0 {
            let (ours, theirs) = (exp_negative(x), libm::exp(x));
            assert!((ours / theirs - 1.0).abs() < EXP_REL, "{x}: {ours} {theirs}");
            x = x * 1.003 - 1e-3;
        }
        assert_eq!(exp_negative(0.0), 1.0);
        assert_eq!(exp_negative(-1e300), 0.0);
    }

    #[test]
    fn property_slopes_match_differences() {
        for kernel in [Kernel::SquaredExponential, Kernel::Matern32, Kernel::Matern52] {
            for at in [0.01_f64, 0.3, 2.0, 9.0] {
                let value = |r2: f64| {
                    let (mut k, mut s) = ([r2], [0.0]);
                    kernel.evaluate(&mut k, &mut s);
                    (k[0], s[0])
                };
                let h = 1e-5 * at;
                let slope = -2.0 * (value(at + h).0 - value(at - h).0) / (2.0 * h);
                // central differences: h² truncation, ε/h rounding
                assert!((slope - value(at).1).abs() < 1e-8, "{kernel:?} {at}");
            }
        }
    }
}
