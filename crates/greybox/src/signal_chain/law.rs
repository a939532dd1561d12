//! The equation of the controller: what the model's controller makes of recorded command and
//! position, against the drive signal recorded.

use super::{
    regression::{Estimate, Regression, least, spread},
    shift::shifted,
    view::{MOST_SHIFT_S, View},
};
use crate::{
    error::{GreyboxError, if_run},
    machine::Machine,
};

/// Accuracy of a shift that needs a replay of its own, s.
const REPLAYED_SHIFT_S: f64 = 1e-4;
/// Accuracy of a shift of the drive, s.
const SHIFT_S: f64 = 2e-5;
/// Steps of the grid on which a shift is looked for.
const SHIFT_STEPS: usize = 50;

/// A recorded drive signal against a replay: `u = g·x + h·x' + o + d·t`, where a shift `−h/g` is
/// what is left of one that was taken out.
#[derive(Clone, Debug)]
pub(super) struct Likeness {
    pub(super) gain: Estimate,
    /// Drive later than the replay, s.
    pub(super) late_s: Estimate,
    /// Share of the drive's energy that is left, without the slope.
    pub(super) left: f64,
}

/// A channel that is shifted, or scaled, with the likeness that is left then.
#[derive(Clone, Debug)]
pub(super) struct Shift {
    /// Shift, s, or factor.
    pub(super) number: Estimate,
    pub(super) gain: Estimate,
    pub(super) left: f64,
}

/// The equation of the controller of one recording.
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
        let replay = machine.replayed(record, &record.command, view.position);
        let Some(replay) = if_run(replay)?.flatten() else { return Ok(None) };
        let (measured, course) = (view.averaged(&record.drive), view.course());
        let nothing = Estimate { value: 0.0, std: 0.0, degrees: 1.0 };
        let likeness = Likeness { gain: nothing, late_s: nothing, left: 1.0 };
        let mut law = Self { machine, view, measured, course, replay, likeness };
        let Some(likeness) = law.likeness_of(&law.replay) else { return Ok(None) };
        law.likeness = likeness;
        Ok(Some(law))
    }

    /// Likeness of a replay at the recording's rate; `None` for one that does nothing.
    fn likeness_of(&self, replay: &[f64]) -> Option<Likeness> {
        let constant = vec![1.0; self.course.len()];
        let mut columns = vec![self.view.averaged(replay), constant, self.course.clone()];
        let block = self.view.block();
        let plain = Regression::of(&self.measured, &columns, block)?;
        let rate_hz = self.view.rate_hz();
        let last = replay.len() - 1;
        let slope: Vec<f64> = (0..replay.len())
            .map(|n| (replay[(n + 1).min(last)] - replay[n.saturating_sub(1)]) * 0.5 * rate_hz)
            .collect();
        columns.push(self.view.averaged(&slope));
        let with_slope = Regression::of(&self.measured, &columns, block)?;
        let late_s = with_slope.quotient(3, 0).scaled(-1.0);
        Some(Likeness { gain: plain.estimate(0), late_s, left: plain.left })
    }

    /// Share that a replay leaves.
    fn left_by(&self, replay: &[f64]) -> f64 {
        let constant = vec![1.0; self.course.len()];
        let columns = [self.view.averaged(replay), constant, self.course.clone()];
        Regression::of(&self.measured, &columns, self.view.block()).map_or(1.0, |fit| fit.left)
    }

    /// Share of the drive's whole energy, its mean included, that the replay leaves. How large the mean
    /// is, a replay cannot say: at a steady speed all else may be noise.
    pub(super) fn left_of_whole(&self) -> f64 {
        let whole: f64 = self.measured.iter().map(|u| u * u).sum();
        self.likeness.left * spread(&self.measured) / whole.max(f64::MIN_POSITIVE)
    }

    /// Likeness with command and position in the place of the recorded ones.
    pub(super) fn with(
        &self,
        command: &[f64],
        position: &[f64],
    ) -> Result<Option<Likeness>, GreyboxError> {
        let replay = if_run(self.machine.replayed(self.view.record, command, position))?;
        Ok(replay.flatten().and_then(|replay| self.likeness_of(&replay)))
    }

    /// The drive late against command and position.
    pub(super) fn drive_late(&self) -> Option<Shift> {
        let rate_hz = self.view.rate_hz();
        let left = |late_s: f64| self.left_by(&shifted(&self.replay, rate_hz, late_s));
        let late_s = least([-MOST_SHIFT_S, MOST_SHIFT_S], SHIFT_STEPS, SHIFT_S, left);
        let found = self.likeness_of(&shifted(&self.replay, rate_hz, late_s))?;
        Some(Shift::of(late_s, &found))
    }

    /// Share left where the drive signal follows its replay through a first-order lag, as the
    /// reading of a slow sensor does, at the lag that fits best.
    pub(super) fn left_by_lag(&self) -> f64 {
        let rate_hz = self.view.rate_hz();
        let lagging = |lag_s: f64| {
            let keep = libm::exp(-1.0 / (rate_hz * lag_s.max(1e-9)));
            let mut shown = self.replay[0];
            let lagged: Vec<f64> = self
                .replay
                .iter()
                .map(|x| {
                    shown = keep * shown + (1.0 - keep) * x;
                    shown
                })
                .collect();
            self.left_by(&lagged)
        };
        let lag_s = least([0.0, MOST_SHIFT_S], SHIFT_STEPS, SHIFT_S, lagging);
        lagging(lag_s)
    }

    /// The position late against command and drive.
    pub(super) fn position_late(&self) -> Result<Option<Shift>, GreyboxError> {
        let (command, position) = (&self.view.record.command, self.view.position);
        let rate_hz = self.view.rate_hz();
        self.replayed_late(|late_s| self.with(command, &shifted(position, rate_hz, -late_s)))
    }

    /// The command late against position and drive.
    pub(super) fn command_late(&self) -> Result<Option<Shift>, GreyboxError> {
        let (command, position) = (&self.view.record.command, self.view.position);
        let rate_hz = self.view.rate_hz();
        self.replayed_late(|late_s| self.with(&shifted(command, rate_hz, -late_s), position))
    }

    /// The position on another scale, near a factor.
    pub(super) fn position_scaled(&self, near: f64) -> Result<Option<Shift>, GreyboxError> {
        let (command, position) = (&self.view.record.command, self.view.position);
        let search = Search {
            range: [(1.0 - SCALE_SHARE) * near, (1.0 + SCALE_SHARE) * near],
            finest: SCALE_FINEST * near,
            second: SCALE_SECOND * near,
        };
        self.replayed_best(&search, |factor| {
            let on_scale: Vec<f64> = position.iter().map(|p| p / factor).collect();
            self.with(command, &on_scale)
        })
    }

    fn replayed_late(
        &self,
        with: impl Fn(f64) -> Result<Option<Likeness>, GreyboxError>,
    ) -> Result<Option<Shift>, GreyboxError> {
        let range = [-MOST_SHIFT_S, MOST_SHIFT_S];
        self.replayed_best(&Search { range, finest: REPLAYED_SHIFT_S, second: SECOND_S }, with)
    }

    /// Number at which a replay explains most.
    fn replayed_best(
        &self,
        search: &Search,
        with: impl Fn(f64) -> Result<Option<Likeness>, GreyboxError>,
    ) -> Result<Option<Shift>, GreyboxError> {
        let mut failed = None;
        let left = |number: f64| match with(number) {
            Ok(likeness) => likeness.map_or(1.0, |likeness| likeness.left),
            Err(error) => {
                failed = Some(error);
                1.0
            }
        };
        let at = least(search.range, SHIFT_STEPS, search.finest, left);
        if let Some(error) = failed {
            return Err(error);
        }
        let Some(found) = with(at)? else { return Ok(None) };
        let step = search.second;
        let around = [with(at - step)?, with(at + step)?];
        let [Some(before), Some(after)] = around else { return Ok(None) };
        let bend = (before.left + after.left - 2.0 * found.left) / (step * step);
        // half the bend over the share left is the information of a residual of unit size; a block
        // counts as one sample
        let std = libm::sqrt((2.0 * found.left / bend.max(f64::MIN_POSITIVE)) / self.view.blocks());
        let degrees = self.measured.len() as f64;
        let number = Estimate { value: at, std, degrees };
        Ok(Some(Shift { number, gain: found.gain, left: found.left }))
    }

    /// Gains of position and speed loop that explain the drive, over those of the model file, with
    /// the share left: `u = K_v·(K_p·e − v) + K_ξ·∫(K_p·e − v)`. Of a speed loop the second alone.
    pub(super) fn own_gains(&self) -> Option<([Option<Estimate>; 2], f64)> {
        let (record, position) = (self.view.record, self.view.position);
        let (rate_hz, gains) = (record.rate_hz, self.machine.loop_gains());
        let is_speed = record.kind == ema_sim::CommandKind::Speed;
        let last = position.len() - 1;
        let speed: Vec<f64> = (0..position.len())
            .map(|n| {
                let (before, after) = (n.saturating_sub(1), (n + 1).min(last));
                (position[after] - position[before]) * rate_hz / (after - before).max(1) as f64
            })
            .collect();
        let error: Vec<f64> = if is_speed {
            record.command.clone()
        } else {
            record.command.iter().zip(position).map(|(c, p)| c - p).collect()
        };
        let mut columns: Vec<Vec<f64>> =
            [&error, &speed].map(|signal| self.view.averaged(signal)).to_vec();
        if gains.speed_integral > 0.0 {
            let summed = running_sum(&error, rate_hz);
            let moved: Vec<f64> = position.iter().map(|p| p - position[0]).collect();
            columns.extend([&summed, &moved].map(|signal| self.view.averaged(signal)));
        }
        columns.push(vec![1.0; self.course.len()]);
        let fit = Regression::of(&self.measured, &columns, self.view.block())?;
        let of_speed = fit.estimate(1).scaled(-1.0 / gains.speed);
        let of_position = fit.quotient(0, 1).scaled(-1.0 / gains.position_per_s);
        Some(([(!is_speed).then_some(of_position), Some(of_speed)], fit.left))
    }

    /// Recorded position.
    pub(super) fn position(&self) -> &'a [f64] {
        self.view.position
    }

    /// Samples that are compared.
    pub(super) fn kept(&self) -> core::ops::Range<usize> {
        self.view.kept()
    }

    /// Recorded drive less the replay at the recording's rate.
    pub(super) fn residual(&self) -> Vec<f64> {
        let drive = &self.view.record.drive;
        drive.iter().zip(&self.replay).map(|(u, x)| u - x).collect()
    }
}

/// Step of the second difference that tells how sure a replayed shift is, s.
const SECOND_S: f64 = 5e-4;
/// Share by which a scale is looked for about its first guess, which the lag of the axis is in; its
/// accuracy and the step of its second difference.
const SCALE_SHARE: f64 = 0.2;
const SCALE_FINEST: f64 = 1e-4;
const SCALE_SECOND: f64 = 5e-3;

/// Numbers that are tried, how fine, and the step of the second difference.
struct Search {
    range: [f64; 2],
    finest: f64,
    second: f64,
}

impl Shift {
    /// A shift taken out of a replay, and what is left of it.
    fn of(taken_s: f64, found: &Likeness) -> Self {
        let left = found.late_s;
        let number = Estimate { value: taken_s + left.value, ..left };
        Self { number, gain: found.gain, left: found.left }
    }
}

fn running_sum(signal: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let add = |x: &f64| {
        sum += x / rate_hz;
        sum
    };
    signal.iter().map(add).collect()
}
