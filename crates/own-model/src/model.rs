//! A simulation of somebody else, its numbers, and the tests that it is compared in.

use crate::ports::PortsInUse;

/// Number of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// Name that its owner gave.
    pub key: String,
    /// Value in the model.
    pub value: f64,
    /// Standard deviation of what is known of it beforehand, in its unit. `None`: the value is
    /// taken for exact, and another one is a cause to be named.
    pub tolerance: Option<f64>,
    /// Standard deviation of the change that a search expects where the value is wrong. `None`: half
    /// of the value.
    pub scale: Option<f64>,
    /// Least value.
    pub least: f64,
    /// Largest value.
    pub most: f64,
}

impl Number {
    /// A number of any size, taken for exact.
    pub fn exact(key: impl Into<String>, value: f64) -> Self {
        let (least, most) = (f64::NEG_INFINITY, f64::INFINITY);
        Self { key: key.into(), value, tolerance: None, scale: None, least, most }
    }

    /// A number with the standard deviation of what is known of it.
    pub fn rough(key: impl Into<String>, value: f64, tolerance: f64) -> Self {
        Self { tolerance: Some(tolerance), ..Self::exact(key, value) }
    }

    /// Refuses bounds and tolerances that no number has.
    ///
    /// # Errors
    ///
    /// [`ModelError::Number`].
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        let Self { key, value, tolerance, scale, least, most } = self;
        let refused = |expected: &str| {
            Err(ModelError::Number { key: key.clone(), expected: expected.to_owned() })
        };
        if !value.is_finite() {
            return refused("a finite value");
        }
        if !(least <= value && value <= most && least < most) {
            return refused(&format!("least {least} and most {most} on either side of {value}"));
        }
        let is_positive = |std: &Option<f64>| std.is_none_or(|std| std > 0.0 && std.is_finite());
        if !is_positive(tolerance) || !is_positive(scale) {
            return refused("a tolerance and a scale above zero");
        }
        Ok(())
    }

    /// Standard deviation of a change of a number that is wrong.
    ///
    /// # Errors
    ///
    /// [`ModelError`] for a value of zero without a scale.
    pub(crate) fn suspected_std(&self) -> Result<f64, ModelError> {
        let std = self.scale.unwrap_or(0.5 * self.value.abs());
        if std > 0.0 && std.is_finite() {
            return Ok(std);
        }
        Err(ModelError::NoScale { key: self.key.clone() })
    }
}

/// Places where causes can enter a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ports {
    /// The model asks [`PortsInUse::load`] for the torque, or force, against its motion.
    pub load: bool,
    /// The model passes what its controller asks of the drive through [`PortsInUse::drive`].
    pub drive: bool,
    /// The model passes the position that its controller sees through [`PortsInUse::sensor`].
    pub sensor: bool,
}

/// A test: what the machine is asked and loaded with, one sample each `1/rate_hz`.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// Samples a second.
    pub rate_hz: f64,
    /// The command, in the model's unit.
    pub command: Vec<f64>,
    /// Known load against positive motion; empty: none.
    pub load: Vec<f64>,
}

/// Signals that were recorded in a test.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Name in messages.
    pub name: String,
    /// The test.
    pub test: Test,
    /// One signal for each of the model's, as long as the command.
    pub signals: Vec<Vec<f64>>,
}

/// Recordings of one machine.
#[derive(Clone, Copy, Debug)]
pub struct Recordings<'a> {
    /// Recordings that causes are fitted to.
    pub train: &'a [Record],
    /// Recordings that causes are judged by; may be empty.
    pub holdout: &'a [Record],
}

/// A simulation of a machine, written by anybody in any language.
///
/// It has to give the same signals for the same numbers, test and ports. It is run some hundred
/// times.
///
/// # Examples
///
/// A mass on a drag, driven by a force:
///
/// ```
/// use own_model::{ModelError, Number, OwnModel, Ports, PortsInUse, Test};
///
/// struct Mass(Vec<Number>);
///
/// impl OwnModel for Mass {
///     fn numbers(&self) -> &[Number] {
///         &self.0
///     }
///
///     fn signals(&self) -> &[String] {
///         const { &[] }
///     }
///
///     fn ports(&self) -> Ports {
///         Ports { load: true, drive: true, sensor: false }
///     }
///
///     fn run(
///         &self,
///         numbers: &[f64],
///         test: &Test,
///         ports: &mut PortsInUse,
///     ) -> Result<Vec<Vec<f64>>, ModelError> {
///         let (mut position, mut speed, step_s) = (0.0, 0.0, 1.0 / test.rate_hz);
///         let mut speeds = Vec::new();
///         for (sample, force) in test.command.iter().enumerate() {
///             speeds.push(speed);
///             let force = ports.drive(sample, *force);
///             let load = ports.load(sample, position, speed);
///             speed += step_s * (force - numbers[1] * speed - load) / numbers[0];
///             position += step_s * speed;
///         }
///         Ok(vec![speeds])
///     }
/// }
///
/// let mass = Mass(vec![Number::exact("mass_kg", 2.0), Number::exact("drag", 0.5)]);
/// let test = Test { rate_hz: 100.0, command: vec![1.0; 300], load: Vec::new() };
/// let signals = mass.run(&[2.0, 0.5], &test, &mut PortsInUse::none(&test))?;
/// assert!(signals[0][299] > 1.0);
/// # Ok::<_, ModelError>(())
/// ```
pub trait OwnModel {
    /// All numbers of the model.
    fn numbers(&self) -> &[Number];

    /// Names of the signals that [`run`](Self::run) gives, in its order.
    fn signals(&self) -> &[String];

    /// The places that it has for causes.
    fn ports(&self) -> Ports;

    /// Runs a test with these values of its numbers: one signal for each name, as long as the
    /// command.
    ///
    /// # Errors
    ///
    /// [`ModelError::Run`] with the model's own words.
    fn run(
        &self,
        numbers: &[f64],
        test: &Test,
        ports: &mut PortsInUse,
    ) -> Result<Vec<Vec<f64>>, ModelError>;
}

/// Reason why a model cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The model itself failed.
    #[error("the model failed: {0}")]
    Run(String),
    /// Whoever waited has gone.
    #[error("stopped")]
    Stopped,
    /// A signal is missing, or has another length than the command.
    #[error(
        "{record}: signal `{signal}` has {given} samples, expected {expected} as in the command"
    )]
    Length {
        /// The recording.
        record: String,
        /// The signal.
        signal: String,
        /// Samples.
        given: usize,
        /// Samples of the command.
        expected: usize,
    },
    /// A value that is no number.
    #[error("{record}: sample {sample} of `{signal}` is not finite")]
    NotFinite {
        /// The recording.
        record: String,
        /// The signal.
        signal: String,
        /// The first such sample.
        sample: usize,
    },
    /// The model itself, as its owner wrote it, gives a value that is no number.
    #[error("{record}: the model gives a value of `{signal}` that is not finite")]
    Diverged {
        /// The recording.
        record: String,
        /// The signal.
        signal: String,
    },
    /// A number that none can be.
    #[error("number `{key}`: expected {expected}")]
    Number {
        /// The number.
        key: String,
        /// Requirement on it.
        expected: String,
    },
    /// A number without a scale.
    #[error("number `{key}` is zero: expected a tolerance or a scale for it")]
    NoScale {
        /// The number.
        key: String,
    },
    /// Nothing to compare, or too little of it.
    #[error("{given} samples of training recordings, expected at least {least}")]
    TooShort {
        /// Samples.
        given: usize,
        /// Samples needed.
        least: usize,
    },
    /// No cause can be looked for.
    #[error(
        "the model has no ports and no numbers: expected a parameter `load`, `drive` or `sensor`, or numbers"
    )]
    Nothing,
    /// No command to choose from.
    #[error("no command to propose, expected at least one")]
    NoCommand,
}
