//! Recordings of one machine in one state of health, explained together.
//!
//! ```text
//! y_r = y_LF(c, ν_r, s) + m(c, ν_r) + u + e_r + w_r        ν_r = ν + ν_session + ν_recording
//! ```
//!
//! with one damage `c`, numbers `ν_r` whose parts have the priors of their levels, numbers `s` of
//! effects that the model file does not have, that part `u` of the learnt error which recordings of
//! a unit have in common, its other part `e_r` and noise `w_r`. For alike noise the covariance of
//! the recordings has the two banded blocks
//!
//! ```text
//! Σ y_r/√n                        S·(1 + (n − 1)·ρ) + N        the mean
//! (Σ_{i<k} y_i − k·y_k)/√(k²+k)   S·(1 − ρ) + N                n − 1 differences
//! ```
//!
//! with `ρ` the share of `S` in common, so that all of them are whitened exactly.
//!
//! # Source
//!
//! Helmert contrasts: Lancaster, *The American Mathematical Monthly* 72, 1965. Hierarchical prior:
//! Gelman et al., *Bayesian Data Analysis*, 3rd ed., chapter 5; `docs/models/units.md`.

use std::sync::Arc;

use ema_sim::{Effect, SimulationError};
use inference::{
    BandedCholesky, BandedMatrix, MostProbable, NotPositiveDefinite, Unknown, Whitened,
};
use nalgebra::{DMatrix, DVector};

use crate::{
    offline::{error_model::add_scaled, factor::joined},
    unit::{
        acting::Acting,
        error::UnitError,
        joint::BuiltFit,
        layout::Layout,
        modelled::Modelled,
        search::{DAMAGE_REACH, number_unknown},
    },
};

/// Variance that a number of the machine has in each recording of its own, over its variance between
/// machines: recordings that have it wholly in common would have no factor.
const OWN_SHARE: f64 = 1e-6;

/// Recordings of one machine beside its model.
#[derive(Clone, Debug)]
pub(crate) struct Together<'a> {
    recordings: Vec<Modelled<'a>>,
    whitening: Arc<Whitening>,
    prior: Arc<NumberPrior>,
    acting: Vec<Acting>,
    /// White slopes in the unknowns at the last point asked for.
    slopes: Vec<Vec<f64>>,
}

impl<'a> Together<'a> {
    pub(crate) fn new(
        recordings: Vec<Modelled<'a>>,
        whitening: Whitening,
        prior: NumberPrior,
    ) -> Self {
        let (whitening, prior) = (Arc::new(whitening), Arc::new(prior));
        Self { recordings, whitening, prior, acting: Vec::new(), slopes: Vec::new() }
    }

    /// The recordings with effects whose numbers are looked for.
    pub(crate) fn with_acting(&self, acting: Vec<Acting>) -> Self {
        Self { acting, ..self.clone() }
    }

    pub(crate) fn with_whitening(&self, whitening: Whitening) -> Self {
        Self { whitening: Arc::new(whitening), ..self.clone() }
    }

    pub(crate) fn recordings(&self) -> &[Modelled<'a>] {
        &self.recordings
    }

    pub(crate) fn acting(&self) -> &[Acting] {
        &self.acting
    }

    /// Simulations of the low-fidelity model so far.
    pub(crate) fn evaluations(&self) -> u64 {
        self.recordings.iter().map(|one| one.evaluations).sum()
    }

    fn layout(&self) -> &Layout {
        self.recordings[0].quantities.layout()
    }

    /// Place of the first number of an effect among the unknowns.
    pub(crate) fn first_of_effects(&self) -> usize {
        let layout = self.layout();
        layout.sought.len() + self.recordings.len() * layout.numbers.len()
    }

    /// Damage, numbers of each recording, numbers of the effects.
    pub(crate) fn unknowns(&self) -> Vec<Unknown> {
        let layout = self.layout();
        let damage = layout
            .sought
            .iter()
            .map(|&coordinate| Unknown { prior_std: None, reach: DAMAGE_REACH[coordinate] });
        // the numbers' prior is among the data: recordings have a part of it in common
        let of_recording = || layout.numbers.iter().map(|number| number.scatter.together());
        let number = |std| Unknown { prior_std: None, ..number_unknown(std) };
        let numbers = self.recordings.iter().flat_map(|_| of_recording().map(number));
        let of_effects = self.acting.iter().flat_map(|one| one.unknowns(self.recordings.len()));
        damage.chain(numbers).chain(of_effects).collect()
    }

    /// Unknowns of one recording.
    pub(crate) fn point(&self, recording: usize, values: &[f64]) -> Vec<f64> {
        let layout = self.layout();
        let (damage, numbers) = (layout.sought.len(), layout.numbers.len());
        let begin = damage + recording * numbers;
        [&values[..damage], &values[begin..begin + numbers]].concat()
    }

    /// The effects as a recording has them.
    pub(crate) fn effects(&self, recording: usize, values: &[f64]) -> Vec<Effect> {
        let mut rest = &values[self.first_of_effects()..];
        let mut effects = Vec::new();
        for acting in &self.acting {
            let (own, others) = rest.split_at(acting.len(self.recordings.len()));
            effects.push(acting.effect(recording, own));
            rest = others;
        }
        effects
    }

    /// Residual of each recording, A.
    pub(crate) fn residuals_a(&mut self, values: &[f64]) -> Result<Vec<Vec<f64>>, SimulationError> {
        let mut all = Vec::new();
        for recording in 0..self.recordings.len() {
            let (point, effects) = (self.point(recording, values), self.effects(recording, values));
            let modelled = &mut self.recordings[recording];
            modelled.set_effects(&effects);
            let found = modelled.residual_a(&point);
            let samples = modelled.observed.signal_a.len();
            // a machine on which an effect of some size is none has no residual
            all.push(match found {
                Err(_) if !self.acting.is_empty() => vec![f64::NAN; samples],
                found => found?,
            });
        }
        Ok(all)
    }

    /// A row of white numbers as long as the residual, of a signal that each recording may have, A.
    pub(crate) fn white_row(&self, of_recordings: &[Option<&[f64]>]) -> Vec<f64> {
        let samples = self.recordings[0].observed.signal_a.len();
        let signals: Vec<Vec<f64>> = of_recordings
            .iter()
            .map(|signal| signal.map_or_else(|| vec![0.0; samples], <[f64]>::to_vec))
            .collect();
        let mut row = self.whitening.whiten(signals);
        row.resize(row.len() + self.readings() + self.prior.len(), 0.0);
        row
    }

    /// Thermometers that were read.
    fn readings(&self) -> usize {
        self.recordings.iter().filter(|one| one.temperature().is_some()).count()
    }

    /// White samples of the signals, without readings and priors.
    pub(crate) fn samples(&self) -> usize {
        self.recordings.iter().map(|one| one.observed.signal_a.len()).sum()
    }

    /// White slopes in the unknowns at the last point asked for.
    pub(crate) fn last_slopes(&self) -> &[Vec<f64>] {
        &self.slopes
    }

    /// Least sum of squares with its priors.
    pub(crate) fn sum(&self, found: &MostProbable) -> f64 {
        self.sum_at(&found.white, &found.numbers)
    }

    /// Points, of those given, that have a machine, the likeliest first.
    pub(crate) fn by_likelihood(&mut self, points: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let mut known = Vec::new();
        for point in points {
            let Ok(white) = self.residual(&point) else { continue };
            let sum = self.sum_at(&white, &point);
            if sum.is_finite() {
                known.push((sum, point));
            }
        }
        known.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        known.into_iter().map(|(_, point)| point).collect()
    }

    fn sum_at(&self, white: &[f64], values: &[f64]) -> f64 {
        let prior = self.unknowns().into_iter().zip(values).filter_map(|(unknown, x)| {
            let std = unknown.prior_std?;
            Some((x / std) * (x / std))
        });
        inference::dot(white, white) + prior.sum::<f64>()
    }
}

impl Whitened for Together<'_> {
    type Error = SimulationError;

    fn residual(&mut self, values: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let residuals = self.residuals_a(values)?;
        let mut white = self.whitening.whiten(residuals);
        for (recording, modelled) in self.recordings.iter().enumerate() {
            if let Some((place, reading)) = modelled.temperature() {
                let found = self.point(recording, values)[place];
                white.push((reading.away_k - found) / reading.std_k);
            }
        }
        let damage = self.layout().sought.len();
        white.extend(self.prior.residual(&values[damage..self.first_of_effects()]));
        Ok(white)
    }

    fn slopes(&mut self, values: &[f64]) -> Result<Vec<Vec<f64>>, SimulationError> {
        let (count, numbers) = (self.recordings.len(), self.layout().numbers.len());
        let damage = self.layout().sought.len();
        let mut of_machine = Vec::new();
        let mut of_effects = Vec::new();
        for recording in 0..count {
            let (point, effects) = (self.point(recording, values), self.effects(recording, values));
            let tail = values[self.first_of_effects()..].to_vec();
            let modelled = &mut self.recordings[recording];
            modelled.set_effects(&effects);
            let shown = modelled.shown_slopes(&point)?;
            of_machine.push(modelled.unknown_slopes(&point, &shown));
            of_effects.push(self.effect_slopes(recording, &point, &effects, &tail)?);
        }
        let mut rows = Vec::new();
        for place in 0..damage {
            let all: Vec<_> = of_machine.iter().map(|one| Some(&one[place][..])).collect();
            rows.push(self.white_row(&all));
        }
        let readings: Vec<usize> =
            (0..count).filter(|&one| self.recordings[one].temperature().is_some()).collect();
        let (samples, prior) = (self.samples(), self.samples() + readings.len());
        for (recording, slopes) in of_machine.iter().enumerate() {
            for number in 0..numbers {
                let mut all = vec![None; count];
                all[recording] = Some(&slopes[damage + number][..]);
                let mut row = self.white_row(&all);
                if let Some((place, reading)) = self.recordings[recording].temperature()
                    && place == damage + number
                    && let Some(nth) = readings.iter().position(|&one| one == recording)
                {
                    row[samples + nth] = 1.0 / reading.std_k;
                }
                row[prior..].copy_from_slice(&self.prior.slope(recording * numbers + number));
                rows.push(row);
            }
        }
        for number in 0..values.len() - self.first_of_effects() {
            let all: Vec<_> = of_effects.iter().map(|one| one[number].as_deref()).collect();
            rows.push(self.white_row(&all));
        }
        self.slopes.clone_from(&rows);
        Ok(rows)
    }
}

impl Together<'_> {
    /// Slopes of a recording in each number of the effects, A; `None` for a number of another
    /// recording.
    fn effect_slopes(
        &mut self,
        recording: usize,
        point: &[f64],
        effects: &[Effect],
        tail: &[f64],
    ) -> Result<Vec<Option<Vec<f64>>>, SimulationError> {
        let count = self.recordings.len();
        let mut rows = vec![None; tail.len()];
        let mut begin = 0;
        for (place, acting) in self.acting.iter().enumerate() {
            let own = &tail[begin..begin + acting.len(count)];
            for number in acting.of_recording(recording, count) {
                let [below, above] = acting.sides(number, count, own[number]);
                let mut side = |value: f64| {
                    let mut moved = own.to_vec();
                    moved[number] = value;
                    let mut effects = effects.to_vec();
                    effects[place] = acting.effect(recording, &moved);
                    self.recordings[recording].signal_with(point, &effects)
                };
                let (low, high) = (side(below)?, side(above)?);
                let slope = high.iter().zip(&low).map(|(a, b)| (a - b) / (above - below));
                rows[begin + number] = Some(slope.collect());
            }
            begin += acting.len(count);
        }
        Ok(rows)
    }
}

/// Factors of the covariance of recordings of one machine.
#[derive(Clone, Debug)]
pub(crate) struct Whitening {
    mean: BandedCholesky,
    differences: BandedCholesky,
}

impl Whitening {
    /// Factors for some recordings with a noise. The share of the error in common is learnt of
    /// recordings from one start of the rotor; from others it is less, and both blocks are taken as
    /// large as they can be.
    pub(crate) fn new(
        error: &UnitError,
        wideness: f64,
        noise: &BandedMatrix,
        recordings: usize,
        has_one_start: bool,
    ) -> Result<Self, NotPositiveDefinite> {
        let covariance = error.covariance_of(wideness);
        let of = |share: f64| joined(&covariance.scaled(share), noise).cholesky();
        let others = recordings.saturating_sub(1) as f64;
        let shared = error.in_common.state;
        let own = if has_one_start { 1.0 - shared } else { 1.0 };
        Ok(Self { mean: of(1.0 + others * shared)?, differences: of(own)? })
    }

    /// White numbers of the signals of all recordings.
    fn whiten(&self, mut signals: Vec<Vec<f64>>) -> Vec<f64> {
        let count = signals.len();
        let is_empty = |signal: &Vec<f64>| signal.iter().all(|value| *value == 0.0);
        let mut white = Vec::new();
        for k in 1..count {
            let scale = 1.0 / ((k * k + k) as f64).sqrt();
            let mut difference = vec![0.0; signals[0].len()];
            for (i, signal) in signals[..=k].iter().enumerate() {
                let share = if i == k { -(k as f64) } else { 1.0 };
                add_scaled(&mut difference, scale * share, signal);
            }
            if !is_empty(&difference) {
                self.differences.whiten(&mut difference);
            }
            white.push(difference);
        }
        let mut mean = signals.swap_remove(0);
        for signal in &signals {
            add_scaled(&mut mean, 1.0, signal);
        }
        for value in &mut mean {
            *value /= (count as f64).sqrt();
        }
        if !is_empty(&mean) {
            self.mean.whiten(&mut mean);
        }
        white.push(mean);
        white.concat()
    }
}

/// Prior of the numbers of all recordings of one machine.
#[derive(Clone, Debug)]
pub(crate) struct NumberPrior {
    mean: DVector<f64>,
    /// Inverse of the covariance's lower factor.
    whitener: DMatrix<f64>,
}

impl NumberPrior {
    /// By the tolerances, or by what a unit that was learnt leaves of them, for recordings of some
    /// sessions; `None` where the unit's covariance has no factor.
    pub(crate) fn new(
        layout: &Layout,
        built: Option<&BuiltFit>,
        sessions: &[usize],
    ) -> Option<Self> {
        let (numbers, count) = (layout.numbers.len(), sessions.len());
        let mut machine = DMatrix::zeros(numbers, numbers);
        let mut mean = DVector::zeros(numbers * count);
        for (place, number) in layout.numbers.iter().enumerate() {
            machine[(place, place)] = number.scatter.machine * number.scatter.machine;
        }
        if let Some(built) = built {
            for (row, &place) in built.numbers.iter().enumerate() {
                for recording in 0..count {
                    mean[recording * numbers + place] = built.estimate[row];
                }
                for (column, &other) in built.numbers.iter().enumerate() {
                    machine[(place, other)] = built.covariance[(row, column)];
                }
            }
        }
        let mut covariance = DMatrix::zeros(numbers * count, numbers * count);
        for (r, session) in sessions.iter().enumerate() {
            for (s, other) in sessions.iter().enumerate() {
                let mut block = machine.clone();
                for (place, number) in layout.numbers.iter().enumerate() {
                    let scatter = number.scatter;
                    if session == other {
                        block[(place, place)] += scatter.session * scatter.session;
                    }
                    if r == s {
                        block[(place, place)] += scatter.recording * scatter.recording
                            + OWN_SHARE * scatter.together() * scatter.together();
                    }
                }
                covariance
                    .view_mut((r * numbers, s * numbers), (numbers, numbers))
                    .copy_from(&block);
            }
        }
        // each number by its own size, so that their units do not matter to the factor
        let size = covariance.diagonal().map(|variance| variance.sqrt().max(f64::MIN_POSITIVE));
        let scaled = DMatrix::from_fn(covariance.nrows(), covariance.nrows(), |i, j| {
            covariance[(i, j)] / (size[i] * size[j])
        });
        let lower = scaled.cholesky()?.l();
        let inverse = lower.solve_lower_triangular(&DMatrix::identity(size.len(), size.len()))?;
        let whitener = inverse * DMatrix::from_diagonal(&size.map(f64::recip));
        Some(Self { mean, whitener })
    }

    fn len(&self) -> usize {
        self.mean.len()
    }

    fn residual(&self, numbers: &[f64]) -> Vec<f64> {
        let off = &self.mean - DVector::from_column_slice(numbers);
        (&self.whitener * off).data.into()
    }

    /// White slope in one number.
    fn slope(&self, number: usize) -> Vec<f64> {
        self.whitener.column(number).iter().copied().collect()
    }

    /// The mean, where a search begins.
    pub(crate) fn mean(&self) -> &[f64] {
        self.mean.as_slice()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use inference::dot;

    use super::*;
    use crate::{
        Bundle, EMBEDDED_BUNDLES,
        seed::{Draws, Purpose, RootSeed},
        unit::quantities::Quantities,
    };

    fn quantities() -> Quantities {
        let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap();
        Quantities::new(&bundle.experiment)
    }

    /// A band of a Gaussian's shape: a covariance.
    fn covariance(order: usize, size: f64) -> BandedMatrix {
        let mut matrix = BandedMatrix::zeros(order, 3);
        for row in 0..order {
            for column in row.saturating_sub(3)..=row {
                let apart = (row - column) as f64;
                *matrix.at_mut(row, column) = size * (-0.7 * apart * apart).exp();
            }
        }
        matrix
    }

    #[test]
    fn contrasts_whiten_recordings_that_share_a_part_of_the_error() {
        let (samples, count, shared) = (6, 3, 0.4);
        let mut error = crate::unit::error::tests::with_covariance(covariance(samples, 2.0));
        error.in_common.state = shared;
        let noise = covariance(samples, 0.5);
        let whitening = Whitening::new(&error, 0.0, &noise, count, true).unwrap();
        let mut random = Draws::new(RootSeed(11).derive(Purpose::Units, 0));
        let signals: Vec<Vec<f64>> =
            (0..count).map(|_| (0..samples).map(|_| random.normal()).collect()).collect();
        let white = whitening.whiten(signals.clone());
        let floor = crate::offline::factor::FLOOR_A * crate::offline::factor::FLOOR_A;
        let whole = DMatrix::from_fn(samples * count, samples * count, |i, j| {
            let ((r, n), (s, m)) = ((i / samples, i % samples), (j / samples, j % samples));
            let own = if r == s { noise.at(n, m) + if n == m { floor } else { 0.0 } } else { 0.0 };
            own + error.covariance.at(n, m) * if r == s { 1.0 } else { shared }
        });
        let all = DVector::from_vec(signals.concat());
        let expected = all.dot(&(whole.try_inverse().unwrap() * &all));
        assert_relative_eq!(dot(&white, &white), expected, max_relative = 1e-9);
        // anti-test: as if each had an error of its own
        error.in_common.state = 0.0;
        let apart = Whitening::new(&error, 0.0, &noise, count, true).unwrap().whiten(signals);
        assert!((dot(&apart, &apart) / expected - 1.0).abs() > 1e-3);
    }

    #[test]
    fn a_number_is_the_same_in_all_recordings_but_for_its_session() {
        let quantities = quantities();
        let layout = quantities.layout();
        let numbers = layout.numbers.len();
        let place = |is: fn(&crate::unit::layout::Scatter) -> bool| {
            layout.numbers.iter().position(|number| is(&number.scatter)).unwrap()
        };
        let of_unit = place(|one| one.machine > 0.0 && one.session + one.recording == 0.0);
        let of_session = place(|one| one.session > 0.0 && one.machine == 0.0);
        // two recordings of a session and one of another
        let prior = NumberPrior::new(layout, None, &[0, 0, 2]).unwrap();
        let sum = |number: usize, values: [f64; 3]| {
            let mut all = vec![0.0; 3 * numbers];
            for (recording, value) in values.into_iter().enumerate() {
                all[recording * numbers + number] =
                    value * layout.numbers[number].scatter.together();
            }
            let white = prior.residual(&all);
            dot(&white, &white)
        };
        assert_relative_eq!(sum(of_unit, [1.0; 3]), 1.0, max_relative = 1e-4);
        assert!(sum(of_unit, [1.0, 1.0, 0.9]) > 1e3);
        assert_relative_eq!(sum(of_session, [1.0, 1.0, 0.0]), 1.0, max_relative = 1e-4);
        assert_relative_eq!(sum(of_session, [1.0; 3]), 2.0, max_relative = 1e-4);
        assert!(sum(of_session, [1.0, 0.9, 0.0]) > 1e3);
    }

    #[test]
    fn a_learnt_unit_moves_the_prior_to_what_it_is() {
        let quantities = quantities();
        let layout = quantities.layout();
        let place = layout.numbers.iter().position(|one| one.scatter.machine > 0.0).unwrap();
        let std = layout.numbers[place].scatter.machine;
        let built = BuiltFit {
            numbers: vec![place],
            estimate: vec![0.8 * std],
            covariance: DMatrix::from_element(1, 1, 0.01 * std * std),
        };
        let prior = NumberPrior::new(layout, Some(&built), &[0]).unwrap();
        assert_relative_eq!(prior.mean()[place], 0.8 * std);
        let mut moved = prior.mean().to_vec();
        assert_eq!(prior.residual(&moved).iter().map(|x| x * x).sum::<f64>(), 0.0);
        moved[place] += 0.1 * std;
        let spread =
            0.1 * std / (0.01 * std * std + layout.numbers[place].scatter.session.powi(2)).sqrt();
        let found: f64 = prior.residual(&moved).iter().map(|x| x * x).sum();
        assert_relative_eq!(found, spread * spread, max_relative = 1e-3);
    }
}
