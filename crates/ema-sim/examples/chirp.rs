//! The chirp test on a healthy and a worn actuator: `cargo run --release --example chirp`.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use ema_sim::{
    Envelope, EnvelopeFilter, FaultId, FaultLevel, HealthState, HighFidelity, LowFidelity,
    Scenario, presets::EMA_48,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenario = Scenario::chirp();
    let reference = HighFidelity::new(&EMA_48, &scenario)?;
    let monitor = LowFidelity::new(&EMA_48, &scenario)?;
    let worn = HealthState::HEALTHY
        .with(FaultId::Friction, FaultLevel::new(0.04)?)
        .with(FaultId::ShortA, FaultLevel::new(0.03)?);
    for (name, health) in [("healthy", HealthState::HEALTHY), ("worn", worn)] {
        let faults = (&health).into();
        let high = reference.simulate(&faults);
        let low = monitor.simulate(&faults);
        let envelope = high.envelope_a(Envelope::ConductingPhase, EMA_48.motor.pole_pairs);
        let high_a = EnvelopeFilter::DEFAULT.apply(&envelope, high.rate_hz);
        let low_a = EnvelopeFilter::DEFAULT.apply(&low.current_a, low.rate_hz);
        let gap: Vec<f64> = high_a.iter().zip(&low_a).map(|(h, l)| h - l).collect();
        println!(
            "{name}: envelope {:.4} A rms, low fidelity off by {:.4} A rms, {} segments",
            rms(&high_a),
            rms(&gap),
            high.segments,
        );
    }
    Ok(())
}

/// Root of the mean square.
fn rms(signal: &[f64]) -> f64 {
    (signal.iter().map(|x| x * x).sum::<f64>() / signal.len() as f64).sqrt()
}
