//! Channels brought onto the even clock behind their stamps, and what was done for it.

use std::{f64::consts::TAU, fmt};

use crate::{
    Channel, ChannelName, RecordError, Sampling, SharedNumbers,
    clock::Clock,
    kernel::{Between, Nodes},
};

/// Longest gap that is bridged, in samples.
pub(crate) const MOST_BRIDGED: usize = 8;

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
    /// Rate that times are taken at in place of that of the stamps.
    pub taken: Option<TakenRate>,
    /// True where the recorded command shows what lacks or is twice, and the stamps do not.
    pub is_by_command: bool,
}

/// Rate that the times of a recording are taken at in place of that of its stamps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TakenRate {
    /// The one that the file states, Hz.
    Stated(f64),
    /// The round number that is near that of the stamps, Hz.
    Round(f64),
    /// The one at which the recorded command is that of the test, Hz.
    Command(f64),
}

impl TakenRate {
    /// The rate, Hz.
    pub fn hz(self) -> f64 {
        let (Self::Stated(rate_hz) | Self::Round(rate_hz) | Self::Command(rate_hz)) = self;
        rate_hz
    }
}

impl ClockNote {
    pub(crate) fn of_rate(name: ChannelName, rate_hz: f64, taken: TakenRate) -> Self {
        Self {
            channels: vec![name],
            rate_hz,
            lost: 0,
            lost_after_s: None,
            doubled: 0,
            late: 0,
            jitter_s: 0.0,
            taken: Some(taken),
            is_by_command: false,
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
        if self.is_by_command {
            write!(f, ", as `command_rad` shows")?;
        }
        match self.taken {
            None => {}
            Some(TakenRate::Command(command_hz)) => write!(
                f,
                " by its stamps, {:.0} ppm off that of the command by `command_rad`, and times are at \
                 {command_hz:.3} Hz",
                1e6 * (self.rate_hz / command_hz - 1.0).abs()
            )?,
            Some(TakenRate::Stated(stated_hz)) => write!(
                f,
                " by its stamps; the file states {stated_hz} Hz, and times are at that rate"
            )?,
            Some(TakenRate::Round(round_hz)) => write!(
                f,
                " by its stamps, {:.0} ppm off {round_hz} Hz, and times are at {round_hz} Hz; where the \
                 stamps are right, state `rate-hz = {}`",
                1e6 * (self.rate_hz / round_hz - 1.0).abs(),
                self.rate_hz
            )?,
        }
        if self.jitter_s > 0.0 {
            let share = self.jitter_s * self.rate_hz;
            write!(
                f,
                "; samples are {:.1e} s (rms) off it, {share:.4} of a sample, and resampled",
                self.jitter_s
            )?;
        }
        Ok(())
    }
}

/// Why the stamps of a channel are no time axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Untimely {
    NotAfter(OutOfOrder),
    Lacking(Lacking),
}

/// A sample that is not after the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OutOfOrder {
    /// Index of the sample.
    pub(crate) at: usize,
    /// True where [`Gaps::Bridge`] would read it.
    pub(crate) can_be_bridged: bool,
}

/// Places of a clock that lack their sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lacking {
    /// Index of the sample before.
    pub(crate) before: usize,
    after_s: f64,
    next_s: f64,
    /// Time between places, s.
    step_s: f64,
    /// True where [`Gaps::Bridge`] would read it.
    can_be_bridged: bool,
}

impl Lacking {
    /// The first places that lack their sample, in a channel on a clock.
    pub(crate) fn first(clock: &Clock, stamps_s: &[f64], values: &[f64]) -> Option<Self> {
        let (before, _) = clock.first_gap()?;
        Some(Self {
            before,
            after_s: stamps_s[before],
            next_s: stamps_s[before + 1],
            step_s: clock.rate_hz.recip(),
            can_be_bridged: can_be_bridged(clock, values),
        })
    }

    /// Places that lack their sample after one, where no clock tells how many there should be.
    pub(crate) fn between(stamps_s: &[f64], before: usize, step_s: f64) -> Self {
        let (after_s, next_s) = (stamps_s[before], stamps_s[before + 1]);
        Self { before, after_s, next_s, step_s, can_be_bridged: false }
    }

    /// The error of a channel, at a line where the file is text.
    pub(crate) fn error(self, channel: ChannelName, line: Option<u64>) -> RecordError {
        let Self { after_s, next_s, step_s, can_be_bridged, .. } = self;
        // as the times are written, not as they are computed
        let step_s = as_written(step_s);
        RecordError::Gap { line, channel, after_s, next_s, step_s, can_be_bridged }
    }
}

/// A time without the digits that computing it has made, s.
fn as_written(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
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
    /// Tells whether what lacks is bridged.
    pub(crate) fn bridges(&self) -> bool {
        self.gaps == Gaps::Bridge
    }

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
    ) -> Result<Channel, Untimely> {
        let disorder = first_out_of_order(&stamps_s);
        if disorder.is_none() && is_plainly_even(&stamps_s, quantum_s) {
            return Ok(Channel::from_rows(name, stamps_s, values, quantum_s));
        }
        let at = self.axis(&stamps_s, quantum_s, &[]);
        let axis = &self.axes[at];
        let Some(clock) = axis.clock.as_ref().filter(|clock| self.is_taken(clock, &values)) else {
            let Some(first) = disorder else {
                return Ok(Channel::from_rows(name, stamps_s, values, quantum_s));
            };
            let Some(clock) = &axis.clock else {
                return Err(Untimely::NotAfter(OutOfOrder { at: first, can_be_bridged: false }));
            };
            // stamps coarser than the samples are equal, and lack samples all the same
            let lacking = Lacking::first(clock, &stamps_s, &values);
            return Err(match lacking.filter(|_| clock.is_in_order()) {
                Some(lacking) => Untimely::Lacking(lacking),
                None => Untimely::NotAfter(OutOfOrder {
                    at: clock.first_out_of_order(&stamps_s).unwrap_or(first),
                    can_be_bridged: can_be_bridged(clock, &values),
                }),
            });
        };
        let sampling = Sampling::of(&stamps_s, quantum_s);
        let is_even = sampling.is_some_and(|sampling| sampling.is_uniform());
        if disorder.is_none() && clock.lost() == 0 && !clock.is_jittered && is_even {
            return Ok(Channel::from_rows(name, stamps_s, values, quantum_s));
        }
        let (values, error) = on_clock(name, clock, &stamps_s, &values);
        let kept_s = || clock.kept.iter().map(|&index| stamps_s[index]).collect();
        let taken_s = clock.is_jittered.then(kept_s);
        let channel = Channel::resampled(name, axis.times_s.clone(), values, error, taken_s);
        self.tell(at, name);
        Ok(channel)
    }

    /// Refuses stamps that do not increase, of rows that may hold samples of several channels, some
    /// of which repeat the row before.
    pub(crate) fn check(
        &mut self,
        stamps_s: &SharedNumbers,
        quantum_s: f64,
        repeated: &[usize],
    ) -> Result<(), OutOfOrder> {
        let Some(first) = first_out_of_order(stamps_s) else { return Ok(()) };
        let at = self.axis(stamps_s, quantum_s, repeated);
        let Some(clock) = &self.axes[at].clock else {
            return Err(OutOfOrder { at: first, can_be_bridged: false });
        };
        // what doubled samples hold, and which channel lacks some, each channel looks at
        let can_be_bridged = longest_gap(clock) <= MOST_BRIDGED;
        if clock.is_in_order() || can_be_bridged && self.gaps == Gaps::Bridge {
            return Ok(());
        }
        let at = clock.first_out_of_order(stamps_s).unwrap_or(first);
        Err(OutOfOrder { at, can_be_bridged })
    }

    /// Notes which rows of these stamps repeat the row before.
    pub(crate) fn note_repeated(
        &mut self,
        stamps_s: &SharedNumbers,
        quantum_s: f64,
        repeated: &[usize],
    ) {
        if first_out_of_order(stamps_s).is_some() {
            self.axis(stamps_s, quantum_s, repeated);
        }
    }

    /// Tells whether samples are brought onto a clock.
    fn is_taken(&self, clock: &Clock, values: &[f64]) -> bool {
        let is_whole = clock.is_in_order() && clock.lost() == 0;
        is_whole || self.gaps == Gaps::Bridge && can_be_bridged(clock, values)
    }

    /// The axis of these stamps, made at first sight.
    fn axis(&mut self, stamps_s: &SharedNumbers, quantum_s: f64, repeated: &[usize]) -> usize {
        let is_same = |axis: &SharedAxis| {
            let (own, other): (&[f64], &[f64]) = (&axis.stamps_s, stamps_s);
            own.as_ptr() == other.as_ptr() && own.len() == other.len() || own == other
        };
        if let Some(at) = self.axes.iter().position(is_same) {
            return at;
        }
        let clock = Clock::of_rows(stamps_s, quantum_s, repeated);
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
            lost_after_s: clock.first_gap().map(|(index, _)| as_written(axis.stamps_s[index])),
            doubled: clock.doubled.len(),
            late: clock.late,
            jitter_s: if clock.is_jittered { clock.error_s } else { 0.0 },
            taken: None,
            is_by_command: false,
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
    let kept = if name == ChannelName::MotorAngle { of_many_turns(kept) } else { kept };
    let on = Nodes { at: &at, values: &kept }.on_places(last, between);
    let error = on.error.hypot(misplacement_error(clock, &kept));
    (on.values.into(), error)
}

/// A channel with its rows at the places of a clock.
pub(crate) fn at_places(channel: &Channel, clock: &Clock, placed_s: &SharedNumbers) -> Channel {
    let (values, error) = on_clock(channel.name(), clock, channel.times_s(), channel.values());
    let error = error.hypot(channel.resampling_error());
    Channel::resampled(channel.name(), placed_s.clone(), values, error, None)
}

/// Angles within one turn, whose jumps by a turn are none of the shaft; others as they are.
fn of_many_turns(angles_rad: Vec<f64>) -> Vec<f64> {
    let least_rad = angles_rad.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest_rad = angles_rad.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if greatest_rad - least_rad > TAU {
        return angles_rad;
    }
    let mut turns = 0.0;
    let mut last_rad = angles_rad[0];
    let unrolled_rad = |angle_rad: f64| {
        turns -= ((angle_rad - last_rad) / TAU).round();
        last_rad = angle_rad;
        angle_rad + turns * TAU
    };
    angles_rad.into_iter().map(unrolled_rad).collect()
}

/// Root mean square error of values beside losses whose place is known to some samples only, over
/// all values.
///
/// A loss of `c` samples that is `m` places off puts `m` samples `c` places off. With a slope `s` for
/// each place their errors add up to `c·m·s`; `m` is anything from `−b` to `b`, of variance `b²/3`.
fn misplacement_error(clock: &Clock, values: &[f64]) -> f64 {
    let last = values.len() - 1;
    let losses = clock.places.windows(2).enumerate().filter(|(_, pair)| pair[1] > pair[0] + 1);
    let of_loss = |(loss, (before, pair)): (usize, (usize, &[usize]))| {
        let (by, lost) = (clock.misplaced.of(loss), (pair[1] - pair[0] - 1) as f64);
        let rise = values[(before + by).min(last)] - values[before.saturating_sub(by)];
        (lost * rise).powi(2) / 12.0
    };
    let squares: f64 = losses.enumerate().map(of_loss).sum();
    (squares / (last + 1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A loss where the angle jumps from a turn to 0: between lie angles of neither side.
    #[test]
    fn angles_of_one_turn_are_filled_across_their_jump() {
        let turned: Vec<f64> = (0..200).map(|n| 0.1 * f64::from(n)).collect();
        let rolled: Vec<f64> = turned.iter().map(|angle_rad| angle_rad.rem_euclid(TAU)).collect();
        assert!(rolled[62] > 6.0 && rolled[63] < 0.1);
        let kept = |all: &[f64]| [&all[..63], &all[64..]].concat();
        let stamps_s: Vec<f64> = (0..200).map(|n| f64::from(n) / 1e3).collect();
        let mut evener = Evener::new(Gaps::Bridge);
        let (stamps_s, values) = (kept(&stamps_s), kept(&rolled));
        let channel =
            evener.channel(ChannelName::MotorAngle, stamps_s.into(), values.into(), 1e-3).unwrap();
        for (got_rad, want_rad) in channel.values().iter().zip(&turned) {
            approx::assert_abs_diff_eq!(got_rad, want_rad, epsilon = 1e-9);
        }
    }
}
