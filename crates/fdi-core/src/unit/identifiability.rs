//! How well a recording can tell each fault: what is left open at best, what it is shared with, what
//! would help.
//!
//! ```text
//! s²        variance of the damage by all recordings together
//! s_0²      the same with the recording's own evidence exact
//! s_k²      the same with a number of the machine known:  V_dd − V_dk·V_kk⁻¹·V_kd
//! s_+²      the same with one more recording or reading of the kind that the bundle knows
//! ```
//!
//! # Source
//!
//! Conditional covariance of a normal law; the inference is that of `joint`.

use ema_sim::FaultId;

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
        let unit = self.plan.unit.as_deref();
        let placed = self.placed(unit, quantities, &fit.evidence);
        let Some(joint) = placed.joint(&fit.point) else { return Vec::new() };
        let layout = quantities.layout();
        let stds = |joint: &Joint<'_>| Some(joint.damage()?.stds(layout));
        let with = |evidence: &Evidence| stds(&placed.with_evidence(evidence, &fit.point)?);
        let of_day = |session: usize| {
            let mut again = placed.own;
            again.session = session;
            again
        };
        let with_another = |session: usize| {
            let both = [placed.own, of_day(session)];
            stds(&Joint::new(&placed.others, &both, &fit.point)?)
        };
        let with_references = || {
            let own = placed.own.session;
            let others: Vec<OfUnit<'_>> = (own + 1..=own + REFERENCES).map(of_day).collect();
            stds(&Joint::new(&others, &[placed.own], &fit.point)?)
        };
        let of_days = placed.others.iter().map(|one| one.session).chain([placed.own.session]);
        let new_day = of_days.max().unwrap_or_default() + 1;
        let mut further = vec![
            (Further::Recording, with_another(placed.own.session)),
            (Further::Day, with_another(new_day)),
        ];
        if placed.worn.is_none() {
            further.push((Further::References, with_references()));
        }
        if fit.evidence.temperature.is_none() && layout.temperature().is_some() {
            let reading = TemperatureReading { away_k: 0.0, std_k: TEMPERATURE_STD_K };
            let evidence = Evidence { temperature: Some(reading), ..fit.evidence.clone() };
            further.push((Further::Temperature, with(&evidence)));
        }
        if fit.evidence.voltage.is_none() {
            let numbers = quantities.volts_at(&fit.point);
            let voltage = error.voltage.as_ref().and_then(|one| one.expected(numbers));
            if voltage.is_some() {
                let evidence = Evidence { voltage, ..fit.evidence.clone() };
                further.push((Further::Voltage, with(&evidence)));
            }
        }
        let Some(now) = stds(&joint) else { return Vec::new() };
        let least = with(&exact(&fit.evidence));
        let of_fault = |fault: FaultId| {
            let std = now[fault.index()]?;
            let notable = |other: f64| other < NOTABLE_SHARE * std;
            let best = further.iter().filter_map(|(what, stds)| {
                Some(WouldHelp { what: *what, std: stds.as_ref()?[fault.index()]? })
            });
            let best = best.min_by(|a, b| a.std.total_cmp(&b.std));
            Some(Identifiability {
                id: report::FaultId::ALL[fault.index()],
                std,
                least_std: least
                    .as_ref()
                    .and_then(|least| least[fault.index()])
                    .unwrap_or(std)
                    .min(std),
                shared_with: shared_with(layout, &joint, fault).filter(|one| notable(one.std)),
                would_help: best.filter(|one| notable(one.std)),
            })
        };
        FaultId::ALL.into_iter().filter_map(of_fault).collect()
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
