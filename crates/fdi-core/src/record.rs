//! Recordings of an actuator: channels with their own time axes, and metadata.
//!
//! The format is CSV (`docs/formats.md`); this module is the only reader of
//! measured data in the workspace.

mod channel;
mod column_map;
mod csv;
mod error;
mod guess;
mod metadata;
mod nearest;
mod sampling;
mod source;
mod writer;

pub use channel::{Channel, ChannelKind, ChannelName, OtherColumn};
pub use column_map::{ColumnMap, ColumnMapError};
pub use error::RecordError;
pub use guess::{ColumnGuess, guess_columns};
pub(crate) use metadata::KEY_TABLE;
pub use metadata::{CommandSource, EnvelopeKind, Metadata, RecordingDate};
pub use nearest::nearest;
pub use sampling::Sampling;
pub use source::list_recordings;
pub use writer::{CsvFormat, WriteError};

use std::path::Path;

/// One recording: named channels, each with its own time axis, and metadata.
///
/// Every value is finite, every time axis strictly increasing, no channel is
/// empty and none appears twice.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What to call it in answers: the path as it was given.
    pub name: String,
    /// What the file says of itself.
    pub metadata: Metadata,
    channels: Vec<Channel>,
    other_columns: Vec<OtherColumn>,
}

/// The current that a recording offers for diagnosis.
#[derive(Clone, Copy, Debug)]
pub enum Current<'a> {
    /// The three phase currents, A.
    Phases([&'a Channel; 3]),
    /// The envelope that the metadata name, A.
    Envelope(&'a Channel),
}

impl Recording {
    /// A recording made in memory.
    ///
    /// # Errors
    /// [`RecordError::DuplicateChannel`] when two channels have one name.
    pub fn new(
        name: impl Into<String>,
        metadata: Metadata,
        channels: Vec<Channel>,
    ) -> Result<Self, RecordError> {
        for (index, channel) in channels.iter().enumerate() {
            if channels[..index].iter().any(|earlier| earlier.name() == channel.name()) {
                return Err(RecordError::DuplicateChannel { channel: channel.name() });
            }
        }
        Ok(Self { name: name.into(), metadata, channels, other_columns: Vec::new() })
    }

    /// Reads a `.csv` or `.csv.gz` file; its [`name`](Self::name) is the path.
    ///
    /// # Errors
    /// Any [`RecordError`] but those of the `require_…` checks. The message does
    /// not repeat the path, which the caller knows.
    pub fn read(path: &Path, map: &ColumnMap) -> Result<Self, RecordError> {
        let bytes = source::read_bytes(path)?;
        Self::parse(path.display().to_string(), &bytes, map)
    }

    /// Reads the text of a recording, not compressed.
    ///
    /// # Errors
    /// As [`read`](Self::read), without those of the file itself.
    pub fn parse(
        name: impl Into<String>,
        bytes: &[u8],
        map: &ColumnMap,
    ) -> Result<Self, RecordError> {
        csv::parse(name.into(), bytes, map)
    }

    /// The channel of that name, where the recording has it.
    pub fn channel(&self, name: ChannelName) -> Option<&Channel> {
        self.channels.iter().find(|channel| channel.name() == name)
    }

    /// All known channels, in the order of the file.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Columns of the file that are no channel: kept, and ignored.
    pub fn other_columns(&self) -> &[OtherColumn] {
        &self.other_columns
    }

    /// The current to diagnose from: the three phases where all are there, else
    /// the envelope.
    ///
    /// # Errors
    /// [`RecordError::PhaseMissing`] when some phases but not all are there and
    /// no envelope is, [`RecordError::NoCurrent`] when nothing is.
    pub fn require_current(&self) -> Result<Current<'_>, RecordError> {
        use ChannelName::{Current as Envelope, PhaseACurrent, PhaseBCurrent, PhaseCCurrent};
        let names = [PhaseACurrent, PhaseBCurrent, PhaseCCurrent];
        let phases = names.map(|name| self.channel(name));
        if let [Some(a), Some(b), Some(c)] = phases {
            return Ok(Current::Phases([a, b, c]));
        }
        if let Some(envelope) = self.channel(Envelope) {
            return Ok(Current::Envelope(envelope));
        }
        if phases.iter().all(Option::is_none) {
            return Err(RecordError::NoCurrent { columns: self.column_names() });
        }
        let of = |present: bool| {
            let chosen = names.iter().zip(&phases).filter(|(_, phase)| phase.is_some() == present);
            chosen.map(|(name, _)| *name).collect()
        };
        Err(RecordError::PhaseMissing { found: of(true), missing: of(false) })
    }

    /// Names of all columns but time, as the file spells them after mapping.
    fn column_names(&self) -> Vec<String> {
        let known = self.channels.iter().map(|channel| channel.name().column().to_owned());
        known.chain(self.other_columns.iter().map(|column| column.name().to_owned())).collect()
    }

    /// Refuses a `rate-hz` that the time axis of the current contradicts.
    fn check_stated_rate(&self) -> Result<(), RecordError> {
        let Some(stated_hz) = self.metadata.rate_hz else { return Ok(()) };
        let Ok(current) = self.require_current() else { return Ok(()) };
        let channel = match current {
            Current::Phases([a, ..]) => a,
            Current::Envelope(envelope) => envelope,
        };
        let Ok(sampling) = channel.sampling() else { return Ok(()) };
        if sampling.agrees_with(stated_hz) {
            return Ok(());
        }
        Err(RecordError::RateContradiction {
            stated_hz,
            found_hz: sampling.rate_hz,
            channel: channel.name(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Recording {
        Recording::parse("r.csv", text.as_bytes(), &ColumnMap::default()).unwrap()
    }

    #[test]
    fn phases_are_preferred_to_the_envelope() {
        let all = parse(
            "time_s,current_a,phase_a_current_a,phase_b_current_a,phase_c_current_a\n0,1,2,3,4\n",
        );
        let Current::Phases([a, _, c]) = all.require_current().unwrap() else { panic!("phases") };
        assert_eq!((a.values()[0], c.values()[0]), (2.0, 4.0));
        let one = parse("time_s,current_a,phase_a_current_a\n0,1,2\n");
        assert!(matches!(one.require_current().unwrap(), Current::Envelope(_)));
    }

    #[test]
    fn missing_current_names_what_is_there() {
        let none = parse("time_s,load_n_m,amps\n0,1,2\n");
        assert_same(
            &none.require_current().unwrap_err().to_string(),
            "no current channel: expected `phase_a_current_a`, `phase_b_current_a` and \
             `phase_c_current_a`, or `current_a`; the columns are `load_n_m`, `amps` \
             (`--map current_a=COLUMN` names one)",
        );
        let two = parse("time_s,phase_a_current_a,phase_c_current_a\n0,1,2\n");
        assert_same(
            &two.require_current().unwrap_err().to_string(),
            "`phase_a_current_a`, `phase_c_current_a` without `phase_b_current_a`: \
             the envelope needs all three",
        );
    }

    fn assert_same(got: &str, want: &str) {
        assert_eq!(got, want);
    }

    #[test]
    fn a_stated_rate_must_be_the_one_of_the_time_axis() {
        let text = "# rate-hz = 4800\ntime_s,current_a\n0,1\n0.0005,1\n0.001,1\n";
        let error = Recording::parse("r", text.as_bytes(), &ColumnMap::default()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "metadata say `rate-hz` 4800, the times of `current_a` are at 2000 Hz"
        );
    }
}
