//! Cost of the envelope and its filter against the raw phase currents.

use std::fmt::Write as _;

use anyhow::Result;
use ema_sim::{FaultCoordinates, Imperfections, LowFidelity, PhysicalFaults};
use fdi_core::{Experiment, default_noise_a};
use reduction::{Information, Matrix, NoiseCovariance, NoiseModel};

use super::{
    encodings::{FAULTS, STEP, derivatives, differences, judged_rows},
    sensor_noise,
};
use crate::median::median;

/// Least deviations of the seven faults in one condition.
struct Bounds {
    /// From every sample of the phase currents, each with noise of its own.
    phases: Vec<f64>,
    /// From the envelope before its filter: one sample of one phase at a time.
    envelope: Vec<f64>,
    /// From the filtered envelope.
    filtered: Vec<f64>,
}

/// Currents of a simulator: the envelope, then the phases one after another, at one rate.
type Currents<'a> = dyn FnMut(&PhysicalFaults) -> Vec<f64> + 'a;

/// The tables, a row a fault, for both simulators.
pub(super) fn section(experiment: &Experiment, faults: &Matrix) -> Result<String> {
    let rate_hz = experiment.actuator.controller.sample_hz;
    let mut page = String::new();
    writeln!(
        page,
        "\n## What the envelope and its filter cost\n\n\
         Ratios of least deviations, the same conditions and noise; medians over the conditions. *Filter*:\n\
         the filtered envelope ({:.0} Hz, {:.0} kHz) against the envelope before it ({:.0} kHz), which is one sample of one\n\
         phase at a time. *Envelope*: that one against every sample of all phases, each with its own noise;\n\
         √2 = 1.41 where two phases carry the same current. *In all*: the filtered envelope against the\n\
         phases. *Largest*: of *in all*, over the conditions. *Short step*: *in all* with differences a tenth as\n\
         wide; where it differs, the current is not smooth in the fault on that scale, and no single figure holds.",
        experiment.filter.corner_hz,
        experiment.filter.output_hz / 1e3,
        rate_hz / 1e3,
    )?;
    let model = experiment.high_fidelity(0.0, Imperfections::NONE)?;
    let poles = experiment.actuator.motor.pole_pairs;
    let mut high = |physical: &PhysicalFaults| {
        let trace = model.simulate(physical);
        let mut all = trace.envelope_a(experiment.envelope, poles);
        trace.phase_currents_a.iter().for_each(|phase| all.extend(phase));
        all
    };
    table(&mut page, "High-fidelity model", experiment, faults, &mut high)?;
    let model = LowFidelity::new(&experiment.actuator, &experiment.scenario)?;
    let mut current_a = Vec::new();
    let mut low = |physical: &PhysicalFaults| {
        model.simulate_current(physical, &mut current_a);
        current_a.repeat(3)
    };
    let filter = table(
        &mut page,
        "Monitoring model (two phases, one current)",
        experiment,
        faults,
        &mut low,
    )?;
    writeln!(
        page,
        "\nA diagnosis compares with the monitoring model, so that the second table is what the filter takes from it:\n\
         {:.0} % at most in the median, and the rest of *in all* is the second phase.",
        100.0 * (filter - 1.0)
    )?;
    page.push_str(include_str!("filter.md"));
    Ok(page)
}

/// The table of a simulator; returns the largest ratio of its column *filter*.
fn table(
    page: &mut String,
    title: &str,
    experiment: &Experiment,
    faults: &Matrix,
    currents: &mut Currents<'_>,
) -> Result<f64> {
    let wide = bounds(experiment, faults, STEP, currents)?;
    let narrow = bounds(experiment, faults, STEP / 10.0, currents)?;
    writeln!(
        page,
        "\n### {title}\n\n\
         | fault | from the phases | from the filtered envelope | filter | envelope | in all | largest | short step |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|"
    )?;
    let mut most = 0.0_f64;
    for fault in 0..FAULTS {
        let of = |all: &[Bounds], pick: &dyn Fn(&Bounds) -> f64| {
            median(&all.iter().map(pick).collect::<Vec<_>>())
        };
        let in_all = |one: &Bounds| one.filtered[fault] / one.phases[fault];
        let filter = of(&wide, &|one| one.filtered[fault] / one.envelope[fault]);
        most = most.max(filter);
        writeln!(
            page,
            "| k{} | {:.2e} | {:.2e} | {filter:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
            fault + 1,
            of(&wide, &|one| one.phases[fault]),
            of(&wide, &|one| one.filtered[fault]),
            of(&wide, &|one| one.envelope[fault] / one.phases[fault]),
            of(&wide, &in_all),
            wide.iter().map(in_all).fold(0.0, f64::max),
            of(&narrow, &in_all),
        )?;
    }
    Ok(most)
}

/// The bounds in every condition with an eccentricity.
fn bounds(
    experiment: &Experiment,
    faults: &Matrix,
    step: f64,
    currents: &mut Currents<'_>,
) -> Result<Vec<Bounds>> {
    let rate_hz = experiment.actuator.controller.sample_hz;
    let samples = (experiment.scenario.duration_s * rate_hz).round() as usize;
    let coloured = sensor_noise(experiment, experiment.samples())?;
    let white = NoiseModel::White { variance: default_noise_a(&experiment.actuator).powi(2) };
    judged_rows(faults)
        .map(|row| {
            let levels = faults.row(row);
            let all = differences(&levels, step, |point| {
                currents(&PhysicalFaults::from(&FaultCoordinates(*point)))
            })?;
            let part = |rows: std::ops::Range<usize>| -> Result<Matrix> {
                let columns: Vec<&[f64]> =
                    (0..FAULTS).map(|column| &all.column(column)[rows.clone()]).collect();
                Ok(Matrix::from_columns(&columns)?)
            };
            let (envelope, phases) = (part(0..samples)?, part(samples..all.rows())?);
            let filtered: Vec<Vec<f64>> = (0..FAULTS)
                .map(|column| experiment.filter.apply(envelope.column(column), rate_hz))
                .collect();
            let filtered = Matrix::from_columns(&filtered)?;
            let derivatives = derivatives(&levels)?;
            let least = |sensitivities: &Matrix, noise: &NoiseCovariance| -> Result<Vec<f64>> {
                let bound = Information::of_signal(sensitivities, noise)?.cramer_rao()?;
                Ok(bound.of_derived(&derivatives)?.deviations())
            };
            let fresh = |signal: &Matrix| NoiseCovariance::new(&white, signal.rows(), 0.0);
            Ok(Bounds {
                phases: least(&phases, &fresh(&phases)?)?,
                envelope: least(&envelope, &fresh(&envelope)?)?,
                filtered: least(&filtered, &coloured)?,
            })
        })
        .collect()
}
