//! Results of a simulation: channels sampled at the controller's rate.

use crate::{ended::Ended, envelope::Envelope, phase::PerPhase, runaway::Runaway};

/// Signals of the high-fidelity model, sampled at each tick before the controller acts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HighFidelityTrace {
    /// Rate of all channels.
    pub rate_hz: f64,
    /// Set-point of the surface.
    pub command_rad: Vec<f64>,
    /// Currents of the phases A, B, C.
    pub phase_currents_a: [Vec<f64>; 3],
    /// Rotor angle, with the start angle.
    pub motor_angle_rad: Vec<f64>,
    /// Rotor speed.
    pub motor_speed_rad_per_s: Vec<f64>,
    /// Angle of the surface.
    pub surface_angle_rad: Vec<f64>,
    /// Voltage that the current loop puts on the motor in the carrier period that begins at the tick:
    /// its duty times the supply, of a field-oriented drive along the quadrature axis, as an amplitude
    /// of the phases. Empty where no current loop makes the duties: under hysteresis control, and where
    /// they are given.
    pub motor_voltage_v: Vec<f64>,
    /// Cost of the run: segments between events.
    pub segments: u64,
    /// Why the run ended before its test, where it did; its channels are NaN from there on.
    pub runaway: Option<Runaway>,
}

impl HighFidelityTrace {
    /// Phase currents of one sample.
    pub fn phases_a(&self, sample: usize) -> PerPhase {
        [0, 1, 2].map(|phase| self.phase_currents_a[phase][sample])
    }

    /// The envelope current at the trace's own rate, not yet filtered.
    pub fn envelope_a(&self, envelope: Envelope, pole_pairs: u32) -> Vec<f64> {
        let [a, b, c] = &self.phase_currents_a;
        envelope.of_phases_at([a, b, c], &self.motor_angle_rad, pole_pairs)
    }
}

/// Motion and current of the motor of the low-fidelity model, sampled at each tick before the
/// controller acts; NaN from where the shaft is driven away.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotorMotion {
    /// Equivalent direct current `I_m`, as its sensor shows it.
    pub current_a: Vec<f64>,
    /// Rotor angle, with the start angle.
    pub motor_angle_rad: Vec<f64>,
    /// Rotor speed.
    pub motor_speed_rad_per_s: Vec<f64>,
}

/// Signals of the low-fidelity model, sampled at each tick before the controller acts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LowFidelityTrace {
    /// Rate of all channels.
    pub rate_hz: f64,
    /// Equivalent direct current `I_m`.
    pub current_a: Vec<f64>,
    /// Rotor angle, with the start angle.
    pub motor_angle_rad: Vec<f64>,
    /// Rotor speed.
    pub motor_speed_rad_per_s: Vec<f64>,
    /// Angle of the surface.
    pub surface_angle_rad: Vec<f64>,
    /// Cost of the run: segments between events.
    pub segments: u64,
    /// Why the run ended before its test, where it did; its channels are NaN from there on.
    pub runaway: Option<Runaway>,
}

impl Ended for HighFidelityTrace {
    fn runaway(&self) -> Option<&Runaway> {
        self.runaway.as_ref()
    }

    fn channels(&mut self) -> Vec<&mut Vec<f64>> {
        let [a, b, c] = &mut self.phase_currents_a;
        let turning = [&mut self.motor_angle_rad, &mut self.motor_speed_rad_per_s];
        let outside = [&mut self.command_rad, &mut self.surface_angle_rad];
        let voltage = Some(&mut self.motor_voltage_v).filter(|voltage_v| !voltage_v.is_empty());
        turning.into_iter().chain(outside).chain([a, b, c]).chain(voltage).collect()
    }
}

impl Ended for LowFidelityTrace {
    fn runaway(&self) -> Option<&Runaway> {
        self.runaway.as_ref()
    }

    fn channels(&mut self) -> Vec<&mut Vec<f64>> {
        let Self { current_a, motor_angle_rad, motor_speed_rad_per_s, surface_angle_rad, .. } =
            self;
        vec![current_a, motor_angle_rad, motor_speed_rad_per_s, surface_angle_rad]
    }
}
