//! How well recordings can tell each fault: what is left open at best, what it is shared with, what
//! would help.
//!
//! ```text
//! s²        variance of the damage by all recordings together
//! s_0²      the same with the evidence of those diagnosed exact
//! s_k²      the same with a number of the machine known:  V_dd − V_dk·V_kk⁻¹·V_kd
//! s_+²      the same with one more recording or reading of the kind that the bundle knows
//! ```
//!
//! # Source
//!
//! Conditional covariance of a normal law; the inference is that of `joint`.

use ema_sim::{FAULT_COUNT, FaultId};

use crate::{
    online::{observation::TEMPERATURE_STD_K, run::Run},
    report::{self, Further, Identifiability, SharedWith, WouldHelp},
    unit::{
        error::UnitError,
        evidence::{Evidence, InCommon, TemperatureReading},
        joint::{Joint, OfUnit},
        layout::Layout,
        quantities::Quantities,
        search::UnitFit,
        voltage::VoltageReading,
    },
};

/// Share of a standard deviation below which that with something more is worth telling.
const NOTABLE_SHARE: f64 = 0.9;
/// Factor on the information of a recording without noise and error.
const EXACT: f64 = 1e6;
/// Recordings as new that would be there.
const REFERENCES: usize = 4;

impl Run<'_> {
    /// How well each fault looked for can be told; nothing where the evidence determines no damage.
    pub(crate) fn identifiability(
        &self,
        error: &UnitError,
        quantities: &Quantities,
        fit: &UnitFit,
    ) -> Vec<Identifiability> {
        let placed = self.placed(self.plan.unit.as_deref(), quantities, &fit.evidence);
        let outlook = Outlook {
            layout: quantities.layout(),
            others: &placed.others,
            own: &[placed.own],
            has_unit: placed.worn.is_some(),
            start: &fit.point,
            voltages: &[error.expected_voltage(quantities, &fit.point)],
        };
        outlook.identifiability()
    }
}

/// Standard deviations of faults by their index.
type Stds = [Option<f64>; FAULT_COUNT];

/// Recordings in one state of health, as further ones would join them.
pub(crate) struct Outlook<'a> {
    pub(crate) layout: &'a Layout,
    /// Recordings that the unit was learnt from.
    pub(crate) others: &'a [OfUnit<'a>],
    pub(crate) own: &'a [OfUnit<'a>],
    /// True where there is a unit.
    pub(crate) has_unit: bool,
    /// Where the search begins, in the unknowns.
    pub(crate) start: &'a [f64],
    /// Readings that the motor's voltage would give beside each of the recordings; `None` where it was
    /// not learnt.
    pub(crate) voltages: &'a [Option<VoltageReading>],
}

impl<'a> Outlook<'a> {
    /// How well each fault looked for can be told; nothing where the evidence determines no damage.
    pub(crate) fn identifiability(&self) -> Vec<Identifiability> {
        let Some(joint) = Joint::new(self.others, self.own, self.start) else { return Vec::new() };
        let Some(damage) = joint.damage() else { return Vec::new() };
        let now = damage.stds(self.layout);
        let least = self.with_evidence(|_, evidence| exact(evidence));
        let further = self.further();
        let of_fault = |fault: FaultId| {
            let std = now[fault.index()]?;
            let notable = |other: f64| other < NOTABLE_SHARE * std;
            let best = further.iter().filter_map(|(what, stds)| {
                Some(WouldHelp { what: *what, std: stds.as_ref()?[fault.index()]? })
            });
            let best = best.min_by(|a, b| a.std.total_cmp(&b.std));
            let least_std = least.and_then(|least| least[fault.index()]).unwrap_or(std);
            Some(Identifiability {
                id: report::FaultId::ALL[fault.index()],
                std,
                least_std: least_std.min(std),
                shared_with: shared_with(self.layout, &joint, fault).filter(|one| notable(one.std)),
                would_help: best.filter(|one| notable(one.std)),
            })
        };
        FaultId::ALL.into_iter().filter_map(of_fault).collect()
    }

    /// Further recordings and readings, with the standard deviations that each would leave.
    fn further(&self) -> Vec<(Further, Option<Stds>)> {
        let of_days = self.others.iter().chain(self.own).map(|one| one.session);
        let new_day = of_days.max().unwrap_or_default() + 1;
        let mut further = Vec::new();
        for last in self.last_of_tests() {
            further.push((Further::Recording, self.with_another(last)));
            further.push((Further::Day, self.with_another(OfUnit { session: new_day, ..last })));
        }
        if !self.has_unit {
            further.push((Further::References, self.with_references(new_day)));
        }
        let evidence = || self.own.iter().map(|one| one.evidence);
        if self.layout.temperature().is_some() && evidence().any(|one| one.temperature.is_none()) {
            let reading = TemperatureReading { away_k: 0.0, std_k: TEMPERATURE_STD_K };
            let read = self.with_evidence(|_, evidence| Evidence {
                temperature: evidence.temperature.or(Some(reading)),
                ..evidence.clone()
            });
            further.push((Further::Temperature, read));
        }
        let lacks =
            |(one, to_come): (&Evidence, &Option<_>)| one.voltage.is_none() && to_come.is_some();
        if evidence().zip(self.voltages).any(lacks) {
            let read = self.with_evidence(|place, evidence| Evidence {
                voltage: evidence.voltage.clone().or_else(|| self.voltages[place].clone()),
                ..evidence.clone()
            });
            further.push((Further::Voltage, read));
        }
        further
    }

    /// The last recording of each test.
    fn last_of_tests(&self) -> Vec<OfUnit<'a>> {
        let mut last: Vec<OfUnit<'a>> = Vec::new();
        for one in self.own {
            match last.iter_mut().find(|known| known.test.number == one.test.number) {
                Some(known) => *known = *one,
                None => last.push(*one),
            }
        }
        last
    }

    fn with_another(&self, another: OfUnit<'a>) -> Option<Stds> {
        let own = [self.own, &[another]].concat();
        self.stds(self.others, &own)
    }

    /// With recordings of each test as new, of days from one on.
    fn with_references(&self, first_day: usize) -> Option<Stds> {
        let days = first_day..first_day + REFERENCES;
        let tests = self.last_of_tests();
        let of_day = |session| tests.iter().map(move |one| OfUnit { session, ..*one });
        let others: Vec<OfUnit<'_>> = days.flat_map(of_day).collect();
        self.stds(&others, self.own)
    }

    /// With other evidence of each recording.
    fn with_evidence(&self, other: impl Fn(usize, &Evidence) -> Evidence) -> Option<Stds> {
        let evidence: Vec<Evidence> =
            self.own.iter().enumerate().map(|(place, one)| other(place, one.evidence)).collect();
        let own: Vec<OfUnit<'_>> =
            self.own.iter().zip(&evidence).map(|(one, other)| one.with_evidence(other)).collect();
        self.stds(self.others, &own)
    }

    fn stds(&self, others: &[OfUnit<'_>], own: &[OfUnit<'_>]) -> Option<Stds> {
        Some(Joint::new(others, own, self.start)?.damage()?.stds(self.layout))
    }
}

/// Evidence of the same recording without noise and error of the model.
fn exact(evidence: &Evidence) -> Evidence {
    let voltage = evidence.voltage.clone().map(|mut voltage| {
        voltage.covariance /= EXACT;
        voltage.in_common = InCommon::default();
        voltage
    });
    Evidence {
        information: EXACT * &evidence.information,
        descent: evidence.descent.iter().map(|value| EXACT * value).collect(),
        in_common: InCommon::default(),
        embedded: None,
        voltage,
        ..evidence.clone()
    }
}

/// The number that would lower the standard deviation of a fault most, were it known: of all phases,
/// and in both directions, where it has several parts.
fn shared_with(layout: &Layout, joint: &Joint<'_>, fault: FaultId) -> Option<SharedWith> {
    let damage = layout.places_of(fault);
    let mut keys: Vec<&str> = layout.numbers.iter().map(|number| whole_key(&number.key)).collect();
    keys.sort_unstable();
    keys.dedup();
    let known = |key: &str| {
        let numbers = (0..layout.numbers.len())
            .filter(|&n| whole_key(&layout.numbers[n].key) == key)
            .map(|n| layout.sought.len() + n);
        let numbers: Vec<usize> = numbers.collect();
        let variances: Option<Vec<f64>> =
            damage.iter().map(|&one| joint.variance_given(one, &numbers)).collect();
        let sum: f64 = variances?.iter().sum();
        let std = (sum / damage.len().max(1) as f64).sqrt();
        Some(SharedWith { key: key.to_owned(), std })
    };
    keys.into_iter().filter_map(known).min_by(|a, b| a.std.total_cmp(&b.std))
}

/// Key of a number in `[tolerance]`, without the phase or direction that it is of.
fn whole_key(key: &str) -> &str {
    match key.rsplit_once('.') {
        Some((whole, "a" | "b" | "c" | "cos" | "sin")) => whole,
        _ => key,
    }
}
