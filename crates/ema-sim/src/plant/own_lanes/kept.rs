//! Runs side by side to their ends, with some signals kept of each.
#![expect(
    clippy::inline_always,
    reason = "the loop is compiled once for each instruction set, which inlining makes possible"
)]

use pulp::NullaryFnOnce;

use super::{LaneControl, OwnLanes};

/// Signal that is kept of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// The current as its sensor shows it.
    Current,
    /// The controller's output.
    Output,
    /// Angle of the motor, with that at the start.
    MotorAngle,
    /// Speed of the motor.
    MotorSpeed,
}

/// Ticks whose values are gathered before they are handed out.
pub(crate) const GATHERED: usize = 64;

/// A run of all lanes, each on its own command; every `step`-th value of some signals is kept.
pub(crate) struct SideBySide<'a, const N: usize, C> {
    pub(crate) lanes: OwnLanes<N, C>,
    pub(crate) commands: &'a [&'a [f64]],
    pub(crate) kept: &'a [Kept],
    pub(crate) step: usize,
}

impl<const N: usize, C: LaneControl<N>> NullaryFnOnce for SideBySide<'_, N, C> {
    type Output = Vec<Vec<Vec<f64>>>;

    /// The signals of each lane; NaN from where a shaft is driven away.
    #[inline(always)]
    fn call(self) -> Vec<Vec<Vec<f64>>> {
        let Self { mut lanes, commands, kept, step } = self;
        let most = commands.iter().map(|command| command.len()).max().unwrap_or(0);
        let room = |command: &&[f64]| {
            let one = || Vec::with_capacity(command.len().div_ceil(step) + GATHERED);
            kept.iter().map(|_| one()).collect()
        };
        let mut values: Vec<Vec<Vec<f64>>> = commands.iter().map(room).collect();
        let mut gathered = vec![[[0.0; N]; GATHERED]; kept.len()];
        let mut rows = 0;
        let mut command = [0.0; N];
        for tick in 0..most {
            for (now, command) in command.iter_mut().zip(commands) {
                *now = command.get(tick).copied().unwrap_or(*now);
            }
            lanes.tick(tick, &command);
            if tick.is_multiple_of(step) {
                for (gathered, kept) in gathered.iter_mut().zip(kept) {
                    gathered[rows] = match kept {
                        Kept::Current => *lanes.shown_current_a(),
                        Kept::Output => *lanes.output(),
                        Kept::MotorAngle => lanes.motor_angle_rad(),
                        Kept::MotorSpeed => *lanes.motor_speed_rad_per_s(),
                    };
                }
                rows += 1;
            }
            if rows == GATHERED || tick + 1 == most {
                for (signal, gathered) in gathered.iter().enumerate() {
                    hand_out(&gathered[..rows], signal, &mut values);
                }
                rows = 0;
            }
        }
        for ((values, command), end) in values.iter_mut().zip(commands).zip(lanes.ends()) {
            for values in values {
                values.truncate(end.div_ceil(step));
                values.resize(command.len().div_ceil(step), f64::NAN);
            }
        }
        values
    }
}

/// Hands rows of a signal of all lanes out to each.
fn hand_out<const N: usize>(rows: &[[f64; N]], signal: usize, values: &mut [Vec<Vec<f64>>]) {
    for (lane, values) in values.iter_mut().enumerate() {
        values[signal].extend(rows.iter().map(|row| row[lane]));
    }
}
