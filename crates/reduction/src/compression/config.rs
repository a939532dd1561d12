use crate::{
    DmdConfig, Matrix, NoiseCovariance, Regression, Snapshots, SomConfig, TrainingScaling,
};

/// Kind of numbers that are kept of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Encoding {
    /// Values at chosen locations; [`Placement::DmdSom`] is the paper's.
    Points(Placement),
    /// The mean over the locations of each neuron of the dynamic-mode map.
    /// Neurons that win no location are left out.
    ClusterMeans,
    /// Coordinates in the span of the dynamic modes, by an orthonormal basis of
    /// it: the first of the paper's two steps without the second. As many as
    /// [`CompressionConfig::dmd`] keeps, whatever the count.
    DynamicModes,
    /// Coordinates in the leading singular modes of the centred snapshots, of
    /// the noise-whitened ones where a noise covariance is given.
    Modes,
    /// Coordinates in the directions in which the parameters move the signal,
    /// regressed from the snapshots and weighed by the noise: nothing of what
    /// the regression knows about the parameters is lost. Needs parameters.
    Sensitivities,
}

/// How the locations of [`Encoding::Points`] are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Placement {
    /// Dynamic modes and a self-organising map (FREEDOM paper, section II.A).
    DmdSom,
    /// Singular modes of the centred snapshots and a self-organising map
    /// (Mainini, Willcox, AIAA J. 53(6), 2015, in that order of steps).
    PodSom,
    /// Pivots of a QR factorisation of the singular modes.
    Qdeim,
    /// Greedily the least sum of variances of the parameters, each in units of
    /// its spread over the snapshots. Needs parameters.
    GreedyAOptimal,
    /// Greedily the least volume of the parameters' confidence region. Needs
    /// parameters.
    GreedyDOptimal,
    /// Equal steps.
    Uniform,
    /// By chance.
    Random,
}

/// Which location a neuron stands for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum PointRule {
    /// The location component of its weight vector, as in the FREEDOM paper.
    #[default]
    WeightLocation,
    /// The location whose row of the training set is nearest to its weight
    /// vector.
    NearestRow,
}

/// Order in which dynamic mode decomposition reads the snapshots.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum SnapshotOrder {
    /// As the columns come.
    #[default]
    AsGiven,
    /// These columns in turn, each once.
    Permuted(Vec<usize>),
}

/// Settings of a [`CompressionMap`](super::CompressionMap).
#[derive(Clone, Debug, PartialEq)]
pub struct CompressionConfig {
    /// Kind of numbers that are kept.
    pub encoding: Encoding,
    /// How many numbers to keep, `n_w` of the paper; [`Encoding::Modes`] and
    /// [`Encoding::Sensitivities`] keep fewer when there are not as many
    /// directions.
    pub count: usize,
    /// Dynamic modes, where the encoding rests on them.
    pub dmd: DmdConfig,
    /// The map, where the encoding rests on one; as many neurons as `count`.
    pub som: SomConfig,
    /// Scaling of the map's training set.
    pub scaling: TrainingScaling,
    /// Which location a neuron stands for.
    pub point_rule: PointRule,
    /// Order in which dynamic mode decomposition reads the snapshots.
    pub order: SnapshotOrder,
    /// Polynomial for sensitivities.
    pub regression: Regression,
    /// Seed of [`Placement::Random`]; the map has its own.
    pub seed: u64,
}

impl Default for CompressionConfig {
    /// The paper's compression: 30 points from 30 dynamic modes.
    fn default() -> Self {
        Self {
            encoding: Encoding::Points(Placement::DmdSom),
            count: 30,
            dmd: DmdConfig::default(),
            som: SomConfig::default(),
            scaling: TrainingScaling::default(),
            point_rule: PointRule::default(),
            order: SnapshotOrder::default(),
            regression: Regression::default(),
            seed: 0,
        }
    }
}

/// Data that a map is fitted to.
#[derive(Clone, Copy, Debug)]
pub struct TrainingData<'a> {
    pub(super) snapshots: &'a Snapshots,
    pub(super) parameters: Option<&'a Matrix>,
    pub(super) noise: Option<&'a NoiseCovariance>,
}

impl<'a> TrainingData<'a> {
    /// Snapshots alone.
    pub fn new(snapshots: &'a Snapshots) -> Self {
        Self { snapshots, parameters: None, noise: None }
    }

    /// Adds the parameters that the snapshots were taken at, one row a snapshot.
    #[must_use]
    pub fn with_parameters(self, parameters: &'a Matrix) -> Self {
        Self { parameters: Some(parameters), ..self }
    }

    /// Adds the covariance of the noise that signals will carry.
    #[must_use]
    pub fn with_noise(self, noise: &'a NoiseCovariance) -> Self {
        Self { noise: Some(noise), ..self }
    }
}

impl<'a> From<&'a Snapshots> for TrainingData<'a> {
    fn from(snapshots: &'a Snapshots) -> Self {
        Self::new(snapshots)
    }
}
