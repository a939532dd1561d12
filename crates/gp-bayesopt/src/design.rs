//! Designs: where to look before anything is known.

use crate::{
    bounds::Bounds,
    error::DesignError,
    random::{Purpose, Stream},
    sobol::Sobol,
};

/// A rule that spreads points over a box.
///
/// # Examples
///
/// ```
/// use gp_bayesopt::{Bounds, Design};
///
/// let bounds = Bounds::unit(3)?;
/// let points = Design::LatinHypercube.points(&bounds, 5, 1)?;
/// let mut rows: Vec<usize> = points.iter().map(|p| (p[0] * 5.0) as usize).collect();
/// rows.sort_unstable();
/// assert_eq!(rows, [0, 1, 2, 3, 4]); // one point in each fifth
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Design {
    /// One point in each of `n` equal slices of every input.
    ///
    /// Source: M. D. `McKay`, Beckman, Conover, Technometrics 21 (1979) 239.
    LatinHypercube,
    /// A Latin hypercube whose fractions are raised to a power, `u^p`: with
    /// `p > 1` denser near the lower limits, with `p = 1` unchanged.
    ///
    /// The FREEDOM paper draws its reference faults from a "modified scaled"
    /// Latin hypercube and prints no formula; this form is ours.
    ScaledLatinHypercube {
        /// One exponent for each input.
        exponents: Vec<f64>,
    },
    /// The Sobol' sequence, scrambled by random lower-triangular bit matrices
    /// and shifted digitally. The seed picks the scrambling.
    ///
    /// Source: Joe and Kuo, SIAM J. Sci. Comput. 30 (2008) 2635; Matoušek,
    /// J. Complexity 14 (1998) 527.
    Sobol,
}

impl Design {
    /// `count` points of the box.
    ///
    /// # Errors
    /// [`DesignError::Exponents`], [`DesignError::TooManyInputs`] (Sobol' reaches 21 inputs),
    /// [`DesignError::TooManyPoints`] (2³² Sobol' points).
    pub fn points(
        &self,
        bounds: &Bounds,
        count: usize,
        seed: u64,
    ) -> Result<Vec<Vec<f64>>, DesignError> {
        let unit = self.unit_points(bounds.dimension(), count, seed)?;
        Ok(unit.iter().map(|u| bounds.at_unit(u)).collect())
    }

    /// `count` points of the unit cube.
    fn unit_points(
        &self,
        dimension: usize,
        count: usize,
        seed: u64,
    ) -> Result<Vec<Vec<f64>>, DesignError> {
        match self {
            Self::LatinHypercube => Ok(latin_hypercube(dimension, count, seed)),
            Self::ScaledLatinHypercube { exponents } => {
                if exponents.len() != dimension
                    || exponents.iter().any(|p| !(p.is_finite() && *p > 0.0))
                {
                    let found = exponents.len();
                    return Err(DesignError::Exponents { expected: dimension, found });
                }
                let mut points = latin_hypercube(dimension, count, seed);
                for point in &mut points {
                    for (u, &p) in point.iter_mut().zip(exponents) {
                        *u = libm::pow(*u, p);
                    }
                }
                Ok(points)
            }
            Self::Sobol => {
                let supported = u32::MAX as usize;
                if count > supported {
                    return Err(DesignError::TooManyPoints { supported, found: count });
                }
                let mut sobol = Sobol::scrambled(dimension, seed)?;
                Ok((0..count).map(|_| sobol.next_point()).collect())
            }
        }
    }
}

/// One point in each slice of every input, at a random place in its slice.
fn latin_hypercube(dimension: usize, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut points = vec![vec![0.0; dimension]; count];
    for input in 0..dimension {
        let mut stream = Stream::new(seed, Purpose::Design, input as u64);
        let order = stream.permutation(count);
        for (point, slice) in points.iter_mut().zip(order) {
            point[input] = (slice as f64 + stream.uniform()) / count as f64;
        }
    }
    points
}
