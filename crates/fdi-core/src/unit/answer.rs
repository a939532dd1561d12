//! Answer to a recording of a machine whose numbers are known to their tolerances.

use ema_sim::EffectId;
use inference::{NotPositiveDefinite, dot};
use nalgebra::DMatrix;

use crate::{
    offline::{bundle::StartAngle, factor::joined},
    online::{
        answer::loud_notice, damage::TRAINED_LEVEL, error::DiagnoseError, noise_level::Noise,
        outcome::MISFIT_DEVIATIONS, posterior::Posterior, run::Run,
    },
    report::{
        Fault, FaultId, Fidelity, Finding, Fit, Method, NoiseSource, Notice, NoticeCode,
        RecordDiagnosis, Status, Verdict,
    },
    unit::{
        error::UnitError,
        finding::{Findings, History, Since},
        joint::{DamageFit, Joint, OfUnit},
        layout::Layout,
        learnt_unit::LearntUnit,
        quantities::Quantities,
        search::{Explained, Observed, UnitFit, UnitSearchError, explain},
    },
};

/// Levels of k1 to k6 from which damage is to be watched: a machine is healthy where none can be
/// beyond. Below what a data sheet's tolerances leave open of one recording, "healthy" could never
/// be said.
const WATCH_LEVELS: [f64; 6] = [0.5, 0.02, 0.15, 0.15, 0.15, 0.10];
/// Levels of changes since a unit was new, of which its references leave less open.
const WATCH_CHANGES: [f64; 6] = [0.10, 0.002, 0.02, 0.02, 0.02, 0.02];

/// Standard deviations by which damage is beyond that of the units whose error was learnt.
const SEVERE_DEVIATIONS: f64 = 1.0;

/// Why tolerances cannot be used on a recording, in words.
pub(crate) type Reason = String;

/// Reason for which a recording is answered without tolerances.
pub(crate) fn beyond_incipient(has_unit: bool) -> Reason {
    let reason = "no machine within its tolerances with incipient faults explains it";
    if has_unit {
        format!("{reason}; the unit is not used, so that levels are no changes since it was new")
    } else {
        reason.to_owned()
    }
}

/// Answer within the tolerances.
pub(crate) struct Within {
    pub(crate) answer: RecordDiagnosis,
    pub(crate) posterior: Posterior,
    /// True where noise and learnt error explain the residual's size, whatever its form is.
    pub(crate) is_to_the_noise: bool,
    /// Time by which the command begins later than it was taken to, and its standard deviation, s;
    /// `None` where it was known.
    pub(crate) late_s: Option<(f64, f64)>,
}

impl Within {
    /// An answer whose damage is known less well by some covariance, in the same
    /// coordinates: what is detected stays so.
    pub(crate) fn widened(mut self, by: &DMatrix<f64>) -> Self {
        self.posterior.covariance += by;
        if let Some(explained) = &mut self.posterior.explained {
            explained.is_widened = true;
        }
        for (fault, wide) in self.answer.faults.iter_mut().zip(self.posterior.faults()) {
            if fault.value.is_some() {
                *fault = Fault { detected: fault.detected, ..wide };
            }
        }
        self.answer.covariance = self.posterior.report_covariance();
        self
    }
}

impl<'a> Run<'a> {
    /// The error on machines within the tolerances and the start angle, where they are used; else
    /// why not, if they were asked for.
    pub(crate) fn within_tolerances(&self) -> Result<(&'a UnitError, f64), Option<Reason>> {
        self.plan.tolerance.map_err(|reason| reason.map(str::to_owned))?;
        let because = |reason: &str| Err(Some(reason.to_owned()));
        if self.learnt.references.is_some() {
            return because("levels are against reference recordings");
        }
        if self.learnt.encoder.is_some() {
            return because("few numbers are looked at in place of the signal");
        }
        match self.observation.start_angle_rad {
            Some(angle_rad) => Ok((self.unit_error(angle_rad).map_err(Some)?, angle_rad)),
            None => because("the rotor's start angle is not known"),
        }
    }

    /// The error on units for a start of the rotor, or why tolerances cannot be used.
    fn unit_error(&self, angle_rad: f64) -> Result<&'a UnitError, Reason> {
        let bundle = &self.learnt.bundle;
        if bundle.experiment.tolerance.is_empty() {
            return Err("its model file lists no tolerance".to_owned());
        }
        if bundle.units.is_empty() {
            return Err("the bundle has not learnt machines within the tolerances".to_owned());
        }
        let own_rad = bundle.experiment.scenario.start_angle_rad;
        let of = |start| bundle.units.iter().find(|error| error.start == start);
        let at_own =
            if self.learnt.same_start(angle_rad, own_rad) { of(StartAngle::Zero) } else { None };
        at_own.or_else(|| of(StartAngle::Any)).ok_or_else(|| {
            "the bundle has not learnt machines within the tolerances from this start angle"
                .to_owned()
        })
    }

    /// Diagnoses a machine within its tolerances, searching from some damage looked for on, else from
    /// a machine as new.
    pub(crate) fn diagnose_unit(
        &self,
        error: &UnitError,
        start_angle_rad: f64,
        damage: &[f64],
    ) -> Result<Within, DiagnoseError> {
        let experiment = self.experiment();
        let quantities = self.learnt.quantities();
        let unit_noise = self.learnt.unit_noise(self.observation.phase_rate_hz);
        let told = self.told_noise(self.observation.noise_beside_gains_a());
        let temperature = self.learnt.temperature_reading(self.observation);
        let effects = self.learnt.effect_slopes(start_angle_rad).map_err(UnitSearchError::from)?;
        let slopes = self.learnt.nominal_slopes(error, start_angle_rad);
        let slopes = slopes.map_err(UnitSearchError::from)?;
        let fitted = |level_a: f64| {
            let noise = unit_noise.scaled(level_a * level_a);
            let signal_a = &self.observation.signal_a;
            explain(
                experiment,
                &quantities,
                error,
                &Observed {
                    signal_a,
                    start_angle_rad,
                    shares: self.observation.sensor_shares.as_ref(),
                    noise: &noise,
                    temperature,
                    start_std_s: self.observation.start_std_s(),
                    damage,
                    nominal_slopes: Some(&slopes),
                },
                &effects,
                self.plan.budget.unit,
            )
        };
        let first = fitted(told.map_or(self.learnt.bundle.noise_a, |noise| noise.level_a))?;
        let (noise, mut fit) = match told {
            Some(noise) if is_adequate(error, &first) || !is_severe(&first) => (noise, first),
            // of damage beyond that of the units learnt the error is larger: the residual tells it
            _ => {
                let level_a = self.likeliest_noise(error, &first)?;
                let mut fit = fitted(level_a)?;
                fit.evaluations += first.evaluations;
                (Noise { level_a, source: NoiseSource::Residual }, fit)
            }
        };
        if quantities.layout().sought.iter().zip(&fit.point).any(is_unlearnt) {
            // there the model's own error may have the form of anything
            fit.evidence.unmodelled.clear();
        }
        let told = if is_adequate(error, &fit) {
            self.read_voltage(error, &quantities, start_angle_rad, &mut fit)?
        } else {
            self.voltage_of_unexplained().into_iter().collect()
        };
        let (mut answer, posterior) = self.unit_answer(error, &quantities, noise, &fit)?;
        answer.notices.extend(told);
        if self.plan.identifiability && answer.is_believed() {
            answer.identifiability = self.identifiability(error, &quantities, &fit);
        }
        let (is_to_the_noise, late_s) = (is_adequate(error, &fit), fit.late_s);
        Ok(Within { answer, posterior, is_to_the_noise, late_s })
    }

    /// The noise level that makes a residual most likely, with the bundle's level as a prior, A.
    pub(crate) fn likeliest_noise(
        &self,
        error: &UnitError,
        fit: &UnitFit,
    ) -> Result<f64, NotPositiveDefinite> {
        let unit_noise = self.learnt.unit_noise(self.observation.phase_rate_hz);
        let covariance = error.covariance_of(fit.wideness);
        self.likeliest_level(|level_a| {
            let factor = joined(&covariance, &unit_noise.scaled(level_a * level_a)).cholesky()?;
            let mut white = fit.residual_a.clone();
            factor.whiten(&mut white);
            Ok(dot(&white, &white) + factor.log_determinant())
        })
    }

    fn unit_answer(
        &self,
        error: &UnitError,
        quantities: &Quantities,
        noise: Noise,
        fit: &UnitFit,
    ) -> Result<(RecordDiagnosis, Posterior), DiagnoseError> {
        let layout = quantities.layout();
        let to_the_noise = is_adequate(error, fit);
        let unfinished = fit.cut_short || (!fit.converged && !to_the_noise);
        let unit = self.plan.unit.as_deref().filter(|_| to_the_noise);
        let unmodelled = &fit.evidence.unmodelled;
        let unmodelled_as_new = unit.is_some_and(LearntUnit::is_unmodelled_as_new);
        let uneven = self.uneven_sensors(layout);
        let adequate =
            to_the_noise && uneven.is_none() && (unmodelled.is_empty() || unmodelled_as_new);
        let (history, damage) = self.with_unit(unit, quantities, fit)?;
        let explained = to_the_noise.then(|| Explained::of(fit, error, quantities));
        let found = Conclusion::of(layout, &history, damage, explained, unfinished);
        let limits = self.limits(noise, &found.faults);
        let is_loud = limits.iter().any(|notice| notice.code == NoticeCode::NoiseAboveBundle);
        let verdict = if unfinished {
            Verdict::Undetermined
        } else if !adequate {
            Verdict::ModelInadequate
        } else {
            found.verdict(is_loud)
        };
        let mut notices = match End::of(unfinished, fit).notice() {
            Some(notice) => vec![notice],
            None => found.direction_notice().into_iter().collect(),
        };
        notices.extend(found.hidden_notice(verdict));
        let Conclusion { posterior, faults, findings, .. } = found;
        notices.extend(limits);
        notices.extend(unit.map(unit_notice));
        notices.extend(unmodelled_notice(unmodelled, unmodelled_as_new));
        notices.extend(uneven);
        (self.watch.answer)(&self.observation.signal_a, &fit.residual_a);
        let answer = RecordDiagnosis {
            recording_sha256: None,
            recording: String::new(),
            actuator_id: None,
            date: None,
            operator: None,
            status: if adequate && !unfinished { Status::Ok } else { Status::Partial },
            verdict,
            bundle: None,
            method: Method::Gls,
            fidelity: Fidelity::Low,
            evaluations: fit.evaluations,
            elapsed_s: None,
            discrepancy: self.discrepancy(&fit.residual_a),
            fit: Fit {
                rms_a: (dot(&fit.residual_a, &fit.residual_a) / fit.residual_a.len() as f64).sqrt(),
                noise_floor_a: fit.floor_a,
                noise_a: noise.level_a,
                noise_source: noise.source,
                adequate,
            },
            faults,
            findings,
            identifiability: Vec::new(),
            action: None,
            covariance: posterior.report_covariance(),
            notices,
            together: Vec::new(),
        };
        Ok((answer, posterior))
    }

    /// A recording with those that its unit was learnt from, and the damage that they show
    /// together.
    fn with_unit<'q>(
        &'q self,
        unit: Option<&'q LearntUnit>,
        quantities: &'q Quantities,
        fit: &'q UnitFit,
    ) -> Result<(History<'q>, DamageFit), DiagnoseError> {
        if let Some(known) = unit.and_then(|unit| unit.with_evidence(&fit.evidence)) {
            return Err(DiagnoseError::OwnReference { learnt_as: known.name.clone() });
        }
        let placed = self.placed(unit, quantities, &fit.evidence);
        let joint = placed.joint(&fit.point).ok_or(UnitSearchError::Undetermined)?;
        let alone = DamageFit::from(fit);
        let Some((worn, nth)) = placed.worn else {
            // the search has seen the current alone
            let alone = match fit.evidence.voltage {
                Some(_) => joint.damage().ok_or(UnitSearchError::Undetermined)?,
                None => alone,
            };
            return Ok((History { joint, worn: None, since: Since::AsBuilt, nth: 1 }, alone));
        };
        let damage = DamageFit {
            // what the recording itself leaves open is the same with others beside it
            known_numbers: alone.known_numbers,
            ..joint.damage().ok_or(UnitSearchError::Undetermined)?
        };
        let own = OfUnit { wear: worn, ..placed.own };
        let worn = (nth > 1).then(|| Joint::worn(&placed.others, &[own], &fit.point)).flatten();
        Ok((History { joint, worn, since: Since::References, nth }, damage))
    }
}

impl Run<'_> {
    /// Notices of a recording that the learnt error does not know: its rate, its noise, its damage,
    /// its temperature.
    fn limits(&self, noise: Noise, faults: &[Fault]) -> Vec<Notice> {
        let beyond = |fault: &&Fault| {
            fault.detected == Some(true) && fault.value.is_some_and(|level| level > TRAINED_LEVEL)
        };
        let levels = &faults[..FaultId::K7 as usize];
        let damage = levels.iter().find(beyond).map(|fault| Notice {
            code: NoticeCode::OutsideTraining,
            message: format!(
                "{} lies beyond the {TRAINED_LEVEL} up to which the error of machines within \
                 tolerances is learnt; the interval may be too narrow",
                fault.id
            ),
        });
        let is_read = self.observation.winding_temperature_k.is_some();
        let is_unused = is_read && self.experiment().temperature.is_none();
        let temperature = is_unused.then(|| Notice {
            code: NoticeCode::TemperatureUnused,
            message: "the winding's temperature was read and is not used: the model file has no \
                      `[temperature]`"
                .to_owned(),
        });
        let expected_a = self.learnt.bundle.noise_a;
        let all = [self.coarse_phases(), loud_notice(noise, expected_a), damage, temperature];
        all.into_iter().flatten().collect()
    }
}

/// Levels and findings by the damage that recordings show.
pub(crate) struct Conclusion {
    pub(crate) posterior: Posterior,
    pub(crate) faults: Vec<Fault>,
    pub(crate) findings: Vec<Finding>,
    /// Faults that could be at or beyond their excluded levels, undetected, each with how far.
    pub(crate) hidden: Vec<(FaultId, f64)>,
    since: Since,
}

impl Conclusion {
    /// Nothing is detected by a search that did not finish.
    pub(crate) fn of(
        layout: &Layout,
        history: &History<'_>,
        damage: DamageFit,
        explained: Option<Explained>,
        unfinished: bool,
    ) -> Self {
        let findings = Findings::of(layout, history, &damage);
        let posterior = Posterior {
            indices: layout.sought.clone(),
            estimate: damage.estimate,
            covariance: damage.covariance,
            explained,
        };
        let mut faults = posterior.faults();
        for fault in &mut faults {
            if fault.detected.is_some() {
                fault.detected = (!unfinished).then(|| findings.detected.contains(&fault.id));
            }
        }
        if faults[5].value.is_some() && faults[5].detected != Some(true) {
            faults[6] = Fault::undetermined(FaultId::K7);
        }
        let since = history.since;
        let hidden = hidden(&faults, since);
        Self { posterior, faults, findings: findings.all, hidden, since }
    }

    /// The verdict, where the model explains the recordings.
    pub(crate) fn verdict(&self, is_loud: bool) -> Verdict {
        if self.findings.iter().any(|finding| finding.detected) {
            Verdict::Faulty
        } else if self.hidden.is_empty() && !is_loud {
            Verdict::Healthy
        } else {
            Verdict::Undetermined
        }
    }

    /// The notice that an eccentricity that is not detected has no direction.
    pub(crate) fn direction_notice(&self) -> Option<Notice> {
        let is_open = self.faults[5].value.is_some() && self.faults[6].value.is_none();
        is_open.then(|| Notice {
            code: NoticeCode::PhaseUndetermined,
            message: "no eccentricity is detected, so that it has no direction (k7)".to_owned(),
        })
    }

    /// The notice of levels that stay open, where the verdict is that something does.
    pub(crate) fn hidden_notice(&self, verdict: Verdict) -> Option<Notice> {
        let is_open = verdict == Verdict::Undetermined && !self.hidden.is_empty();
        is_open.then(|| hidden_notice(&self.hidden, self.since))
    }
}

/// True where the model explains the recording.
fn is_adequate(error: &UnitError, fit: &UnitFit) -> bool {
    fit.misfit <= error.largest_misfit(MISFIT_DEVIATIONS)
}

/// True where a coordinate of damage is beyond its excluded level, and beyond that of the units whose
/// error was learnt.
pub(crate) fn is_unlearnt((&coordinate, level): (&usize, &f64)) -> bool {
    // both coordinates of eccentricity have the excluded level of k6
    let watch = WATCH_LEVELS[coordinate.min(WATCH_LEVELS.len() - 1)];
    level.abs() > watch.max(TRAINED_LEVEL)
}

/// True where damage is beyond that of the units whose error was learnt.
pub(crate) fn is_severe(fit: &UnitFit) -> bool {
    let stds = fit.covariance.diagonal().map(f64::sqrt);
    let mut levels = fit.point.iter().zip(&stds);
    levels.any(|(level, std)| level.abs() > TRAINED_LEVEL + SEVERE_DEVIATIONS * std)
}

/// The notice that levels are changes of a unit.
fn unit_notice(unit: &LearntUnit) -> Notice {
    let (references, sessions) = (unit.references(), unit.sessions());
    let plural = |count: usize| if count == 1 { "" } else { "s" };
    Notice {
        code: NoticeCode::ReferenceUsed,
        message: format!(
            "levels are changes since {references} recording{} as new of {}, {sessions} session{} \
             in all",
            plural(references),
            unit.actuator_id().map_or("this unit".to_owned(), |id| format!("`{id}`")),
            plural(sessions),
        ),
    }
}

/// The notice that a residual has the form of effects.
fn unmodelled_notice(unmodelled: &[EffectId], as_new: bool) -> Option<Notice> {
    let named: Vec<String> = unmodelled.iter().map(|id| id.info().label()).collect();
    let [others @ .., last] = &named[..] else { return None };
    let named =
        if others.is_empty() { last.clone() } else { format!("{} or {last}", others.join(", ")) };
    let so = if as_new {
        "its recordings as new do so too, so that it is no change"
    } else {
        "a part of it may have been taken for damage, so that the levels are not to be believed"
    };
    Some(Notice {
        code: NoticeCode::UnmodelledPhysics,
        message: format!(
            "the residual has the form of {named}, which the model file does not have; {so}"
        ),
    })
}

/// Faults that could be at or beyond their excluded levels, undetected.
fn hidden(faults: &[Fault], since: Since) -> Vec<(FaultId, f64)> {
    let levels = match since {
        Since::AsBuilt => &WATCH_LEVELS,
        Since::References => &WATCH_CHANGES,
    };
    let beyond = |(fault, watch): (&Fault, &f64)| {
        let [_, most] = fault.interval_95?;
        (fault.detected != Some(true) && most >= *watch).then_some((fault.id, most))
    };
    faults.iter().zip(levels).filter_map(beyond).collect()
}

/// How a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Finished,
    /// The evaluations were spent.
    Spent,
    /// The steps led to no explanation.
    Unexplained,
}

impl End {
    fn of(unfinished: bool, fit: &UnitFit) -> Self {
        match (unfinished, fit.cut_short) {
            (false, _) => Self::Finished,
            (true, true) => Self::Spent,
            (true, false) => Self::Unexplained,
        }
    }

    /// The notice of a search that is not finished.
    fn notice(self) -> Option<Notice> {
        let ended = match self {
            Self::Finished => return None,
            Self::Spent => "when the evaluations allowed were spent",
            Self::Unexplained => "where the model does not explain the recording",
        };
        Some(Notice {
            code: NoticeCode::SearchUnfinished,
            message: format!(
                "the search ended {ended}; the levels are where it stopped, and nothing is decided"
            ),
        })
    }
}

fn hidden_notice(hidden: &[(FaultId, f64)], since: Since) -> Notice {
    let levels: Vec<String> =
        hidden.iter().map(|(id, most)| format!("{id} up to {most:.3}")).collect();
    let (what, would_tell) = match since {
        Since::AsBuilt => ("the tolerances leave", "recordings of the same unit as new"),
        Since::References => (
            "sessions of one unit leave",
            "recordings of other days, or the winding's temperature,",
        ),
    };
    let levels = levels.join(", ");
    Notice {
        code: NoticeCode::TolerancesHideLevels,
        message: format!("{what} open {levels}; {would_tell} would tell"),
    }
}
