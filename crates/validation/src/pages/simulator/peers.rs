//! One machine in this and other simulators: `fixtures/references`.

use std::fmt::Write as _;

use anyhow::{Context as _, Result, ensure};
use ema_sim::{
    Actuator, Command, HealthState, HighFidelity, HighFidelityTrace, Scenario, presets::EMA_48,
};

use super::signals::{ERROR_REL, Lookup, figure};
use crate::pages::figure::Figure;

/// A case, its recording and what our machine is given.
struct Case {
    name: &'static str,
    what: &'static str,
    csv: &'static str,
    viscous: f64,
    load_n_m: f64,
    locked: bool,
}

const CASES: [Case; 4] = [
    Case {
        name: "progpy-locked-rotor",
        what: "ProgPy, locked rotor",
        csv: include_str!("../../../../../fixtures/references/progpy/locked-rotor.progpy.csv"),
        viscous: 3e-5,
        load_n_m: 0.0,
        locked: true,
    },
    Case {
        name: "progpy-run-up",
        what: "ProgPy, run-up at full voltage",
        csv: include_str!("../../../../../fixtures/references/progpy/run-up.progpy.csv"),
        viscous: 3e-5,
        load_n_m: 0.0,
        locked: false,
    },
    Case {
        name: "progpy-run-up-viscous",
        what: "ProgPy, run-up against ten times the drag",
        csv: include_str!("../../../../../fixtures/references/progpy/run-up-viscous.progpy.csv"),
        viscous: 3e-4,
        load_n_m: 0.0,
        locked: false,
    },
    Case {
        name: "progpy-run-up-load",
        what: "ProgPy, run-up against a load of 0.2 N·m",
        csv: include_str!("../../../../../fixtures/references/progpy/run-up-load.progpy.csv"),
        viscous: 3e-5,
        load_n_m: 0.2,
        locked: false,
    },
];

/// Signals that are compared.
pub(super) const SIGNALS: [&str; 5] = [
    "speed_rad_per_s",
    "phase_a_current_a",
    "phase_b_current_a",
    "phase_c_current_a",
    "torque_n_m",
];

/// The motor shaft alone, its loops asked for more than the supply gives.
fn machine(case: &Case) -> Actuator {
    let mut a = EMA_48;
    a.motor.inertia_kg_m2 = EMA_48.total_inertia_kg_m2();
    a.motor.viscous_n_m_s_per_rad = case.viscous;
    a.transmission.gear_ratio = 1.0;
    a.transmission.surface_inertia_kg_m2 = 0.0;
    a.transmission.backlash_rad = 0.0;
    a.transmission.efficiency_ratio = 1.0;
    a.transmission.kinetic_friction_n_m = 0.0;
    a.transmission.static_friction_n_m = if case.locked { 1e3 } else { 0.0 };
    a.transmission.stop_rad = 1e6;
    a.controller.sample_hz = a.inverter.carrier_hz;
    a.controller.position_gain_per_s = 1e6;
    a.controller.speed_limit_rad_per_s = 1e5;
    a.controller.speed_gain_a_s_per_rad = 1e3;
    a.controller.current_limit_a = 1e4;
    a
}

fn simulate(case: &Case, samples: usize) -> Result<HighFidelityTrace> {
    let scenario = Scenario {
        command: Command::Recorded { values_rad: vec![1e5], rate_hz: 1.0 },
        load_n_m: case.load_n_m,
        duration_s: samples as f64 * 50e-6,
        start_angle_rad: core::f64::consts::FRAC_PI_3 / 4.0,
        ..Scenario::chirp()
    };
    let model = HighFidelity::new(&machine(case), &scenario)?;
    Ok(model.simulate(&(&HealthState::HEALTHY).into()))
}

/// Columns of a recording by name.
pub(super) fn read<const N: usize>(csv: &str, names: [&str; N]) -> Result<[Vec<f64>; N]> {
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().context("empty recording")?.split(',').collect();
    let mut columns = [const { Vec::new() }; N];
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        for (column, signal) in columns.iter_mut().zip(names) {
            let place = header
                .iter()
                .position(|name| *name == signal)
                .with_context(|| signal.to_owned())?;
            column.push(cells[place].parse()?);
        }
    }
    Ok(columns)
}

/// Trapezoid with a flat top of 120°.
fn shape(electrical_rad: f64) -> f64 {
    let x = electrical_rad.rem_euclid(core::f64::consts::TAU).to_degrees();
    if x < 30.0 {
        x / 30.0
    } else if x < 150.0 {
        1.0
    } else if x < 210.0 {
        (180.0 - x) / 30.0
    } else if x < 330.0 {
        -1.0
    } else {
        (x - 360.0) / 30.0
    }
}

/// Our signals, in the order of [`SIGNALS`].
fn signals(trace: &HighFidelityTrace) -> [Vec<f64>; 5] {
    let torque = |n: usize| -> f64 {
        (0..3)
            .map(|j| {
                let electrical =
                    4.0 * trace.motor_angle_rad[n] - core::f64::consts::TAU / 3.0 * j as f64;
                EMA_48.motor.back_emf_v_s_per_rad * shape(electrical) * trace.phase_currents_a[j][n]
            })
            .sum()
    };
    let [a, b, c] = trace.phase_currents_a.clone();
    let speed = trace.motor_speed_rad_per_s.clone();
    let torques = (0..speed.len()).map(torque).collect();
    [speed, a, b, c, torques]
}

/// Largest difference and its rms, over the reference's range.
fn compare(ours: &[f64], reference: &[f64]) -> (f64, f64) {
    let (low, high) = reference
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
    // a signal that should be zero throughout is compared as it is
    let range = if high - low > 1e-6 { high - low } else { 1.0 };
    let differences = ours.iter().zip(reference).map(|(a, b)| (a - b).abs() / range);
    let (mut most, mut squares) = (0.0_f64, 0.0);
    for difference in differences {
        most = most.max(difference);
        squares += difference * difference;
    }
    (most, (squares / reference.len() as f64).sqrt())
}

pub(super) fn figures() -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    for case in &CASES {
        let reference = read(case.csv, SIGNALS)?;
        let trace = simulate(case, reference[0].len())?;
        let ours = signals(&trace);
        figures.extend(differences(case.name, &ours, &reference)?);
    }
    Ok(figures)
}

/// Largest and rms difference of each signal, over the reference's range.
pub(super) fn differences(
    case: &str,
    ours: &[Vec<f64>; 5],
    reference: &[Vec<f64>; 5],
) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    for (place, signal) in SIGNALS.iter().enumerate() {
        ensure!(ours[place].len() == reference[place].len(), "lengths of {signal} differ");
        let (most, rms) = compare(&ours[place], &reference[place]);
        figures.push(figure(format!("{case}/{signal}/max"), most, ERROR_REL, "1"));
        figures.push(figure(format!("{case}/{signal}/rms"), rms, ERROR_REL, "1"));
    }
    Ok(figures)
}

/// A line of the table.
pub(super) fn line(page: &mut String, f: &Lookup<'_>, case: &str, what: &str) -> Result<()> {
    write!(page, "| {what} |")?;
    for signal in SIGNALS {
        let at = |kind: &str| f.percent(&format!("{case}/{signal}/{kind}"));
        write!(page, " {:.3} / {:.3} |", at("max")?, at("rms")?)?;
    }
    writeln!(page)?;
    Ok(())
}

pub(super) fn text(page: &mut String, f: &Lookup<'_>) -> Result<()> {
    writeln!(
        page,
        "\n## Against other simulators\n\n\
         The motor shaft alone in NASA ProgPy 1.9.0 (`fixtures/references/progpy`; star point and open leg there are the\n\
         fixture's), at instants 50 µs apart. Largest and rms difference, per cent of the signal's range; bar: 1.\n\n\
         | case | speed | phase A | phase B | phase C | torque |\n|---|--:|--:|--:|--:|--:|"
    )?;
    for case in &CASES {
        line(page, f, case.name, case.what)?;
    }
    page.push_str(include_str!("peers.md"));
    Ok(())
}
