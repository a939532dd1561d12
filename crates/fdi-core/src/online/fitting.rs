//! Choice of the bundle that a recording is diagnosed with.

use ema_sim::{FAULT_COUNT, FaultCoordinates};
use recordings::{CommandSource, Recording};

use crate::{online::observation::Observation, simulation::experiment::Experiment};

/// Share by which a recording may be shorter than the test.
const LENGTH_TOLERANCE: f64 = 1e-3;
/// Time by which a recording may be shorter than the test: it ends one sample before, s.
const LAST_SAMPLE_S: f64 = 1e-3;

/// Place of the experiment whose bundle a recording is diagnosed with.
///
/// The experiment is the one of the command that the metadata name. Without a name it is one that the
/// recording is long enough for: of several, the one whose machine as new leaves least of the current
///
/// ```text
/// |y − y_LF|² / |y|²        y the filtered envelope over the length of the test
/// ```
///
/// A recorded command has to be that of the experiment. Where none fits, the choice is the first of
/// those named or the longest of those covered, else the first.
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
    let candidates = candidates(experiments, recording);
    if let [] | [_] = candidates[..] {
        return candidates.first().copied().unwrap_or(0);
    }
    let left = candidates.iter().filter_map(|&place| {
        let share = share_left(experiments[place], recording)?;
        Some((place, share))
    });
    let nearest = left.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(place, _)| place);
    nearest.or(candidates.first().copied()).unwrap_or(0)
}

/// Experiments of the command that the metadata name, else those that the recording is long enough
/// for, the longest first.
fn candidates(experiments: &[&Experiment], recording: &Recording) -> Vec<usize> {
    let places = 0..experiments.len();
    if let Some(CommandSource::Named(name)) = &recording.metadata.command {
        return places.filter(|&place| experiments[place].name == *name).collect();
    }
    let Ok(current) = recording.require_current() else { return Vec::new() };
    let channel = current.channel();
    let length_s = match (channel.times_s().first(), channel.times_s().last()) {
        (Some(start), Some(end)) => end - start,
        _ => 0.0,
    };
    let covered_s = length_s * (1.0 + LENGTH_TOLERANCE) + LAST_SAMPLE_S;
    let duration_s = |place: usize| experiments[place].scenario.duration_s;
    let mut covered: Vec<usize> = places.filter(|&place| duration_s(place) <= covered_s).collect();
    covered.sort_by(|&a, &b| duration_s(b).total_cmp(&duration_s(a)));
    covered
}

/// Share of a recording's current that the machine of an experiment as new leaves; `None` where the
/// recording is not of the experiment.
fn share_left(experiment: &Experiment, recording: &Recording) -> Option<f64> {
    let observed = Observation::of(recording, experiment, 0.0).ok()?;
    let start_angle_rad = observed.start_angle_rad.unwrap_or(experiment.scenario.start_angle_rad);
    let as_new = FaultCoordinates([0.0; FAULT_COUNT]);
    let expected_a = experiment.monitor(start_angle_rad).ok()?.signal(&as_new);
    let square = |value: f64| value * value;
    let all: f64 = observed.signal_a.iter().copied().map(square).sum();
    let pairs = observed.signal_a.iter().zip(&expected_a);
    let left: f64 = pairs.map(|(found_a, expected_a)| square(found_a - expected_a)).sum();
    let share = left / all;
    share.is_finite().then_some(share)
}

#[cfg(test)]
mod tests {
    use ema_sim::{HealthState, Imperfections, PhaseSensors};
    use recordings::{Channel, ChannelName, Metadata};

    use super::*;
    use crate::{RecordedContent, SimulatedRecording};

    /// A recording of a worn machine that does not name its test.
    fn nameless(test: &Experiment) -> Recording {
        let simulated = SimulatedRecording {
            faults: HealthState::new([0.03, 0.02, 0.03, 0.0, 0.02, 0.03, 0.4])
                .unwrap()
                .coordinates(),
            start_angle_rad: 0.0,
            imperfections: Imperfections::REAL,
            controller_seed: 1,
            sensors: PhaseSensors { noise_a: 0.02, converter: None },
            phase_rate_hz: None,
            sensor_seed: 1,
            content: RecordedContent::Phases,
            has_voltage: false,
        };
        let mut recording = simulated.record(test, "r").unwrap();
        recording.metadata.command = None;
        recording
    }

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
    fn the_longest_test_that_is_covered_is_taken_where_none_fits() {
        let sine_s = Experiment::sine().scenario.duration_s;
        assert_eq!(chosen(None, 0.1), 0);
        assert_eq!(chosen(None, 0.6), 0);
        assert_eq!(chosen(None, sine_s), 1);
        assert_eq!(chosen(None, sine_s - 0.01), 0);
        assert_eq!(chosen(None, 25.0), 2);
    }

    #[test]
    fn the_current_tells_the_test_where_several_are_covered() {
        let [chirp, sine, planned] =
            ["chirp", "sine", "planned"].map(|name| Experiment::named(name).unwrap());
        let known = [&chirp, &sine, &planned];
        assert_eq!(fitting_experiment(&known, &nameless(&planned)), 2);
        let mut with_rest = chirp.clone();
        with_rest.scenario.duration_s = 4.0;
        assert_eq!(fitting_experiment(&known, &nameless(&with_rest)), 0);
        // anti-test: by length alone it would be the longest that is covered
        assert!(planned.scenario.duration_s < with_rest.scenario.duration_s);
    }

    #[test]
    fn a_recorded_command_has_to_be_that_of_the_test() {
        let planned = Experiment::planned();
        let mut other = planned.clone();
        if let ema_sim::Command::Recorded { values_rad, .. } = &mut other.scenario.command {
            for value in values_rad {
                *value *= 0.97;
            }
        }
        for (first, second, place) in [(&planned, &other, 0), (&other, &planned, 1)] {
            let recording = nameless(&planned);
            let times_s = recording.channels()[0].times_s();
            let values = times_s.iter().map(|&t| planned.scenario.command.at(t)).collect();
            let command = Channel::uniform(ChannelName::Command, 0.0, 10_000.0, values).unwrap();
            let channels = [recording.channels().to_vec(), vec![command]].concat();
            let recording = Recording::new("r", recording.metadata.clone(), channels).unwrap();
            assert_eq!(fitting_experiment(&[first, second], &recording), place);
        }
    }

    #[test]
    fn a_command_by_name_goes_before_the_length() {
        let named = |name: &str| Some(CommandSource::Named(name.to_owned()));
        assert_eq!(chosen(named("chirp"), 25.0), 0);
        assert_eq!(chosen(named("sine"), 0.1), 1);
        assert_eq!(chosen(named("another"), 25.0), 0);
    }
}
