//! Answers of the tool to all sets of the page.

use anyhow::Result;
use greybox::{Calibrated, Explained, Options};

use super::{
    emps, laas,
    others::{self, Answer},
    setting::JOBS,
};
use crate::terminal::clock;

/// Files of the actuator with seeded faults, one a kind.
const ACTUATOR_FILES: [&str; 4] = ["normal", "lackLubrication1", "backlash1", "spalling1"];

/// Answers of the tool to all sets.
pub(super) struct Answers {
    pub(super) emps: Explained,
    pub(super) emps_took_s: f64,
    /// The LAAS motor with numbers of its own.
    pub(super) calibrated: Calibrated,
    pub(super) laas: Explained,
    pub(super) laas_took_s: f64,
    /// The dominant order of the table that the LAAS drive was given.
    pub(super) order: usize,
    /// The servo under its own controller, a gain of its firmware each.
    pub(super) servo_in_loop: Vec<(String, Answer)>,
    /// The servo by its motion alone.
    pub(super) servo: Answer,
    pub(super) robot: Vec<Answer>,
    pub(super) actuator: Vec<(String, Answer)>,
}

impl Answers {
    pub(super) fn new(emps: &emps::Data, laas: &laas::Data) -> Result<Self> {
        let start = clock();
        let of_emps = emps.explained(0)?;
        let emps_took_s = start.elapsed().as_secs_f64();
        let calibrated = laas.calibrated()?;
        let start = clock();
        let options = Options { jobs: JOBS, ..Options::default() };
        let of_laas = laas.explained(&calibrated.model, &options)?;
        let laas_took_s = start.elapsed().as_secs_f64();
        let in_loop = |gain: &str| Ok((gain.to_owned(), others::servo_in_loop(gain)?.explained()));
        let robot = |axis| Ok(others::robot(axis)?.calibrated_first());
        let actuator = |file: &str| Ok((file.to_owned(), others::actuator(file)?.explained()));
        Ok(Self {
            emps: of_emps,
            emps_took_s,
            calibrated,
            laas: of_laas,
            laas_took_s,
            order: laas::orders_of_table()?[0].0,
            servo_in_loop: others::SERVO_GAINS.into_iter().map(in_loop).collect::<Result<_>>()?,
            servo: others::servo()?.explained(),
            robot: (1..=3).map(robot).collect::<Result<_>>()?,
            actuator: ACTUATOR_FILES.into_iter().map(actuator).collect::<Result<_>>()?,
        })
    }
}
