/// How the neurons of a map lie beside one another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Topology {
    /// Square cells; up to eight neighbours, diagonals included.
    #[default]
    Rectangular,
    /// Hexagonal cells, odd rows shifted by half a cell; up to six neighbours.
    Hexagonal,
}

/// The two-dimensional arrangement of the neurons.
///
/// Neuron `row·columns + column` lies at that row and column. Neighbours in a
/// row are at distance 1; in a hexagonal grid all six are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Rows of neurons.
    pub rows: usize,
    /// Columns of neurons.
    pub columns: usize,
    /// Shape of the cells.
    pub topology: Topology,
}

impl Grid {
    /// A grid of square cells.
    pub const fn rectangular(rows: usize, columns: usize) -> Self {
        Self { rows, columns, topology: Topology::Rectangular }
    }

    /// A grid of hexagonal cells.
    pub const fn hexagonal(rows: usize, columns: usize) -> Self {
        Self { rows, columns, topology: Topology::Hexagonal }
    }

    /// Number of neurons.
    pub const fn neurons(&self) -> usize {
        self.rows * self.columns
    }

    /// Position of a neuron in the plane, in cells.
    pub fn position(&self, neuron: usize) -> [f64; 2] {
        let (row, column) = (neuron / self.columns, neuron % self.columns);
        match self.topology {
            Topology::Rectangular => [column as f64, row as f64],
            Topology::Hexagonal => {
                let shift = if row % 2 == 1 { 0.5 } else { 0.0 };
                [column as f64 + shift, row as f64 * 0.75_f64.sqrt()]
            }
        }
    }

    /// Squared distance of two neurons in the plane, in cells.
    pub fn distance_squared(&self, one: usize, other: usize) -> f64 {
        let (one, other) = (self.position(one), self.position(other));
        (one[0] - other[0]).powi(2) + (one[1] - other[1]).powi(2)
    }

    /// Tells whether two different neurons touch.
    pub fn adjacent(&self, one: usize, other: usize) -> bool {
        // Between the farthest neighbour and the nearest stranger: √2 and 2
        // cells in the rectangular grid, 1 and √3 in the hexagonal one.
        let limit = match self.topology {
            Topology::Rectangular => 3.0,
            Topology::Hexagonal => 2.0,
        };
        one != other && self.distance_squared(one, other) < limit
    }
}

#[cfg(test)]
mod tests {
    use super::Grid;

    fn neighbours(grid: Grid, neuron: usize) -> usize {
        (0..grid.neurons()).filter(|&other| grid.adjacent(neuron, other)).count()
    }

    #[test]
    fn inner_neurons_have_eight_or_six_neighbours() {
        assert_eq!(neighbours(Grid::rectangular(5, 5), 12), 8);
        assert_eq!(neighbours(Grid::hexagonal(5, 5), 12), 6);
        assert_eq!(neighbours(Grid::hexagonal(5, 5), 7), 6);
        assert_eq!(neighbours(Grid::rectangular(5, 5), 0), 3);
        assert_eq!(neighbours(Grid::rectangular(1, 4), 3), 1);
    }
}
