//! The sinusoidal machine and its field-oriented drive in motulator: `fixtures/references`.

use core::f64::consts::{FRAC_PI_4, TAU};
use std::fmt::Write as _;

use anyhow::Result;
use ema_sim::{
    Actuator, Command, ControlMode, CurrentControl, HighFidelity, HighFidelityTrace, PerPhase,
    Scenario, presets::BENCH,
};

use super::{
    peers::{self, SIGNALS, differences, read},
    signals::{Lookup, healthy},
};
use crate::pages::figure::Figure;

macro_rules! fixture {
    ($name:literal) => {
        include_str!(concat!("../../../../../fixtures/references/motulator/", $name, ".csv"))
    };
}

/// Drive of the machine.
enum Law {
    /// Duties that are known before.
    Duties(fn() -> Result<Vec<PerPhase>>),
    /// The project's own loops, following a sine of the speed.
    Speed,
}

/// A case, its recording and what our machine is given.
struct Case {
    name: &'static str,
    what: &'static str,
    csv: &'static str,
    law: Law,
    start_rad_per_s: f64,
    load_n_m: f64,
    sample_hz: f64,
    /// Samples of ours from one of the recording to the next.
    every: usize,
}

/// Length of a carrier period and of an averaging one there.
const PERIOD_S: f64 = 50e-6;

const CASES: [Case; 4] = [
    Case {
        name: "motulator-short-brake",
        what: "terminals joined, from 300 rad/s",
        csv: fixture!("short-brake.motulator"),
        law: Law::Duties(|| Ok(vec![[0.5; 3]; 601])),
        start_rad_per_s: 300.0,
        load_n_m: 0.0,
        sample_hz: 20e3,
        every: 1,
    },
    Case {
        name: "motulator-voltage-step",
        what: "step of the q-axis voltage against a load",
        csv: fixture!("voltage-step.motulator"),
        law: Law::Duties(step_of_voltage),
        start_rad_per_s: 0.0,
        load_n_m: 0.05,
        sample_hz: 20e3,
        every: 1,
    },
    Case {
        name: "motulator-speed-sine",
        what: "sine of the speed, our loops on both machines",
        csv: fixture!("speed-sine.motulator"),
        law: Law::Speed,
        start_rad_per_s: 0.0,
        load_n_m: 0.0,
        sample_hz: 10e3,
        every: 4,
    },
    Case {
        name: "motulator-speed-sine-native",
        what: "sine of the speed, duties of its own control",
        csv: fixture!("speed-sine-native.motulator"),
        law: Law::Duties(native),
        start_rad_per_s: 0.0,
        load_n_m: 0.0,
        sample_hz: 20e3,
        every: 4,
    },
];

/// 12 V along the rotor's q axis at the beginning of each period, by the recorded angle.
fn step_of_voltage() -> Result<Vec<PerPhase>> {
    let [angle_rad] = read(fixture!("voltage-step.motulator"), ["electrical_angle_rad"])?;
    let duties = |theta_e: f64| {
        [0.0, 1.0, 2.0].map(|j| 0.5 + 12.0 / 48.0 * f64::sin(theta_e - TAU / 3.0 * j))
    };
    Ok(angle_rad.into_iter().map(duties).collect())
}

/// Duties of the native run: those computed in a period act in the next.
fn native() -> Result<Vec<PerPhase>> {
    let names = ["duty_a_frac", "duty_b_frac", "duty_c_frac"];
    let [a, b, c] = read(fixture!("speed-sine-native.duty"), names)?;
    let computed = (0..a.len() - 1).map(|k| [a[k], b[k], c[k]]);
    Ok(core::iter::once([0.5; 3]).chain(computed).collect())
}

/// The motor shaft alone.
fn shaft(sample_hz: f64) -> Actuator {
    let mut a = BENCH;
    a.motor.inertia_kg_m2 = BENCH.total_inertia_kg_m2();
    a.transmission.gear_ratio = 1.0;
    a.transmission.surface_inertia_kg_m2 = 0.0;
    a.transmission.backlash_rad = 0.0;
    a.transmission.efficiency_ratio = 1.0;
    a.transmission.kinetic_friction_n_m = 0.0;
    a.transmission.static_friction_n_m = 0.0;
    a.transmission.surface_friction_n_m = 0.0;
    a.transmission.stop_rad = 1e6;
    a.controller.sample_hz = sample_hz;
    a
}

fn simulate(case: &Case, control: CurrentControl, samples: usize) -> Result<HighFidelityTrace> {
    let mut scenario = Scenario {
        command: Command::Sine { amplitude_rad: 150.0, frequency_hz: 5.0 },
        mode: ControlMode::Speed,
        load_n_m: case.load_n_m,
        duration_s: (samples * case.every) as f64 / case.sample_hz,
        start_angle_rad: FRAC_PI_4,
        ..Scenario::sine()
    };
    scenario.initial.motor_speed_rad_per_s = case.start_rad_per_s;
    let model = HighFidelity::new(&shaft(case.sample_hz), &scenario)?;
    let model = model.with_current_control(control)?;
    Ok(match case.law {
        Law::Duties(duties) => model.simulate_duties(&healthy(), &duties()?)?,
        Law::Speed => model.simulate(&healthy()),
    })
}

/// Our signals at the recording's instants, in the order of [`SIGNALS`].
fn signals(case: &Case, trace: &HighFidelityTrace) -> [Vec<f64>; 5] {
    let torque = |n: usize| -> f64 {
        let along = |j: usize| {
            let x = 4.0 * trace.motor_angle_rad[n] - TAU / 3.0 * j as f64;
            x.sin() * trace.phase_currents_a[j][n]
        };
        BENCH.motor.back_emf_v_s_per_rad * (0..3).map(along).sum::<f64>()
    };
    let [a, b, c] = trace.phase_currents_a.clone();
    let speed = trace.motor_speed_rad_per_s.clone();
    let torques = (0..speed.len()).map(torque).collect();
    [speed, a, b, c, torques].map(|signal| signal.into_iter().step_by(case.every).collect())
}

/// Both ways of switching.
const CONTROLS: [(&str, CurrentControl); 2] =
    [("averaged", CurrentControl::Averaged), ("carrier", CurrentControl::Carrier)];

pub(super) fn figures() -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    for case in &CASES {
        let reference = read(case.csv, SIGNALS)?;
        for (name, control) in CONTROLS {
            let trace = simulate(case, control, reference[0].len())?;
            let ours = signals(case, &trace);
            figures.extend(differences(&format!("{}/{name}", case.name), &ours, &reference)?);
        }
    }
    Ok(figures)
}

pub(super) fn text(page: &mut String, f: &Lookup<'_>) -> Result<()> {
    page.push_str(
        "\nThe sinusoidal machine of the bench, its shaft alone, in motulator 0.5.0 (`fixtures/references/motulator`), which holds\n\
         the legs' averages over a period. *Averaged*: ours does the same. *Carrier*: ours switches, and is sampled where the\n\
         period begins. As above, per cent of the signal's range; bar: 1.\n\n\
         | case | speed | phase A | phase B | phase C | torque |\n|---|--:|--:|--:|--:|--:|\n",
    );
    for (name, _) in CONTROLS {
        for case in &CASES {
            let what = format!("{}, {name}", case.what);
            peers::line(page, f, &format!("{}/{name}", case.name), &what)?;
        }
    }
    let worst = |name: &str| -> Result<f64> {
        let mut most = 0.0_f64;
        for case in &CASES {
            for signal in SIGNALS {
                most = most.max(f.percent(&format!("{}/{name}/{signal}/max", case.name))?);
            }
        }
        Ok(most)
    };
    writeln!(
        page,
        "\nAveraged, the largest difference is {:.0e} %, under the carrier {:.2} %; the winding's time constant is {:.1} periods.",
        worst("averaged")?,
        worst("carrier")?,
        BENCH.motor.inductance_henry / BENCH.motor.resistance_ohm / PERIOD_S,
    )?;
    page.push_str(include_str!("motulator.md"));
    Ok(())
}
