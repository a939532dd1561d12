//! Expected improvement of the squared norm of a vector that is modelled.

use crate::{
    dual::Dual,
    error::AcquisitionError,
    gp::{Belief, BeliefSlope, GaussianProcess},
    matrix::norm,
};

use super::expected::Scored;

/// Smallest exponent of the power transformation; it is ½ to ⅓ when all
/// outputs share one variance, and could vanish for very unequal ones.
const MIN_EXPONENT: f64 = 0.1;

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
/// The integral is taken in logarithms after a substitution that removes the
/// power law of `F` at `q₀`, so that it neither cancels nor vanishes.
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
            let parts = Cumulants { a: k + lambda, b: k + 2.0 * lambda, c: k + 3.0 * lambda };
            libm::exp(Transform::new(parts.constants()).ln_value(t))
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

    fn constants(&self) -> [Dual; 3] {
        [self.a, self.b, self.c].map(Dual::constant)
    }

    fn variables(&self) -> [Dual; 3] {
        [Dual::variable(self.a, 0), Dual::variable(self.b, 1), Dual::variable(self.c, 2)]
    }
}

/// The power transformation that makes `Q` nearly normal.
#[derive(Clone, Copy, Debug)]
struct Transform {
    a: Dual,
    h: Dual,
    centre: Dual,
    spread: Dual,
}

impl Transform {
    fn new([a, b, c]: [Dual; 3]) -> Self {
        let one = Dual::constant(1.0);
        let half = Dual::constant(0.5);
        let h = (one - Dual::constant(2.0 / 3.0) * a * c / (b * b)).at_least(MIN_EXPONENT);
        let p = b / (a * a);
        let m = (h - one) * (one - Dual::constant(3.0) * h);
        let centre = one + h * p * (h - one - half * (Dual::constant(2.0) - h) * m * p);
        let spread = h * (Dual::constant(2.0) * p).sqrt() * (one + half * m * p);
        Self { a, h, centre, spread }
    }

    /// `ln F(q)` with derivatives.
    fn ln_distribution(&self, q: f64) -> Dual {
        let power = (self.h * (Dual::constant(q) / self.a).ln()).exp();
        ((power - self.centre) / self.spread).ln_distribution()
    }

    /// `ln F(q)` alone.
    fn ln_value(&self, q: f64) -> f64 {
        let power = libm::exp(self.h.value * libm::log(q / self.a.value));
        crate::normal::ln_distribution((power - self.centre.value) / self.spread.value)
    }

    /// Power law of `F` at `q₀`, from a small relative step.
    fn exponent(&self, q0: f64) -> f64 {
        let step = 1e-3;
        ((self.ln_value(q0) - self.ln_value(q0 * (1.0 - step))) / step).max(0.0)
    }
}

/// Points and weights of the integral: with `w = v^(1/(β+1))`, `q = q₀·w` and
/// `dw = w^(−β)/(β+1) dv`.
fn nodes(q0: f64, exponent: f64) -> [(f64, f64); 8] {
    LEGENDRE.map(|(node, weight)| {
        let ln_w = libm::log(node) / (exponent + 1.0);
        (q0 * libm::exp(ln_w), weight * libm::exp(-exponent * ln_w))
    })
}

/// A belief that is certain up to rounding.
fn certain(cumulants: &Cumulants) -> bool {
    cumulants.b <= 1e-28 * cumulants.a * cumulants.a
}

/// `ln EI`.
pub(crate) fn ln_improvement(cumulants: &Cumulants, best_norm: f64) -> f64 {
    let q0 = best_norm * best_norm;
    if q0 == 0.0 {
        return f64::NEG_INFINITY;
    }
    if certain(cumulants) {
        return libm::log((q0 - cumulants.a).max(0.0));
    }
    let transform = Transform::new(cumulants.constants());
    let ln_at_best = transform.ln_value(q0);
    let exponent = transform.exponent(q0);
    let terms = nodes(q0, exponent);
    let sum: f64 =
        terms.iter().map(|(q, w)| w * libm::exp(transform.ln_value(*q) - ln_at_best)).sum();
    libm::log(q0) - libm::log1p(exponent) + ln_at_best + libm::log(sum)
}

/// `ln EI` with its derivatives by the cumulants.
fn ln_improvement_with_slope(cumulants: &Cumulants, best_norm: f64) -> Dual {
    let q0 = best_norm * best_norm;
    let nothing = Dual::constant(f64::NEG_INFINITY);
    if q0 == 0.0 {
        return nothing;
    }
    if certain(cumulants) {
        let gain = Dual::constant(q0) - Dual::variable(cumulants.a, 0);
        return if gain.value > 0.0 { gain.ln() } else { nothing };
    }
    let transform = Transform::new(cumulants.variables());
    let ln_at_best = transform.ln_distribution(q0);
    let exponent = transform.exponent(q0);
    let mut sum = Dual::constant(0.0);
    for (q, weight) in nodes(q0, exponent) {
        let ln_term = transform.ln_distribution(q) - ln_at_best;
        sum = sum + Dual::constant(weight) * ln_term.exp();
    }
    Dual::constant(libm::log(q0) - libm::log1p(exponent)) + ln_at_best + sum.ln()
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
