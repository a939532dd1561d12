//! Recordings against a machine: residuals, and what each free number does to the prediction.

use ema_sim::{MachineSignals, PreparedTest};

use crate::{
    error::GreyboxError,
    machine::{Machine, State},
    mains::Mains,
    parallel,
    record::Record,
    structure::Structure,
};

/// Time left out at the start, s: the controller's integrators are not known there.
const SETTLING_S: f64 = 0.3;

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
    pub(crate) measured: Vec<f64>,
    /// Work that runs of its command have in common.
    test: PreparedTest,
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
        let (measured, test) = (Vec::new(), machine.prepared(record));
        let mut prepared = Self { record, place, factor, skip, mains, measured, test };
        prepared.measured = prepared.reduce(&drive);
        prepared
    }

    /// The drive signal of a machine on its command, as it is compared.
    pub(crate) fn drive(&self, machine: &Machine, state: &State) -> Result<Vec<f64>, GreyboxError> {
        Ok(self.reduce(&machine.drive(state, self.record, &self.test, self.place)?))
    }

    /// A drive signal at the recording's rate as it is compared: averaged, and without what hums
    /// at the frequency of the mains.
    pub(crate) fn reduce(&self, drive: &[f64]) -> Vec<f64> {
        let mut averaged = self.averaged(drive);
        self.mains.take_off(&mut averaged);
        averaged
    }

    /// A signal at the recording's rate, averaged over so many samples, without its start.
    pub(crate) fn averaged(&self, signal: &[f64]) -> Vec<f64> {
        let kept = signal.get(self.skip..).unwrap_or_default();
        let mean = |chunk: &[f64]| chunk.iter().sum::<f64>() / self.factor as f64;
        kept.chunks_exact(self.factor).map(mean).collect()
    }

    /// Rate of what is compared.
    pub(crate) fn rate_hz(&self) -> f64 {
        self.record.rate_hz / self.factor as f64
    }
}

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
        let work: Vec<(&State, &Prepared<'_>)> = states
            .iter()
            .flat_map(|state| self.records.iter().map(move |record| (state, record)))
            .collect();
        let of = |(state, prepared): &(&State, &Prepared<'_>)| prepared.drive(self.machine, state);
        let drives: Result<Vec<Vec<f64>>, _> =
            parallel::map(&work, self.jobs, of).into_iter().collect();
        let mut drives = drives?.into_iter();
        Ok(states.iter().map(|_| drives.by_ref().take(self.records.len()).collect()).collect())
    }

    /// Measured less predicted.
    pub(crate) fn residuals(&self, drive: &PerRecord) -> PerRecord {
        let of = |(prepared, drive): (&Prepared<'_>, &Vec<f64>)| {
            prepared.measured.iter().zip(drive).map(|(y, s)| y - s).collect()
        };
        self.records.iter().zip(drive).map(of).collect()
    }

    /// Change of the prediction with each free number from the `first` on, by forward
    /// differences over a share of their steps; backward at the upper bound.
    pub(crate) fn sensitivities(
        &self,
        structure: &Structure,
        first: usize,
        share: f64,
        values: &[f64],
        at: &PerRecord,
    ) -> Result<Vec<PerRecord>, GreyboxError> {
        let steps: Vec<f64> = structure
            .free
            .iter()
            .zip(values)
            .skip(first)
            .map(|(free, value)| {
                let step = share * free.step;
                if value + step <= free.most { step } else { -step }
            })
            .collect();
        let stepped = |(place, step): (usize, &f64)| {
            let mut values = values.to_vec();
            values[first + place] += step;
            structure.state(self.machine, &values)
        };
        let states: Vec<State> = steps.iter().enumerate().map(stepped).collect();
        let drives = self.drives(&states)?;
        let difference = |(drive, step): (PerRecord, &f64)| {
            let of = |(after, before): (&Vec<f64>, &Vec<f64>)| {
                after.iter().zip(before).map(|(a, b)| (a - b) / step).collect()
            };
            drive.iter().zip(at).map(of).collect()
        };
        Ok(drives.into_iter().zip(&steps).map(difference).collect())
    }
}
