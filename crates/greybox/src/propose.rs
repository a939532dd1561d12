//! The recording to take next: of a menu of safe commands the one that tells apart what the
//! recordings at hand leave open.

use ema_sim::{CommandKind, EffectId};
use inference::Whitener;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal};

use crate::{
    error::{GreyboxError, if_run},
    explain::{Options, Session, with_holdout},
    fit::whitened,
    gram::{dot, solve},
    known::Known,
    machine::Machine,
    menu::{Offer, PaceLimit, menu},
    problem::{PerRecord, Problem},
    record::{Record, Recordings},
    signal_chain::{SignalCode, SignalFind, sound, standing},
    structure::Free,
    suspects::with_suspects,
};

/// A recording that might be taken.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Proposed {
    /// Motion of the machine in it.
    pub description: String,
    /// Command, at the rate of the recordings: rad or rad/s, m or m/s.
    pub command: Vec<f64>,
    /// Load against positive motion, where the recordings had one: N·m or N.
    pub load: Option<Vec<f64>>,
    /// For each pair of open causes twice the log-likelihood by which the recording is expected
    /// to speak against the wrong one: 9 is three standard deviations.
    pub separations: Vec<Separation>,
}

/// How far a recording is expected to tell two causes apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Separation {
    /// The two causes.
    pub causes: [EffectId; 2],
    /// Twice the log-likelihood by which it is expected to speak against the wrong one.
    pub expected: f64,
}

impl Separation {
    /// Chance that the recording speaks for the right cause by more than the limit of ties
    /// `t`, nats, with the separation `λ`:
    ///
    /// ```text
    /// P = Φ((λ/2 − t)/√λ)
    /// ```
    fn chance_told_apart(&self, tie_nats: f64) -> f64 {
        let separation = self.expected;
        let deviations = (0.5 * separation - tie_nats) / libm::sqrt(separation.max(1e-9));
        0.5 * libm::erfc(-core::f64::consts::FRAC_1_SQRT_2 * deviations)
    }

    /// Separation that tells two causes apart with a chance between 0 and 1, where causes within
    /// `t` nats ([`Options::tie_nats`]) are tied:
    ///
    /// ```text
    /// λ = (z + √(z² + 2·t))²,   z = Φ⁻¹(P)
    /// ```
    ///
    /// # Examples
    ///
    /// ```
    /// use greybox::{Options, Separation};
    ///
    /// let tie_nats = Options::default().tie_nats;
    /// assert!((Separation::needed_for(0.5, tie_nats) - 2.0 * tie_nats).abs() < 1e-9);
    /// ```
    pub fn needed_for(chance: f64, tie_nats: f64) -> f64 {
        let deviations = Normal::standard().inverse_cdf(chance);
        let root = deviations + libm::sqrt(deviations * deviations + 2.0 * tie_nats);
        root * root
    }
}

impl Proposed {
    /// The least of the separations.
    pub fn separation(&self) -> f64 {
        self.separations.iter().map(|pair| pair.expected).fold(f64::INFINITY, f64::min)
    }
}

/// Ties that a recording is expected to break: the sum over pairs of causes of the chance that it
/// speaks for the right one by more than the limit of ties, nats. One told apart for certain counts no more than another, however certain; a pair that no
/// recording tells apart decides nothing.
fn ties_broken(separations: &[Separation], tie_nats: f64) -> f64 {
    separations.iter().map(|pair| pair.chance_told_apart(tie_nats)).sum()
}

/// Ties more or less that two recordings are taken to break alike.
const ALIKE_TIES: f64 = 0.01;

/// Proposal of the recording to take next.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Proposal {
    /// Causes that the recordings leave open, the likeliest first; fewer than two: nothing to
    /// tell apart.
    pub open: Vec<EffectId>,
    /// The menu, most telling first.
    pub menu: Vec<Proposed>,
    /// Rate of the commands.
    pub rate_hz: f64,
    /// Quantity that the commands ask for.
    pub kind: CommandKind,
}

/// Looks for the recording that tells the open causes apart.
///
/// For causes `a` and `b` with predictions `y` of the new recording, both whitened,
///
/// ```text
/// λ = min over δ of |y_b − y_a − J_a·δ|² + δᵀ·F_a·δ
/// ```
///
/// with the sensitivities `J_a` of all that is free beside cause `a`, and what the recordings at
/// hand say of it, `F_a`: the smaller of `(a, b)` and `(b, a)`, less what cannot be foreseen.
///
/// # Source
///
/// Design for discrimination between models: Atkinson and Fedorov 1975, with the free numbers
/// of a cause known as `F_a` says; `docs/models/greybox.md`.
///
/// # Errors
///
/// [`GreyboxError`].
pub fn propose(
    model: &ema_sim::model_file::MachineModel,
    recordings: &Recordings,
    options: &Options,
) -> Result<Proposal, GreyboxError> {
    recordings.check()?;
    let machine = Machine::new(model);
    let recordings = with_holdout(recordings);
    let (recordings, finds) = sound(&machine, recordings, options.signals, options.jobs)?;
    // another motion is what is looked for
    let finds: Vec<SignalFind> =
        finds.into_iter().filter(|find| find.code != SignalCode::SameMotion).collect();
    if let Some(find) = standing(&finds) {
        return Err(find.into());
    }
    let machine = with_suspects(&machine, &recordings, &options.exact, options.jobs)?;
    let (open, whitener) = Session::new(&machine, &recordings, options).open()?;
    let first = recordings.train.first().ok_or(GreyboxError::NoTraining)?;
    let mut proposal = Proposal {
        open: open.iter().map(|(id, _)| *id).collect(),
        menu: Vec::new(),
        rate_hz: first.rate_hz,
        kind: first.kind,
    };
    if open.len() < 2 {
        return Ok(proposal);
    }
    let causes: Vec<Cause> = open
        .iter()
        .map(|(id, fitted)| Cause { id: *id, known: Known::new(fitted, &whitener) })
        .collect();
    let mut served: Vec<(f64, Proposed)> = Vec::new();
    let pace = PaceLimit::new(&machine, &recordings, first.kind);
    for Offer { description, sizes } in menu(&machine, &recordings) {
        // what the machine cannot do at any size is not on the menu
        for record in sizes {
            let problem = Problem::new(&machine, [&record], options.jobs);
            let drives = if_run(drives(&machine, &problem, &causes, &record))?;
            let Some(drives) = drives else { continue };
            let separations = separations(&machine, &problem, &causes, &drives, &whitener);
            let Some(separations) = if_run(separations)? else { continue };
            if !pace.allows(&record) {
                break;
            }
            let told = ties_broken(&separations, options.tie_nats);
            let Record { command, load, .. } = record;
            let proposed = Proposed { description, command, load, separations };
            served.push((libm::round(told / ALIKE_TIES), proposed));
            break;
        }
    }
    // of those that tell alike the first of the menu, which goes from rest over slow moves to fast
    // sines: the slower, the less of it hangs on what the recordings at hand do not say
    served.sort_by(|a, b| b.0.total_cmp(&a.0));
    proposal.menu = served.into_iter().map(|(_, proposed)| proposed).collect();
    Ok(proposal)
}

/// An explanation that is open.
struct Cause {
    id: EffectId,
    known: Known,
}

impl Cause {
    /// Numbers a standard deviation from the fitted ones in every direction that the recordings
    /// tell of, with `F = L·Lᵀ` those off by `L⁻ᵀ·1`; none further than its difference was taken
    /// over, since what is known worse than that is fitted to the new recording, and the other way
    /// where a bound is nearer.
    fn a_deviation_off(&self) -> Vec<f64> {
        let Known { structure, values, information, .. } = &self.known;
        let n = values.len();
        let ones = DVector::from_element(n, 1.0);
        let factor = information.clone().cholesky();
        let off = factor.and_then(|f| f.l().transpose().solve_upper_triangular(&ones));
        let off = off.unwrap_or_else(|| DVector::zeros(n));
        let numbers = structure.free.iter().zip(values);
        let moved = |((free, value), off): ((&Free, &f64), &f64)| {
            let off = off.clamp(-free.step, free.step);
            let there = if (free.least..=free.most).contains(&(value + off)) { off } else { -off };
            (value + there).clamp(free.least, free.most)
        };
        numbers.zip(&off).map(moved).collect()
    }
}

/// The drive signal by each cause; an error where it exceeds what the machine may do.
fn drives(
    machine: &Machine,
    problem: &Problem<'_>,
    causes: &[Cause],
    record: &Record,
) -> Result<Vec<PerRecord>, GreyboxError> {
    let of = |cause: &Cause| cause.known.structure.state(machine, &cause.known.values);
    let states: Vec<_> = causes.iter().map(of).collect();
    let mut drives = Vec::new();
    for state in &states {
        let predictions = problem.predictions(state)?;
        let asked = predictions.iter().flat_map(|prediction| &prediction.drive);
        if asked.fold(0.0_f64, |most, x| most.max(x.abs())) > machine.safe_drive() {
            return Err(GreyboxError::NotFinite { record: record.name.clone() });
        }
        let compared = problem.records.iter().zip(&predictions);
        drives
            .push(compared.map(|(record, prediction)| record.reduce(&prediction.drive)).collect());
    }
    Ok(drives)
}

fn apart(a: &PerRecord, b: &PerRecord, whitener: &Whitener) -> Vec<f64> {
    let difference: PerRecord =
        a.iter().zip(b).map(|(a, b)| b.iter().zip(a).map(|(y, x)| y - x).collect()).collect();
    whitened(whitener, &difference)
}

fn separations(
    machine: &Machine,
    problem: &Problem<'_>,
    causes: &[Cause],
    drives: &[PerRecord],
    whitener: &Whitener,
) -> Result<Vec<Separation>, GreyboxError> {
    let mut beside = Vec::new();
    for (cause, drive) in causes.iter().zip(drives) {
        beside.push(Beside::new(machine, problem, cause, drive, whitener)?);
    }
    let mut pairs = Vec::new();
    for a in 0..causes.len() {
        for b in a + 1..causes.len() {
            let apart = apart(&drives[a], &drives[b], whitener);
            let of = |place: usize| {
                let information = &causes[place].known.information;
                left_over(&apart, &beside[place].columns, information)
            };
            let unforeseen = beside[a].unforeseen.max(beside[b].unforeseen);
            let separation = at_least(of(a).min(of(b)), unforeseen);
            pairs.push(Separation { causes: [causes[a].id, causes[b].id], expected: separation });
        }
    }
    Ok(pairs)
}

/// Energy that two signals of these energies have at least together.
fn at_least(energy: f64, other: f64) -> f64 {
    let left = (libm::sqrt(energy) - libm::sqrt(other)).max(0.0);
    left * left
}

/// Change of a new recording by the free numbers of a cause.
struct Beside {
    /// Whitened sensitivities.
    columns: Vec<Vec<f64>>,
    /// Energy of what they do beyond those, a standard deviation off: much where a drive sticks
    /// and slips, or rattles in its play, and nobody can say when.
    unforeseen: f64,
}

impl Beside {
    fn new(
        machine: &Machine,
        problem: &Problem<'_>,
        cause: &Cause,
        drive: &PerRecord,
        whitener: &Whitener,
    ) -> Result<Self, GreyboxError> {
        let Known { structure, values, information, .. } = &cause.known;
        let columns = problem.sensitivities(structure, 0, 1.0, values, drive)?;
        let columns: Vec<Vec<f64>> = columns.iter().map(|c| whitened(whitener, c)).collect();
        let off = cause.a_deviation_off();
        let mut there = problem.drives(&[structure.state(machine, &off)])?;
        let mut beyond = apart(drive, &there.remove(0), whitener);
        for ((column, to), from) in columns.iter().zip(&off).zip(values) {
            for (left, slope) in beyond.iter_mut().zip(column) {
                *left -= slope * (to - from);
            }
        }
        let unforeseen = left_over(&beyond, &columns, information);
        Ok(Self { columns, unforeseen })
    }
}

/// Energy of a signal that free numbers, known as well as they are, cannot take up.
fn left_over(signal: &[f64], columns: &[Vec<f64>], information: &DMatrix<f64>) -> f64 {
    let n = columns.len();
    let matrix = DMatrix::from_fn(n, n, |i, j| dot(&columns[i], &columns[j]) + information[(i, j)]);
    let right = DVector::from_fn(n, |i, _| dot(&columns[i], signal));
    (dot(signal, signal) - right.dot(&solve(&matrix, &right))).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ties broken of three pairs with these separations.
    fn of_three(separations: [f64; 3]) -> f64 {
        use EffectId::{Cogging, CurrentRipple, TransmissionError};
        let pairs = [
            [Cogging, CurrentRipple],
            [Cogging, TransmissionError],
            [CurrentRipple, TransmissionError],
        ];
        let of = |(causes, expected)| Separation { causes, expected };
        ties_broken(&pairs.into_iter().zip(separations).map(of).collect::<Vec<_>>(), 5.0)
    }

    #[test]
    fn a_pair_that_nothing_tells_apart_decides_nothing() {
        // of three causes two are the same: what tells them from the third is better
        assert!(of_three([40.0, 40.0, 0.0]) > of_three([2.0, 2.0, 0.1]));
        // and one that tells all is better than one that tells a pair very well
        assert!(of_three([20.0, 20.0, 20.0]) > of_three([500.0, 0.0, 0.0]));
    }

    #[test]
    fn a_tie_is_broken_in_half_of_the_cases_where_the_limit_of_ties_is_expected() {
        assert!((of_three([10.0, 10.0, 10.0]) - 1.5).abs() < 1e-9);
        assert!((of_three([0.0, 0.0, 1e6]) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_separation_that_is_needed_gives_its_chance() {
        let causes = [EffectId::Cogging, EffectId::CurrentRipple];
        for chance in [0.1, 0.5, 0.9, 0.999] {
            let expected = Separation::needed_for(chance, 5.0);
            let told = Separation { causes, expected }.chance_told_apart(5.0);
            assert!((told - chance).abs() < 1e-9, "{told} {chance}");
        }
        assert!((Separation::needed_for(0.9, 5.0) - 22.03).abs() < 0.01);
    }

    #[test]
    fn a_pair_told_apart_beyond_doubt_does_not_stand_for_another() {
        // at rest a wave of the transmission stands out a thousand times more than is needed
        let rest = [0.0, 280_254.6, 280_254.6];
        assert!(of_three([123.5, 435.8, 514.3]) > of_three(rest));
    }

    #[test]
    fn what_cannot_be_foreseen_tells_nothing_apart() {
        assert!((at_least(100.0, 0.0) - 100.0).abs() < 1e-12);
        assert!((at_least(100.0, 4.0) - 64.0).abs() < 1e-12);
        assert!(at_least(48_934.0, 60_000.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_known_well_cannot_take_up_a_difference() {
        let signal = [2.0, 0.0, 1.0];
        let columns = [vec![1.0, 0.0, 0.0]];
        let free = left_over(&signal, &columns, &DMatrix::zeros(1, 1));
        assert!((free - 1.0).abs() < 1e-8, "{free}");
        let known = left_over(&signal, &columns, &DMatrix::from_element(1, 1, 1e12));
        assert!((known - 5.0).abs() < 1e-8, "{known}");
        // as well known as the new recording itself tells: half of it
        let half = left_over(&signal, &columns, &DMatrix::from_element(1, 1, 1.0));
        assert!((half - 3.0).abs() < 1e-8, "{half}");
    }
}
