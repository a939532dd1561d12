use crate::CompressionMap;

/// Kept locations on the first mode of the training snapshots, and how they lie
/// to its extrema: the data of the FREEDOM paper's figure 5.
///
/// # Examples
///
/// ```
/// use reduction::ModeFigure;
///
/// // Three periods of a sine, the points on its six extrema.
/// let mode: Vec<f64> = (0..=120).map(|i| (i as f64 * 0.05 * std::f64::consts::PI).sin()).collect();
/// let figure = ModeFigure::new(mode, vec![10, 30, 50, 70, 90, 110], 0.05);
/// assert_eq!(figure.extrema, [10, 30, 50, 70, 90, 110]);
/// assert_eq!(figure.mean_distance_to_extremum(), 0.0);
/// assert!((figure.mean_distance_by_chance() - 610.0 / 121.0).abs() < 1e-12);
/// assert_eq!(figure.extrema_covered(2), 1.0);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ModeFigure {
    /// Value of the mode at each location, unit Euclidean norm.
    pub mode: Vec<f64>,
    /// Kept locations, increasing.
    pub points: Vec<usize>,
    /// Local extrema that stand out, increasing.
    pub extrema: Vec<usize>,
}

impl ModeFigure {
    /// Joins a mode and the points on it. Extrema are those that rise above the
    /// turns beside them by at least `prominence_ratio` of the mode's range.
    ///
    /// # Panics
    ///
    /// If a point lies outside the mode.
    pub fn new(mode: Vec<f64>, points: Vec<usize>, prominence_ratio: f64) -> Self {
        assert!(points.iter().all(|&at| at < mode.len()), "a point lies outside the mode");
        let extrema = prominent_extrema(&mode, prominence_ratio);
        Self { mode, points, extrema }
    }

    /// The figure of a map, if it keeps locations.
    pub fn of(map: &CompressionMap, prominence_ratio: f64) -> Option<Self> {
        let points = map.locations()?.to_vec();
        Some(Self::new(map.parts().first_mode.clone(), points, prominence_ratio))
    }

    /// Mean distance of the points to the nearest extremum, in locations; 0
    /// without an extremum.
    pub fn mean_distance_to_extremum(&self) -> f64 {
        self.mean_distance(self.points.iter().copied())
    }

    /// Mean distance to the nearest extremum over all locations, in locations; that of points by chance.
    pub fn mean_distance_by_chance(&self) -> f64 {
        self.mean_distance(0..self.mode.len())
    }

    /// Fraction of the extrema with a point at most `reach` locations away; 1
    /// without an extremum.
    pub fn extrema_covered(&self, reach: usize) -> f64 {
        if self.extrema.is_empty() {
            return 1.0;
        }
        let near = |at: usize| self.points.iter().any(|&point| point.abs_diff(at) <= reach);
        let covered = self.extrema.iter().filter(|&&at| near(at)).count();
        covered as f64 / self.extrema.len() as f64
    }

    fn mean_distance(&self, locations: impl Iterator<Item = usize>) -> f64 {
        let (mut total, mut count) = (0.0, 0.0_f64);
        for location in locations {
            let nearest = self.extrema.iter().map(|&at| at.abs_diff(location)).min();
            total += nearest.unwrap_or(0) as f64;
            count += 1.0;
        }
        total / count.max(1.0)
    }
}

/// Turning points after swings of at least `ratio` of the range.
fn prominent_extrema(values: &[f64], ratio: f64) -> Vec<usize> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let swing = (ratio * (high - low)).max(f64::MIN_POSITIVE);
    let mut extrema = Vec::new();
    // Candidates for the next maximum and minimum, and which is looked for:
    // 1 a maximum, −1 a minimum, 0 either.
    let (mut top, mut bottom, mut sought) = (0, 0, 0);
    for at in 1..values.len() {
        if values[at] > values[top] {
            top = at;
        }
        if values[at] < values[bottom] {
            bottom = at;
        }
        if sought >= 0 && values[top] - values[at] >= swing {
            if top > 0 {
                extrema.push(top);
            }
            (bottom, sought) = (at, -1);
        } else if sought <= 0 && values[at] - values[bottom] >= swing {
            if bottom > 0 {
                extrema.push(bottom);
            }
            (top, sought) = (at, 1);
        }
        if sought < 0 {
            top = at;
        } else if sought > 0 {
            bottom = at;
        }
    }
    extrema
}
