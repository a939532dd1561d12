//! Reasons why a recording does not fit an experiment.

use ema_sim::SimulationError;
use recordings::{RecordError, WINDING_TEMPERATURES_K};

/// Why a recording does not fit an experiment.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ObservationError {
    /// The recording lacks what a diagnosis needs.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The samples do not stand on a uniform grid.
    #[error(
        "column `{column}` is sampled irregularly: a sample is {deviation_s:.2e} s off its grid, \
         expected at most {tolerance_s:.2e} s"
    )]
    Irregular {
        /// Column.
        column: &'static str,
        /// Largest distance from the grid.
        deviation_s: f64,
        /// Distance that rounding explains.
        tolerance_s: f64,
    },
    /// A quadrature-axis current of a machine that has none.
    #[error(
        "`q_axis_current_a` is the current of a field-oriented drive, and this machine is commutated in \
         six steps: record `phase_a_current_a`, `phase_b_current_a` and `phase_c_current_a`"
    )]
    QuadratureOfSixSteps,
    /// The rate is not the bundle's.
    #[error("column `{column}` is sampled at {found_hz} Hz, expected {expected}")]
    Rate {
        /// Column.
        column: &'static str,
        /// Rate of the column.
        found_hz: f64,
        /// Rates that the bundle takes.
        expected: String,
    },
    /// The currents are of another unit than the columns say.
    #[error(
        "a tenth of `{column}` is beyond {found_a} A, and the actuator's current limit is \
         {limit_a} A: say by what it is to be multiplied (`--map {column}=COLUMN*FACTOR`, 0.001 \
         for mA)"
    )]
    BeyondLimit {
        /// Column.
        column: &'static str,
        /// Size that a tenth of the samples is beyond, A.
        found_a: f64,
        /// Current limit of the actuator's controller, A.
        limit_a: f64,
    },
    /// The winding's temperature is of another unit than the column says.
    #[error(
        "the mean of `winding_temperature_k` is {found_k:.1}, expected {} to {} K: say what is to be added \
         (`--map winding_temperature_k=COLUMN*1+273.15` for °C)",
        WINDING_TEMPERATURES_K.start(),
        WINDING_TEMPERATURES_K.end()
    )]
    TemperatureUnit {
        /// Mean of the column.
        found_k: f64,
    },
    /// The recording ends too early.
    #[error(
        "the recording has {found_s} s of `{column}`, expected {expected_s} s for the command \
         `{command}`"
    )]
    TooShort {
        /// Column.
        column: &'static str,
        /// Length of the column.
        found_s: f64,
        /// Length needed.
        expected_s: f64,
        /// Command of the bundle.
        command: String,
    },
    /// Another envelope than the bundle's.
    #[error("`current_a` is the envelope `{found}`, expected `{expected}` as the bundle has it")]
    OtherEnvelope {
        /// By the metadata.
        found: &'static str,
        /// The bundle's.
        expected: &'static str,
    },
    /// Another filter than the bundle's.
    #[error(
        "`current_a` was filtered at {found_hz} Hz, expected {expected_hz} Hz as the bundle has it"
    )]
    OtherFilter {
        /// By the metadata.
        found_hz: f64,
        /// The bundle's.
        expected_hz: f64,
    },
    /// Another command than the bundle's.
    #[error("the recording is of the command `{found}`, the bundle is for `{expected}`")]
    OtherCommand {
        /// By the metadata.
        found: String,
        /// The bundle's.
        expected: String,
    },
    /// The recording was running before a command that it does not hold.
    #[error(
        "the recording begins about {:.0} ms before the command, which only `command_rad` shows well \
         enough here: record it, or cut the recording where the command begins",
        1e3 * after_s
    )]
    StartUnknown {
        /// Time from the first sample to the command, s.
        after_s: f64,
    },
    /// The recorded command is not the bundle's.
    #[error(
        "`command_rad` is {found_rad} rad at {time_s} s, the bundle's command `{command}` \
         {expected_rad} rad"
    )]
    CommandDiffers {
        /// Recorded.
        found_rad: f64,
        /// The bundle's.
        expected_rad: f64,
        /// When they differ most.
        time_s: f64,
        /// Command of the bundle.
        command: String,
    },
    /// Phase currents without the rotor's angle, whose commutation is not the machine's.
    #[error(
        "phase currents without `motor_angle_rad`, and the commutation {seen_in} is on average \
         {deviation_deg:.0}° of electrical angle off that of the machine in this test, expected at \
         most {most_deg:.0}°: is it of this actuator and command?"
    )]
    NoRotorAngle {
        /// Where the commutation was looked for.
        seen_in: &'static str,
        /// How far it is off.
        deviation_deg: f64,
        /// How far it may be.
        most_deg: f64,
    },
    /// A sector that no Hall sensors show.
    #[error("`hall_state` is {found} at {time_s} s, expected 1 to 6")]
    HallState {
        /// Value.
        found: f64,
        /// When.
        time_s: f64,
    },
    /// A load that the machine does not hold.
    #[error(
        "the recording states a load of {load_n_m} N·m, under which the machine as new is driven away: \
         is it a torque on the surface, in N·m?"
    )]
    LoadTooLarge {
        /// By column or metadata, N·m.
        load_n_m: f64,
    },
    /// The bundle's machine cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The channels of the phases differ in their time axis.
    #[error(
        "{}columns `{column}` and `phase_a_current_a` have different time axes: at {time_s} s one \
         has a sample and the other has none",
        line.map(|line| format!("line {line}: ")).unwrap_or_default()
    )]
    TimeAxes {
        /// The column that differs.
        column: &'static str,
        /// Where they first differ, s.
        time_s: f64,
        /// The line of that sample, from 1, in a file that is text.
        line: Option<u64>,
    },
}

impl ObservationError {
    /// True where the recording is shorter than the test.
    pub(crate) fn is_too_short(&self) -> bool {
        matches!(self, Self::TooShort { .. })
    }
}
