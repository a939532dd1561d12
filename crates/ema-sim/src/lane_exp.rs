//! Exponential of several lanes with the bits of `libm`.
//!
//! `libm` (a port of FreeBSD's msun) takes multiples of ln 2 off the argument in two parts and then
//! evaluates a rational function. Its branches serve arguments that are close to zero, that need no
//! reduction, and whose exponential is no normal number; but for the last the same operations in
//! the same order make a loop without branches. A lane that would take that one says so.
#![expect(
    clippy::inline_always,
    reason = "the loop is compiled once for each instruction set, which inlining makes possible"
)]
#![expect(
    clippy::excessive_precision,
    clippy::unreadable_literal,
    reason = "msun's coefficients as they are published"
)]

/// Size of an argument below which the exponential is surely a normal number, and argument below
/// which it is surely zero.
const MOST: f64 = 700.0;
const NOTHING: f64 = -746.0;
const LN2_HIGH: f64 = 6.93147180369123816490e-01;
const LN2_LOW: f64 = 1.90821492927058770002e-10;
const PER_LN2: f64 = core::f64::consts::LOG2_E;
/// Beginnings of the arguments that are reduced by a multiple of ln 2, and by one; of those that are
/// not too small for more than `1 + x`.
const MANY: f64 = f64::from_bits(0x3ff0_a2b2 << 32);
const ONE: f64 = f64::from_bits(0x3fd6_2e43 << 32);
const SOME: f64 = f64::from_bits(0x3e30_0001 << 32);
/// 2⁵² and the exponent's bias: added to a whole number, it leaves the exponent's bits.
const TO_EXPONENT: f64 = 4_503_599_627_370_496.0 + 1023.0;

const P: [f64; 5] = [
    1.66666666666666019037e-01,
    -2.77777777770155933842e-03,
    6.61375632143793436117e-05,
    -1.65339022054652515390e-06,
    4.13813679705723846039e-08,
];

/// Exponential, and whether it is that of [`libm::exp`].
#[inline(always)]
fn exp(x: f64) -> (f64, bool) {
    let size = x.abs();
    let half = if x < 0.0 { -0.5 } else { 0.5 };
    let many = (PER_LN2 * x + half).trunc();
    let once = if x < 0.0 { -1.0 } else { 1.0 };
    let reduced = if size >= MANY { many } else { once };
    let k = if size >= ONE { reduced } else { 0.0 };
    let high = x - k * LN2_HIGH;
    let low = k * LN2_LOW;
    let y = high - low;
    let yy = y * y;
    let c = y - yy * (P[0] + yy * (P[1] + yy * (P[2] + yy * (P[3] + yy * P[4]))));
    let value = 1.0 + (y * c / (2.0 - c) - low + high);
    let power = f64::from_bits((k + TO_EXPONENT).to_bits() << 52);
    let value = if size >= SOME { value * power } else { 1.0 + x };
    let vanishes = x < NOTHING;
    (if vanishes { 0.0 } else { value }, (size < MOST) | vanishes)
}

/// Exponentials, with the bits of `libm::exp`.
#[inline(always)]
pub fn exp_of_lanes<const N: usize>(x: &[f64; N]) -> [f64; N] {
    let (mut values, mut own) = ([0.0; N], [0_u64; N]);
    for lane in 0..N {
        let (value, is_own) = exp(x[lane]);
        (values[lane], own[lane]) = (value, u64::from(is_own));
    }
    if own.iter().fold(1, |all, own| all & own) == 0 {
        for lane in 0..N {
            if own[lane] == 0 {
                values[lane] = libm::exp(x[lane]);
            }
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_bits(x: f64) {
        let [lane] = exp_of_lanes(&[x]);
        assert_eq!(lane.to_bits(), libm::exp(x).to_bits(), "{x:e}");
    }

    #[test]
    fn property_the_bits_are_those_of_libm() {
        let mut state = 7_u64;
        for n in 0..2_000_000 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let u = (state >> 11) as f64 / (1_u64 << 53) as f64;
            let range = [1e-9, 0.5, 2.0, 40.0, 720.0][n % 5];
            assert_bits(range * (2.0 * u - 1.0));
        }
    }

    #[test]
    fn arguments_at_the_branches_have_the_bits_of_libm() {
        for x in
            [MANY, ONE, SOME, MOST, NOTHING, 1e4, 0.0, 1e-300, 1e300, f64::INFINITY, 708.4, 745.2]
        {
            for x in [x, x.next_up(), x.next_down()] {
                assert_bits(x);
                assert_bits(-x);
            }
        }
        for half in -40..40 {
            let x = 0.5 * f64::from(half) * core::f64::consts::LN_2;
            [x, x.next_up(), x.next_down()].into_iter().for_each(assert_bits);
        }
        assert!(exp_of_lanes(&[f64::NAN])[0].is_nan());
    }
}
