//! `docs/validation/simulator.md`: the simulators against physics, other software and each other.

mod bench;
mod limits;
mod motulator;
mod peers;
mod signals;
mod speed;

use std::fmt::Write as _;

use anyhow::Result;
use ema_sim::{
    Actuator, CurrentControl, Envelope, EnvelopeFilter, Imperfections, LowFidelity, PhysicalFaults,
    Scenario,
    presets::{BENCH, EMA_48},
};
use greybox::rms;

use self::signals::{
    BASE_POINTS, ERROR_REL, LEVEL, Lookup, NAMES, SETTLED_REL, base_points, combine, disagreements,
    distance, figure, healthy, high, high_signal, low, low_signal, single, worn,
};
use super::figure::Figure;

/// The deterministic figures.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let mut figures = physics()?;
    figures.extend(peers::figures()?);
    figures.extend(motulator::figures()?);
    figures.extend(fidelities()?);
    figures.extend(bench::figures()?);
    figures.extend(limits::figures()?);
    figures.extend(smoothness()?);
    Ok(figures)
}

fn physics() -> Result<Vec<Figure>> {
    let model = high(&Scenario::chirp())?;
    let mut figures = Vec::new();
    for (name, faults) in [("healthy", healthy()), ("worn", worn()?)] {
        let (coarse, energy) = model.simulate_with_ledger(&faults);
        let balance = (energy.residual_j() / energy.dissipated_j()).abs();
        figures.push(figure(format!("{name}/energy-residual"), balance, ERROR_REL, "1"));
        let (fine, _) = model.simulate_finer(&faults, 1.0 / 40.0);
        let gap = distance(&coarse.phase_currents_a[0], &fine.phase_currents_a[0]);
        figures.push(figure(format!("{name}/eight-times-finer"), gap, ERROR_REL, "1"));
        figures.push(figure(format!("{name}/segments"), coarse.segments as f64, SETTLED_REL, "1"));
        for (term, joule) in [
            ("supply", energy.supply_j.iter().sum::<f64>()),
            ("diode-supply", energy.diode_supply_j),
            ("copper", energy.copper_j.iter().sum()),
            ("friction", energy.friction_j),
            ("viscous", energy.viscous_j),
            ("gear", energy.gear_j),
            ("load", energy.load_j),
            ("magnetic", energy.magnetic_j),
            ("kinetic", energy.kinetic_j),
        ] {
            figures.push(figure(format!("{name}/energy/{term}"), joule, SETTLED_REL, "J"));
        }
    }
    let control = CurrentControl::Hysteresis { half_band_a: 0.15 };
    let (trace, energy) =
        model.clone().with_current_control(control)?.simulate_with_ledger(&worn()?);
    let balance = (energy.residual_j() / energy.dissipated_j()).abs();
    figures.push(figure("hysteresis/energy-residual", balance, ERROR_REL, "1"));
    figures.push(figure("hysteresis/segments", trace.segments as f64, SETTLED_REL, "1"));
    let raw = trace.envelope_a(Envelope::SignedProjection, EMA_48.motor.pole_pairs);
    let envelope = EnvelopeFilter::DEFAULT.apply(&raw, trace.rate_hz);
    let carrier = high_signal(&model, &worn()?, Envelope::SignedProjection);
    figures.push(figure("hysteresis/gap", distance(&envelope, &carrier), SETTLED_REL, "1"));
    figures.extend(convergence()?);
    Ok(figures)
}

/// Difference of the low-fidelity current from that of segments sixteen times finer.
fn convergence() -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    for (actuator, machine) in MACHINES {
        for (test, scenario) in [("chirp", Scenario::chirp()), ("sine", Scenario::sine())] {
            for (name, faults) in [("healthy", healthy()), ("worn", worn()?)] {
                let model = LowFidelity::new(&machine, &scenario)?;
                let shipped = model.simulate(&faults).current_a;
                let finer = model.with_finer_segments(1.0 / FINER).simulate(&faults).current_a;
                let id = format!("low/{actuator}/{test}/{name}/finer");
                figures.push(figure(id, distance(&shipped, &finer), ERROR_REL, "1"));
            }
        }
    }
    Ok(figures)
}

/// Parts that a tick is cut into to see whether the low-fidelity model has converged.
const FINER: f64 = 16.0;
/// The two machines, as the page names them.
const MACHINES: [(&str, Actuator); 2] = [("ema-48", EMA_48), ("bench", BENCH)];

fn fidelities() -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    let e6 = Envelope::ConductingPhase;
    let (clean, real) = (Scenario::chirp(), Scenario::chirp().with_real_electronics(1));
    let sine = Scenario::sine();
    for (name, scenario) in [("chirp", &clean), ("chirp-real", &real), ("sine", &sine)] {
        let reference = high_signal(&high(scenario)?, &healthy(), e6);
        // the monitor has no noise to know of
        let monitor = Scenario { imperfections: clean.imperfections, ..scenario.clone() };
        let gap = distance(&low_signal(&low(&monitor)?, &healthy()), &reference);
        figures.push(figure(format!("{name}/healthy-gap"), gap, SETTLED_REL, "1"));
    }
    for (name, envelope) in
        [("half-abs-sum", Envelope::HalfAbsSum), ("signed-projection", Envelope::SignedProjection)]
    {
        let reference = high_signal(&high(&clean)?, &healthy(), envelope);
        let mut monitor = low(&clean)?.simulate(&healthy()).current_a;
        if envelope == Envelope::HalfAbsSum {
            monitor = monitor.into_iter().map(f64::abs).collect();
        }
        let gap = distance(&EnvelopeFilter::DEFAULT.apply(&monitor, 10e3), &reference);
        figures.push(figure(format!("chirp/healthy-gap/{name}"), gap, SETTLED_REL, "1"));
    }
    let seed = |seed| -> Result<Vec<f64>> {
        Ok(high_signal(&high(&Scenario::chirp().with_real_electronics(seed))?, &healthy(), e6))
    };
    figures.push(figure("chirp-real/seed-floor", distance(&seed(1)?, &seed(2)?), SETTLED_REL, "1"));
    let mut digitised = Scenario::chirp();
    digitised.imperfections = Imperfections { controller_noise: false, digitisation: true };
    let silent = high_signal(&high(&digitised)?, &healthy(), e6);
    for n in [1, 2] {
        let size = distance(&seed(n)?, &silent);
        figures.push(figure(format!("chirp-real/noise/{n}"), size, SETTLED_REL, "1"));
    }
    figures.extend(signatures("signature", &clean)?);
    figures.extend(signatures("sine/signature", &sine)?);
    Ok(figures)
}

/// Change of the signal by each fault in low fidelity, against that in high fidelity.
fn signatures(prefix: &str, scenario: &Scenario) -> Result<Vec<Figure>> {
    let e6 = Envelope::ConductingPhase;
    let mut figures = Vec::new();
    let (reference, monitor) = (high(scenario)?, low(scenario)?);
    let (high_zero, low_zero) =
        (high_signal(&reference, &healthy(), e6), low_signal(&monitor, &healthy()));
    for (coordinate, name) in NAMES.iter().enumerate() {
        let faults = single(coordinate, LEVEL);
        let h = combine(&high_signal(&reference, &faults, e6), &high_zero, |a, b| a - b);
        let l = combine(&low_signal(&monitor, &faults), &low_zero, |a, b| a - b);
        let dot: f64 = h.iter().zip(&l).map(|(a, b)| a * b).sum::<f64>() / h.len() as f64;
        let cosine = dot / (rms(&h) * rms(&l));
        figures.push(figure(format!("{prefix}/{name}/cosine"), cosine, SETTLED_REL, "1"));
        let ratio = rms(&l) / rms(&h);
        figures.push(figure(format!("{prefix}/{name}/magnitude"), ratio, SETTLED_REL, "1"));
    }
    Ok(figures)
}

fn smoothness() -> Result<Vec<Figure>> {
    let bases = base_points()?;
    let e6 = Envelope::ConductingPhase;
    let reference = high(&Scenario::chirp())?;
    let real = high(&Scenario::chirp().with_real_electronics(1))?;
    let monitor = low(&Scenario::chirp())?;
    let high_clean = |faults: &PhysicalFaults| high_signal(&reference, faults, e6);
    let high_real = |faults: &PhysicalFaults| high_signal(&real, faults, e6);
    let low_clean = |faults: &PhysicalFaults| low_signal(&monitor, faults);
    let mut figures = Vec::new();
    let few = &bases[..5];
    for (coordinate, name) in NAMES.iter().enumerate() {
        let mut add = |id: &str, all: &[f64]| {
            let median = all[all.len() / 2];
            // a median of errors, a few of which are jumps
            figures.push(figure(format!("smoothness/{id}/{name}"), median, 0.05, "1"));
        };
        add("high", &disagreements(&high_clean, &bases, coordinate, (1e-3, 1e-4)));
        add("low", &disagreements(&low_clean, &bases, coordinate, (1e-3, 1e-4)));
        add("high-wide", &disagreements(&high_clean, &bases, coordinate, (3e-3, 1e-3)));
        add("high-real", &disagreements(&high_real, few, coordinate, (1e-3, 1e-4)));
    }
    Ok(figures)
}

/// The page.
pub(super) fn text(figures: &[Figure]) -> Result<String> {
    let lookup = Lookup(figures);
    let mut page = String::from(HEADER);
    physics_text(&mut page, &lookup)?;
    peers::text(&mut page, &lookup)?;
    motulator::text(&mut page, &lookup)?;
    fidelities_text(&mut page, &lookup)?;
    bench::text(&mut page, &lookup)?;
    limits::text(&mut page, &lookup)?;
    speed::text(&mut page, &lookup)?;
    smoothness_text(&mut page, &lookup)?;
    page.push_str(INPUT);
    Ok(page)
}

const HEADER: &str = "\
# The simulators

Written by `cargo xtask validate simulator`; do not edit. Actuator EMA-48, the chirp of 0.5 s with a load of
0.5 N·m, envelope `conducting-phase` through the default filter, controller noise and digitisation off, unless a
line says otherwise. *Worn* is k = (0.04, 0.02, 0.05, 0, 0.03, 0.05, 0.7).
";

fn physics_text(page: &mut String, f: &Lookup<'_>) -> Result<()> {
    writeln!(
        page,
        "\n## Physics\n\n| what | healthy | worn | bar |\n|---|--:|--:|--:|\n\
         | energy unaccounted for, over energy dissipated | {:.1e} | {:.1e} | 1e-6 |\n\
         | phase current against segments cut eight times finer, rms over rms | {:.1e} | {:.1e} | 1e-5 |\n\
         | segments | {:.0} | {:.0} | |",
        f.get("healthy/energy-residual")?,
        f.get("worn/energy-residual")?,
        f.get("healthy/eight-times-finer")?,
        f.get("worn/eight-times-finer")?,
        f.get("healthy/segments")?,
        f.get("worn/segments")?,
    )?;
    writeln!(
        page,
        "\nUnder hysteresis control (half-band 0.15 A, worn, {:.0} segments) {:.1e} of the energy is unaccounted for, and the\n\
         filtered signed projection is {:.1} % of rms from that under the carrier.",
        f.get("hysteresis/segments")?,
        f.get("hysteresis/energy-residual")?,
        f.percent("hysteresis/gap")?,
    )?;
    writeln!(
        page,
        "\n**Low fidelity**: its current against that of segments {FINER} times finer, rms over rms (bar: 1e-5; test\n\
         `order_low_fidelity_is_converged`):\n\n\
         | machine | chirp, healthy | chirp, worn | sine, healthy | sine, worn |\n|---|--:|--:|--:|--:|"
    )?;
    for (actuator, _) in MACHINES {
        write!(page, "| {actuator} |")?;
        for case in ["chirp/healthy", "chirp/worn", "sine/healthy", "sine/worn"] {
            write!(page, " {:.1e} |", f.get(&format!("low/{actuator}/{case}/finer"))?)?;
        }
        writeln!(page)?;
    }
    writeln!(page, "\nWhere the energy goes, each term integrated on its own, J:\n")?;
    writeln!(page, "| term | healthy | worn |\n|---|--:|--:|")?;
    for term in [
        "supply",
        "diode-supply",
        "copper",
        "friction",
        "viscous",
        "gear",
        "load",
        "magnetic",
        "kinetic",
    ] {
        let joule = |case: &str| f.get(&format!("{case}/energy/{term}"));
        writeln!(page, "| {term} | {:.5} | {:.5} |", joule("healthy")?, joule("worn")?)?;
    }
    page.push_str(PHYSICS_TESTS);
    Ok(())
}

const PHYSICS_TESTS: &str = "
Tests of `ema-sim` (`tests/it`) hold the rest:

| case | held to | test |
|---|---|---|
| the same physics in fixed steps of 25 ns, written apart, worn, turned start | 1e-4 of rms, falling with the step | `law_small_fixed_steps_converge_to_the_engine` |
| locked rotor, unequal phases: rise of a coil's current | 7 µA of 23 A | `law_locked_rotor_current_rises_as_in_a_coil` |
| no-load speed, supply over torque constant | 1e-3 | `law_no_load_speed_is_supply_over_torque_constant` |
| coast-down with dry and viscous friction: speed, end, angle | 1e-9 | `law_coasting_ends_where_friction_says` |
| free play: the surface rests until the flank touches | rounding | `law_the_surface_rests_while_the_play_is_open` |
| currents sum to zero, unequal phases | 1e-14 A | `property_currents_sum_to_zero_with_unequal_phases` |
| energy through the end stops | 1e-6 | `law_energy_is_balanced_through_the_stops` |
| energy with a dead time of 1 µs, both drives | 1e-6 | `law_energy_is_balanced_with_a_dead_time` |
| voltage that a dead time takes | a dead time's shift of the sample, 3 % | `law_a_leg_loses_dead_time_times_carrier_of_the_supply` |
| full damage of each fault and of all, both drives | finite | `full_damage_of_every_fault_runs` |
| damage as often full as not, with any of the effects, both drives and fidelities, 96 draws | finite | `property_effects_within_bounds_leave_numbers` |
| allocations of a run, both fidelities, both machines, batch, servo axis | the same for 0.1 s and 0.5 s | `the_step_loop_of_high_fidelity_allocates_nothing`, … |
| gap, cosine, magnitude of EMA-48 | the bars below | `law_low_and_high_fidelity_agree_within_the_bars` |
| smoothness of EMA-48 | the bars below | `law_high_fidelity_is_smooth_in_the_fault_levels`, … |

Torque and back-EMF share one k_j in the code (`Coupling`); the energy balance would show it if they did not.
";

fn fidelities_text(page: &mut String, f: &Lookup<'_>) -> Result<()> {
    writeln!(
        page,
        "\n## Low against high fidelity\n\n\
         Healthy gap, rms of the difference over rms:\n\n\
         | case | gap % | bar |\n|---|--:|--:|\n\
         | chirp | {:.2} | 1 |\n\
         | chirp, projection on the commutation pattern | {:.2} | |\n\
         | chirp, half sum of absolute values | {:.2} | |\n\
         | chirp, controller noise and digitisation on | {:.2} | |\n\
         | two noise seeds against each other | {:.2} | 1.41 times the noise: {:.2} |\n\
         | the noise's own size: seed 1, seed 2, each against the run without noise | {:.2}, {:.2} | |\n\
         | sine of 5 s | {:.2} | none: the bar is the chirp's |",
        f.percent("chirp/healthy-gap")?,
        f.percent("chirp/healthy-gap/signed-projection")?,
        f.percent("chirp/healthy-gap/half-abs-sum")?,
        f.percent("chirp-real/healthy-gap")?,
        f.percent("chirp-real/seed-floor")?,
        f.percent("chirp-real/noise/1")?.hypot(f.percent("chirp-real/noise/2")?),
        f.percent("chirp-real/noise/1")?,
        f.percent("chirp-real/noise/2")?,
        f.percent("sine/healthy-gap")?,
    )?;
    writeln!(
        page,
        "\nSignature of each fault at 0.05, low against high: cosine, and size of low over high. The bars are of the\n\
         chirp; the sine of 5 s has none.\n\n\
         | fault | chirp, cosine | bar | chirp, magnitude | bar | sine, cosine | sine, magnitude |\n\
         |---|--:|--:|--:|--:|--:|--:|"
    )?;
    for name in NAMES {
        let of = |prefix: &str, what: &str| f.get(&format!("{prefix}/{name}/{what}"));
        writeln!(
            page,
            "| {name} | {:.4} | 0.95 | {:.4} | 0.97 to 1.03 | {:.4} | {:.4} |",
            of("signature", "cosine")?,
            of("signature", "magnitude")?,
            of("sine/signature", "cosine")?,
            of("sine/signature", "magnitude")?,
        )?;
    }
    Ok(())
}

fn smoothness_text(page: &mut String, f: &Lookup<'_>) -> Result<()> {
    writeln!(
        page,
        "\n## Smoothness in the fault levels\n\n\
         Central differences of the filtered envelope at steps of 1e-3 and 1e-4, rms of their difference over rms,\n\
         median over {BASE_POINTS} base points (the last column: steps of 3e-3 and 1e-3; the column before it: noise and\n\
         digitisation on, one seed, five points). Per cent.\n\n\
         | level | low | bar | high | bar | high, real electronics | high, wider steps |\n\
         |---|--:|--:|--:|--:|--:|--:|"
    )?;
    for (coordinate, name) in NAMES.iter().enumerate() {
        let at = |id: &str| f.percent(&format!("smoothness/{id}/{name}"));
        let bar = if coordinate == 1 { "analysed" } else { "15" };
        writeln!(
            page,
            "| {name} | {:.2} | 2 | {:.1} | {bar} | {:.0} | {:.1} |",
            at("low")?,
            at("high")?,
            at("high-real")?,
            at("high-wide")?,
        )?;
    }
    page.push_str(SMOOTHNESS);
    Ok(())
}

const SMOOTHNESS: &str = include_str!("simulator/smoothness.md");

const INPUT: &str = "
## Bad input

| input | outcome | test |
|---|---|---|
| any parameter negative, NaN, infinite, beyond its bound; no pole pair | `ParameterError::OutOfBounds` with key and bounds | `every_number_is_guarded`, `bounds_are_told_in_words` |
| static below kinetic friction (both named), play wider than the stop, dead time above a tenth of the period, trapezoidal machine under a field-oriented drive, carrier no multiple of the controller's rate, winding faster than the carrier resolves | `ParameterError` | `rules_between_numbers_are_guarded` |
| an inertia so small, or a back-EMF so weak, that a tick or a carrier period is too coarse for it | `ParameterError::TooLight`, `TooFast` with key, value and least value | `machines_that_cannot_be_followed_are_refused`, `a_mass_too_small_for_the_tick_is_named` |
| command beyond the stops; load, duration, angle, play, integrators or command not finite | `SimulationError` | `tests_that_cannot_be_run_are_refused` |
| a test of more than 4e7 ticks or 1e9 carrier periods | `SimulationError::Scenario` with the longest | `a_test_has_an_end` |
| a level outside 0 to 1 | `FaultLevelError` | `levels_outside_the_scale_are_refused` |
| a fault that an axis cannot have, a command that it has no gain for | `ParameterError::NoSuchFault`, `SimulationError::Unregulated` | `a_fault_without_its_cause_is_told`, `a_command_that_no_gain_follows_is_refused` |
| an effect too strong for its machine | `EffectError::TooStrong` with key and most | `an_effect_too_strong_for_its_machine_is_refused_by_name` |
| an effect that would change nothing on its machine, a block of one without a size | `EffectError::NotInModel` with the reason, `ModelFileError::Sizeless`, `Curveless` with the keys | `every_number_of_an_effect_acts_or_is_refused`, `an_effect_without_a_size_is_refused_with_its_keys` |
| effects that drive the shaft away, in either fidelity or on an axis | the run ends with `SimulationError::Runaway`: time, speed, bound, effects | `a_shaft_that_is_driven_away_ends_the_run_in_high_fidelity`, `an_axis_that_is_driven_away_ends_the_run`, … |
| noise, steps and converters beyond any sensor, an axis' offset beyond 1e9 | `ParameterError` with key and bounds | `noise_and_steps_beyond_any_sensor_are_refused`, `sensors_that_nobody_has_are_refused_by_name` |
| dead time of more than the supply, a sensor's offset of more than the controller's limit, a friction curve beyond 1e9 | `EffectError::TooStrong` | `a_voltage_beyond_the_supply_and_a_friction_beyond_any_are_refused` |
| events that repeat at one instant | put off after 1024 in a hold of the legs (4096 in a tick of low fidelity), so that the run ends | `cogging_beyond_the_motor_comes_to_an_end`, `events_at_one_instant_come_to_an_end` |
| 200 random machines with random damage | all that is accepted runs | `property_whatever_is_accepted_runs` |
| 200 random servo axes, every drive and input, damage as often full as not, any effects | all that is accepted runs, in bounded work, or is driven away by a named effect | `property_whatever_axis_is_accepted_runs` |
";
