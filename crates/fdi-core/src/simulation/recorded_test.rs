//! A test from a recording of its command.

use recordings::{Channel, ChannelName, RecordError, Recording};

use crate::simulation::experiment::Experiment;

/// Why a recording does not say what was commanded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordedTestError {
    /// No command in it.
    #[error("no column `command_rad`, which holds the command")]
    NoCommand,
    /// Neither command of a servo axis in it.
    #[error("no column `{position}` or `{speed}`, which hold the command of a servo axis")]
    NoAxisCommand {
        /// Column of a commanded position.
        position: &'static str,
        /// Column of a commanded speed.
        speed: &'static str,
    },
    /// Samples that do not stand on a uniform grid.
    #[error(
        "`{column}` is sampled irregularly: a sample is {deviation_s:.2e} s off its grid, \
         expected at most {tolerance_s:.2e} s"
    )]
    Irregular {
        /// The command's column.
        column: &'static str,
        /// Largest distance from the grid.
        deviation_s: f64,
        /// Distance that rounding explains.
        tolerance_s: f64,
    },
    /// A load that changes.
    #[error(
        "`load_n_m` runs from {least_n_m} to {greatest_n_m} N·m, expected one value: the load of \
         a simulated test is constant"
    )]
    VaryingLoad {
        /// Least value.
        least_n_m: f64,
        /// Greatest value.
        greatest_n_m: f64,
    },
    /// The time axis has no rate.
    #[error(transparent)]
    Record(#[from] RecordError),
}

impl Experiment {
    /// The test that a recording is of: its `command_rad` from the first sample on, under its
    /// `load_n_m`, else the `load-n-m` of its metadata, without which there is none.
    ///
    /// # Errors
    ///
    /// [`RecordedTestError`].
    pub fn of_recording(recording: &Recording) -> Result<Self, RecordedTestError> {
        let channel = recording.channel(ChannelName::Command);
        let channel = channel.ok_or(RecordedTestError::NoCommand)?;
        let mut experiment = Self::recorded(channel.values().to_vec(), even_rate_hz(channel)?);
        if let Some(load) = recording.channel(ChannelName::Load) {
            experiment.scenario.load_n_m = constant_n_m(load)?;
        } else if let Some(load_n_m) = recording.metadata.load_n_m {
            experiment.scenario.load_n_m = load_n_m;
        }
        Ok(experiment)
    }
}

/// The rate of a command.
pub(crate) fn even_rate_hz(channel: &Channel) -> Result<f64, RecordedTestError> {
    let sampling = channel.sampling()?;
    if sampling.is_uniform() {
        return Ok(sampling.rate_hz);
    }
    let (deviation_s, tolerance_s) = (sampling.deviation_s, sampling.tolerance_s);
    let column = channel.name().column();
    Err(RecordedTestError::Irregular { column, deviation_s, tolerance_s })
}

/// The one value of a load.
fn constant_n_m(load: &Channel) -> Result<f64, RecordedTestError> {
    let least_n_m = load.values().iter().copied().fold(f64::INFINITY, f64::min);
    let greatest_n_m = load.values().iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if least_n_m == greatest_n_m {
        Ok(least_n_m)
    } else {
        Err(RecordedTestError::VaryingLoad { least_n_m, greatest_n_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use recordings::ColumnMap;

    fn of_text(text: &str) -> Result<Experiment, String> {
        let recording = Recording::parse("r", text.as_bytes(), &ColumnMap::default()).unwrap();
        Experiment::of_recording(&recording).map_err(|error| error.to_string())
    }

    #[test]
    fn command_and_load_are_taken_over() {
        let text = "time_s,command_rad,load_n_m\n2.0,0.01,1.5\n2.1,0.02,\n2.2,0.03,1.5\n";
        let scenario = of_text(text).unwrap().scenario;
        assert_eq!((scenario.load_n_m, scenario.duration_s), (1.5, 0.3));
        assert_eq!([0.0, 0.1].map(|time_s| scenario.command.at(time_s)), [0.01, 0.02]);
        let scenario = of_text("time_s,command_rad\n0,0\n0.1,0\n").unwrap().scenario;
        assert_eq!(scenario.load_n_m, 0.0);
    }

    #[test]
    fn what_says_no_command_is_refused() {
        let cases = [
            ("time_s,load_n_m\n0,1\n0.1,1\n", "no column `command_rad`"),
            ("time_s,command_rad\n0.0,1\n0.1,1\n0.5,1\n", "sampled irregularly"),
            (
                "time_s,command_rad,load_n_m\n0.0,1,2\n0.1,1,3\n",
                "`load_n_m` runs from 2 to 3 N·m, expected one value",
            ),
        ];
        for (text, expected) in cases {
            let error = of_text(text).unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
    }
}
