//! Recordings against a machine: residuals, and what each free number does to the prediction.

use core::f64::consts::TAU;

use ema_sim::{CommandKind, MachineSignals, ModelFidelity, PreparedTest};
use inference::{BandedCholesky, LIMIT_SHARE, Whitener, rms};

use crate::{
    anchor::{Anchor, loop_covariance},
    error::{GreyboxError, if_run},
    gram::dot,
    machine::{AskedDrive, Machine, State},
    mains::Mains,
    median::median,
    parallel,
    record::Record,
    structure::{Free, Structure, Target},
};

/// Time left out at the start, s: the controller's integrators are not known there.
const SETTLING_S: f64 = 0.3;
/// Share of the rough part of a residual that is of the sensors at least.
const LEAST_SENSOR_SHARE: f64 = 0.01;

/// Share of a recording that has to be below the limit of its drive for what is at it to be left out.
const LEAST_BELOW_LIMIT: f64 = 0.1;

/// Runs that a thread is given at a time: as many as go side by side.
const SIDE_BY_SIDE: usize = 16;

/// Signals of all recordings, one after the other.
pub(crate) type PerRecord = Vec<Vec<f64>>;

/// A recording with its drive signal as it is compared.
#[derive(Clone, Debug)]
pub(crate) struct Prepared<'a> {
    pub(crate) record: &'a Record,
    /// Place among the recordings compared.
    pub(crate) place: usize,
    /// Samples averaged to one.
    pub(crate) factor: usize,
    skip: usize,
    mains: Mains,
    /// Places of the averaged samples that are compared; none where all are.
    below_limit: Option<Vec<usize>>,
    /// Measured drive signal as it is compared: of equal noise throughout.
    pub(crate) measured: Vec<f64>,
    /// Measured drive signal, averaged.
    pub(crate) averaged: Vec<f64>,
    /// Work that runs of its command have in common.
    test: PreparedTest,
    /// Finer model to which the prediction is moved.
    anchored: Option<Anchored>,
}

/// Anchor of a recording as it is compared.
#[derive(Clone, Debug)]
struct Anchored {
    /// Change of the averaged drive signal.
    drive: Vec<f64>,
    /// Change of the position of the motor, at the rate of the recording.
    motor: Vec<f64>,
    /// Averaged runs less their mean.
    scatter: Vec<Vec<f64>>,
    /// Factor of the covariance of sensors and loop together, in units of the sensors' variance.
    noise: Option<BandedCholesky>,
}

impl Anchored {
    /// Factor of the covariance of the sensors and so many times that of the loop, in units of the
    /// sensors' variance.
    fn covariance(&self, times: f64, noise: f64, rate_hz: f64) -> Option<BandedCholesky> {
        let mut covariance = loop_covariance(&self.scatter, rate_hz);
        covariance.scale(times / (noise * noise));
        covariance.add_to_diagonal(1.0);
        // a unit matrix beside one that is positive semi-definite
        covariance.cholesky().ok()
    }
}

impl<'a> Prepared<'a> {
    fn new(machine: &Machine, place: usize, record: &'a Record) -> Self {
        let factor = libm::round(record.rate_hz / machine.compared_hz(record)).max(1.0) as usize;
        let skip = (libm::ceil(SETTLING_S * record.rate_hz) as usize)
            .min(record.drive.len() / 4)
            .next_multiple_of(factor);
        let drive = Machine::measured_drive(record);
        let samples = drive.len().saturating_sub(skip) / factor;
        let mains = Mains::new(record.rate_hz, factor, samples);
        let (measured, averaged, anchored) = (Vec::new(), Vec::new(), None);
        let test = machine.prepared(record);
        let below_limit = None;
        let mut prepared = Self {
            record,
            place,
            factor,
            skip,
            mains,
            below_limit,
            measured,
            averaged,
            test,
            anchored,
        };
        if record.kind != CommandKind::Motion {
            prepared.leave_out_limit(machine);
        }
        prepared.averaged = prepared.reduce(&drive);
        prepared.measured.clone_from(&prepared.averaged);
        prepared
    }

    /// Leaves out what the limit of the drive decides. It tells of the limit alone, and a sensor whose
    /// range ends there cuts noise and ripple on one side.
    fn leave_out_limit(&mut self, machine: &Machine) {
        let is_at_limit = at_limit(machine, self.record, self.place, self.factor);
        let averaged = is_at_limit.get(self.skip..).unwrap_or_default().chunks_exact(self.factor);
        let below = averaged.enumerate().filter(|(_, samples)| !samples.contains(&true));
        let below: Vec<usize> = below.map(|(place, _)| place).collect();
        let all = self.even_samples();
        let is_enough = below.len() as f64 > LEAST_BELOW_LIMIT * all as f64;
        self.below_limit = (is_enough && below.len() < all).then_some(below);
    }

    /// Share of the averaged samples that is left out.
    fn left_out_frac(&self) -> f64 {
        1.0 - self.measured.len() as f64 / self.even_samples().max(1) as f64
    }

    /// Leaves out what is left out of a recording of the same command.
    fn leave_out_of(&mut self, other: &Self) {
        let Some(theirs) = &other.below_limit else { return };
        let is_theirs = |place: &usize| theirs.binary_search(place).is_ok();
        let own = (0..self.even_samples()).collect();
        let own: Vec<usize> = self.below_limit.take().unwrap_or(own);
        self.below_limit = Some(own.into_iter().filter(is_theirs).collect());
        self.averaged = self.reduce(&Machine::measured_drive(self.record));
        self.measured.clone_from(&self.averaged);
    }

    /// The samples of an averaged signal that are compared.
    pub(crate) fn below_limit(&self, signal: Vec<f64>) -> Vec<f64> {
        match &self.below_limit {
            Some(places) => {
                debug_assert_eq!(signal.len(), self.even_samples(), "a signal at equal distances");
                places.iter().map(|&place| signal[place]).collect()
            }
            None => signal,
        }
    }

    /// A drive signal of the simple model as it is compared.
    fn compared(&self, drive: &[f64]) -> Vec<f64> {
        self.of_equal_noise(self.moved(self.reduce(drive)))
    }

    /// A run in a state on its command.
    fn asked<'s>(&'s self, state: &'s State) -> AskedDrive<'s> {
        AskedDrive { state, record: self.record, ready: &self.test, place: self.place }
    }

    /// An averaged drive signal of the simple model, moved to what the finer one gives.
    pub(crate) fn moved(&self, mut drive: Vec<f64>) -> Vec<f64> {
        if let Some(anchored) = &self.anchored {
            drive.iter_mut().zip(&anchored.drive).for_each(|(x, by)| *x += by);
        }
        drive
    }

    /// Change of the position of the motor from the simple model to the finer one, where there is
    /// one.
    pub(crate) fn moved_motor(&self) -> Option<&[f64]> {
        self.anchored.as_ref().map(|anchored| anchored.motor.as_slice())
    }

    /// Covariance of the noise in the loop, as its factor.
    fn noise(&self) -> Option<&BandedCholesky> {
        self.anchored.as_ref()?.noise.as_ref()
    }

    /// An averaged signal seen so that its noise is that of the sensors alone: `L⁻¹·x`, where the
    /// noise of sensors and loop has the covariance `σ²·L·Lᵀ`.
    pub(crate) fn of_equal_noise(&self, mut signal: Vec<f64>) -> Vec<f64> {
        if let Some(noise) = self.noise() {
            noise.whiten(&mut signal);
        }
        signal
    }

    /// Makes of averaged signals what [`of_equal_noise`](Self::of_equal_noise) makes of one.
    pub(crate) fn give_equal_noise(&self, signals: &mut [&mut Vec<f64>]) {
        if let Some(noise) = self.noise() {
            let mut signals: Vec<&mut [f64]> =
                signals.iter_mut().map(|signal| signal.as_mut_slice()).collect();
            noise.whiten_each(&mut signals);
        }
    }

    /// A residual [of equal noise](Self::of_equal_noise) in its own unit.
    pub(crate) fn in_its_unit(&self, signal: &[f64]) -> Vec<f64> {
        let mut signal = signal.to_vec();
        if let Some(noise) = self.noise() {
            noise.colour(&mut signal);
        }
        signal
    }

    /// Moves the prediction to what a finer model gives in a state; false where it cannot be run.
    fn anchor(
        &self,
        machine: &Machine,
        fidelity: ModelFidelity,
        state: &State,
        runs: u64,
    ) -> Result<Option<Anchored>, GreyboxError> {
        let anchor = Anchor::new(machine, fidelity, state, self.record, self.place, runs)?;
        Ok(anchor.map(|Anchor { drive, motor, scatter }| Anchored {
            drive: self.reduce(&drive),
            motor,
            scatter: scatter.iter().map(|run| self.reduce(run)).collect(),
            noise: None,
        }))
    }

    /// Takes the noise of the loop into account beside that of the sensors, and that of the mean of
    /// so few runs.
    fn weigh(&mut self, noise: f64) {
        let rate_hz = self.rate_hz();
        if let Some(anchored) = &mut self.anchored {
            let runs = anchored.scatter.len() as f64;
            anchored.noise = anchored.covariance(1.0 + 1.0 / runs, noise, rate_hz);
        }
        self.measured = self.of_equal_noise(self.averaged.clone());
    }

    /// Cost of the noise in the loop to a likelihood, nats: the logarithm of the determinant of the
    /// factor that [`of_equal_noise`](Self::of_equal_noise) goes by.
    fn noise_nats(&self) -> f64 {
        self.noise().map_or(0.0, |factor| 0.5 * factor.log_determinant())
    }

    /// Variance of half the square of a whitened residual by the mean of so few runs.
    fn runs_variance(&self, residual: &[f64], whitener: &Whitener) -> f64 {
        let Some(anchored) = &self.anchored else { return 0.0 };
        let runs = anchored.scatter.len() as f64;
        let white = whitener.apply(residual);
        let along = |run: &Vec<f64>| {
            let run = whitener.apply(&self.of_equal_noise(run.clone()));
            let product = dot(&white, &run);
            product * product
        };
        anchored.scatter.iter().map(along).sum::<f64>() / (runs * (runs - 1.0)).max(1.0)
    }

    /// Logarithm of the determinant of `L`, the factor of the noise of sensors and loop about a mean
    /// that is known; zero without an anchor.
    fn log_determinant(&self, noise: f64) -> f64 {
        let own = self.anchored.as_ref();
        let factor = own.and_then(|anchored| anchored.covariance(1.0, noise, self.rate_hz()));
        factor.map_or(0.0, |factor| 0.5 * factor.log_determinant())
    }

    /// A drive signal at the recording's rate as it is compared: averaged, without what hums at the
    /// frequency of the mains, and below the drive's limit.
    pub(crate) fn reduce(&self, drive: &[f64]) -> Vec<f64> {
        self.below_limit(self.evenly_reduced(drive))
    }

    /// As [`reduce`](Self::reduce), at the drive's limit too: at equal distances in time.
    pub(crate) fn evenly_reduced(&self, drive: &[f64]) -> Vec<f64> {
        let mut averaged = self.evenly_averaged_of(drive.len(), |n| drive[n]);
        self.mains.take_off(&mut averaged);
        averaged
    }

    /// A signal at the recording's rate, averaged over so many samples, without its start, where the
    /// drive is below its limit.
    pub(crate) fn average(&self, signal: &[f64]) -> Vec<f64> {
        self.below_limit(self.evenly_averaged_of(signal.len(), |n| signal[n]))
    }

    /// As [`average`](Self::average), of a signal of so many samples that is made as it is averaged,
    /// at equal distances in time.
    pub(crate) fn evenly_averaged_of(&self, samples: usize, of: impl Fn(usize) -> f64) -> Vec<f64> {
        let count = samples.saturating_sub(self.skip) / self.factor;
        let mean = |place: usize| {
            let start = self.skip + place * self.factor;
            (start..start + self.factor).map(&of).sum::<f64>() / self.factor as f64
        };
        (0..count).map(mean).collect()
    }

    /// Averaged samples, those at the drive's limit too.
    pub(crate) fn even_samples(&self) -> usize {
        self.record.drive.len().saturating_sub(self.skip) / self.factor
    }

    /// Rate of what is compared.
    pub(crate) fn rate_hz(&self) -> f64 {
        self.record.rate_hz / self.factor as f64
    }
}

/// Samples of a recording at which the drive is at its limit as recorded, or before a logger's filter
/// by the model as its file says, with as many after them as the filter remembers, and some about
/// them: a machine that is not its file is there sooner or later.
fn at_limit(machine: &Machine, record: &Record, place: usize, about: usize) -> Vec<bool> {
    let nominal = Structure::nominal(machine);
    let state = nominal.state(machine, &nominal.starts());
    let unfiltered = Record { filter_hz: None, ..record.clone() };
    // what cannot be run is told where it is fitted
    let predicted = machine.simulate(&state, &unfiltered, place).map(|signals| signals.drive);
    let predicted = predicted.unwrap_or_default();
    let limit = LIMIT_SHARE * machine.drive_limit();
    let reaches = |signal: &[f64], n: usize| signal.get(n).is_some_and(|x| x.abs() >= limit);
    let memory_s = record.filter_hz.map_or(0.0, |corner_hz| FILTER_TIMES / (TAU * corner_hz));
    let after = about + libm::ceil(memory_s * record.rate_hz) as usize;
    let samples = record.drive.len();
    let mut is_at_limit = vec![false; samples];
    for n in (0..samples).filter(|&n| reaches(&record.drive, n) || reaches(&predicted, n)) {
        is_at_limit[n.saturating_sub(about)..(n + after + 1).min(samples)].fill(true);
    }
    is_at_limit
}

/// Time constants that two first-order low-passes remember: 4 % of a step is left.
const FILTER_TIMES: f64 = 5.0;

/// Anchors of the recordings of a problem.
#[derive(Clone, Debug)]
pub(crate) struct Anchors(Vec<Option<Anchored>>);

/// Recordings to fit and recordings held out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split<'a> {
    pub(crate) train: &'a Problem<'a>,
    pub(crate) holdout: &'a Problem<'a>,
}

/// Recordings that one state of a machine is to explain.
#[derive(Clone, Debug)]
pub(crate) struct Problem<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) records: Vec<Prepared<'a>>,
    pub(crate) jobs: usize,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        machine: &'a Machine,
        records: impl IntoIterator<Item = &'a Record>,
        jobs: usize,
    ) -> Self {
        Self {
            machine,
            records: records
                .into_iter()
                .enumerate()
                .map(|(place, record)| Prepared::new(machine, place, record))
                .collect(),
            jobs,
        }
    }

    /// Leaves out of recordings of one command, by their places here and among the `others`, what is left
    /// out of either: they are compared sample by sample.
    pub(crate) fn leave_out_alike(&mut self, others: &mut Self, pairs: &[(usize, usize)]) {
        for &(own, other) in pairs {
            self.records[own].leave_out_of(&others.records[other]);
        }
        for &(own, other) in pairs {
            others.records[other].leave_out_of(&self.records[own]);
        }
    }

    /// Recordings of which samples at the limit of the drive are left out, in words.
    pub(crate) fn left_out(&self) -> impl Iterator<Item = String> {
        let some = self.records.iter().filter(|prepared| prepared.below_limit.is_some());
        some.map(|prepared| {
            let percent = 100.0 * prepared.left_out_frac();
            format!(
                "{}: {percent:.1} % is at the limit of the drive: left out",
                prepared.record.name
            )
        })
    }

    /// Anchors of the recordings, to be [put back](Self::put_back).
    pub(crate) fn anchors(&self) -> Anchors {
        Anchors(self.records.iter().map(|prepared| prepared.anchored.clone()).collect())
    }

    /// Puts back the anchors that the recordings had.
    pub(crate) fn put_back(&mut self, anchors: &Anchors) {
        for (prepared, anchored) in self.records.iter_mut().zip(&anchors.0) {
            prepared.anchored.clone_from(anchored);
            prepared.measured = prepared.of_equal_noise(prepared.averaged.clone());
        }
    }

    /// Moves the predictions to what a finer model gives in a state; false where it cannot be run.
    /// The noise of the sensors is asked for with the anchor known.
    pub(crate) fn anchor(
        &mut self,
        fidelity: ModelFidelity,
        state: &State,
        runs: u64,
    ) -> Result<bool, GreyboxError> {
        let of = |prepared: &Prepared<'_>| prepared.anchor(self.machine, fidelity, state, runs);
        let anchors = parallel::map(&self.records, self.jobs, of);
        let anchors: Option<Vec<Anchored>> = anchors.into_iter().collect::<Result<_, _>>()?;
        let Some(anchors) = anchors else { return Ok(false) };
        for (prepared, anchor) in self.records.iter_mut().zip(anchors) {
            prepared.anchored = Some(anchor);
        }
        Ok(true)
    }

    /// Runs less their mean of the finer model to which predictions are moved, of all recordings.
    pub(crate) fn scatter(&self) -> Vec<&[f64]> {
        let anchored = self.records.iter().filter_map(|prepared| prepared.anchored.as_ref());
        anchored.flat_map(|anchored| anchored.scatter.iter().map(Vec::as_slice)).collect()
    }

    /// Gives all samples noise of one size, where the sensors have so much.
    pub(crate) fn weigh(&mut self, noise: f64) {
        self.records.iter_mut().for_each(|prepared| prepared.weigh(noise));
    }

    /// Cost of the noise in the loop to a likelihood of all recordings, nats.
    pub(crate) fn noise_nats(&self) -> f64 {
        self.records.iter().map(Prepared::noise_nats).sum()
    }

    /// Standard deviation of half the square of whitened residuals by the means of so few runs of the
    /// finer model: with the error `e` of a mean, that of `r·e`.
    pub(crate) fn runs_std(&self, residuals: &PerRecord, whitener: &Whitener) -> f64 {
        let of = |(prepared, residual): (&Prepared<'_>, &Vec<f64>)| {
            prepared.runs_variance(residual, whitener)
        };
        libm::sqrt(self.records.iter().zip(residuals).map(of).sum())
    }

    /// Logarithm of the determinant of the factors of the noise of sensors and loop, of all
    /// recordings.
    pub(crate) fn log_determinant(&self, noise: f64) -> f64 {
        self.records.iter().map(|prepared| prepared.log_determinant(noise)).sum()
    }

    /// Noise of the sensors by second differences of what an anchored prediction leaves in a state,
    /// less that of the loop; at least a tenth of all.
    pub(crate) fn sensor_noise(&self, state: &State) -> Result<f64, GreyboxError> {
        let rough = |signal: &[f64]| second_differences(signal).map(|d| d * d).sum::<f64>() / 6.0;
        let (mut all, mut of_loop, mut count) = (0.0, 0.0, 0.0);
        let mut records: Vec<(&Prepared<'_>, &Anchored)> = Vec::new();
        for prepared in &self.records {
            records.extend(prepared.anchored.as_ref().map(|anchored| (prepared, anchored)));
        }
        let asked: Vec<AskedDrive<'_>> = records.iter().map(|(r, _)| r.asked(state)).collect();
        for ((prepared, anchored), drive) in records.iter().zip(self.machine.drives(&asked)) {
            let drive = prepared.moved(prepared.reduce(&drive?));
            let left: Vec<f64> = prepared.averaged.iter().zip(&drive).map(|(y, s)| y - s).collect();
            all += rough(&left);
            let runs = anchored.scatter.len().max(2) as f64;
            of_loop += anchored.scatter.iter().map(|run| rough(run)).sum::<f64>() / (runs - 1.0);
            count += left.len() as f64;
        }
        let least = LEAST_SENSOR_SHARE * all;
        Ok(libm::sqrt((all - of_loop).max(least) / f64::max(count, 1.0)).max(1e-9))
    }

    /// Residuals in their own unit.
    pub(crate) fn in_their_unit(&self, residuals: &PerRecord) -> PerRecord {
        let of = |(prepared, residual): (&Prepared<'_>, &Vec<f64>)| prepared.in_its_unit(residual);
        self.records.iter().zip(residuals).map(of).collect()
    }

    pub(crate) fn samples(&self) -> usize {
        self.records.iter().map(|record| record.measured.len()).sum()
    }

    /// Signals that the machine gives for each recording, unreduced.
    pub(crate) fn predictions(&self, state: &State) -> Result<Vec<MachineSignals>, GreyboxError> {
        let of =
            |prepared: &Prepared<'_>| self.machine.simulate(state, prepared.record, prepared.place);
        parallel::map(&self.records, self.jobs, of).into_iter().collect()
    }

    /// The drive signals of several states, as compared: by state, then by recording.
    pub(crate) fn drives(&self, states: &[State]) -> Result<Vec<PerRecord>, GreyboxError> {
        self.drives_of_each(states).into_iter().collect()
    }

    /// The drive signals of each of several states, as compared, where it can be run.
    pub(crate) fn drives_of_each(&self, states: &[State]) -> Vec<Result<PerRecord, GreyboxError>> {
        let places = 0..self.records.len();
        let work = states.iter().flat_map(|state| places.clone().map(move |n| (state, n)));
        let mut drives = self.drives_each(&work.collect::<Vec<_>>()).into_iter();
        let own = |_: &State| drives.by_ref().take(places.len()).collect::<Vec<_>>();
        let by_state: Vec<Vec<Result<Vec<f64>, GreyboxError>>> = states.iter().map(own).collect();
        by_state.into_iter().map(|own| own.into_iter().collect()).collect()
    }

    /// The drive signals, as compared, of states on the commands of recordings by their places.
    /// Runs that are alike go side by side.
    pub(crate) fn drives_each(
        &self,
        work: &[(&State, usize)],
    ) -> Vec<Result<Vec<f64>, GreyboxError>> {
        let asked: Vec<AskedDrive<'_>> =
            work.iter().map(|(state, place)| self.records[*place].asked(state)).collect();
        let mut order: Vec<usize> = (0..work.len()).collect();
        order.sort_by_cached_key(|&n| asked[n].likeness());
        let alike = order.chunk_by(|a, b| asked[*a].likeness() == asked[*b].likeness());
        let chunks: Vec<&[usize]> = alike.flat_map(|alike| alike.chunks(SIDE_BY_SIDE)).collect();
        let done = parallel::map(&chunks, self.jobs, |chunk| {
            let asked: Vec<AskedDrive<'_>> = chunk.iter().map(|&n| asked[n]).collect();
            let drives = self.machine.drives(&asked).into_iter().zip(*chunk);
            let compared = |(drive, n): (Result<Vec<f64>, _>, &usize)| {
                Ok(self.records[work[*n].1].compared(&drive?))
            };
            drives.map(compared).collect::<Vec<_>>()
        });
        let mut drives: Vec<(usize, _)> =
            order.into_iter().zip(done.into_iter().flatten()).collect();
        drives.sort_by_key(|(n, _)| *n);
        drives.into_iter().map(|(_, drive)| drive).collect()
    }

    /// Measured less predicted.
    pub(crate) fn residuals(&self, drive: &PerRecord) -> PerRecord {
        let of = |(prepared, drive): (&Prepared<'_>, &Vec<f64>)| {
            prepared.measured.iter().zip(drive).map(|(y, s)| y - s).collect()
        };
        self.records.iter().zip(drive).map(of).collect()
    }

    /// Change of the prediction with each free number from the `first` on, by differences over a share
    /// of their steps: forward ones, backward at the upper bound. Damage and numbers of the machine
    /// are moved to both sides where no bound stops them and the file leaves several open: forward
    /// differences bend, so that numbers that do the same would seem to be told apart.
    pub(crate) fn sensitivities(
        &self,
        structure: &Structure,
        first: usize,
        share: f64,
        values: &[f64],
        at: &PerRecord,
    ) -> Result<Vec<PerRecord>, GreyboxError> {
        let is_central = |free: &Free| {
            self.machine.has_suspects()
                && matches!(free.target, Target::Rough(_) | Target::Fault(_))
        };
        let ends: Vec<[f64; 2]> = structure
            .free
            .iter()
            .zip(values)
            .skip(first)
            .map(|(free, &value)| {
                let step = share * free.step;
                let [below, above] = [(value - step).max(free.least), value + step];
                match (is_central(free), above <= free.most) {
                    _ if free.least == free.most => [value; 2],
                    (true, true) => [below, above],
                    (_, true) => [value, above],
                    (_, false) => [value - step, value],
                }
            })
            .collect();
        let moved = |place: usize, end: f64| {
            let mut values = values.to_vec();
            values[first + place] = end;
            structure.state(self.machine, &values)
        };
        // what stands still is known
        let stands = |place: usize, end: f64| end == values[first + place];
        let mut states: Vec<State> = Vec::new();
        for (place, ends) in ends.iter().enumerate() {
            let away = ends.iter().filter(|&&end| !stands(place, end));
            states.extend(away.map(|&end| moved(place, end)));
        }
        let mut drives = self.drives_of_each(&states).into_iter();
        let mut slopes = Vec::new();
        for (place, ends) in ends.into_iter().enumerate() {
            // an end at which the machine cannot be run is none
            let mut reached = |end: f64| -> Result<(f64, Option<PerRecord>), GreyboxError> {
                let drive = if stands(place, end) { None } else { drives.next() };
                let drive = drive.map_or(Ok(None), if_run)?;
                Ok((if drive.is_some() { end } else { values[first + place] }, drive))
            };
            let [(low, below), (high, above)] = [reached(ends[0])?, reached(ends[1])?];
            let (below, above) = (below.as_ref().unwrap_or(at), above.as_ref().unwrap_or(at));
            slopes.push(difference(above, below, high - low));
        }
        Ok(slopes)
    }
}

/// Difference of two predictions over a step; none over no step.
fn difference(after: &PerRecord, before: &PerRecord, step: f64) -> PerRecord {
    let slope = |(a, b): (&f64, &f64)| if step == 0.0 { 0.0 } else { (a - b) / step };
    let of =
        |(after, before): (&Vec<f64>, &Vec<f64>)| after.iter().zip(before).map(slope).collect();
    after.iter().zip(before).map(of).collect()
}

/// Noise by second differences of the measured signals: a first guess for fits, which jumps of a
/// command make larger.
pub(crate) fn rough_noise(problem: &Problem<'_>) -> f64 {
    rms(&scaled_differences(problem)).max(1e-9)
}

/// Noise by the median of second differences, so that jumps of a command do not count; where most are
/// zero, as of a coarse converter, their size does.
pub(crate) fn quiet_noise(problem: &Problem<'_>) -> f64 {
    quiet_size(&scaled_differences(problem))
}

/// Standard deviation of normal numbers but for a few far out.
fn quiet_size(differences: &[f64]) -> f64 {
    let middle = median(differences.iter().map(|d| d.abs()).collect());
    let noise = if middle > 0.0 { STD_OVER_MEDIAN * middle } else { rms(differences) };
    noise.max(1e-9)
}

/// Standard deviation of normal numbers over the median of their sizes.
const STD_OVER_MEDIAN: f64 = 1.4826;

/// Second differences of all signals, as large as white noise itself.
fn scaled_differences(problem: &Problem<'_>) -> Vec<f64> {
    let of = |r: &Prepared<'_>| -> Vec<f64> {
        second_differences(&r.measured).map(|d| d / libm::sqrt(6.0)).collect()
    };
    problem.records.iter().flat_map(of).collect()
}

/// Second differences of a signal; of white noise their variance is six times its own.
fn second_differences(signal: &[f64]) -> impl Iterator<Item = f64> {
    signal.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes of a standard deviation of one have a median of 0.6745; one jump of a hundred does not
    /// count, and of zeros alone that jump does.
    #[test]
    fn a_jump_is_no_noise_unless_all_else_is_zero() {
        let mut differences: Vec<f64> = (0..100).map(|n| 0.013_49 * f64::from(n)).collect();
        assert!((quiet_size(&differences) - 1.0).abs() < 0.01, "{}", quiet_size(&differences));
        differences[0] = 1e3;
        assert!((quiet_size(&differences) - 1.0).abs() < 0.03, "{}", quiet_size(&differences));
        let coarse = [0.0, 0.0, 0.0, 4.0];
        assert_eq!(quiet_size(&coarse), 2.0);
    }

    /// A command that jumps puts the drive to its limit, and what is compared leaves that out; one that
    /// goes slowly is compared everywhere, and so is a drive that is followed.
    #[test]
    fn what_the_limit_decides_is_left_out() {
        let machine = Machine::bench_top();
        let nominal = Structure::nominal(&machine);
        let state = nominal.state(&machine, &nominal.starts());
        let record = |jump_rad: f64, kind: CommandKind| {
            let at = |n: u32| if n < 750 { 0.0 } else { jump_rad };
            let mut record = Record {
                name: "jump".to_owned(),
                rate_hz: 1000.0,
                command: (0..2000).map(at).collect(),
                kind: CommandKind::Position,
                drive: vec![0.0; 2000],
                position: Some(vec![0.0; 2000]),
                load: None,
                filter_hz: Some(200.0),
                start_rad: None,
            };
            let signals = machine.simulate(&state, &record, 0).expect("an axis that runs");
            (record.drive, record.kind) = (signals.drive, kind);
            record
        };
        let left_out = |record: &Record| {
            let prepared = Prepared::new(&machine, 0, record);
            prepared.even_samples() - prepared.measured.len()
        };
        let jump = record(0.45, CommandKind::Position);
        let unfiltered = left_out(&Record { filter_hz: None, ..jump.clone() });
        assert!((3..100).contains(&unfiltered), "{unfiltered}");
        // a filter remembers the limit for five of its time constants: 4 ms
        let remembered = 4.0 / Prepared::new(&machine, 0, &jump).factor as f64;
        assert!((left_out(&jump) as f64 - unfiltered as f64 - remembered).abs() <= 1.0);
        assert_eq!(left_out(&record(0.01, CommandKind::Position)), 0);
        assert_eq!(left_out(&Record { kind: CommandKind::Motion, ..jump }), 0);
    }
}
