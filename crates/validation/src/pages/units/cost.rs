//! Simulations and processor time of a diagnosis within tolerances.

use std::{fmt::Write as _, sync::Arc};

use anyhow::Result;
use experiments::{HiddenDamage, UnitsLine, hidden_recordings, unit_recordings};
use fdi_core::{DiagnoseOptions, Diagnoser, Recording, ToleranceUse};

use super::setting::{JOBS, SEED, embedded, line};
use crate::processor::{processor_s, reference_s};

/// Recordings of a line, all of different machines.
const RECORDINGS: usize = 100;
/// Units, and recordings of each as new.
const UNITS: u64 = 20;
const REFERENCES: usize = 4;

pub(super) fn text() -> Result<String> {
    let diagnoser = embedded()?;
    let drawn = |damage, seed| -> Result<Vec<Recording>> {
        let few = UnitsLine { machines: RECORDINGS, twins: 0, ..line(1.0, damage) };
        let drawn = hidden_recordings(&diagnoser.bundle().experiment, &few, seed, JOBS)?;
        Ok(drawn.into_iter().map(|(_, recording)| recording).collect())
    };
    let healthy = drawn(HiddenDamage::Healthy, SEED + 420)?;
    let faulty = drawn(HiddenDamage::OneToThree, SEED + 421)?;
    let mut table = format!(
        "{RECORDINGS} distinct recordings a line at full tolerances, one after another on one thread, \
         each with the noise level that is estimated from it. Processor time is in runs of a reference \
         loop beside it, and in milliseconds on this machine. With references: {UNITS} units, of each \
         {REFERENCES} recordings are learnt and the next is diagnosed. Bars: 250 simulations and 80 ms a \
         recording, 1000 and 300 ms with four references. The high-fidelity model takes no step.\n\n\
         | recordings | simulations, median | 95th percentile | most | processor time, ms | runs of \
         the reference loop |\n|---|---|---|---|---|---|\n"
    );
    let alone = |recordings: &[Recording]| -> Result<Vec<u64>> {
        let options = options();
        let of = |recording| Ok(diagnoser.diagnose(recording, &options)?.evaluations);
        recordings.iter().map(of).collect()
    };
    let units = (0..UNITS).map(|unit| {
        unit_recordings(&diagnoser.bundle().experiment, REFERENCES + 1, SEED + 430 + unit)
    });
    let units = units.collect::<Result<Vec<_>, _>>()?;
    // learning simulates each reference as its diagnosis does
    let of_references = units.iter().map(|of_unit| Ok(alone(&of_unit[..REFERENCES])?.iter().sum()));
    let of_references = of_references.collect::<Result<Vec<u64>>>()?;
    let with_references = || -> Result<Vec<u64>> {
        let last = units.iter().map(|of_unit| learnt(&diagnoser, of_unit));
        let both = last.zip(&of_references);
        both.map(|(last, references)| Ok(last? + references)).collect()
    };
    row(&mut table, "healthy", healthy.len(), || alone(&healthy))?;
    row(&mut table, "one to three faults", faulty.len(), || alone(&faulty))?;
    row(&mut table, "with four references", UNITS as usize, with_references)?;
    Ok(table)
}

fn options() -> DiagnoseOptions {
    DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() }
}

/// Learns a unit from all recordings but the last; simulations of the last one's diagnosis.
fn learnt(diagnoser: &Diagnoser, recordings: &[Recording]) -> Result<u64> {
    let (last, references) = recordings.split_last().expect("a unit has recordings");
    let unit = Some(Arc::new(diagnoser.learn_unit(references, &options())?));
    Ok(diagnoser.diagnose(last, &DiagnoseOptions { unit, ..options() })?.evaluations)
}

fn row(
    table: &mut String,
    name: &str,
    count: usize,
    run: impl FnOnce() -> Result<Vec<u64>>,
) -> Result<()> {
    let before_s = reference_s();
    let start_s = processor_s();
    let mut simulations = run()?;
    let took_s = (processor_s() - start_s) / count as f64;
    let ratio = took_s / before_s.min(reference_s());
    simulations.sort_unstable();
    let at = |share: f64| simulations[(share * (simulations.len() - 1) as f64).round() as usize];
    let _ = writeln!(
        table,
        "| {name} | {} | {} | {} | {:.0} | {ratio:.2} |",
        at(0.5),
        at(0.95),
        at(1.0),
        1e3 * took_s
    );
    Ok(())
}
