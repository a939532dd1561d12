//! Carrier periods with all three legs connected.

use super::{End, MOST_IN_A_HOLD, Run, event::Event};
use crate::{event_limit::EventLimit, phase::PerPhase, probe::Probe};

/// Length of the edges of a carrier period, in which all legs are at the lower rail.
fn edge_s(duties: &PerPhase, period_s: f64) -> f64 {
    0.25 * (1.0 - duties.iter().copied().fold(-1.0, f64::max)) * period_s
}

impl<P: Probe> Run<P> {
    /// The first edge of a first carrier period.
    pub(crate) fn first_three_leg_edge(&mut self, duties: &PerPhase, period_s: f64) {
        self.legs_v = [-self.half_bus_v; 3];
        self.hold_connected(edge_s(duties, period_s));
    }

    /// One carrier period from the end of its first edge on with all three legs connected, each
    /// at the upper rail for its duty `(1 + u)/2`, centred; up to the end of the next period's
    /// first edge. What the electronics sample at the seam is left in [`Self::sample`].
    ///
    /// ```text
    /// −−− │ +−− │ ++− │ +++ │ ++− │ +−− │ −−− ┊ −−− │ …
    /// edge             centre             edge  seam
    /// ```
    pub(crate) fn three_leg_period(
        &mut self,
        duties: &PerPhase,
        next_duties: &PerPhase,
        period_s: f64,
    ) {
        self.follow_rotor();
        let rises_s = duties.map(|u| 0.25 * (1.0 - u) * period_s);
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|a, b| rises_s[*a].total_cmp(&rises_s[*b]));
        self.legs_v = [-self.half_bus_v; 3];
        let mut now_s = rises_s[order[0]];
        for phase in order {
            self.hold_connected(rises_s[phase] - now_s);
            now_s = rises_s[phase];
            self.legs_v[phase] = self.half_bus_v;
        }
        self.hold_connected(period_s - 2.0 * now_s);
        for phase in order.into_iter().rev() {
            self.hold_connected(now_s - rises_s[phase]);
            now_s = rises_s[phase];
            self.legs_v[phase] = -self.half_bus_v;
        }
        self.connected_over_seam(now_s, edge_s(next_duties, period_s));
    }

    /// All legs at the lower rail to the seam of two carrier periods and on, mostly in one
    /// segment.
    fn connected_over_seam(&mut self, before_s: f64, after_s: f64) {
        let span_s = before_s + after_s;
        // with effects the sample is taken between two segments
        if span_s <= self.longest_s && self.extension.is_none() && !self.own_circuit {
            let step = self.solve_connected::<false>(span_s);
            let end = End::of(&step.segment, span_s);
            if !self.interrupted::<false>(&step, &end, span_s) {
                self.sample = self.sample_at(&End::of(&step.segment, before_s));
                self.observe_connected::<false>(&step, span_s);
                self.commit(&end);
                return;
            }
        }
        self.hold_connected(before_s);
        self.take_sample();
        self.hold_connected(after_s);
    }

    /// A period with the legs at their averages: what the carrier becomes without ripple.
    pub(crate) fn averaged_period(&mut self, duties: &PerPhase, period_s: f64) {
        self.follow_rotor();
        self.legs_v = duties.map(|u| u * self.half_bus_v);
        self.hold_connected(period_s);
        self.take_sample();
    }

    /// Holds all three legs at their potentials for a time.
    pub(super) fn hold_connected(&mut self, span_s: f64) {
        if self.own_circuit {
            self.hold_connected_own(span_s);
        } else {
            self.hold_connected_as::<false>(span_s);
        }
    }

    #[cold]
    fn hold_connected_own(&mut self, span_s: f64) {
        self.hold_connected_as::<true>(span_s);
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the path without effects pays nothing for them")]
    fn hold_connected_as<const OWN: bool>(&mut self, span_s: f64) {
        let (mut left_s, mut event_limit) = (span_s, EventLimit::over(span_s, MOST_IN_A_HOLD));
        while left_s > 0.0 {
            let span_s = self.take_effects_in(left_s.min(self.longest_s));
            let from = self.mark();
            let step = self.solve_connected::<OWN>(span_s);
            let mut end = End::of(&step.segment, span_s);
            let (mut event, mut at_s) = (Event::Switching, span_s);
            if self.interrupted::<OWN>(&step, &end, span_s) {
                (event, at_s) = self.first_event(&step, &end, span_s);
                at_s = event_limit.put_off(at_s, span_s);
                end = End::of(&step.segment, at_s);
            }
            self.observe_connected::<OWN>(&step, at_s);
            self.commit(&end);
            self.advance_effects(at_s, &from);
            if event != Event::Switching {
                self.handle(event, self.torque_n_m::<OWN>(&step, at_s));
            }
            left_s -= at_s;
        }
    }
}
