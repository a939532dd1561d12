//! The field-oriented drive's machine: its current follows the set-point through a loop.

use crate::{
    drive_train::Direction,
    event_limit::EventLimit,
    extension::{Extension, MotorState},
    params::Actuator,
    scenario::Scenario,
    series::{RECIPROCALS, Series, less, root, value},
    shape_function::{Near, ShapeFunction},
    winding::{LocalQuadratic, Shaft, first, second},
};

use super::{
    Event, MOST_IN_A_TICK, Motion, Run, SHORTEST_RATIO, SegmentEnd,
    quadrature_loop::{Answer, LoopState, QuadratureLoop},
};

/// A segment with effects in which the loop holds the current.
#[derive(Clone, Copy, Debug)]
pub(super) struct RegulatedSegment {
    /// Current that the loop drives to.
    pub(super) wanted_a: f64,
    pub(super) span_s: f64,
    pub(super) coupling: LocalQuadratic,
    pub(super) resistance_ohm: f64,
}

impl Run {
    /// Takes on the loop of a field-oriented drive.
    pub(super) fn start_loop(&mut self, actuator: &Actuator, scenario: &Scenario) {
        self.quadrature_loop = QuadratureLoop::new(actuator);
        if self.quadrature_loop.is_some() {
            let emf_v = self.equivalent().0[0] * self.train.speed_rad_per_s;
            self.take(QuadratureLoop::start(scenario.initial.current_integral_v, emf_v));
        }
    }

    /// The equivalent machine near the rotor's angle.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    pub(super) fn near(&self, shape: &ShapeFunction) -> Near {
        let motor_rad = self.start_angle_rad + self.train.angle_rad;
        shape.near(motor_rad, &self.winding.gap(&self.rotor))
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    fn loop_state(&self) -> LoopState {
        LoopState { current_a: self.current_a, behind_v: self.behind_v }
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    pub(super) fn take(&mut self, state: LoopState) {
        (self.current_a, self.behind_v) = (state.current_a, state.behind_v);
    }

    /// Holds the set-point for a tick.
    pub(super) fn advance_regulated(&mut self, reference_a: f64, span_s: f64) {
        let Some(law) = self.quadrature_loop else { return };
        let (mut left_s, mut event_limit) = (span_s, EventLimit::over(span_s, MOST_IN_A_TICK));
        while left_s > 0.0 {
            let Some(shape) = &self.shape else { return };
            let near = self.near(shape);
            let speed = self.train.speed_rad_per_s;
            let shaped_s = shape.longest_s(speed).max(SHORTEST_RATIO * span_s);
            let segment_s = left_s.min(shaped_s).min(law.longest_s);
            let resistance_ohm = shape.resistance_ohm(&near);
            let needed_v = resistance_ohm * reference_a + near.coupling[0] * speed;
            left_s -= if needed_v.abs() > self.limit_v {
                let applied_v = self.limit_v.copysign(needed_v);
                self.at_the_limit(&near, resistance_ohm, applied_v, segment_s, &mut event_limit)
            } else {
                self.regulated_segment(&law, &near, reference_a, segment_s, &mut event_limit)
            };
        }
    }

    /// A segment with the supply all used, the loop at its end; returns its length.
    #[cold]
    fn at_the_limit(
        &mut self,
        near: &Near,
        resistance_ohm: f64,
        applied_v: f64,
        segment_s: f64,
        event_limit: &mut EventLimit,
    ) -> f64 {
        let coupling = &near.coupling;
        let emf_v = coupling[0] * self.train.speed_rad_per_s;
        let current_a = (applied_v - emf_v) / resistance_ohm;
        self.take(LoopState { current_a, behind_v: 0.0 });
        if self.train.direction == Direction::Stuck {
            self.train.stand_still(coupling[0] * self.current_a);
            if self.train.direction == Direction::Stuck {
                return segment_s;
            }
            self.renew();
        }
        let speed = self.train.speed_rad_per_s;
        let motion = Motion::at_voltage(&self.shaft, coupling, resistance_ohm, applied_v, speed);
        self.follow(&motion, segment_s, coupling, event_limit)
    }

    /// A segment in which the loop holds the current; returns its length.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the monitor's inner loop: a third of its time")]
    fn regulated_segment(
        &mut self,
        law: &QuadratureLoop,
        near: &Near,
        reference_a: f64,
        segment_s: f64,
        event_limit: &mut EventLimit,
    ) -> f64 {
        let coupling = &near.coupling;
        if self.train.direction == Direction::Stuck {
            self.train.stand_still(coupling[0] * self.current_a);
            self.renew();
        }
        let speed = self.train.speed_rad_per_s;
        let answer = law.answer(self.loop_state(), reference_a, near, &self.shaft, speed);
        if self.train.direction == Direction::Stuck {
            return self.rest(&answer, coupling[0], segment_s, event_limit);
        }
        let motion = Motion::at_series(&self.shaft, coupling, &answer.current, speed, &law.fifth);
        let (event, taken_s) = self.glide(&motion, segment_s, event_limit);
        self.take(answer.at(taken_s));
        if event != Event::Tick {
            self.handle(event, coupling[0] * self.current_a);
        }
        taken_s
    }

    /// Rests while the current changes, until its torque is beyond the static friction; returns
    /// the time taken.
    fn rest(
        &mut self,
        answer: &Answer,
        constant: f64,
        segment_s: f64,
        event_limit: &mut EventLimit,
    ) -> f64 {
        let torque = answer.current.map(|current| constant * current);
        let (backward_n_m, forward_n_m) = self.train.breakaway_n_m();
        let end_n_m = value(&torque, segment_s);
        let mut taken_s = segment_s;
        let broken = if end_n_m > forward_n_m {
            Some((Direction::Forward, forward_n_m))
        } else if end_n_m < backward_n_m {
            Some((Direction::Backward, backward_n_m))
        } else {
            None
        };
        if let Some((direction, from_n_m)) = broken {
            let at_s = root(&less(&torque, from_n_m), segment_s);
            taken_s = event_limit.put_off(at_s, segment_s);
            self.train.break_away(direction);
            self.renew();
        }
        self.segments += 1;
        self.take(answer.at(taken_s));
        taken_s
    }

    /// A segment with effects in which the loop holds the current; returns its length.
    #[cold]
    pub(super) fn regulated_with_effects(
        &mut self,
        extension: &mut Extension,
        law: &QuadratureLoop,
        segment: &RegulatedSegment,
        event_limit: &mut EventLimit,
    ) -> f64 {
        let RegulatedSegment { wanted_a, span_s, coupling, resistance_ohm } = *segment;
        let Some(shape) = &self.shape else { return span_s };
        let near = Near { coupling, turns: self.near(shape).turns };
        let speed = self.train.speed_rad_per_s;
        let before = law.answer(self.loop_state(), wanted_a, &near, &self.shaft, speed);
        let middle_a = before.at(0.5 * span_s).current_a;
        let motor_n_m = coupling[0] * middle_a;
        self.take_effects(extension, motor_n_m, span_s);
        let heat_w = resistance_ohm * middle_a * middle_a;
        let from = MotorState { angle_rad: self.train.angle_rad, speed_rad_per_s: speed };
        if self.train.direction == Direction::Stuck {
            self.train.stand_still(coupling[0] * self.current_a);
            if self.train.direction == Direction::Stuck {
                let taken_s = self.rest(&before, coupling[0], span_s, event_limit);
                extension.advance(taken_s, from, from, heat_w);
                return taken_s;
            }
            self.renew();
            self.take_effects(extension, motor_n_m, span_s);
        }
        let answer = law.answer(self.loop_state(), wanted_a, &near, &self.shaft, speed);
        let motion = Motion::at_series(&self.shaft, &coupling, &answer.current, speed, &law.fifth);
        let (event, taken_s) = self.glide(&motion, span_s, event_limit);
        self.take(answer.at(taken_s));
        self.end_segment(extension, SegmentEnd { event, taken_s, from, heat_w, motor_n_m });
        taken_s
    }
}

impl Motion {
    /// With a current that changes; `fifth` stands for the fifth power of time, which the current's
    /// fourth makes of the speed.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
    pub(super) fn at_series(
        shaft: &Shaft,
        v: &LocalQuadratic,
        current: &Series,
        w0: f64,
        fifth: &[f64; 4],
    ) -> Self {
        let (j, c) = (&shaft.per_inertia, shaft.viscous_n_m_s_per_rad);
        let [i0, i1, i2, i3, i4] = *current;
        let w1 = (v[0] * i0 + shaft.external_n_m - c * w0) * j[0];
        let d2 = RECIPROCALS[1] * w1;
        let v1 = first(v, w0);
        let w2 = (v1 * i0 + v[0] * i1 - c * w1) * j[1];
        let v2 = second(v, w0, d2);
        let w3 = (v2 * i0 + v1 * i1 + v[0] * i2 - c * w2) * j[2];
        let w4 = (v2 * i1 + v1 * i2 + v[0] * i3 - c * w3) * j[3];
        let w5 = (v2 * i2 + v1 * i3 + v[0] * i4 - c * w4) * (0.2 * j[0]);
        let f = fifth;
        Self {
            speed: [w0, w1 + w5 * f[0], w2 + w5 * f[1], w3 + w5 * f[2], w4 + w5 * f[3]],
            turn: [0.0, w0, d2, w2 * RECIPROCALS[2], RECIPROCALS[3] * w3],
        }
    }
}
