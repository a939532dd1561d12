//! Damage of recordings in one state of health beside other recordings of the same unit.
//!
//! ```text
//! ν_r = u + w_s + e_r    numbers in recording r of session s, each part with its own prior
//! c_r = 0                as new
//! c_r = n_r·d            since, n_r sessions of a part after those as new: d is what a session wears
//! c_r = c                the recordings that are diagnosed
//! ```
//!
//! The numbers as built are common to all recordings, so that they leave the damage `c` no more open
//! than sessions and recordings do. The wear `d` has no prior: sessions since tell how the unit
//! scatters, and a slow wear is not taken for it.
//!
//! What else differs between sessions and recordings than the temperature, whose effect the
//! coefficients of the unit multiply, is not looked for, but left out by its prior: with `z` the white numbers of a session's recordings and `G` their slopes in `w` and `e`
//!
//! ```text
//! z ← (1 + G·diag(s²)·Gᵀ)^(−½)·z
//! ```
//!
//! so that the unknowns grow by one a session.
//!
//! # Source
//!
//! Hierarchical normal model, Gelman et al., *Bayesian Data Analysis*, 3rd ed., chapter 5;
//! `docs/models/units.md`.

use std::{borrow::Cow, cell::OnceCell, convert::Infallible};

use ema_sim::{FAULT_COUNT, FaultId};
use inference::{MostProbable, SymmetricMatrix, Unknown, Whitened, dot, most_probable};
use nalgebra::{DMatrix, DVector};

use crate::unit::{
    evidence::{CommonTo, Evidence, TemperatureReading, WhiteEvidence, With},
    layout::{Component, Layout, UnitNumber},
    quantities::Quantities,
    search::{DAMAGE_REACH, UnitFit, number_unknown},
};

/// Damage of a recording that is not the one diagnosed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wear {
    /// None: it is as new.
    AsNew,
    /// Damage of so many sessions of each component after those in which it was new.
    Since([usize; Component::COUNT]),
}

impl Wear {
    /// Sessions of each component after those in which it was new.
    fn sessions(self) -> [f64; Component::COUNT] {
        match self {
            Self::AsNew => [0.0; Component::COUNT],
            Self::Since(sessions) => sessions.map(|count| count as f64),
        }
    }
}

/// Test that a recording is of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OfTest<'a> {
    /// Quantities that the test shows; tests of one machine have one layout of the unknowns.
    pub(crate) quantities: &'a Quantities,
    /// Number among the tests of the recordings.
    pub(crate) number: usize,
}

impl<'a> OfTest<'a> {
    /// The one test that all recordings are of.
    pub(crate) fn only(quantities: &'a Quantities) -> Self {
        Self { quantities, number: 0 }
    }
}

/// Evidence of a recording among those of its unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OfUnit<'a> {
    pub(crate) evidence: &'a Evidence,
    pub(crate) test: OfTest<'a>,
    /// Number of its session.
    pub(crate) session: usize,
    pub(crate) wear: Wear,
    /// Parts replaced before it, by component.
    pub(crate) replaced: [u32; Component::COUNT],
}

impl OfUnit<'_> {
    /// The recording with other evidence in the place of its own.
    pub(crate) fn with_evidence<'b>(&'b self, evidence: &'b Evidence) -> OfUnit<'b> {
        let &OfUnit { test, session, wear, replaced, .. } = self;
        OfUnit { evidence, test, session, wear, replaced }
    }
}

/// Damage with what is left open of it.
#[derive(Clone, Debug)]
pub(crate) struct DamageFit {
    /// Most probable damage looked for.
    pub(crate) estimate: Vec<f64>,
    /// Covariance of the damage, the numbers marginal.
    pub(crate) covariance: DMatrix<f64>,
    /// Covariance of the damage, were every number known.
    pub(crate) known_numbers: DMatrix<f64>,
}

impl DamageFit {
    /// Standard deviations of faults by their index, of the eccentricity the root mean square over its
    /// two coordinates; `None` of what is not looked for.
    pub(crate) fn stds(&self, layout: &Layout) -> [Option<f64>; FAULT_COUNT] {
        FaultId::ALL.map(|fault| {
            let places = layout.places_of(fault);
            let sum: f64 = places.iter().map(|&place| self.covariance[(place, place)]).sum();
            (!places.is_empty()).then(|| (sum / places.len() as f64).sqrt())
        })
    }
}

impl From<&UnitFit> for DamageFit {
    fn from(fit: &UnitFit) -> Self {
        Self {
            estimate: fit.point[..fit.covariance.nrows()].to_vec(),
            covariance: fit.covariance.clone(),
            known_numbers: fit.known_numbers.clone(),
        }
    }
}

/// Numbers of a machine as built, with what is left open of them.
#[derive(Clone, Debug)]
pub(crate) struct BuiltFit {
    /// Places of the numbers in the layout.
    pub(crate) numbers: Vec<usize>,
    /// Most probable values, beyond those of the model file.
    pub(crate) estimate: Vec<f64>,
    pub(crate) covariance: DMatrix<f64>,
}

/// A recording of a unit among those that are explained together.
#[derive(Clone, Debug)]
struct Seen<'a> {
    evidence: WhiteEvidence,
    test: OfTest<'a>,
    session: usize,
    replaced: [u32; Component::COUNT],
    /// True for recordings whose damage is looked for by itself.
    is_diagnosed: bool,
    /// Sessions of wear of each component.
    wear: [f64; Component::COUNT],
}

impl<'a> Seen<'a> {
    /// `None` where the evidence is not finite.
    fn of(one: &OfUnit<'a>, is_diagnosed: bool, with: With, readings: usize) -> Option<Self> {
        let &OfUnit { evidence, test, session, replaced, wear } = one;
        let mut evidence = evidence.white(with)?;
        if let Some(reading) = &mut evidence.temperature {
            // the thermometer's error is that of the session: together its readings tell what one does
            reading.std_k *= (readings as f64).sqrt();
        }
        Some(Self { evidence, test, session, replaced, is_diagnosed, wear: wear.sessions() })
    }

    /// All that the recording shows at a point of its unknowns.
    fn shown_at(&self, point: &[f64]) -> Vec<f64> {
        let quantities = self.test.quantities;
        let mut shown = quantities.shown_at(point);
        if let Some(by) = &self.evidence.voltage_by {
            let found_at = quantities.at(point);
            shown.extend(less_found(by, &found_at, &quantities.volts_at(point)));
        }
        shown
    }

    /// Derivatives of all that the recording shows, one row an unknown.
    fn shown_slopes(&self, point: &[f64]) -> Vec<Vec<f64>> {
        let quantities = self.test.quantities;
        let mut slopes = quantities.shown_slopes(point);
        if let Some(by) = &self.evidence.voltage_by {
            for (row, volts) in slopes.iter_mut().zip(quantities.volts_slopes(point)) {
                let volts = less_found(by, row, &volts);
                row.extend(volts);
            }
        }
        slopes
    }
}

/// Numbers of a voltage, or their slopes, less what the quantities at which they are found make of
/// them; behind these others may follow.
fn less_found(by: &DMatrix<f64>, quantities: &[f64], volts: &[f64]) -> Vec<f64> {
    let found = |row: usize| dot(&by.row(row).iter().copied().collect::<Vec<_>>(), quantities);
    volts.iter().enumerate().map(|(row, volts)| volts - found(row)).collect()
}

/// One unknown of the recordings together.
#[derive(Clone, Copy, Debug)]
struct Part {
    unknown: Unknown,
    /// Place among the unknowns of one recording.
    place: usize,
    of: Of,
}

/// The recordings that an unknown is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Of {
    Diagnosed,
    /// Wear of a session of a component after so many replacements of it.
    Wear(Component, u32),
    /// Recordings of the machine as built; of a component since so many replacements of it.
    Built(Option<(Component, u32)>),
    Session(usize),
    Recording(usize),
    /// Every recording of a test, through the error of the model that they have in common; `place`
    /// counts its white numbers.
    UnitError(usize),
    /// Recordings of a test in one state of health, diagnosed or not, through what these have in
    /// common beyond it.
    StateError(usize, bool),
}

impl Of {
    /// The error of the model that it is.
    fn error(self) -> Option<CommonTo> {
        match self {
            Self::UnitError(_) => Some(CommonTo::Unit),
            Self::StateError(..) => Some(CommonTo::State),
            _ => None,
        }
    }

    /// True where it is an error of the model that a recording has.
    fn is_error_of(self, seen: &Seen<'_>) -> bool {
        match self {
            Self::UnitError(test) => test == seen.test.number,
            Self::StateError(test, is_diagnosed) => {
                test == seen.test.number && is_diagnosed == seen.is_diagnosed
            }
            _ => false,
        }
    }
}

/// Recordings of a unit that are explained together, those diagnosed last.
#[derive(Clone, Debug)]
pub(crate) struct Joint<'a> {
    layout: &'a Layout,
    seen: Vec<Seen<'a>>,
    /// Recordings that share a session, with the factor of what their numbers have of it.
    sessions: Vec<Session>,
    parts: Vec<Part>,
    /// Where the search begins.
    start: Vec<f64>,
    /// Best explanation, once it was asked for.
    best: OnceCell<Option<MostProbable>>,
}

/// Recordings of one session.
#[derive(Clone, Debug)]
struct Session {
    recordings: Vec<usize>,
    /// Lower factor of `1 + G·diag(s²)·Gᵀ`; `None` where nothing differs between sessions.
    factor: Option<DMatrix<f64>>,
}

impl<'a> Joint<'a> {
    /// Recordings in one state of health with others of their unit, the search from a point of the
    /// unknowns; `None` where there are none, or some evidence is not finite.
    pub(crate) fn new(
        others: &[OfUnit<'a>],
        diagnosed: &[OfUnit<'a>],
        start: &[f64],
    ) -> Option<Self> {
        let is_alone = others.len() + diagnosed.len() == 1;
        let mut seen = seen_of(others, diagnosed)?;
        for one in seen.iter_mut().filter(|one| one.is_diagnosed) {
            one.wear = [0.0; Component::COUNT];
        }
        Self::of_seen(seen, is_alone, start)
    }

    /// Recordings with others of their unit, the damage looked for that beyond the wear which those have too:
    /// damage since them; `None` where there are none, or some evidence is not finite.
    pub(crate) fn beyond_wear(
        others: &[OfUnit<'a>],
        diagnosed: &[OfUnit<'a>],
        start: &[f64],
    ) -> Option<Self> {
        Self::of_seen(seen_of(others, diagnosed)?, false, start)
    }

    /// Recordings with others of their unit, their damage the wear of so many sessions as that of the
    /// others is; `None` where some evidence is not finite, or no part has worn.
    pub(crate) fn worn(
        others: &[OfUnit<'a>],
        diagnosed: &[OfUnit<'a>],
        start: &[f64],
    ) -> Option<Self> {
        let mut joint = Self::beyond_wear(others, diagnosed, start)?;
        joint.retain(|part| part.of != Of::Diagnosed);
        let has_worn = joint.parts.iter().any(|part| matches!(part.of, Of::Wear(..)));
        has_worn.then_some(joint)
    }

    /// Keeps some of the unknowns.
    fn retain(&mut self, is_kept: impl Fn(&Part) -> bool) {
        let mut kept = self.parts.iter().map(&is_kept);
        self.start.retain(|_| kept.next().unwrap_or(true));
        self.parts.retain(is_kept);
    }

    /// Recordings that a unit was learnt from, none of them diagnosed: what they say of its numbers
    /// after so many replacements of each component. Of a component that no recording has seen since,
    /// the tolerances alone are known.
    pub(crate) fn learnt(all: &[OfUnit<'a>], replaced: &[u32; Component::COUNT]) -> Option<Self> {
        let mut joint = Self::as_new(all)?;
        let layout = joint.layout;
        for (number, place) in layout.numbers.iter().zip(layout.sought.len()..) {
            let Some(component) = number.acts.component() else { continue };
            let of = Of::Built(Some((component, replaced[component as usize])));
            let is_seen = joint.parts.iter().any(|part| part.place == place && part.of == of);
            if number.scatter.machine > 0.0 && !is_seen {
                let unknown = number_unknown(number.scatter.machine);
                joint.parts.push(Part { unknown, place, of });
            }
        }
        joint.start = vec![0.0; joint.parts.len()];
        Some(joint)
    }

    /// Recordings of which none is diagnosed.
    pub(crate) fn as_new(all: &[OfUnit<'a>]) -> Option<Self> {
        let mut joint = Self::of_seen(seen_of(all, &[])?, false, &[])?;
        joint.retain(|part| part.of != Of::Diagnosed);
        Some(joint)
    }

    fn of_seen(seen: Vec<Seen<'a>>, is_alone: bool, start: &[f64]) -> Option<Self> {
        let layout = seen.first()?.test.quantities.layout();
        let parts = parts(layout, &seen, is_alone);
        let start = parts.iter().map(|part| match part.of {
            Of::Diagnosed | Of::Built(_) => start.get(part.place).copied().unwrap_or(0.0),
            _ => 0.0,
        });
        let start: Vec<f64> = start.collect();
        let (sessions, best) = (Vec::new(), OnceCell::new());
        let mut joint = Self { layout, seen, sessions, parts, start, best };
        joint.sessions = joint.sessions(is_alone)?;
        Some(joint)
    }

    /// The sessions with what differs between them left out.
    fn sessions(&self, is_alone: bool) -> Option<Vec<Session>> {
        let numbers = distinct(self.seen.iter().map(|one| one.session));
        let session = |number: usize| {
            let is_of = |&place: &usize| self.seen[place].session == number;
            let recordings: Vec<usize> = (0..self.seen.len()).filter(is_of).collect();
            // a recording alone shows all levels together
            let factor = if is_alone { None } else { Some(self.factor(&recordings)?) };
            Some(Session { recordings, factor })
        };
        numbers.into_iter().map(session).collect()
    }

    /// Lower factor of the covariance of a session's white numbers.
    fn factor(&self, recordings: &[usize]) -> Option<DMatrix<f64>> {
        let layout = self.layout;
        let length = recordings.iter().map(|&one| self.white_len(one)).sum();
        let mut covariance = DMatrix::identity(length, length);
        // one column a number of the session, and one a number of each recording
        let mut columns: Vec<DVector<f64>> = Vec::new();
        let mut of_session: Vec<DVector<f64>> = vec![DVector::zeros(length); layout.numbers.len()];
        let mut begin = 0;
        for &recording in recordings {
            let slopes = self.white_slopes(recording, &self.start);
            let left_out = |(_, number): &(usize, &UnitNumber)| !number.acts.is_temperature();
            for (place, number) in layout.numbers.iter().enumerate().filter(left_out) {
                let slope = &slopes[layout.sought.len() + place];
                let mut part = of_session[place].rows_mut(begin, slope.len());
                part += number.scatter.session * slope;
                if number.scatter.recording > 0.0 {
                    let mut column = DVector::zeros(length);
                    column.rows_mut(begin, slope.len()).copy_from(slope);
                    columns.push(number.scatter.recording * column);
                }
            }
            begin += self.white_len(recording);
        }
        columns.extend(of_session.into_iter().filter(|column| column.amax() > 0.0));
        columns.extend(self.errors_in_common(recordings, length));
        for column in &columns {
            covariance.ger(1.0, column, column, 1.0);
        }
        Some(covariance.cholesky()?.l())
    }

    /// Additions of errors of the model that recordings of a session in one state of health have in
    /// common, one column an error.
    fn errors_in_common(&self, recordings: &[usize], length: usize) -> Vec<DVector<f64>> {
        let group = |one: usize| (self.seen[one].test.number, self.seen[one].is_diagnosed);
        let mut columns = Vec::new();
        for of in distinct(recordings.iter().map(|&one| group(one))) {
            let of_group = recordings.iter().filter(|&&one| group(one) == of);
            let errors = of_group.map(|&one| self.seen[one].evidence.len()).max().unwrap_or(0);
            for error in 0..errors {
                let mut column = DVector::zeros(length);
                let mut begin = 0;
                for &one in recordings {
                    let addition = self.seen[one].evidence.addition(CommonTo::Session, error);
                    if let Some(addition) = addition.filter(|_| group(one) == of) {
                        column.rows_mut(begin, addition.len()).copy_from(&addition);
                    }
                    begin += self.white_len(one);
                }
                columns.push(column);
            }
        }
        columns.retain(|column| column.amax() > 0.0);
        columns
    }

    /// True where a recording that is diagnosed has the motor's voltage.
    pub(crate) fn has_voltage(&self) -> bool {
        let mut diagnosed = self.seen.iter().filter(|one| one.is_diagnosed);
        diagnosed.any(|one| one.evidence.voltage_by.is_some())
    }

    /// White numbers of all recordings.
    pub(crate) fn white_numbers(&self) -> usize {
        (0..self.seen.len()).map(|one| self.white_len(one)).sum()
    }

    /// White numbers of a recording.
    fn white_len(&self, recording: usize) -> usize {
        let seen = &self.seen[recording];
        seen.evidence.len() + usize::from(self.temperature_of(seen).is_some())
    }

    /// White numbers of a recording, the session not left out.
    fn white(&self, recording: usize, values: &[f64]) -> DVector<f64> {
        let seen = &self.seen[recording];
        let point = self.point(recording, values);
        let mut white = seen.evidence.residual(&seen.shown_at(&point));
        for (part, value) in self.parts.iter().zip(values) {
            if let Some(to) = part.of.error().filter(|_| part.of.is_error_of(seen))
                && let Some(addition) = seen.evidence.addition(to, part.place)
            {
                white -= *value * addition;
            }
        }
        match self.temperature_of(seen) {
            Some((place, reading)) => white.push((reading.away_k - point[place]) / reading.std_k),
            None => white,
        }
    }

    /// White slopes of a recording in its own unknowns.
    fn white_slopes(&self, recording: usize, values: &[f64]) -> Vec<DVector<f64>> {
        let seen = &self.seen[recording];
        let slopes = seen.shown_slopes(&self.point(recording, values));
        let white = slopes.iter().map(|slope| seen.evidence.slope(slope));
        let Some((place, reading)) = self.temperature_of(seen) else { return white.collect() };
        let own = |unknown: usize| if unknown == place { 1.0 / reading.std_k } else { 0.0 };
        white.enumerate().map(|(unknown, slope)| slope.push(own(unknown))).collect()
    }

    /// The best explanation, which several questions about the recordings need; `None` where the
    /// recordings and the tolerances do not determine it.
    fn best(&self) -> Option<&MostProbable> {
        self.best.get_or_init(|| Constrained::new(self, &[], &[]).found()).as_ref()
    }

    /// The most probable damage; `None` where the recordings and the tolerances do not determine it.
    pub(crate) fn damage(&self) -> Option<DamageFit> {
        let found = self.best()?;
        let damage = self.layout.sought.len();
        let block = |of: &SymmetricMatrix| DMatrix::from_fn(damage, damage, |i, j| of.at(i, j));
        Some(DamageFit {
            estimate: found.numbers[..damage].to_vec(),
            covariance: block(&found.covariance),
            known_numbers: block(&found.information).try_inverse()?,
        })
    }

    /// Variance of a coordinate of the damage diagnosed, were some numbers known in every recording; `None`
    /// where the recordings do not determine it, or nothing of the numbers is open.
    pub(crate) fn variance_given(&self, damage: usize, numbers: &[usize]) -> Option<f64> {
        let found = self.best()?;
        let is_of = |part: &&usize| {
            let part = &self.parts[**part];
            numbers.contains(&part.place) && part.of.error().is_none()
        };
        let all: Vec<usize> = (0..self.parts.len()).collect();
        let known: Vec<usize> = all.iter().filter(is_of).copied().collect();
        if known.is_empty() {
            return None;
        }
        let covariance = &found.covariance;
        let of_known =
            DMatrix::from_fn(known.len(), known.len(), |i, j| covariance.at(known[i], known[j]));
        let cross = DVector::from_fn(known.len(), |i, _| covariance.at(damage, known[i]));
        let explained = cross.dot(&of_known.cholesky()?.solve(&cross));
        Some((covariance.at(damage, damage) - explained).max(0.0))
    }

    /// The machine as built, after so many replacements of each component, by the recordings
    /// together; `None` where they and the tolerances do not determine it.
    pub(crate) fn as_built(&self, replaced: &[u32; Component::COUNT]) -> Option<BuiltFit> {
        let found = self.best()?;
        let latest = |part: &Part| match part.of {
            Of::Built(None) => true,
            Of::Built(Some((component, times))) => times == replaced[component as usize],
            _ => false,
        };
        let damage = self.layout.sought.len();
        let mut kept: Vec<usize> =
            (0..self.parts.len()).filter(|&part| latest(&self.parts[part])).collect();
        kept.sort_by_key(|&part| self.parts[part].place);
        Some(BuiltFit {
            numbers: kept.iter().map(|&part| self.parts[part].place - damage).collect(),
            estimate: kept.iter().map(|&part| found.numbers[part]).collect(),
            covariance: DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
                found.covariance.at(kept[i], kept[j])
            }),
        })
    }

    /// Twice the negative logarithm of the probability of the best explanation, up to a constant,
    /// with the damage diagnosed at right angles to some weights; `None` where there is none.
    pub(crate) fn least_sum(&self, weights: &[Vec<f64>]) -> Option<f64> {
        let damage: Vec<usize> = (0..self.layout.sought.len()).collect();
        self.sum_of(&Constrained::new(self, &damage, weights))
    }

    /// Least sum of squares with the wear of a session at right angles to some weights; `None` where a part
    /// that they weigh has not worn since it was replaced.
    pub(crate) fn least_sum_of_wear(&self, weights: &[Vec<f64>]) -> Option<f64> {
        let latest = &self.seen.last()?.replaced;
        let sought = self.layout.sought.iter().enumerate();
        let wear = |(place, &coordinate): (usize, &usize)| {
            let component = Component::of_damage(coordinate);
            let of = Of::Wear(component, latest[component as usize]);
            self.parts.iter().position(|part| part.place == place && part.of == of)
        };
        let wear: Vec<Option<usize>> = sought.map(wear).collect();
        let weighs = |place: usize| weights.iter().any(|row| row[place] != 0.0);
        if (0..wear.len()).any(|place| weighs(place) && wear[place].is_none()) {
            return None;
        }
        // what is not weighed follows nothing, whatever its place
        let wear: Vec<usize> = wear.into_iter().map(Option::unwrap_or_default).collect();
        self.sum_of(&Constrained::new(self, &wear, weights))
    }

    fn sum_of(&self, constrained: &Constrained<'_>) -> Option<f64> {
        let found = if constrained.bound.is_empty() {
            Cow::Borrowed(self.best()?)
        } else {
            Cow::Owned(constrained.found()?)
        };
        let prior = constrained.kept.iter().zip(&found.numbers).map(|(&part, value)| {
            let std = self.parts[part].unknown.prior_std;
            std.map_or(0.0, |std| (value / std) * (value / std))
        });
        Some(dot(&found.white, &found.white) + prior.sum::<f64>())
    }

    /// The unknowns of one recording.
    fn point(&self, recording: usize, values: &[f64]) -> Vec<f64> {
        let mut point = vec![0.0; self.layout.len()];
        let of_point = |(part, _): &(&Part, &f64)| part.of.error().is_none();
        for (part, value) in self.parts.iter().zip(values).filter(of_point) {
            point[part.place] += self.share(part, recording) * value;
        }
        point
    }

    /// Place of the winding's temperature among the unknowns of a recording, and its reading.
    fn temperature_of(&self, seen: &Seen<'_>) -> Option<(usize, TemperatureReading)> {
        self.layout.temperature().zip(seen.evidence.temperature)
    }

    /// Share of an unknown that a recording has.
    fn share(&self, part: &Part, recording: usize) -> f64 {
        let seen = &self.seen[recording];
        let is_there = match part.of {
            Of::Diagnosed => seen.is_diagnosed,
            Of::Wear(component, times) if seen.replaced[component as usize] == times => {
                return seen.wear[component as usize];
            }
            Of::Wear(..) => false,
            Of::Built(None) => true,
            of @ (Of::UnitError(_) | Of::StateError(..)) => of.is_error_of(seen),
            Of::Session(session) => session == seen.session,
            Of::Recording(one) => one == recording,
            Of::Built(Some((component, times))) => seen.replaced[component as usize] == times,
        };
        f64::from(u8::from(is_there))
    }
}

/// Recordings that are not diagnosed, then those that are; `None` where some evidence is not finite.
fn seen_of<'a>(others: &[OfUnit<'a>], diagnosed: &[OfUnit<'a>]) -> Option<Vec<Seen<'a>>> {
    let all: Vec<(&OfUnit<'a>, bool)> = others
        .iter()
        .map(|one| (one, false))
        .chain(diagnosed.iter().map(|one| (one, true)))
        .collect();
    let seen = |&(one, is_diagnosed): &(&OfUnit<'a>, bool)| {
        let of_test = all.iter().filter(|(other, _)| other.test.number == one.test.number);
        let of_state = of_test.clone().filter(|(_, other)| *other == is_diagnosed);
        let of_session = of_state.clone().filter(|(other, _)| other.session == one.session);
        let with = With {
            of_unit: of_test.count() > 1,
            of_state: of_state.count() > 1,
            of_session: of_session.count() > 1,
        };
        let of_day = all.iter().filter(|(other, _)| other.session == one.session);
        let readings = of_day.filter(|(other, _)| other.evidence.temperature.is_some()).count();
        Seen::of(one, is_diagnosed, with, readings)
    };
    all.iter().map(seen).collect()
}

/// The unknowns of recordings together, the damage diagnosed first; of a recording alone the levels
/// of its numbers together.
fn parts(layout: &Layout, seen: &[Seen<'_>], is_alone: bool) -> Vec<Part> {
    let damage = |place: usize, of| {
        let unknown = Unknown { prior_std: None, reach: DAMAGE_REACH[layout.sought[place]] };
        Part { unknown, place, of }
    };
    let mut parts: Vec<Part> =
        (0..layout.sought.len()).map(|place| damage(place, Of::Diagnosed)).collect();
    for (place, &coordinate) in layout.sought.iter().enumerate() {
        let component = Component::of_damage(coordinate);
        let worn = seen.iter().filter(|one| one.wear[component as usize] > 0.0);
        for times in distinct(worn.map(|one| one.replaced[component as usize])) {
            parts.push(damage(place, Of::Wear(component, times)));
        }
    }
    for (number, place) in layout.numbers.iter().zip(layout.sought.len()..) {
        let mut add = |of, std: f64| {
            if std > 0.0 {
                parts.push(Part { unknown: number_unknown(std), place, of });
            }
        };
        let scatter = number.scatter;
        if is_alone {
            add(Of::Built(None), scatter.together());
            continue;
        }
        match number.acts.component() {
            Some(component) => {
                for times in distinct(seen.iter().map(|one| one.replaced[component as usize])) {
                    add(Of::Built(Some((component, times))), scatter.machine);
                }
            }
            None => add(Of::Built(None), scatter.machine),
        }
        if number.acts.is_temperature() {
            for session in distinct(seen.iter().map(|one| one.session)) {
                add(Of::Session(session), scatter.session);
            }
            for recording in 0..seen.len() {
                add(Of::Recording(recording), scatter.recording);
            }
        }
    }
    let unknown = Unknown { prior_std: Some(1.0), reach: f64::INFINITY };
    let of_unit = seen.iter().map(|one| Of::UnitError(one.test.number));
    let of_state = seen.iter().map(|one| Of::StateError(one.test.number, one.is_diagnosed));
    for of in distinct(of_unit.chain(of_state)) {
        let Some(to) = of.error() else { continue };
        let has_it =
            |one: &&Seen<'_>| of.is_error_of(one) && one.evidence.addition(to, 0).is_some();
        let white = seen.iter().filter(has_it).map(|one| one.evidence.len()).max().unwrap_or(0);
        parts.extend((0..white).map(|place| Part { unknown, place, of }));
    }
    parts
}

/// Each value once, in order.
fn distinct<T: Ord>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut values: Vec<T> = values.collect();
    values.sort_unstable();
    values.dedup();
    values
}

/// Recordings together, some combinations of a damage held at zero.
struct Constrained<'a> {
    joint: &'a Joint<'a>,
    /// Unknowns that stay free.
    kept: Vec<usize>,
    /// Unknowns that follow from others, each with those and their shares.
    bound: Vec<(usize, Vec<(usize, f64)>)>,
}

impl<'a> Constrained<'a> {
    /// Each row of weights takes out, of the unknowns of a damage (one a coordinate), the one that weighs
    /// most.
    fn new(joint: &'a Joint<'a>, damage: &[usize], weights: &[Vec<f64>]) -> Self {
        let bound = weights.iter().filter_map(|row| {
            let place = (0..row.len()).max_by(|&a, &b| row[a].abs().total_cmp(&row[b].abs()))?;
            let others = (0..row.len()).filter(|&n| n != place && row[n] != 0.0);
            let shares = others.map(|n| (damage[n], -row[n] / row[place])).collect();
            Some((damage[place], shares))
        });
        let bound: Vec<(usize, Vec<(usize, f64)>)> = bound.collect();
        let is_free = |place: &usize| !bound.iter().any(|(one, _)| one == place);
        let kept = (0..joint.parts.len()).filter(is_free).collect();
        Self { joint, kept, bound }
    }

    fn found(&self) -> Option<MostProbable> {
        let unknowns: Vec<Unknown> =
            self.kept.iter().map(|&part| self.joint.parts[part].unknown).collect();
        let start: Vec<f64> = self.kept.iter().map(|&part| self.joint.start[part]).collect();
        let mut data = self;
        let Ok(found) = most_probable(&mut data, &unknowns, &start);
        found
    }

    /// All unknowns.
    fn values(&self, kept: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.joint.parts.len()];
        for (&part, &value) in self.kept.iter().zip(kept) {
            values[part] = value;
        }
        for (part, shares) in &self.bound {
            values[*part] = shares.iter().map(|(of, share)| share * values[*of]).sum();
        }
        values
    }
}

impl Whitened for &Constrained<'_> {
    type Error = Infallible;

    fn residual(&mut self, kept: &[f64]) -> Result<Vec<f64>, Infallible> {
        let values = self.values(kept);
        let mut all = Vec::new();
        for session in &self.joint.sessions {
            let white = session.recordings.iter().map(|&one| self.joint.white(one, &values));
            all.extend(session.left_out(white.flat_map(|one| one.data.as_vec().clone()).collect()));
        }
        Ok(all)
    }

    fn slopes(&mut self, kept: &[f64]) -> Result<Vec<Vec<f64>>, Infallible> {
        let joint = self.joint;
        let values = self.values(kept);
        let mut rows: Vec<Vec<f64>> = vec![Vec::new(); joint.parts.len()];
        for session in &joint.sessions {
            let slopes = session.recordings.iter().map(|&one| joint.white_slopes(one, &values));
            let slopes: Vec<_> = slopes.collect();
            for (part, row) in joint.parts.iter().zip(&mut rows) {
                let mut white = Vec::new();
                for (&recording, slopes) in session.recordings.iter().zip(&slopes) {
                    let (share, begin) = (joint.share(part, recording), white.len());
                    white.resize(begin + joint.white_len(recording), 0.0);
                    let slope = match part.of.error() {
                        Some(to) => joint.seen[recording].evidence.addition(to, part.place),
                        None => slopes.get(part.place).cloned(),
                    };
                    for (value, slope) in white[begin..].iter_mut().zip(slope.iter().flatten()) {
                        *value = share * slope;
                    }
                }
                row.extend(session.left_out(white));
            }
        }
        for (bound, shares) in &self.bound {
            let follows = std::mem::take(&mut rows[*bound]);
            for (of, share) in shares {
                for (value, slope) in rows[*of].iter_mut().zip(&follows) {
                    *value += share * slope;
                }
            }
        }
        Ok(self.kept.iter().map(|&part| std::mem::take(&mut rows[part])).collect())
    }
}

impl Session {
    /// White numbers of the recordings, what differs between sessions left out.
    fn left_out(&self, white: Vec<f64>) -> Vec<f64> {
        // most unknowns are of other sessions
        let has_any = white.iter().any(|value| *value != 0.0);
        let Some(factor) = self.factor.as_ref().filter(|_| has_any) else { return white };
        let mut white = DVector::from_vec(white);
        // a factor of one and more has no zero on its diagonal
        factor.solve_lower_triangular_mut(&mut white);
        white.data.into()
    }
}
