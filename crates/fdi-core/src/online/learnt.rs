//! Learnt errors and covariances of a bundle, kept from one recording to the next.

use std::{convert::Infallible, sync::Arc};

use ema_sim::SimulationError;
use inference::BandedMatrix;

use crate::{
    offline::{
        bundle::{Bundle, BundleError, StartAngle, differences},
        dataset::{ReferenceDesign, sought_coordinates},
        encoding::Encoder,
        error_model::{ErrorModel, FOLDS},
    },
    online::{
        beginning,
        cache::{ErrorId, Kept, LikelihoodKey, NoiseKey, RateKey},
        damage::within_training,
        emulator::Emulator,
        error::DiagnoseError,
        folds::Folds,
        likelihood::{GridLikelihood, Likelihood},
        noise_grid::NoiseLevel,
        observation::Observation,
        severe_errors::SevereErrors,
    },
    simulation::experiment::{Experiment, Monitor},
    statistics::noise_covariance::unit_noise_covariance,
    unit::{
        error::UnitError,
        evidence::TemperatureReading,
        monitor::{NominalSlopes, UnitMonitor},
        quantities::Quantities,
        unmodelled::{EffectSlopes, absent},
    },
};

/// Errors that are kept.
const ERRORS_KEPT: usize = 8;
/// Numbers in the factors of all likelihoods that are kept for the next recording, and in those of
/// their folds: 64 MB each.
const NUMBERS_KEPT: usize = 8_000_000;
/// Likelihoods that are kept at least, and at most.
const LIKELIHOODS_KEPT: [usize; 2] = [3, 64];
/// Levels whose folds are kept at least, and at most.
const FOLDS_KEPT: [usize; 2] = [1, 16];
/// Rates of the phase samples whose noise is kept.
const RATES_KEPT: usize = 64;
/// Start angles whose slopes are kept.
const STARTS_KEPT: usize = 16;

/// A bundle with what is learnt from it when first needed.
#[derive(Debug)]
pub(crate) struct Learnt {
    pub(crate) bundle: Bundle,
    /// Rows that make few numbers of the signal; none for the whole signal.
    pub(crate) encoder: Option<Arc<Encoder>>,
    /// Recordings of the machine as new that the error models are corrected with.
    pub(crate) references: Option<References>,
    at_own_start: Kept<(), AtOwnStart>,
    /// Other errors; `None` where the bundle has no signals for one.
    errors: Kept<ErrorId, Option<Arc<ErrorModel>>>,
    /// Errors on severe damage, where the bundle has the wide design.
    severe: Kept<(), Option<Arc<SevereErrors>>>,
    /// Changes of the signal by another start.
    start_effects: Kept<(), Arc<Vec<Vec<f64>>>>,
    /// Quantities that the current of a machine within its tolerances shows.
    quantities: Kept<(), Arc<Quantities>>,
    /// Slopes of the signal in effects that the model file does not have, by the start angle's bits.
    effect_slopes: Kept<u64, Arc<Vec<EffectSlopes>>>,
    /// Slopes of the nominal machine's signal in its quantities, by the start angle's bits.
    nominal_slopes: Kept<u64, Arc<NominalSlopes>>,
    /// Covariance of the noise of one ampere.
    unit_noise: Kept<RateKey, Arc<BandedMatrix>>,
    likelihoods: Kept<LikelihoodKey, Arc<GridLikelihood>>,
    /// Folds of the reference errors, each for several levels of the grid.
    folds: Kept<LikelihoodKey, Arc<Folds>>,
    emulators: Kept<NoiseKey, Arc<Emulator>>,
    /// The response surface, prepared for a noise level.
    surfaces: Kept<NoiseKey, Arc<Emulator>>,
}

/// Models learnt at the bundle's start angle.
#[derive(Clone, Debug)]
pub(crate) struct AtOwnStart {
    /// Error of the low-fidelity model.
    pub(crate) error: Arc<ErrorModel>,
    /// Response surface: signal of the low-fidelity model, its error's mean included, over the
    /// damage.
    pub(crate) surface: Option<Arc<ErrorModel>>,
}

/// References that a diagnosis rests on.
#[derive(Debug)]
pub(crate) struct References {
    /// Recordings.
    pub(crate) count: usize,
    /// Rotor angle at their start.
    pub(crate) start_angle_rad: f64,
    /// Share of their noise in the mean, as a level on each phase sample, A.
    pub(crate) noise_a: f64,
    /// Root mean square of `δ`, A.
    pub(crate) rms_a: f64,
    /// The error model that the references have not changed.
    pub(crate) learnt: ErrorModel,
}

/// The low-fidelity model with the mean of its learnt error added, start angle 0.
#[derive(Clone, Debug)]
pub struct CorrectedMonitor<'a> {
    experiment: &'a Experiment,
    monitor: Monitor,
    error: Arc<ErrorModel>,
}

impl CorrectedMonitor<'_> {
    /// The signal at coordinates looked for, A.
    pub fn signal(&mut self, coordinates: &[f64]) -> Vec<f64> {
        let mut signal = self.monitor.signal(&self.experiment.all_coordinates(coordinates));
        let mean = self.error.mean_at(&within_training(coordinates));
        for (value, mean) in signal.iter_mut().zip(mean) {
            *value += mean;
        }
        signal
    }
}

impl Learnt {
    /// A bundle of which nothing is learnt yet.
    pub(crate) fn of(bundle: Bundle, encoder: Option<Arc<Encoder>>) -> Result<Self, BundleError> {
        let shape = bundle.incipient_shape().ok_or(BundleError::NoIncipient)?;
        let numbers = bundle.experiment.samples() * shape.taper_support_samples;
        let kept = |factors: usize, [least, most]: [usize; 2]| {
            (NUMBERS_KEPT / factors / numbers.max(1)).clamp(least, most)
        };
        let levels = kept(1, LIKELIHOODS_KEPT);
        Ok(Self {
            bundle,
            encoder,
            references: None,
            at_own_start: Kept::at_most(1),
            errors: Kept::at_most(ERRORS_KEPT),
            severe: Kept::at_most(1),
            start_effects: Kept::at_most(1),
            quantities: Kept::at_most(1),
            effect_slopes: Kept::at_most(STARTS_KEPT),
            nominal_slopes: Kept::at_most(STARTS_KEPT),
            unit_noise: Kept::at_most(RATES_KEPT),
            likelihoods: Kept::at_most(levels),
            folds: Kept::at_most(kept(FOLDS, FOLDS_KEPT)),
            emulators: Kept::at_most(levels),
            surfaces: Kept::at_most(levels),
        })
    }

    /// Models learnt at the bundle's start angle.
    pub(crate) fn at_own_start(&self) -> Result<AtOwnStart, BundleError> {
        self.at_own_start.get((), || {
            let learnt = self.bundle.incipient_with_surface()?.ok_or(BundleError::NoIncipient)?;
            Ok(AtOwnStart { error: Arc::new(learnt.0), surface: learnt.1.map(Arc::new) })
        })
    }

    /// Puts other models in the place of those learnt at the bundle's start angle.
    pub(crate) fn correct_own_start(&mut self, corrected: AtOwnStart) {
        self.at_own_start.put((), corrected);
    }

    /// Learnt error; `None` where the bundle has no signals for it.
    pub(crate) fn error(&self, id: ErrorId) -> Result<Option<Arc<ErrorModel>>, BundleError> {
        match id {
            ErrorId::Incipient => Ok(Some(self.at_own_start()?.error)),
            ErrorId::Turned => self.turned(),
            ErrorId::HighOwnStart => {
                let learn = || self.high_error(StartAngle::Zero, &self.at_own_start()?.error);
                self.errors.get(id, learn)
            }
            ErrorId::Signal => {
                self.errors.get(id, || Ok(self.bundle.signal_model()?.map(Arc::new)))
            }
            ErrorId::HighAnyStart => self.errors.get(id, || match self.turned()? {
                Some(turned) => self.high_error(StartAngle::Any, &turned),
                None => Ok(None),
            }),
        }
    }

    /// Error of the low-fidelity model for another start angle than the bundle's.
    pub(crate) fn turned(&self) -> Result<Option<Arc<ErrorModel>>, BundleError> {
        let learn = || Ok(self.bundle.error_model(StartAngle::Any)?.map(Arc::new));
        self.errors.get(ErrorId::Turned, learn)
    }

    /// Puts another error of the low-fidelity model in the place of the learnt one.
    pub(crate) fn correct_turned(&mut self, corrected: ErrorModel) {
        self.errors.put(ErrorId::Turned, Some(Arc::new(corrected)));
    }

    fn high_error(
        &self,
        start: StartAngle,
        error: &ErrorModel,
    ) -> Result<Option<Arc<ErrorModel>>, BundleError> {
        Ok(self.bundle.high_error_model(start, error)?.map(Arc::new))
    }

    /// Error of the high-fidelity model: at the bundle's own start angle, or at another where the
    /// bundle has signals of others.
    pub(crate) fn high_error_id(&self, at_own_start: bool) -> Result<ErrorId, BundleError> {
        let is_turned = !at_own_start && self.turned()?.is_some();
        Ok(if is_turned { ErrorId::HighAnyStart } else { ErrorId::HighOwnStart })
    }

    /// Error of the low-fidelity model on severe damage, from the wide design.
    pub(crate) fn severe(&self) -> Result<Option<Arc<SevereErrors>>, BundleError> {
        self.severe.get((), || {
            let Some(dataset) = self.bundle.dataset(ReferenceDesign::Wide) else {
                return Ok(None);
            };
            let experiment = &self.bundle.experiment;
            // what references correct is no error of the low-fidelity model on this machine's model
            let own = self.at_own_start()?.error;
            let references = self.references.as_ref();
            let model = references.map_or(&*own, |references| &references.learnt);
            let errors = differences(experiment, dataset)?;
            let points = sought_coordinates(experiment, dataset);
            Ok(Some(Arc::new(SevereErrors::learn(model, errors, &points))))
        })
    }

    /// Changes of the signal by another start, of the play and of the integrator.
    pub(crate) fn start_effects(&self) -> Result<Arc<Vec<Vec<f64>>>, BundleError> {
        let effects = || Ok(Arc::new(beginning::start_effects(&self.bundle.experiment)?));
        self.start_effects.get((), effects)
    }

    /// Quantities that the current of a machine within its tolerances shows.
    pub(crate) fn quantities(&self) -> Arc<Quantities> {
        let made = || Ok::<_, Infallible>(Arc::new(Quantities::new(&self.bundle.experiment)));
        let Ok(quantities) = self.quantities.get((), made);
        quantities
    }

    /// Slopes of the nominal machine's signal in effects that the model file does not have.
    pub(crate) fn effect_slopes(
        &self,
        start_angle_rad: f64,
    ) -> Result<Arc<Vec<EffectSlopes>>, SimulationError> {
        self.effect_slopes.get(start_angle_rad.to_bits(), || {
            let quantities = self.quantities();
            let monitor = UnitMonitor::new(&self.bundle.experiment, &quantities, start_angle_rad);
            let effects = absent(&self.bundle.experiment.effects);
            Ok(Arc::new(monitor.effect_slopes(&quantities.nominal(), &effects)?))
        })
    }

    /// Slopes of the nominal machine's signal in its quantities, by differences over their spread
    /// between the machines of a learnt error: the one of the start angle, which is the key.
    pub(crate) fn nominal_slopes(
        &self,
        error: &UnitError,
        start_angle_rad: f64,
    ) -> Result<Arc<NominalSlopes>, SimulationError> {
        self.nominal_slopes.get(start_angle_rad.to_bits(), || {
            let quantities = self.quantities();
            let monitor = UnitMonitor::new(&self.bundle.experiment, &quantities, start_angle_rad);
            Ok(Arc::new(monitor.nominal_slopes(&error.spread)?))
        })
    }

    /// Temperature of a recording's winding beyond that of the model file's numbers, where it was read.
    pub(crate) fn temperature_reading(
        &self,
        observation: &Observation,
    ) -> Option<TemperatureReading> {
        let law = self.bundle.experiment.temperature?;
        let (found_k, std_k) = observation.winding_temperature_k?;
        Some(TemperatureReading { away_k: found_k - law.nominal_k, std_k })
    }

    /// Covariance of the noise of one ampere on phases sampled at a rate.
    pub(crate) fn unit_noise(&self, phase_rate_hz: f64) -> Arc<BandedMatrix> {
        let Ok(noise) = self.unit_noise.get(RateKey::new(phase_rate_hz), || {
            let experiment = &self.bundle.experiment;
            let unit = unit_noise_covariance(experiment, phase_rate_hz);
            Ok::<_, Infallible>(Arc::new(unit))
        });
        noise
    }

    /// Noise of recording and references together, A.
    pub(crate) fn with_reference_noise(&self, noise_a: f64) -> f64 {
        self.references.as_ref().map_or(noise_a, |references| noise_a.hypot(references.noise_a))
    }

    /// Noise of recording and references with the level of the grid; a level of its own where few
    /// numbers are looked at, whose covariance is small.
    pub(crate) fn level(&self, noise_a: f64) -> NoiseLevel {
        let whole_a = self.with_reference_noise(noise_a);
        match self.encoder {
            Some(_) => NoiseLevel::own(whole_a),
            None => NoiseLevel::near(whole_a),
        }
    }

    /// Likelihood of an error at a noise level.
    pub(crate) fn likelihood(
        &self,
        id: ErrorId,
        phase_rate_hz: f64,
        noise_a: f64,
    ) -> Result<Likelihood, DiagnoseError> {
        let level = self.level(noise_a);
        Ok(Likelihood::at(self.grid(id, phase_rate_hz, level)?, level))
    }

    /// Likelihood of an error at a level of the grid.
    fn grid(
        &self,
        id: ErrorId,
        phase_rate_hz: f64,
        level: NoiseLevel,
    ) -> Result<Arc<GridLikelihood>, DiagnoseError> {
        self.likelihoods.get(LikelihoodKey::new(id, phase_rate_hz, level), || {
            let error = self.error(id)?.ok_or(match id {
                ErrorId::Signal => BundleError::NoEmulator,
                _ => BundleError::NoIncipient,
            })?;
            let (unit, encoder) = (self.unit_noise(phase_rate_hz), self.encoder.as_ref());
            let of_folds = level.of_folds();
            let key = LikelihoodKey::new(id, phase_rate_hz, of_folds);
            let Ok(folds) = self.folds.get(key, || {
                let folds = Folds::at(&error, &unit, of_folds.grid_variance_a2(), encoder);
                Ok::<_, Infallible>(Arc::new(folds))
            });
            Ok(Arc::new(GridLikelihood::with_folds(level.grid_variance_a2(), folds)?))
        })
    }

    /// Emulator for the levels about one of the grid.
    pub(crate) fn emulator(
        &self,
        phase_rate_hz: f64,
        level: NoiseLevel,
    ) -> Result<Arc<Emulator>, DiagnoseError> {
        self.emulators.get(NoiseKey::new(phase_rate_hz, level), || {
            let model = self.error(ErrorId::Signal)?.ok_or(BundleError::NoEmulator)?;
            let grid = self.grid(ErrorId::Signal, phase_rate_hz, level)?;
            Ok(Arc::new(Emulator::on(model, self.bundle.experiment.sought_indices(), grid)))
        })
    }

    /// Response surface for the levels about one of the grid; `None` where there is none.
    pub(crate) fn surface(
        &self,
        phase_rate_hz: f64,
        noise_a: f64,
    ) -> Result<Option<Arc<Emulator>>, DiagnoseError> {
        let Some(surface) = self.at_own_start()?.surface else { return Ok(None) };
        let level = self.level(noise_a);
        let prepared = self.surfaces.get(NoiseKey::new(phase_rate_hz, level), || {
            let grid = self.grid(ErrorId::Incipient, phase_rate_hz, level)?;
            let sought = self.bundle.experiment.sought_indices();
            Ok::<_, DiagnoseError>(Arc::new(Emulator::on(surface, sought, grid)))
        });
        prepared.map(Some)
    }

    /// The low-fidelity model with the mean of its error added.
    pub(crate) fn corrected_monitor(&self) -> Result<CorrectedMonitor<'_>, BundleError> {
        let experiment = &self.bundle.experiment;
        let error = self.at_own_start()?.error;
        Ok(CorrectedMonitor { experiment, monitor: experiment.monitor(0.0)?, error })
    }

    /// Mechanical angle within which two start angles count as one, rad.
    pub(crate) fn tolerance_rad(&self) -> f64 {
        self.bundle.experiment.start_tolerance_rad()
    }

    /// True where two start angles count as one.
    pub(crate) fn same_start(&self, a_rad: f64, b_rad: f64) -> bool {
        self.bundle.experiment.is_same_start(a_rad, b_rad)
    }
}
