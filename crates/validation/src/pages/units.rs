//! `docs/validation/units.md`: machines that differ from their model file by its tolerances.

use std::fmt::Write as _;

use anyhow::Result;
use experiments::{
    BoundCase, HiddenDamage, UnitsLine, UnitsResult, UnitsScore, bundle_at, evaluate_units,
    unit_bounds,
};
use fdi_core::{Diagnoser, report::FaultId};

use self::setting::{
    BUNDLE_SEED, Bounds, FAULTS, JOBS, MACHINES, SEED, TWINS, beside, both_bounds, embedded, line,
};
use super::{
    figure::{Figure, Rendered},
    section::Section,
};

mod cost;
mod decisions;
mod effects;
mod learnt;
mod numbers;
mod setting;
mod symmetry;

pub(super) use self::{
    learnt::{HALF_WIDTH_K, READING_STD_K, diagnoser},
    setting::percent,
};

/// Shares of the tolerances.
const SCALES: [f64; 5] = [0.0, 0.03, 0.1, 0.3, 1.0];
/// Machines of a line of the table of power.
const POWER_MACHINES: usize = 500;
/// Machines of the quick figures.
const QUICK_MACHINES: usize = 16;

/// Bounds at full tolerances, and a few machines.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let diagnoser = embedded()?;
    let bounds = unit_bounds(diagnoser.bundle(), &BoundCase::alone(1.0), JOBS)?;
    let figure = |id: String, value: f64, tolerance_rel: f64| Figure {
        id,
        value,
        tolerance_rel,
        unit: "1".to_owned(),
    };
    let mut figures: Vec<Figure> = FAULTS
        .iter()
        .zip(bounds)
        .map(|(name, bound)| figure(format!("bound-{name}"), bound, 1e-3))
        .collect();
    let few = UnitsLine { machines: QUICK_MACHINES, twins: 0, ..line(1.0, HiddenDamage::Healthy) };
    let result = evaluate_units(&diagnoser, &few, BUNDLE_SEED, JOBS)?;
    let std = result.with_tolerances.std_median;
    figures.push(figure("std-k1".to_owned(), std[0], 1e-2));
    figures.push(figure("std-k3".to_owned(), std[2], 1e-2));
    Ok(figures)
}

/// Sections that can be rebuilt one by one.
pub(super) const SECTIONS: &[Section] = &[
    Section { name: "scales", write: scales },
    Section { name: "power", write: |page| put(page, "Power at full tolerances", power) },
    Section {
        name: "symmetries",
        write: |page| put(page, "What a recording cannot tell apart", symmetry::text),
    },
    Section { name: "learnt", write: |page| put(page, "Units that were learnt", learnt::text) },
    Section {
        name: "numbers",
        write: |page| put(page, "Numbers of a unit", || numbers::text(&learnt::diagnoser()?)),
    },
    Section {
        name: "effects",
        write: |page| {
            let text = || effects::text(&learnt::diagnoser()?);
            put(page, "Physics that the model file does not have", text)
        },
    },
    Section {
        name: "misstated",
        write: |page| put(page, "A fleet that is not as stated", misstated),
    },
    Section { name: "wear", write: |page| put(page, "Slow wear", learnt::wear) },
    Section { name: "severe", write: |page| put(page, "Severe faults", severe) },
    Section { name: "decisions", write: |page| put(page, "Decisions", decisions::text) },
    Section { name: "cost", write: |page| put(page, "Cost", cost::text) },
];

/// The page.
pub(super) fn text() -> Result<Rendered> {
    let mut page = Rendered::from(introduction());
    for section in SECTIONS {
        (section.write)(&mut page)?;
    }
    Ok(page)
}

/// Adds a section to a page.
fn put(page: &mut Rendered, heading: &str, text: impl Fn() -> Result<String>) -> Result<()> {
    write!(page.markdown, "\n## {heading}\n\n{}", text()?)?;
    Ok(())
}

fn introduction() -> String {
    format!(
        "# Machines that differ from their model file\n\n\
         Hidden machines in high fidelity, each with numbers of its own, one embedded chirp each, \
         noise of 20 mA at 10 kHz, 12 bits, real electronics. The scatter at full tolerances is that \
         of `docs/models/tolerances.md` (torque constant 3 %, dry friction 20 %, gains of the sensors \
         1 %, ...), of units and of sessions. It is clipped at 2.5 standard deviations. Mismatch of \
         turns is 0.3 % and eccentricity 2 % as built. The model file states the same tolerances at \
         the same share. Made by `cargo xtask validate units`; root seed {SEED}, bundles learnt with \
         seed {BUNDLE_SEED}. \"Twin\" is the same recording diagnosed with `--tolerance none`, the \
         first {TWINS} machines of each line.\n\n\
         The winding's temperature is 15 K (one standard deviation) off that of the model file.\n\n\
         This set cannot show what follows where the machine is not as assumed. The shapes of the \
         distributions are those of the priors (normal, clipped), and the machine's equations are \
         those of the simulator. The law of temperature is that of the model file but for a friction \
         that is linear in it.\n"
    )
}

/// Machines at shares of the tolerances.
fn scales(page: &mut Rendered) -> Result<()> {
    let mut healthy = Vec::new();
    let mut faulty = Vec::new();
    let mut bounds = Vec::new();
    for (place, scale) in SCALES.into_iter().enumerate() {
        let diagnoser = Diagnoser::new(bundle_at(scale, true, BUNDLE_SEED)?)?;
        let seed = |kind: u64| SEED + 2 * place as u64 + kind;
        crate::terminal::say(&format!("units: {scale} of the tolerances"));
        let of = |damage, kind| evaluate_units(&diagnoser, &line(scale, damage), seed(kind), JOBS);
        healthy.push(of(HiddenDamage::Healthy, 0)?);
        faulty.push(of(HiddenDamage::OneToThree, 1)?);
        bounds.push(both_bounds(diagnoser.bundle(), BoundCase::alone(scale))?);
    }
    let parts = [
        ("Verdicts", verdicts(&healthy, &faulty)),
        ("Coverage of the 95 % intervals", coverage(&healthy, &faulty)),
        ("Widths beside the bound", widths(&healthy, &bounds)),
    ];
    let parts = parts.map(|(heading, text)| format!("### {heading}\n\n{text}"));
    put(page, "Shares of the tolerances", || Ok(parts.join("\n")))
}

/// Shares of all verdicts, and of machines on which something is detected.
fn verdicts(healthy: &[UnitsResult], faulty: &[UnitsResult]) -> String {
    let mut table = format!(
        "Shares of {MACHINES} machines a line, in percent; a refusal is an error in place of an \
         answer. Bars: on healthy machines something detected in at most 3 % and model-inadequate \
         in at most 5 %.\n\n\
         | share of tolerances | machines | diagnosis | healthy | faulty | undetermined | \
         model-inadequate | refused | something detected |\n|---|---|---|---|---|---|---|---|---|\n"
    );
    for (kind, results) in [("healthy", healthy), ("one to three faults", faulty)] {
        for result in results {
            for (way, score) in ways(result) {
                let n = score.machines;
                let [h, f, u, i, r] = score.verdicts.map(|count| percent(count, n));
                let detected = percent(score.detected, n);
                let scale = result.line.scale;
                let _ = writeln!(
                    table,
                    "| {scale} | {kind} | {way} | {h:.1} | {f:.1} | {u:.1} | {i:.1} | {r:.1} | \
                     {detected:.1} |"
                );
            }
        }
    }
    table
}

fn ways(result: &UnitsResult) -> [(&'static str, &UnitsScore); 2] {
    [("tolerances", &result.with_tolerances), ("twin", &result.without)]
}

fn coverage(healthy: &[UnitsResult], faulty: &[UnitsResult]) -> String {
    let mut table = "Share of machines, in percent, whose truth the interval of a level holds, of k6 \
                     and k7 the joint region. Bar: 91 to 98.5.\n\n\
                     | share of tolerances | machines | diagnosis | k1 | k2 | k3 | k4 | k5 | k6, k7 |\n\
                     |---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for (kind, results) in [("healthy", healthy), ("one to three faults", faulty)] {
        for result in results {
            for (way, score) in ways(result) {
                let shares = score.covered.map(|count| percent(count, score.machines));
                let cells: Vec<String> = shares.iter().map(|share| format!("{share:.1}")).collect();
                let _ = writeln!(
                    table,
                    "| {} | {kind} | {way} | {} |",
                    result.line.scale,
                    cells.join(" | ")
                );
            }
        }
    }
    table
}

fn widths(healthy: &[UnitsResult], bounds: &[Bounds]) -> String {
    let mut table = "Median standard deviation, before the cut at zero, in thousandths. In \
                     brackets: its ratio to the Cramér-Rao bound with the same priors, without and \
                     with the learnt error of the low-fidelity model as noise. The bound takes the \
                     slopes of the low-fidelity model and the noise of the high-fidelity model's \
                     electronics. Bar: 0.8 to 1.4.\n\n\
                     The twin's standard deviations take every number to be exact: its ratios say \
                     how sure it is, and not how right.\n\n\
                     | share of tolerances | diagnosis | k1 | k2 | k3 | k4 | k5 | k6 | simulations, \
                     median |\n|---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for (result, bound) in healthy.iter().zip(bounds) {
        for (way, score) in ways(result) {
            let _ = writeln!(
                table,
                "| {} | {way} | {} | {} |",
                result.line.scale,
                beside(score.std_median, bound),
                score.evaluations_median
            );
        }
    }
    table
}

fn power() -> Result<String> {
    let with_built = embedded()?;
    let without_built = Diagnoser::new(bundle_at(1.0, false, BUNDLE_SEED)?)?;
    let lines = [
        ("imbalance of 0.015", FaultId::K3, 0.015, false, "95, right phase 98"),
        ("k6 of 0.01", FaultId::K6, 0.01, false, "90"),
        ("k2 of 0.02", FaultId::K2, 0.02, false, "90"),
        ("imbalance of 0.027", FaultId::K3, 0.027, true, "90"),
        ("k6 of 0.07", FaultId::K6, 0.07, true, "90"),
    ];
    let mut table = format!(
        "{POWER_MACHINES} machines a line with one fault. \"As built\": with mismatch of turns and \
         eccentricity of a healthy machine, which the model file states (the embedded bundle); else \
         without either, in machine and file. \"Right phase\": of the shorts that \
         one alone is detected.\n\n\
         | fault | as built | detected, % | right phase, % | bar, % |\n|---|---|---|---|---|\n"
    );
    for (place, (name, fault, level, as_built, bar)) in lines.into_iter().enumerate() {
        let damage = HiddenDamage::Alone(fault, level);
        let line = UnitsLine { as_built, machines: POWER_MACHINES, twins: 0, ..line(1.0, damage) };
        let diagnoser = if as_built { &with_built } else { &without_built };
        let result = evaluate_units(diagnoser, &line, SEED + 100 + place as u64, JOBS)?;
        let score = &result.with_tolerances;
        let of = |index: usize| score.detected_of[index];
        let found = match fault {
            FaultId::K3 => score.short_detected,
            other => of(other as usize),
        };
        let right = match fault {
            FaultId::K3 => format!("{:.1}", percent(score.phase_right, score.machines)),
            _ => String::new(),
        };
        let built = if as_built { "yes" } else { "no" };
        let _ = writeln!(
            table,
            "| {name} | {built} | {:.1} | {right} | {bar} |",
            percent(found, score.machines)
        );
    }
    Ok(table)
}

/// Scatter of each number and machine up to so many times more or less than stated.
const MISSTATED: f64 = 1.5;

fn misstated() -> Result<String> {
    let mut table = format!(
        "The scatter of each number and machine is up to {MISSTATED} times more or less than the \
         model file states, log-uniform, at full tolerances; {MACHINES} machines and {} units a \
         line. Bars: on healthy machines something detected in at most 8 %, coverage at least \
         88 %.\n\n| machines | healthy, % | faulty, % | undetermined, % | inadequate, % | something \
         detected, % | coverage of k1 to k5 and (k6, k7), % |\n|---|---|---|---|---|---|---|\n",
        learnt::UNITS
    );
    let diagnoser = embedded()?;
    let mut row = |name: &str, score: &UnitsScore| {
        let n = score.machines;
        let [h, f, u, i, _] = score.verdicts.map(|count| percent(count, n));
        let covered = score.covered.map(|count| format!("{:.1}", percent(count, n)));
        let _ = writeln!(
            table,
            "| {name} | {h:.1} | {f:.1} | {u:.1} | {i:.1} | {:.1} | {} |",
            percent(score.detected, n),
            covered.join(", ")
        );
    };
    for (place, (name, damage)) in [
        ("healthy, one recording", HiddenDamage::Healthy),
        ("one to three faults, one recording", HiddenDamage::OneToThree),
    ]
    .into_iter()
    .enumerate()
    {
        let line = UnitsLine { misstated: MISSTATED, twins: 0, ..line(1.0, damage) };
        let result = evaluate_units(&diagnoser, &line, SEED + 200 + place as u64, JOBS)?;
        row(name, &result.with_tolerances);
    }
    for (name, score) in learnt::misstated(MISSTATED)? {
        row(name, &score);
    }
    Ok(table)
}

/// Machines of a line of severe faults.
const SEVERE_MACHINES: usize = 50;

fn severe() -> Result<String> {
    let mut table = format!(
        "{SEVERE_MACHINES} machines a line, the rotor started anywhere; \"among\": beside one to \
         three incipient faults. Bars: none missed, none refused, coverage at least 90 %. At full \
         tolerances only the default is meant to hold.\n\n\
         | fault | share of tolerances | `--tolerance` | found, % | refused, % | inadequate, % | \
         coverage of k1 to k5 and (k6, k7), % |\n|---|---|---|---|---|---|---|\n"
    );
    let diagnoser = embedded()?;
    let faults = [
        ("k1 = 1", FaultId::K1, 1.0),
        ("k3, k4 or k5 = 1", FaultId::K3, 1.0),
        ("k6 = 0.5", FaultId::K6, 0.5),
    ];
    let mut seed = SEED + 300;
    for scale in [0.0, 1.0] {
        for (name, fault, level) in faults {
            let kinds = [
                ("", HiddenDamage::Alone(fault, level)),
                (", among", HiddenDamage::Among(fault, level)),
            ];
            for (kind, damage) in kinds {
                seed += 1;
                let line = UnitsLine {
                    any_start: true,
                    machines: SEVERE_MACHINES,
                    twins: SEVERE_MACHINES,
                    ..line(scale, damage)
                };
                let result = evaluate_units(&diagnoser, &line, seed, JOBS)?;
                for (option, score) in
                    [("model", &result.with_tolerances), ("none", &result.without)]
                {
                    let n = score.machines;
                    let found = match fault {
                        FaultId::K3 => score.short_detected,
                        other => score.detected_of[other as usize],
                    };
                    let covered = score.covered.map(|count| format!("{:.0}", percent(count, n)));
                    let _ = writeln!(
                        table,
                        "| {name}{kind} | {scale} | {option} | {:.0} | {:.0} | {:.0} | {} |",
                        percent(found, n),
                        percent(score.verdicts[4], n),
                        percent(score.verdicts[3], n),
                        covered.join(", ")
                    );
                }
            }
        }
    }
    Ok(table)
}
