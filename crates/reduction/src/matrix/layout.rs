//! A matrix as serialised data.

use serde::{Deserialize, Serialize};

use super::{Matrix, MatrixError};

/// Shape and values, column after column.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Layout {
    rows: usize,
    columns: usize,
    values: Vec<f64>,
}

impl From<Matrix> for Layout {
    fn from(Matrix { rows, columns, values }: Matrix) -> Self {
        Self { rows, columns, values }
    }
}

impl TryFrom<Layout> for Matrix {
    type Error = MatrixError;

    fn try_from(Layout { rows, columns, values }: Layout) -> Result<Self, MatrixError> {
        Self::from_column_major(rows, columns, values)
    }
}
