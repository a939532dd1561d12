//! Channels of a recording: samples with times.

use crate::{
    ChannelName, RecordError, Sampling, SharedNumbers, clock::Clock, kernel::Nodes,
    row_choice::choice_of,
};

/// The samples of one channel.
///
/// Never empty; values finite; times finite and strictly increasing.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    name: ChannelName,
    times_s: SharedNumbers,
    values: SharedNumbers,
    time_quantum_s: f64,
    resampling_error: f64,
    /// Times of the samples that the values were made of, where these were off the clock, s.
    taken_s: Option<SharedNumbers>,
}

impl Channel {
    /// A channel sampled at the given times.
    ///
    /// # Errors
    /// [`RecordError::ChannelLength`], [`RecordError::ChannelEmpty`],
    /// [`RecordError::ChannelNotFinite`] or [`RecordError::ChannelTime`].
    pub fn new(name: ChannelName, times_s: &[f64], values: Vec<f64>) -> Result<Self, RecordError> {
        if times_s.len() != values.len() {
            let (times, values) = (times_s.len(), values.len());
            return Err(RecordError::ChannelLength { channel: name, times, values });
        }
        if values.is_empty() {
            return Err(RecordError::ChannelEmpty { channel: name });
        }
        let finite = |(time_s, value): (&f64, &f64)| time_s.is_finite() && value.is_finite();
        if let Some(index) = times_s.iter().zip(values.iter()).position(|pair| !finite(pair)) {
            return Err(RecordError::ChannelNotFinite { channel: name, index, is_lacking: false });
        }
        if let Some(index) = times_s.windows(2).position(|pair| pair[1] <= pair[0]) {
            return Err(RecordError::ChannelTime {
                channel: name,
                index: index + 1,
                can_be_bridged: false,
                begins_again: false,
                rows_before: None,
            });
        }
        Ok(Self::from_rows(name, times_s.into(), values.into(), 0.0))
    }

    /// A channel sampled at a fixed rate: sample `i` is at `start_s + i / rate_hz`.
    ///
    /// # Errors
    /// As [`new`](Self::new); a rate that is not positive gives
    /// [`RecordError::ChannelTime`] or [`RecordError::ChannelNotFinite`].
    pub fn uniform(
        name: ChannelName,
        start_s: f64,
        rate_hz: f64,
        values: Vec<f64>,
    ) -> Result<Self, RecordError> {
        let times_s: Vec<f64> =
            (0..values.len()).map(|index| start_s + index as f64 / rate_hz).collect();
        Self::new(name, &times_s, values)
    }

    /// As read from a file that was checked line by line.
    pub(super) fn from_rows(
        name: ChannelName,
        times_s: SharedNumbers,
        values: SharedNumbers,
        time_quantum_s: f64,
    ) -> Self {
        debug_assert_eq!(times_s.len(), values.len());
        Self { name, times_s, values, time_quantum_s, resampling_error: 0.0, taken_s: None }
    }

    /// As brought onto the places of its clock, with the times of samples that stood beside them.
    pub(super) fn resampled(
        name: ChannelName,
        times_s: SharedNumbers,
        values: SharedNumbers,
        resampling_error: f64,
        taken_s: Option<SharedNumbers>,
    ) -> Self {
        Self { resampling_error, taken_s, ..Self::from_rows(name, times_s, values, 0.0) }
    }

    /// The current of a star's phase by those of the others, which have the same times; their errors
    /// are independent.
    pub(super) fn third_of_star(name: ChannelName, one: &Self, two: &Self) -> Self {
        let pairs = one.values.iter().zip(two.values.iter());
        Self {
            name,
            values: pairs.map(|(one, two)| -(one + two)).collect(),
            resampling_error: one.resampling_error.hypot(two.resampling_error),
            ..one.clone()
        }
    }

    /// Puts as many increasing times in place of its own, which are exact or rounded as its own were.
    pub(super) fn take_times(&mut self, times_s: SharedNumbers, are_exact: bool) {
        debug_assert_eq!(times_s.len(), self.values.len());
        if let Some(taken_s) = &self.taken_s {
            let [own, other] = [&self.times_s, &times_s].map(|all| (all[0], all[all.len() - 1]));
            let scale = (other.1 - other.0) / (own.1 - own.0);
            let moved = taken_s.iter().map(|taken_s| other.0 + scale * (taken_s - own.0));
            self.taken_s = Some(moved.collect());
        }
        self.times_s = times_s;
        if are_exact {
            self.time_quantum_s = 0.0;
        }
    }

    /// The samples from a time on; `None` where there are none.
    pub(super) fn since(&self, start_s: f64) -> Option<Self> {
        let first = self.times_s.partition_point(|time_s| *time_s < start_s);
        if first == self.times_s.len() {
            return None;
        }
        let (times_s, values) = (self.times_s[first..].into(), self.values[first..].into());
        let taken_s = self.taken_s.as_ref().map(|taken_s| {
            let first = taken_s.partition_point(|time_s| *time_s < start_s);
            taken_s[first..].into()
        });
        Some(Self { times_s, values, taken_s, ..self.clone() })
    }

    /// Which channel it is.
    pub fn name(&self) -> ChannelName {
        self.name
    }

    /// Times of the samples, s.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Values of the samples, in the unit of the [`name`](Self::name).
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Root mean square error that filling gaps and bringing samples onto an even clock have made,
    /// over all samples, in the unit of the [`name`](Self::name); 0 where neither was done.
    pub fn resampling_error(&self) -> f64 {
        self.resampling_error
    }

    /// Times of the samples in the file that the values were made of, s; `None` where these stood on
    /// an even clock.
    pub fn taken_s(&self) -> Option<&[f64]> {
        self.taken_s.as_deref()
    }

    /// Brings other samples, taken when the channel's were, onto its [`times_s`](Self::times_s) in the
    /// way that the channel's own were; `None` where these stood on an even clock.
    ///
    /// # Panics
    ///
    /// When there are not as many as [`taken_s`](Self::taken_s): a programming error.
    pub fn brought_onto_clock(&self, samples: &[f64]) -> Option<Vec<f64>> {
        let taken_s = self.taken_s.as_ref()?;
        assert_eq!(samples.len(), taken_s.len(), "samples differ in number from their times");
        let (first_s, last) = (self.times_s[0], self.times_s.len() - 1);
        let rate_hz = last as f64 / (self.times_s[last] - first_s);
        let at: Vec<f64> = taken_s.iter().map(|taken_s| (taken_s - first_s) * rate_hz).collect();
        Some(Nodes { at: &at, values: samples }.values_on_places(last))
    }

    /// Times of the samples, s, with a share in their memory.
    pub fn shared_times_s(&self) -> SharedNumbers {
        self.times_s.clone()
    }

    /// Values of the samples, with a share in their memory.
    pub fn shared_values(&self) -> SharedNumbers {
        self.values.clone()
    }

    /// The clock that the times show.
    pub(super) fn clock(&self) -> Option<Clock> {
        Clock::of(&self.times_s, self.time_quantum_s)
    }

    /// The rate of the samples and how evenly they are spaced.
    ///
    /// # Errors
    /// [`RecordError::TooFewSamples`] with fewer than two samples.
    pub fn sampling(&self) -> Result<Sampling, RecordError> {
        Sampling::of(&self.times_s, self.time_quantum_s)
            .ok_or(RecordError::TooFewSamples { channel: self.name, samples: self.values.len() })
    }
}

/// A column that is no channel: its text is kept and otherwise ignored.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherColumn {
    name: String,
    times_s: Vec<f64>,
    text: String,
    ends: Vec<usize>,
    unread: Option<usize>,
}

impl OtherColumn {
    pub(super) fn new(name: String) -> Self {
        Self { name, times_s: Vec::new(), text: String::new(), ends: Vec::new(), unread: None }
    }

    /// One of a file that is not text: its samples stay there.
    pub(super) fn unread(name: String, samples: usize) -> Self {
        Self { unread: Some(samples), ..Self::new(name) }
    }

    /// How many samples the file has of it.
    pub fn samples(&self) -> usize {
        self.unread.unwrap_or(self.ends.len())
    }

    pub(super) fn push(&mut self, time_s: f64, cell: &str) {
        self.times_s.push(time_s);
        self.text.push_str(cell);
        self.ends.push(self.text.len());
    }

    /// Name of the column in the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Times of its cells that are not empty, s.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// The cells that are not empty, as text.
    pub fn cells(&self) -> impl Iterator<Item = &str> {
        (0..self.ends.len()).map(|index| self.cell(index))
    }

    /// The choice of rows `COLUMN=VALUE` that takes those before a row and no others, where no cell
    /// is empty.
    pub(super) fn choice_of_rows_before(&self, row: usize) -> Option<String> {
        let first = (row > 0 && self.ends.len() > row).then(|| self.cell(0))?;
        let is_told = (0..self.ends.len()).all(|at| (self.cell(at) == first) == (at < row));
        is_told.then(|| choice_of(&self.name, first)).flatten()
    }

    /// One cell that is not empty.
    pub(super) fn cell(&self, index: usize) -> &str {
        let start = if index == 0 { 0 } else { self.ends[index - 1] };
        &self.text[start..self.ends[index]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_refuse_what_no_consumer_should_see() {
        let new = |times: &[f64], values: &[f64]| {
            Channel::new(ChannelName::Current, times, values.to_vec()).unwrap_err().to_string()
        };
        assert_eq!(new(&[0.0], &[]), "`current_a` has 1 times and 0 values");
        assert_eq!(new(&[], &[]), "`current_a` has no samples");
        assert_eq!(new(&[0.0, 1.0], &[0.0, f64::NAN]), "`current_a` is not finite at sample 1");
        assert_eq!(
            new(&[0.0, 1.0, 1.0], &[0.0; 3]),
            "time of `current_a` does not increase at sample 2"
        );
        let backwards = Channel::uniform(ChannelName::Current, 0.0, -1.0, vec![0.0; 2]);
        assert!(matches!(backwards, Err(RecordError::ChannelTime { .. })));
    }
}
