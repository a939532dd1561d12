//! One recording and the checks on it.

use crate::{
    Channel, ChannelName, ClockNote, Dialect, Metadata, OtherColumn, RecordError, SharedNumbers,
    StatedUnit, evened::can_be_bridged, lines::Lines,
};

/// Largest number that a channel may hold, in its SI unit: a shaft that turns at 10 000 rad/s
/// for three years.
pub(crate) const MOST_PLAUSIBLE: f64 = 1e12;

/// One recording: named channels, each with its own time axis, and metadata.
///
/// Every value is finite, every time axis strictly increasing, no channel is
/// empty and none appears twice.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Name in answers: the path as it was given.
    pub name: String,
    /// Metadata that the file states.
    pub metadata: Metadata,
    pub(crate) channels: Vec<Channel>,
    pub(crate) other_columns: Vec<OtherColumn>,
    /// Where the rows stand in a text.
    pub(crate) lines: Option<Lines>,
    pub(crate) stated_units: Vec<StatedUnit>,
    pub(crate) clock_notes: Vec<ClockNote>,
    pub(crate) dialect: Option<Dialect>,
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
        Ok(Self {
            name: name.into(),
            metadata,
            channels,
            other_columns: Vec::new(),
            lines: None,
            stated_units: Vec::new(),
            clock_notes: Vec::new(),
            dialect: None,
        })
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

    /// Columns whose file states a unit that is not the SI unit of their channel, and what
    /// they were multiplied by.
    pub fn stated_units(&self) -> &[StatedUnit] {
        &self.stated_units
    }

    /// How a text writes its table, where it is not as this crate would.
    pub fn dialect(&self) -> Option<&Dialect> {
        self.dialect.as_ref()
    }

    /// Time axes that were brought onto an even clock, and what was done for it.
    pub fn clock_notes(&self) -> &[ClockNote] {
        &self.clock_notes
    }

    /// The line, from 1, that the samples at this time stand on; `None` where the recording
    /// is no text or has no such row.
    pub fn line_at(&self, time_s: f64) -> Option<u64> {
        self.lines.as_ref()?.of(time_s)
    }

    /// Refuses a channel that lacks samples between others.
    ///
    /// # Errors
    /// [`RecordError::Gap`] at the first place of the channel's clock that has no sample; without
    /// a clock, at the first step that is longer than the median one by half of it and by more than
    /// the rounding of the times explains.
    pub fn require_no_gap(&self, channel: &Channel) -> Result<(), RecordError> {
        let Ok(sampling) = channel.sampling() else { return Ok(()) };
        if sampling.shows_each_sample() {
            return Ok(());
        }
        let times_s = channel.times_s();
        if let Some(clock) = channel.clock() {
            let Some((before, _)) = clock.first_gap() else { return Ok(()) };
            let can_be_bridged = can_be_bridged(&clock, channel.values());
            return Err(self.gap(channel, before, clock.rate_hz.recip(), can_be_bridged));
        }
        let step = |pair: &[f64]| pair[1] - pair[0];
        let mut steps: Vec<f64> = times_s.windows(2).map(step).collect();
        let middle = steps.len() / 2;
        let median_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let longest_s = 1.5 * median_s + 2.0 * sampling.tolerance_s;
        match times_s.windows(2).position(|pair| step(pair) > longest_s) {
            Some(before) => Err(self.gap(channel, before, median_s, false)),
            None => Ok(()),
        }
    }

    /// The error of a gap after a sample.
    fn gap(
        &self,
        channel: &Channel,
        before: usize,
        step_s: f64,
        can_be_bridged: bool,
    ) -> RecordError {
        let [after_s, next_s] = [channel.times_s()[before], channel.times_s()[before + 1]];
        RecordError::Gap {
            line: self.line_at(after_s).map(|line| line + 1),
            channel: channel.name(),
            after_s,
            next_s,
            // as the times are written, not as they are computed
            step_s: (step_s * 1e9).round() / 1e9,
            can_be_bridged,
        }
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

    /// Refuses a `rate-hz` that the time axis of the current contradicts. Where the two differ by
    /// less, the stamps are of a clock that runs a little fast or slow: times become those of the
    /// stated rate.
    pub(crate) fn settle_stated_rate(&mut self) -> Result<(), RecordError> {
        let Some(stated_hz) = self.metadata.rate_hz else { return Ok(()) };
        let Ok(current) = self.require_current() else { return Ok(()) };
        let channel = match current {
            Current::Phases([a, ..]) => a,
            Current::Envelope(envelope) => envelope,
        };
        let Ok(sampling) = channel.sampling() else { return Ok(()) };
        let found_hz = sampling.rate_hz;
        if !sampling.agrees_with(stated_hz) {
            self.require_no_gap(channel)?;
            let channel = channel.name();
            return Err(RecordError::RateContradiction { stated_hz, found_hz, channel });
        }
        let is_off = (found_hz - stated_hz).abs() > sampling.rate_tolerance_hz;
        if is_off && self.require_no_gap(channel).is_ok() {
            let (name, start_s) = (channel.name(), channel.times_s()[0]);
            self.stretch_times(start_s, found_hz / stated_hz);
            self.clock_notes.push(ClockNote::of_stated_rate(name, found_hz, stated_hz));
        }
        Ok(())
    }

    /// Multiplies the times after a start.
    fn stretch_times(&mut self, start_s: f64, by: f64) {
        let mut made: Vec<(SharedNumbers, SharedNumbers)> = Vec::new();
        for channel in &mut self.channels {
            let own_s = channel.shared_times_s();
            let shared = made.iter().find(|(from, _)| from.as_ptr() == own_s.as_ptr());
            let times_s = shared.map_or_else(
                || own_s.iter().map(|time_s| start_s + (time_s - start_s) * by).collect(),
                |(_, stretched)| SharedNumbers::clone(stretched),
            );
            made.push((own_s, times_s.clone()));
            channel.take_times(times_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ColumnMap;

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
    fn gaps_are_named_with_their_line() {
        let rows: Vec<String> = (0..20).map(|i| format!("{:.6},1\n", f64::from(i) / 1e4)).collect();
        let whole = rows.concat();
        let gap = |text: String| {
            let text = format!("# rate-hz = 10000\ntime_s,current_a\n{text}");
            Recording::parse("r", text.as_bytes(), &ColumnMap::default()).map(|_| ())
        };
        assert!(gap(whole.clone()).is_ok());
        let empty = gap(whole.replace("0.000700,1", "0.000700,")).unwrap_err().to_string();
        assert_same(
            &empty,
            "line 10: no sample of `current_a` between 0.0006 s and 0.0008 s; the others are \
             0.0001 s apart",
        );
        let missing = gap(whole.replace("0.000700,1\n0.000800,1\n", "")).unwrap_err().to_string();
        assert!(
            missing.starts_with("line 10: no sample of `current_a` between 0.0006 s and 0.0009")
        );
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
