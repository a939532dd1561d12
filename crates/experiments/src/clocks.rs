//! Recordings whose times are not those of an even clock, beside the recording that the same machine
//! would give on one.
//!
//! Each recording is simulated at the very instants of its samples, the carrier's ripple included, and is
//! written as text.

use std::fmt::Write as _;

use fdi_core::{
    Bundle, ClockNote, ColumnMap, Condition, DiagnoseOptions, Diagnoser, Experiment, Gaps, Purpose,
    Recording, RootSeed, ToleranceUse,
    ema_sim::{Imperfections, PhysicalFaults},
    in_parallel, timed_by_command,
};

use crate::{
    answers::{Answered, AnswersScore, SENSORS, sound_and_damaged},
    chance::Chance,
    request::EvaluationError,
};

/// Errors of the times of a recording. Ranges are drawn from, each whole number as likely, and
/// shares of a sample by their logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClockFault {
    /// None.
    Even,
    /// Samples at random places are not in the file.
    Lost([usize; 2]),
    /// Rows stand twice.
    Doubled([usize; 2]),
    /// Neighbouring rows are exchanged.
    Swapped([usize; 2]),
    /// One gap of some samples.
    Gap([usize; 2]),
    /// Samples are taken off their even instants by normal errors whose root mean square is a share of
    /// a sample, and stamped when they are taken.
    Jittered([f64; 2]),
    /// As jittered, with some samples lost.
    JitteredAndLost([f64; 2], [usize; 2]),
    /// Stamps of even samples are off by such errors.
    StampsJittered([f64; 2]),
    /// Stamps are rounded to some decimals.
    Rounded([usize; 2]),
    /// As rounded, with some samples lost.
    RoundedAndLost([usize; 2], [usize; 2]),
    /// Stamps are sums of steps.
    Cumulated,
    /// Stamps of even samples run too fast or too slow by some parts in a million.
    StampsOff(f64),
    /// Samples are taken by a clock of the logger that is off by so many parts in a million, and
    /// stamped as if it were not.
    SamplesOff(f64),
    /// As so off, with the command recorded.
    SamplesOffByCommand(f64),
    /// Samples at random places are not in the file, whose stamps count its rows; the command is recorded.
    CountedLost([usize; 2]),
    /// Rows stand twice in a file whose stamps count its rows; the command is recorded.
    CountedDoubled([usize; 2]),
}

impl ClockFault {
    /// True where the command is recorded.
    fn has_command(self) -> bool {
        matches!(
            self,
            Self::SamplesOffByCommand(_) | Self::CountedLost(_) | Self::CountedDoubled(_)
        )
    }
}

/// Recordings with wrong times to score.
#[derive(Clone, Copy, Debug)]
pub struct ClocksRequest<'a> {
    /// Machine and test.
    pub bundle: &'a Bundle,
    /// Errors, one kind after the other.
    pub faults: &'a [ClockFault],
    /// Machines without damage, and as many with some.
    pub machines: usize,
    /// Recordings of each machine and kind.
    pub recordings: usize,
    /// Root seed.
    pub seed: u64,
    /// Threads.
    pub jobs: usize,
}

/// Answers to recordings of one kind of wrong times.
#[derive(Clone, Debug, PartialEq)]
pub struct ClocksScore {
    /// Errors of the times.
    pub fault: ClockFault,
    /// Answers beside those of the twins.
    pub answers: AnswersScore,
    /// Recordings that are read, whose lost, doubled or exchanged samples are counted wrong.
    pub miscounted: usize,
}

/// Scores kinds of wrong times of a bundle's machine that is exactly its model file, after the twins.
///
/// # Errors
///
/// [`EvaluationError`] when a machine cannot be simulated.
pub fn evaluate_clocks(request: &ClocksRequest<'_>) -> Result<Vec<ClocksScore>, EvaluationError> {
    let experiment = &request.bundle.experiment;
    let conditions = sound_and_damaged(experiment, request.machines, request.seed, request.jobs)?;
    let diagnoser = Diagnoser::new(request.bundle.clone())?;
    let options = DiagnoseOptions { tolerance: ToleranceUse::None, ..DiagnoseOptions::default() };
    let map = ColumnMap::default().with_gaps(Gaps::Bridge);
    let kinds: Vec<ClockFault> =
        [ClockFault::Even].into_iter().chain(request.faults.iter().copied()).collect();
    let root = RootSeed(request.seed);
    let of_kind = |condition: &Condition, case: usize, place: usize| {
        let seed = root.derive(Purpose::SensorNoise, (case * kinds.len() + place) as u64);
        let log = Log::drawn(kinds[place], experiment, &mut Chance::new(seed));
        let has_command = kinds[place].has_command();
        let text = log.written(experiment, condition, seed, has_command)?;
        let recording = Recording::parse("r.csv", text.as_bytes(), &map).ok();
        let timed = recording.as_ref().and_then(|one| timed_by_command(one, experiment).ok());
        let is_counted = timed.map(|one| log.is_told_by(one.clock_notes()));
        let answer = recording.and_then(|one| diagnoser.diagnose(&one, &options).ok());
        Ok::<_, EvaluationError>((Answered { truth: condition.levels, answer }, is_counted))
    };
    let answered = in_parallel(&conditions, request.jobs, |_, (index, condition)| {
        let of_case = |recording: usize| {
            let case = index * request.recordings + recording;
            (0..kinds.len()).map(|place| of_kind(condition, case, place)).collect()
        };
        (0..request.recordings).map(of_case).collect::<Result<Vec<Vec<_>>, EvaluationError>>()
    })?;
    let scored = |(place, fault): (usize, &ClockFault)| {
        let cases = || answered.iter().flatten();
        let pairs: Vec<_> = cases().map(|kinds| (&kinds[place].0, &kinds[0].0)).collect();
        ClocksScore {
            fault: *fault,
            answers: AnswersScore::of(&pairs),
            miscounted: cases().filter(|kinds| kinds[place].1 == Some(false)).count(),
        }
    };
    Ok(kinds.iter().enumerate().map(scored).collect())
}

/// When the samples of a recording were taken, and what its file says of that.
struct Log {
    /// In the order of time, s.
    instants_s: Vec<f64>,
    /// Rows of the file: the sample and its stamp.
    rows: Vec<(usize, String)>,
    lost: usize,
    doubled: usize,
    late: usize,
}

impl Log {
    /// A log of a test with samples at the rate of its controller.
    fn drawn(fault: ClockFault, experiment: &Experiment, chance: &mut Chance) -> Self {
        let rate_hz = experiment.actuator.controller.sample_hz;
        let samples = (experiment.scenario.duration_s * rate_hz).round() as usize;
        let mut log = Self::even(samples, rate_hz);
        let among = |chance: &mut Chance, [least, most]: [usize; 2]| chance.whole(least..=most);
        match fault {
            ClockFault::Even => {}
            ClockFault::Lost(range) => log.lose(among(chance, range), chance),
            ClockFault::Gap(range) => {
                let lost = among(chance, range);
                let first = chance.whole(1..=samples - 1 - lost);
                log.rows.drain(first..first + lost);
                log.lost = lost;
            }
            ClockFault::Doubled(range) => log.double(among(chance, range), chance),
            ClockFault::Swapped(range) => {
                log.late = among(chance, range);
                for at in apart(log.late, samples, chance) {
                    log.rows.swap(at, at + 1);
                }
            }
            ClockFault::Jittered(range) => log.jitter(range, rate_hz, chance),
            ClockFault::JitteredAndLost(range, lost) => {
                log.jitter(range, rate_hz, chance);
                log.lose(among(chance, lost), chance);
            }
            ClockFault::StampsJittered(range) => {
                let even_s = log.instants_s.clone();
                log.jitter(range, rate_hz, chance);
                log.instants_s = even_s;
            }
            ClockFault::Rounded(range) => log.round(among(chance, range)),
            ClockFault::RoundedAndLost(range, lost) => {
                log.round(among(chance, range));
                log.lose(among(chance, lost), chance);
            }
            ClockFault::Cumulated => {
                let mut sum_s = 0.0;
                for (_, stamp) in &mut log.rows {
                    *stamp = f64::to_string(&sum_s);
                    sum_s += 1.0 / rate_hz;
                }
            }
            ClockFault::StampsOff(ppm) => {
                let factor = 1.0 + 1e-6 * ppm * sign(chance);
                log.stamp(9, |instant_s| factor * instant_s);
            }
            ClockFault::CountedLost(range) => {
                log.lose(among(chance, range), chance);
                log.count(rate_hz);
            }
            ClockFault::CountedDoubled(range) => {
                log.double(among(chance, range), chance);
                log.count(rate_hz);
            }
            ClockFault::SamplesOff(ppm) | ClockFault::SamplesOffByCommand(ppm) => {
                let factor = 1.0 + 1e-6 * ppm * sign(chance);
                let last_s = (samples - 1) as f64 / rate_hz;
                // the stamps stay those of the even clock
                let off_s = log.instants_s.iter().map(|instant_s| (factor * instant_s).min(last_s));
                log.instants_s = off_s.collect();
            }
        }
        log
    }

    /// Samples and stamps of an even clock.
    fn even(samples: usize, rate_hz: f64) -> Self {
        let instants_s = (0..samples).map(|n| n as f64 / rate_hz).collect();
        let mut log = Self { instants_s, rows: Vec::new(), lost: 0, doubled: 0, late: 0 };
        log.stamp(4, |instant_s| instant_s);
        log
    }

    /// Stamps each sample with some decimals.
    fn stamp(&mut self, decimals: usize, stamp_s: impl Fn(f64) -> f64) {
        let stamps = self.instants_s.iter().map(|&instant_s| stamp_s(instant_s));
        self.rows = stamps.map(|stamp_s| format!("{stamp_s:.decimals$}")).enumerate().collect();
    }

    fn round(&mut self, decimals: usize) {
        self.stamp(decimals, |instant_s| instant_s);
    }

    /// Takes samples off their instants, and stamps them when they are taken.
    fn jitter(&mut self, [least, most]: [f64; 2], rate_hz: f64, chance: &mut Chance) {
        let share = least * (most / least).powf(chance.uniform());
        let last_s = self.instants_s[self.instants_s.len() - 1];
        for instant_s in &mut self.instants_s {
            *instant_s = (*instant_s + share / rate_hz * chance.normal()).clamp(0.0, last_s);
        }
        self.instants_s.sort_by(f64::total_cmp);
        self.stamp(9, |instant_s| instant_s);
    }

    /// Stamps each row by its number.
    fn count(&mut self, rate_hz: f64) {
        for (n, (_, stamp)) in self.rows.iter_mut().enumerate() {
            *stamp = format!("{:.4}", n as f64 / rate_hz);
        }
    }

    /// Writes rows, none of them near another, twice.
    fn double(&mut self, count: usize, chance: &mut Chance) {
        self.doubled = count;
        for at in apart(count, self.rows.len(), chance).into_iter().rev() {
            self.rows.insert(at, self.rows[at].clone());
        }
    }

    /// Leaves out rows between the first and the last.
    fn lose(&mut self, count: usize, chance: &mut Chance) {
        self.lost = count;
        for _ in 0..count {
            let at = chance.whole(1..=self.rows.len() - 2);
            self.rows.remove(at);
        }
    }

    /// Tells whether the notes count what is lost, doubled and exchanged.
    fn is_told_by(&self, notes: &[ClockNote]) -> bool {
        let told = notes.first().map_or([0; 3], |note| [note.lost, note.doubled, note.late]);
        told == [self.lost, self.doubled, self.late]
    }

    /// The text of the recording: phases of a machine with noise of the sensors, the rotor's angle, and
    /// the command where it is recorded.
    fn written(
        &self,
        experiment: &Experiment,
        condition: &Condition,
        sensor_seed: u64,
        has_command: bool,
    ) -> Result<String, EvaluationError> {
        let model = experiment
            .high_fidelity(condition.start_angle_rad, Imperfections::REAL)?
            .with_seed(condition.noise_seed);
        let faults = PhysicalFaults::from(&condition.coordinates());
        let (_, logged) = model.simulate_logged(&faults, &self.instants_s)?;
        let [a, b, c] = &logged.phase_currents_a;
        let [a, b, c] = SENSORS.measure([a, b, c], sensor_seed);
        let head = "time_s,phase_a_current_a,phase_b_current_a,phase_c_current_a,motor_angle_rad";
        let mut text = if has_command {
            format!("{head},command_rad\n")
        } else {
            format!("# command = \"{}\"\n{head}\n", experiment.name)
        };
        for (n, stamp) in &self.rows {
            let angle_rad = logged.motor_angle_rad[*n];
            let _ = write!(text, "{stamp},{:.6},{:.6},{:.6},{angle_rad:.6}", a[*n], b[*n], c[*n]);
            if has_command {
                let command_rad = experiment.scenario.command.at(self.instants_s[*n]);
                let _ = write!(text, ",{command_rad:.7}");
            }
            text.push('\n');
        }
        Ok(text)
    }
}

/// Rows, in ascending order, that are at least three apart, and none of them the first or the last two.
fn apart(count: usize, rows: usize, chance: &mut Chance) -> Vec<usize> {
    let mut taken: Vec<usize> = Vec::with_capacity(count);
    while taken.len() < count {
        let at = chance.whole(1..=rows - 3);
        if taken.iter().all(|other| other.abs_diff(at) > 2) {
            taken.push(at);
        }
    }
    taken.sort_unstable();
    taken
}

fn sign(chance: &mut Chance) -> f64 {
    if chance.uniform() < 0.5 { -1.0 } else { 1.0 }
}
