//! Events that end a segment: which comes first, and what changes at it.

use super::{End, Run, Step, elastic::Flank};
use crate::{
    drive_train::{Crossing, Direction},
    probe::Probe,
    series::{less, reach, root, value},
};

/// Cause of a segment's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// The legs switch, or the segment is as long as it may be.
    Switching,
    /// The shaft comes to zero speed.
    Standstill,
    /// The shaft at rest breaks away.
    Breakaway(Direction),
    /// The rotor reaches the end of its sector.
    Sector(i64),
    /// The play closes, or a stop is met.
    Bound,
    /// The back-EMF of a phase comes to a corner within the sector.
    Corner(i64),
    /// A flank of the play before an elastic shaft takes hold or lets go.
    Flank(Flank),
    /// The idle phase's current ends.
    FreewheelEnd,
    /// The current of a phase leaves its comparator's band.
    Comparator(usize),
}

impl From<Crossing> for Event {
    fn from(crossing: Crossing) -> Self {
        match crossing {
            Crossing::Sector(step) => Self::Sector(step),
            Crossing::Bound => Self::Bound,
        }
    }
}

impl<P: Probe> Run<P> {
    /// True where anything happens before the end of a span.
    #[inline]
    pub(super) fn interrupted<const OWN: bool>(&self, step: &Step, end: &End, span_s: f64) -> bool {
        let freewheel_ends = end.idle_a * step.diode < 0.0;
        let shaft_changes = if self.train.direction == Direction::Stuck {
            let (backward, forward) = self.train.breakaway_n_m();
            let torque = step.coupling.torque_at_rest(&step.segment);
            if OWN {
                let torque = self.with_circulating(torque);
                let [to_back, to_forth] = self.less_spring(&torque, &step.segment);
                value(&to_forth, span_s) > forward || value(&to_back, span_s) < backward
            } else {
                let torque = value(&torque, span_s);
                torque > forward || torque < backward
            }
        } else {
            let to_rad = self.train.angle_rad + end.turn_rad;
            end.speed_rad_per_s * self.train.direction.sign() <= 0.0
                || to_rad > self.window_rad.1
                || to_rad < self.window_rad.0
        };
        let flank_changes = OWN && self.flank_event(&step.segment, span_s).is_some();
        freewheel_ends || shaft_changes || flank_changes
    }

    /// The first event within a span, and when.
    #[cold]
    pub(super) fn first_event(&self, step: &Step, end: &End, span_s: f64) -> (Event, f64) {
        let segment = &step.segment;
        let mut first = (Event::Switching, span_s);
        let mut offer = |event, at_s: f64| {
            if at_s < first.1 {
                first = (event, at_s);
            }
        };
        if end.idle_a * step.diode < 0.0 {
            offer(Event::FreewheelEnd, root(&segment.idle, span_s));
        }
        if self.flank.is_some()
            && let Some((event, at_s)) = self.flank_event(segment, span_s)
        {
            offer(event, at_s);
        }
        if self.train.direction == Direction::Stuck {
            let (backward, forward) = self.train.breakaway_n_m();
            let torque = self.with_circulating(step.coupling.torque_at_rest(segment));
            let [to_back, to_forth] =
                if self.flank.is_some() { self.less_spring(&torque, segment) } else { [torque; 2] };
            if value(&to_forth, span_s) > forward {
                // without dry friction the start itself may be the instant
                let beyond = less(&to_forth, forward);
                let at_s = if beyond[0] >= 0.0 { 0.0 } else { root(&beyond, span_s) };
                offer(Event::Breakaway(Direction::Forward), at_s);
            } else if value(&to_back, span_s) < backward {
                let beyond = less(&to_back, backward);
                let at_s = if beyond[0] <= 0.0 { 0.0 } else { root(&beyond, span_s) };
                offer(Event::Breakaway(Direction::Backward), at_s);
            }
            return first;
        }
        if end.speed_rad_per_s * self.train.direction.sign() <= 0.0 {
            offer(Event::Standstill, root(&segment.speed, span_s));
        }
        let to_rad = self.train.angle_rad + end.turn_rad;
        let sector_rad = self.sector_rad.into();
        for (crossing, at_s) in self.train.crossings(&segment.turn, to_rad, sector_rad, span_s) {
            offer(crossing.into(), at_s);
        }
        if self.corners.is_some() {
            let (step, by_rad) = if to_rad > self.corner_rad.1 {
                (1, self.corner_rad.1 - self.train.angle_rad)
            } else {
                (-1, self.corner_rad.0 - self.train.angle_rad)
            };
            if to_rad > self.corner_rad.1 || to_rad < self.corner_rad.0 {
                // where a sector has just ended at the corner, rounding may have passed it
                let ahead = by_rad * step as f64 > 0.0;
                let at_s = if ahead { reach(&segment.turn, by_rad, span_s) } else { 0.0 };
                offer(Event::Corner(step), at_s);
            }
        }
        first
    }

    /// Changes the state at an event.
    pub(super) fn handle(&mut self, event: Event, torque_n_m: f64) {
        if self.extension.is_some() && matches!(event, Event::Standstill | Event::Bound) {
            // at rest friction and torques are others than on the way there
            let moving = event == Event::Bound;
            let speed = if moving { self.train.speed_rad_per_s } else { 0.0 };
            self.take_effects(0.0, Some(speed));
        }
        match event {
            Event::Switching => {}
            Event::Standstill => self.train.stand_still(torque_n_m),
            Event::Breakaway(direction) => self.train.break_away(direction),
            Event::Sector(step) => {
                self.train.angle_rad = if step > 0 { self.sector_rad.1 } else { self.sector_rad.0 };
                self.enter(self.sector.shifted(step));
            }
            Event::Corner(step) => {
                let at_rad = if step > 0 { self.corner_rad.1 } else { self.corner_rad.0 };
                let bound = self.train.bounds_rad();
                let (low, high) = (self.sector_rad.0.max(bound.0), self.sector_rad.1.min(bound.1));
                self.train.angle_rad = at_rad.clamp(low, high);
                self.turn_corner(step);
            }
            Event::Bound => {
                let (low, high) = self.train.bounds_rad();
                let forward = self.train.direction == Direction::Forward;
                self.train.angle_rad = if forward { high } else { low };
                let before_j = self.train.kinetic_j();
                self.train.reach_bound(torque_n_m);
                self.probe.impact(before_j - self.train.kinetic_j());
            }
            Event::Flank(flank) => self.change_flank(flank),
            Event::FreewheelEnd => self.idle_a = 0.0,
            Event::Comparator(phase) => self.legs_v[phase] = -self.legs_v[phase],
        }
        self.renew();
    }
}
