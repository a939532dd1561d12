//! Few numbers in place of a whole signal: the likelihood on an encoded residual.
//!
//! ```text
//! z = E·r,   z ~ N(0, E·Σ·Eᵀ)
//! ```
//!
//! with the rows of `E` learnt on the bundle's incipient signals. Everything that is asked of
//! the whole signal's covariance is asked of the smaller one in the same way.

use std::sync::Arc;

use reduction::{
    CompressionConfig, CompressionError, CompressionMap, Encoding as Kept, Matrix, NoiseCovariance,
    NoiseModel, Snapshots, SomConfig, TrainingData,
};

use crate::{
    banded::{BandedCholesky, BandedMatrix, NotPositiveDefinite, dot},
    bundle::{Bundle, BundleError, MASK_POINTS, sought_coordinates},
    dataset::ReferenceDesign,
    noise_covariance::unit_noise_covariance,
    report::{Notice, NoticeCode},
    seed::{Purpose, RootSeed},
};

/// What of the filtered envelope a diagnosis looks at.
///
/// # Source
///
/// [`Points`](Self::Points) is the FREEDOM paper's, section II.A; what each of the others costs
/// in accuracy is compared in `docs/validation/reduction.md`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// Every sample.
    #[default]
    Full,
    /// The samples of the bundle's mask.
    Points,
    /// Means over the clusters of the self-organising map that places the points.
    ClusterMeans,
    /// Projection on the leading modes of the signals in units of the sensors' noise.
    Modes,
    /// Projection on the sensitivities that a linear regression of the signals on the damage
    /// gives, in units of the sensors' noise.
    Sensitivities,
}

impl Encoding {
    /// Every encoding, the default first.
    pub const ALL: [Self; 5] =
        [Self::Full, Self::Points, Self::ClusterMeans, Self::Modes, Self::Sensitivities];

    /// Its name on the command line and in answers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Points => "points",
            Self::ClusterMeans => "cluster-means",
            Self::Modes => "modes",
            Self::Sensitivities => "sensitivities",
        }
    }
}

/// Rows `E` that make few numbers of a signal.
#[derive(Debug)]
pub(crate) struct Encoder {
    pub(crate) encoding: Encoding,
    rows: Vec<Vec<f64>>,
}

impl Encoder {
    /// Learns the rows from a bundle; `None` for the whole signal.
    ///
    /// The noise is the bundle's, white on phases sampled at the controller's rate; the map of
    /// cluster means is seeded by the dataset's seed. The same bundle gives the same rows.
    pub(crate) fn of(
        bundle: &Bundle,
        encoding: Encoding,
    ) -> Result<Option<Arc<Self>>, BundleError> {
        let samples = bundle.experiment.samples();
        let rows = match encoding {
            Encoding::Full => return Ok(None),
            Encoding::Points => picked(&bundle.mask, samples),
            Encoding::ClusterMeans => fitted(bundle, Kept::ClusterMeans)?,
            Encoding::Modes => fitted(bundle, Kept::Modes)?,
            Encoding::Sensitivities => fitted(bundle, Kept::Sensitivities)?,
        };
        Ok(Some(Arc::new(Self { encoding, rows })))
    }

    /// Numbers made of a signal.
    pub(crate) fn size(&self) -> usize {
        self.rows.len()
    }

    /// What an answer says of it.
    pub(crate) fn notice(&self) -> Notice {
        let (name, size) = (self.encoding.name(), self.size());
        let message = format!("`{name}`: {size} numbers were looked at, not the whole signal");
        Notice { code: NoticeCode::Encoded, message }
    }

    /// `E·r`.
    fn encode(&self, signal: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| dot(row, signal)).collect()
    }

    /// `Eᵀ·z`.
    fn spread(&self, encoded: &[f64], samples: usize) -> Vec<f64> {
        let mut signal = vec![0.0; samples];
        for (row, part) in self.rows.iter().zip(encoded) {
            for (value, weight) in signal.iter_mut().zip(row) {
                *value += part * weight;
            }
        }
        signal
    }

    /// `E·Σ·Eᵀ`, dense: its band is as wide as it is.
    fn covariance(&self, whole: &BandedMatrix) -> BandedMatrix {
        let mut covariance = BandedMatrix::zeros(self.size(), self.size());
        for (i, row) in self.rows.iter().enumerate() {
            let image = whole.times(row);
            for (j, other) in self.rows[..=i].iter().enumerate() {
                *covariance.at_mut(i, j) = dot(&image, other);
            }
        }
        covariance
    }
}

/// Rows that pick samples.
fn picked(points: &[usize], samples: usize) -> Vec<Vec<f64>> {
    let pick = |&point: &usize| {
        let mut row = vec![0.0; samples];
        row[point] = 1.0;
        row
    };
    points.iter().map(pick).collect()
}

/// Rows of a compression map of the incipient signals.
fn fitted(bundle: &Bundle, encoding: Kept) -> Result<Vec<Vec<f64>>, BundleError> {
    let dataset = bundle.dataset(ReferenceDesign::Incipient).ok_or(BundleError::NoIncipient)?;
    let snapshots = Snapshots::from_columns(&dataset.signals_a)?;
    let points = sought_coordinates(&bundle.experiment, dataset);
    let parameters = Matrix::from_columns(&points)?.transposed();
    let noise = stated_noise(bundle)?;
    let data = TrainingData::new(&snapshots).with_parameters(&parameters).with_noise(&noise);
    let seed = RootSeed(dataset.seed).derive(Purpose::Map, 0);
    let config = CompressionConfig {
        encoding,
        count: MASK_POINTS,
        som: SomConfig { seed, ..SomConfig::default() },
        ..CompressionConfig::default()
    };
    let weights = CompressionMap::fit(&data, &config)?.weights();
    Ok((0..weights.columns()).map(|column| weights.column(column).to_vec()).collect())
}

/// Covariance of the sensors' noise that the bundle states.
fn stated_noise(bundle: &Bundle) -> Result<NoiseCovariance, BundleError> {
    let experiment = &bundle.experiment;
    let rate_hz = experiment.actuator.controller.sample_hz;
    let samples = experiment.samples();
    let unit = unit_noise_covariance(&experiment.filter, rate_hz, samples);
    let variance = bundle.noise_a.powi(2);
    let band = |lag: usize| (0..samples - lag).map(|at| variance * unit.at(at + lag, at)).collect();
    let model = NoiseModel::Banded((0..=unit.half_band()).map(band).collect());
    Ok(NoiseCovariance::new(&model, samples, 0.0).map_err(CompressionError::from)?)
}

/// Factor of the covariance of what a diagnosis looks at.
#[derive(Debug)]
pub(crate) struct Factor {
    encoder: Option<Arc<Encoder>>,
    cholesky: BandedCholesky,
    size: usize,
}

impl Factor {
    /// Factors the covariance of a signal, or that of what an encoder makes of it.
    pub(crate) fn new(
        covariance: BandedMatrix,
        encoder: Option<&Arc<Encoder>>,
    ) -> Result<Self, NotPositiveDefinite> {
        let seen = match encoder {
            Some(encoder) => encoder.covariance(&covariance),
            None => covariance,
        };
        let size = seen.order();
        Ok(Self { encoder: encoder.cloned(), cholesky: seen.cholesky()?, size })
    }

    /// Numbers that are looked at.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// White numbers from a residual of full length.
    pub(crate) fn whiten(&self, residual: &[f64]) -> Vec<f64> {
        let mut seen = match &self.encoder {
            Some(encoder) => encoder.encode(residual),
            None => residual.to_vec(),
        };
        self.cholesky.whiten(&mut seen);
        seen
    }

    /// The same for several residuals.
    pub(crate) fn whiten_each<'r>(
        &self,
        residuals: impl Iterator<Item = &'r Vec<f64>>,
    ) -> Vec<Vec<f64>> {
        let see = |residual: &Vec<f64>| match &self.encoder {
            Some(encoder) => encoder.encode(residual),
            None => residual.clone(),
        };
        let mut seen: Vec<Vec<f64>> = residuals.map(see).collect();
        self.cholesky.whiten_each(&mut seen);
        seen
    }

    /// `Eᵀ·(E·Σ·Eᵀ)⁻¹·E·r`, of full length.
    pub(crate) fn solve(&self, residual: &[f64]) -> Vec<f64> {
        self.spread(self.whiten(residual), residual.len())
    }

    /// `Eᵀ·L⁻ᵀ·z` of white numbers, of full length: after [`whiten`](Self::whiten) this is
    /// [`solve`](Self::solve).
    pub(crate) fn spread(&self, mut white: Vec<f64>, samples: usize) -> Vec<f64> {
        self.cholesky.whiten_transposed(&mut white);
        match &self.encoder {
            Some(encoder) => encoder.spread(&white, samples),
            None => white,
        }
    }

    /// The same for several.
    pub(crate) fn spread_each(&self, mut white: Vec<Vec<f64>>, samples: usize) -> Vec<Vec<f64>> {
        self.cholesky.whiten_transposed_each(&mut white);
        match &self.encoder {
            Some(encoder) => white.iter().map(|row| encoder.spread(row, samples)).collect(),
            None => white,
        }
    }

    /// Logarithm of the determinant of the covariance.
    pub(crate) fn log_determinant(&self) -> f64 {
        self.cholesky.log_determinant()
    }

    /// The part of a misfit of one a number that a noise of covariance `N` has,
    /// `tr((E·Σ·Eᵀ)⁻¹·E·N·Eᵀ)/size`; `None` for the whole signal, where it is estimated.
    pub(crate) fn exact_share(&self, noise: &BandedMatrix) -> Option<f64> {
        let encoder = self.encoder.as_ref()?;
        let covariance = encoder.covariance(noise);
        let trace: f64 = (0..self.size)
            .map(|j| {
                let mut column: Vec<f64> = (0..self.size).map(|i| covariance.at(i, j)).collect();
                self.cholesky.whiten(&mut column);
                self.cholesky.whiten_transposed(&mut column);
                column[j]
            })
            .sum();
        Some(trace / self.size as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two solves of order 12 with condition below 10.
    const SOLVE_ABS: f64 = 1e-13;

    fn covariance() -> BandedMatrix {
        let mut whole = BandedMatrix::zeros(12, 2);
        for i in 0..12_usize {
            for j in i.saturating_sub(2)..=i {
                *whole.at_mut(i, j) = if i == j { 2.0 } else { 0.5 / (i - j) as f64 };
            }
        }
        whole
    }

    fn encoder(rows: Vec<Vec<f64>>) -> Arc<Encoder> {
        Arc::new(Encoder { encoding: Encoding::Modes, rows })
    }

    #[test]
    fn a_square_encoder_loses_nothing() {
        // any invertible E leaves r'Σ⁻¹r as it is
        let rows = (0..12)
            .map(|i| {
                (0..12).map(|j| if i == j { 2.0 } else { 0.1 * f64::from(i - j).sin() }).collect()
            })
            .collect();
        let whole = Factor::new(covariance(), None).unwrap();
        let encoded = Factor::new(covariance(), Some(&encoder(rows))).unwrap();
        let residual: Vec<f64> = (0..12).map(|i| (0.9 * f64::from(i)).sin()).collect();
        for (a, b) in whole.solve(&residual).iter().zip(encoded.solve(&residual)) {
            assert!((a - b).abs() < SOLVE_ABS, "{a} {b}");
        }
        let square = |factor: &Factor| factor.whiten(&residual).iter().map(|z| z * z).sum::<f64>();
        assert!((square(&whole) - square(&encoded)).abs() < SOLVE_ABS);
        // of noise that is all there is, every number has one
        assert!((encoded.exact_share(&covariance()).unwrap() - 1.0).abs() < SOLVE_ABS);
    }

    #[test]
    fn a_picked_sample_has_its_own_variance() {
        let factor = Factor::new(covariance(), Some(&encoder(picked(&[5], 12)))).unwrap();
        let residual: Vec<f64> = (0..12).map(f64::from).collect();
        assert_eq!(factor.size(), 1);
        assert!((factor.whiten(&residual)[0] - 5.0 / 2f64.sqrt()).abs() < SOLVE_ABS);
        assert!((factor.log_determinant() - 2f64.ln()).abs() < SOLVE_ABS);
    }
}
