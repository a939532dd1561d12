//! Choice of the bundle that a recording is diagnosed with.

use recordings::{CommandSource, Recording};

use crate::simulation::experiment::Experiment;

/// Share by which a recording may be shorter than the test.
const LENGTH_TOLERANCE: f64 = 1e-3;
/// Time by which a recording may be shorter than the test: it ends one sample before, s.
const LAST_SAMPLE_S: f64 = 1e-3;

/// Place of the experiment whose bundle a recording is diagnosed with: the one of the recording's
/// command; without one, the longest that the recording is long enough for, else the first.
///
/// # Examples
///
/// ```
/// use fdi_core::{ColumnMap, Experiment, Recording, fitting_experiment};
///
/// let known = [&Experiment::chirp(), &Experiment::sine()];
/// let text = "# command = \"sine\"\ntime_s,current_a\n0,1\n0.1,1\n";
/// let recording = Recording::parse("r", text.as_bytes(), &ColumnMap::default())?;
/// assert_eq!(fitting_experiment(&known, &recording), 1);
/// # Ok::<_, fdi_core::RecordError>(())
/// ```
pub fn fitting_experiment(experiments: &[&Experiment], recording: &Recording) -> usize {
    if let Some(CommandSource::Named(name)) = &recording.metadata.command {
        return experiments.iter().position(|one| one.name == *name).unwrap_or(0);
    }
    let Ok(current) = recording.require_current() else { return 0 };
    let channel = current.channel();
    let length_s = match (channel.times_s().first(), channel.times_s().last()) {
        (Some(start), Some(end)) => end - start,
        _ => 0.0,
    };
    let covered_s = length_s * (1.0 + LENGTH_TOLERANCE) + LAST_SAMPLE_S;
    let duration_s = |place: &usize| experiments[*place].scenario.duration_s;
    let covered = (0..experiments.len()).filter(|place| duration_s(place) <= covered_s);
    covered.max_by(|a, b| duration_s(a).total_cmp(&duration_s(b))).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use recordings::{Channel, ChannelName, Metadata};

    use super::*;

    fn chosen(command: Option<CommandSource>, length_s: f64) -> usize {
        let values = vec![0.0; (100.0 * length_s) as usize + 1];
        let current = Channel::uniform(ChannelName::Current, 0.0, 100.0, values).unwrap();
        let metadata = Metadata { command, ..Metadata::default() };
        let recording = Recording::new("r", metadata, vec![current]).unwrap();
        let mut long = Experiment::sine();
        long.scenario.duration_s = 20.0;
        fitting_experiment(&[&Experiment::chirp(), &Experiment::sine(), &long], &recording)
    }

    #[test]
    fn the_longest_test_that_is_covered_is_taken() {
        let sine_s = Experiment::sine().scenario.duration_s;
        assert_eq!(chosen(None, 0.1), 0);
        assert_eq!(chosen(None, 0.6), 0);
        assert_eq!(chosen(None, sine_s), 1);
        assert_eq!(chosen(None, sine_s - 0.01), 0);
        assert_eq!(chosen(None, 25.0), 2);
    }

    #[test]
    fn a_command_by_name_goes_before_the_length() {
        let named = |name: &str| Some(CommandSource::Named(name.to_owned()));
        assert_eq!(chosen(named("chirp"), 25.0), 0);
        assert_eq!(chosen(named("sine"), 0.1), 1);
        assert_eq!(chosen(named("another"), 25.0), 0);
    }
}
