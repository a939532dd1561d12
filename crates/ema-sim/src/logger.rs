//! Currents as a logger samples them, with a clock of its own.

use crate::{
    drive_train::{Direction, DriveTrain},
    ended::Ended,
    phase::PerPhase,
    probe::{Circuit, Probe},
    runaway::Runaway,
    series::value,
    winding::Segment,
};

/// Phase currents and rotor angle at the instants of a logger.
///
/// Between two ticks of the controller the currents hold the ripple of the carrier, which samples
/// at the ticks do not show: those stand where it crosses its mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoggedCurrents {
    /// Currents of the phases A, B, C, A.
    pub phase_currents_a: [Vec<f64>; 3],
    /// Rotor angle, with the start angle, rad.
    pub motor_angle_rad: Vec<f64>,
    /// Why the run ended before its test, where it did; both are NaN from there on.
    pub runaway: Option<Runaway>,
}

impl Ended for LoggedCurrents {
    fn runaway(&self) -> Option<&Runaway> {
        self.runaway.as_ref()
    }

    fn channels(&mut self) -> Vec<&mut Vec<f64>> {
        let [a, b, c] = &mut self.phase_currents_a;
        vec![a, b, c, &mut self.motor_angle_rad]
    }
}

/// Rounding of the time of a tick, s.
const TICK_ROUNDING_S: f64 = 1e-12;

/// Samples the solution of each segment at the instants that lie in it.
#[derive(Clone, Debug)]
pub(crate) struct Logger<'a> {
    /// In ascending order, s.
    instants_s: &'a [f64],
    start_angle_rad: f64,
    /// Start of the next segment, s.
    now_s: f64,
    tick_hz: f64,
    /// Ticks so far.
    ticks: usize,
    /// Error of the current's sensor in each phase in this tick, A.
    sensor_error_a: PerPhase,
    logged: LoggedCurrents,
}

impl<'a> Logger<'a> {
    pub(crate) fn new(instants_s: &'a [f64], start_angle_rad: f64, tick_hz: f64) -> Self {
        let room = || Vec::with_capacity(instants_s.len());
        let logged = LoggedCurrents {
            phase_currents_a: [room(), room(), room()],
            motor_angle_rad: room(),
            runaway: None,
        };
        Self {
            instants_s,
            start_angle_rad,
            now_s: 0.0,
            tick_hz,
            ticks: 0,
            sensor_error_a: [0.0; 3],
            logged,
        }
    }

    /// The log, filled up where the run ended early.
    pub(crate) fn logged(self, runaway: Option<Runaway>) -> LoggedCurrents {
        LoggedCurrents { runaway, ..self.logged }.filled(self.instants_s.len())
    }

    /// Logs the state at a time of a segment.
    fn log(&mut self, segment: &Segment, at_s: f64, circuit: &Circuit<'_>, train: &DriveTrain) {
        let (positive_a, idle_a) = (value(&segment.positive, at_s), value(&segment.idle, at_s));
        let mut phases_a = self.sensor_error_a;
        phases_a[circuit.at.positive] += positive_a;
        phases_a[circuit.at.idle] += idle_a;
        phases_a[circuit.at.negative] -= positive_a + idle_a;
        for (channel, current_a) in self.logged.phase_currents_a.iter_mut().zip(phases_a) {
            channel.push(current_a);
        }
        let is_at_rest = train.direction == Direction::Stuck;
        let turn_rad = if is_at_rest { 0.0 } else { value(&segment.turn, at_s) };
        self.logged.motor_angle_rad.push(self.start_angle_rad + train.angle_rad + turn_rad);
    }
}

impl Probe for Logger<'_> {
    fn segment(
        &mut self,
        segment: &Segment,
        span_s: f64,
        circuit: &Circuit<'_>,
        train: &DriveTrain,
    ) {
        let end_s = self.now_s + span_s;
        while let Some(&instant_s) = self.instants_s.get(self.logged.motor_angle_rad.len()) {
            if instant_s >= end_s {
                break;
            }
            self.log(segment, (instant_s - self.now_s).max(0.0), circuit, train);
        }
        self.now_s = end_s;
    }

    fn impact(&mut self, _: f64) {}

    fn tick(&mut self, sensor_error_a: &PerPhase) {
        let tick_s = self.ticks as f64 / self.tick_hz - TICK_ROUNDING_S;
        let now_a = core::mem::replace(&mut self.sensor_error_a, *sensor_error_a);
        self.ticks += 1;
        // a segment goes over the tick: what it logged behind that is of the new one
        let logged = self.logged.motor_angle_rad.len();
        let first = self.instants_s[..logged].partition_point(|instant_s| *instant_s < tick_s);
        for (phase, channel) in self.logged.phase_currents_a.iter_mut().enumerate() {
            let change_a = sensor_error_a[phase] - now_a[phase];
            channel[first..].iter_mut().for_each(|current_a| *current_a += change_a);
        }
    }
}
