//! Documents of what was found of a model of one's own.

use own_model::{
    Estimate, NamedCause, OwnCalibration, OwnExplanation, OwnProposal, OwnVerdict, SignalFit,
};
use serde_json::{Map, Value, json};

/// Document of an explanation.
pub(crate) fn explanation(model: &str, told: &OwnExplanation) -> String {
    let set = |set: &own_model::ComparedSet| json!({ "causes": set.causes, "probability": set.probability });
    written(&json!({
        "task": "explain",
        "model": model,
        "verdict": told.verdict.code(),
        "sentence": sentence(told),
        "causes": told.causes.iter().map(cause).collect::<Vec<Value>>(),
        "numbers": told.numbers.iter().map(estimate).collect::<Vec<Value>>(),
        "sets": told.sets.iter().map(set).collect::<Vec<Value>>(),
        "signals": told.signals.iter().map(signal).collect::<Vec<Value>>(),
        "holdout_gain_ratio": told.holdout_gain(),
        "runs": told.runs,
    }))
}

/// Document of a calibration.
pub(crate) fn calibration(model: &str, told: &OwnCalibration) -> String {
    let number = |(number, left): (&Estimate, &f64)| {
        let mut fields = estimate(number);
        if let Value::Object(fields) = &mut fields {
            fields.insert("left_of_prior_ratio".to_owned(), json!(left));
        }
        fields
    };
    let numbers = told.numbers.iter().zip(&told.left_of_prior).map(number);
    let each = told.numbers.iter().map(|n| format!("{} {:.4} ± {:.2}", n.key, n.value, n.std));
    written(&json!({
        "task": "calibrate",
        "model": model,
        "sentence": each.collect::<Vec<String>>().join(", "),
        "numbers": numbers.collect::<Vec<Value>>(),
        "correlations": told.correlations,
        "signals": told.signals.iter().map(signal).collect::<Vec<Value>>(),
        "runs": told.runs,
    }))
}

/// Document of a proposal.
pub(crate) fn proposal(model: &str, told: &OwnProposal) -> String {
    let pair = |pair: &own_model::SetSeparation| json!({ "causes": pair.causes, "separation": pair.separation });
    let test = |test: &own_model::ProposedTest| {
        let pairs: Vec<Value> = test.pairs.iter().map(pair).collect();
        json!({ "name": test.name, "least_separation": test.least(), "pairs": pairs })
    };
    let sentence = match told.tests.first().and_then(|test| Some((&test.name, test.least()?))) {
        Some((name, least)) => format!("`{name}` separates best: at least {least:.1}"),
        None => "nothing is open between causes".to_owned(),
    };
    written(&json!({
        "task": "propose",
        "model": model,
        "sentence": sentence,
        "tests": told.tests.iter().map(test).collect::<Vec<Value>>(),
        "runs": told.runs,
    }))
}

fn written(document: &Value) -> String {
    // what is no number has no place in JSON: it is null
    format!("{document:#}\n")
}

fn sentence(told: &OwnExplanation) -> String {
    let names: Vec<String> = told.causes.iter().map(in_words).collect();
    let names = names.join("; ");
    match told.verdict {
        OwnVerdict::Adequate => "the model explains the recordings to the noise".to_owned(),
        OwnVerdict::Named => names,
        OwnVerdict::NamedWithRemainder => format!("{names}; and something that has no name"),
        OwnVerdict::OneOf => format!("one of several: {names}"),
        OwnVerdict::Unknown => "something is left that no cause explains".to_owned(),
        OwnVerdict::Inconclusive => format!("not sure: perhaps {names}"),
    }
}

fn in_words(cause: &NamedCause) -> String {
    let size = |size: &Estimate| {
        let of =
            if size.before == 0.0 { String::new() } else { format!(" instead of {}", size.before) };
        format!("{} {:.4} ± {:.1e}{of}", size.key, size.value, size.std)
    };
    let sizes: Vec<String> = cause.sizes.iter().map(size).collect();
    let names: Vec<&str> =
        core::iter::once(&cause.name).chain(&cause.tied_with).map(String::as_str).collect();
    format!("{} ({})", names.join(" or "), sizes.join(", "))
}

fn cause(cause: &NamedCause) -> Value {
    let shape: Map<String, Value> =
        cause.shape.iter().map(|(key, value)| ((*key).to_owned(), json!(value))).collect();
    json!({
        "name": cause.name,
        "symbol": cause.symbol,
        "port": cause.port.name(),
        "probability": cause.probability,
        "sizes": cause.sizes.iter().map(estimate).collect::<Vec<Value>>(),
        "shape": shape,
        "tied_with": cause.tied_with,
    })
}

fn estimate(estimate: &Estimate) -> Value {
    let Estimate { key, value, std, interval: [low, high], before } = estimate;
    json!({
        "key": key, "value": value, "std": std, "low95": low, "high95": high, "before": before,
    })
}

fn signal(fit: &SignalFit) -> Value {
    let [before, after] = fit.train_rms;
    json!({
        "signal": fit.signal,
        "train_rms_before": before,
        "train_rms_after": after,
        "holdout_rms_before": fit.holdout_rms.map(|[before, _]| before),
        "holdout_rms_after": fit.holdout_rms.map(|[_, after]| after),
        "noise_std": fit.noise,
        "left_ratio": fit.left_ratio,
    })
}
