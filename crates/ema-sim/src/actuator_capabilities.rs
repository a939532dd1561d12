//! Facts of an actuator's models by which effects are taken or refused.

use crate::{
    effect::{
        Geometry,
        capabilities::{AdmissibleSize, Commutated, ModelCapabilities, SizingData, WindingModel},
    },
    params::{Actuator, Commutation, PositionSensor},
    scenario::Scenario,
};

impl ModelCapabilities {
    /// The facts of a model of an actuator in a test.
    pub(crate) fn of_actuator(
        name: &'static str,
        actuator: &Actuator,
        scenario: &Scenario,
        winding: WindingModel,
    ) -> Self {
        let (c, t) = (&actuator.controller, &actuator.transmission);
        let sizing = SizingData {
            peak_torque: actuator.torque_constant_n_m_per_a() * c.current_limit_a,
            inertia: actuator.total_inertia_kg_m2(),
            gear_ratio: t.gear_ratio,
            tick_s: 1.0 / c.sample_hz,
            stop_rad: Some(t.stop_rad),
            supply_v: actuator.equivalent_supply_v(),
            output: c.current_limit_a,
        };
        Self {
            name,
            geometry: Geometry::Rotary,
            commutated: match actuator.inverter.commutation {
                Commutation::SixStep => Commutated::BySectors,
                Commutation::FieldOriented => Commutated::Smoothly,
            },
            winding,
            encoder_on_motor: c.position_sensor == PositionSensor::MotorShaft,
            surface_rubs: t.surface_friction_n_m > 0.0,
            undivided_inertia: None,
            gains: [c.position_gain_per_s, c.speed_gain_a_s_per_rad, c.speed_integral_a_per_rad],
            dry_friction: t.static_friction_n_m > 0.0 || scenario.brake_n_m > 0.0,
            rubbing_effect: false,
            current_recorded: true,
            admissible: AdmissibleSize::new(&sizing),
        }
    }
}
