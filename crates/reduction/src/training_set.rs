use crate::{Matrix, matrix::norm};

/// How the columns of the training set are weighed against one another.
///
/// The paper joins locations and modes (eq. 4) without a word on their units;
/// the nearest neuron depends on them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingScaling {
    /// Standard deviation that the locations are scaled to.
    pub location: f64,
    /// Scale of each mode.
    pub modes: ModeScaling,
}

impl Default for TrainingScaling {
    /// Every column to unit standard deviation.
    fn default() -> Self {
        Self { location: 1.0, modes: ModeScaling::UnitDeviation }
    }
}

/// Scaling of the modes in a training set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ModeScaling {
    /// Each mode to unit standard deviation: all count alike.
    #[default]
    UnitDeviation,
    /// The modes by their weights (modulus of the amplitude, or singular value)
    /// relative to the largest, that one to unit standard deviation: a mode
    /// counts as much as it contributes.
    ByWeight,
}

/// Training set of the map, one location a row.
///
/// ```text
/// T = [x, υ_1 … υ_w]
/// ```
///
/// Columns are centred and scaled by [`TrainingScaling`]; `x` is the place of
/// the location on [0, 1] before that. A complex conjugate pair of modes enters
/// as its real and its imaginary part, one column each, so that `w` modes make
/// `w` columns. A column without variation stays at zero.
///
/// # Source
///
/// FREEDOM paper, eq. 4.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainingSet {
    rows: Matrix,
    location_mean: f64,
    location_factor: f64,
}

impl TrainingSet {
    /// Joins locations and modes, one mode a column, with a weight each.
    ///
    /// # Panics
    ///
    /// If there are fewer weights than modes.
    pub fn new(modes: &Matrix, weights: &[f64], scaling: TrainingScaling) -> Self {
        assert!(weights.len() >= modes.columns(), "a mode has no weight");
        let count = modes.rows();
        let location: Vec<f64> =
            (0..count).map(|row| row as f64 / (count.max(2) - 1) as f64).collect();
        let (scaled, location_mean, location_factor) = standardise(&location, scaling.location);
        let mut values = scaled;
        let largest = weights.iter().fold(0.0_f64, |top, weight| top.max(weight.abs()));
        for index in 0..modes.columns() {
            let deviation = match scaling.modes {
                ModeScaling::ByWeight if largest > 0.0 => weights[index].abs() / largest,
                _ => 1.0,
            };
            values.extend(standardise(modes.column(index), deviation).0);
        }
        let rows = Matrix::raw(count, modes.columns() + 1, values);
        Self { rows, location_mean, location_factor }
    }

    /// The rows that a map is trained on.
    pub fn rows(&self) -> &Matrix {
        &self.rows
    }

    /// The location, as a fractional row, that a scaled first component stands
    /// for; at the nearest end when it lies outside.
    pub fn location_of(&self, scaled: f64) -> f64 {
        let last = (self.rows.rows() - 1) as f64;
        if self.location_factor == 0.0 {
            return 0.0;
        }
        ((scaled / self.location_factor + self.location_mean) * last).clamp(0.0, last)
    }
}

/// Values centred and scaled to a standard deviation, with mean and factor.
fn standardise(values: &[f64], deviation: f64) -> (Vec<f64>, f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let centred: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let spread = norm(&centred) / count.sqrt();
    // Rounding of the mean is no variation.
    let varies = spread > count * f64::EPSILON * mean.abs();
    let factor = if varies { deviation / spread } else { 0.0 };
    (centred.iter().map(|value| value * factor).collect(), mean, factor)
}
