//! Sine and cosine of several lanes with the bits of `libm`.
//!
//! `libm` (a port of FreeBSD's msun) takes multiples of π/2 off the argument in two parts and then
//! evaluates two polynomials. Its branches serve arguments that are large, close to a multiple of
//! π/2, or close to the middle between two; without those the same operations in the same order
//! make a loop without branches. A lane that would take another branch says so.
#![expect(
    clippy::inline_always,
    reason = "the loop is compiled once for each instruction set, which inlining makes possible"
)]
#![expect(
    clippy::excessive_precision,
    clippy::unreadable_literal,
    reason = "msun's coefficients as they are published"
)]
#![expect(
    clippy::needless_bitwise_bool,
    reason = "a branch would keep the loop from being taken in vectors"
)]

/// 1.5·2⁵²: added and taken away, it leaves the nearest whole number.
const TO_WHOLE: f64 = 6_755_399_441_055_744.0;
const PER_QUARTER: f64 = core::f64::consts::FRAC_2_PI;
/// First 33 bits of π/2, and the rest.
const QUARTER: f64 = 1.57079632673412561417e+00;
const QUARTER_TAIL: f64 = 6.07710050650619224932e-11;
/// Beginning of the arguments from which quarter turns are taken off, π/4 rounded up by msun.
const SMALL: f64 = f64::from_bits(0x3fe9_21fc << 32);
/// Distance from a whole number of quarter turns up to which rounding cannot be in doubt.
const CLEAR: f64 = 0.499_9;
/// Powers of two of remainder over argument from which the second part of π/2 suffices.
const CANCELLED: f64 = 1.0 / 65_536.0;
/// The exponent's bits.
const EXPONENT: u64 = 0x7ff << 52;

const S: [f64; 6] = [
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
];
const C: [f64; 6] = [
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
];

/// Sine, cosine, and whether they are those of [`libm::sincos`].
#[inline(always)]
pub(crate) fn sincos(x: f64) -> (f64, f64, bool) {
    let size = x.abs();
    let small = size < SMALL;
    let turns = x * PER_QUARTER;
    let shifted = turns + TO_WHOLE;
    let whole = shifted - TO_WHOLE;
    let head = x - whole * QUARTER;
    let tail = whole * QUARTER_TAIL;
    let rest = head - tail;
    let (y0, y1) = if small { (x, 0.0) } else { (rest, (head - rest) - tail) };

    let z = y0 * y0;
    let w = z * z;
    let r = S[1] + z * (S[2] + z * S[3]) + z * w * (S[4] + z * S[5]);
    let v = z * y0;
    let near_zero = y0 + v * (S[0] + z * r);
    let reduced = y0 - ((z * (0.5 * y1 - v * r) - y1) - v * S[0]);
    let sin = if small { near_zero } else { reduced };
    let r = z * (C[0] + z * (C[1] + z * C[2])) + w * w * (C[3] + z * (C[4] + z * C[5]));
    let half = 0.5 * z;
    let w = 1.0 - half;
    let cos = w + (((1.0 - w) - half) + (z * r - y0 * y1));

    // the whole number's last bits are the sum's
    let quarter = if small { 0 } else { shifted.to_bits() };
    let (a, b) = if quarter & 1 == 0 { (sin, cos) } else { (cos, sin) };
    let sin = if quarter & 2 == 0 { a } else { -a };
    let cos = if quarter.wrapping_add(1) & 2 == 0 { b } else { -b };
    let power = |x: f64| f64::from_bits(x.to_bits() & EXPONENT);
    let enough = power(rest) >= power(x) * CANCELLED;
    let reducible = enough & ((turns - whole).abs() <= CLEAR);
    (sin, cos, small | reducible)
}

/// Sine and cosine of one number with the bits of [`libm::sin`] and [`libm::cos`], together and
/// mostly without branches.
pub(crate) fn sincos_of(x: f64) -> (f64, f64) {
    let (sin, cos, own) = sincos(x);
    // the sign of a zero is libm's
    if own && x != 0.0 { (sin, cos) } else { libm::sincos(x) }
}

/// Sines and cosines of angles in rad, with the bits of `libm::sin` and `libm::cos`.
#[inline(always)]
pub fn sincos_of_lanes<const N: usize>(x: &[f64; N]) -> [[f64; N]; 2] {
    let ([mut sines, mut cosines], mut own) = ([[0.0; N]; 2], [0_u64; N]);
    for lane in 0..N {
        let (sin, cos, is_own) = sincos(x[lane]);
        (sines[lane], cosines[lane]) = (sin, cos);
        own[lane] = u64::from(is_own & (x[lane] != 0.0));
    }
    if own.iter().fold(1, |all, own| all & own) == 0 {
        for lane in 0..N {
            if own[lane] == 0 {
                (sines[lane], cosines[lane]) = libm::sincos(x[lane]);
            }
        }
    }
    [sines, cosines]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares bits; returns whether the lane answered for itself.
    fn agrees(x: f64) -> bool {
        let (sin, cos, own) = sincos(x);
        let (s, c) = libm::sincos(x);
        if own {
            // equal numbers have equal bits but for the sign of zero
            assert_eq!((sin, cos), (s, c), "{x:e}");
            let bits = |(sin, cos): (f64, f64)| (sin.to_bits(), cos.to_bits());
            assert_eq!(bits(sincos_of(x)), bits((libm::sin(x), libm::cos(x))), "{x:e}");
        }
        own
    }

    #[test]
    fn property_the_bits_are_those_of_libm() {
        let (mut own, mut state) = (0, 7_u64);
        let count = 2_000_000;
        for n in 0..count {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let u = (state >> 11) as f64 / (1_u64 << 53) as f64;
            let range = [1.0, 8.0, 60.0, 600.0][n % 4];

            own += usize::from(agrees(range * (2.0 * u - 1.0)));
        }
        // of arguments up to 600 one in two hundred is too near to a multiple of π/2
        assert!(own as f64 > 0.995 * count as f64, "{own}");
    }

    #[test]
    fn arguments_at_the_branches_agree_or_are_left_to_libm() {
        for quarter in -40..40 {
            for eighth in [0.0, 0.5] {
                let centre = (f64::from(quarter) + eighth) * core::f64::consts::FRAC_PI_2;
                for scale in 0..52 {
                    for sign in [-1.0, 1.0] {
                        agrees(centre + sign * centre.abs().max(1e-3) * (-f64::from(scale)).exp2());
                    }
                }
                agrees(centre);
            }
        }
        for x in [0.0, -0.0, 1e-300, 1e-8, 1e6, 1e22] {
            agrees(x);
        }
        assert!(!sincos(f64::NAN).2 && !sincos(f64::INFINITY).2 && !sincos(1e22).2);
    }
}
