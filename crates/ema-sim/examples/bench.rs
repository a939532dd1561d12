//! The paper's bench test with friction and play: `cargo run --release --example bench`.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use ema_sim::{
    Envelope, EnvelopeFilter, FaultId, FaultLevel, HealthState, HighFidelity, LowFidelity,
    Scenario, presets::BENCH,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenario = Scenario::sine();
    let reference = HighFidelity::new(&BENCH, &scenario)?;
    let monitor = LowFidelity::new(&BENCH, &scenario)?;
    let level = FaultLevel::new(0.05)?;
    let cases = [
        ("healthy", HealthState::HEALTHY),
        ("friction", HealthState::HEALTHY.with(FaultId::Friction, level)),
        ("backlash", HealthState::HEALTHY.with(FaultId::Backlash, level)),
    ];
    let mut healthy_a = None;
    for (name, health) in cases {
        let faults = (&health).into();
        let high = reference.simulate(&faults);
        let low = monitor.simulate(&faults);
        let envelope = high.envelope_a(Envelope::QAxis, BENCH.motor.pole_pairs);
        let high_a = EnvelopeFilter::DEFAULT.apply(&envelope, high.rate_hz);
        let low_a = EnvelopeFilter::DEFAULT.apply(&low.current_a, low.rate_hz);
        let first_a = healthy_a.get_or_insert_with(|| high_a.clone());
        println!(
            "{name}: q-axis current {:.4} A rms, changed by {:.4} A rms, low fidelity off by {:.4} A rms",
            rms(&high_a),
            distance(&high_a, first_a),
            distance(&high_a, &low_a),
        );
    }
    Ok(())
}

/// Root of the mean square.
fn rms(signal: &[f64]) -> f64 {
    (signal.iter().map(|x| x * x).sum::<f64>() / signal.len() as f64).sqrt()
}

/// The same of a difference.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    rms(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}
