//! The recording to take next: of a menu of safe commands the one that tells apart what the
//! recordings at hand leave open.

use ema_sim::EffectId;
use nalgebra::{DMatrix, DVector};

use crate::{
    error::GreyboxError,
    explain::{Options, Session, with_holdout},
    fit::whitened,
    gram::{dot, solve},
    known::Known,
    machine::Machine,
    menu::menu,
    noise::Whitener,
    problem::{PerRecord, Problem},
    record::{CommandKind, Record, Recordings},
};

/// A recording that might be taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposed {
    /// What the machine does in it.
    pub description: String,
    /// What is asked for, at the rate of the recordings: rad or rad/s, m or m/s.
    pub command: Vec<f64>,
    /// Load against positive motion, where the recordings had one: N·m or N.
    pub load: Option<Vec<f64>>,
    /// For each pair of open causes twice the log-likelihood by which the recording is expected
    /// to speak against the wrong one: 9 is three standard deviations.
    pub separations: Vec<(EffectId, EffectId, f64)>,
}

impl Proposed {
    /// The least of the separations.
    pub fn separation(&self) -> f64 {
        self.separations.iter().map(|(.., separation)| *separation).fold(f64::INFINITY, f64::min)
    }
}

impl Proposed {
    fn told(&self) -> f64 {
        told(&self.separations.iter().map(|(.., separation)| *separation).collect::<Vec<_>>())
    }
}

/// What a recording tells of several pairs of causes: the more of each, the less another counts
/// that is told apart already; a pair that no recording tells apart decides nothing.
fn told(separations: &[f64]) -> f64 {
    separations.iter().map(|separation| libm::log1p(*separation)).sum()
}

/// What to record next.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// Causes that the recordings leave open, the likeliest first; fewer than two: nothing to
    /// tell apart.
    pub open: Vec<EffectId>,
    /// The menu, most telling first.
    pub menu: Vec<Proposed>,
    /// Rate of the commands.
    pub rate_hz: f64,
    /// Whether the commands are positions or speeds.
    pub kind: CommandKind,
}

/// Commands whose separation is worked out, of those that the causes differ most in.
const WORKED_OUT: usize = 8;

/// Looks for the recording that tells the open causes apart.
///
/// For causes `a` and `b` with predictions `y` of the new recording, both whitened,
///
/// ```text
/// λ = min over δ of |y_b − y_a − J_a·δ|² + δᵀ·F_a·δ
/// ```
///
/// with the sensitivities `J_a` of all that is free beside cause `a`, and what the recordings at
/// hand say of it, `F_a`: the smaller of `(a, b)` and `(b, a)`.
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
    let mut served = Vec::new();
    for (description, record) in menu(model, &recordings) {
        let problem = Problem::new(&machine, [&record], options.jobs);
        // what the machine cannot do is not on the menu
        if let Ok(drives) = drives(&machine, &problem, &causes, &record) {
            let told = told(&distances(&drives, &whitener));
            served.push((told, description, record, drives));
        }
    }
    served.sort_by(|a, b| b.0.total_cmp(&a.0));
    served.truncate(WORKED_OUT);
    for (_, description, record, drives) in served {
        let problem = Problem::new(&machine, [&record], options.jobs);
        let separations = separations(&problem, &causes, &drives, &whitener)?;
        let Record { command, load, .. } = record;
        proposal.menu.push(Proposed { description, command, load, separations });
    }
    proposal.menu.sort_by(|a, b| b.told().total_cmp(&a.told()));
    Ok(proposal)
}

/// An explanation that is open.
struct Cause {
    id: EffectId,
    known: Known,
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

/// Distances between each two causes before anything is fitted.
fn distances(drives: &[PerRecord], whitener: &Whitener) -> Vec<f64> {
    let mut distances = Vec::new();
    for (place, a) in drives.iter().enumerate() {
        for b in &drives[place + 1..] {
            let apart = apart(a, b, whitener);
            distances.push(dot(&apart, &apart));
        }
    }
    distances
}

fn apart(a: &PerRecord, b: &PerRecord, whitener: &Whitener) -> Vec<f64> {
    let difference: PerRecord =
        a.iter().zip(b).map(|(a, b)| b.iter().zip(a).map(|(y, x)| y - x).collect()).collect();
    whitened(whitener, &difference)
}

fn separations(
    problem: &Problem<'_>,
    causes: &[Cause],
    drives: &[PerRecord],
    whitener: &Whitener,
) -> Result<Vec<(EffectId, EffectId, f64)>, GreyboxError> {
    let mut beside = Vec::new();
    for (cause, drive) in causes.iter().zip(drives) {
        let Known { structure, values, .. } = &cause.known;
        let columns = problem.sensitivities(structure, (0, 1.0), values, drive)?;
        let columns: Vec<Vec<f64>> = columns.iter().map(|c| whitened(whitener, c)).collect();
        beside.push(columns);
    }
    let mut pairs = Vec::new();
    for a in 0..causes.len() {
        for b in a + 1..causes.len() {
            let apart = apart(&drives[a], &drives[b], whitener);
            let of =
                |place: usize| left_over(&apart, &beside[place], &causes[place].known.information);
            pairs.push((causes[a].id, causes[b].id, of(a).min(of(b))));
        }
    }
    Ok(pairs)
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

    #[test]
    fn a_pair_that_nothing_tells_apart_decides_nothing() {
        // of three causes two are the same: what tells them from the third is better
        assert!(told(&[40.0, 40.0, 0.0]) > told(&[2.0, 2.0, 0.1]));
        // and one that tells all a little is better than one that tells a pair very well
        assert!(told(&[20.0, 20.0, 20.0]) > told(&[500.0, 0.0, 0.0]));
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
