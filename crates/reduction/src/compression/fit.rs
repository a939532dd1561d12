use super::{
    CompressionConfig, CompressionMap, CompressionParts, Encoder, Encoding, PartsError, Placement,
    PointRule, SnapshotOrder, TrainingData,
};
use crate::{
    Dmd, DmdError, Matrix, NoiseError, RankRule, Sensitivities, SensitivityError, Snapshots, Som,
    SomError, Svd, SvdError, TrainingSet,
    decomposition::{self, NoConvergence, Qr},
    placement::{self, Optimality},
    thin_svd,
};

/// Why a compression map could not be fitted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompressionError {
    /// No number, or more numbers than locations, to keep.
    #[error("{count} numbers to keep of {locations} locations")]
    Count {
        /// Numbers asked for.
        count: usize,
        /// Locations there are.
        locations: usize,
    },
    /// Snapshots that are all alike: nothing tells one from another.
    #[error("all {snapshots} snapshots are alike")]
    NoVariation {
        /// Snapshots given.
        snapshots: usize,
    },
    /// A grid with another number of neurons than numbers to keep.
    #[error("{neurons} neurons for {count} numbers to keep")]
    Neurons {
        /// Neurons of the grid.
        neurons: usize,
        /// Numbers asked for.
        count: usize,
    },
    /// An order that does not name each snapshot once.
    #[error("order does not name each of {snapshots} snapshots once")]
    Order {
        /// Snapshots given.
        snapshots: usize,
    },
    /// The encoding rests on parameters, and none were given.
    #[error("this encoding needs the parameters of the snapshots")]
    NoParameters,
    /// Dynamic modes could not be had.
    #[error("dynamic modes not found")]
    Dmd(#[from] DmdError),
    /// Singular modes could not be had.
    #[error("singular modes not found")]
    Svd(#[from] SvdError),
    /// The map could not be trained.
    #[error("self-organising map not trained")]
    Som(#[from] SomError),
    /// Sensitivities could not be learnt.
    #[error("sensitivities not learnt")]
    Sensitivity(#[from] SensitivityError),
    /// The noise covariance does not fit.
    #[error("noise covariance not applied")]
    Noise(#[from] NoiseError),
    /// The fitted parts do not fit one another.
    #[error("parts of the map do not fit one another")]
    Parts(#[from] PartsError),
}

impl From<NoConvergence> for CompressionError {
    fn from(error: NoConvergence) -> Self {
        Self::Svd(SvdError::NoConvergence(error))
    }
}

/// Report of a fit.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct FitReport {
    /// Singular values of the centred training snapshots (noise-whitened where
    /// the encoding is).
    pub singular_values: Vec<f64>,
    /// Dynamic modes kept, where the encoding rests on them.
    pub dynamic_modes: Option<usize>,
    /// Mean distance of the training rows to their neurons.
    pub quantisation_error: Option<f64>,
    /// Fraction of the training rows whose two nearest neurons do not touch.
    pub topographic_error: Option<f64>,
    /// Neurons that stood for a location already taken, moved to the nearest
    /// free one.
    pub points_moved: usize,
    /// Neurons that won no location.
    pub empty_clusters: usize,
}

impl CompressionMap {
    /// Fits a map.
    ///
    /// # Errors
    ///
    /// Each [`CompressionError`] for what it names.
    pub fn fit(
        data: &TrainingData<'_>,
        config: &CompressionConfig,
    ) -> Result<Self, CompressionError> {
        Fit::new(data, config)?.run()
    }
}

struct Fit<'a> {
    data: &'a TrainingData<'a>,
    config: &'a CompressionConfig,
    order: Vec<usize>,
    mean: Vec<f64>,
    centred: Snapshots,
    modes: Svd,
    report: FitReport,
}

/// An encoder, a decoder that comes with it, and a first dynamic mode.
type Fitted = (Encoder, Option<Matrix>, Option<Vec<f64>>);

impl<'a> Fit<'a> {
    fn new(
        data: &'a TrainingData<'a>,
        config: &'a CompressionConfig,
    ) -> Result<Self, CompressionError> {
        let snapshots = data.snapshots;
        let (count, locations) = (config.count, snapshots.locations());
        if count == 0 || count > locations {
            return Err(CompressionError::Count { count, locations });
        }
        let neurons = config.som.grid.neurons();
        if uses_map(config.encoding) && neurons != count {
            return Err(CompressionError::Neurons { neurons, count });
        }
        let order = checked_order(&config.order, snapshots.count())?;
        let mean = snapshots.mean();
        let centred = snapshots.less(&mean);
        if varies_only_by_rounding(&centred, snapshots) {
            return Err(CompressionError::NoVariation { snapshots: snapshots.count() });
        }
        let modes = thin_svd(&centred)?.truncated(RankRule::Full)?;
        let report =
            FitReport { singular_values: modes.singular_values().to_vec(), ..FitReport::default() };
        Ok(Self { data, config, order, mean, centred, modes, report })
    }

    fn run(mut self) -> Result<CompressionMap, CompressionError> {
        let (encoder, decoder, first_mode) = match self.config.encoding {
            Encoding::Points(placement) => self.points(placement)?,
            Encoding::ClusterMeans => self.cluster_means()?,
            Encoding::DynamicModes => self.dynamic_span()?,
            Encoding::Modes => self.whitened_modes()?,
            Encoding::Sensitivities => self.sensitivities()?,
        };
        let decoder = match decoder {
            Some(decoder) => decoder,
            None => self.decoder(&encoder)?,
        };
        let first_mode = first_mode.unwrap_or_else(|| self.modes.left().column(0).to_vec());
        Ok(CompressionMap::from_parts(CompressionParts {
            encoding: self.config.encoding,
            encoder,
            mean: self.mean,
            decoder,
            snapshot_order: self.order,
            first_mode,
            report: self.report,
        })?)
    }

    fn points(&mut self, placement: Placement) -> Result<Fitted, CompressionError> {
        let (locations, count) = (self.mean.len(), self.config.count);
        let mut first_mode = None;
        let mut chosen = match placement {
            Placement::DmdSom => {
                let (modes, weights) = self.dynamic_modes()?;
                first_mode = Some(modes.column(0).to_vec());
                self.map_points(&modes, &weights)?
            }
            Placement::PodSom => {
                let modes = self.modes.left().leading_columns(count);
                let weights = self.modes.singular_values().to_vec();
                self.map_points(&modes, &weights)?
            }
            Placement::Qdeim => placement::qdeim(&self.modes.left().leading_columns(count), count),
            Placement::GreedyAOptimal => self.greedy(Optimality::A)?,
            Placement::GreedyDOptimal => self.greedy(Optimality::D)?,
            Placement::Uniform => placement::uniform(locations, count),
            Placement::Random => placement::random(locations, count, self.config.seed),
        };
        chosen.sort_unstable();
        Ok((Encoder::Select(chosen), None, first_mode))
    }

    fn cluster_means(&mut self) -> Result<Fitted, CompressionError> {
        let (modes, weights) = self.dynamic_modes()?;
        let set = TrainingSet::new(&modes, &weights, self.config.scaling);
        let map = self.train(&set)?;
        let mut groups = vec![Vec::new(); map.grid().neurons()];
        for (location, winner) in map.winners(set.rows())?.into_iter().enumerate() {
            groups[winner].push(location);
        }
        groups.retain(|group| !group.is_empty());
        self.report.empty_clusters = map.grid().neurons() - groups.len();
        // By their first location, as the points are.
        groups.sort_unstable();
        Ok((Encoder::Average(groups), None, Some(modes.column(0).to_vec())))
    }

    fn dynamic_span(&mut self) -> Result<Fitted, CompressionError> {
        let modes = self.dynamic_modes()?.0;
        let first_mode = modes.column(0).to_vec();
        Ok((Encoder::Project(Qr::new(modes).thin_basis()), None, Some(first_mode)))
    }

    fn whitened_modes(&mut self) -> Result<Fitted, CompressionError> {
        let Some(noise) = self.data.noise else {
            let modes = self.modes.left().leading_columns(self.config.count);
            return Ok((Encoder::Project(modes.clone()), Some(modes), None));
        };
        let whitened = Snapshots::from(noise.whiten(self.centred.matrix())?);
        let svd = thin_svd(&whitened)?.truncated(RankRule::Full)?;
        let modes = svd.left().leading_columns(self.config.count);
        self.report.singular_values = svd.singular_values().to_vec();
        let weights = noise.solve_transposed(&modes)?;
        Ok((Encoder::Project(weights), Some(noise.colour(&modes)?), None))
    }

    fn sensitivities(&mut self) -> Result<Fitted, CompressionError> {
        let directions = self.regress()?.directions();
        let whitened = match self.data.noise {
            Some(noise) => noise.whiten(&directions)?,
            None => directions,
        };
        let svd = thin_svd(&Snapshots::from(whitened))?.truncated(RankRule::Full)?;
        let axes = svd.left().leading_columns(self.config.count);
        let weights = match self.data.noise {
            Some(noise) => noise.solve_transposed(&axes)?,
            None => axes,
        };
        Ok((Encoder::Project(weights), None, None))
    }

    /// Real columns of the dynamic modes and the moduli of their amplitudes.
    fn dynamic_modes(&mut self) -> Result<(Matrix, Vec<f64>), CompressionError> {
        let ordered = self.data.snapshots.reordered(&self.order);
        let dmd = Dmd::fit(&ordered, &self.config.dmd)?;
        self.report.dynamic_modes = Some(dmd.rank());
        let weights = dmd.amplitudes().iter().map(|amplitude| amplitude.modulus()).collect();
        Ok((dmd.real_modes().clone(), weights))
    }

    fn train(&mut self, set: &TrainingSet) -> Result<Som, CompressionError> {
        let map = Som::fit(set.rows(), &self.config.som)?;
        self.report.quantisation_error = Some(map.quantisation_error(set.rows())?);
        self.report.topographic_error = Some(map.topographic_error(set.rows())?);
        Ok(map)
    }

    fn map_points(
        &mut self,
        modes: &Matrix,
        weights: &[f64],
    ) -> Result<Vec<usize>, CompressionError> {
        let set = TrainingSet::new(modes, weights, self.config.scaling);
        let map = self.train(&set)?;
        let wanted: Vec<f64> = match self.config.point_rule {
            PointRule::WeightLocation => {
                map.weights().column(0).iter().map(|&scaled| set.location_of(scaled)).collect()
            }
            PointRule::NearestRow => nearest_rows(&map, set.rows()),
        };
        let (chosen, moved) = distinct_locations(&wanted, set.rows().rows());
        self.report.points_moved = moved;
        Ok(chosen)
    }

    fn regress(&self) -> Result<Sensitivities, CompressionError> {
        let parameters = self.data.parameters.ok_or(CompressionError::NoParameters)?;
        Ok(Sensitivities::regress(self.data.snapshots, parameters, self.config.regression)?)
    }

    fn greedy(&self, optimality: Optimality) -> Result<Vec<usize>, CompressionError> {
        let directions = self.regress()?.directions();
        if let Some(noise) = self.data.noise
            && noise.size() != directions.rows()
        {
            let (found, expected) = (noise.size(), directions.rows());
            return Err(NoiseError::Size { found, expected }.into());
        }
        Ok(placement::greedy(&directions, self.data.noise, self.config.count, optimality))
    }

    /// `D = M·(E·M)⁺` with `M` the leading centred modes, as many as are
    /// encoded at most.
    fn decoder(&self, encoder: &Encoder) -> Result<Matrix, CompressionError> {
        let modes = self.modes.left().leading_columns(encoder.len());
        let weights = encoder.weights(self.mean.len());
        let seen = weights.transposed_times(&modes);
        let identity = Matrix::raw(
            encoder.len(),
            encoder.len(),
            (0..encoder.len().pow(2))
                .map(|at| f64::from(u8::from(at % (encoder.len() + 1) == 0)))
                .collect(),
        );
        Ok(modes.times(&decomposition::least_squares(&seen, &identity)?))
    }
}

fn uses_map(encoding: Encoding) -> bool {
    matches!(
        encoding,
        Encoding::ClusterMeans | Encoding::Points(Placement::DmdSom | Placement::PodSom)
    )
}

fn checked_order(order: &SnapshotOrder, snapshots: usize) -> Result<Vec<usize>, CompressionError> {
    let identity: Vec<usize> = (0..snapshots).collect();
    match order {
        SnapshotOrder::AsGiven => Ok(identity),
        SnapshotOrder::Permuted(order) => {
            let mut sorted = order.clone();
            sorted.sort_unstable();
            if sorted == identity {
                Ok(order.clone())
            } else {
                Err(CompressionError::Order { snapshots })
            }
        }
    }
}

/// Tells whether what the mean leaves is no more than the rounding of the mean.
fn varies_only_by_rounding(centred: &Snapshots, snapshots: &Snapshots) -> bool {
    let rounding = snapshots.count() as f64 * f64::EPSILON;
    centred.matrix().frobenius_norm() <= rounding * snapshots.matrix().frobenius_norm()
}

/// The row nearest to each weight vector.
fn nearest_rows(map: &Som, rows: &Matrix) -> Vec<f64> {
    let points: Vec<Vec<f64>> = (0..rows.rows()).map(|row| rows.row(row)).collect();
    (0..map.grid().neurons())
        .map(|neuron| {
            let weight = map.weights().row(neuron);
            let distance = |point: &[f64]| -> f64 {
                point.iter().zip(&weight).map(|(a, b)| (a - b).powi(2)).sum()
            };
            let nearest = (0..points.len())
                .min_by(|&a, &b| distance(&points[a]).total_cmp(&distance(&points[b])));
            nearest.unwrap_or(0) as f64
        })
        .collect()
}

/// The nearest free location to each wanted one, in turn, and how many were
/// not free; the lower one in a tie.
fn distinct_locations(wanted: &[f64], locations: usize) -> (Vec<usize>, usize) {
    let mut taken = vec![false; locations];
    let mut moved = 0;
    let chosen = wanted
        .iter()
        .map(|&place| {
            let nearest = (place.round() as usize).min(locations - 1);
            let free = (0..locations)
                .filter(|&at| !taken[at])
                .min_by(|&a, &b| (a as f64 - place).abs().total_cmp(&(b as f64 - place).abs()))
                .unwrap_or(nearest);
            moved += usize::from(taken[nearest]);
            taken[free] = true;
            free
        })
        .collect();
    (chosen, moved)
}
