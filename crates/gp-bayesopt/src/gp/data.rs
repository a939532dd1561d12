//! Observations in the form that fitting works on.

use crate::{bounds::Bounds, error::FitError, features::Features, matrix::Matrix};

/// Points as features and outputs as standardised columns.
#[derive(Clone, Debug)]
pub(super) struct Data {
    /// Points of the unit cube.
    pub(super) unit: Vec<Vec<f64>>,
    /// Features of each point.
    pub(super) features: Vec<Vec<f64>>,
    /// Standardised outputs, one contiguous column after another.
    pub(super) columns: Vec<f64>,
    /// Raw outputs, points × outputs.
    pub(super) raw: Vec<Vec<f64>>,
    /// Centre and half-range of each output.
    pub(super) scaling: Vec<Scaling>,
}

/// The affine map of one output to `[−1, 1]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scaling {
    pub(super) centre: f64,
    /// Half-range; zero for an output that never varied.
    pub(super) spread: f64,
}

impl Scaling {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (v.min(l), v.max(h)));
        // halves first: the difference of huge numbers must not overflow
        let spread = 0.5 * high - 0.5 * low;
        let noise = f64::EPSILON * low.abs().max(high.abs());
        Self { centre: 0.5 * low + 0.5 * high, spread: if spread > noise { spread } else { 0.0 } }
    }

    fn standardise(self, value: f64) -> f64 {
        if self.spread == 0.0 { 0.0 } else { (value - self.centre) / self.spread }
    }
}

impl Data {
    /// Checks and standardises.
    pub(super) fn new(
        bounds: &Bounds,
        features: &Features,
        points: &[Vec<f64>],
        outputs: &Matrix,
    ) -> Result<Self, FitError> {
        if points.is_empty() {
            return Err(FitError::NoObservations);
        }
        if points.len() != outputs.rows() {
            let (points, observations) = (points.len(), outputs.rows());
            return Err(FitError::CountMismatch { points, observations });
        }
        for (point, x) in points.iter().enumerate() {
            bounds.check(x).map_err(|source| FitError::Point { point, source })?;
        }
        for observation in 0..outputs.rows() {
            check_finite(observation, outputs.row(observation))?;
        }
        let unit: Vec<Vec<f64>> = points.iter().map(|x| bounds.to_unit(x)).collect();
        let raw: Vec<Vec<f64>> = (0..outputs.rows()).map(|i| outputs.row(i).to_vec()).collect();
        Ok(Self::from_unit(features, unit, raw))
    }

    /// Standardises checked observations at points of the unit cube.
    pub(super) fn from_unit(features: &Features, unit: Vec<Vec<f64>>, raw: Vec<Vec<f64>>) -> Self {
        let outputs = raw.first().map_or(0, Vec::len);
        let scaling = (0..outputs).map(|o| Scaling::of(raw.iter().map(|row| row[o]))).collect();
        let features = unit.iter().map(|u| features.of(u)).collect();
        let mut data = Self { unit, features, columns: Vec::new(), raw, scaling };
        data.standardise();
        data
    }

    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.raw.len()
    }

    /// Number of outputs.
    pub(super) fn outputs(&self) -> usize {
        self.scaling.len()
    }

    /// Adds one observation, keeping the scaling.
    pub(super) fn push(&mut self, unit: Vec<f64>, features: Vec<f64>, outputs: &[f64]) {
        self.unit.push(unit);
        self.features.push(features);
        self.raw.push(outputs.to_vec());
        self.standardise();
    }

    /// The observations of some points, with the same scaling.
    pub(super) fn subset(&self, keep: &[usize]) -> Self {
        let pick = |rows: &[Vec<f64>]| keep.iter().map(|&i| rows[i].clone()).collect();
        let mut part = Self {
            unit: pick(&self.unit),
            features: pick(&self.features),
            columns: Vec::new(),
            raw: pick(&self.raw),
            scaling: self.scaling.clone(),
        };
        part.standardise();
        part
    }

    fn standardise(&mut self) {
        self.columns = (0..self.outputs())
            .flat_map(|o| self.raw.iter().map(move |row| (o, row[o])))
            .map(|(o, v)| self.scaling[o].standardise(v))
            .collect();
    }
}

/// Refuses NaN and infinities.
pub(super) fn check_finite(observation: usize, outputs: &[f64]) -> Result<(), FitError> {
    match outputs.iter().find(|v| !v.is_finite()) {
        Some(&value) => Err(FitError::NotFinite { observation, value }),
        None => Ok(()),
    }
}
