//! One recording and the checks on it.

use crate::{
    Channel, ChannelName, ClockNote, Dialect, Gaps, Metadata, OtherColumn, RecordError, Sampling,
    SharedNumbers, StatedUnit, TakenRate, evened::Lacking, lines::Lines,
};

/// Largest number that a channel may hold, in its SI unit: a shaft that turns at 10 000 rad/s
/// for three years.
pub(crate) const MOST_PLAUSIBLE: f64 = 1e12;

/// Largest share by which a rate is taken for a round number: two clocks of quartz, each within the
/// 100 ppm that cheap ones are sold with.
const ROUND_WITHIN: f64 = 2e-4;
/// Digits of round numbers after their first.
const ROUND_DIGITS: usize = 1;

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
    pub(crate) computed_phase: Option<ChannelName>,
    /// How samples that lack are treated, for what is only found out later.
    pub(crate) gaps: Gaps,
}

/// The current that a recording offers for diagnosis.
#[derive(Clone, Copy, Debug)]
pub enum Current<'a> {
    /// The three phase currents, A.
    Phases([&'a Channel; 3]),
    /// The envelope that the metadata name, A.
    Envelope(&'a Channel),
    /// The quadrature-axis current of a field-oriented drive, A.
    Quadrature(&'a Channel),
}

impl<'a> Current<'a> {
    /// The channel whose times are those of the current: of phases the first.
    pub fn channel(&self) -> &'a Channel {
        match self {
            Self::Phases([channel, ..]) | Self::Envelope(channel) | Self::Quadrature(channel) => {
                channel
            }
        }
    }
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
            computed_phase: None,
            gaps: Gaps::Refuse,
        })
    }

    /// The channel of that name, where the recording has it.
    pub fn channel(&self, name: ChannelName) -> Option<&Channel> {
        self.channels.iter().find(|channel| channel.name() == name)
    }

    /// The recording without the samples before a time, s. Channels that have none since are left
    /// out; columns that are no channel stay whole.
    ///
    /// # Examples
    ///
    /// ```
    /// use recordings::{ColumnMap, Recording};
    ///
    /// let text = "time_s,current_a\n-0.1,0\n0,1\n0.1,2\n";
    /// let whole = Recording::parse("r", text.as_bytes(), &ColumnMap::default())?;
    /// assert_eq!(whole.since(-0.05).channels()[0].values(), [1.0, 2.0]);
    /// # Ok::<_, recordings::RecordError>(())
    /// ```
    #[must_use]
    pub fn since(&self, start_s: f64) -> Self {
        let channels = self.channels.iter().filter_map(|channel| channel.since(start_s)).collect();
        Self { channels, ..self.clone() }
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

    /// The phase whose current is not recorded and follows from the two others.
    pub fn computed_phase(&self) -> Option<ChannelName> {
        self.computed_phase
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
            let lacking = Lacking::first(&clock, times_s, channel.values());
            return lacking.map_or(Ok(()), |lacking| {
                let line = self.line_at(times_s[lacking.before]).map(|line| line + 1);
                Err(lacking.error(channel.name(), line))
            });
        }
        let step = |pair: &[f64]| pair[1] - pair[0];
        let mut steps: Vec<f64> = times_s.windows(2).map(step).collect();
        let middle = steps.len() / 2;
        let median_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let longest_s = 1.5 * median_s + 2.0 * sampling.tolerance_s;
        let Some(before) = times_s.windows(2).position(|pair| step(pair) > longest_s) else {
            return Ok(());
        };
        let lacking = Lacking::between(times_s, before, median_s);
        let line = self.line_at(times_s[before]).map(|line| line + 1);
        Err(lacking.error(channel.name(), line))
    }

    /// The current to diagnose from: the three phases where all are there, else the envelope, else
    /// the quadrature-axis current.
    ///
    /// # Errors
    /// [`RecordError::PhaseMissing`] when some phases but not all are there and
    /// no envelope is, [`RecordError::NoCurrent`] when nothing is.
    pub fn require_current(&self) -> Result<Current<'_>, RecordError> {
        use ChannelName::{
            Current as Envelope, PhaseACurrent, PhaseBCurrent, PhaseCCurrent, QAxisCurrent,
        };
        let names = [PhaseACurrent, PhaseBCurrent, PhaseCCurrent];
        let phases = names.map(|name| self.channel(name));
        if let [Some(a), Some(b), Some(c)] = phases {
            return Ok(Current::Phases([a, b, c]));
        }
        if let Some(envelope) = self.channel(Envelope) {
            return Ok(Current::Envelope(envelope));
        }
        if let Some(quadrature) = self.channel(QAxisCurrent) {
            return Ok(Current::Quadrature(quadrature));
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
    /// stated rate. Without one they become those of a round rate that is as near as clocks are.
    pub(crate) fn settle_rate(&mut self) -> Result<(), RecordError> {
        // a drive stamps its own current by the clock that its command comes from
        let Ok(current @ (Current::Phases(_) | Current::Envelope(_))) = self.require_current()
        else {
            return Ok(());
        };
        let channel = current.channel();
        let Ok(sampling) = channel.sampling() else { return Ok(()) };
        let found_hz = sampling.rate_hz;
        let stated_hz = self.metadata.rate_hz;
        let taken = stated_hz.map_or_else(|| TakenRate::Round(round(found_hz)), TakenRate::Stated);
        let taken_hz = taken.hz();
        if let Some(stated_hz) = stated_hz
            && !sampling.agrees_with(stated_hz)
        {
            self.require_no_gap(channel)?;
            let channel = channel.name();
            return Err(RecordError::RateContradiction { stated_hz, found_hz, channel });
        }
        let is_near = stated_hz.is_some() || (found_hz / taken_hz - 1.0).abs() <= ROUND_WITHIN;
        let is_off = (found_hz - taken_hz).abs() > sampling.rate_tolerance_hz;
        // of two rates that the stamps allow, the stated one is right, and the rounder one was found
        let is_finer = stated_hz.is_some_and(|stated_hz| stated_hz != found_hz);
        if is_near && (is_off || is_finer) && self.require_no_gap(channel).is_ok() {
            let (name, start_s) = (channel.name(), channel.times_s()[0]);
            self.stretch_times(start_s, found_hz / taken_hz);
            if is_off {
                self.clock_notes.push(ClockNote::of_rate(name, found_hz, taken));
            }
        }
        Ok(())
    }

    /// Multiplies the times after a start. Those of even samples lose the rounding of their stamps.
    pub(crate) fn stretch_times(&mut self, start_s: f64, by: f64) {
        let mut made: Vec<(SharedNumbers, SharedNumbers)> = Vec::new();
        for channel in &mut self.channels {
            let own_s = channel.shared_times_s();
            let even = channel.sampling().ok().filter(Sampling::is_uniform);
            let later_s = |time_s: f64| start_s + (time_s - start_s) * by;
            let shared = made.iter().find(|(from, _)| from.as_ptr() == own_s.as_ptr());
            let times_s = match (shared, &even) {
                (Some((_, stretched)), _) => SharedNumbers::clone(stretched),
                (None, Some(even)) => {
                    let (first_s, period_s) = (later_s(own_s[0]), by / even.rate_hz);
                    (0..own_s.len()).map(|n| first_s + n as f64 * period_s).collect()
                }
                (None, None) => own_s.iter().copied().map(later_s).collect(),
            };
            made.push((own_s, times_s.clone()));
            channel.take_times(times_s, even.is_some());
        }
    }
}

/// The round number nearest to a rate.
fn round(rate_hz: f64) -> f64 {
    format!("{rate_hz:.ROUND_DIGITS$e}").parse().unwrap_or(rate_hz)
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
             `phase_c_current_a`, or `current_a`, or `q_axis_current_a` of a field-oriented drive; the columns are `load_n_m`, `amps` \
             (`--map current_a=COLUMN[*FACTOR]` names one)",
        );
        let one = parse("time_s,phase_a_current_a\n0,1\n");
        assert_same(
            &one.require_current().unwrap_err().to_string(),
            "`phase_a_current_a` without `phase_b_current_a`, `phase_c_current_a`: the envelope \
             needs all three, or two on the same times",
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

    #[test]
    fn a_rate_beside_a_round_one_is_taken_for_it_unless_it_is_stated() {
        let rows = |rate_hz: f64| -> String {
            let row = |row: i32| format!("{:.9},1\n", f64::from(row) / rate_hz);
            (0..500).map(row).collect::<Vec<_>>().concat()
        };
        let read = |head: &str, rate_hz: f64| {
            let recording = parse(&format!("{head}time_s,current_a\n{}", rows(rate_hz)));
            let rate_hz = recording.channels()[0].sampling().unwrap().rate_hz;
            (rate_hz, recording.clock_notes().iter().map(|note| note.taken).collect::<Vec<_>>())
        };
        assert_eq!(read("", 10_000.0), (10_000.0, vec![]));
        assert_eq!(read("", 9999.0), (10_000.0, vec![Some(TakenRate::Round(10_000.0))]));
        assert_eq!(read("# rate-hz = 9999\n", 9999.0), (9999.0, vec![]));
        let stated = vec![Some(TakenRate::Stated(10_000.0))];
        assert_eq!(read("# rate-hz = 10000\n", 9999.0), (10_000.0, stated));
        assert_eq!(read("", 9990.0), (9990.0, vec![]));
    }
}
