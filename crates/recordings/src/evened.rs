//! Channels brought onto the even clock behind their stamps, and what was done for it.

use std::fmt;

use crate::{
    Channel, ChannelName, Sampling, SharedNumbers,
    clock::Clock,
    kernel::{Between, Nodes},
};

/// Longest gap that is bridged, in samples.
const MOST_BRIDGED: usize = 8;

/// Treatment of samples that are lost, doubled or out of order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gaps {
    /// The recording is refused, and the message says where.
    #[default]
    Refuse,
    /// Samples are put in order, doubled ones dropped, and gaps of up to 8 samples filled from
    /// the samples beside them, with an error that enters the noise.
    Bridge,
}

/// Repair of the time axis of channels.
#[derive(Clone, Debug, PartialEq)]
pub struct ClockNote {
    /// Channels on the axis.
    pub channels: Vec<ChannelName>,
    /// Rate of the clock that the stamps show, Hz.
    pub rate_hz: f64,
    /// Samples that were lost and are filled.
    pub lost: usize,
    /// Time of the last sample before the first of them, s.
    pub lost_after_s: Option<f64>,
    /// Samples that stood in the file twice.
    pub doubled: usize,
    /// Samples that stood in the file after a later one.
    pub late: usize,
    /// Root mean square distance of the stamps from the clock where the values were resampled for
    /// it, s; else 0.
    pub jitter_s: f64,
    /// Rate that the file states in place of that of its stamps, Hz.
    pub stated_hz: Option<f64>,
}

impl ClockNote {
    pub(crate) fn of_stated_rate(name: ChannelName, rate_hz: f64, stated_hz: f64) -> Self {
        Self {
            channels: vec![name],
            rate_hz,
            lost: 0,
            lost_after_s: None,
            doubled: 0,
            late: 0,
            jitter_s: 0.0,
            stated_hz: Some(stated_hz),
        }
    }
}

impl fmt::Display for ClockNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.channels.iter().map(|name| format!("`{name}`")).collect();
        write!(f, "the clock of {} is {} Hz", names.join(", "), self.rate_hz)?;
        let samples = |count: usize| if count == 1 { "sample" } else { "samples" };
        if let Some(after_s) = self.lost_after_s {
            let lost = self.lost;
            write!(f, "; {lost} {} lost (the first after {after_s} s) and filled", samples(lost))?;
        }
        if self.doubled > 0 {
            write!(f, "; {} {} twice in the file", self.doubled, samples(self.doubled))?;
        }
        if self.late > 0 {
            write!(f, "; {} {} out of order", self.late, samples(self.late))?;
        }
        if let Some(stated_hz) = self.stated_hz {
            write!(
                f,
                " by its stamps; the file states {stated_hz} Hz, and times are at that rate"
            )?;
        }
        if self.jitter_s > 0.0 {
            let share = self.jitter_s * self.rate_hz;
            write!(
                f,
                "; samples are {:.1e} s (rms) off it, {share:.3} of a sample, and resampled",
                self.jitter_s
            )?;
        }
        Ok(())
    }
}

/// Why stamps are no time axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OutOfOrder {
    /// The first sample that is not after the one before.
    pub(crate) index: usize,
    /// True where [`Gaps::Bridge`] would read it.
    pub(crate) can_be_bridged: bool,
}

/// The channels of a file, brought onto their clocks one by one; an axis that several share is
/// looked at once.
#[derive(Debug)]
pub(crate) struct Evener {
    gaps: Gaps,
    axes: Vec<SharedAxis>,
    notes: Vec<ClockNote>,
}

#[derive(Debug)]
struct SharedAxis {
    stamps_s: SharedNumbers,
    clock: Option<Clock>,
    /// Times of the places, where samples are brought onto them.
    times_s: SharedNumbers,
    note: Option<usize>,
}

impl Evener {
    pub(crate) fn new(gaps: Gaps) -> Self {
        Self { gaps, axes: Vec::new(), notes: Vec::new() }
    }

    pub(crate) fn into_notes(self) -> Vec<ClockNote> {
        self.notes
    }

    /// A channel of samples with these stamps, which are written to a multiple of `quantum_s`.
    pub(crate) fn channel(
        &mut self,
        name: ChannelName,
        stamps_s: SharedNumbers,
        values: SharedNumbers,
        quantum_s: f64,
    ) -> Result<Channel, OutOfOrder> {
        let disorder = first_out_of_order(&stamps_s);
        if disorder.is_none() && is_plainly_even(&stamps_s, quantum_s) {
            return Ok(Channel::from_rows(name, stamps_s, values, quantum_s));
        }
        let at = self.axis(&stamps_s, quantum_s);
        let axis = &self.axes[at];
        let Some(clock) = axis.clock.as_ref().filter(|clock| self.is_taken(clock, &values)) else {
            let Some(index) = disorder else {
                return Ok(Channel::from_rows(name, stamps_s, values, quantum_s));
            };
            let clock = axis.clock.as_ref();
            let can_be_bridged = clock.is_some_and(|clock| can_be_bridged(clock, &values));
            return Err(OutOfOrder { index, can_be_bridged });
        };
        let sampling = Sampling::of(&stamps_s, quantum_s);
        let is_even = sampling.is_some_and(|sampling| sampling.is_uniform());
        if disorder.is_none() && clock.lost() == 0 && !clock.is_jittered && is_even {
            return Ok(Channel::from_rows(name, stamps_s, values, quantum_s));
        }
        let (values, error) = on_clock(name, clock, &stamps_s, &values);
        let channel = Channel::resampled(name, axis.times_s.clone(), values, error);
        self.tell(at, name);
        Ok(channel)
    }

    /// Refuses stamps that do not increase, of rows that may hold samples of several channels.
    pub(crate) fn check(
        &mut self,
        stamps_s: &SharedNumbers,
        quantum_s: f64,
    ) -> Result<(), OutOfOrder> {
        let Some(index) = first_out_of_order(stamps_s) else { return Ok(()) };
        let at = self.axis(stamps_s, quantum_s);
        let clock = self.axes[at].clock.as_ref();
        // what doubled samples hold, each channel looks at
        let is_short = |clock: &Clock| longest_gap(clock) <= MOST_BRIDGED;
        let can_be_bridged = clock.is_some_and(is_short);
        let is_whole = clock.is_some_and(|clock| clock.is_in_order() && clock.lost() == 0);
        if is_whole || can_be_bridged && self.gaps == Gaps::Bridge {
            return Ok(());
        }
        Err(OutOfOrder { index, can_be_bridged })
    }

    /// Tells whether samples are brought onto a clock.
    fn is_taken(&self, clock: &Clock, values: &[f64]) -> bool {
        let is_whole = clock.is_in_order() && clock.lost() == 0;
        is_whole || self.gaps == Gaps::Bridge && can_be_bridged(clock, values)
    }

    /// The axis of these stamps, made at first sight.
    fn axis(&mut self, stamps_s: &SharedNumbers, quantum_s: f64) -> usize {
        let is_same = |axis: &SharedAxis| {
            let (own, other): (&[f64], &[f64]) = (&axis.stamps_s, stamps_s);
            own.as_ptr() == other.as_ptr() && own.len() == other.len() || own == other
        };
        if let Some(at) = self.axes.iter().position(is_same) {
            return at;
        }
        let clock = Clock::of(stamps_s, quantum_s);
        let times = clock.as_ref().map(|clock| {
            let count = clock.places.last().map_or(0, |last| last + 1);
            let time_s = |place: usize| clock.start_s + place as f64 / clock.rate_hz;
            (0..count).map(time_s).collect::<SharedNumbers>()
        });
        let times_s = times.unwrap_or_else(|| stamps_s.clone());
        self.axes.push(SharedAxis { stamps_s: stamps_s.clone(), clock, times_s, note: None });
        self.axes.len() - 1
    }

    /// Notes what was done to an axis, for one more channel.
    fn tell(&mut self, at: usize, name: ChannelName) {
        let axis = &mut self.axes[at];
        let Some(clock) = &axis.clock else { return };
        if clock.is_in_order() && clock.lost() == 0 && !clock.is_jittered {
            return;
        }
        if let Some(note) = axis.note {
            self.notes[note].channels.push(name);
            return;
        }
        axis.note = Some(self.notes.len());
        self.notes.push(ClockNote {
            channels: vec![name],
            rate_hz: clock.rate_hz,
            lost: clock.lost(),
            lost_after_s: clock.first_gap().map(|(index, _)| axis.stamps_s[index]),
            doubled: clock.doubled.len(),
            late: clock.late,
            jitter_s: if clock.is_jittered { clock.error_s } else { 0.0 },
            stated_hz: None,
        });
    }
}

/// Tells whether samples can be brought onto a clock, its gaps filled.
pub(crate) fn can_be_bridged(clock: &Clock, values: &[f64]) -> bool {
    // two values at one time cannot both be right
    longest_gap(clock) <= MOST_BRIDGED
        && clock.doubled.iter().all(|&(kept, other)| values[kept] == values[other])
}

/// Most places between two samples that have none.
fn longest_gap(clock: &Clock) -> usize {
    clock.places.windows(2).map(|pair| pair[1] - pair[0] - 1).max().unwrap_or(0)
}

fn first_out_of_order(stamps_s: &[f64]) -> Option<usize> {
    stamps_s.windows(2).position(|pair| pair[1] <= pair[0]).map(|before| before + 1)
}

/// Tells whether stamps are even, and fine enough to show each sample that lacks.
fn is_plainly_even(stamps_s: &[f64], quantum_s: f64) -> bool {
    Sampling::of(stamps_s, quantum_s).is_some_and(|sampling| sampling.shows_each_sample())
}

/// Values of the samples at the places of their clock, and the error that was made.
fn on_clock(
    name: ChannelName,
    clock: &Clock,
    stamps_s: &[f64],
    values: &[f64],
) -> (SharedNumbers, f64) {
    let kept: Vec<f64> = clock.kept.iter().map(|&index| values[index]).collect();
    if clock.lost() == 0 && !clock.is_jittered {
        return (kept.into(), 0.0);
    }
    let place = |(&index, &place): (&usize, &usize)| {
        if clock.is_jittered {
            (stamps_s[index] - clock.start_s) * clock.rate_hz
        } else {
            place as f64
        }
    };
    let at: Vec<f64> = clock.kept.iter().zip(&clock.places).map(place).collect();
    let between = if name == ChannelName::HallState { Between::Held } else { Between::Kernel };
    let last = clock.places.last().copied().unwrap_or(0);
    let on = Nodes { at: &at, values: &kept }.on_places(last, between);
    (on.values.into(), on.error)
}
