//! Recordings as this crate takes them: equally long channels at one rate.

use ema_sim::{CommandKind, MachineSignals, MachineTest};

use crate::error::GreyboxError;

/// One recording of a machine in closed loop.
///
/// All channels have one sample at each multiple of `1/rate_hz`, beginning at zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Name that answers give it.
    pub name: String,
    /// Rate of all channels.
    pub rate_hz: f64,
    /// Command that was given.
    pub command: Vec<f64>,
    /// Quantity that the command asks for.
    pub kind: CommandKind,
    /// Drive signal, as measured: current in A, or of an amplifier or winding its
    /// voltage in V.
    pub drive: Vec<f64>,
    /// Measured position of the motor (of an axis its own): rad or m.
    pub position: Option<Vec<f64>>,
    /// Load against positive motion, on the surface or the axis: N·m or N.
    pub load: Option<Vec<f64>>,
    /// Corner of the two first-order low-passes behind `drive`, where it was filtered.
    pub filter_hz: Option<f64>,
    /// Angle of an actuator's motor at the first sample, rad, where it is known better than by an
    /// encoder's step: with damaged phases the current tells ten-thousandths of a turn apart.
    pub start_rad: Option<f64>,
}

/// Shortest recording, s: the first 0.3 s are not compared.
const LEAST_S: f64 = 0.4;

/// Fewest samples of a recording.
const LEAST_SAMPLES: usize = 200;

impl Record {
    /// Recording of a test that was simulated, with all that its signals show.
    pub fn of_test(name: &str, test: &MachineTest<'_>, signals: MachineSignals) -> Self {
        Self {
            name: name.to_owned(),
            rate_hz: test.rate_hz,
            command: test.command.to_vec(),
            kind: test.asks_for,
            drive: signals.drive,
            position: Some(signals.motor),
            load: test.load.map(<[f64]>::to_vec),
            filter_hz: test.filter_hz,
            start_rad: test.start_rad,
        }
    }

    /// Refuses a recording whose channels differ in length, are not finite, or are too short.
    ///
    /// # Errors
    ///
    /// [`GreyboxError::Record`], naming recording and channel.
    pub fn check(&self) -> Result<(), GreyboxError> {
        let refuse = |reason: String| GreyboxError::Record { record: self.name.clone(), reason };
        if !(self.rate_hz.is_finite() && self.rate_hz > 0.0) {
            return Err(refuse(format!("a rate of {} Hz", self.rate_hz)));
        }
        if let Some(start) = self.start_rad.filter(|start| !start.is_finite()) {
            return Err(refuse(format!("a start angle of {start}")));
        }
        let samples = self.drive.len();
        if samples < LEAST_SAMPLES {
            return Err(refuse(format!("{samples} samples, expected at least {LEAST_SAMPLES}")));
        }
        let channels = [
            ("command", Some(&self.command)),
            ("drive", Some(&self.drive)),
            ("position", self.position.as_ref()),
            ("load", self.load.as_ref()),
        ];
        for (name, channel) in channels.iter().filter_map(|(name, c)| c.map(|c| (name, c))) {
            if channel.len() != samples {
                let found = channel.len();
                return Err(refuse(format!("{found} samples of {name}, {samples} of the drive")));
            }
            if let Some(index) = channel.iter().position(|value| !value.is_finite()) {
                return Err(refuse(format!("sample {index} of {name} is not finite")));
            }
        }
        Ok(())
    }

    /// Length in seconds.
    pub fn duration_s(&self) -> f64 {
        self.drive.len() as f64 / self.rate_hz
    }

    /// Tells whether the measurements are those of another recording, to the last digit.
    fn is_same(&self, other: &Self) -> bool {
        self.drive == other.drive
            && self.position == other.position
            && self.command == other.command
    }

    /// Command and load, as a machine is run on them.
    pub(crate) fn test(&self) -> MachineTest<'_> {
        MachineTest {
            rate_hz: self.rate_hz,
            command: &self.command,
            asks_for: self.kind,
            load: self.load.as_deref(),
            filter_hz: self.filter_hz,
            shown_start: self.position.as_ref().map(|position| position[0]),
            start_rad: self.start_rad,
        }
    }

    /// Tells whether another recording is of the same command under the same load.
    pub(crate) fn repeats(&self, other: &Self) -> bool {
        let same = |a: &[f64], b: &[f64]| {
            let range = a.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            a.len() == b.len()
                && a.iter().zip(b).all(|(x, y)| (x - y).abs() <= 1e-6 * range.max(1e-12))
        };
        let loads = match (&self.load, &other.load) {
            (Some(a), Some(b)) => same(a, b),
            (a, b) => a.is_none() == b.is_none(),
        };
        self.kind == other.kind
            && self.rate_hz == other.rate_hz
            && loads
            && same(&self.command, &other.command)
    }
}

/// Recordings of one machine in one state of health, by what they are for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recordings {
    /// Fitted.
    pub train: Vec<Record>,
    /// Neither fitted nor chosen on: another command than those fitted.
    pub holdout: Vec<Record>,
    /// Repetitions of recordings of `train`, for the noise.
    pub repeat: Vec<Record>,
}

impl Recordings {
    /// Refuses sets without a recording to fit, recordings of no use or too short to be compared,
    /// and one that is given twice, which would be judged on what it was fitted to.
    ///
    /// # Errors
    ///
    /// [`GreyboxError`].
    pub fn check(&self) -> Result<(), GreyboxError> {
        let all: Vec<&Record> = self.all().collect();
        for (place, one) in all.iter().enumerate() {
            let duration_s = one.duration_s();
            if duration_s < LEAST_S {
                let record = one.name.clone();
                return Err(GreyboxError::Short { record, duration_s, least_s: LEAST_S });
            }
            if let Some(twin) = all[..place].iter().find(|other| one.is_same(other)) {
                let [first, second] = [twin, one].map(|record| record.name.clone());
                return Err(GreyboxError::Twice { first, second });
            }
        }
        if self.train.is_empty() {
            return Err(GreyboxError::NoTraining);
        }
        self.all().try_for_each(Record::check)
    }

    /// All of them, those to fit first.
    pub fn all(&self) -> impl Iterator<Item = &Record> {
        self.train.iter().chain(&self.holdout).chain(&self.repeat)
    }
}
