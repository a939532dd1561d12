//! Runs of a machine with shorted turns: its segments, torque and heat (`shorted_loops`).

use super::{End, Run, Step};
use crate::{
    probe::Probe,
    series::Series,
    shorted_loops::{LoopDrive, ShortedLoops},
    winding::{LegVolts, LocalCubic, Segment},
};

impl<P: Probe> Run<P> {
    /// Coupling of each phase near the rotor's angle.
    fn phase_couplings(&self) -> [LocalCubic; 3] {
        let motor_rad = self.start_angle_rad + self.train.angle_rad;
        let along = self.along(self.train.angle_rad);
        self.winding.phase_couplings(&self.at, self.rotor_frame(), motor_rad, along)
    }

    /// Machine and drive as they stand, with voltages against the negative leg.
    fn loop_drive(&self, pair_v: f64, idle_v: Option<f64>, coupling_ratio: f64) -> LoopDrive<'_> {
        LoopDrive {
            at: self.winding.sector(self.sector),
            shaft: &self.shaft,
            start: self.segment_start(),
            pair_v,
            idle_v,
            coupling: self.phase_couplings().map(|k| k.map(|k| coupling_ratio * k)),
            warmth_ratio: self.warmth_ratio,
        }
    }

    /// The solution with shorted loops, the currents of which it keeps.
    fn solve_loops(
        &self,
        loops: &mut ShortedLoops,
        span_s: f64,
        legs: LegVolts,
        [at_a, idle_a]: [f64; 2],
    ) -> (Step, End) {
        let idle_v = -self.half_bus_v * idle_a.signum() * f64::from(idle_a != 0.0);
        let shares = self.shares(at_a, idle_a, [legs.positive_v, legs.negative_v, idle_v]);
        let half_bus_v = shares.supply_ratio * self.half_bus_v;
        let legs = self.on_rails(legs, shares.supply_ratio);
        let mut drive = self.loop_drive(legs.pair_v(), None, shares.coupling_ratio);
        let phases_v = loops.phases_v(&drive);
        let open_v = legs.negative_v + phases_v[self.at.idle] - phases_v[self.at.negative];
        let diode = self.diode_at(open_v, half_bus_v);
        let idle_v = -diode * half_bus_v;
        drive.idle_v = (diode != 0.0).then_some(idle_v - legs.negative_v);
        let segment = loops.solve(&drive, span_s);
        let coupling = self.coupling_now().scaled(shares.coupling_ratio);
        let end = End::of(&segment, span_s);
        (Step { segment, coupling, diode, pair: legs, idle_v }, end)
    }

    /// The solution with shorted loops and the legs of the pair held.
    pub(super) fn solve_shorted(&mut self, span_s: f64, legs: LegVolts) -> Option<(Step, End)> {
        let mut loops = self.shorted.take()?;
        let mut solution =
            self.solve_loops(&mut loops, span_s, legs, [self.positive_a, self.idle_a]);
        if self.extension.is_some() {
            let (positive_a, idle_a) = solution.0.middle_a(span_s);
            solution = self.solve_loops(&mut loops, span_s, legs, [positive_a, idle_a]);
        }
        self.shorted = Some(loops);
        Some(solution)
    }

    /// The solution with shorted loops and all three legs connected.
    pub(super) fn solve_shorted_connected(&mut self, span_s: f64) -> Option<Step> {
        let mut loops = self.shorted.take()?;
        let roles = [self.at.positive, self.at.negative, self.at.idle];
        let mut solve = |at_a: f64, idle_a: f64| {
            let shares = self.shares(at_a, idle_a, roles.map(|j| self.legs_v[j]));
            let [positive_v, negative_v, idle_v] =
                roles.map(|j| shares.supply_ratio * self.legs_v[j]);
            let between_v = Some(idle_v - negative_v);
            let drive = self.loop_drive(positive_v - negative_v, between_v, shares.coupling_ratio);
            let segment = loops.solve(&drive, span_s);
            let coupling = self.coupling_now().scaled(shares.coupling_ratio);
            let pair = LegVolts { positive_v, negative_v };
            Step { segment, coupling, diode: 0.0, pair, idle_v }
        };
        let mut step = solve(self.positive_a, self.idle_a);
        if self.extension.is_some() {
            let (positive_a, idle_a) = step.middle_a(span_s);
            step = solve(positive_a, idle_a);
        }
        self.shorted = Some(loops);
        Some(step)
    }

    /// Voltage at which the pair without current stays so, where loops are shorted.
    pub(super) fn shorted_pair_v(&self) -> Option<f64> {
        let loops = self.shorted.as_ref()?;
        Some(loops.open_pair_v(&self.loop_drive(0.0, None, 1.0)))
    }

    /// Torque of the circulating currents at a time of the segment solved last.
    pub(super) fn circulating_n_m(&self, segment: &Segment, at_s: f64) -> f64 {
        self.shorted.as_ref().map_or(0.0, |loops| loops.torque_n_m(segment, at_s))
    }

    /// Torque of the circulating currents now; 0 without such.
    pub(super) fn circulating_now_n_m(&self) -> f64 {
        self.shorted.as_ref().map_or(0.0, |loops| loops.torque_now_n_m(&self.phase_couplings()))
    }

    /// Adds that torque to the one of a rotor at rest.
    pub(super) fn with_circulating(&self, torque: Series) -> Series {
        let Some(loops) = &self.shorted else { return torque };
        let circulating = loops.torque_at_rest();
        core::array::from_fn(|m| torque[m] + circulating[m])
    }

    /// Heat that circulating currents add now to the winding, faults and all, were it cold.
    pub(super) fn circulating_w(&self) -> f64 {
        let Some(loops) = &self.shorted else { return 0.0 };
        let phases_a = self.phases_a(self.positive_a, self.idle_a);
        loops.heat_now_w(&phases_a)
    }

    /// Moves the circulating currents to the end of a segment.
    pub(super) fn move_loops(&mut self, span_s: f64) {
        if let Some(loops) = &mut self.shorted {
            loops.go_on(span_s);
        }
    }
}
