//! `docs/validation/setup.md`: hidden machines that are set up, and diagnosed afterwards.

use std::{fmt::Write as _, path::Path};

use anyhow::{Context, Result};
use experiments::{SetupsLine, SetupsResult, Unfit, evaluate_setups, evaluate_unfit};
use fdi_core::{
    Bundle, Diagnoser,
    report::{ActionLevels, FaultId},
};

use super::{
    bar::met,
    figure::Figure,
    machine::{built, ema_48},
};
use crate::processor::jobs;

/// Root seed of the page. The setup was developed on seed 3.
const SEED: u64 = 20_261_126;
/// Machines of each kind.
const MACHINES: [usize; 3] = [16, 12, 12];
/// Recordings as new of each machine.
const REFERENCES: usize = 4;
/// Later recordings of each without damage.
const SOUND: usize = 10;
/// Simulated tests of a setup without damage, and as many with.
const TESTS: usize = 20;
/// Damage of a later recording each.
const DAMAGE: [FaultId; 4] = [FaultId::K1, FaultId::K2, FaultId::K3, FaultId::K6];
/// Bars: machines accepted of 40; later recordings without damage on which nothing is detected, and those
/// called healthy, percent.
const LEAST_ACCEPTED: usize = 36;
const LEAST_SILENT_PERCENT: f64 = 97.0;
const LEAST_HEALTHY_PERCENT: f64 = 90.0;
/// Bars of the intervals that hold the truth, percent.
const HOLD_PERCENT: [f64; 2] = [91.0, 98.5];
/// Machines of the quick figures.
const FEW: usize = 2;

/// Name of the embedded kind.
const EMA_48: &str = "ema-48, chirp";

/// A kind of machine with its test.
struct Kind {
    name: &'static str,
    diagnoser: Diagnoser,
}

/// Scores of a kind of machine.
struct Scored {
    name: &'static str,
    result: SetupsResult,
}

impl Kind {
    fn of(name: &'static str, bundle: Bundle) -> Result<Self> {
        Ok(Self { name, diagnoser: Diagnoser::new(bundle)? })
    }
}

fn line(machines: usize) -> SetupsLine {
    SetupsLine {
        machines,
        references: REFERENCES,
        sound: SOUND,
        damage: DAMAGE.map(|fault| (fault, ActionLevels::default().watch[fault as usize])).to_vec(),
        tests: TESTS,
    }
}

/// Two machines: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let few = SetupsLine { sound: 2, tests: 4, ..line(FEW) };
    let result = evaluate_setups(&Kind::of(EMA_48, ema_48()?)?.diagnoser, &few, SEED, jobs())?;
    let figure = |id: &str, value: usize| Figure {
        id: id.to_owned(),
        value: value as f64,
        tolerance_rel: 0.0,
        unit: "1".to_owned(),
    };
    Ok(vec![
        figure("accepted", result.accepted),
        figure("wired", result.wired),
        figure("healthy", result.healthy),
        figure("found", result.found.iter().map(|found| found.0).sum()),
        figure("held", result.held.0),
    ])
}

pub(super) fn text() -> Result<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let flap = root.join("fixtures/commands/flap.csv");
    let model = root.join("fixtures/models/ema-270.toml");
    let model = model.to_str().context("the path of the model is no text")?;
    let kinds = [
        Kind::of(EMA_48, ema_48()?)?,
        Kind::of("ema-270, flap", built(model, Some(&flap))?)?,
        Kind::of("bench, chirp", built("bench", None)?)?,
    ];
    let mut page = String::from(HEAD);
    let mut scored = Vec::new();
    for (Kind { name, diagnoser }, machines) in kinds.iter().zip(MACHINES) {
        let result = evaluate_setups(diagnoser, &line(machines), SEED, jobs())?;
        scored.push(Scored { name, result });
    }
    accepted(&mut page, &scored)?;
    later(&mut page, &scored)?;
    predicted(&mut page, &scored)?;
    unfit(&mut page, &kinds[0].diagnoser)?;
    page.push_str(LIMITS);
    Ok(page)
}

fn accepted(page: &mut String, scored: &[Scored]) -> Result<()> {
    page.push_str("\n## Setup\n\n| machine, test | machines | accepted | wiring found | refused |\n| --- | --- | --- | --- | --- |\n");
    let (mut all, mut wired, mut machines) = (0, 0, 0);
    for Scored { name, result } in scored {
        let codes: Vec<&str> = result.refusals.iter().map(|code| code.word()).collect();
        let codes = if codes.is_empty() { "-".to_owned() } else { codes.join(", ") };
        writeln!(
            page,
            "| {name} | {} | {} | {} | {codes} |",
            result.machines, result.accepted, result.wired
        )?;
        (all, wired, machines) =
            (all + result.accepted, wired + result.wired, machines + result.machines);
    }
    let is_met = met(all >= LEAST_ACCEPTED);
    writeln!(page, "| all | {machines} | {all}, bar {LEAST_ACCEPTED}: {is_met} | {wired} | |")?;
    Ok(())
}

fn later(page: &mut String, scored: &[Scored]) -> Result<()> {
    page.push_str(
        "\n## Later recordings of accepted machines\n\n\
         | machine, test | without damage | nothing detected, % | called healthy, % | intervals held, % | found: friction 0.1 | play 0.02 | a short 0.02 | eccentricity 0.05 |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for Scored { name, result } in scored {
        let percent = |part: usize, of: usize| 100.0 * part as f64 / of.max(1) as f64;
        let silent = percent(result.sound - result.false_alarms, result.sound);
        let healthy = percent(result.healthy, result.sound);
        let held = percent(result.held.0, result.held.1);
        write!(
            page,
            "| {name} | {} | {silent:.1} {} | {healthy:.1} {} | {held:.1} {} |",
            result.sound,
            met(silent >= LEAST_SILENT_PERCENT),
            met(healthy >= LEAST_HEALTHY_PERCENT),
            met((HOLD_PERCENT[0]..=HOLD_PERCENT[1]).contains(&held)),
        )?;
        for (found, of) in &result.found {
            write!(page, " {found} of {of} |")?;
        }
        page.push('\n');
    }
    Ok(())
}

fn predicted(page: &mut String, scored: &[Scored]) -> Result<()> {
    page.push_str(
        "\n## What the simulated tests of the setups said beforehand\n\n\
         | machine, test | false alarms, % | later | found, % | later | intervals held, % | later |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for Scored { name, result } in scored {
        let percent = |(part, of): (usize, usize)| 100.0 * part as f64 / of.max(1) as f64;
        let [alarms, found, held] = result.predicted.map(percent);
        let sum = |pick: fn(&(usize, usize)) -> usize| result.found.iter().map(pick).sum::<usize>();
        writeln!(
            page,
            "| {name} | {alarms:.1} | {:.1} | {found:.1} | {:.1} | {held:.1} | {:.1} |",
            percent((result.false_alarms, result.sound)),
            percent((sum(|one| one.0), sum(|one| one.1))),
            percent(result.held)
        )?;
    }
    Ok(())
}

fn unfit(page: &mut String, diagnoser: &Diagnoser) -> Result<()> {
    page.push_str(
        "\n## Machines that cannot be set up\n\nEMA-48 in the chirp.\n\n| what is wrong | code | |\n| --- | --- | --- |\n",
    );
    let codes = evaluate_unfit(diagnoser, &line(1), SEED)?;
    for (way, code) in Unfit::ALL.iter().zip(codes) {
        let told = code.map_or("accepted", |code| code.word());
        writeln!(page, "| {} | `{told}` | {} |", in_words(*way), met(code == Some(way.code())))?;
    }
    Ok(())
}

fn in_words(way: Unfit) -> &'static str {
    match way {
        Unfit::NoReversal => "the command goes one way",
        Unfit::WrongGear => "gear ratio 10 % above the model file's",
        Unfit::OtherMachine => "1.6 times the inertia, half the torque constant",
        Unfit::Noise => "noise of the size of the current on each phase sample",
        Unfit::Saturated => "phases cut at 60 % of their peak",
        Unfit::TooShort => "recordings that end after 60 % of the test",
    }
}

const HEAD: &str = include_str!("setup/head.md");
const LIMITS: &str = include_str!("setup/limits.md");
