use rand_chacha::ChaCha8Rng;

use super::{Grid, SomError, shuffle};
use crate::{Matrix, Snapshots, thin_svd};

/// Weights that training starts from.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum SomStart {
    /// Different samples, drawn without replacement.
    #[default]
    RandomSamples,
    /// A plane grid of one standard deviation to either side of the mean along
    /// the two first principal axes (the longer side of the grid along the
    /// first), which needs no chance.
    PrincipalAxes,
    /// These, one neuron a row.
    Given(Matrix),
}

impl SomStart {
    pub(super) fn weights(
        &self,
        samples: &Matrix,
        grid: Grid,
        random: &mut ChaCha8Rng,
    ) -> Result<Matrix, SomError> {
        match self {
            Self::RandomSamples => {
                let mut rows: Vec<usize> = (0..samples.rows()).collect();
                shuffle(&mut rows, random);
                Ok(gather(samples, &rows[..grid.neurons()]))
            }
            Self::PrincipalAxes => principal_plane(samples, grid),
            Self::Given(weights) => {
                let (neurons, features) = (grid.neurons(), samples.columns());
                if (weights.rows(), weights.columns()) != (neurons, features) {
                    return Err(SomError::StartShape {
                        found_neurons: weights.rows(),
                        found_features: weights.columns(),
                        neurons,
                        features,
                    });
                }
                Ok(weights.clone())
            }
        }
    }
}

fn gather(samples: &Matrix, rows: &[usize]) -> Matrix {
    let values = (0..samples.columns())
        .flat_map(|column| rows.iter().map(move |&row| samples.get(row, column)))
        .collect();
    Matrix::raw(rows.len(), samples.columns(), values)
}

fn principal_plane(samples: &Matrix, grid: Grid) -> Result<Matrix, SomError> {
    let columns = Snapshots::from(samples.transposed());
    let mean = columns.mean();
    let svd = thin_svd(&columns.less(&mean)).map_err(SomError::Axes)?;
    let scale = (samples.rows() as f64).sqrt();
    let axis = |index: usize| -> Vec<f64> {
        if index < svd.singular_values().len() {
            let deviation = svd.singular_values()[index] / scale;
            svd.left().column(index).iter().map(|value| value * deviation).collect()
        } else {
            vec![0.0; mean.len()]
        }
    };
    let (along_rows, along_columns) =
        if grid.rows >= grid.columns { (axis(0), axis(1)) } else { (axis(1), axis(0)) };
    let mut weights = Matrix::zeros(grid.neurons(), mean.len());
    for neuron in 0..grid.neurons() {
        let row = centred(neuron / grid.columns, grid.rows);
        let column = centred(neuron % grid.columns, grid.columns);
        for feature in 0..mean.len() {
            let value = mean[feature] + row * along_rows[feature] + column * along_columns[feature];
            weights.set(neuron, feature, value);
        }
    }
    Ok(weights)
}

/// Place of `index` among `count` on [−1, 1]; the middle when it is alone.
fn centred(index: usize, count: usize) -> f64 {
    if count < 2 { 0.0 } else { 2.0 * index as f64 / (count - 1) as f64 - 1.0 }
}
