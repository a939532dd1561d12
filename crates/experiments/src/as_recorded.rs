//! Recordings as benches make them, beside the recording that the same machine would give on a bench
//! that is exactly as the bundle has it.
//!
//! Each machine is simulated once, its phases at a rate ten times that of the recording: a recording
//! may then begin at any tenth of a sample before the command, and shows the carrier's ripple there. Both recordings of a machine have noise
//! of their own, so that their answers differ by that too.

use std::{f64::consts::TAU, fmt::Write as _};

use fdi_core::{
    Bundle, ColumnMap, Condition, DiagnoseOptions, Diagnoser, Purpose, RecordedContent, Recording,
    RootSeed, SimulatedRecording, ToleranceUse,
    ema_sim::{Envelope, Imperfections, PhaseSensors},
    in_parallel,
    report::{NoticeCode, RecordDiagnosis},
};

use crate::{
    answers::{Answered, AnswersScore, SENSORS, sound_and_damaged},
    request::EvaluationError,
};

/// Rate of the phases in the recordings, Hz.
const RATE_HZ: f64 = 10e3;
/// Simulated samples for each recorded one.
const FINE: usize = 10;

/// How a bench makes its recordings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BenchForm {
    /// In words.
    pub name: &'static str,
    /// Longest time that a recording runs before its command, s; each recording has a part of it.
    pub most_before_s: f64,
    /// True where the command begins between two samples.
    pub between_samples: bool,
    /// Columns beside the first two phases.
    pub columns: &'static [BenchColumn],
    /// True where the columns of the phases are in any of six orders, all the other way round or not.
    pub any_wiring: bool,
    /// The current of a field-oriented drive in place of the phases.
    pub quadrature: Option<DriveLog>,
}

/// How a field-oriented drive logs its quadrature-axis current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveLog {
    /// Corner of its low-pass of first order, Hz, where it has one.
    pub corner_hz: Option<f64>,
    /// Ticks of its controller for each sample of the log.
    pub ticks: usize,
}

impl DriveLog {
    /// The log of a current that the drive computed at each tick: its low-pass is an exponential mean.
    fn of(&self, quadrature_a: &[f64]) -> Vec<f64> {
        let share =
            self.corner_hz.map_or(1.0, |corner_hz| 1.0 - (-TAU * corner_hz / RATE_HZ).exp());
        let mut mean_a = 0.0;
        let smooth = quadrature_a.iter().map(|current_a| {
            mean_a += share * (current_a - mean_a);
            mean_a
        });
        smooth.step_by(self.ticks).collect()
    }
}

/// Column that a bench may record beside two phases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchColumn {
    /// The third phase.
    Phase,
    /// The rotor's angle.
    Angle,
    /// The command.
    Command,
}

impl BenchForm {
    fn has(&self, column: BenchColumn) -> bool {
        self.columns.contains(&column)
    }
}

/// As the bundle has it.
const TWIN: BenchForm = BenchForm {
    name: "twin",
    most_before_s: 0.0,
    between_samples: false,
    columns: &[BenchColumn::Phase, BenchColumn::Angle],
    any_wiring: false,
    quadrature: None,
};

/// Forms of recordings to score.
#[derive(Clone, Copy, Debug)]
pub struct AsRecordedRequest<'a> {
    /// Machine and test.
    pub bundle: &'a Bundle,
    /// Forms.
    pub forms: &'a [BenchForm],
    /// Machines without damage, and as many with some.
    pub machines: usize,
    /// Use of the machine's tolerances.
    pub tolerance: ToleranceUse,
    /// Root seed.
    pub seed: u64,
    /// Threads.
    pub jobs: usize,
}

/// Answers to recordings of one form.
#[derive(Clone, Debug, PartialEq)]
pub struct AsRecordedScore {
    /// Name of the form, `twin` for recordings as the bundle has them.
    pub name: &'static str,
    /// Answers beside those of the twins.
    pub answers: AnswersScore,
    /// Recordings whose wiring is told as it is: another than stated, or none.
    pub wiring_right: usize,
}

/// Scores forms of recordings of a bundle's machine, after their twins.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated or the recording is none.
pub fn evaluate_as_recorded(
    request: &AsRecordedRequest<'_>,
) -> Result<Vec<AsRecordedScore>, EvaluationError> {
    let experiment = request.bundle.experiment.clone();
    let conditions = sound_and_damaged(&experiment, request.machines, request.seed, request.jobs)?;
    let diagnoser = Diagnoser::new(request.bundle.clone())?;
    let forms: Vec<BenchForm> = [TWIN].into_iter().chain(request.forms.iter().copied()).collect();
    let options = DiagnoseOptions { tolerance: request.tolerance, ..DiagnoseOptions::default() };
    let answered = in_parallel(&conditions, request.jobs, |_, (index, condition)| {
        let machine = Machine::simulated(&experiment, condition)?;
        let of_form = |(place, form): (usize, &BenchForm)| {
            let root = RootSeed(request.seed);
            let seed = root.derive(Purpose::SensorNoise, (index * forms.len() + place) as u64);
            let start = root.derive(Purpose::Fixture, *index as u64);
            let wiring = if form.any_wiring { Wiring::drawn(seed) } else { Wiring::STATED };
            let text = match &form.quadrature {
                Some(log) => machine.logged(&experiment, log, seed),
                None => machine.written(&experiment, form, &wiring, start, seed),
            };
            let recording = Recording::parse("r.csv", text.as_bytes(), &ColumnMap::default())?;
            let answer = diagnoser.diagnose(&recording, &options).ok();
            let answered = Answered { truth: condition.levels, answer };
            Ok::<_, EvaluationError>((answered, wiring))
        };
        forms.iter().enumerate().map(of_form).collect::<Result<Vec<_>, _>>()
    })?;
    let scored = |(place, form): (usize, &BenchForm)| {
        let of_form = answered.iter().map(|all| (&all[place].0, &all[0].0));
        let is_told = |all: &&Vec<(Answered, Wiring)>| {
            let (Answered { answer, .. }, wiring) = &all[place];
            answer.as_ref().is_some_and(|answer| wiring.is_told_by(answer))
        };
        AsRecordedScore {
            name: form.name,
            answers: AnswersScore::of(&of_form.collect::<Vec<_>>()),
            wiring_right: answered.iter().filter(is_told).count(),
        }
    };
    Ok(forms.iter().enumerate().map(scored).collect())
}

/// Orders of the columns of three phases.
pub(crate) const ORDERS: [[usize; 3]; 6] =
    [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
/// Columns of the phases.
const PHASES: [&str; 3] = ["phase_a_current_a", "phase_b_current_a", "phase_c_current_a"];

/// How a bench has connected the sensors of the phases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wiring {
    /// Phase behind each column.
    pub(crate) phases: [usize; 3],
    /// True where all sensors sit the other way round.
    pub(crate) is_reversed: bool,
}

impl Wiring {
    /// Every column has its phase.
    pub(crate) const STATED: Self = Self { phases: ORDERS[0], is_reversed: false };

    /// Any of twelve.
    fn drawn(seed: u64) -> Self {
        let of_twelve = RootSeed(seed).derive(Purpose::Fixture, 0) % 12;
        Self { phases: ORDERS[of_twelve as usize / 2], is_reversed: of_twelve % 2 == 1 }
    }

    /// Columns of the currents of the phases.
    pub(crate) fn connected(&self, phases_a: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
        let sign = if self.is_reversed { -1.0 } else { 1.0 };
        self.phases.map(|phase| phases_a[phase].iter().map(|i| sign * i).collect())
    }

    /// Tells whether the answer says where two of the phases are; the third is what is left.
    fn is_told_by(&self, answer: &RecordDiagnosis) -> bool {
        let told = answer.notices.iter().find(|one| one.code == NoticeCode::PhasesRewired);
        let Some(told) = told else { return *self == Self::STATED };
        let factor = if self.is_reversed { "*-1" } else { "" };
        let is_told = |column: usize| {
            let read = format!("{}={}{factor}", PHASES[self.phases[column]], PHASES[column]);
            let parts = told.message.split([' ', ',', '`']);
            parts.filter(|part| *part == read).count() == 1
        };
        *self != Self::STATED && is_told(0) && is_told(1)
    }
}

/// A machine in the test, its phases and angle without noise of the sensors, at `FINE` times the rate
/// of the recordings.
struct Machine {
    phases_a: [Vec<f64>; 3],
    angle_rad: Vec<f64>,
}

impl Machine {
    fn simulated(
        experiment: &fdi_core::Experiment,
        condition: &Condition,
    ) -> Result<Self, EvaluationError> {
        let recorded = SimulatedRecording {
            faults: condition.coordinates(),
            start_angle_rad: condition.start_angle_rad,
            imperfections: Imperfections::REAL,
            controller_seed: condition.noise_seed,
            sensors: PhaseSensors { noise_a: 0.0, converter: None },
            phase_rate_hz: Some(FINE as f64 * RATE_HZ),
            sensor_seed: 0,
            content: RecordedContent::Phases,
            has_voltage: false,
        };
        let recording = recorded.record(experiment, "r")?;
        let values = |place: usize| recording.channels()[place].values().to_vec();
        Ok(Self { phases_a: [0, 1, 2].map(values), angle_rad: values(3) })
    }

    /// The text that a field-oriented drive logs of its own current, from the first tick of the test.
    fn logged(
        &self,
        experiment: &fdi_core::Experiment,
        log: &DriveLog,
        sensor_seed: u64,
    ) -> String {
        let ticks = |fine: &[f64]| fine.iter().step_by(FINE).copied().collect::<Vec<f64>>();
        let [a, b, c] = self.phases_a.each_ref().map(|phase| ticks(phase));
        let [a, b, c] = SENSORS.measure([&a, &b, &c], sensor_seed);
        let angle_rad = ticks(&self.angle_rad);
        let pole_pairs = experiment.actuator.motor.pole_pairs;
        let quadrature_a = Envelope::QAxis.of_phases_at([&a, &b, &c], &angle_rad, pole_pairs);
        let mut text = format!("# command = \"{}\"\n", experiment.name);
        if let Some(corner_hz) = log.corner_hz {
            let _ = writeln!(text, "# filter-hz = {corner_hz}");
        }
        text.push_str("time_s,q_axis_current_a,motor_angle_rad\n");
        for (n, current_a) in log.of(&quadrature_a).iter().enumerate() {
            let tick = n * log.ticks;
            let time_s = tick as f64 / RATE_HZ;
            let _ = writeln!(text, "{time_s:.4},{current_a:.6},{:.6}", angle_rad[tick]);
        }
        text
    }

    /// The text of a recording in a form. Before its command all stands as at its start.
    fn written(
        &self,
        experiment: &fdi_core::Experiment,
        form: &BenchForm,
        wiring: &Wiring,
        start: u64,
        sensor_seed: u64,
    ) -> String {
        let share = start as f64 / u64::MAX as f64;
        let rest = (share * form.most_before_s * RATE_HZ).round() as i64;
        let offset = if form.between_samples { (start % FINE as u64) as i64 } else { 0 };
        let last = self.angle_rad.len() as i64 - 1;
        let places: Vec<i64> = (-rest..=last / FINE as i64)
            .map(|n| n * FINE as i64 + offset)
            .filter(|at| *at <= last)
            .collect();
        let taken = |fine: &[f64], before: f64| -> Vec<f64> {
            places.iter().map(|&at| if at < 0 { before } else { fine[at as usize] }).collect()
        };
        let [a, b, c] = wiring.connected(&self.phases_a.each_ref().map(|phase| taken(phase, 0.0)));
        let phases_a = SENSORS.measure([&a, &b, &c], sensor_seed);
        let angle_rad = taken(&self.angle_rad, self.angle_rad[0]);
        let mut text = String::new();
        if !form.has(BenchColumn::Command) {
            let _ = writeln!(text, "# command = \"{}\"", experiment.name);
        }
        text.push_str("time_s,phase_a_current_a,phase_b_current_a");
        for (is_there, column) in [
            (form.has(BenchColumn::Phase), ",phase_c_current_a"),
            (form.has(BenchColumn::Angle), ",motor_angle_rad"),
            (form.has(BenchColumn::Command), ",command_rad"),
        ] {
            text.push_str(if is_there { column } else { "" });
        }
        for (n, &at) in places.iter().enumerate() {
            let [a, b, c] = phases_a.each_ref().map(|phase| phase[n]);
            let _ = write!(text, "\n{:.4},{a:.6},{b:.6}", n as f64 / RATE_HZ);
            if form.has(BenchColumn::Phase) {
                let _ = write!(text, ",{c:.6}");
            }
            if form.has(BenchColumn::Angle) {
                let _ = write!(text, ",{:.6}", angle_rad[n]);
            }
            if form.has(BenchColumn::Command) {
                let since_s = (at as f64 / (FINE as f64 * RATE_HZ)).max(0.0);
                let _ = write!(text, ",{:.7}", experiment.scenario.command.at(since_s));
            }
        }
        text.push('\n');
        text
    }
}
