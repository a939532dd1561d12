//! Which recorded column is which phase, and which way round each sensor sits.
//!
//! ```text
//! L = Σₖ Σₜ s·i_c(k)(t)·pₖ(θ(t))·m(t) / (|i|·|p·m|)
//! ```
//!
//! with `c` an order of the columns and `s` their sense, `pₖ` the sign of phase `k` in the sector of the
//! electrical angle `θ`, and `m` the envelope of the healthy machine. The share of the currents that an
//! order leaves unexplained is `1 - L²`; another order than the stated one is told where it leaves less
//! than half of what the stated one leaves. Over whole turns `L` of a wrong order is at most half of
//! that of the right one. One sensor that sits the other way round than the others shows in the sum of
//! the three, which a star keeps at nothing.
//!
//! An order is one against the angle's zero: a zero that is 60° off looks like columns of a cyclic order
//! the other way round, and both give the same levels.

use ema_sim::{FAULT_COUNT, FaultCoordinates, Sector};
use inference::dot;
use recordings::ChannelName;

use crate::{
    report::{Notice, NoticeCode},
    simulation::experiment::Experiment,
};

/// Part of what the stated wiring leaves unexplained that another may leave.
const MOST_LEFT: f64 = 0.5;
/// Least likeness of a wiring: noise alone is nowhere near, damage takes off little.
const LEAST_LIKENESS: f64 = 0.5;
/// Columns of the phases.
const COLUMNS: [ChannelName; 3] =
    [ChannelName::PhaseACurrent, ChannelName::PhaseBCurrent, ChannelName::PhaseCCurrent];
/// Orders of three columns.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]];

/// The column that the current of a phase stands in.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MappedColumn {
    /// Phase.
    pub phase: ChannelName,
    /// Column of another phase, or its own, as the file is read without options.
    pub column: ChannelName,
    /// Factor of the column, 1 or -1.
    pub factor: f64,
}

impl MappedColumn {
    /// True where the phase stands in its own column, the right way round.
    pub fn is_as_stated(&self) -> bool {
        self.phase == self.column && self.factor > 0.0
    }

    /// The option that reads the phase from its column.
    pub fn option(&self) -> String {
        let factor = if self.factor < 0.0 { "*-1" } else { "" };
        format!("--map {}={}{factor}", self.phase, self.column)
    }
}

/// Columns of the phases A, B and C, and the sense of each column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wiring {
    /// Place of each phase's column.
    columns: [usize; 3],
    /// Factor of each column, 1 or -1.
    signs: [f64; 3],
    /// Column that is computed of the two others.
    computed: Option<usize>,
}

impl Wiring {
    /// The wiring of recorded columns by the rotor's electrical angle at each sample, where it is not
    /// the stated one.
    ///
    /// `start_angle_rad` is the rotor's, mechanical; `computed` the phase that was not recorded.
    pub(super) fn found(
        columns: [&[f64]; 3],
        electrical_rad: &[f64],
        rate_hz: f64,
        start_angle_rad: f64,
        computed: Option<ChannelName>,
        experiment: &Experiment,
    ) -> Option<Self> {
        let model = healthy_phases(electrical_rad, rate_hz, start_angle_rad, experiment)?;
        let computed = COLUMNS.iter().position(|name| Some(*name) == computed);
        let products = columns.map(|i| model.each_ref().map(|expected| dot(i, expected)));
        let gram = columns.map(|i| columns.map(|j| dot(i, j)));
        let model_norm = model.iter().map(|phase| dot(phase, phase)).sum::<f64>().sqrt();
        let likeness = |wiring: &Self| {
            let likeness = wiring.product(&products) / (wiring.norm(&gram) * model_norm);
            if likeness.is_finite() { likeness } else { 0.0 }
        };
        let stated = Self { columns: ORDERS[0], signs: [1.0; 3], computed };
        let senses = senses(&gram, computed);
        let of_order = |columns| senses.iter().map(move |&signs| Self { columns, signs, computed });
        let (best, most) = ORDERS
            .into_iter()
            .flat_map(of_order)
            .map(|wiring| (wiring, likeness(&wiring)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let left = |likeness: f64| 1.0 - likeness.max(0.0).powi(2);
        let is_told = left(most) < MOST_LEFT * left(likeness(&stated));
        (is_told && most >= LEAST_LIKENESS).then_some(best)
    }

    /// Factors that make the current of a column of the recorded ones.
    fn factors(&self, column: usize) -> [f64; 3] {
        let mut factors = [0.0; 3];
        if self.computed == Some(column) {
            for other in (0..3).filter(|other| *other != column) {
                factors[other] = -self.signs[other];
            }
        } else {
            factors[column] = self.signs[column];
        }
        factors
    }

    /// Sum over the phases of the products with what is expected of them.
    fn product(&self, products: &[[f64; 3]; 3]) -> f64 {
        let of_phase = |phase: usize| {
            let factors = self.factors(self.columns[phase]);
            (0..3).map(|column| factors[column] * products[column][phase]).sum::<f64>()
        };
        (0..3).map(of_phase).sum()
    }

    /// Norm of all three phases.
    fn norm(&self, gram: &[[f64; 3]; 3]) -> f64 {
        (0..3).map(|column| square(&self.factors(column), gram)).sum::<f64>().sqrt()
    }

    /// The currents of the phases A, B and C.
    pub(super) fn phases(&self, columns: [&[f64]; 3]) -> [Vec<f64>; 3] {
        self.columns.map(|column| {
            let factors = self.factors(column);
            let value = |n: usize| (0..3).map(|c| factors[c] * columns[c][n]).sum();
            (0..columns[0].len()).map(value).collect()
        })
    }

    /// The column of each phase that was recorded.
    pub(crate) fn columns(&self) -> Vec<MappedColumn> {
        let recorded = (0..3).filter(|phase| self.computed != Some(self.columns[*phase]));
        let mapped = |phase: usize| {
            let column = self.columns[phase];
            MappedColumn {
                phase: COLUMNS[phase],
                column: COLUMNS[column],
                factor: self.signs[column],
            }
        };
        recorded.map(mapped).collect()
    }

    /// Says how the columns were read, and the option that states it.
    pub(super) fn notice(&self) -> Notice {
        let maps: Vec<String> = self.columns().iter().map(MappedColumn::option).collect();
        Notice {
            code: NoticeCode::PhasesRewired,
            message: format!(
                "the rotor's angle shows that the phases are wired otherwise than the columns say: \
                 read as with `{}`, of the names that the file has",
                maps.join(" ")
            ),
        }
    }
}

/// Sum of squares of the columns times factors, by their products with one another.
fn square(factors: &[f64; 3], gram: &[[f64; 3]; 3]) -> f64 {
    let row = |a: usize| (0..3).map(move |b| factors[a] * factors[b] * gram[a][b]);
    (0..3).flat_map(row).sum()
}

/// Senses of the columns that may be: of three recorded ones those with the least sum, of two all.
fn senses(gram: &[[f64; 3]; 3], computed: Option<usize>) -> Vec<[f64; 3]> {
    let both = |signs: [f64; 3]| [signs, signs.map(|sign| -sign)];
    let flipped = |column: usize| {
        let mut signs = [1.0; 3];
        signs[column] = -1.0;
        signs
    };
    if let Some(column) = computed {
        // the computed column follows, whatever its own sign
        return [[1.0; 3], flipped((column + 1) % 3)].into_iter().flat_map(both).collect();
    }
    let patterns = [[1.0; 3], flipped(0), flipped(1), flipped(2)];
    let least = patterns.into_iter().min_by(|a, b| square(a, gram).total_cmp(&square(b, gram)));
    least.into_iter().flat_map(both).collect()
}

/// Currents of the healthy machine's phases at the samples of a recording, A.
fn healthy_phases(
    electrical_rad: &[f64],
    rate_hz: f64,
    start_angle_rad: f64,
    experiment: &Experiment,
) -> Option<[Vec<f64>; 3]> {
    let envelope_a =
        experiment.monitor(start_angle_rad).ok()?.signal(&FaultCoordinates([0.0; FAULT_COUNT]));
    let a_sample = experiment.filter.output_hz / rate_hz;
    let mut phases: [Vec<f64>; 3] = Default::default();
    for (n, angle_rad) in electrical_rad.iter().enumerate() {
        let place = (n as f64 * a_sample).round() as usize;
        let current_a = envelope_a.get(place).copied().unwrap_or(0.0);
        let signs = Sector::of_electrical_angle(*angle_rad).pattern();
        for (phase, sign) in phases.iter_mut().zip(signs) {
            phase.push(sign * current_a);
        }
    }
    Some(phases)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::Draws;

    const RATE_HZ: f64 = 10e3;

    /// The healthy machine's phases on a rotor that turns as it likes, with noise.
    fn sound(experiment: &Experiment, offset_rad: f64) -> ([Vec<f64>; 3], Vec<f64>) {
        let samples = (experiment.scenario.duration_s * RATE_HZ) as usize;
        let angle = |n: usize| offset_rad + 20.0 * (4e-4 * n as f64).sin();
        let electrical_rad: Vec<f64> = (0..samples).map(angle).collect();
        let mut phases = healthy_phases(&electrical_rad, RATE_HZ, 0.0, experiment).unwrap();
        let mut noise = Draws::new(3);
        for value in phases.iter_mut().flatten() {
            *value += 0.1 * noise.normal();
        }
        (phases, electrical_rad)
    }

    fn found(
        phases: &[Vec<f64>; 3],
        electrical_rad: &[f64],
        computed: Option<ChannelName>,
    ) -> Option<Wiring> {
        let views = phases.each_ref().map(|phase| &phase[..]);
        Wiring::found(views, electrical_rad, RATE_HZ, 0.0, computed, &Experiment::chirp())
    }

    #[test]
    fn every_order_and_sense_is_undone() {
        let (phases, electrical_rad) = sound(&Experiment::chirp(), 0.3);
        assert_eq!(found(&phases, &electrical_rad, None), None);
        for order in ORDERS {
            for bits in 0..8usize {
                let mut columns: [Vec<f64>; 3] = Default::default();
                for (phase, &column) in order.iter().enumerate() {
                    let sign = if bits >> column & 1 == 0 { 1.0 } else { -1.0 };
                    columns[column] = phases[phase].iter().map(|i| sign * i).collect();
                }
                let wiring = found(&columns, &electrical_rad, None);
                let views = columns.each_ref().map(|column| &column[..]);
                let back = wiring.map_or_else(|| columns.clone(), |wiring| wiring.phases(views));
                assert!(back == phases, "{order:?} {bits}");
                assert_eq!(wiring.is_none(), order == ORDERS[0] && bits == 0);
            }
        }
    }

    #[test]
    fn a_phase_that_is_computed_follows_from_the_two_as_they_are_wired() {
        let (phases, electrical_rad) = sound(&Experiment::chirp(), 0.3);
        // the file's A is B the other way round, its B is C, and its C was computed of these
        let a: Vec<f64> = phases[1].iter().map(|i| -i).collect();
        let b = phases[2].clone();
        let c: Vec<f64> = a.iter().zip(&b).map(|(a, b)| -(a + b)).collect();
        let columns = [a, b, c];
        let computed = Some(ChannelName::PhaseCCurrent);
        let wiring = found(&columns, &electrical_rad, computed).unwrap();
        let views = columns.each_ref().map(|column| &column[..]);
        let [_, b, c] = wiring.phases(views);
        assert!(b == phases[1] && c == phases[2]);
        let message = wiring.notice().message;
        let told = "`--map phase_b_current_a=phase_a_current_a*-1 --map phase_c_current_a=phase_b_current_a`";
        assert!(message.contains(told), "{message}");
    }

    #[test]
    fn noise_has_no_wiring() {
        let mut noise = Draws::new(5);
        let columns = [0, 1, 2].map(|_| (0..5000).map(|_| noise.normal()).collect());
        let electrical_rad: Vec<f64> = (0..5000).map(|n| 0.01 * f64::from(n)).collect();
        assert_eq!(found(&columns, &electrical_rad, None), None);
    }
}
