//! The cascades of machines side by side.

use crate::{
    plant::{LaneControl, LaneLaw, Seen},
    wide::{Wide, of_each},
};

use super::{Law, Measured};

/// Cascades that differ in their numbers alone.
#[derive(Clone, Debug)]
pub(crate) struct CascadeLanes<const N: usize> {
    /// Law with the choices that all of them share.
    common: Law,
    gear_ratio: Wide<N>,
    position_gain: Wide<N>,
    integral_step: Wide<N>,
    speed_limit_rad_per_s: Wide<N>,
    speed_gain_a_s_per_rad: Wide<N>,
    current_limit_a: Wide<N>,
    integral_a: Wide<N>,
}

impl<const N: usize> CascadeLanes<N> {
    /// Cascades with their integrals; the last ones fill what is left of the lanes. `None` where
    /// there is none.
    fn of(laws: &[(Law, f64)]) -> Option<Self> {
        let (common, _) = *laws.first()?;
        let of = |number: &dyn Fn(&Law) -> f64| of_each(laws, |(law, _)| number(law));
        Some(Self {
            common,
            gear_ratio: of(&|law| law.gear_ratio),
            position_gain: of(&|law| law.position_gain),
            integral_step: of(&|law| law.integral_step),
            speed_limit_rad_per_s: of(&|law| law.controller.speed_limit_rad_per_s),
            speed_gain_a_s_per_rad: of(&|law| law.controller.speed_gain_a_s_per_rad),
            current_limit_a: of(&|law| law.controller.current_limit_a),
            integral_a: of_each(laws, |(_, integral_a)| *integral_a),
        })
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    fn law(&self, lane: usize) -> Law {
        let mut law = self.common;
        law.gear_ratio = self.gear_ratio[lane];
        law.position_gain = self.position_gain[lane];
        law.integral_step = self.integral_step[lane];
        law.controller.speed_limit_rad_per_s = self.speed_limit_rad_per_s[lane];
        law.controller.speed_gain_a_s_per_rad = self.speed_gain_a_s_per_rad[lane];
        law.controller.current_limit_a = self.current_limit_a[lane];
        law
    }
}

/// A cascade's law with its integral.
impl LaneLaw for (Law, f64) {
    type Lanes<const N: usize> = CascadeLanes<N>;

    fn is_like(&self, other: &Self) -> bool {
        let of = |(law, _): &Self| (law.controller.position_sensor, law.mode);
        of(self) == of(other)
    }

    fn lanes<const N: usize>(laws: &[Self]) -> Option<CascadeLanes<N>> {
        CascadeLanes::of(laws)
    }
}

impl<const N: usize> LaneControl<N> for CascadeLanes<N> {
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    fn decide(&mut self, seen: &Seen<N>, references: &mut Wide<N>) {
        for lane in 0..N {
            let law = self.law(lane);
            let measured = Measured {
                surface_rad: seen.shown_rad[lane],
                motor_rad: seen.angle_rad[lane],
                speed_rad_per_s: seen.speed_rad_per_s[lane],
            };
            let held_rad = law.held_rad(&measured);
            let error = law.error(seen.command[lane], held_rad, measured.speed_rad_per_s);
            let integral_a = self.integral_a[lane];
            let wanted_a = law.wanted_a(error, integral_a);
            (references[lane], self.integral_a[lane]) = law.limited_a(wanted_a, error, integral_a);
        }
    }
}
