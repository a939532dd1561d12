//! Units that were learnt, on the page of machines within their tolerances.

use std::fmt::Write as _;

use anyhow::Result;
use experiments::{
    BoundCase, Days, HiddenDamage, LearntLine, LearntResult, UnitsScore, WearLine,
    bundle_over_days, evaluate_learnt, evaluate_wear,
};
use fdi_core::{Diagnoser, report::FaultId};

use super::setting::{BUNDLE_SEED, JOBS, SEED, beside, both_bounds, percent};

/// Units of a line.
pub(super) const UNITS: usize = 500;
/// Units of a line that are diagnosed by a shift against their references too.
const SHIFTED: usize = 10;
/// Recordings of each unit as new.
pub(super) const REFERENCES: usize = 4;
/// Half-width of the winding's temperature over days, K.
pub(crate) const HALF_WIDTH_K: f64 = 40.0;
/// Standard deviation of the winding's temperature as read, K.
pub(crate) const READING_STD_K: f64 = 3.0;
/// Units of a line of slow wear, and sessions that each is followed.
const WORN_UNITS: usize = 50;
const SESSIONS: usize = 40;

pub(crate) fn diagnoser() -> Result<Diagnoser> {
    Ok(Diagnoser::new(bundle_over_days(HALF_WIDTH_K, BUNDLE_SEED)?)?)
}

fn line(damage: HiddenDamage, reading_std_k: Option<f64>) -> LearntLine {
    LearntLine {
        references: REFERENCES,
        days: Days {
            half_width_k: HALF_WIDTH_K,
            reading_std_k,
            has_voltage: false,
            load_within_n_m: 0.0,
        },
        damage,
        misstated: 1.0,
        units: UNITS,
        shifted: SHIFTED,
    }
}

/// The section of learnt units.
pub(super) fn text() -> Result<String> {
    crate::terminal::say("units: learnt");
    let diagnoser = diagnoser()?;
    let mut text = format!(
        "{UNITS} units a line at full tolerances: {REFERENCES} recordings as new, each of a day of \
         its own, and one on a later day. The winding's temperature is uniform within \
         ±{HALF_WIDTH_K} K; \"read\": with a standard deviation of {READING_STD_K} K. \"Shift\": the \
         first {SHIFTED} units with `--tolerance none --reference`. \"z\": the rms current of the \
         phases against that of the references, Student's test at 2 %. Bars, with the temperature \
         read: on healthy units something detected in at most 3 %, not healthy in at most 10 %; the \
         damage of the last three lines detected in 90 %; coverage 91 to 98.5 %.\n\n\
         | damage | temperature | healthy, % | faulty, % | undetermined, % | inadequate, % | its \
         fault detected, % | coverage of k1 to k5 and (k6, k7), % | shift: faulty, % | z: faulty, % |\n\
         |---|---|---|---|---|---|---|---|---|---|\n"
    );
    let mut widths = String::new();
    for (part, reading_std_k) in [Some(READING_STD_K), None].into_iter().enumerate() {
        let temperature = if reading_std_k.is_some() { "read" } else { "not read" };
        let lines = [
            ("none", HiddenDamage::Healthy, None),
            ("one to three of 0.01 to 0.05", HiddenDamage::OneToThree, None),
            ("k2 of 0.002", HiddenDamage::Alone(FaultId::K2, 0.002), Some(FaultId::K2)),
            ("a short of 0.02", HiddenDamage::Alone(FaultId::K3, 0.02), Some(FaultId::K3)),
            ("k1 of 0.10", HiddenDamage::Alone(FaultId::K1, 0.10), Some(FaultId::K1)),
        ];
        // without a reading the first two tell what it is worth
        let count = if reading_std_k.is_some() { lines.len() } else { 2 };
        for (place, (name, damage, fault)) in lines.into_iter().take(count).enumerate() {
            let seed = SEED + 400 + 10 * part as u64 + place as u64;
            let result = evaluate_learnt(&diagnoser, &line(damage, reading_std_k), seed, JOBS)?;
            row(&mut text, name, temperature, fault, &result);
            if damage == HiddenDamage::Healthy {
                let case = BoundCase {
                    references: REFERENCES,
                    half_width_k: Some(HALF_WIDTH_K),
                    reading_std_k,
                    ..BoundCase::alone(1.0)
                };
                let bounds = both_bounds(diagnoser.bundle(), case)?;
                let _ = writeln!(
                    widths,
                    "| {temperature} | {} | {} |",
                    beside(result.learnt.std_median, &bounds),
                    result.learnt.evaluations_median
                );
            }
        }
    }
    let _ = write!(
        text,
        "\nMedian standard deviations of healthy units in thousandths, in brackets over the bounds \
         as above. The recordings as new need no simulation any more.\n\n\
         | temperature | k1 | k2 | k3 | k4 | k5 | k6 | simulations, median |\n\
         |---|---|---|---|---|---|---|---|\n{widths}"
    );
    Ok(text)
}

fn row(
    text: &mut String,
    name: &str,
    temperature: &str,
    fault: Option<FaultId>,
    result: &LearntResult,
) {
    let score = &result.learnt;
    let n = score.machines;
    let [healthy, faulty, undetermined, inadequate, _] =
        score.verdicts.map(|count| percent(count, n));
    let found = fault.map(|fault| match fault {
        FaultId::K3 => score.short_detected,
        other => score.detected_of[other as usize],
    });
    let found = found.map_or(String::new(), |found| format!("{:.1}", percent(found, n)));
    let covered = score.covered.map(|count| format!("{:.1}", percent(count, n)));
    let _ = writeln!(
        text,
        "| {name} | {temperature} | {healthy:.1} | {faulty:.1} | {undetermined:.1} | \
         {inadequate:.1} | {found} | {} | {:.0} | {:.1} |",
        covered.join(", "),
        percent(result.shifted.verdicts[1], result.shifted.machines),
        percent(result.z_detected, n)
    );
}

/// Scores of learnt units whose scatter is not as stated.
pub(super) fn misstated(most: f64) -> Result<[(&'static str, UnitsScore); 2]> {
    let diagnoser = diagnoser()?;
    let of = |damage, seed| -> Result<UnitsScore> {
        let line = line(damage, Some(READING_STD_K));
        let line = LearntLine { misstated: most, shifted: 0, ..line };
        Ok(evaluate_learnt(&diagnoser, &line, seed, JOBS)?.learnt)
    };
    Ok([
        ("healthy, four references", of(HiddenDamage::Healthy, SEED + 500)?),
        ("one to three faults, four references", of(HiddenDamage::OneToThree, SEED + 501)?),
    ])
}

/// The section of slow wear.
pub(super) fn wear() -> Result<String> {
    crate::terminal::say("units: slow wear");
    let diagnoser = diagnoser()?;
    let mut text = format!(
        "{WORN_UNITS} units a line: {REFERENCES} recordings as new, then {SESSIONS} sessions, each \
         diagnosed and, where nothing is found, learnt with `fdi unit update`. Bars: found in 90 % by \
         a level of 0.02, k1 by 0.10: by the last session. Of a unit without wear every session is \
         another chance of a false alarm.\n\n\
         | wear a session | found within {SESSIONS} sessions, % | level when found, median | \
         largest |\n|---|---|---|---|\n"
    );
    let lines = [
        ("none", None, 0.0),
        ("k2 by 0.0005", Some(FaultId::K2), 0.0005),
        ("k6 by 0.0005", Some(FaultId::K6), 0.0005),
        ("a short by 0.0005", Some(FaultId::K3), 0.0005),
        ("k1 by 0.0025", Some(FaultId::K1), 0.0025),
    ];
    for (place, (name, fault, rate)) in lines.into_iter().enumerate() {
        let line = WearLine { fault, rate, sessions: SESSIONS, units: WORN_UNITS };
        let found = evaluate_wear(&diagnoser, &line, SEED + 600 + place as u64, JOBS)?;
        let mut levels: Vec<f64> =
            found.iter().flatten().map(|&session| rate * session as f64).collect();
        levels.sort_by(f64::total_cmp);
        let told = |at: usize| levels.get(at).map_or(String::new(), |level| format!("{level:.4}"));
        let share = percent(levels.len(), found.len());
        let (median, most) = (told(levels.len() / 2), told(levels.len().wrapping_sub(1)));
        let (median, most) =
            if fault.is_some() { (median, most) } else { (String::new(), String::new()) };
        let _ = writeln!(text, "| {name} | {share:.0} | {median} | {most} |");
    }
    Ok(text)
}
