//! Numbers of units that were learnt, on the page of machines within their tolerances.

use std::fmt::Write as _;

use anyhow::Result;
use experiments::{
    BoundCase, NumberBound, NumberScore, NumbersLine, evaluate_numbers, number_bounds,
};
use fdi_core::Diagnoser;

use super::{
    learnt::{HALF_WIDTH_K, READING_STD_K, REFERENCES},
    setting::{JOBS, SEED, percent},
};

/// Units whose numbers are learnt.
const UNITS: usize = 400;

pub(super) fn text(diagnoser: &Diagnoser) -> Result<String> {
    crate::terminal::say("units: numbers");
    let line = NumbersLine { references: REFERENCES, units: UNITS };
    let result = evaluate_numbers(diagnoser, &line, SEED + 450, JOBS)?;
    let case = BoundCase {
        references: REFERENCES,
        half_width_k: Some(HALF_WIDTH_K),
        reading_std_k: Some(READING_STD_K),
        ..BoundCase::alone(1.0)
    };
    let with_error = BoundCase { with_model_error: true, ..case };
    let bounds = [case, with_error].map(|case| number_bounds(diagnoser.bundle(), &case, JOBS));
    let [plain, with_error] = bounds;
    let bounds = [plain?, with_error?];
    let mut table = format!(
        "{UNITS} units of {REFERENCES} recordings as new, days and temperatures as above; \
         {} could be learnt. `fdi unit learn`, then `fdi unit show`; `fdi calibrate` gives the same \
         numbers. \"Left\": the median standard deviation over that of the tolerances, in brackets \
         over the bounds as above; of ratios the bound of the first alone was computed. Of \
         resistance, inductance and bus voltage this test shows nothing. Bars: coverage 91 to 98.5 %, 0.8 to \
         1.4 of the bound, nothing determined whose posterior is the prior, inertia over torque \
         constant to 2 % on 95 %.\n\n\
         | number | tolerance | coverage, % | left | called determined, % | within 2 % of the truth, \
         % |\n|---|---|---|---|---|---|\n",
        result.learnt
    );
    for score in &result.numbers {
        let NumberScore { key, prior_std, share_median: left, .. } = score;
        let share = |count: usize| percent(count, result.learnt);
        let _ = writeln!(
            table,
            "| `{key}` | {prior_std:.4} | {:.1} | {left:.3}{} | {:.1} | {:.1} |",
            share(score.covered),
            over(*left, key, &bounds),
            share(score.determined),
            share(score.within_2_percent)
        );
    }
    Ok(table)
}

/// Share left over each bound, in brackets; nothing of a number without bounds.
fn over(left: f64, key: &str, bounds: &[Vec<NumberBound>; 2]) -> String {
    let ratio = |bounds: &Vec<NumberBound>| {
        let bound = bounds.iter().find(|bound| bound.key == key)?;
        Some(format!("{:.2}", left / bound.share))
    };
    let ratios: Option<Vec<String>> = bounds.iter().map(ratio).collect();
    ratios.map_or_else(String::new, |ratios| format!(" ({})", ratios.join(", ")))
}
