//! An experiment: which actuator does what, and which signal of it is diagnosed.

use std::f64::consts::TAU;

use ema_sim::{
    Actuator, Command, Effect, Envelope, EnvelopeFilter, FAULT_COUNT, FaultCoordinates, FaultId,
    HighFidelity, Imperfections, LowFidelity, PhysicalFaults, Scenario, SimulationError,
    TemperatureLaw, Tolerance,
    model_file::{ActionLevel, EffectBlock, Model, StatedLevels},
    presets::EMA_48,
};
use fdi_report::ActionLevels;
use inference::central_differences_together;

/// Electrical start angles closer than this to the bundle's count as the bundle's, rad: at the
/// slowest commutation of the chirp that is a tenth of a carrier period. One milliradian at a rotor
/// of four pole pairs.
const ELECTRICAL_TOLERANCE_RAD: f64 = 4e-3;
/// Points whose currents are held at a time: two groups that go side by side.
const AT_ONCE: usize = 32;
/// Points of the paper's mask, section IV.
pub const MASK_POINTS: usize = 30;

/// An actuator in a test, with the envelope that is diagnosed and the faults looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Name, also that of the command in metadata.
    pub name: String,
    /// Name of the actuator's model.
    pub model_name: String,
    /// The machine.
    pub actuator: Actuator,
    /// Effects besides the base model, in both fidelities.
    pub effects: Vec<Effect>,
    /// The test, with ideal electronics, at the start angle that reference signals are made for.
    pub scenario: Scenario,
    /// Definition of the envelope.
    pub envelope: Envelope,
    /// Filter and rate of the envelope.
    pub filter: EnvelopeFilter,
    /// Which coordinates of [`FaultCoordinates`] are looked for; the others are zero.
    pub sought: [bool; FAULT_COUNT],
    /// Rate at which the low-fidelity model's current is sampled before it is filtered; `None`:
    /// that of the controller.
    pub phase_rate_hz: Option<f64>,
    /// Tolerances of numbers of the machine, of the test and of the sensors; none for a machine
    /// that is exactly its model file.
    pub tolerance: Vec<Tolerance>,
    /// How numbers of the machine follow the temperature of its winding, where that is known.
    pub temperature: Option<TemperatureLaw>,
    /// Levels for decisions that the model file states.
    pub stated_levels: StatedLevels,
}

/// Why a model and a test make no experiment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// The model lists no fault that the test shows.
    #[error(
        "`faults` of the model lists none that the test `{test}` shows, expected at least one of {}",
        .shown.iter().map(|fault| fault.symbol()).collect::<Vec<_>>().join(", ")
    )]
    NoFaults {
        /// Name of the test.
        test: String,
        /// Faults that it shows.
        shown: Vec<FaultId>,
    },
    /// One half of the eccentricity is listed without the other.
    #[error(
        "`faults` of the model lists {} without {}: size and direction of the eccentricity are \
         decided together", found.symbol(), missing.symbol()
    )]
    HalfEccentricity {
        /// Listed.
        found: FaultId,
        /// Not listed.
        missing: FaultId,
    },
    /// Fewer samples than the mask has points.
    #[error("the command lasts {found_s} s, expected at least {needed_s} s")]
    TooShort {
        /// Length of the command.
        found_s: f64,
        /// Length that gives a sample for each point of the mask.
        needed_s: f64,
    },
    /// The actuator cannot follow the test.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

impl ExperimentError {
    /// Tells whether the command rather than the model is why the test cannot be run.
    pub fn is_of_the_command(&self) -> bool {
        matches!(
            self,
            Self::TooShort { .. }
                | Self::Simulation(
                    SimulationError::CommandBeyondStops { .. } | SimulationError::Scenario { .. }
                )
        )
    }
}

/// Name of a test whose command was recorded.
pub const RECORDED: &str = "recorded";

/// Command of the planned test, as `fdi propose` writes it, with its rate and load.
const PLANNED_CSV: &str = include_str!("../../commands/planned.csv");
const PLANNED_RATE_HZ: f64 = 1000.0;
const PLANNED_LOAD_N_M: f64 = 0.5;

/// The second column of a table with a line of names.
fn command_of(table: &str) -> Vec<f64> {
    let rows = table.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.filter_map(|row| row.split(',').nth(1)?.parse().ok()).collect()
}

impl Experiment {
    /// The chirp of the paper's numerical experiments, all seven faults.
    pub fn chirp() -> Self {
        Self {
            name: "chirp".into(),
            model_name: "ema-48".into(),
            actuator: EMA_48,
            effects: Vec::new(),
            scenario: Scenario::chirp(),
            envelope: Envelope::ConductingPhase,
            filter: EnvelopeFilter::DEFAULT,
            sought: [true; FAULT_COUNT],
            phase_rate_hz: None,
            tolerance: Vec::new(),
            temperature: None,
            stated_levels: [None; 6],
        }
    }

    /// The sine of the paper's bench, friction and backlash alone.
    pub fn sine() -> Self {
        Self {
            name: "sine".into(),
            scenario: Scenario::sine(),
            sought: [true, true, false, false, false, false, false],
            ..Self::chirp()
        }
    }

    /// The test of 2.85 s that `fdi propose --faults k1,k2,k3,k4,k5,k6 --within 3s --load-n-m 0.5`
    /// plans for EMA-48, all seven faults.
    pub fn planned() -> Self {
        let command_rad = command_of(PLANNED_CSV);
        let mut test = Self::recorded(command_rad, PLANNED_RATE_HZ);
        test.name = "planned".into();
        test.scenario.load_n_m = PLANNED_LOAD_N_M;
        test
    }

    /// The test of that name: `chirp`, `sine` or `planned`.
    ///
    /// ```
    /// use fdi_core::Experiment;
    ///
    /// assert_eq!(Experiment::named("sine"), Some(Experiment::sine()));
    /// assert_eq!(Experiment::named("ramp"), None);
    /// ```
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "chirp" => Some(Self::chirp()),
            "sine" => Some(Self::sine()),
            "planned" => Some(Self::planned()),
            _ => None,
        }
    }

    /// A test with a command that was recorded, all seven faults, no load; of EMA-48 until
    /// [`of_model`](Self::of_model) names another machine.
    pub fn recorded(command_rad: Vec<f64>, rate_hz: f64) -> Self {
        let duration_s = command_rad.len() as f64 / rate_hz;
        let command = Command::Recorded { values_rad: command_rad, rate_hz };
        let scenario = Scenario { command, load_n_m: 0.0, duration_s, ..Scenario::chirp() };
        Self { name: RECORDED.into(), scenario, ..Self::chirp() }
    }

    /// Takes this test to another machine.
    ///
    /// Rates follow from the machine: the envelope is kept at the whole share of its controller's
    /// rate that is nearest to that of [`EnvelopeFilter::DEFAULT`], and the test lasts a whole
    /// number of its samples; a field-oriented drive is seen by its current in quadrature. Looked
    /// for are the faults that test and machine have in common.
    ///
    /// # Errors
    ///
    /// [`ExperimentError`] when nothing is left to look for, or the machine cannot follow.
    pub fn of_model(self, name: &str, model: &Model) -> Result<Self, ExperimentError> {
        let sought = self.sought_of(&model.faults)?;
        let filter = filter_for(model.actuator.controller.sample_hz);
        let mut scenario = self.scenario;
        let samples = (scenario.duration_s * filter.output_hz + 1e-6).floor();
        let needed_s = MASK_POINTS as f64 / filter.output_hz;
        if samples < MASK_POINTS as f64 {
            return Err(ExperimentError::TooShort { found_s: scenario.duration_s, needed_s });
        }
        scenario.duration_s = samples / filter.output_hz;
        let (model_name, actuator) = (name.to_owned(), model.actuator);
        let (effects, tolerance) = (model.switched_on(), model.tolerance.clone());
        let envelope = match actuator.inverter.commutation {
            ema_sim::Commutation::FieldOriented => Envelope::QAxis,
            _ => self.envelope,
        };
        let experiment = Self {
            model_name,
            actuator,
            effects,
            scenario,
            envelope,
            filter,
            sought,
            tolerance,
            temperature: model.temperature,
            stated_levels: model.action_levels,
            ..self
        };
        experiment.monitor(experiment.scenario.start_angle_rad)?;
        Ok(experiment)
    }

    /// The faults of a model that this test shows.
    fn sought_of(&self, faults: &[FaultId]) -> Result<[bool; FAULT_COUNT], ExperimentError> {
        let mut sought = self.sought;
        for fault in FaultId::ALL {
            sought[fault.index()] &= faults.contains(&fault);
        }
        let [size, direction] = [FaultId::Eccentricity, FaultId::EccentricityPhase];
        for (found, missing) in [(size, direction), (direction, size)] {
            if sought[found.index()] && !sought[missing.index()] {
                return Err(ExperimentError::HalfEccentricity { found, missing });
            }
        }
        if sought.contains(&true) {
            return Ok(sought);
        }
        let shown = FaultId::ALL.into_iter().filter(|id| self.sought[id.index()]).collect();
        Err(ExperimentError::NoFaults { test: self.name.clone(), shown })
    }

    /// Samples of the diagnosed signal.
    pub fn samples(&self) -> usize {
        (self.scenario.duration_s * self.filter.output_hz).round() as usize
    }

    /// The model of the machine, as a file gives it.
    pub fn model(&self) -> Model {
        let plain = |effect: &Effect| EffectBlock {
            effect: effect.clone(),
            name: None,
            interval_95: Vec::new(),
            annotations: Vec::new(),
        };
        Model {
            name: Some(self.model_name.clone()),
            actuator: self.actuator,
            faults: FaultId::ALL.into_iter().filter(|fault| self.sought[fault.index()]).collect(),
            tolerance: self.tolerance.clone(),
            temperature: self.temperature,
            action_levels: self.stated_levels,
            effects: self.effects.iter().map(plain).collect(),
        }
    }

    /// Levels that decisions are made by: those that the model file states, of any other fault the
    /// default; and the play that they are of.
    pub fn action_levels(&self) -> ActionLevels {
        let play_rad = self.actuator.transmission.backlash_rad;
        let nominal_backlash_rad = (play_rad > 0.0).then_some(play_rad);
        let mut levels = ActionLevels { nominal_backlash_rad, ..ActionLevels::default() };
        for (place, stated) in self.stated_levels.iter().enumerate() {
            if let Some(ActionLevel { watch, act }) = *stated {
                (levels.watch[place], levels.act[place]) = (watch, act);
            }
        }
        levels
    }

    /// Mechanical angle within which two start angles count as one, rad.
    pub(crate) fn start_tolerance_rad(&self) -> f64 {
        ELECTRICAL_TOLERANCE_RAD / f64::from(self.actuator.motor.pole_pairs)
    }

    /// True where two start angles of the rotor, mechanical, rad, count as one: within 4 mrad electrical.
    pub fn is_same_start(&self, a_rad: f64, b_rad: f64) -> bool {
        let turn = (a_rad - b_rad).rem_euclid(TAU);
        turn.min(TAU - turn) < self.start_tolerance_rad()
    }

    /// Indices of the coordinates looked for.
    pub fn sought_indices(&self) -> Vec<usize> {
        (0..FAULT_COUNT).filter(|&i| self.sought[i]).collect()
    }

    /// All coordinates at a point of those looked for, the others zero.
    pub(crate) fn all_coordinates(&self, point: &[f64]) -> FaultCoordinates {
        let mut all = FaultCoordinates([0.0; FAULT_COUNT]);
        for (index, &value) in self.sought_indices().into_iter().zip(point) {
            all.0[index] = value;
        }
        all
    }

    /// The high-fidelity model at a start angle.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for parameters or a test that cannot be simulated.
    pub fn high_fidelity(
        &self,
        start_angle_rad: f64,
        imperfections: Imperfections,
    ) -> Result<HighFidelity, SimulationError> {
        let scenario = Scenario { imperfections, ..self.scenario.clone() };
        let scenario = scenario.turned_to(start_angle_rad);
        HighFidelity::new(&self.actuator, &scenario)?.with_effects(&self.effects)
    }

    /// The low-fidelity model in another scenario than the experiment's own.
    pub(crate) fn low_fidelity(&self, scenario: &Scenario) -> Result<LowFidelity, SimulationError> {
        LowFidelity::new(&self.actuator, scenario)?.with_effects(&self.effects)
    }

    /// The diagnosed signal of the high-fidelity model, noise of the sensors apart.
    pub fn high_fidelity_signal(&self, model: &HighFidelity, faults: &PhysicalFaults) -> Vec<f64> {
        let trace = model.simulate(faults);
        let envelope = trace.envelope_a(self.envelope, self.actuator.motor.pole_pairs);
        self.filter.apply(&envelope, trace.rate_hz)
    }

    /// The low-fidelity model at a start angle.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for parameters or a test that cannot be simulated.
    pub fn monitor(&self, start_angle_rad: f64) -> Result<Monitor, SimulationError> {
        self.noisy_monitor(start_angle_rad, Imperfections::NONE, 0)
    }

    /// The low-fidelity model with imperfect electronics in its loops, their noise by a seed.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for parameters or a test that cannot be simulated.
    pub fn noisy_monitor(
        &self,
        start_angle_rad: f64,
        imperfections: Imperfections,
        seed: u64,
    ) -> Result<Monitor, SimulationError> {
        let scenario = self.scenario.clone().turned_to(start_angle_rad);
        let scenario = Scenario { imperfections, seed, ..scenario };
        let monitor = Monitor {
            model: self.low_fidelity(&scenario)?,
            filter: self.filter,
            rate_hz: self.actuator.controller.sample_hz,
            keep_every: 1,
            current_a: Vec::new(),
        };
        Ok(match self.phase_rate_hz {
            Some(rate_hz) => monitor.sampled_at(rate_hz),
            None => monitor,
        })
    }
}

/// The default filter, at the whole share of a controller's rate that is nearest to its own.
fn filter_for(sample_hz: f64) -> EnvelopeFilter {
    let keep_every = (sample_hz / EnvelopeFilter::DEFAULT.output_hz).round().max(1.0);
    EnvelopeFilter { output_hz: sample_hz / keep_every, ..EnvelopeFilter::DEFAULT }
}

/// The low-fidelity model as a function from damage to the diagnosed signal.
#[derive(Clone, Debug)]
pub struct Monitor {
    model: LowFidelity,
    filter: EnvelopeFilter,
    rate_hz: f64,
    /// The current is sampled at `rate_hz / keep_every`, then filtered.
    keep_every: usize,
    current_a: Vec<f64>,
}

impl Monitor {
    /// Turns the rotor at the start.
    pub fn turn_to(&mut self, start_angle_rad: f64) {
        self.model.turn_to(start_angle_rad);
    }

    /// Samples the current as the sensors of the phases do, where their rate is a whole part of
    /// the controller's; what is filtered afterwards then has the same aliases as a recording.
    #[must_use]
    pub fn sampled_at(mut self, phase_rate_hz: f64) -> Self {
        let ratio = self.rate_hz / phase_rate_hz;
        let whole = ratio >= 1.0 && (ratio - ratio.round()).abs() < 1e-6;
        self.keep_every = if whole { ratio.round() as usize } else { 1 };
        self
    }

    /// Slopes of the signal in some coordinates, one row each: central differences.
    pub fn jacobian(
        &self,
        coordinates: &FaultCoordinates,
        indices: &[usize],
        step: f64,
    ) -> Vec<Vec<f64>> {
        let point: Vec<f64> = indices.iter().map(|&index| coordinates.0[index]).collect();
        central_differences_together(&point, step, |points| {
            let moved = points.iter().map(|values| {
                let mut moved = *coordinates;
                for (&index, &value) in indices.iter().zip(values) {
                    moved.0[index] = value;
                }
                moved
            });
            self.signals(&moved.collect::<Vec<_>>())
        })
    }

    /// The signal at a point of the damage space.
    pub fn signal(&mut self, coordinates: &FaultCoordinates) -> Vec<f64> {
        self.model.simulate_current(&PhysicalFaults::from(coordinates), &mut self.current_a);
        self.filtered(&self.current_a)
    }

    /// The signals at several points, side by side: the same bits, sooner.
    pub fn signals(&self, points: &[FaultCoordinates]) -> Vec<Vec<f64>> {
        let faults: Vec<PhysicalFaults> = points.iter().map(PhysicalFaults::from).collect();
        let (mut currents_a, mut signals) = (Vec::new(), Vec::with_capacity(points.len()));
        // currents before the filter are several times as long as the signals
        for faults in faults.chunks(AT_ONCE) {
            self.model.simulate_currents(faults, &mut currents_a);
            signals.extend(currents_a.iter().map(|current_a| self.filtered(current_a)));
        }
        signals
    }

    /// Signal that the sensors and the filter make of the current.
    fn filtered(&self, current_a: &[f64]) -> Vec<f64> {
        if self.keep_every == 1 {
            return self.filter.apply(current_a, self.rate_hz);
        }
        let kept: Vec<f64> = current_a.iter().step_by(self.keep_every).copied().collect();
        self.filter.apply(&kept, self.rate_hz / self.keep_every as f64)
    }
}

#[cfg(test)]
mod tests {
    use recordings::{ColumnMap, Recording};

    use super::*;

    fn model(change: impl FnOnce(&mut Model)) -> Model {
        let mut model = Model::from(EMA_48);
        change(&mut model);
        model
    }

    #[test]
    fn the_planned_test_is_its_file() {
        let columns = ColumnMap::default();
        let file = Recording::parse("planned.csv", PLANNED_CSV.as_bytes(), &columns).unwrap();
        let expected = Experiment::of_recording(&file).unwrap();
        let planned = Experiment::planned();
        assert_eq!(planned.scenario, expected.scenario);
        assert_eq!((planned.name.as_str(), planned.samples()), ("planned", 5700));
    }

    #[test]
    fn the_default_machine_gives_the_presets_bit_for_bit() {
        for preset in [Experiment::chirp(), Experiment::sine(), Experiment::planned()] {
            assert_eq!(preset.clone().of_model("ema-48", &model(|_| ())).unwrap(), preset);
        }
    }

    #[test]
    fn rates_follow_the_machine() {
        for (sample_hz, output_hz) in
            [(8e3, 2e3), (10e3, 2e3), (15e3, 1875.0), (7e3, 1750.0), (1e3, 1e3)]
        {
            let machine = model(|model| {
                model.actuator.controller.sample_hz = sample_hz;
                model.actuator.inverter.carrier_hz = 2.0 * (10e3 / sample_hz).ceil() * sample_hz;
            });
            // a length that is no whole number of samples of any of them
            let test = Experiment::recorded(vec![0.0; 4987], 10e3).of_model("m", &machine).unwrap();
            assert_eq!(test.filter.output_hz, output_hz);
            let model = test.high_fidelity(0.0, Imperfections::NONE).unwrap();
            let healthy = FaultCoordinates([0.0; FAULT_COUNT]);
            let signal = test.high_fidelity_signal(&model, &(&healthy).into());
            assert_eq!(signal.len(), test.samples(), "{sample_hz}");
            assert_eq!(test.monitor(0.0).unwrap().signal(&healthy).len(), test.samples());
        }
    }

    #[test]
    fn only_faults_of_both_are_looked_for() {
        use FaultId::{Backlash, Eccentricity, Friction, ShortA};
        let faults = |faults: &[FaultId]| model(|model| model.faults = faults.to_vec());
        let sought = |experiment: Experiment, list: &[FaultId]| {
            experiment.of_model("m", &faults(list)).map(|experiment| experiment.sought_indices())
        };
        assert_eq!(sought(Experiment::chirp(), &[ShortA, Friction]).unwrap(), [0, 2]);
        assert_eq!(sought(Experiment::sine(), &[ShortA, Backlash]).unwrap(), [1]);
        assert_eq!(
            sought(Experiment::sine(), &[ShortA]).unwrap_err().to_string(),
            "`faults` of the model lists none that the test `sine` shows, expected at least one \
             of k1, k2"
        );
        assert_eq!(
            sought(Experiment::chirp(), &[Eccentricity]).unwrap_err().to_string(),
            "`faults` of the model lists k6 without k7: size and direction of the eccentricity \
             are decided together"
        );
    }

    #[test]
    fn a_command_shorter_than_the_mask_is_refused() {
        let short = Experiment::recorded(vec![0.0; 10], 1000.0).of_model("m", &model(|_| ()));
        assert_eq!(
            short.unwrap_err().to_string(),
            "the command lasts 0.01 s, expected at least 0.015 s"
        );
    }
}
