//! The regression of a case as a table, for programs of others.

use std::fmt::Write;

use serde::Serialize;

use super::{
    design::{Design, Rows},
    feature::Shape,
};

/// Which columns of the table belong to what; the first two are role and residual.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Key {
    /// Faults and nuisance parameters.
    nuisance: Vec<usize>,
    features: Vec<KeyOfFeature>,
}

/// A feature's columns, and the effect that it names by the sign of a single column's size.
#[derive(Clone, Debug, Serialize)]
struct KeyOfFeature {
    plus: Option<&'static str>,
    minus: Option<&'static str>,
    columns: Vec<usize>,
    /// Columns of a vibration with the hold-out's own phases.
    own: Vec<usize>,
}

/// The table as CSV, and its key.
pub(super) fn of(design: &Design) -> (String, Key) {
    let nuisance = design.train.nuisance.len();
    let mut next = 2 + nuisance;
    let mut take = |count: usize| -> Vec<usize> {
        next += count;
        (next - count..next).collect()
    };
    let vibrates = |n: usize| matches!(design.features[n].shape, Shape::Vibration(_));
    let features: Vec<KeyOfFeature> = design
        .features
        .iter()
        .enumerate()
        .map(|(n, feature)| KeyOfFeature {
            plus: feature.plus,
            minus: feature.minus,
            columns: take(design.train.features[n].len()),
            own: if vibrates(n) { take(design.hold_out.features[n].len()) } else { Vec::new() },
        })
        .collect();
    let mut text = String::from("role,residual");
    for n in 2..next {
        let _ = write!(text, ",c{n}");
    }
    text.push('\n');
    rows(&mut text, "train", &design.train, &features, true);
    rows(&mut text, "holdout", &design.hold_out, &features, false);
    (text, Key { nuisance: (2..2 + nuisance).collect(), features })
}

fn rows(text: &mut String, role: &str, rows: &Rows, features: &[KeyOfFeature], train: bool) {
    for n in 0..rows.residual.len() {
        let _ = write!(text, "{role},{:.6e}", rows.residual[n]);
        for column in &rows.nuisance {
            let _ = write!(text, ",{:.6e}", column[n]);
        }
        for (columns, key) in rows.features.iter().zip(features) {
            let zeros = |text: &mut String, count: usize| text.push_str(&",0".repeat(count));
            let own = !key.own.is_empty();
            if own && !train {
                zeros(text, key.columns.len());
            }
            for column in columns {
                let _ = write!(text, ",{:.6e}", column[n]);
            }
            if own && train {
                zeros(text, key.own.len());
            }
        }
        text.push('\n');
    }
}
