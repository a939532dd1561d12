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
    let kept = match encoding {
        Encoding::Full => return Ok(None),
        Encoding::Points => {
            let rows = picked(&bundle.mask, bundle.experiment.samples());
            return Ok(Some(Arc::new(Encoder::new(encoding, rows))));
        }
        Encoding::ClusterMeans => Kept::ClusterMeans,
        Encoding::Modes => Kept::Modes,
        Encoding::Sensitivities => Kept::Sensitivities,
    };
    let dataset = bundle.dataset(ReferenceDesign::Incipient).ok_or(BundleError::NoIncipient)?;
    let seed = RootSeed(dataset.seed).derive(Purpose::Map, 0);
    let config = CompressionConfig {
        encoding: kept,
        count: MASK_POINTS,
        som: SomConfig { seed, ..SomConfig::default() },
        ..CompressionConfig::default()
    };
    Ok(Some(Arc::new(compressing_encoder(bundle, &config)?)))
}

/// Encoder of a compression map that is fitted to a bundle's incipient signals, with the noise
/// that the bundle states.
pub(crate) fn compressing_encoder(
    bundle: &Bundle,
    config: &CompressionConfig,
) -> Result<Encoder, BundleError> {
    let dataset = bundle.dataset(ReferenceDesign::Incipient).ok_or(BundleError::NoIncipient)?;
    let snapshots = Snapshots::from_columns(&dataset.signals_a)?;
    let points = sought_coordinates(&bundle.experiment, dataset);
    let parameters = Matrix::from_columns(&points)?.transposed();
    let noise = stated_noise(bundle)?;
    let data = TrainingData::new(&snapshots).with_parameters(&parameters);
    let data = match &noise {
        Some(noise) => data.with_noise(noise),
        None => data,
    };
    let weights = CompressionMap::fit(&data, config)?.weights();
    let rows = (0..weights.columns()).map(|column| weights.column(column).to_vec()).collect();
    Ok(Encoder::new(published(config.encoding), rows))
}

/// The word that answers have for a kind of kept numbers.
fn published(kept: Kept) -> Encoding {
    match kept {
        Kept::Points(_) => Encoding::Points,
        Kept::ClusterMeans => Encoding::ClusterMeans,
        Kept::Sensitivities => Encoding::Sensitivities,
        _ => Encoding::Modes,
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

/// Covariance of the sensors' noise that the bundle states; `None` where it states that there is
/// none.
fn stated_noise(bundle: &Bundle) -> Result<Option<NoiseCovariance>, BundleError> {
    if bundle.noise_a == 0.0 {
        return Ok(None);
    }
    let experiment = &bundle.experiment;
    let rate_hz = experiment.actuator.controller.sample_hz;
    let samples = experiment.samples();
    let unit = unit_noise_covariance(experiment, rate_hz);
    let variance = bundle.noise_a.powi(2);
    let band = |lag: usize| (0..samples - lag).map(|at| variance * unit.at(at + lag, at)).collect();
    let model = NoiseModel::Banded((0..=unit.half_band()).map(band).collect());
    let noise = NoiseCovariance::new(&model, samples, 0.0).map_err(CompressionError::from)?;
    Ok(Some(noise))
}
