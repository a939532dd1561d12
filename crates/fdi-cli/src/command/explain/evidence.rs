//! Evidence for the answer: every hypothesis, and the residual over the coordinates.

use fdi_core::report::{CurveBin, HypothesisOutcome, HypothesisRefit, ResidualCurve, Standing};
use greybox::{Explained, Finding, Hypothesis};

/// How each effect of the catalogue fared.
pub(super) fn hypotheses(explained: &Explained) -> Vec<HypothesisOutcome> {
    let is_one_of =
        |found: &[Finding], one: &Hypothesis| found.iter().any(|f| f.effect.id() == one.id);
    let standing = |one: &Hypothesis| {
        if is_one_of(&explained.effects, one) {
            Standing::Found
        } else if is_one_of(&explained.alternatives, one) {
            Standing::AsLikely
        } else if one.refit.is_some() {
            Standing::FellShort
        } else {
            Standing::NotFitted
        }
    };
    let of = |one: &Hypothesis| HypothesisOutcome {
        id: one.id.info().symbol.to_owned(),
        name: one.id.info().name.to_owned(),
        standing: standing(one),
        log10_p: one.log_p / std::f64::consts::LN_10,
        visible_share: one.visible_share,
        refit: one.refit.map(|refit| HypothesisRefit {
            holdout_gain_nats: refit.holdout_gain_nats,
            holdout_gain_se: refit.holdout_gain_se,
            evidence_nats: refit.evidence_nats,
            on_bound: refit.on_bound,
        }),
    };
    explained.hypotheses.iter().map(of).collect()
}

/// The residual over a coordinate.
pub(super) fn curve(curve: &greybox::ResidualCurve) -> ResidualCurve {
    let bin = |bin: &greybox::CurveBin| CurveBin {
        centre: bin.centre,
        samples: bin.samples as u64,
        mean_before: bin.mean_before,
        mean_after: bin.mean_after,
    };
    ResidualCurve {
        coordinate: curve.coordinate.to_owned(),
        unit: curve.unit.to_owned(),
        share_before: curve.share_before,
        share_after: curve.share_after,
        bins: curve.bins.iter().map(bin).collect(),
    }
}
