//! Parameters of an actuator, one struct a block of Fig. 2 of the FREEDOM paper.

use crate::{
    back_emf::BackEmfTable,
    effect::rescaling::Rescaling,
    envelope::Envelope,
    parameter::{Keyed, Parameter, kinetic_within_static, within},
    parameter_error::ParameterError,
    shorted_turns::ShortedTurns,
};

/// Shape of the back-EMF over the electrical angle, with unit peak.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[expect(clippy::large_enum_variant, reason = "an actuator is copied once a run, and stays `Copy`")]
pub enum BackEmfShape {
    /// Trapezoid with a flat top of 120°, straight flanks of 60°: the brushless DC machine.
    Trapezoid,
    /// Sine: the permanent-magnet synchronous machine.
    Sinusoid,
    /// A measured shape; its peak need not be one.
    Tabulated(BackEmfTable),
}

/// Which legs are switched, and where the current is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Commutation {
    /// Two phases conduct in each sector of 60°, the third is open: the brushless DC drive.
    SixStep,
    /// All phases are connected, the current is held in quadrature to the rotor (`i_d = 0`).
    FieldOriented,
}

impl Commutation {
    /// Envelope that stands for the current of such a drive: of a field-oriented one the current in
    /// quadrature, else that of the conducting phase.
    pub fn envelope(self) -> Envelope {
        match self {
            Self::SixStep => Envelope::ConductingPhase,
            Self::FieldOriented => Envelope::QAxis,
        }
    }
}

/// Where the angle is measured that closes the position loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PositionSensor {
    /// At the surface: the play lies inside the loop.
    Surface,
    /// On the motor shaft: the surface follows as the play lets it.
    MotorShaft,
}

/// Electrical machine, star-connected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Pole pairs `P`; the electrical angle is `P·θ_m`.
    pub pole_pairs: u32,
    /// Resistance of one phase, `R_p`.
    pub resistance_ohm: f64,
    /// Inductance of one phase, self less mutual, `L_p`.
    pub inductance_henry: f64,
    /// Peak back-EMF of one phase over speed, `k_p`.
    pub back_emf_v_s_per_rad: f64,
    /// Shape of the back-EMF.
    pub back_emf_shape: BackEmfShape,
    /// Rotor inertia, `J_m`.
    pub inertia_kg_m2: f64,
    /// Viscous drag on the motor shaft, `c_m`.
    pub viscous_n_m_s_per_rad: f64,
    /// Shorted turns of the faults `k3..k5` in the high-fidelity model.
    pub shorted_turns: ShortedTurns,
}

impl Motor {
    /// Torque over envelope current with two phases conducting, `k = 2·k_p`.
    pub fn torque_constant_n_m_per_a(&self) -> f64 {
        2.0 * self.back_emf_v_s_per_rad
    }
}

/// Inverter with unipolar, centre-aligned carrier modulation, and its synchronous current loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inverter {
    /// Supply, `V_dc`; the legs switch between `±V_dc/2`.
    pub bus_voltage_v: f64,
    /// Carrier frequency, a whole multiple of the controller's rate.
    pub carrier_hz: f64,
    /// Bandwidth that the current loop is tuned for (pole of the winding cancelled).
    pub current_bandwidth_hz: f64,
    /// Time for which both switches of a leg are open when it changes sides, `t_d`; at most a
    /// tenth of a carrier period.
    pub dead_time_s: f64,
    /// Which legs are switched.
    pub commutation: Commutation,
}

/// Gear, backlash, friction and end stops between motor and surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// Motor angle over surface angle, `i_g`.
    pub gear_ratio: f64,
    /// Inertia of the surface side, `J_u`.
    pub surface_inertia_kg_m2: f64,
    /// Whole play at the surface, `b`.
    pub backlash_rad: f64,
    /// Kinetic dry friction at the motor shaft, `F_d`.
    pub kinetic_friction_n_m: f64,
    /// Static dry friction at the motor shaft, `F_s`.
    pub static_friction_n_m: f64,
    /// Dry friction of the surface, behind the play: felt while a flank touches, over the gear
    /// ratio and the efficiency. No fault changes it.
    pub surface_friction_n_m: f64,
    /// Share of the torque that the gear passes on, `η`.
    pub efficiency_ratio: f64,
    /// The surface stops at plus and minus this angle.
    pub stop_rad: f64,
}

/// Position and speed cascade.
///
/// ```text
/// ω_ref = sat(K_pos·i_g·(θ_cmd − θ_u), ω_max)
/// I_ref = sat(K_s·e + K_d·e' + ξ, I_max)         ξ' = K_i·e, held while saturated
/// e     = ω_ref − ω_m
/// ```
///
/// With the encoder on the motor shaft `θ_m/i_g` stands in place of `θ_u`; in speed mode
/// `ω_ref` is the command's. `e'` is the difference of two ticks over their distance.
///
/// # Source
///
/// FREEDOM paper, III.A.1, names position and speed loops; form and gains are the project's
/// choice, see `docs/models/controller.md`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    /// Rate of the cascade.
    pub sample_hz: f64,
    /// Position gain, `K_pos`.
    pub position_gain_per_s: f64,
    /// Largest speed that the position loop asks for, `ω_max`.
    pub speed_limit_rad_per_s: f64,
    /// Proportional gain of the speed loop, `K_s`.
    pub speed_gain_a_s_per_rad: f64,
    /// Integral gain of the speed loop, `K_i`.
    pub speed_integral_a_per_rad: f64,
    /// Derivative gain of the speed loop, `K_d`; mostly zero.
    pub speed_derivative_a_s2_per_rad: f64,
    /// Largest current asked for, `I_max`.
    pub current_limit_a: f64,
    /// Where the position loop is closed.
    pub position_sensor: PositionSensor,
}

/// Errors of the control electronics' sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensing {
    /// Step of the position encoder as an angle of the surface; for one on the motor shaft its
    /// step over the gear ratio.
    pub surface_step_rad: f64,
    /// Step of the current set-point.
    pub current_reference_step_a: f64,
    /// White noise on the measured speed, rms.
    pub speed_noise_rad_per_s: f64,
    /// Uniform noise on the current feedback, half width.
    pub current_noise_half_width_a: f64,
}

/// An actuator: every number the simulators need.
///
/// # Examples
///
/// ```
/// let actuator = ema_sim::presets::EMA_48;
/// assert!(actuator.check().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Actuator {
    /// Electrical machine.
    pub motor: Motor,
    /// Power electronics.
    pub inverter: Inverter,
    /// Gear and surface.
    pub transmission: Transmission,
    /// Position and speed loops.
    pub controller: Controller,
    /// Sensors of the control electronics.
    pub sensing: Sensing,
}

impl Actuator {
    /// Inertia at the motor shaft, `J = J_m + J_u/i_g²`.
    pub fn total_inertia_kg_m2(&self) -> f64 {
        let i_g = self.transmission.gear_ratio;
        self.motor.inertia_kg_m2 + self.transmission.surface_inertia_kg_m2 / (i_g * i_g)
    }

    /// Torque over the current that the drive holds: of two phases in series `2·k_p`, of a
    /// field-oriented machine, over the amplitude of the phases, `1.5·k_p` times the fundamental
    /// of its shape.
    pub fn torque_constant_n_m_per_a(&self) -> f64 {
        match self.inverter.commutation {
            Commutation::SixStep => self.motor.torque_constant_n_m_per_a(),
            Commutation::FieldOriented => match &self.motor.back_emf_shape {
                BackEmfShape::Tabulated(table) => {
                    1.5 * self.motor.back_emf_v_s_per_rad * table.fundamental_ratio()
                }
                _ => 1.5 * self.motor.back_emf_v_s_per_rad,
            },
        }
    }

    /// Largest voltage of the equivalent direct-current machine: with it and the current `I`
    /// that the drive holds, `V·I` is the power of the phases. `V_dc` of two phases in series,
    /// `3/2·V_dc/2` of three with the amplitude `V_dc/2`.
    pub(crate) fn equivalent_supply_v(&self) -> f64 {
        let supply_v = self.inverter.bus_voltage_v;
        match self.inverter.commutation {
            Commutation::SixStep => supply_v,
            Commutation::FieldOriented => 0.75 * supply_v,
        }
    }

    /// The actuator with some of its constants scaled by effects.
    pub(crate) fn rescaled(mut self, by: &Rescaling) -> Self {
        self.motor.back_emf_v_s_per_rad *= by.torque_constant_ratio;
        let c = &mut self.controller;
        c.position_gain_per_s *= by.position_gain_ratio;
        c.speed_gain_a_s_per_rad *= by.speed_gain_ratio;
        c.speed_integral_a_per_rad *= by.speed_integral_ratio;
        c.current_limit_a *= by.output_limit_ratio;
        self
    }

    /// Refuses parameters that no machine has.
    ///
    /// # Errors
    ///
    /// [`ParameterError`] naming the first field that is not finite or out of its bounds.
    pub fn check(&self) -> Result<(), ParameterError> {
        for parameter in Parameter::ALL {
            parameter.check(self)?;
        }
        self.motor.shorted_turns.check()?;
        let (m, v, t, c) = (&self.motor, &self.inverter, &self.transmission, &self.controller);
        kinetic_within_static(
            Keyed { key: "transmission.kinetic-friction-n-m", value: t.kinetic_friction_n_m },
            Keyed { key: "transmission.static-friction-n-m", value: t.static_friction_n_m },
        )?;
        // a play as wide as the travel leaves no way to the stop
        within("transmission.backlash-rad", t.backlash_rad, 0.0, t.stop_rad)?;
        within("inverter.dead-time-s", v.dead_time_s, 0.0, 0.1 / v.carrier_hz)?;
        let trapezoid = m.back_emf_shape == BackEmfShape::Trapezoid;
        if v.commutation == Commutation::FieldOriented && trapezoid {
            return Err(ParameterError::TrapezoidFieldOriented);
        }
        let periods = v.carrier_hz / c.sample_hz;
        if (periods - libm::round(periods)).abs() > 1e-9 || periods < 1.0 {
            return Err(ParameterError::CarrierNotMultiple {
                carrier_hz: v.carrier_hz,
                sample_hz: c.sample_hz,
            });
        }
        // A segment between switching instants spans up to half a carrier period; its Taylor
        // series needs the winding to change little in that time.
        let time_constant_s = m.inductance_henry / m.resistance_ohm;
        if time_constant_s * v.carrier_hz < 2.0 {
            return Err(ParameterError::WindingTooFast {
                time_constant_s,
                carrier_hz: v.carrier_hz,
            });
        }
        self.check_pace()
    }

    /// Refuses a machine faster than what its carrier and controller are run with.
    fn check_pace(&self) -> Result<(), ParameterError> {
        let (m, v, tick_s) = (&self.motor, &self.inverter, 1.0 / self.controller.sample_hz);
        let (torque_constant, inertia_kg_m2) =
            (m.torque_constant_n_m_per_a(), self.total_inertia_kg_m2());
        let swing_s = libm::sqrt(2.0 * m.inductance_henry * inertia_kg_m2) / torque_constant;
        let electrical_s = torque_constant / (f64::from(m.pole_pairs) * v.bus_voltage_v);
        let carrier_hz = v.carrier_hz;
        // what is missing to a hundredth of a period; the swing grows with the inertia's root
        let short =
            |time_s: f64| (time_s * carrier_hz < 0.01).then(|| 0.01 / (time_s * carrier_hz));
        if let Some(ratio) = short(swing_s) {
            let (field, value) = ("motor.inertia-kg-m2", m.inertia_kg_m2);
            let least = value + inertia_kg_m2 * (ratio * ratio - 1.0);
            let time_s = swing_s;
            return Err(ParameterError::TooFast { field, value, least, time_s, carrier_hz });
        }
        if let Some(ratio) = short(electrical_s) {
            let (field, value) = ("motor.back-emf-v-s-per-rad", m.back_emf_v_s_per_rad);
            let (least, time_s) = (value * ratio, electrical_s);
            return Err(ParameterError::TooFast { field, value, least, time_s, carrier_hz });
        }
        let braking = torque_constant * torque_constant / (2.0 * m.resistance_ohm);
        let needed_kg_m2 = least_inertia(m.viscous_n_m_s_per_rad + braking, tick_s);
        if inertia_kg_m2 < needed_kg_m2 {
            let (field, value) = ("motor.inertia-kg-m2".to_owned(), m.inertia_kg_m2);
            let least = needed_kg_m2 - (inertia_kg_m2 - m.inertia_kg_m2);
            return Err(ParameterError::TooLight { field, value, least, tick_s });
        }
        Ok(())
    }
}

/// Inertia that a drag slows by no more than half its speed within a tick: the series of a
/// segment, of four orders, then misses `0.5⁵/120` of the speed.
pub(crate) fn least_inertia(drag: f64, tick_s: f64) -> f64 {
    2.0 * drag * tick_s
}
