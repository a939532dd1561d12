//! The answer as JSON.

use std::collections::BTreeMap;

use fdi_core::{
    ema_sim::{Geometry, Role, model_file::MachineModel},
    report::{
        CoordinateShare, EffectFinding, EffectNumber, Explanation, ExplanationVerdict,
        FaultBeforeAfter, Holdout, NominalChange, NumberFinding, Prediction, RecordFit, Remainder,
        SCHEMA_VERSION, Sensitivity,
    },
};
use greybox::{
    Explained, FaultChange, Finding, NoiseFloor, NumberFit, Observation, RecordChange,
    SmallestNamed, Use, Verdict, WrongNumber,
};

use super::{evidence, sentences, signals};
use crate::{GlobalArgs, stamp};

pub(super) fn document(
    explained: &Explained,
    prediction: Option<Prediction>,
    model: &MachineModel,
    global: &GlobalArgs,
    elapsed_s: Option<f64>,
) -> Explanation {
    let verdict = match explained.verdict {
        Verdict::Adequate => ExplanationVerdict::Adequate,
        Verdict::Named => ExplanationVerdict::Named,
        Verdict::NamedWithRemainder => ExplanationVerdict::NamedWithRemainder,
        Verdict::OneOf => ExplanationVerdict::OneOf,
        Verdict::Unknown => ExplanationVerdict::Unknown,
        Verdict::Absorbed => ExplanationVerdict::Absorbed,
        Verdict::Inconclusive => ExplanationVerdict::Inconclusive,
    };
    let judged = |(rms, floor): ([f64; 2], NoiseFloor)| holdout(rms, &floor, explained.drive_unit);
    let signals = signals::findings(&explained.signals);
    let mut answer = Explanation {
        schema_version: SCHEMA_VERSION,
        tool: format!("fdi {}", env!("CARGO_PKG_VERSION")),
        seed: global.seed,
        stamp: global.stamp.then(stamp::now),
        model: model.name().unwrap_or("unnamed").to_owned(),
        prediction,
        verdict,
        sentence: String::new(),
        signal: signals::decisive(&signals),
        signals,
        effects: explained.effects.iter().map(finding).collect(),
        alternatives: explained.alternatives.iter().map(finding).collect(),
        numbers: explained.numbers.iter().map(number).collect(),
        absorbed: absorbed(explained),
        holdout: explained.holdout_rms.zip(explained.noise_floor).map(judged),
        faults: explained.faults.iter().map(|f| (f.key.clone(), fault(f))).collect(),
        nominal: explained
            .rough
            .iter()
            .map(|number| {
                let NumberFit { key, nominal, fitted } = number;
                (key.clone(), NominalChange { nominal: *nominal, fitted: *fitted })
            })
            .collect(),
        records: explained.records.iter().map(record).collect(),
        remainder: explained.remainder.as_ref().map(|remainder| Remainder {
            shares: remainder
                .shares
                .iter()
                .map(|one| CoordinateShare {
                    coordinate: one.coordinate.to_owned(),
                    share: one.share,
                })
                .collect(),
            curve: remainder.curve.clone(),
            kurtosis: remainder.kurtosis,
        }),
        sensitivity: explained
            .smallest_named_90
            .iter()
            .map(|smallest| sensitivity(smallest, model.geometry()))
            .collect(),
        hypotheses: evidence::hypotheses(explained),
        curves: explained.curves.iter().map(evidence::curve).collect(),
        elapsed_s,
    };
    answer.sentence = sentences::sentence(&answer, explained.reason.as_deref());
    answer
}

/// Model that predicted the recordings.
pub(super) fn prediction(observation: Observation) -> Option<Prediction> {
    match observation {
        Observation::Ideal => Some(Prediction::Ideal),
        Observation::Low => Some(Prediction::Low),
        Observation::High => Some(Prediction::High),
        _ => None,
    }
}

/// The model that a word of the options asks for.
pub(crate) fn observation(asked: Prediction) -> Option<Observation> {
    match asked {
        Prediction::Ideal => Some(Observation::Ideal),
        Prediction::Low => Some(Observation::Low),
        Prediction::High => Some(Observation::High),
        _ => None,
    }
}

/// The smallest size that a recording would have named.
fn sensitivity(smallest: &SmallestNamed, geometry: Geometry) -> Sensitivity {
    let info = smallest.effect.id().info();
    let own = info.parameters.iter().find(|parameter| parameter.key(geometry) == smallest.key);
    let shape = info.parameters.iter().zip(smallest.effect.values());
    let shape =
        shape.filter(|(parameter, value)| parameter.role() != Role::Amplitude && **value != 0.0);
    let shape = shape.map(|(parameter, value)| (parameter.key(geometry).to_owned(), *value));
    Sensitivity {
        id: info.symbol.to_owned(),
        parameter: smallest.key.clone(),
        smallest_named_90: smallest.size,
        unit: own.map_or("", |parameter| parameter.quantity().key_ending(geometry)).to_owned(),
        shape: shape.collect(),
    }
}

/// A fault level without and with what was found.
fn fault(change: &FaultChange) -> FaultBeforeAfter {
    let FaultChange { before, after, ambiguous_with, .. } = change;
    FaultBeforeAfter {
        before: before.value,
        std_before: before.std,
        interval_95_before: before.interval_95,
        after: after.value,
        std_after: after.std,
        interval_95_after: after.interval_95,
        ambiguous_with: ambiguous_with.clone(),
    }
}

/// Effects that damage or tolerance imitate. Of one that was found, as E19, a shape may be such (a
/// gain) and another not (an offset): it is not among them.
fn absorbed(explained: &Explained) -> Vec<String> {
    let found = || explained.effects.iter().chain(&explained.alternatives);
    let is_found = |id| found().any(|finding| finding.effect.id() == id);
    let absorbed = explained.absorbed.iter().filter(|id| !is_found(**id));
    absorbed.map(|id| id.info().symbol.to_owned()).collect()
}

/// The residual of recordings that were not fitted, before and after.
pub(crate) fn holdout(rms: [f64; 2], noise_floor: &NoiseFloor, unit: &str) -> Holdout {
    let [rms_before, rms_after] = rms;
    Holdout {
        rms_before,
        rms_after,
        noise_floor: noise_floor.rms,
        gap_closed_frac: noise_floor.closed_gap_frac(rms),
        unit: unit.to_owned(),
    }
}

fn record(change: &RecordChange) -> RecordFit {
    let RecordChange { role, before, after } = change;
    let role = match role {
        Use::Train => "train",
        Use::Holdout => "holdout",
        Use::Repeat => "repeat",
    };
    RecordFit {
        recording: before.record.clone(),
        role: role.to_owned(),
        rms_before: before.rms,
        rms_after: after.rms,
        fit_percent_before: before.fit_percent,
        fit_percent_after: after.fit_percent,
        whiteness_p: after.whiteness_p,
    }
}

fn number(wrong: &WrongNumber) -> NumberFinding {
    NumberFinding {
        id: format!("number:{}", wrong.key),
        nominal: wrong.nominal,
        value: wrong.value,
        interval_95: wrong.interval_95,
        factor: (wrong.nominal != 0.0).then(|| wrong.value / wrong.nominal),
        tolerance: wrong.tolerance,
        p_familywise: wrong.p_familywise,
        holdout_gain_nats: wrong.holdout_gain_nats,
        holdout_gain_se: wrong.holdout_gain_se,
    }
}

fn finding(finding: &Finding) -> EffectFinding {
    let (effect, info) = (&finding.effect, finding.effect.id().info());
    let mut parameters = BTreeMap::new();
    for (parameter, value) in info.parameters.iter().zip(effect.values()) {
        let key = parameter.key(effect.geometry());
        let interval = finding.interval_95.iter().find(|fitted| fitted.key == key);
        let interval_95 = interval.map(|interval| interval.interval_95);
        let number = EffectNumber { value: *value, interval_95 };
        parameters.insert(key.to_owned(), number);
    }
    EffectFinding {
        id: info.symbol.to_owned(),
        name: info.name.to_owned(),
        port: info.port.name().to_owned(),
        class: info.class.name().to_owned(),
        parameters,
        p_familywise: finding.p_familywise,
        holdout_gain_nats: finding.holdout_gain_nats,
        holdout_gain_se: finding.holdout_gain_se,
        separated_by: info.separated_by.to_owned(),
        instead_of: finding.instead_of.map(|id| id.info().symbol.to_owned()),
    }
}
