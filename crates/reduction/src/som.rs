//! Self-organising map.

mod epoch;
mod grid;
mod kernel;
mod quality;
mod schedule;
mod start;

use rand::RngExt;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

use crate::{Matrix, SvdError};
use epoch::{OnlineEpoch, Samples, batch_epoch};
use kernel::Weights;

pub use grid::{Grid, Topology};
pub use schedule::{Decay, Schedule};
pub use start::SomStart;

/// Why a map could not be trained.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SomError {
    /// A grid without neurons.
    #[error("grid of {rows} by {columns} has no neuron")]
    NoNeurons {
        /// Rows of the grid.
        rows: usize,
        /// Columns of the grid.
        columns: usize,
    },
    /// More neurons than samples.
    #[error("{neurons} neurons for {samples} samples")]
    MoreNeuronsThanSamples {
        /// Neurons of the grid.
        neurons: usize,
        /// Samples given.
        samples: usize,
    },
    /// No epoch.
    #[error("0 epochs asked for")]
    NoEpochs,
    /// A learning rate outside (0, 1].
    #[error("learning rate {found} is not in (0, 1]")]
    LearningRate {
        /// The rate given.
        found: f64,
    },
    /// A neighbourhood radius that is not positive.
    #[error("neighbourhood radius starting at {found} cells is not positive throughout")]
    Radius {
        /// The radius that the schedule starts with, in cells.
        found: f64,
    },
    /// Weights to start from have another shape.
    #[error(
        "{found_neurons} by {found_features} weights for {neurons} neurons and {features} features"
    )]
    StartShape {
        /// Rows of the weights given.
        found_neurons: usize,
        /// Columns of the weights given.
        found_features: usize,
        /// Neurons of the grid.
        neurons: usize,
        /// Features of the samples.
        features: usize,
    },
    /// Principal axes to start from could not be had.
    #[error("principal axes of the samples not found")]
    Axes(#[source] SvdError),
    /// A sample with another number of features than the map.
    #[error("{found} features where the map has {expected}")]
    Features {
        /// Features given.
        found: usize,
        /// Features of the map.
        expected: usize,
    },
}

/// How the weights follow the samples.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Training {
    /// After each sample, `w_j += α·h_lj·(τ − w_j)` (the FREEDOM paper's).
    Online {
        /// Learning rate `α`, in (0, 1].
        rate: Schedule,
        /// In which order an epoch presents the samples.
        order: SampleOrder,
    },
    /// After each epoch, `w_j = Σ_i h_{l(i)j}·τ_i ÷ Σ_i h_{l(i)j}`.
    Batch,
}

/// In which order an epoch of online training presents the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum SampleOrder {
    /// Shuffled anew for every epoch, as in the FREEDOM paper.
    #[default]
    Shuffled,
    /// As the rows come.
    AsGiven,
}

/// Settings of a [`Som`].
#[derive(Clone, Debug, PartialEq)]
pub struct SomConfig {
    /// Arrangement of the neurons.
    pub grid: Grid,
    /// Weights to start from.
    pub start: SomStart,
    /// How the weights follow the samples.
    pub training: Training,
    /// Width `s` of the neighbourhood `h_lj = exp(−d_lj²/(2s²))`, in cells.
    pub radius: Schedule,
    /// Times that all samples are presented.
    pub epochs: usize,
    /// Seed of the start and of the shuffling.
    pub seed: u64,
}

impl Default for SomConfig {
    /// Online training of 6 × 5 square cells from random samples: 100 epochs,
    /// rate 0.5 and radius 1.5 cells, both falling to a third. The paper states
    /// the 30 neurons and the shuffling; the rest is a choice of this project.
    fn default() -> Self {
        Self {
            grid: Grid::rectangular(6, 5),
            start: SomStart::RandomSamples,
            training: Training::Online {
                rate: Schedule::inverse(0.5),
                order: SampleOrder::Shuffled,
            },
            radius: Schedule::inverse(1.5),
            epochs: 100,
            seed: 0,
        }
    }
}

/// A trained self-organising map.
///
/// ```text
/// l = arg min_j ‖τ − w_j‖
/// ```
///
/// Schedules advance with the epoch. The winner of a tie is the neuron of
/// lowest index. The same samples and configuration give the same bits.
///
/// # Source
///
/// FREEDOM paper, eq. 5; Kohonen, Neural Networks 37, 2013 (both trainings).
///
/// # Examples
///
/// ```
/// use reduction::{Grid, Matrix, Som, SomConfig};
///
/// let line = Matrix::from_fn(100, 1, |row, _| row as f64 / 99.0)?;
/// let config = SomConfig { grid: Grid::rectangular(1, 4), ..SomConfig::default() };
/// let map = Som::fit(&line, &config)?;
/// assert!(map.quantisation_error(&line)? < 0.1);
/// assert_eq!(map.topographic_error(&line)?, 0.0);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Som {
    grid: Grid,
    weights: Matrix,
}

impl Som {
    /// Trains a map on samples, one a row.
    ///
    /// # Errors
    ///
    /// Each [`SomError`] but [`Features`](SomError::Features) for what it names.
    ///
    /// # Cost
    ///
    /// `6·n·p·k` operations an epoch of online training of `n` samples of `p`
    /// features on `k` neurons, `3·n·p·k` of batch training.
    pub fn fit(samples: &Matrix, config: &SomConfig) -> Result<Self, SomError> {
        config.check(samples)?;
        let mut random = ChaCha8Rng::seed_from_u64(config.seed);
        let start = config.start.weights(samples, config.grid, &mut random)?;
        let mut weights = Weights::new(config.grid.neurons(), start.values());
        let features = samples.columns();
        // One sample after another, as the kernels read them.
        let samples = samples.transposed().into_values();
        let samples = Samples { values: &samples, features };
        let mut queue: Vec<usize> = (0..samples.values.len() / features).collect();
        for epoch in 0..config.epochs {
            match config.training {
                Training::Online { rate, order } => {
                    if order == SampleOrder::Shuffled {
                        shuffle(&mut queue, &mut random);
                    }
                    let rate = rate.at(epoch, config.epochs);
                    let shares = &config.shares(epoch, rate, weights.padded());
                    OnlineEpoch { weights: &mut weights, samples, queue: &queue, shares }.run();
                }
                Training::Batch => {
                    let shares = config.shares(epoch, 1.0, weights.padded());
                    batch_epoch(&mut weights, samples, config.grid, &shares);
                }
            }
        }
        let weights = Matrix::raw(config.grid.neurons(), features, weights.by_feature());
        Ok(Self { grid: config.grid, weights })
    }

    /// Arrangement of the neurons.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Weight vectors, one a row.
    pub fn weights(&self) -> &Matrix {
        &self.weights
    }

    /// Nearest neuron of each sample, one a row.
    ///
    /// # Errors
    ///
    /// [`SomError::Features`].
    pub fn winners(&self, samples: &Matrix) -> Result<Vec<usize>, SomError> {
        self.check_features(samples)?;
        let mut weights = Weights::new(self.grid.neurons(), self.weights.values());
        let rows = samples.transposed();
        Ok((0..rows.columns()).map(|row| weights.winner(rows.column(row))).collect())
    }

    fn check_features(&self, samples: &Matrix) -> Result<(), SomError> {
        let (found, expected) = (samples.columns(), self.weights.columns());
        if found == expected { Ok(()) } else { Err(SomError::Features { found, expected }) }
    }
}

impl SomConfig {
    fn check(&self, samples: &Matrix) -> Result<(), SomError> {
        let neurons = self.grid.neurons();
        if neurons == 0 {
            return Err(SomError::NoNeurons { rows: self.grid.rows, columns: self.grid.columns });
        }
        if neurons > samples.rows() {
            return Err(SomError::MoreNeuronsThanSamples { neurons, samples: samples.rows() });
        }
        if self.epochs == 0 {
            return Err(SomError::NoEpochs);
        }
        if !self.radius.is_positive() {
            return Err(SomError::Radius { found: self.radius.start });
        }
        if let Training::Online { rate, .. } = self.training
            && !(rate.is_positive() && rate.start <= 1.0 && rate.at(1, 2) <= 1.0)
        {
            return Err(SomError::LearningRate { found: rate.start });
        }
        Ok(())
    }

    /// `rate·h_lj` for each winner `l`, padded with zeros.
    fn shares(&self, epoch: usize, rate: f64, padded: usize) -> Vec<f64> {
        let neurons = self.grid.neurons();
        let radius = self.radius.at(epoch, self.epochs);
        let mut shares = vec![0.0; neurons * padded];
        for (winner, row) in shares.chunks_exact_mut(padded).enumerate() {
            for (neuron, share) in row[..neurons].iter_mut().enumerate() {
                let distance_squared = self.grid.distance_squared(winner, neuron);
                *share = rate * (-distance_squared / (2.0 * radius * radius)).exp();
            }
        }
        shares
    }
}

/// Fisher–Yates.
pub(crate) fn shuffle(items: &mut [usize], random: &mut ChaCha8Rng) {
    for last in (1..items.len()).rev() {
        items.swap(last, random.random_range(0..=last));
    }
}
