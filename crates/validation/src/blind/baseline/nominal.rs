//! Numbers of the nominal model file, as far as a torque balance needs them.

use std::{fs, path::Path};

use anyhow::{Context, Result};
use ema_sim::model_file::{MachineModel, parse_machine};

/// Numbers of the nominal machine, at the motor's shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Nominal {
    pub(super) constant_n_m_per_a: f64,
    pub(super) inertia_kg_m2: f64,
    pub(super) viscous_n_m_s_per_rad: f64,
    pub(super) kinetic_n_m: f64,
    /// Whole play without its fault, at the motor.
    pub(super) play_rad: f64,
    pub(super) gear: f64,
    pub(super) efficiency: f64,
    /// Rate of the controller, which holds its current in between.
    pub(super) tick_hz: f64,
    /// Pole pairs of a six-step motor, whose turns and air gap can be at fault.
    pub(super) pole_pairs: Option<f64>,
}

impl Nominal {
    /// Reads the model file.
    pub(super) fn read(file: &Path) -> Result<Self> {
        let text = fs::read_to_string(file).context("the nominal model")?;
        Ok(match parse_machine(&text).context("the nominal model")? {
            MachineModel::Actuator(model) => {
                let a = &model.actuator;
                let t = &a.transmission;
                Self {
                    constant_n_m_per_a: a.torque_constant_n_m_per_a(),
                    inertia_kg_m2: a.total_inertia_kg_m2(),
                    viscous_n_m_s_per_rad: a.motor.viscous_n_m_s_per_rad,
                    kinetic_n_m: t.kinetic_friction_n_m,
                    play_rad: t.backlash_rad * t.gear_ratio,
                    gear: t.gear_ratio,
                    efficiency: t.efficiency_ratio,
                    tick_hz: a.controller.sample_hz,
                    pole_pairs: Some(f64::from(a.motor.pole_pairs)),
                }
            }
            MachineModel::ServoAxis(model) => {
                let a = &model.axis;
                Self {
                    constant_n_m_per_a: a.force_constant,
                    inertia_kg_m2: a.inertia,
                    viscous_n_m_s_per_rad: a.viscous,
                    kinetic_n_m: a.kinetic_friction,
                    play_rad: a.backlash,
                    gear: 1.0,
                    efficiency: 1.0,
                    tick_hz: a.controller.sample_hz,
                    pole_pairs: None,
                }
            }
        })
    }
}
