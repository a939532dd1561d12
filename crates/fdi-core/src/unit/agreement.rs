//! Agreement of the recordings as new that a unit was learnt from.
//!
//! ```text
//! S(all) − S(the first) ~ χ²     S = least sum of squares of recordings of a machine without damage
//! ```
//!
//! with as many degrees of freedom as the others have white numbers. Beside it each recording is held
//! against the others by the damage that it shows beyond them, as a later recording would be.
//!
//! # Source
//!
//! Hierarchical normal model, Gelman et al., *Bayesian Data Analysis*, 3rd ed., chapter 5;
//! `docs/models/units.md`, section "References that contradict one another".

use inference::chi_squared_log_tail;

use crate::{
    diagnose::Diagnoser,
    online::options::DiagnoseOptions,
    report::Notice,
    unit::{
        contradiction::Contradiction,
        evidence::Evidence,
        finding::{Findings, History, Since},
        joint::{Joint, OfTest, OfUnit, Wear},
        learnt_unit::{Earlier, Learnt, LearntUnit},
        quantities::Quantities,
    },
};

/// Chance, by the normal distribution, with which recordings of one state of health are called of
/// different ones. The model's error is not normal: of 500 units of another seed than those that are
/// scored, the least likely had 1e-6.
const DISAGREEMENT_RATE: f64 = 1e-7;
/// Chance with which a recording is said to have damage that others do not have.
pub(crate) const CHANGE_RATE: f64 = 1e-5;

impl Diagnoser {
    /// Tells whether the recordings as new of a unit contradict one another: a diagnosis does not use
    /// such a unit.
    pub fn contradiction<'a>(&self, unit: &'a LearntUnit) -> Option<&'a Contradiction> {
        unit.contradiction(&self.learnt.quantities())
    }

    /// Settings without a unit whose recordings contradict one another, and the notice of it.
    pub(crate) fn with_agreeing_unit(
        &self,
        options: &DiagnoseOptions,
    ) -> (DiagnoseOptions, Option<Notice>) {
        let mut options = options.clone();
        let contradiction = options.unit.as_ref().and_then(|unit| self.contradiction(unit));
        let notice = contradiction.map(Contradiction::notice);
        options.unit.take_if(|_| notice.is_some());
        (options, notice)
    }
}

impl LearntUnit {
    fn contradiction(&self, quantities: &Quantities) -> Option<&Contradiction> {
        self.agreement.or_find(|| found(self, quantities))
    }
}

fn found(unit: &LearntUnit, quantities: &Quantities) -> Option<Contradiction> {
    let learnt = Learnt { unit, test: OfTest::only(quantities) };
    let all = Earlier::of(&[learnt], &[]).others.into_iter().zip(&unit.recordings);
    let (as_new, recordings): (Vec<OfUnit<'_>>, Vec<_>) =
        all.filter(|(one, _)| one.wear == Wear::AsNew).unzip();
    if !contradict(quantities, &as_new) {
        return None;
    }
    Some(Contradiction {
        recordings: as_new.len(),
        odd_one: odd_one(quantities, &as_new).map(|place| recordings[place].name.clone()),
        states_no_session: recordings.iter().all(|one| one.session.is_none()),
    })
}

/// True where no machine without damage shows recordings as new.
fn contradict(quantities: &Quantities, as_new: &[OfUnit<'_>]) -> bool {
    let Some((first, others)) = as_new.split_first().filter(|(_, others)| !others.is_empty())
    else {
        return false;
    };
    disagree(sum_as_new(as_new), sum_as_new(&[*first]))
        || (0..=others.len()).any(|place| stands_out(quantities, as_new, place))
}

/// True where recordings are not of one state of health, by the least sums of squares of all and of the
/// first alone, each with its white numbers; false where there is no sum.
pub(crate) fn disagree(all: Option<(f64, usize)>, first: Option<(f64, usize)>) -> bool {
    all.zip(first).is_some_and(|((sum, numbers), (of_first, numbers_of_first))| {
        let degrees = numbers - numbers_of_first;
        chi_squared_log_tail(sum - of_first, degrees) < DISAGREEMENT_RATE.ln()
    })
}

/// True where a recording shows damage that the others do not have.
fn stands_out(quantities: &Quantities, as_new: &[OfUnit<'_>], place: usize) -> bool {
    let joint = Joint::new(&without(as_new, place), &[as_new[place]], &[]);
    let Some((joint, damage)) = joint.and_then(|joint| joint.damage().map(|of| (joint, of))) else {
        return false;
    };
    let history = History { joint, worn: None, since: Since::References, nth: 1 };
    let findings = Findings::at_rate(CHANGE_RATE, quantities.layout(), &history, &damage);
    findings.all.iter().any(|finding| finding.detected)
}

/// Place of the recording without which the others agree best, where they do.
fn odd_one(quantities: &Quantities, as_new: &[OfUnit<'_>]) -> Option<usize> {
    let sum = |place: usize| Some((place, sum_as_new(&without(as_new, place))?.0));
    let sums = (0..as_new.len()).filter_map(sum);
    let (place, _) = sums.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| as_new.len() > 2)?;
    (!contradict(quantities, &without(as_new, place))).then_some(place)
}

fn without<'a>(all: &[OfUnit<'a>], place: usize) -> Vec<OfUnit<'a>> {
    let others = all.iter().enumerate().filter(|(other, _)| *other != place);
    others.map(|(_, one)| *one).collect()
}

/// Least sum of squares of the currents of recordings as new, and how many white numbers they are.
fn sum_as_new(as_new: &[OfUnit<'_>]) -> Option<(f64, usize)> {
    let currents = of_currents(as_new);
    let as_new = as_new.iter().zip(&currents).map(|(one, of)| one.with_evidence(of));
    let joint = Joint::as_new(&as_new.collect::<Vec<_>>())?;
    Some((joint.least_sum(&[])?, joint.white_numbers()))
}

/// Evidence of recordings without that of their voltages, whose numbers differ within a session by
/// more in some directions than the one share in common says that is learnt of them.
pub(crate) fn of_currents(all: &[OfUnit<'_>]) -> Vec<Evidence> {
    all.iter().map(|one| Evidence { voltage: None, ..one.evidence.clone() }).collect()
}
