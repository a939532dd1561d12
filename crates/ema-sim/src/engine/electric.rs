//! Effects on winding, supply, commutation and the current's sensor.

use super::{
    End, Run, Step,
    elastic::{Flank, Loops, Spring},
};
use crate::{
    field_oriented::PhaseAngles,
    phase::{PerPhase, Sector},
    probe::Probe,
    series::value,
    waveform::Corners,
    winding::{Coupling, LegVolts, LoopVolts, Segment},
};

/// Changes of the circuit with the current of an instant.
#[derive(Clone, Copy)]
pub(super) struct Shares {
    /// Torque constant over that without current.
    pub(super) coupling_ratio: f64,
    /// Supply over that without load.
    pub(super) supply_ratio: f64,
}

/// Currents as the current loop measures them.
#[derive(Clone, Copy)]
pub(crate) struct Seen {
    pub(crate) feedback_a: f64,
    pub(crate) currents_a: PerPhase,
}

impl<P: Probe> Run<P> {
    /// Takes over what effects change for good: circuit, sectors, the wave of the back-EMF.
    #[cold]
    pub(super) fn rewire(&mut self) {
        let Some(extension) = &mut self.extension else { return };
        self.flank = extension.hand_over_surface().then_some(Flank::Loose);
        self.own_circuit =
            self.shorted.is_some() || self.flank.is_some() || extension.has_own_circuit();
        let pole_pairs = self.winding.pole_pairs();
        if let Some(wave) = extension.waveform() {
            self.lead_rad = extension.commutation_lead_rad(pole_pairs);
            let electrical_rad = pole_pairs * (self.start_angle_rad + self.train.angle_rad);
            if self.winding.is_trapezoidal() {
                self.corners = Some(Corners::about(&wave, electrical_rad));
                self.winding.reshape(wave, electrical_rad);
                self.turn_corner(0);
            }
            let led_rad = electrical_rad + pole_pairs * self.lead_rad;
            self.enter(Sector::of_electrical_angle(led_rad));
        }
        self.take_sample();
        self.read_sensor(0.0);
    }

    /// Goes on by a corner of the back-EMF's wave.
    pub(super) fn turn_corner(&mut self, step: i64) {
        let Some(corners) = &mut self.corners else { return };
        corners.cross(step);
        let (low_rad, high_rad) = corners.span_rad();
        self.winding.move_wave(0.5 * (low_rad + high_rad));
        let pole_pairs = self.winding.pole_pairs();
        let from_start = |electrical_rad: f64| electrical_rad / pole_pairs - self.start_angle_rad;
        self.corner_rad = (from_start(low_rad), from_start(high_rad));
    }

    /// Amplitude of the phases' currents: of a conducting pair that of both, of three sinusoidal
    /// ones their peak.
    pub(super) fn amplitude_a(&self, positive_a: f64, idle_a: f64) -> f64 {
        let negative_a = positive_a + idle_a;
        let squares = positive_a * positive_a + negative_a * negative_a + idle_a * idle_a;
        libm::sqrt(if self.whole_turn { 2.0 / 3.0 } else { 0.5 } * squares)
    }

    /// Heat of the winding were it cold.
    pub(super) fn copper_w(&self) -> f64 {
        let of_phases_w = self.winding.sector(self.sector).copper_w(self.positive_a, self.idle_a);
        of_phases_w + self.circulating_w()
    }

    /// Torque constant and supply with currents of the positive and the idle phase and the
    /// potentials of all three legs.
    ///
    /// ```text
    /// V = V_dc − R_b·Σ d_j·i_j        d_j the leg's share of the upper rail
    /// ```
    pub(super) fn shares(&self, positive_a: f64, idle_a: f64, legs_v: [f64; 3]) -> Shares {
        let Some(extension) = &self.extension else {
            return Shares { coupling_ratio: 1.0, supply_ratio: 1.0 };
        };
        let [positive_v, negative_v, idle_v] = legs_v;
        let power_w =
            positive_v * positive_a - negative_v * (positive_a + idle_a) + idle_v * idle_a;
        let bus_v = 2.0 * self.half_bus_v;
        let drop_v = extension.winding().source_ohm * power_w / bus_v;
        Shares {
            coupling_ratio: extension.saturation_ratio(self.amplitude_a(positive_a, idle_a)),
            supply_ratio: (1.0 - drop_v / bus_v).max(0.0),
        }
    }

    /// Potentials of legs at the rails of a supply that sags; a floating terminal is at no rail.
    pub(super) fn on_rails(&self, legs: LegVolts, supply_ratio: f64) -> LegVolts {
        let on_rail = |leg_v: f64| {
            let at_rail = leg_v.abs() >= (1.0 - 1e-12) * self.half_bus_v;
            if at_rail { supply_ratio * leg_v } else { leg_v }
        };
        LegVolts { positive_v: on_rail(legs.positive_v), negative_v: on_rail(legs.negative_v) }
    }

    /// The solution with the circuit as the current in the middle of the span makes it.
    #[cold]
    pub(super) fn solve_own_circuit(&mut self, span_s: f64, legs: LegVolts) -> (Step, End) {
        if let Some(solution) = self.solve_shorted(span_s, legs) {
            return solution;
        }
        let coupling = self.coupling_now();
        let solve = |currents: (f64, f64)| {
            let idle_v = -self.half_bus_v * currents.1.signum() * f64::from(currents.1 != 0.0);
            let legs_v = [legs.positive_v, legs.negative_v, idle_v];
            let shares = self.shares(currents.0, currents.1, legs_v);
            let coupling = coupling.scaled(shares.coupling_ratio);
            let half_bus_v = shares.supply_ratio * self.half_bus_v;
            let legs = self.on_rails(legs, shares.supply_ratio);
            match self.spring() {
                None => self.solve_with(coupling, half_bus_v, span_s, legs),
                Some(spring) => self.solve_sprung(&spring, coupling, half_bus_v, span_s, legs),
            }
        };
        let (first, _) = solve((self.positive_a, self.idle_a));
        solve(first.middle_a(span_s))
    }

    /// As [`solve_with`](Self::solve_with), with the surface behind an elastic shaft.
    fn solve_sprung(
        &self,
        spring: &Spring,
        coupling: Coupling,
        half_bus_v: f64,
        span_s: f64,
        legs: LegVolts,
    ) -> (Step, End) {
        let diode = self.diode(&coupling, half_bus_v, legs);
        let idle_v = -diode * half_bus_v;
        let volts = LoopVolts { pair_v: legs.pair_v(), idle_v: idle_v - legs.negative_v };
        let loops = Loops { volts, open: diode == 0.0, cubic: None };
        let segment = self.sprung_segment(spring, &coupling, &loops);
        let end = End::of(&segment, span_s);
        (Step { segment, coupling, diode, pair: legs, idle_v }, end)
    }

    fn sprung_segment(&self, spring: &Spring, coupling: &Coupling, loops: &Loops) -> Segment {
        spring.solve(&self.at, &self.shaft, coupling, loops, self.segment_start())
    }

    /// The solution with all three legs connected, as the current in the middle of the span makes
    /// it.
    #[cold]
    pub(super) fn solve_own_connected(&mut self, span_s: f64) -> Step {
        if let Some(step) = self.solve_shorted_connected(span_s) {
            return step;
        }
        let (coupling, cubic) = self.connected_coupling();
        let legs_v = [self.at.positive, self.at.negative, self.at.idle].map(|j| self.legs_v[j]);
        let solve = |currents: (f64, f64)| {
            let shares = self.shares(currents.0, currents.1, legs_v);
            let cubic = cubic.map(|cubic| cubic.scaled(shares.coupling_ratio));
            let legs_v = self.legs_v.map(|v| shares.supply_ratio * v);
            let coupling = coupling.scaled(shares.coupling_ratio);
            match self.spring() {
                None => self.solve_connected_with(coupling, cubic, legs_v),
                Some(spring) => {
                    let [pair_v, low_v, idle_v] =
                        [self.at.positive, self.at.negative, self.at.idle].map(|j| legs_v[j]);
                    let volts = LoopVolts { pair_v: pair_v - low_v, idle_v: idle_v - low_v };
                    let loops = Loops { volts, open: false, cubic };
                    let segment = self.sprung_segment(&spring, &coupling, &loops);
                    let pair = LegVolts { positive_v: pair_v, negative_v: low_v };
                    Step { segment, coupling, diode: 0.0, pair, idle_v }
                }
            }
        };
        let first = solve((self.positive_a, self.idle_a));
        solve(first.middle_a(span_s))
    }

    /// The current that the drive regulates, and its pattern over the phases, at the sample.
    fn regulated(&self) -> (f64, PerPhase) {
        let sample = &self.sample;
        let motor_rad = self.start_angle_rad + sample.angle_rad;
        let electrical_rad = self.winding.pole_pairs() * (motor_rad + self.lead_rad);
        if self.whole_turn {
            let angles = PhaseAngles::of(electrical_rad);
            return (angles.axes_of(&sample.currents_a).1, angles.sin);
        }
        (sample.feedback_a, Sector::of_electrical_angle(electrical_rad).pattern())
    }

    /// Reads the current's sensor at the sample, a period after it was read last.
    #[inline]
    pub(crate) fn read_sensor(&mut self, period_s: f64) {
        if self.extension.as_ref().is_some_and(|e| e.current_sensor().is_some()) {
            self.read_wrong_sensor(period_s);
        }
    }

    #[cold]
    fn read_wrong_sensor(&mut self, period_s: f64) {
        let (current_a, _) = self.regulated();
        if let Some(extension) = &mut self.extension {
            self.sensor_error_a = extension.read_current_a(current_a, period_s) - current_a;
        }
    }

    /// The phases as the sensor shows them: its error in the pattern of the regulated current.
    pub(super) fn shown_a(&self) -> PerPhase {
        let mut shown_a = self.sample.currents_a;
        if self.sensor_error_a != 0.0 {
            let (_, pattern) = self.regulated();
            for (current_a, share) in shown_a.iter_mut().zip(pattern) {
                *current_a += share * self.sensor_error_a;
            }
        }
        shown_a
    }

    /// Currents as the current loop measures them.
    #[inline]
    pub(crate) fn seen(&self) -> Seen {
        let (feedback_a, currents_a) = (self.sample.feedback_a, self.sample.currents_a);
        if self.sensor_error_a == 0.0 {
            return Seen { feedback_a, currents_a };
        }
        let in_loop =
            self.extension.as_ref().is_some_and(|e| e.current_sensor().is_some_and(|s| s.in_loop));
        if in_loop {
            let feedback_a = feedback_a + self.sensor_error_a;
            Seen { feedback_a, currents_a: self.shown_a() }
        } else {
            Seen { feedback_a, currents_a }
        }
    }
}

impl Step {
    /// Currents of the positive and the idle phase in the middle of a span.
    pub(super) fn middle_a(&self, span_s: f64) -> (f64, f64) {
        let at_s = 0.5 * span_s;
        (value(&self.segment.positive, at_s), value(&self.segment.idle, at_s))
    }
}
