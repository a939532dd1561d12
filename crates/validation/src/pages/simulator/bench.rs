//! The bench: a sinusoidal machine under a field-oriented drive.

use std::fmt::Write as _;

use anyhow::Result;
use ema_sim::{
    CurrentControl, Envelope, EnvelopeFilter, HighFidelity, HighFidelityTrace, LowFidelity,
    PhysicalFaults, Scenario, presets::BENCH,
};
use greybox::rms;

use crate::pages::figure::Figure;

use super::{
    signals::{
        ERROR_REL, LEVEL, Lookup, NAMES, SETTLED_REL, base_points, combine, disagreements,
        distance, figure, healthy, low_signal, single, worn,
    },
    speed::{least_cpu_ms, least_ms},
};

/// The two tests, as the page names them.
fn tests() -> [(&'static str, Scenario); 2] {
    [("chirp", Scenario::chirp()), ("sine", Scenario::sine())]
}

pub(super) fn signal(model: &HighFidelity, faults: &PhysicalFaults) -> Vec<f64> {
    let trace = model.simulate(faults);
    let raw = trace.envelope_a(Envelope::QAxis, BENCH.motor.pole_pairs);
    EnvelopeFilter::DEFAULT.apply(&raw, trace.rate_hz)
}

/// The phases, as the page names them.
const PHASES: [&str; 3] = ["a", "b", "c"];
/// Carriers whose whole period is one segment.
const CARRIERS_HZ: [f64; 3] = [20e3, 40e3, 80e3];

/// The carrier whose segments are so short that their error is below that of the others.
const FINEST_HZ: f64 = 640e3;

/// The bench's machine without friction, its terminals joined, from 200 rad/s for 5 ms.
fn braked(carrier_hz: f64, start_rad: f64, inertia_kg_m2: f64) -> Result<HighFidelityTrace> {
    let mut actuator = BENCH;
    actuator.motor.inertia_kg_m2 = inertia_kg_m2;
    actuator.inverter.carrier_hz = carrier_hz;
    actuator.transmission.stop_rad = 1e6;
    let t = &mut actuator.transmission;
    (t.kinetic_friction_n_m, t.static_friction_n_m, t.surface_friction_n_m) = (0.0, 0.0, 0.0);
    let mut scenario = Scenario::sine().turned_to(start_rad);
    scenario.initial.motor_speed_rad_per_s = BRAKED_RAD_PER_S;
    let model = HighFidelity::new(&actuator, &scenario)?;
    let model = model.with_current_control(CurrentControl::Averaged)?;
    let duties = vec![[0.5; 3]; (5e-3 * carrier_hz).round() as usize];
    Ok(model.simulate_duties(&healthy(), &duties)?)
}

const BRAKED_RAD_PER_S: f64 = 200.0;

/// Largest error of each phase, the speed held by a flywheel.
///
/// ```text
/// L·i' = −R·i − k·ω·sin(P·ω·t + φ)
/// ```
fn errors_of_segments(carrier_hz: f64) -> Result<[f64; 3]> {
    let (speed, start_rad) = (BRAKED_RAD_PER_S, 0.3);
    let trace = braked(carrier_hz, start_rad, 1e9)?;
    let (r, l) = (BENCH.motor.resistance_ohm, BENCH.motor.inductance_henry);
    let electrical = 4.0 * speed;
    let amplitude = -BENCH.motor.back_emf_v_s_per_rad * speed / r.hypot(electrical * l);
    let lag = (electrical * l).atan2(r);
    let third = core::f64::consts::TAU / 3.0;
    Ok(core::array::from_fn(|phase| {
        let start = 4.0 * start_rad - lag - third * phase as f64;
        let steady = |t: f64| amplitude * (electrical * t + start).sin();
        let error = |n: usize| {
            let t = n as f64 / trace.rate_hz;
            let exact = steady(t) - steady(0.0) * (-r / l * t).exp();
            (trace.phase_currents_a[phase][n] - exact).abs()
        };
        (0..trace.motor_angle_rad.len()).map(error).fold(0.0, f64::max)
    }))
}

/// Largest difference of the speed to that of the finest segments, the rotor braked.
fn speed_error_of_segments(carrier_hz: f64, finest: &HighFidelityTrace) -> Result<f64> {
    let trace = braked(carrier_hz, 0.3, BENCH.motor.inertia_kg_m2)?;
    let pairs = trace.motor_speed_rad_per_s.iter().zip(&finest.motor_speed_rad_per_s);
    Ok(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
}

pub(super) fn figures() -> Result<Vec<Figure>> {
    let mut figures = physics()?;
    let finest = braked(FINEST_HZ, 0.3, BENCH.motor.inertia_kg_m2)?;
    for carrier_hz in CARRIERS_HZ {
        let mut add = |what: &str, error: f64, unit: &str| {
            figures.push(figure(
                format!("bench/order/{what}/{carrier_hz}"),
                error,
                SETTLED_REL,
                unit,
            ));
        };
        for (phase, error) in PHASES.iter().zip(errors_of_segments(carrier_hz)?) {
            add(phase, error, "A");
        }
        add("speed", speed_error_of_segments(carrier_hz, &finest)?, "rad/s");
    }
    for (test, scenario) in tests() {
        figures.extend(fidelities(test, &scenario)?);
    }
    let (high, low) = (
        HighFidelity::new(&BENCH, &Scenario::chirp())?,
        LowFidelity::new(&BENCH, &Scenario::chirp())?,
    );
    let bases = base_points()?;
    let steps = (1e-3, 1e-4);
    for (coordinate, name) in NAMES.iter().enumerate() {
        let mut add = |id: &str, all: &[f64]| {
            let id = format!("bench/smoothness/{id}/{name}");
            figures.push(figure(id, all[all.len() / 2], 0.05, "1"));
        };
        add("high", &disagreements(&|f| signal(&high, f), &bases, coordinate, steps));
        add("low", &disagreements(&|f| low_signal(&low, f), &bases, coordinate, steps));
    }
    Ok(figures)
}

fn physics() -> Result<Vec<Figure>> {
    let model = HighFidelity::new(&BENCH, &Scenario::chirp())?;
    let mut figures = Vec::new();
    for (name, faults) in [("healthy", healthy()), ("worn", worn()?)] {
        let (coarse, energy) = model.simulate_with_ledger(&faults);
        let balance = (energy.residual_j() / energy.dissipated_j()).abs();
        figures.push(figure(format!("bench/{name}/energy-residual"), balance, ERROR_REL, "1"));
        let (fine, _) = model.simulate_finer(&faults, 1.0 / 40.0);
        let gap = distance(&coarse.phase_currents_a[0], &fine.phase_currents_a[0]);
        figures.push(figure(format!("bench/{name}/finer"), gap, ERROR_REL, "1"));
        let segments = coarse.segments as f64;
        figures.push(figure(format!("bench/{name}/segments"), segments, SETTLED_REL, "1"));
    }
    Ok(figures)
}

fn fidelities(test: &str, scenario: &Scenario) -> Result<Vec<Figure>> {
    let (high, low) = (HighFidelity::new(&BENCH, scenario)?, LowFidelity::new(&BENCH, scenario)?);
    let (high_zero, low_zero) = (signal(&high, &healthy()), low_signal(&low, &healthy()));
    let gap = distance(&low_zero, &high_zero);
    let mut figures = vec![figure(format!("bench/{test}/healthy-gap"), gap, SETTLED_REL, "1")];
    for (coordinate, name) in NAMES.iter().enumerate() {
        let faults = single(coordinate, LEVEL);
        let h = combine(&signal(&high, &faults), &high_zero, |a, b| a - b);
        let l = combine(&low_signal(&low, &faults), &low_zero, |a, b| a - b);
        let dot: f64 = h.iter().zip(&l).map(|(a, b)| a * b).sum::<f64>() / h.len() as f64;
        let mut add = |what: &str, value: f64, unit: &str| {
            let id = format!("bench/{test}/signature/{name}/{what}");
            figures.push(figure(id, value, SETTLED_REL, unit));
        };
        add("cosine", dot / (rms(&h) * rms(&l)), "1");
        add("magnitude", rms(&l) / rms(&h), "1");
        add("size", rms(&h), "A");
    }
    Ok(figures)
}

/// Least cosine of a signature, and how far its magnitude may be from 1.
const LEAST_COSINE: f64 = 0.98;
const MOST_OFF: f64 = 0.03;
/// Largest disagreement of differences in high and in low fidelity, %.
const SMOOTH: [f64; 2] = [15.0, 2.0];

pub(super) fn text(page: &mut String, f: &Lookup<'_>) -> Result<()> {
    writeln!(
        page,
        "\n## The bench\n\n\
         `presets::BENCH` (`docs/models/bench.md`): sinusoidal machine, field-oriented drive, encoder on the motor shaft; envelope\n\
         `q-axis`. On the chirp with its load:\n\n\
         | what | healthy | worn | bar |\n|---|--:|--:|--:|\n\
         | energy unaccounted for, over energy dissipated | {:.1e} | {:.1e} | 1e-6 |\n\
         | phase current against finer segments (a fortieth of the longest), rms over rms | {:.1e} | {:.1e} | 1e-5 |\n\
         | segments | {:.0} | {:.0} | |",
        f.get("bench/healthy/energy-residual")?,
        f.get("bench/worn/energy-residual")?,
        f.get("bench/healthy/finer")?,
        f.get("bench/worn/finer")?,
        f.get("bench/healthy/segments")?,
        f.get("bench/worn/segments")?,
    )?;
    writeln!(
        page,
        "\n**Order**, on a right-hand side that depends on time: terminals joined, a flywheel at 200 rad/s, so that\n\
         L·i' = −R·i − k·ω·sin(P·ω·t + φ) has a closed solution for each phase; and the speed of the bench's own rotor, braked\n\
         by its currents from 200 rad/s, against segments of {:.2} µs. Largest error over 5 ms, of currents of 9 A; beside it the order:\n\n\
         | segment µs | phase A, A | | phase B, A | | phase C, A | | speed, rad/s | |\n|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
        1e6 / FINEST_HZ,
    )?;
    for (n, carrier_hz) in CARRIERS_HZ.into_iter().enumerate() {
        write!(page, "| {} |", 1e6 / carrier_hz)?;
        for what in PHASES.into_iter().chain(["speed"]) {
            let at = |carrier_hz: f64| f.get(&format!("bench/order/{what}/{carrier_hz}"));
            let error = at(carrier_hz)?;
            let order = match n {
                0 => String::new(),
                _ => format!("{:.2}", (at(CARRIERS_HZ[n - 1])? / error).log2()),
            };
            write!(page, " {error:.1e} | {order} |")?;
        }
        writeln!(page)?;
    }
    signatures(page, f)?;
    let (high, low) = (
        HighFidelity::new(&BENCH, &Scenario::sine())?,
        LowFidelity::new(&BENCH, &Scenario::sine())?,
    );
    writeln!(
        page,
        "\nThe sine of 5 s takes {:.0} ms in high and {:.1} ms in low fidelity (healthy, least of several runs).",
        least_cpu_ms(6, || drop(std::hint::black_box(high.simulate(&healthy())))),
        least_ms(50, || drop(std::hint::black_box(low.simulate(&healthy())))),
    )?;
    Ok(())
}

/// The low-fidelity model against the high-fidelity one: signatures of the faults, smoothness.
fn signatures(page: &mut String, f: &Lookup<'_>) -> Result<()> {
    writeln!(
        page,
        "\nLow against high fidelity: the healthy gap is {:.2} % of rms on the chirp (bar: 1) and {:.2} % on the sine of 5 s\n\
         without load. Signature of each fault at 0.05 (bars: cosine 0.98, magnitude within 3 %), and smoothness on the chirp as\n\
         below (bars: high 15 %, low 2 %):\n\n\
         | fault | chirp: cosine | magnitude | rms A | sine: cosine | magnitude | rms A | smoothness high % | low % |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|",
        f.percent("bench/chirp/healthy-gap")?,
        f.percent("bench/sine/healthy-gap")?,
    )?;
    let mut missed = Vec::new();
    for name in NAMES {
        write!(page, "| {name} |")?;
        for (test, _) in tests() {
            let at = |what: &str| f.get(&format!("bench/{test}/signature/{name}/{what}"));
            let (cosine, magnitude) = (at("cosine")?, at("magnitude")?);
            write!(page, " {cosine:.4} | {magnitude:.4} | {:.4} |", at("size")?)?;
            if cosine < LEAST_COSINE || (magnitude - 1.0).abs() > MOST_OFF {
                missed.push(format!("{name} on the {test}"));
            }
        }
        let smooth = |id: &str| f.percent(&format!("bench/smoothness/{id}/{name}"));
        let (high, low) = (smooth("high")?, smooth("low")?);
        writeln!(page, " {high:.1} | {low:.2} |")?;
        for (fidelity, found, most) in [("high", high, SMOOTH[0]), ("low", low, SMOOTH[1])] {
            if found > most {
                missed.push(format!("{name} in its smoothness in {fidelity} fidelity"));
            }
        }
    }
    let missed = if missed.is_empty() { "nothing".to_owned() } else { missed.join(", ") };
    writeln!(
        page,
        "\nBeyond the bars: {missed}. k2 shows through the friction of the user shaft, which the motor does not feel while it\n\
         crosses the play."
    )?;
    Ok(())
}
