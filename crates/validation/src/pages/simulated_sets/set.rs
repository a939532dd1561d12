//! A simulated set: two recordings to fit, and one held out.

use anyhow::Result;
use ema_sim::{
    Converter, Effect, FaultCoordinates, Imperfections, ModelFidelity, PhaseSensors,
    model_file::{MachineModel, Model, parse_machine},
};
use fdi_core::{Experiment, Purpose, RecordedContent, RootSeed, SimulatedRecording, read_model};
use greybox::{Record, Recordings};

use super::course::{Course, RATE_HZ};
use crate::pages::{chance::Chance, compared::compared};

/// White noise on each sample of a phase, A.
const NOISE_A: f64 = 0.02;
/// Bits of the converter.
const BITS: u32 = 12;
/// Recordings that are fitted.
const FITTED: usize = 2;
/// All recordings of a set.
const RECORDINGS: usize = 3;

/// Levels of a machine without damage.
pub(super) const HEALTHY: FaultCoordinates = FaultCoordinates([0.0; 7]);

/// Machines by their names.
pub(super) const MACHINES: [&str; 3] = ["EMA-48", "bench", "ema-270"];

/// The machine of a name.
pub(super) fn machine(name: &str) -> Result<Model> {
    if name != "ema-270" {
        return Ok(read_model(&name.to_lowercase())?);
    }
    let text = include_str!("../../../../../fixtures/models/ema-270.toml");
    match parse_machine(text)? {
        MachineModel::Actuator(model) => Ok(model),
        MachineModel::ServoAxis(_) => anyhow::bail!("`ema-270.toml` is an actuator"),
    }
}

/// Choice of a set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice<'a> {
    /// Model file that recordings are compared with.
    pub(super) model: &'a Model,
    /// Machine that they are of, without an effect.
    pub(super) machine: &'a Model,
    pub(super) fidelity: ModelFidelity,
    pub(super) course: Course,
    /// Everything random in it.
    pub(super) seed: RootSeed,
}

impl Choice<'_> {
    /// Tests of the set, without an effect.
    pub(super) fn tests(&self) -> Result<Vec<Experiment>> {
        self.tests_of(self.machine)
    }

    /// Tests of the set with another machine.
    pub(super) fn tests_of(&self, machine: &Model) -> Result<Vec<Experiment>> {
        let name = self.model.name.clone().unwrap_or_else(|| "machine".to_owned());
        let mut chance = Chance::new(self.seed.derive(Purpose::Design, 0));
        let test = |_| {
            let test = Experiment::recorded(self.course.draw(&mut chance), RATE_HZ);
            Ok(test.of_model(&name, machine)?)
        };
        (0..RECORDINGS).map(test).collect()
    }

    /// Recordings of the set, of a machine that has some damage, and effects beside its model.
    pub(super) fn recordings(
        &self,
        effects: &[Effect],
        faults: FaultCoordinates,
    ) -> Result<Recordings> {
        let tests = self.tests()?.into_iter().enumerate();
        let mut train = tests
            .map(|(place, mut test)| {
                test.effects.extend_from_slice(effects);
                self.record(&test, faults, Imperfections::REAL, place as u64, self.seed)
            })
            .collect::<Result<Vec<_>>>()?;
        let holdout = train.split_off(FITTED);
        Ok(Recordings { train, holdout, repeat: Vec::new() })
    }

    /// A test of the set with some damage, as it was recorded with a seed.
    pub(super) fn record(
        &self,
        test: &Experiment,
        faults: FaultCoordinates,
        imperfections: Imperfections,
        place: u64,
        seed: RootSeed,
    ) -> Result<Record> {
        let converter = Converter::of_drive(BITS, None, &test.actuator.controller);
        let request = SimulatedRecording {
            faults,
            start_angle_rad: 0.0,
            imperfections,
            controller_seed: seed.derive(Purpose::ControllerNoise, place),
            sensors: PhaseSensors { noise_a: NOISE_A, converter: Some(converter) },
            phase_rate_hz: None,
            sensor_seed: seed.derive(Purpose::SensorNoise, place),
            content: RecordedContent::Phases,
            has_voltage: false,
        };
        let name = format!("recording {}", place + 1);
        let recording = match self.fidelity {
            ModelFidelity::High => request.record(test, &name)?,
            ModelFidelity::Low => request.record_low_fidelity(test, &name)?,
        };
        compared(&recording, &MachineModel::Actuator(self.model.clone()))
    }
}
