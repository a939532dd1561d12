//! Expected improvement of the squared norm of a vector that is modelled.

use crate::{
    dual::{Dual, Number},
    error::AcquisitionError,
    gp::{Belief, BeliefSlope, GaussianProcess},
    matrix::norm,
};

use super::expected::Scored;

/// Smallest exponent of the power transformation; it is ½ to ⅓ when all
/// outputs share one variance, and could vanish for very unequal ones.
const MIN_EXPONENT: f64 = 0.1;

/// Relative step that the power law of a tail is taken from.
const EXPONENT_STEP: f64 = 1e-3;

/// Least `u^h` at which the tail of the distribution is taken to end and its rise to begin; it
/// is one standard deviation below the centre unless that comes near zero.
const LEAST_BEND: f64 = 0.05;

/// Standard deviations above which the distribution is 1, up to 1e-9.
const SURE: f64 = 6.0;

/// Nodes and weights of Gauss-Legendre on `[0, 1]`, eight points.
const LEGENDRE: [(f64, f64); 8] = [
    (0.019_855_071_751_231_856, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_64, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_63),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_63),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_24),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_13),
];

/// Expected improvement of `Q = ‖y‖²` when `y_o ~ N(μ_o, σ_o²)` independently.
///
/// ```text
/// EI = E[(q₀ − Q)⁺] = ∫₀^{q₀} F(q) dq,   q₀ the best squared norm so far
/// F(q) ≈ Φ((  (q/a)^h − 1 − h·p·(h − 1 − ½(2−h)·m·p) ) / ( h·√(2p)·(1 + ½·m·p) ))
/// h = 1 − ⅔·a·c/b²,  p = b/a²,  m = (h−1)·(1−3h)
/// a = Σ(σ²+μ²),  b = Σσ²(σ²+2μ²),  c = Σσ⁴(σ²+3μ²)
/// ```
///
/// With one variance for all outputs `Q` is a scaled noncentral `χ²` and this
/// `F` is Sankaran's approximation, as in Uhrenholt and Jensen; with unequal
/// variances it is the same power transformation on the first three cumulants.
/// Where `F` is a tail the integral is taken in logarithms after a substitution
/// that removes the power law of `F` at its end, so that it neither cancels nor
/// vanishes; where `F` rises it is taken over the normal variable, and where `F`
/// is 1 in closed form.
///
/// # Accuracy
/// That of the transformation: a few percent of the value around the mean, less
/// relative accuracy far in the tail. See `docs/validation/bayesopt.md`.
///
/// # Source
/// Uhrenholt and Jensen, AISTATS 2019 (PMLR 89:2661); Sankaran, Biometrika 46
/// (1959) 235; Jensen and Solomon, JASA 67 (1972) 898.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NormImprovement;

impl NormImprovement {
    /// `ln EI` of a prediction; minus infinity when nothing can be gained.
    ///
    /// # Errors
    /// [`AcquisitionError`] when a number is not finite, a standard deviation is negative, or the
    /// lengths differ.
    pub fn ln_of_prediction(
        self,
        mean: &[f64],
        std: &[f64],
        best_norm: f64,
    ) -> Result<f64, AcquisitionError> {
        if mean.len() != std.len() {
            let (expected, found) = (mean.len(), std.len());
            return Err(AcquisitionError::Outputs { expected, found });
        }
        for (&mean, &std) in mean.iter().zip(std) {
            if !(mean.is_finite() && std.is_finite() && std >= 0.0) {
                return Err(AcquisitionError::Prediction { mean, std });
            }
        }
        check_incumbent(best_norm)?;
        let variance: Vec<f64> = std.iter().map(|s| s * s).collect();
        Ok(ln_improvement(&Cumulants::of(mean, &variance, 1.0), best_norm))
    }

    /// `EI` of a prediction with one variance for all outputs, in the closed
    /// form of Uhrenholt and Jensen:
    /// `q₀·F_k(t) − σ²·(k·F_{k+2}(t) + λ·F_{k+4}(t))`, `t = q₀/σ²`.
    ///
    /// It cancels where the improvement is small against `q₀`;
    /// [`Self::ln_of_prediction`] does not.
    ///
    /// # Errors
    /// Those of [`Self::ln_of_prediction`]; `std` must be positive.
    pub fn of_shared_std(
        self,
        mean: &[f64],
        std: f64,
        best_norm: f64,
    ) -> Result<f64, AcquisitionError> {
        check_incumbent(best_norm)?;
        let size = norm(mean);
        if !(size.is_finite() && std.is_finite() && std > 0.0) {
            return Err(AcquisitionError::Prediction { mean: size, std });
        }
        let (k, lambda) = (mean.len() as f64, (size / std).powi(2));
        let t = (best_norm / std).powi(2);
        let cdf = |k: f64| {
            let transform = Transform::new([k + lambda, k + 2.0 * lambda, k + 3.0 * lambda]);
            libm::exp(transform.ln_distribution(t / transform.a))
        };
        Ok(std * std * (t * cdf(k) - k * cdf(k + 2.0) - lambda * cdf(k + 4.0)))
    }

    /// `ln EI` at a point of a surrogate of residuals, with its gradient.
    ///
    /// Where the surrogate is certain the gradient is that of `ln (q₀ − ‖μ‖²)`.
    ///
    /// # Errors
    /// [`AcquisitionError`] for an unusable point or incumbent.
    pub fn evaluate_with_gradient(
        self,
        gp: &GaussianProcess,
        point: &[f64],
        best_norm: f64,
    ) -> Result<Scored, AcquisitionError> {
        gp.bounds().check(point)?;
        check_incumbent(best_norm)?;
        let unit = gp.bounds().to_unit(point);
        let variance: Vec<f64> = gp.signal_std().iter().map(|s| s * s).collect();
        let (belief, slope) = gp.believe_with_slope(&unit);
        let (value, mut gradient) = ln_with_slope(&belief, &slope, &variance, best_norm);
        for (i, g) in gradient.iter_mut().enumerate() {
            *g /= gp.bounds().width(i);
        }
        Ok(Scored { value, gradient })
    }
}

fn check_incumbent(best_norm: f64) -> Result<(), AcquisitionError> {
    if best_norm.is_finite() && best_norm >= 0.0 {
        return Ok(());
    }
    Err(AcquisitionError::Incumbent { value: best_norm })
}

/// `Σ(σ²+μ²)`, `Σσ²(σ²+2μ²)`, `Σσ⁴(σ²+3μ²)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cumulants {
    a: f64,
    b: f64,
    c: f64,
}

impl Cumulants {
    /// For variances `share·signal_o`.
    pub(crate) fn of(mean: &[f64], signal: &[f64], share: f64) -> Self {
        let (mut a, mut b, mut c) = (0.0, 0.0, 0.0);
        for (&mean, &signal) in mean.iter().zip(signal) {
            let (variance, square) = (share * signal, mean * mean);
            a += variance + square;
            b += variance * (variance + 2.0 * square);
            c += variance * variance * (variance + 3.0 * square);
        }
        Self { a, b, c }
    }

    fn values(&self) -> [f64; 3] {
        [self.a, self.b, self.c]
    }

    fn variables(&self) -> [Dual; 3] {
        [Dual::variable(self.a, 0), Dual::variable(self.b, 1), Dual::variable(self.c, 2)]
    }
}

/// The power transformation that makes `u = Q/a` nearly normal: `u^h = centre + spread·z`.
#[derive(Clone, Copy, Debug)]
struct Transform<N> {
    a: N,
    h: N,
    centre: N,
    spread: N,
}

impl<N: Number> Transform<N> {
    fn new([a, b, c]: [N; 3]) -> Self {
        let number = N::constant;
        let (one, half) = (number(1.0), number(0.5));
        let h = (one - number(2.0 / 3.0) * a * c / (b * b)).at_least(MIN_EXPONENT);
        let p = b / (a * a);
        let m = (h - one) * (one - number(3.0) * h);
        let centre = one + h * p * (h - one - half * (number(2.0) - h) * m * p);
        let spread = h * (number(2.0) * p).sqrt() * (one + half * m * p);
        Self { a, h, centre, spread }
    }

    /// `z` of some `u`.
    fn normal(&self, u: N) -> N {
        ((self.h * u.ln()).exp() - self.centre) / self.spread
    }

    /// `ln F` at some `u`.
    fn ln_distribution(&self, u: N) -> N {
        self.normal(u).ln_distribution()
    }

    /// `ln (EI/a)` below `u_0 = q_0/a`.
    fn ln_gain(&self, u0: N) -> N {
        let bend = (self.centre - self.spread).at_least(LEAST_BEND);
        let z_bend = (bend - self.centre) / self.spread;
        let z0 = self.normal(u0);
        if z0.value() <= z_bend.value() {
            return self.ln_tail(u0);
        }
        let below = self.ln_tail((bend.ln() / self.h).exp()).exp();
        let z_sure = N::constant(SURE);
        let sure = z0.value() > SURE;
        let mut gain = below + self.rise(z_bend, if sure { z_sure } else { z0 });
        if sure {
            gain = gain + u0 - ((self.centre + self.spread * z_sure).ln() / self.h).exp();
        }
        gain.ln()
    }

    /// `ln ∫₀^{u₀} F(u) du` where `F` is a tail: with `β` its power law at `u₀` and
    /// `w = v^(1/(β+1))`, `u = u₀·w`, `dw = w^(−β)/(β+1) dv`.
    fn ln_tail(&self, u0: N) -> N {
        let one = N::constant(1.0);
        let ln_end = self.ln_distribution(u0);
        let before = self.ln_distribution(u0 * N::constant(1.0 - EXPONENT_STEP));
        let beta = ((ln_end - before) / N::constant(EXPONENT_STEP)).at_least(0.0);
        let mut sum = N::constant(0.0);
        for (node, weight) in LEGENDRE {
            let ln_w = N::constant(libm::log(node)) / (beta + one);
            let ln_term = self.ln_distribution(u0 * ln_w.exp()) - ln_end - beta * ln_w;
            sum = sum + N::constant(weight) * ln_term.exp();
        }
        u0.ln() - (beta + one).ln() + ln_end + sum.ln()
    }

    /// `∫ F du = ∫ Φ(z)·du/dz dz` between two `z` where `F` rises.
    fn rise(&self, from: N, to: N) -> N {
        let width = to - from;
        let mut sum = N::constant(0.0);
        for (node, weight) in LEGENDRE {
            let z = from + N::constant(node) * width;
            let ln_power = (self.centre + self.spread * z).ln();
            let ln_slope = ln_power * (N::constant(1.0) / self.h - N::constant(1.0));
            sum = sum + N::constant(weight) * (z.ln_distribution() + ln_slope).exp();
        }
        width * sum * self.spread / self.h
    }
}

/// A belief that is certain up to rounding.
fn certain(cumulants: &Cumulants) -> bool {
    cumulants.b <= 1e-28 * cumulants.a * cumulants.a
}

/// `ln EI`.
pub(crate) fn ln_improvement(cumulants: &Cumulants, best_norm: f64) -> f64 {
    ln_improvement_of(cumulants, cumulants.values(), best_norm)
}

/// `ln EI` where it can reach `floor`, else what it cannot exceed, `ln (q₀·F(q₀))`.
pub(crate) fn ln_improvement_above(floor: f64, cumulants: &Cumulants, best_norm: f64) -> f64 {
    let q0 = best_norm * best_norm;
    if q0 > 0.0 && floor > f64::NEG_INFINITY && !certain(cumulants) {
        let transform = Transform::new(cumulants.values());
        let most = libm::log(q0) + transform.ln_distribution(q0 / transform.a);
        if most < floor {
            return most;
        }
    }
    ln_improvement(cumulants, best_norm)
}

/// `ln EI` with its derivatives by the cumulants.
fn ln_improvement_with_slope(cumulants: &Cumulants, best_norm: f64) -> Dual {
    ln_improvement_of(cumulants, cumulants.variables(), best_norm)
}

fn ln_improvement_of<N: Number>(cumulants: &Cumulants, parts: [N; 3], best_norm: f64) -> N {
    let q0 = N::constant(best_norm * best_norm);
    let nothing = N::constant(f64::NEG_INFINITY);
    if q0.value() == 0.0 {
        return nothing;
    }
    let [a, ..] = parts;
    if certain(cumulants) {
        let gain = q0 - a;
        return if gain.value() > 0.0 { gain.ln() } else { nothing };
    }
    a.ln() + Transform::new(parts).ln_gain(q0 / a)
}

/// `ln EI` of a belief with its gradient in unit coordinates.
pub(crate) fn ln_with_slope(
    belief: &Belief,
    slope: &BeliefSlope,
    signal: &[f64],
    best_norm: f64,
) -> (f64, Vec<f64>) {
    let share = belief.share;
    let cumulants = Cumulants::of(&belief.mean, signal, share);
    let ln = ln_improvement_with_slope(&cumulants, best_norm);
    let [by_a, by_b, by_c] = ln.slope;
    let mut by_share = 0.0;
    let mut by_mean = Vec::with_capacity(signal.len());
    for (&mean, &s) in belief.mean.iter().zip(signal) {
        let (variance, square) = (share * s, mean * mean);
        by_mean
            .push(mean * (2.0 * by_a + 4.0 * by_b * variance + 6.0 * by_c * variance * variance));
        by_share += s
            * (by_a
                + 2.0 * by_b * (variance + square)
                + 3.0 * by_c * variance * (variance + 2.0 * square));
    }
    let mut gradient = slope.mean.transpose_times(&by_mean);
    for (g, s) in gradient.iter_mut().zip(&slope.share) {
        *g += by_share * s;
    }
    (ln.value, gradient)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Richardson's extrapolation in steps of a thousandth of the standard deviation of `Q`:
    /// truncation of order 1e-12 times a fifth derivative in those units. Rounding is added to it.
    const RICHARDSON_REL: f64 = 1e-8;
    const STEP: f64 = 1e-3;

    fn at([a, b, c]: [f64; 3], best_norm: f64) -> Dual {
        ln_improvement_with_slope(&Cumulants { a, b, c }, best_norm)
    }

    /// Cumulants of beliefs from nearly certain to vague, each with incumbents from hopeless to
    /// sure.
    fn cases() -> impl Iterator<Item = ([f64; 3], f64)> {
        [0.003, 0.03, 0.3, 3.0].into_iter().flat_map(|spread: f64| {
            let mean: Vec<f64> = (0..12).map(|o| (0.7 * f64::from(o)).sin()).collect();
            let signal: Vec<f64> = (0..12).map(|o| 1.0 + 0.05 * f64::from(o)).collect();
            let parts = Cumulants::of(&mean, &signal, spread * spread).values();
            [0.3, 0.8, 0.98, 1.0, 1.02, 1.3, 3.0, 30.0]
                .map(|share| (parts, share * parts[0].sqrt()))
        })
    }

    #[test]
    fn property_slopes_by_the_cumulants() {
        for (parts, best_norm) in cases() {
            let [a, b, c] = parts;
            let value = at(parts, best_norm);
            assert_eq!(value.value, ln_improvement(&Cumulants { a, b, c }, best_norm));
            let size = |j: usize| value.slope[j] * parts[j];
            let scale = (0..3).fold(0.0_f64, |m, j| m.max(size(j).abs()));
            let step = STEP * (2.0 * b).sqrt() / a;
            for i in 0..3 {
                let central = |h: f64| {
                    let side = |sign: f64| {
                        let mut moved = parts;
                        moved[i] *= 1.0 + sign * h;
                        at(moved, best_norm).value
                    };
                    (side(1.0) - side(-1.0)) / (2.0 * h)
                };
                let slope = (4.0 * central(0.5 * step) - central(step)) / 3.0;
                let error = (slope - size(i)).abs() / scale;
                let rounding = 8.0 * f64::EPSILON * (1.0 + value.value.abs()) / (step * scale);
                let allowed = RICHARDSON_REL + rounding;
                assert!(error < allowed, "{parts:?} {best_norm} {i}: {error:e} of {allowed:e}");
            }
        }
    }

    #[test]
    fn property_the_most_it_can_be() {
        for ([a, b, c], best_norm) in cases() {
            let parts = Cumulants { a, b, c };
            let value = ln_improvement(&parts, best_norm);
            let most = ln_improvement_above(f64::INFINITY, &parts, best_norm);
            assert!(value <= most, "{parts:?} {best_norm}: {value} {most}");
            assert_eq!(ln_improvement_above(value, &parts, best_norm), value);
        }
    }

    #[test]
    fn law_a_sure_gain_is_the_difference() {
        // relative width 1e-3·√2, incumbent far above: F is a step
        let (a, best_norm) = (0.02, 1.0);
        let gain = at([a, a * a * 1e-6, a * a * a * 1e-12], best_norm);
        let want = best_norm * best_norm - a;
        assert!((gain.value - want.ln()).abs() < 1e-6, "{gain:?}");
        assert!((gain.slope[0] * want + 1.0).abs() < 1e-6, "{gain:?}");
    }
}
