//! A motion of the high-fidelity model as a recording samples it.

use ema_sim::{HighFidelity, HighFidelityTrace, PhysicalFaults, SimulationError};

use crate::simulation::resampling::resampled;

/// Instants of samples at a rate from the first of some ticks to the last one, s.
fn instants_s(ticks: usize, tick_hz: f64, rate_hz: f64) -> Vec<f64> {
    let last = ticks.saturating_sub(1) as f64;
    let count = (last * rate_hz / tick_hz).floor() as usize + 1;
    (0..count).map(|n| (n as f64 / rate_hz).min(last / tick_hz)).collect()
}

/// A motion at the ticks of the controller, and the same one at another rate: currents and angle as
/// they are at these instants, with the ripple of the carrier; the other channels straight between
/// ticks.
pub(crate) fn sampled_at(
    model: &HighFidelity,
    faults: &PhysicalFaults,
    rate_hz: f64,
) -> Result<(HighFidelityTrace, HighFidelityTrace), SimulationError> {
    let tick_hz = model.tick_hz();
    let instants_s = instants_s(model.samples(), tick_hz, rate_hz);
    let (trace, logged) = model.simulate_logged(faults, &instants_s)?;
    let straight = |channel: &[f64]| resampled(channel, tick_hz, rate_hz);
    let sampled = HighFidelityTrace {
        rate_hz,
        command_rad: straight(&trace.command_rad),
        phase_currents_a: logged.phase_currents_a,
        motor_angle_rad: logged.motor_angle_rad,
        motor_speed_rad_per_s: straight(&trace.motor_speed_rad_per_s),
        surface_angle_rad: straight(&trace.surface_angle_rad),
        motor_voltage_v: straight(&trace.motor_voltage_v),
        ..trace.clone()
    };
    Ok((trace, sampled))
}
