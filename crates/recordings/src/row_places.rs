//! Rows at other places of their clock than their stamps say, as something else in the recording shows.

use crate::{
    Channel, ClockNote, Gaps, RecordError, Recording, SharedNumbers, TakenRate,
    clock::Clock,
    evened::{at_places, can_be_bridged},
    places::Misplaced,
};

/// Places of the rows of a time axis on its clock.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RowPlaces {
    /// Place of each row, from 0, never decreasing. A row at the place of the one before is a row too
    /// many; a place without a row has lost its sample.
    pub places: Vec<usize>,
    /// Rows by which each loss may stand elsewhere, in the order of the losses.
    pub uncertain_rows: Vec<usize>,
}

impl Recording {
    /// Which rows, from 0, hold what the one before holds in every channel with the times of one.
    pub fn repeated_rows(&self, of: &Channel) -> Vec<bool> {
        let on_axis: Vec<&Channel> = self.on_axis_of(of).collect();
        let repeats = |row: usize| {
            row > 0
                && on_axis.iter().all(|channel| channel.values()[row - 1] == channel.values()[row])
        };
        (0..of.values().len()).map(repeats).collect()
    }

    /// The recording with the rows of a channel, and of all channels with its times, at the places of
    /// their clock that `command_rad` shows. Samples that lack are filled as [`Gaps::Bridge`] does.
    ///
    /// # Errors
    ///
    /// [`RecordError::CommandShowsGap`] where the recording was not read with [`Gaps::Bridge`], or has a
    /// gap that is too long to be filled.
    ///
    /// # Panics
    ///
    /// When there are not as many places as rows: a programming error.
    pub fn with_places_by_command(
        &self,
        of: &Channel,
        rows: &RowPlaces,
    ) -> Result<Self, RecordError> {
        let (times_s, rate_hz) = (of.times_s(), of.sampling()?.rate_hz);
        assert_eq!(rows.places.len(), times_s.len(), "places differ in number from rows");
        let clock = clock_at(rows, times_s[0], rate_hz);
        let on_axis = || self.on_axis_of(of);
        let can_be_bridged = on_axis().all(|channel| can_be_bridged(&clock, channel.values()));
        if self.gaps == Gaps::Refuse || !can_be_bridged {
            let first = first_row_off(&rows.places);
            return Err(RecordError::CommandShowsGap {
                line: self.line_at(times_s[first]).map(|line| line + 1),
                lost: clock.lost(),
                doubled: clock.doubled.len(),
                after_s: times_s[first],
                can_be_bridged,
            });
        }
        let count = clock.places.last().map_or(0, |last| last + 1);
        let time_s = |place: usize| clock.start_s + place as f64 / rate_hz;
        let placed_s: SharedNumbers = (0..count).map(time_s).collect();
        let channels = self.channels.iter().map(|channel| {
            if channel.times_s() == times_s {
                at_places(channel, &clock, &placed_s)
            } else {
                channel.clone()
            }
        });
        let lost_after = clock.first_gap().map(|(row, _)| times_s[row]);
        let note = ClockNote {
            channels: on_axis().map(Channel::name).collect(),
            rate_hz,
            lost: clock.lost(),
            lost_after_s: lost_after,
            doubled: clock.doubled.len(),
            late: 0,
            jitter_s: 0.0,
            taken: None,
            is_by_command: true,
        };
        let mut placed = Self { channels: channels.collect(), lines: None, ..self.clone() };
        placed.clock_notes.push(note);
        Ok(placed)
    }

    /// The recording with all times after the first of a channel multiplied, as `command_rad` shows that
    /// their clock runs.
    ///
    /// # Errors
    ///
    /// [`RecordError::TooFewSamples`] of a channel without a rate.
    pub fn with_rate_by_command(&self, of: &Channel, by: f64) -> Result<Self, RecordError> {
        let rate_hz = of.sampling()?.rate_hz;
        let mut stretched = self.clone();
        stretched.stretch_times(of.times_s()[0], by);
        let taken = TakenRate::Command(rate_hz / by);
        let channels = self.on_axis_of(of).map(Channel::name).collect();
        let note = ClockNote::of_rate(of.name(), rate_hz, taken);
        stretched.clock_notes.push(ClockNote { channels, ..note });
        Ok(stretched)
    }

    fn on_axis_of<'a>(&'a self, of: &'a Channel) -> impl Iterator<Item = &'a Channel> {
        self.channels.iter().filter(|channel| channel.times_s() == of.times_s())
    }
}

/// The clock on which rows stand at their places.
fn clock_at(rows: &RowPlaces, start_s: f64, rate_hz: f64) -> Clock {
    let mut kept: Vec<usize> = Vec::with_capacity(rows.places.len());
    let mut places: Vec<usize> = Vec::with_capacity(rows.places.len());
    let mut doubled = Vec::new();
    for (row, &place) in rows.places.iter().enumerate() {
        match (kept.last(), places.last()) {
            (Some(&before), Some(&last)) if last == place => doubled.push((before, row)),
            _ => {
                kept.push(row);
                places.push(place);
            }
        }
    }
    Clock {
        start_s,
        rate_hz,
        kept,
        places,
        doubled,
        late: 0,
        misplaced: Misplaced::One(rows.uncertain_rows.clone()),
        error_s: 0.0,
        is_jittered: false,
    }
}

/// The last row before the first that is not at the place after its own.
fn first_row_off(places: &[usize]) -> usize {
    places.windows(2).position(|pair| pair[1] != pair[0] + 1).unwrap_or(0)
}
