use crate::{
    CompressionMap, Information, InformationError, Matrix, NoiseCovariance, information::seen,
};

/// A point in parameter space at which encodings are judged.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundCase {
    /// Change of the signal per unit of each parameter, one parameter a column.
    pub sensitivities: Matrix,
    /// Change of the quantities of interest per unit of each parameter, one
    /// quantity a row; none when the parameters themselves are of interest.
    pub derivatives: Option<Matrix>,
}

/// Cost of an encoding against the whole signal.
///
/// ```text
/// inflation = least deviation from the encoded numbers ÷ from the whole signal
/// ```
///
/// # Examples
///
/// ```
/// use reduction::{
///     BoundCase, CompressionConfig, CompressionMap, Encoding, EncodingBounds, Matrix,
///     NoiseCovariance, NoiseModel, Placement, Snapshots,
/// };
///
/// // Signals of one changing amplitude: a quarter of equal samples doubles the deviation.
/// let snapshots = Snapshots::from_fn(40, 8, |_, column| column as f64)?;
/// let noise = NoiseCovariance::new(&NoiseModel::White { variance: 1.0 }, 40, 0.0)?;
/// let config = CompressionConfig {
///     encoding: Encoding::Points(Placement::Uniform),
///     count: 10,
///     ..CompressionConfig::default()
/// };
/// let map = CompressionMap::fit(&(&snapshots).into(), &config)?;
/// let case =
///     BoundCase { sensitivities: Matrix::from_fn(40, 1, |_, _| 1.0)?, derivatives: None };
/// let bounds = EncodingBounds::of(&map, &noise, &[case])?;
/// assert!((bounds.median_inflation()[0] - 2.0).abs() < 1e-12);
/// assert!((bounds.information[0] - 0.25).abs() < 1e-12);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct EncodingBounds {
    /// Least deviation from the encoded numbers, one quantity a row, one case a
    /// column.
    pub deviations: Matrix,
    /// Least deviation from the whole signal, likewise.
    pub whole: Matrix,
    /// Fraction of the information kept in each case
    /// ([`Information::fraction_of`]).
    pub information: Vec<f64>,
}

impl EncodingBounds {
    /// Judges a map at some points.
    ///
    /// # Errors
    ///
    /// [`InformationError::Size`] for no case, and each [`InformationError`] for
    /// what it names; [`InformationError::Unidentifiable`] when the encoding
    /// lets a parameter vanish.
    pub fn of(
        map: &CompressionMap,
        noise: &NoiseCovariance,
        cases: &[BoundCase],
    ) -> Result<Self, InformationError> {
        let basis = seen(noise, &map.weights())?;
        let (mut deviations, mut wholes, mut information) = (Vec::new(), Vec::new(), Vec::new());
        for case in cases {
            let whole = Information::of_signal(&case.sensitivities, noise)?;
            let kept = whole.seen_by(&basis);
            deviations.push(case.deviations(&kept)?);
            wholes.push(case.deviations(&whole)?);
            information.push(kept.fraction_of(&whole)?);
        }
        let quantities = wholes.first().map_or(0, Vec::len);
        let unequal = |_| InformationError::Size { found: cases.len(), expected: quantities };
        Ok(Self {
            deviations: Matrix::from_columns(&deviations).map_err(unequal)?,
            whole: Matrix::from_columns(&wholes).map_err(unequal)?,
            information,
        })
    }

    /// Median over the cases of each quantity's inflation.
    pub fn median_inflation(&self) -> Vec<f64> {
        self.inflations().map(|mut row| median(&mut row)).collect()
    }

    /// Largest inflation of each quantity over the cases.
    pub fn worst_inflation(&self) -> Vec<f64> {
        self.inflations().map(|row| row.into_iter().fold(0.0, f64::max)).collect()
    }

    /// Median over the cases of each quantity's least deviation.
    pub fn median_deviation(&self) -> Vec<f64> {
        (0..self.deviations.rows()).map(|row| median(&mut self.deviations.row(row))).collect()
    }

    fn inflations(&self) -> impl Iterator<Item = Vec<f64>> + '_ {
        (0..self.deviations.rows()).map(|row| {
            let pairs = self.deviations.row(row).into_iter().zip(self.whole.row(row));
            pairs.map(|(kept, whole)| kept / whole).collect()
        })
    }
}

impl BoundCase {
    fn deviations(&self, information: &Information) -> Result<Vec<f64>, InformationError> {
        let bound = information.cramer_rao()?;
        Ok(match &self.derivatives {
            Some(derivatives) => bound.of_derived(derivatives)?.deviations(),
            None => bound.deviations(),
        })
    }
}

/// Median; the mean of the middle two of an even number.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    f64::midpoint(values[(values.len() - 1) / 2], values[values.len() / 2])
}
