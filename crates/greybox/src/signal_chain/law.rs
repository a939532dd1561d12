//! The controller's law: what the model's controller makes of the recorded command and position,
//! against the drive signal recorded.

use super::{
    least_squares::{Fit, least},
    view::{MOST_SHIFT_S, View, shifted},
};
use crate::{error::GreyboxError, machine::Machine};

/// Accuracy of a shift that needs a replay of its own, s.
const REPLAYED_SHIFT_S: f64 = 2e-4;
/// Accuracy of a shift of the drive, s.
const SHIFT_S: f64 = 2e-5;

/// A recorded drive signal against a replay: `u = gain·x + offset + drift·t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Likeness {
    pub(super) gain: f64,
    pub(super) offset: f64,
    /// Share of the drive's energy that is left.
    pub(super) left: f64,
}

/// A channel that is shifted, with the likeness that is left then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shift {
    pub(super) late_s: f64,
    pub(super) likeness: Likeness,
}

/// The law of one recording.
#[derive(Debug)]
pub(super) struct Law<'a> {
    machine: &'a Machine,
    view: View<'a>,
    measured: Vec<f64>,
    course: Vec<f64>,
    /// Replay at the recording's rate.
    pub(super) replay: Vec<f64>,
    pub(super) likeness: Likeness,
}

impl<'a> Law<'a> {
    /// `None` where the controller is not known or there is nothing to compare.
    pub(super) fn of(machine: &'a Machine, view: View<'a>) -> Result<Option<Self>, GreyboxError> {
        let record = view.record;
        let Some(replay) = machine.replayed(record, &record.command, view.position)? else {
            return Ok(None);
        };
        let (measured, course) = (view.averaged(&record.drive), view.course());
        let nothing = Likeness { gain: 0.0, offset: 0.0, left: 1.0 };
        let mut law = Self { machine, view, measured, course, replay, likeness: nothing };
        let Some(likeness) = law.likeness_of(&law.replay) else { return Ok(None) };
        law.likeness = likeness;
        Ok(Some(law))
    }

    /// Likeness of a replay at the recording's rate; `None` for one that does nothing.
    fn likeness_of(&self, replay: &[f64]) -> Option<Likeness> {
        let columns =
            [self.view.averaged(replay), vec![1.0; self.course.len()], self.course.clone()];
        let fit = Fit::new(&self.measured, &columns)?;
        Some(Likeness { gain: fit.coefficients[0], offset: fit.coefficients[1], left: fit.left })
    }

    /// Recorded position.
    pub(super) fn position(&self) -> &'a [f64] {
        self.view.position
    }

    /// Likeness with command and position in the place of the recorded ones.
    pub(super) fn with(
        &self,
        command: &[f64],
        position: &[f64],
    ) -> Result<Option<Likeness>, GreyboxError> {
        let replay = self.machine.replayed(self.view.record, command, position)?;
        Ok(replay.and_then(|replay| self.likeness_of(&replay)))
    }

    /// The drive late against command and position.
    pub(super) fn drive_late(&self) -> Shift {
        let rate_hz = self.view.rate_hz();
        let left = |late_s: f64| {
            let replay = shifted(&self.replay, rate_hz, late_s);
            self.likeness_of(&replay).map_or(1.0, |likeness| likeness.left)
        };
        let (late_s, _) = least(-MOST_SHIFT_S, MOST_SHIFT_S, 20, SHIFT_S, left);
        let replay = shifted(&self.replay, rate_hz, late_s);
        let likeness = self.likeness_of(&replay).unwrap_or(self.likeness);
        Shift { late_s, likeness }
    }

    /// The position late against command and drive.
    pub(super) fn position_late(&self) -> Result<Shift, GreyboxError> {
        let (command, position) = (&self.view.record.command, self.view.position);
        self.replayed_late(|late_s| {
            self.with(command, &shifted(position, self.view.rate_hz(), -late_s))
        })
    }

    /// The command late against position and drive.
    pub(super) fn command_late(&self) -> Result<Shift, GreyboxError> {
        let (command, position) = (&self.view.record.command, self.view.position);
        self.replayed_late(|late_s| {
            self.with(&shifted(command, self.view.rate_hz(), -late_s), position)
        })
    }

    fn replayed_late(
        &self,
        with: impl Fn(f64) -> Result<Option<Likeness>, GreyboxError>,
    ) -> Result<Shift, GreyboxError> {
        let mut failed = None;
        let left = |late_s: f64| match with(late_s) {
            Ok(likeness) => likeness.map_or(1.0, |likeness| likeness.left),
            Err(error) => {
                failed = Some(error);
                1.0
            }
        };
        let (late_s, _) = least(-MOST_SHIFT_S, MOST_SHIFT_S, 20, REPLAYED_SHIFT_S, left);
        if let Some(error) = failed {
            return Err(error);
        }
        Ok(Shift { late_s, likeness: with(late_s)?.unwrap_or(self.likeness) })
    }

    /// Gains of position and speed loop that explain the drive, over those of the model file, with
    /// the share left: `u = K_v·(K_p·e − v) + K_ξ·∫(K_p·e − v)`.
    pub(super) fn own_gains(&self) -> Option<([f64; 2], f64)> {
        let (record, position) = (self.view.record, self.view.position);
        let rate_hz = record.rate_hz;
        let error: Vec<f64> = record.command.iter().zip(position).map(|(c, p)| c - p).collect();
        let last = position.len() - 1;
        let speed: Vec<f64> = (0..position.len())
            .map(|n| {
                let (before, after) = (n.saturating_sub(1), (n + 1).min(last));
                (position[after] - position[before]) * rate_hz / (after - before).max(1) as f64
            })
            .collect();
        let mut sum = 0.0;
        let integral: Vec<f64> = error
            .iter()
            .map(|e| {
                sum += e / rate_hz;
                sum
            })
            .collect();
        let mut columns: Vec<Vec<f64>> =
            [&error, &speed].map(|signal| self.view.averaged(signal)).to_vec();
        if self.machine.has_integral() {
            let moved: Vec<f64> = position.iter().map(|p| p - position[0]).collect();
            columns.extend([&integral, &moved].map(|signal| self.view.averaged(signal)));
        }
        columns.push(vec![1.0; self.course.len()]);
        let fit = Fit::new(&self.measured, &columns)?;
        let [position_gain, speed_gain] = self.machine.gains();
        let speed_ratio = -fit.coefficients[1] / speed_gain;
        let position_ratio = -fit.coefficients[0] / fit.coefficients[1] / position_gain;
        Some(([position_ratio, speed_ratio], fit.left))
    }

    /// Recorded drive less the replay at the recording's rate, with the gain of the model file.
    pub(super) fn residual(&self) -> Vec<f64> {
        let drive = &self.view.record.drive;
        drive.iter().zip(&self.replay).map(|(u, x)| u - x).collect()
    }
}
