//! Carrier periods of legs with a dead time.
//!
//! A leg that changes sides opens one switch and closes the other a dead time later. In between
//! its current flows through a diode, to the lower rail when it flows into the phase and to the
//! upper one when it flows out, until it is zero; then the terminal floats. A leg with current
//! `i` so loses `V_dc·t_d·f_c·sgn i` on average.

use super::{MOST_IN_A_HOLD, Run};
use crate::{
    event_limit::EventLimit,
    phase::{PerPhase, Sector},
    probe::Probe,
    series::{Series, root, value},
    winding::LegVolts,
};

/// How a leg stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Leg {
    Low,
    Open,
    High,
}

/// A leg changes.
#[derive(Clone, Copy, Debug)]
struct Edge {
    at_s: f64,
    leg: usize,
    becomes: Leg,
}

/// Current below which a diode counts as blocking.
const BLOCKING_A: f64 = 1e-9;

/// The edges of a period, in order for each leg. A pulse shorter than two dead times, up or
/// down, is lengthened to them.
fn edges<const N: usize>(duties: [f64; N], dead_s: f64, period_s: f64) -> [[Edge; 4]; N] {
    core::array::from_fn(|leg| {
        let rise_s = (0.25 * (1.0 - duties[leg]) * period_s).clamp(dead_s, 0.5 * period_s - dead_s);
        let fall_s = period_s - rise_s;
        let edge = |at_s, becomes| Edge { at_s, leg, becomes };
        [
            edge(rise_s, Leg::Open),
            edge(rise_s + dead_s, Leg::High),
            edge(fall_s, Leg::Open),
            edge(fall_s + dead_s, Leg::Low),
        ]
    })
}

impl<P: Probe> Run<P> {
    /// One carrier period from seam to seam with all three legs connected.
    pub(crate) fn three_leg_dead_period(&mut self, duties: &PerPhase, dead_s: f64, period_s: f64) {
        self.follow_rotor();
        let mut edges = edges(*duties, dead_s, period_s);
        let edges = edges.as_flattened_mut();
        edges.sort_unstable_by(|a, b| a.at_s.total_cmp(&b.at_s));
        let (mut legs, mut now_s) = ([Leg::Low; 3], 0.0);
        for edge in edges {
            self.hold_legs(legs, edge.at_s - now_s);
            now_s = edge.at_s;
            legs[edge.leg] = edge.becomes;
        }
        self.hold_legs(legs, period_s - now_s);
        self.take_sample();
    }

    /// Holds three legs. Of those that are open the one with the least current is followed to
    /// the end of its diode's conduction; another keeps the rail that its current has now.
    fn hold_legs(&mut self, legs: [Leg; 3], span_s: f64) {
        if span_s <= 0.0 {
            return;
        }
        let currents_a = self.phases_a(self.positive_a, self.idle_a);
        let mut open: Option<usize> = None;
        for (phase, leg) in legs.iter().enumerate() {
            let current_a = currents_a[phase];
            self.legs_v[phase] = match leg {
                Leg::Low => -self.half_bus_v,
                Leg::High => self.half_bus_v,
                Leg::Open if current_a == 0.0 => self.legs_v[phase],
                Leg::Open => -self.half_bus_v.copysign(current_a),
            };
            let least = open.is_none_or(|other| current_a.abs() < currents_a[other].abs());
            if *leg == Leg::Open && least {
                open = Some(phase);
            }
        }
        match open {
            Some(phase) if self.whole_turn => {
                self.enter(Sector::from_place(2 - phase));
                let (positive, negative) = (self.at.positive, self.at.negative);
                let (positive_v, negative_v) = (self.legs_v[positive], self.legs_v[negative]);
                self.hold(span_s, LegVolts { positive_v, negative_v });
            }
            _ => self.hold_connected(span_s),
        }
    }

    /// One carrier period from seam to seam of the legs of the positive and the negative phase.
    pub(crate) fn pair_dead_period(&mut self, duty: f64, dead_s: f64, period_s: f64) {
        self.follow_gap();
        let mut edges = edges([duty, -duty], dead_s, period_s);
        let edges = edges.as_flattened_mut();
        edges.sort_unstable_by(|a, b| a.at_s.total_cmp(&b.at_s));
        let (mut legs, mut now_s) = ([Leg::Low; 2], 0.0);
        for edge in edges {
            self.hold_pair(legs, edge.at_s - now_s);
            now_s = edge.at_s;
            legs[edge.leg] = edge.becomes;
        }
        self.hold_pair(legs, period_s - now_s);
        self.take_sample();
    }

    /// Holds the legs of the pair, cut where the current of an open one ends.
    fn hold_pair(&mut self, legs: [Leg; 2], span_s: f64) {
        let (mut left_s, mut event_limit) = (span_s, EventLimit::over(span_s, MOST_IN_A_HOLD));
        while left_s > 0.0 {
            let volts = self.pair_v(legs);
            let step_s = left_s.min(self.longest_s);
            let mut at_s = step_s;
            if legs.contains(&Leg::Open) {
                at_s = self.end_of_conduction_s(legs, volts, step_s);
            }
            if at_s < step_s {
                at_s = event_limit.put_off(at_s, step_s);
            }
            self.hold(at_s, volts);
            self.block(legs);
            left_s -= at_s;
        }
    }

    /// Currents out of the legs of the pair into their phases.
    fn pair_a(&self) -> [f64; 2] {
        [self.positive_a, -(self.positive_a + self.idle_a)]
    }

    /// Potentials of the pair; an open leg without current floats with the other one.
    fn pair_v(&self, legs: [Leg; 2]) -> LegVolts {
        let currents_a = self.pair_a();
        let rail = |n: usize| match legs[n] {
            Leg::Low => Some(-self.half_bus_v),
            Leg::High => Some(self.half_bus_v),
            Leg::Open if currents_a[n].abs() < BLOCKING_A => None,
            Leg::Open => Some(-self.half_bus_v.copysign(currents_a[n])),
        };
        let within = |v: f64| v.clamp(-self.half_bus_v, self.half_bus_v);
        let emf_v = self.pair_emf_v();
        let (positive_v, negative_v) = match (rail(0), rail(1)) {
            (Some(positive_v), Some(negative_v)) => (positive_v, negative_v),
            (None, Some(negative_v)) => (within(negative_v + emf_v), negative_v),
            (Some(positive_v), None) => (positive_v, within(positive_v - emf_v)),
            (None, None) => (within(0.5 * emf_v), within(-0.5 * emf_v)),
        };
        LegVolts { positive_v, negative_v }
    }

    /// When the current of an open leg comes to zero; the whole span if it does not.
    fn end_of_conduction_s(&mut self, legs: [Leg; 2], volts: LegVolts, span_s: f64) -> f64 {
        let (step, _) = if self.own_circuit {
            self.solve::<true>(span_s, volts)
        } else {
            self.solve::<false>(span_s, volts)
        };
        let positive = step.segment.positive;
        let negative: Series = core::array::from_fn(|m| -(positive[m] + step.segment.idle[m]));
        let mut first_s = span_s;
        for (leg, current) in legs.iter().zip([positive, negative]) {
            let ends = current[0].abs() >= BLOCKING_A && current[0] * value(&current, span_s) < 0.0;
            if *leg == Leg::Open && ends {
                first_s = first_s.min(root(&current, span_s));
            }
        }
        first_s
    }

    /// Takes the rest of a current that has just ended.
    fn block(&mut self, legs: [Leg; 2]) {
        let [positive_a, negative_a] = self.pair_a();
        if legs[0] == Leg::Open && positive_a.abs() < BLOCKING_A {
            self.positive_a = 0.0;
        } else if legs[1] == Leg::Open && negative_a.abs() < BLOCKING_A {
            self.positive_a = -self.idle_a;
        }
    }
}
