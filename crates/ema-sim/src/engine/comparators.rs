//! Hysteresis control: every leg by a comparator on its phase.

use super::{End, Run, event::Event};
use crate::{
    event_limit::EventLimit,
    probe::Probe,
    series::{Series, less, root, value},
    winding::Segment,
};

/// Events in a tick of comparators, which switch as often as their band asks for.
const MOST_IN_A_TICK: u32 = 1 << 14;

/// Set-point less current of the positive, the negative and the idle phase.
fn errors_a(reference_a: f64, positive_a: f64, idle_a: f64) -> [f64; 3] {
    [reference_a - positive_a, positive_a + idle_a - reference_a, -idle_a]
}

/// Set-point less current of the positive, the negative or the idle phase, over a segment.
fn error_series(reference_a: f64, segment: &Segment, place: usize) -> Series {
    core::array::from_fn(|m| {
        let (positive, idle) = (segment.positive[m], segment.idle[m]);
        let constant = if m == 0 { reference_a } else { 0.0 };
        match place {
            0 => constant - positive,
            1 => positive + idle - constant,
            _ => -idle,
        }
    })
}

impl<P: Probe> Run<P> {
    /// One tick under hysteresis control: every leg by its comparator.
    pub(crate) fn comparators(&mut self, reference_a: f64, half_band_a: f64, span_s: f64) {
        if self.own_circuit {
            self.comparators_as::<true>(reference_a, half_band_a, span_s);
        } else {
            self.comparators_as::<false>(reference_a, half_band_a, span_s);
        }
    }

    fn comparators_as<const OWN: bool>(&mut self, reference_a: f64, half_band_a: f64, span_s: f64) {
        let (mut left_s, mut event_limit) = (span_s, EventLimit::over(span_s, MOST_IN_A_TICK));
        while left_s > 0.0 {
            let off_a = errors_a(reference_a, self.positive_a, self.idle_a);
            let phases = [self.at.positive, self.at.negative, self.at.idle];
            for (error_a, phase) in off_a.into_iter().zip(phases) {
                if error_a.abs() > half_band_a {
                    self.legs_v[phase] = self.half_bus_v.copysign(error_a);
                }
            }
            let span_s = self.take_effects_in(left_s.min(self.longest_s));
            let from = self.mark();
            let step = self.solve_connected::<OWN>(span_s);
            let mut end = End::of(&step.segment, span_s);
            let (mut event, mut at_s) = (Event::Switching, span_s);
            if self.interrupted::<OWN>(&step, &end, span_s) {
                (event, at_s) = self.first_event(&step, &end, span_s);
            }
            let ends_a = errors_a(
                reference_a,
                value(&step.segment.positive, at_s),
                value(&step.segment.idle, at_s),
            );
            for (place, phase) in phases.into_iter().enumerate() {
                let sign = self.legs_v[phase].signum();
                if ends_a[place] * sign < -half_band_a {
                    let error = error_series(reference_a, &step.segment, place);
                    let when_s = root(&less(&error, -sign * half_band_a), at_s);
                    if when_s < at_s {
                        (event, at_s) = (Event::Comparator(phase), when_s);
                    }
                }
            }
            if at_s < span_s {
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
