use super::{Som, SomError, Weights};
use crate::Matrix;

impl Som {
    /// Mean distance of the samples to their winners.
    ///
    /// # Errors
    ///
    /// [`SomError::Features`].
    pub fn quantisation_error(&self, samples: &Matrix) -> Result<f64, SomError> {
        let total: f64 = self.two_nearest(samples)?.iter().map(|near| near.distance).sum();
        Ok(total / samples.rows() as f64)
    }

    /// Fraction of the samples whose two nearest neurons do not touch; 0 on a
    /// map of one neuron.
    ///
    /// # Errors
    ///
    /// [`SomError::Features`].
    pub fn topographic_error(&self, samples: &Matrix) -> Result<f64, SomError> {
        let torn = self
            .two_nearest(samples)?
            .iter()
            .filter(|near| {
                near.second.is_some_and(|second| !self.grid.adjacent(near.first, second))
            })
            .count();
        Ok(torn as f64 / samples.rows() as f64)
    }

    /// Mean distance of each weight vector to those of the touching neurons; 0
    /// on a map of one neuron.
    pub fn u_matrix(&self) -> Vec<f64> {
        let neurons = self.grid.neurons();
        let rows: Vec<Vec<f64>> = (0..neurons).map(|neuron| self.weights.row(neuron)).collect();
        let distance = |one: usize, other: usize| {
            let differences = rows[one].iter().zip(&rows[other]).map(|(a, b)| (a - b).powi(2));
            differences.sum::<f64>().sqrt()
        };
        (0..neurons)
            .map(|neuron| {
                let touching: Vec<f64> = (0..neurons)
                    .filter(|&other| self.grid.adjacent(neuron, other))
                    .map(|other| distance(neuron, other))
                    .collect();
                touching.iter().sum::<f64>() / touching.len().max(1) as f64
            })
            .collect()
    }

    fn two_nearest(&self, samples: &Matrix) -> Result<Vec<Nearest>, SomError> {
        self.check_features(samples)?;
        let mut weights = Weights::new(self.grid.neurons(), self.weights.values());
        let rows = samples.transposed();
        Ok((0..rows.columns())
            .map(|row| Nearest::of(weights.distances_squared(rows.column(row))))
            .collect())
    }
}

struct Nearest {
    first: usize,
    second: Option<usize>,
    distance: f64,
}

impl Nearest {
    fn of(distances_squared: &[f64]) -> Self {
        let mut first = 0;
        let mut second = None;
        for (index, distance) in distances_squared.iter().enumerate().skip(1) {
            if *distance < distances_squared[first] {
                second = Some(first);
                first = index;
            } else if second.is_none_or(|other: usize| *distance < distances_squared[other]) {
                second = Some(index);
            }
        }
        Self { first, second, distance: distances_squared[first].sqrt() }
    }
}
