//! Short circuits in which a current circulates, beside those of the paper whose turns are gone.

use fdi_core::{
    Bundle, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Experiment, Purpose, RecordedContent,
    RootSeed, SimulatedRecording, ToleranceUse,
    ema_sim::{
        Converter, FaultId, FaultLevel, HealthState, HighFidelityTrace, Imperfections,
        PhaseSensors, PhysicalFaults, ShortedTurns,
    },
    in_parallel,
    report::{RecordDiagnosis, Verdict},
};

use crate::request::EvaluationError;

/// Noise of each phase sample, rms.
const NOISE_A: f64 = 0.020;

/// Recordings of short circuits to look at: those of phase A in the embedded chirp.
#[derive(Clone, Copy, Debug)]
pub struct ShortsRequest<'a> {
    /// Shares of the turns that are shorted.
    pub shares: &'a [f64],
    /// Resistance of the fault over that of the shorted turns, `R_f/(s·R)`.
    pub fault_over_turns: &'a [f64],
    /// Share of leakage in a phase's inductance.
    pub leakage_ratio: f64,
    /// Recordings of each short circuit that are diagnosed, each with noise of its own.
    pub recordings: usize,
    /// Root seed.
    pub seed: u64,
    /// Threads.
    pub jobs: usize,
}

/// A short circuit, what it changes, and what the diagnosis makes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct ShortResult {
    /// Share of the turns of phase A that are shorted.
    pub share: f64,
    /// Resistance of the fault, Ω; `None` where the turns are gone, as in the paper.
    pub fault_ohm: Option<f64>,
    /// Change of the filtered envelope against that of removed turns.
    pub current: Agreement,
    /// Change of the motor's angle against that of removed turns.
    pub motion: Agreement,
    /// Answers for a machine exactly as its model file, and for one within its tolerances.
    pub answers: [ShortAnswers; 2],
}

/// A change of a signal against another one, both from the healthy machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Size of the change over that of the other.
    pub size: f64,
    /// Cosine of the angle between both.
    pub cosine: f64,
    /// Size of their difference over that of the other.
    pub difference: f64,
}

/// Answers to several recordings of one short circuit.
#[derive(Clone, Debug, PartialEq)]
pub struct ShortAnswers {
    /// Recordings.
    pub recordings: usize,
    /// Mean level of `k1..k6`; `None` where it is not determined in each.
    pub levels: [Option<f64>; 6],
    /// Answers in which the level is detected.
    pub detected: [usize; 6],
    /// Answers by verdict: healthy, faulty, model inadequate, undetermined.
    pub verdicts: [usize; 4],
    /// Mean of the residual over noise and learnt error.
    pub fit: f64,
}

/// Simulates and diagnoses short circuits with circulating current, and for each share the one
/// with its turns removed, which comes first.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated or a recording not diagnosed.
pub fn evaluate_shorts(request: &ShortsRequest<'_>) -> Result<Vec<ShortResult>, EvaluationError> {
    let diagnoser = Diagnoser::new(Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?)?;
    let mut results = Vec::new();
    for &share in request.shares {
        let turns_ohm = share * diagnoser.bundle().experiment.actuator.motor.resistance_ohm;
        let removed = Short { share, fault_ohm: None, leakage_ratio: request.leakage_ratio };
        let closed = request.fault_over_turns.iter().map(|ratio| {
            let fault_ohm = Some(ratio * turns_ohm);
            Short { fault_ohm, ..removed }
        });
        for short in core::iter::once(removed).chain(closed) {
            results.push(short.evaluate(&diagnoser, request)?);
        }
    }
    Ok(results)
}

/// Changes of current and motion alone.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn compare_short(
    share: f64,
    fault_ohm: f64,
    leakage_ratio: f64,
) -> Result<[Agreement; 2], EvaluationError> {
    let short = Short { share, fault_ohm: Some(fault_ohm), leakage_ratio };
    short.compare(&Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?.experiment)
}

/// A short circuit of phase A.
#[derive(Clone, Copy)]
struct Short {
    share: f64,
    fault_ohm: Option<f64>,
    leakage_ratio: f64,
}

impl Short {
    /// The experiment on a machine whose shorted turns are as here.
    fn on(&self, experiment: &Experiment) -> Experiment {
        let mut experiment = experiment.clone();
        if let Some(fault_ohm) = self.fault_ohm {
            experiment.actuator.motor.shorted_turns =
                ShortedTurns::closed_over(fault_ohm).with_leakage_ratio(self.leakage_ratio);
        }
        experiment
    }

    fn health(&self) -> HealthState {
        let level = FaultLevel::new(self.share).unwrap_or(FaultLevel::NONE);
        HealthState::HEALTHY.with(FaultId::ShortA, level)
    }

    /// Filtered envelope and motor angle of a machine without noise and steps.
    fn signals(&self, experiment: &Experiment) -> Result<[Vec<f64>; 2], EvaluationError> {
        let model = self.on(experiment).high_fidelity(0.0, Imperfections::NONE)?;
        Ok(signals_of(experiment, &model.try_simulate(&PhysicalFaults::from(&self.health()))?))
    }

    /// Changes of current and motion.
    fn compare(&self, experiment: &Experiment) -> Result<[Agreement; 2], EvaluationError> {
        let healthy = Self { share: 0.0, fault_ohm: None, ..*self }.signals(experiment)?;
        let removed = Self { fault_ohm: None, ..*self }.signals(experiment)?;
        let own = self.signals(experiment)?;
        let of = |n: usize| Agreement::of(&own[n], &removed[n], &healthy[n]);
        Ok([of(0), of(1)])
    }

    fn evaluate(
        &self,
        diagnoser: &Diagnoser,
        request: &ShortsRequest<'_>,
    ) -> Result<ShortResult, EvaluationError> {
        let experiment = &diagnoser.bundle().experiment;
        let [current, motion] = self.compare(experiment)?;
        let machine = self.on(experiment);
        let indices: Vec<u64> = (0..request.recordings as u64).collect();
        let answers = in_parallel(&indices, request.jobs, |_, &index| {
            self.diagnosed(diagnoser, &machine, RootSeed(request.seed), index)
        })?;
        let of = |n: usize| ShortAnswers::of(answers.iter().map(|both| &both[n]));
        let answers = [of(0), of(1)];
        Ok(ShortResult { share: self.share, fault_ohm: self.fault_ohm, current, motion, answers })
    }

    /// A recording of the machine, diagnosed as exactly its model file and within its tolerances.
    fn diagnosed(
        &self,
        diagnoser: &Diagnoser,
        machine: &Experiment,
        seed: RootSeed,
        index: u64,
    ) -> Result<[RecordDiagnosis; 2], EvaluationError> {
        let recording = SimulatedRecording {
            faults: self.health().coordinates(),
            start_angle_rad: 0.0,
            imperfections: Imperfections::REAL,
            controller_seed: seed.derive(Purpose::ControllerNoise, index),
            sensors: PhaseSensors { noise_a: NOISE_A, converter: Some(Converter::DEFAULT) },
            phase_rate_hz: None,
            sensor_seed: seed.derive(Purpose::SensorNoise, index),
            content: RecordedContent::Phases,
            has_voltage: false,
        };
        let recording = recording.record(machine, "short")?;
        let answer = |tolerance| {
            let options = DiagnoseOptions { tolerance, ..DiagnoseOptions::default() };
            diagnoser.diagnose(&recording, &options)
        };
        Ok([answer(ToleranceUse::None)?, answer(ToleranceUse::Model)?])
    }
}

fn signals_of(experiment: &Experiment, trace: &HighFidelityTrace) -> [Vec<f64>; 2] {
    let envelope = trace.envelope_a(experiment.envelope, experiment.actuator.motor.pole_pairs);
    [experiment.filter.apply(&envelope, trace.rate_hz), trace.motor_angle_rad.clone()]
}

impl Agreement {
    /// The change of one signal against that of another, from a third.
    fn of(one: &[f64], other: &[f64], from: &[f64]) -> Self {
        let (mut own, mut others, mut both) = (0.0, 0.0, 0.0);
        for ((one, other), from) in one.iter().zip(other).zip(from) {
            let (a, b) = (one - from, other - from);
            (own, others, both) = (own + a * a, others + b * b, both + a * b);
        }
        Self {
            size: (own / others).sqrt(),
            cosine: both / (own * others).sqrt(),
            difference: ((own - 2.0 * both + others).max(0.0) / others).sqrt(),
        }
    }
}

impl ShortAnswers {
    fn of<'a>(answers: impl Iterator<Item = &'a RecordDiagnosis>) -> Self {
        let answers: Vec<_> = answers.collect();
        let count = answers.len();
        let mean = |of: &dyn Fn(&RecordDiagnosis) -> Option<f64>| {
            let all: Option<Vec<f64>> = answers.iter().map(|answer| of(answer)).collect();
            all.map(|all| all.iter().sum::<f64>() / count as f64)
        };
        let told = |verdict| answers.iter().filter(|answer| answer.verdict == verdict).count();
        Self {
            recordings: count,
            levels: core::array::from_fn(|n| mean(&|answer| answer.faults[n].value)),
            detected: core::array::from_fn(|n| {
                answers.iter().filter(|answer| answer.faults[n].detected == Some(true)).count()
            }),
            verdicts: [
                told(Verdict::Healthy),
                told(Verdict::Faulty),
                told(Verdict::ModelInadequate),
                told(Verdict::Undetermined),
            ],
            fit: mean(&|answer| Some(answer.fit.rms_a / answer.fit.noise_floor_a))
                .unwrap_or_default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_agrees_with_its_double_but_in_size() {
        let (from, other) = ([1.0, 1.0, 1.0], [1.5, 0.0, 1.0]);
        let double = [2.0, -1.0, 1.0];
        let found = Agreement::of(&double, &other, &from);
        assert!((found.size - 2.0).abs() < 1e-15 && (found.cosine - 1.0).abs() < 1e-15);
        assert!((found.difference - 1.0).abs() < 1e-15, "{found:?}");
    }

    #[test]
    fn removed_turns_agree_with_themselves_and_another_seed_is_another_answer() {
        let request = ShortsRequest {
            shares: &[0.05],
            fault_over_turns: &[10.0],
            leakage_ratio: 0.5,
            recordings: 2,
            seed: 1,
            jobs: 1,
        };
        let results = evaluate_shorts(&request).unwrap();
        let [removed, closed] = &results[..] else { panic!("{}", results.len()) };
        assert_eq!((removed.current.difference, removed.motion.difference), (0.0, 0.0));
        assert!(closed.current.difference > 0.5, "{:?}", closed.current);
        let k3 = removed.answers[0].levels[2].unwrap();
        assert!((k3 - 0.05).abs() < 0.005, "{k3}");
        assert_eq!(results, evaluate_shorts(&ShortsRequest { jobs: 2, ..request }).unwrap());
        let other = evaluate_shorts(&ShortsRequest { seed: 2, ..request }).unwrap();
        assert_ne!(results[0].answers[0], other[0].answers[0]);
    }
}
