//! Rows of an encoder, learnt on a bundle's incipient signals.

use std::sync::Arc;

use reduction::{
    CompressionConfig, CompressionError, CompressionMap, Encoding as Kept, Matrix, NoiseCovariance,
    NoiseModel, Snapshots, SomConfig, TrainingData,
};

use crate::{
    offline::{
        bundle::{Bundle, BundleError},
        dataset::{ReferenceDesign, sought_coordinates},
        encoding::Encoder,
    },
    report::Encoding,
    seed::{Purpose, RootSeed},
    simulation::experiment::MASK_POINTS,
    statistics::noise_covariance::unit_noise_covariance,
};

/// Encoder with rows learnt from a bundle; `None` for the whole signal.
///
/// The noise is the bundle's, white on phases sampled at the controller's rate; the map of
/// cluster means is seeded by the dataset's seed. The same bundle gives the same rows.
pub(crate) fn fitted_encoder(
    bundle: &Bundle,
    encoding: Encoding,
) -> Result<Option<Arc<Encoder>>, BundleError> {
    let samples = bundle.experiment.samples();
    let rows = match encoding {
        Encoding::Full => return Ok(None),
        Encoding::Points => picked(&bundle.mask, samples),
        Encoding::ClusterMeans => fitted(bundle, Kept::ClusterMeans)?,
        Encoding::Modes => fitted(bundle, Kept::Modes)?,
        Encoding::Sensitivities => fitted(bundle, Kept::Sensitivities)?,
    };
    Ok(Some(Arc::new(Encoder::new(encoding, rows))))
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
