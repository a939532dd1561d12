//! The controllers of axes side by side.

use crate::{
    bounds::within,
    plant::{LaneControl, LaneLaw, Seen},
    quantisation::quantised_in_lane,
    wide::{Wide, of_each},
};

use super::{AxisCascade, AxisController, Feedback, Integrals};

/// Quantity that the commands of axes ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
    Position,
    Speed,
    /// The controller's output itself.
    Output,
}

/// An axis of a lane.
#[derive(Clone, Debug)]
pub(crate) struct AxisLane {
    pub(crate) asked: Asked,
    pub(crate) cascade: AxisCascade,
    /// Position of the motor at the start.
    pub(crate) start: f64,
    /// True where the position counts from there, whatever a sensor shows.
    pub(crate) is_plain: bool,
}

/// Controllers that differ in their numbers alone.
#[derive(Clone, Debug)]
pub(crate) struct AxisLanes<const N: usize> {
    asked: Asked,
    /// Law with the choices that all of them share.
    common: AxisController,
    tick_s: f64,
    position_gain: Wide<N>,
    position_integral: Wide<N>,
    position_derivative: Wide<N>,
    speed_limit: Wide<N>,
    speed_gain: Wide<N>,
    speed_integral: Wide<N>,
    output_limit: Wide<N>,
    encoder_step: Wide<N>,
    start: Wide<N>,
    is_plain: [bool; N],
    integral_of_position: Wide<N>,
    integral_of_speed: Wide<N>,
    last_error: Option<Wide<N>>,
    /// The latest positions; the next one takes the place of the oldest.
    positions: Vec<Wide<N>>,
    oldest: usize,
}

impl LaneLaw for AxisLane {
    type Lanes<const N: usize> = AxisLanes<N>;

    fn is_like(&self, other: &Self) -> bool {
        let of = |lane: &Self| {
            let law = &lane.cascade.law;
            (lane.asked, law.speed_samples, law.feedback)
        };
        of(self) == of(other)
    }

    fn lanes<const N: usize>(laws: &[Self]) -> Option<AxisLanes<N>> {
        AxisLanes::of(laws)
    }
}

impl<const N: usize> AxisLanes<N> {
    /// Controllers at the start; the last ones fill what is left of the lanes. `None` where there
    /// is none.
    fn of(axes: &[AxisLane]) -> Option<Self> {
        let AxisLane { asked, cascade, .. } = axes.first()?;
        let AxisCascade { law: common, tick_s, .. } = *cascade;
        let of = |number: &dyn Fn(&AxisController) -> f64| {
            of_each(axes, |axis: &AxisLane| number(&axis.cascade.law))
        };
        let before = |n: usize| of_each(axes, |axis: &AxisLane| axis.cascade.positions[n]);
        Some(Self {
            asked: *asked,
            common,
            tick_s,
            position_gain: of(&|law| law.position_gain_per_s),
            position_integral: of(&|law| law.position_integral_per_s2),
            position_derivative: of(&|law| law.position_derivative_ratio),
            speed_limit: of(&|law| law.speed_limit),
            speed_gain: of(&|law| law.speed_gain),
            speed_integral: of(&|law| law.speed_integral),
            output_limit: of(&|law| law.output_limit),
            encoder_step: of(&|law| law.encoder_step),
            start: of_each(axes, |axis| axis.start),
            is_plain: of_each(axes, |axis| axis.is_plain),
            integral_of_position: of_each(axes, |axis| axis.cascade.integrals.position),
            integral_of_speed: of_each(axes, |axis| axis.cascade.integrals.speed),
            last_error: None,
            // oldest first
            positions: (0..common.speed_samples as usize).rev().map(before).collect(),
            oldest: 0,
        })
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    fn law(&self, lane: usize) -> AxisController {
        AxisController {
            position_gain_per_s: self.position_gain[lane],
            position_integral_per_s2: self.position_integral[lane],
            position_derivative_ratio: self.position_derivative[lane],
            speed_limit: self.speed_limit[lane],
            speed_gain: self.speed_gain[lane],
            speed_integral: self.speed_integral[lane],
            output_limit: self.output_limit[lane],
            encoder_step: self.encoder_step[lane],
            ..self.common
        }
    }

    /// Positions with the encoder's steps.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    fn positions(&self, seen: &Seen<N>) -> Wide<N> {
        let mut positions = [0.0; N];
        for lane in 0..N {
            let motor = if self.is_plain[lane] {
                self.start[lane] + seen.angle_rad[lane]
            } else {
                seen.shown_rad[lane] + (seen.angle_rad[lane] - seen.moved_rad[lane])
            };
            let position = match self.common.feedback {
                Feedback::Load => seen.shown_rad[lane],
                Feedback::Motor => motor,
            };
            positions[lane] = position;
        }
        for lane in 0..N {
            positions[lane] = quantised_in_lane(positions[lane], self.encoder_step[lane]);
        }
        positions
    }

    /// The speeds that the controllers take.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    fn speeds(&mut self, positions: &Wide<N>, speeds: &Wide<N>) -> Wide<N> {
        let Some(before) = self.positions.get_mut(self.oldest) else { return *speeds };
        let span_s = self.tick_s * f64::from(self.common.speed_samples);
        let speeds = core::array::from_fn(|lane| (positions[lane] - before[lane]) / span_s);
        *before = *positions;
        self.oldest = (self.oldest + 1) % self.positions.len();
        speeds
    }
}

impl<const N: usize> LaneControl<N> for AxisLanes<N> {
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    fn decide(&mut self, seen: &Seen<N>, references: &mut Wide<N>) {
        let tick_s = self.tick_s;
        if self.asked == Asked::Output {
            for lane in 0..N {
                references[lane] = within(seen.command[lane], self.output_limit[lane]);
            }
            return;
        }
        let positions = self.positions(seen);
        let speeds = self.speeds(&positions, &seen.speed_rad_per_s);
        let errors: Wide<N> = core::array::from_fn(|lane| seen.command[lane] - positions[lane]);
        let before = self.last_error.replace(errors).unwrap_or(errors);
        for lane in 0..N {
            let law = self.law(lane);
            let mut integrals = Integrals {
                position: self.integral_of_position[lane],
                speed: self.integral_of_speed[lane],
            };
            references[lane] = match self.asked {
                Asked::Position => {
                    integrals.position(&law, tick_s, [errors[lane], before[lane]], speeds[lane])
                }
                _ => integrals.regulate(&law, tick_s, seen.command[lane], speeds[lane]).0,
            };
            self.integral_of_position[lane] = integrals.position;
            self.integral_of_speed[lane] = integrals.speed;
        }
    }
}
