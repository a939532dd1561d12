//! Fitting the hyperparameters, and adding observations one by one.

#[cfg(feature = "serde")]
use super::layout::Layout;
use super::{
    data::{Data, check_finite},
    evidence::{Evidence, Memory, Solved},
};
use crate::{
    bounds::{Bounds, Walls},
    error::{FitError, SettingError},
    features::Features,
    kernel::Kernel,
    matrix::{Matrix, norm},
    minimise::{Limits, minimise},
    random::{Purpose, Stream},
};

/// Centre of the prior on log length scales, `ln 1.5`.
const LN_PRIOR_SCALE: f64 = 0.405_465_108_108_164_4;

/// Jitters tried, relative to the signal variance.
const JITTERS: [f64; 8] = [0.0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-6, 1e-4];

/// Knowledge of the observation noise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Noise {
    /// The ratio of noise to signal variance is given.
    Ratio(f64),
    /// The ratio is fitted within these limits.
    Fitted {
        /// Smallest ratio.
        lower: f64,
        /// Largest ratio.
        upper: f64,
    },
}

/// How a Gaussian process is fitted.
///
/// Length scales are in units of the input's interval.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct GpOptions {
    /// The covariance function.
    pub kernel: Kernel,
    /// The observation noise.
    pub noise: Noise,
    /// Smallest and largest length scale.
    pub length_scales: (f64, f64),
    /// Local maximisations of the likelihood, each from another start.
    pub starts: usize,
    /// Likelihood evaluations that one maximisation may take.
    pub evaluations_per_start: usize,
    /// With more points, hyperparameters are fitted on this many of them.
    pub max_fit_points: usize,
    /// Weight of a normal prior of standard deviation 1 on each log length
    /// scale around `ln 1.5`, relative to the number of data; 0: pure
    /// maximum likelihood.
    pub prior_weight: f64,
    /// Seed of the starts and of the subset.
    pub seed: u64,
}

impl Default for GpOptions {
    fn default() -> Self {
        Self {
            kernel: Kernel::SquaredExponential,
            noise: Noise::Fitted { lower: 1e-10, upper: 1.0 },
            length_scales: (0.02, 20.0),
            starts: 2,
            evaluations_per_start: 60,
            max_fit_points: 512,
            prior_weight: 0.0,
            seed: 0,
        }
    }
}

impl GpOptions {
    pub(super) fn check(&self) -> Result<(), SettingError> {
        let (low, high) = self.length_scales;
        let mut rules = vec![
            ("length_scales", low, low > 0.0 && low.is_finite(), "positive and finite"),
            ("length_scales", high, high > low && high.is_finite(), "above the lower limit"),
            ("starts", self.starts as f64, self.starts > 0, "at least 1"),
            ("max_fit_points", self.max_fit_points as f64, self.max_fit_points > 1, "at least 2"),
            ("prior_weight", self.prior_weight, self.prior_weight >= 0.0, "not negative"),
        ];
        match self.noise {
            Noise::Ratio(g) => rules.push(("noise", g, g >= 0.0 && g.is_finite(), "not negative")),
            Noise::Fitted { lower, upper } => {
                rules.push(("noise", lower, lower > 0.0, "positive"));
                rules.push((
                    "noise",
                    upper,
                    upper > lower && upper.is_finite(),
                    "above the lower limit",
                ));
            }
        }
        match rules.into_iter().find(|(_, _, holds, _)| !holds) {
            Some((name, value, _, needs)) => Err(SettingError::OutOfRange { name, value, needs }),
            None => Ok(()),
        }
    }

    /// Limits of the logarithmic hyperparameters.
    pub(super) fn limits(&self, scales: usize) -> Walls {
        let mut lower = vec![libm::log(self.length_scales.0); scales];
        let mut upper = vec![libm::log(self.length_scales.1); scales];
        if let Noise::Fitted { lower: low, upper: high } = self.noise {
            lower.push(libm::log(low));
            upper.push(libm::log(high));
        }
        Walls { lower, upper }
    }

    fn fixed_noise(&self) -> Option<f64> {
        match self.noise {
            Noise::Ratio(g) => Some(g),
            Noise::Fitted { .. } => None,
        }
    }
}

/// Hyperparameters that are given and not fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hyperparameters<'a> {
    /// Length scales in units of the intervals, as many as [`FitReport::length_scales`] holds.
    pub length_scales: &'a [f64],
    /// Noise variance over signal variance.
    pub noise_ratio: f64,
}

/// Result of a fit, repairs included.
#[derive(Clone, Debug, PartialEq)]
pub struct FitReport {
    /// Log-likelihood of the data in their own units, all outputs together.
    /// Outputs that never varied do not take part.
    pub ln_likelihood: f64,
    /// Length scales, as fractions of the inputs' intervals: one for each
    /// linear or periodic input, two for a polar pair, at the place of its radius.
    pub length_scales: Vec<f64>,
    /// Noise variance over signal variance, the jitter not included.
    pub noise_ratio: f64,
    /// Jitter that was needed to factor the covariance, relative to the
    /// signal variance; 0 when none.
    pub jitter: f64,
    /// Which length scales rest on a limit.
    pub at_limit: Vec<bool>,
    /// Likelihood evaluations made.
    pub evaluations: usize,
    /// Points that the hyperparameters were fitted on.
    pub fitted_on: usize,
    /// Outputs that never varied.
    pub constant_outputs: usize,
}

/// A Gaussian process fitted to data, one kernel and one Cholesky factor for
/// all outputs, a mean and a variance for each.
///
/// ```text
/// y_o(x) ~ GP(m_o, s_o²·k(x, x')),   observed with noise s_o²·g
/// μ_o(x) = m_o + k(x)ᵀ·K⁻¹·(y_o − m_o)         (FREEDOM paper, eq. 9)
/// σ_o²(x) = s_o²·(1 − k(x)ᵀ·K⁻¹·k(x))          (FREEDOM paper, eq. 10)
/// ```
///
/// `m_o` and `s_o²` maximise the likelihood in closed form; length scales and
/// `g` by a bounded quasi-Newton method from several starts.
///
/// # Cost
/// Fit: `n³/2` multiplications for each likelihood with gradient. Prediction:
/// `n²/2`, and `n` for each output. Appending: `n²`.
///
/// # Examples
///
/// ```
/// use gp_bayesopt::{Bounds, GaussianProcess, GpOptions};
///
/// let bounds = Bounds::new(&[0.0], &[6.0])?;
/// let points: Vec<Vec<f64>> = (0..9).map(|i| vec![0.75 * f64::from(i)]).collect();
/// let values: Vec<f64> = points.iter().map(|x| x[0].sin()).collect();
/// let gp = GaussianProcess::fit(&bounds, &points, &values, &GpOptions::default())?;
/// let at = gp.predict(&[2.0])?;
/// assert!((at.mean[0] - 2.0_f64.sin()).abs() < 1e-3);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "Layout", into = "Layout"))]
pub struct GaussianProcess {
    pub(super) bounds: Bounds,
    pub(super) features: Features,
    pub(super) options: GpOptions,
    pub(super) data: Data,
    pub(super) theta: Vec<f64>,
    pub(super) solved: Solved,
    pub(super) report: FitReport,
    /// Features over length scales, one contiguous row for each feature.
    pub(super) scaled: Vec<f64>,
    /// `K⁻¹·(y − m)` in the outputs' units, points × outputs.
    pub(super) weights: Vec<f64>,
    /// Inverse length scale of each feature.
    pub(super) inverse_scale: Vec<f64>,
    /// Observations appended since the factor was made at once.
    pub(super) appended: usize,
}

/// Cost of finding the hyperparameters.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Effort {
    /// Likelihood evaluations.
    pub(super) evaluations: usize,
    /// Points that the likelihood was that of.
    pub(super) points: usize,
}

impl GaussianProcess {
    /// Fits one output.
    ///
    /// # Errors
    /// Those of [`Self::fit_many`].
    pub fn fit(
        bounds: &Bounds,
        points: &[Vec<f64>],
        values: &[f64],
        options: &GpOptions,
    ) -> Result<Self, FitError> {
        let outputs = column(values);
        Self::fit_many(bounds, points, &outputs, options)
    }

    /// Fits several outputs (`points × outputs`) that share one kernel.
    ///
    /// Duplicated points are fine with noise; without, a jitter is added and
    /// reported. A single point, or outputs that never vary, leave the length
    /// scales at their start.
    ///
    /// # Errors
    /// [`FitError`]: nothing observed, counts that differ, NaN or infinity, unusable
    /// settings, or a covariance that no jitter up to 1e-4 makes definite.
    pub fn fit_many(
        bounds: &Bounds,
        points: &[Vec<f64>],
        outputs: &Matrix,
        options: &GpOptions,
    ) -> Result<Self, FitError> {
        Self::fit_from(bounds, points, outputs, options, None)
    }

    /// Fits several outputs, starting from the hyperparameters of an earlier
    /// fit beside the usual starts.
    ///
    /// # Errors
    /// Those of [`Self::fit_many`].
    pub fn refit(&self, points: &[Vec<f64>], outputs: &Matrix) -> Result<Self, FitError> {
        Self::fit_from(&self.bounds, points, outputs, &self.options, Some(&self.theta))
    }

    pub(crate) fn fit_from(
        bounds: &Bounds,
        points: &[Vec<f64>],
        outputs: &Matrix,
        options: &GpOptions,
        warm: Option<&[f64]>,
    ) -> Result<Self, FitError> {
        options.check()?;
        let features = Features::new(bounds);
        let data = Data::new(bounds, &features, points, outputs)?;
        let (theta, effort) = hyperparameters(&data, &features, options, warm);
        Self::assemble(bounds, data, options, theta, effort)
    }

    /// A process with the hyperparameters of an earlier fit.
    pub(crate) fn at(
        bounds: &Bounds,
        points: &[Vec<f64>],
        outputs: &Matrix,
        options: &GpOptions,
        theta: &[f64],
    ) -> Result<Self, FitError> {
        options.check()?;
        let features = Features::new(bounds);
        let expected = options.limits(features.scales()).lower.len();
        if theta.len() != expected {
            let (name, found) = ("hyperparameters", theta.len());
            return Err(SettingError::Length { name, expected, found }.into());
        }
        let data = Data::new(bounds, &features, points, outputs)?;
        Self::assemble(bounds, data, options, theta.to_vec(), Effort::default())
    }

    /// A process with given hyperparameters; nothing is fitted but means and variances.
    ///
    /// # Errors
    /// Those of [`Self::fit_many`], and [`SettingError::Length`] unless there is one
    /// length scale where [`FitReport::length_scales`] would have one.
    pub fn with_hyperparameters(
        bounds: &Bounds,
        points: &[Vec<f64>],
        outputs: &Matrix,
        options: &GpOptions,
        hyperparameters: Hyperparameters<'_>,
    ) -> Result<Self, FitError> {
        let Hyperparameters { length_scales, noise_ratio } = hyperparameters;
        let features = Features::new(bounds);
        if length_scales.len() != features.scales() {
            let (expected, found) = (features.scales(), length_scales.len());
            return Err(SettingError::Length { name: "length_scales", expected, found }.into());
        }
        let options = GpOptions { noise: Noise::Ratio(noise_ratio), ..options.clone() };
        options.check()?;
        let theta: Vec<f64> = length_scales.iter().map(|&l| libm::log(l)).collect();
        if let Some(at) = theta.iter().position(|t| !t.is_finite()) {
            let (name, needs) = ("length_scales", "positive and finite");
            let value = length_scales[at];
            return Err(SettingError::OutOfRange { name, value, needs }.into());
        }
        let data = Data::new(bounds, &features, points, outputs)?;
        Self::assemble(bounds, data, &options, theta, Effort::default())
    }

    /// Solves at `theta`, with as little jitter as it takes.
    pub(super) fn assemble(
        bounds: &Bounds,
        data: Data,
        options: &GpOptions,
        theta: Vec<f64>,
        effort: Effort,
    ) -> Result<Self, FitError> {
        let features = Features::new(bounds);
        let base = Evidence::new(&data, &features, options.kernel, options.fixed_noise());
        let solved = JITTERS.iter().find_map(|&jitter| {
            let solved = base.clone().with_jitter(jitter).solve(&theta).ok()?;
            // a factor whose pivots span more than this holds no digits
            let (low, high) = solved.factor.pivots();
            (low > 1e-7 * high).then_some((jitter, solved))
        });
        let Some((jitter, solved)) = solved else {
            return Err(FitError::NotPositiveDefinite { jitter: JITTERS[JITTERS.len() - 1] });
        };
        let noise_ratio = base.noise(&theta);
        drop(base);
        let Walls { lower, upper } = options.limits(features.scales());
        let report = FitReport {
            ln_likelihood: 0.0,
            length_scales: theta[..features.scales()].iter().map(|&t| libm::exp(t)).collect(),
            noise_ratio,
            jitter,
            at_limit: (0..features.scales())
                .map(|i| theta[i] <= lower[i] || theta[i] >= upper[i])
                .collect(),
            evaluations: effort.evaluations,
            fitted_on: effort.points,
            constant_outputs: data.scaling.iter().filter(|s| s.spread == 0.0).count(),
        };
        let inverse_scale =
            features.groups().iter().map(|&g| 1.0 / report.length_scales[g]).collect();
        let mut gp = Self {
            bounds: bounds.clone(),
            features,
            options: options.clone(),
            data,
            theta,
            solved,
            report,
            scaled: Vec::new(),
            weights: Vec::new(),
            inverse_scale,
            appended: 0,
        };
        gp.arrange();
        Ok(gp)
    }

    /// Lays out what prediction reads, and states the likelihood in the
    /// outputs' units.
    fn arrange(&mut self) {
        let (n, q) = (self.data.len(), self.data.outputs());
        self.scaled = (0..self.features.len())
            .flat_map(|j| {
                let inverse = self.inverse_scale[j];
                self.data.features.iter().map(move |z| z[j] * inverse)
            })
            .collect();
        self.weights = (0..n)
            .flat_map(|i| (0..q).map(move |o| (i, o)))
            .map(|(i, o)| self.solved.alpha[o * n + i] * self.data.scaling[o].spread)
            .collect();
        let ln_units: f64 =
            self.data.scaling.iter().filter(|s| s.spread > 0.0).map(|s| libm::log(s.spread)).sum();
        self.report.ln_likelihood = self.solved.ln_likelihood - n as f64 * ln_units;
    }

    /// Adds one observation without fitting the hyperparameters again: the
    /// factor grows by one row, means and variances are solved anew.
    ///
    /// # Errors
    /// [`FitError`] for an unusable point or outputs, or when the point is so near
    /// another that the factor would break; the process is then unchanged.
    pub fn append(&mut self, point: &[f64], outputs: &[f64]) -> Result<(), FitError> {
        let n = self.data.len();
        self.bounds.check(point).map_err(|source| FitError::Point { point: n, source })?;
        if outputs.len() != self.data.outputs() {
            let (expected, found) = (self.data.outputs(), outputs.len());
            return Err(FitError::OutputMismatch { observation: n, expected, found });
        }
        check_finite(n, outputs)?;
        self.append_unit(self.bounds.to_unit(point), outputs)
    }

    /// Adds one checked observation at a point of the unit cube.
    pub(super) fn append_unit(&mut self, unit: Vec<f64>, outputs: &[f64]) -> Result<(), FitError> {
        let features = self.features.of(&unit);
        let column = self.correlations(&features);
        let corner = 1.0 + self.report.noise_ratio + self.report.jitter;
        let mut factor = self.solved.factor.clone();
        let broken = FitError::NotPositiveDefinite { jitter: self.report.jitter };
        factor.append(&column, corner).map_err(|_| broken.clone())?;
        let (low, high) = factor.pivots();
        if low <= 1e-7 * high {
            return Err(broken);
        }
        self.data.push(unit, features, outputs);
        self.resolve(factor);
        self.arrange();
        self.appended += 1;
        Ok(())
    }

    /// Means and variances for a factor that has grown.
    fn resolve(&mut self, factor: crate::linalg::Factor) {
        self.solved = super::evidence::profile(&self.data, factor);
        self.report.constant_outputs = self.data.scaling.iter().filter(|s| s.spread == 0.0).count();
    }

    /// Result of the fit.
    pub fn report(&self) -> &FitReport {
        &self.report
    }

    /// The box it was fitted on.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Number of observations.
    pub fn len(&self) -> usize {
        self.data.len()
    }

    /// Tells whether there are no observations: never, a fit needs one.
    pub fn is_empty(&self) -> bool {
        self.data.len() == 0
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.data.outputs()
    }

    /// The `count` observed points of the unit cube with the smallest norm of
    /// the outputs; for one output, with the smallest output.
    pub(crate) fn best_points(&self, count: usize) -> Vec<Vec<f64>> {
        let rate = |row: &Vec<f64>| match row.as_slice() {
            [value] => *value,
            many => norm(many),
        };
        let rates: Vec<f64> = self.data.raw.iter().map(rate).collect();
        let mut order: Vec<usize> = (0..rates.len()).collect();
        order.sort_by(|&a, &b| rates[a].total_cmp(&rates[b]));
        order.into_iter().take(count).map(|i| self.data.unit[i].clone()).collect()
    }

    /// The observed point with the least predicted mean, for one output, and that mean: the
    /// incumbent of observations with noise.
    pub(crate) fn least_belief(&self) -> (usize, f64) {
        let means = self.block(&self.data.unit).mean;
        let less = |(i, low): (usize, f64), (j, mean): (usize, f64)| {
            if mean < low { (j, mean) } else { (i, low) }
        };
        means.into_iter().enumerate().fold((0, f64::INFINITY), less)
    }

    /// Length scale of each input, as a fraction of its interval; the smaller one where an input
    /// has several features.
    pub(crate) fn scale_of_inputs(&self) -> Vec<f64> {
        let mut scales = vec![f64::INFINITY; self.bounds.dimension()];
        let jacobian = self.features.jacobian(&vec![0.3; scales.len()]);
        for (f, inverse) in self.inverse_scale.iter().enumerate() {
            for (scale, slope) in scales.iter_mut().zip(jacobian.row(f)) {
                if *slope != 0.0 {
                    *scale = scale.min(1.0 / inverse);
                }
            }
        }
        scales
    }

    /// Logarithms of the hyperparameters, for a later warm start.
    pub(crate) fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Standard deviation of the observation noise of each output.
    pub fn noise_std(&self) -> Vec<f64> {
        let ratio = self.report.noise_ratio;
        self.signal_std().iter().map(|s| s * ratio.sqrt()).collect()
    }

    /// Prior mean `m_o` of each output.
    pub fn prior_mean(&self) -> Vec<f64> {
        let scaling = self.data.scaling.iter();
        scaling.zip(&self.solved.mean).map(|(s, m)| s.centre + s.spread * m).collect()
    }

    /// Prior standard deviation `s_o` of each output.
    pub fn signal_std(&self) -> Vec<f64> {
        let scaling = self.data.scaling.iter();
        scaling.zip(&self.solved.variance).map(|(s, v)| s.spread * v.sqrt()).collect()
    }
}

/// One column as a matrix.
pub(crate) fn column(values: &[f64]) -> Matrix {
    let mut outputs = Matrix::zeros(values.len(), 1);
    for (i, &v) in values.iter().enumerate() {
        outputs.set(i, 0, v);
    }
    outputs
}

/// Maximises the likelihood; returns the best hyperparameters and what they cost.
fn hyperparameters(
    data: &Data,
    features: &Features,
    options: &GpOptions,
    warm: Option<&[f64]>,
) -> (Vec<f64>, Effort) {
    let scales = features.scales();
    let default = default_start(&options.limits(scales), scales);
    if data.len() < 2 || data.scaling.iter().all(|s| s.spread == 0.0) {
        return (default, Effort { evaluations: 0, points: data.len() });
    }
    let order = Stream::new(options.seed, Purpose::Starts, 1).permutation(data.len());
    let mut evaluations = 0;
    // the starts compete on few points; the winner is refined on all
    let scout = data.len() > SCOUTS * 3 / 2 && warm.is_none();
    let first = if scout {
        data.subset(&order[..SCOUTS])
    } else {
        data.subset(&order[..data.len().min(options.max_fit_points)])
    };
    let found = climb(Climb { data: &first, features, options }, warm, &mut evaluations);
    if !scout {
        return (found.unwrap_or(default), Effort { evaluations, points: first.len() });
    }
    let most = options.max_fit_points.min(data.len());
    let last = if most == data.len() { data.clone() } else { data.subset(&order[..most]) };
    let refine = GpOptions { starts: 1, ..options.clone() };
    let start = found.unwrap_or(default);
    let found =
        climb(Climb { data: &last, features, options: &refine }, Some(&start), &mut evaluations);
    (found.unwrap_or(start), Effort { evaluations, points: last.len() })
}

/// Points on which the starts of a large fit compete.
const SCOUTS: usize = 64;

/// Data whose likelihood is climbed.
#[derive(Clone, Copy)]
struct Climb<'a> {
    data: &'a Data,
    features: &'a Features,
    options: &'a GpOptions,
}

/// The most likely hyperparameters that any start leads to.
fn climb(of: Climb<'_>, warm: Option<&[f64]>, evaluations: &mut usize) -> Option<Vec<f64>> {
    let Climb { data, features, options } = of;
    let scales = features.scales();
    let walls = options.limits(scales);
    let evidence = Evidence::new(data, features, options.kernel, options.fixed_noise())
        .with_jitter(if options.fixed_noise().is_some() { 1e-10 } else { 0.0 });
    let size = (data.len() * data.outputs()) as f64;
    let mut memory = Memory::default();
    let mut cost = |theta: &[f64]| {
        let (value, gradient) = evidence.value_and_gradient(theta, &mut memory)?;
        let prior = |t: f64| options.prior_weight * (t - LN_PRIOR_SCALE);
        let penalty: f64 =
            theta[..scales].iter().map(|&t| 0.5 * prior(t) * (t - LN_PRIOR_SCALE)).sum();
        let mut gradient: Vec<f64> = gradient.iter().map(|g| -g / size).collect();
        for (g, &t) in gradient.iter_mut().zip(&theta[..scales]) {
            *g += prior(t);
        }
        Some((-value / size + penalty, gradient))
    };
    let limits = Limits {
        evaluations: options.evaluations_per_start,
        decrease: 1e-7,
        gradient: 1e-5,
        first_step: 0.7,
    };
    let mut best: Option<(f64, Vec<f64>)> = None;
    for start in starts(&evidence, options, &walls, warm, evaluations) {
        if let Some(found) = minimise(&mut cost, &start, &walls, limits) {
            *evaluations += found.evaluations;
            if best.as_ref().is_none_or(|(value, _)| found.value < *value) {
                best = Some((found.value, found.point));
            }
        }
    }
    best.map(|(_, theta)| theta)
}

/// Half an interval for every length scale, little noise.
fn default_start(walls: &Walls, scales: usize) -> Vec<f64> {
    let Walls { lower, upper } = walls;
    let wish = |i: usize| if i < scales { libm::log(0.7) } else { libm::log(1e-4) };
    (0..lower.len()).map(|i| wish(i).clamp(lower[i], upper[i])).collect()
}

/// Starts of the local maximisations: the warm one, then the most likely of a
/// ladder of equal length scales and of some random ones.
fn starts(
    evidence: &Evidence<'_>,
    options: &GpOptions,
    walls: &Walls,
    warm: Option<&[f64]>,
    evaluations: &mut usize,
) -> Vec<Vec<f64>> {
    let Walls { lower, upper } = walls;
    let mut starts: Vec<Vec<f64>> =
        warm.iter().filter(|w| w.len() == lower.len()).map(|w| w.to_vec()).collect();
    let wanted = options.starts;
    if starts.len() >= wanted {
        return starts;
    }
    let scales = lower.len() - usize::from(options.fixed_noise().is_none());
    let clamp = |theta: Vec<f64>| -> Vec<f64> {
        (0..theta.len()).map(|i| theta[i].clamp(lower[i], upper[i])).collect()
    };
    let mut stream = Stream::new(options.seed, Purpose::Starts, 0);
    let mut pool: Vec<Vec<f64>> = [0.3_f64, 1.0, 3.0]
        .iter()
        .map(|l| (0..lower.len()).map(|i| if i < scales { l.ln() } else { -9.0 }).collect())
        .map(clamp)
        .collect();
    for _ in 1..wanted {
        let theta =
            (0..lower.len())
                .map(|i| {
                    if i < scales { stream.between(-1.5, 1.5) } else { stream.between(-14.0, -3.0) }
                })
                .collect();
        pool.push(clamp(theta));
    }
    let mut rated: Vec<(f64, Vec<f64>)> = pool
        .into_iter()
        .map(|theta| {
            *evaluations += 1;
            (evidence.solve(&theta).map_or(f64::NEG_INFINITY, |s| s.ln_likelihood), theta)
        })
        .collect();
    rated.sort_by(|a, b| b.0.total_cmp(&a.0));
    starts.extend(rated.into_iter().map(|(_, theta)| theta).take(wanted - starts.len()));
    starts
}
