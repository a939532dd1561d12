//! Damage and data sheet that draw the same current: neither may be taken for the other.

use std::fmt::Write as _;

use anyhow::Result;
use experiments::{
    bundle_at, bundle_of_scaled_torques, difference_of_diagnosers, evaluate_symmetries,
};
use fdi_core::Diagnoser;

use super::setting::{BUNDLE_SEED, FAULTS, JOBS, SEED, embedded};

/// Pairs of a direction.
const PAIRS: usize = 50;
/// Recordings that both model files diagnose.
const RECORDINGS: usize = 50;
/// Torques of the other model file over those of the first.
const RATIO: f64 = 1.05;

pub(super) fn text() -> Result<String> {
    let mut text = format!(
        "{PAIRS} pairs of machines a direction, at full tolerances: one with damage (k1 of 0.05, k2 \
         of 0.003, k3 to k5 of 0.03), the other with a number of the data sheet that is off as much, \
         each with noise of its own. \"Tolerances alone\": what they leave open of the direction, were \
         the recording without noise. \"Stated\": the tolerance of the number itself, between units, \
         days and temperatures. \"Difference\": the level in which a pair's answers differ most on \
         average, over its standard deviation. Bars: the standard deviation that of the tolerances to \
         1 %, the difference below 0.2.\n\n\
         | direction | standard deviation, median, thousandths | off the tolerances alone, at most, % | \
         stated, thousandths | mean difference | root mean square |\n|---|---|---|---|---|---|\n"
    );
    for result in evaluate_symmetries(&embedded()?, PAIRS, SEED + 400, JOBS)? {
        let _ = writeln!(
            text,
            "| {} | {:.2} | {:.2} | {:.2} | {:.3} | {:.3} |",
            result.symmetry.finding(),
            1e3 * result.std,
            100.0 * result.off_prior,
            1e3 * result.symmetry.stated_std(),
            result.difference,
            result.difference_rms
        );
    }
    let one = Diagnoser::new(bundle_at(1.0, true, BUNDLE_SEED)?)?;
    let other = Diagnoser::new(bundle_of_scaled_torques(RATIO, BUNDLE_SEED, JOBS)?)?;
    let differences = difference_of_diagnosers([&one, &other], RECORDINGS, SEED + 410, JOBS)?;
    let shown = FAULTS.iter().zip(differences).map(|(name, by)| format!("{name} {by:.3}"));
    let _ = writeln!(
        text,
        "\nA model file whose back-EMF, inertias, frictions, drag and load are all {RATIO} times \
         those of EMA-48 draws the same current. Its bundle is learnt from simulations of its own. \
         Mean differences of the levels of {RECORDINGS} machines with one to three faults by the two \
         bundles, over their standard deviations: {}.",
        shown.collect::<Vec<_>>().join(", ")
    );
    Ok(text)
}
