//! Channels of a recording brought onto one time base.

use std::f64::consts::TAU;

use crate::{
    channel::Channel, channel_name::ChannelName, error::RecordError, recording::Recording,
};

/// Share of a sample that a sample may be off the grid of its recording.
const MOST_OFF_GRID: f64 = 0.01;

/// Share of the runs of equal values that are of one length where a logger has held samples.
const LEAST_HELD_SHARE: f64 = 0.8;

/// Farthest that a start angle may be from the first sample of the motor's angle, rad: half a step
/// of a coarse encoder.
const MOST_OFF_START_RAD: f64 = 0.02;

/// Quantity that a command column asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AskedFor {
    /// A position: rad or m.
    Position,
    /// A speed: rad/s or m/s.
    Speed,
}

/// Column that says what the controller was asked for.
#[derive(Clone, Copy, Debug)]
pub struct CommandColumn<'a> {
    /// The column.
    pub channel: &'a Channel,
    /// Quantity that it asks for.
    pub asked_for: AskedFor,
}

impl Channel {
    /// Values at other times in increasing order: straight between samples, constant beyond them.
    ///
    /// ```text
    /// x(t) = x_i + (x_{i+1} − x_i)·(t − t_i)/(t_{i+1} − t_i),   t_i ≤ t < t_{i+1}
    /// ```
    ///
    /// # Source
    ///
    /// Linear interpolation; any textbook of numerical analysis.
    pub fn at(&self, times_s: &[f64]) -> Vec<f64> {
        let (from_s, values) = (self.times_s(), self.values());
        if from_s == times_s {
            return values.to_vec();
        }
        let mut above = 0;
        times_s
            .iter()
            .map(|&time_s| {
                while above < from_s.len() && from_s[above] <= time_s {
                    above += 1;
                }
                match (above.checked_sub(1), from_s.get(above)) {
                    (Some(below), Some(&next_s)) => {
                        let share = (time_s - from_s[below]) / (next_s - from_s[below]);
                        values[below] + share * (values[above] - values[below])
                    }
                    (Some(last), None) => values[last],
                    (None, _) => values[0],
                }
            })
            .collect()
    }

    /// Values at other times in increasing order, of what moves smoothly: by the cubic through the two
    /// samples on either side, or the nearest four; constant farther beyond the first and the last than
    /// one sample is from the next.
    ///
    /// ```text
    /// x(t) = Σ_j x_j·Π_{k≠j} (t − t_k)/(t_j − t_k),   j, k of the four samples
    /// ```
    ///
    /// # Source
    ///
    /// Lagrange interpolation; any textbook of numerical analysis.
    pub fn smooth_at(&self, times_s: &[f64]) -> Vec<f64> {
        let (from_s, values) = (self.times_s(), self.values());
        let mut moved = self.at(times_s);
        let count = from_s.len();
        if from_s == times_s || count < 4 {
            return moved;
        }
        let before_s = from_s[0] - (from_s[1] - from_s[0]);
        let beyond_s = from_s[count - 1] + (from_s[count - 1] - from_s[count - 2]);
        for (value, &time_s) in moved.iter_mut().zip(times_s) {
            if !(before_s..=beyond_s).contains(&time_s) {
                continue;
            }
            let above = from_s.partition_point(|&from_s| from_s <= time_s).clamp(2, count - 2);
            let near = above - 2..above + 2;
            let weight = |j: usize| {
                let others = near.clone().filter(|&k| k != j);
                others.map(|k| (time_s - from_s[k]) / (from_s[j] - from_s[k])).product::<f64>()
            };
            *value = near.clone().map(|j| weight(j) * values[j]).sum();
        }
        moved
    }

    /// The samples of a channel that a logger has written again in rows between them; `None` where it has
    /// a sample of its own in each row, or its values repeat for another reason, as those of a coarse
    /// encoder do.
    ///
    /// Held samples stand in runs of one length, but for what stands still.
    pub fn unheld(&self) -> Option<Self> {
        let values = self.values();
        let starts: Vec<usize> =
            (0..values.len()).filter(|&at| at == 0 || values[at] != values[at - 1]).collect();
        let ends = starts.iter().skip(1).copied();
        let mut lengths: Vec<usize> = starts.iter().zip(ends).map(|(from, to)| to - from).collect();
        lengths.sort_unstable();
        let usual = *lengths.get(lengths.len() / 2)?;
        let are_usual = lengths.iter().filter(|length| length.abs_diff(usual) <= 1).count();
        if usual < 2 || (are_usual as f64) < LEAST_HELD_SHARE * lengths.len() as f64 {
            return None;
        }
        let after = starts.iter().skip(1).copied().chain([values.len()]);
        let runs = starts.iter().zip(after);
        let taken: Vec<usize> = runs
            .flat_map(|(&from, to)| {
                // a run that is a row longer or shorter is one sample
                let count = ((to - from) as f64 / usual as f64).round().max(1.0) as usize;
                (0..count).map(move |nth| from + nth * usual)
            })
            .collect();
        let times_s: Vec<f64> = taken.iter().map(|&at| self.times_s()[at]).collect();
        Self::new(self.name(), &times_s, taken.iter().map(|&at| values[at]).collect()).ok()
    }

    /// Sample rate, Hz, of a channel whose samples stand on a grid.
    ///
    /// # Errors
    ///
    /// [`RecordError`] for a channel without a rate, and for one with a sample farther than a
    /// hundredth of a sample off its grid.
    pub fn regular_rate_hz(&self) -> Result<f64, RecordError> {
        let sampling = self.sampling()?;
        let most_s = MOST_OFF_GRID / sampling.rate_hz;
        if sampling.deviation_s > most_s {
            let (channel, deviation_s) = (self.name(), sampling.deviation_s);
            return Err(RecordError::OffGrid { channel, deviation_s, most_s });
        }
        Ok(sampling.rate_hz)
    }
}

impl Recording {
    /// First channel that the recording has of several names.
    pub fn first_channel(&self, names: &[ChannelName]) -> Option<&Channel> {
        names.iter().find_map(|name| self.channel(*name))
    }

    /// Column that says what the controller was asked for: a position before a speed.
    pub fn command_column(&self) -> Option<CommandColumn<'_>> {
        use ChannelName::{Command, LinearCommand, LinearSpeedCommand, SpeedCommand};
        let of = |names: [ChannelName; 2], asked_for| {
            self.first_channel(&names).map(|channel| CommandColumn { channel, asked_for })
        };
        of([Command, LinearCommand], AskedFor::Position)
            .or_else(|| of([SpeedCommand, LinearSpeedCommand], AskedFor::Speed))
    }

    /// Angle of the motor at the first sample by the metadata, rad, in the turn in which the column
    /// of the angle begins; `None` where the metadata do not say it.
    ///
    /// # Errors
    ///
    /// [`RecordError::StartAngle`] where the two are more than 0.02 rad apart.
    pub fn start_angle_rad(&self, column_rad: Option<&[f64]>) -> Result<Option<f64>, RecordError> {
        let told_rad = self.metadata.start_angle_rad;
        let (Some(told_rad), Some(&[first_rad, ..])) = (told_rad, column_rad) else {
            return Ok(told_rad);
        };
        let off_rad = told_rad - first_rad;
        let off_rad = off_rad - TAU * (off_rad / TAU).round();
        if off_rad.abs() > MOST_OFF_START_RAD {
            let most_rad = MOST_OFF_START_RAD;
            return Err(RecordError::StartAngle { told_rad, first_rad, most_rad });
        }
        Ok(Some(first_rad + off_rad))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_between_samples_lie_on_a_line_and_beyond_them_are_constant() {
        let channel = Channel::new(ChannelName::Command, &[0.0, 1.0, 3.0], vec![2.0, 4.0, 0.0]);
        let values = channel.expect("a channel").at(&[-1.0, 0.0, 0.5, 2.0, 3.0, 9.0]);
        assert_eq!(values, [2.0, 2.0, 3.0, 2.0, 0.0, 0.0]);
    }

    #[test]
    fn what_moves_smoothly_lies_on_a_cubic_between_samples() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t - 0.25 * t * t * t;
        let from_s = [0.0, 1.0, 1.5, 3.0, 4.0];
        let channel = Channel::new(ChannelName::MotorAngle, &from_s, from_s.map(cubic).into());
        let values = channel.expect("a channel").smooth_at(&[-2.0, -0.5, 1.25, 3.5, 4.5, 9.0]);
        let told = [0.0, -0.5, 1.25, 3.5, 4.5, 4.0].map(cubic);
        for (value, told) in values.iter().zip(told) {
            assert!((value - told).abs() < 1e-12, "{values:?}");
        }
    }

    #[test]
    fn samples_that_were_written_again_are_taken_once() {
        let of = |values: Vec<f64>| {
            Channel::uniform(ChannelName::MotorAngle, 0.0, 10.0, values).expect("a channel")
        };
        let swing = |t: f64| (0.7 * t).sin();
        // it stands for 40 rows, then a sample is written four times each
        let held = |row: u32| swing(f64::from(row.max(40) / 4 * 4) - 40.0);
        let taken = of((0..400).map(held).collect()).unheld().expect("samples");
        assert_eq!(taken.values().len(), 100);
        assert_eq!((taken.values()[11], taken.times_s()[11]), (swing(4.0), 4.4));
        // one of its own in each row, and a coarse encoder
        let fine = |row: u32| swing(0.01 * f64::from(row));
        assert!(of((0..400).map(fine).collect()).unheld().is_none());
        let coarse = |row: u32| (10.0 * fine(row)).round() / 10.0;
        assert!(of((0..400).map(coarse).collect()).unheld().is_none());
    }

    #[test]
    fn a_sample_off_the_grid_has_no_regular_rate() {
        let mut times_s: Vec<f64> = (0..1000).map(|n| f64::from(n) / 1000.0).collect();
        let channel = |times_s: &[f64]| {
            Channel::new(ChannelName::Current, times_s, vec![0.0; 1000]).expect("a channel")
        };
        assert_eq!(channel(&times_s).regular_rate_hz().unwrap(), 1000.0);
        times_s[500] += 2e-5;
        let told = channel(&times_s).regular_rate_hz().map_err(|error| error.to_string());
        let expected = "column `current_a` is sampled irregularly: a sample is 2.00e-5 s off its \
                        grid, expected at most 1.00e-5 s";
        assert_eq!(told, Err(expected.to_owned()));
    }
}
