//! Ports of a model, and the laws of causes there: torque against the motion, drive, sensor.

use core::f64::consts::TAU;

use ema_sim::{Effect, ShaftMoment, ShaftTorque};

use crate::model::Test;

/// Numbers of a cause in a run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Law {
    /// Dry friction: torque.
    DryFriction(f64),
    /// Drag: torque over speed.
    Drag(f64),
    /// Torque whichever way the machine moves.
    ConstantTorque(f64),
    /// An effect of the catalogue on the shaft.
    Effect(Effect),
    /// Share by which the drive makes less than asked for.
    DriveLoss(f64),
    /// Time by which the drive comes late, s.
    DriveDelay(f64),
    /// Share by which the sensor shows more.
    SensorGain(f64),
    /// Time by which the sensor comes late, s.
    SensorDelay(f64),
    /// Error of the sensor over the turn: sine and cosine.
    SensorEccentricity([f64; 2]),
}

/// Motion that a model told its ports.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Seen {
    pub(crate) positions: Vec<f64>,
    pub(crate) speeds: Vec<f64>,
}

/// The ports of a model in one run.
///
/// Samples are counted from zero. A sample may be asked for several times, by the stages of an
/// integrator; the last one counts.
#[derive(Clone, Debug)]
pub struct PortsInUse {
    sample_s: f64,
    load: Vec<f64>,
    laws: Vec<Law>,
    inertia: Option<f64>,
    kick: f64,
    asked: Vec<f64>,
    shown: Vec<f64>,
    rubbed: Vec<f64>,
    seen: Seen,
}

impl PortsInUse {
    /// Ports at which nothing acts but the load of the test.
    pub fn none(test: &Test) -> Self {
        Self::with(test, Vec::new(), None)
    }

    /// Ports at which causes act. Dry friction stops a machine of this inertia within a sample and
    /// not faster.
    pub(crate) fn with(test: &Test, laws: Vec<Law>, inertia: Option<f64>) -> Self {
        Self {
            sample_s: 1.0 / test.rate_hz,
            load: test.load.clone(),
            laws,
            inertia,
            kick: 0.0,
            asked: Vec::new(),
            shown: Vec::new(),
            rubbed: Vec::new(),
            seen: Seen::default(),
        }
    }

    /// Ports with a torque more in the first sample.
    pub(crate) fn with_kick(test: &Test, kick: f64) -> Self {
        Self { kick, ..Self::none(test) }
    }

    pub(crate) fn seen(&self) -> &Seen {
        &self.seen
    }

    /// Torque, or force, against positive motion in a sample: the load of the test and what causes
    /// add.
    pub fn load(&mut self, sample: usize, position: f64, speed: f64) -> f64 {
        put(&mut self.seen.positions, sample, position);
        put(&mut self.seen.speeds, sample, speed);
        let known = self.load.get(sample).or(self.load.last()).copied().unwrap_or(0.0);
        let kick = if sample == 0 { self.kick } else { 0.0 };
        let time_s = sample as f64 * self.sample_s;
        let moment = ShaftMoment { position, speed, time_s };
        let mut against = known + kick;
        let mut dry = [0.0; 2];
        for law in &self.laws {
            let on_shaft = law.on_shaft(&moment);
            against += on_shaft.against;
            dry = [dry[0] + on_shaft.dry[0], dry[1] + on_shaft.dry[1]];
        }
        against + self.rubbing(sample, speed, dry)
    }

    /// Drive's answer to what is asked for in a sample.
    pub fn drive(&mut self, sample: usize, asked: f64) -> f64 {
        put(&mut self.asked, sample, asked);
        let delay_s: f64 = self.laws.iter().map(Law::drive_delay_s).sum();
        let gain: f64 = self.laws.iter().map(Law::drive_gain).product();
        gain * before(&self.asked, sample, delay_s / self.sample_s)
    }

    /// The position that a sensor shows in a sample.
    pub fn sensor(&mut self, sample: usize, position: f64) -> f64 {
        let shown =
            self.laws.iter().fold(position, |shown, law| shown + law.sensor_error(position));
        put(&mut self.shown, sample, shown);
        let delay_s: f64 = self.laws.iter().map(Law::sensor_delay_s).sum();
        before(&self.shown, sample, delay_s / self.sample_s)
    }

    /// Dry friction against the motion: all of it, or what stops the machine by the next sample if
    /// that is less.
    ///
    /// ```text
    /// T = clamp(M·ω_k/Δt + M·(ω_k − ω_{k−1})/Δt + T_{k−1}, −F_backward, F_forward)
    /// ```
    ///
    /// The last two terms are the other torques a sample before. At rest what is left of the speed
    /// is their change over a sample.
    fn rubbing(&mut self, sample: usize, speed: f64, dry: [f64; 2]) -> f64 {
        if dry == [0.0; 2] {
            return 0.0;
        }
        let before = sample.checked_sub(1);
        let last = |of: &[f64]| before.and_then(|at| of.get(at)).copied();
        let stops = match self.inertia {
            Some(inertia) => {
                let (slower, rubbed) = (last(&self.seen.speeds), last(&self.rubbed));
                let per_speed = inertia / self.sample_s;
                per_speed * (2.0 * speed - slower.unwrap_or(speed)) + rubbed.unwrap_or(0.0)
            }
            None => f64::INFINITY * speed,
        };
        let torque = if stops >= 0.0 { stops.min(dry[1]) } else { stops.max(-dry[0]) };
        put(&mut self.rubbed, sample, torque);
        torque
    }
}

impl Law {
    /// Torque on the shaft.
    fn on_shaft(&self, at: &ShaftMoment) -> ShaftTorque {
        let smooth = |against| ShaftTorque { against, dry: [0.0; 2] };
        match self {
            Self::DryFriction(torque) => ShaftTorque { against: 0.0, dry: [*torque; 2] },
            Self::Drag(drag) => smooth(drag * at.speed),
            Self::ConstantTorque(torque) => smooth(*torque),
            Self::Effect(effect) => effect.on_shaft(at),
            _ => smooth(0.0),
        }
    }

    fn drive_delay_s(&self) -> f64 {
        if let Self::DriveDelay(delay_s) = self { *delay_s } else { 0.0 }
    }

    fn drive_gain(&self) -> f64 {
        if let Self::DriveLoss(loss) = self { 1.0 - loss } else { 1.0 }
    }

    fn sensor_delay_s(&self) -> f64 {
        if let Self::SensorDelay(delay_s) = self { *delay_s } else { 0.0 }
    }

    fn sensor_error(&self, position: f64) -> f64 {
        match self {
            Self::SensorGain(gain) => gain * position,
            Self::SensorEccentricity([sine, cosine]) => {
                let turn = libm::remainder(position, TAU);
                sine * libm::sin(turn) + cosine * libm::cos(turn)
            }
            _ => 0.0,
        }
    }
}

/// Replaces a sample, or adds it, with what was last before it between.
fn put(signal: &mut Vec<f64>, sample: usize, value: f64) {
    let last = signal.last().copied().unwrap_or(value);
    if sample >= signal.len() {
        signal.resize(sample + 1, last);
    }
    signal[sample] = value;
}

/// The signal so many samples before, between two of them in a straight line; before its start as
/// at its start.
fn before(signal: &[f64], sample: usize, delay: f64) -> f64 {
    let at = (sample as f64 - delay).max(0.0);
    let (whole, part) = (at as usize, at.fract());
    let (here, next) = (signal[whole], signal[(whole + 1).min(sample)]);
    here + part * (next - here)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ports(laws: Vec<Law>) -> PortsInUse {
        let test = Test { rate_hz: 100.0, command: vec![0.0; 10], load: vec![0.25] };
        PortsInUse::with(&test, laws, Some(1.0))
    }

    #[test]
    fn a_late_drive_holds_its_first_value_and_then_follows() {
        let mut late = ports(vec![Law::DriveDelay(0.015), Law::DriveLoss(0.1)]);
        let made: Vec<f64> = (0..5).map(|n| late.drive(n, n as f64 + 1.0)).collect();
        for (made, expected) in made.iter().zip([1.0, 1.0, 1.5, 2.5, 3.5]) {
            assert!((made - 0.9 * expected).abs() < 1e-12, "{made} for {expected}");
        }
    }

    #[test]
    fn friction_opposes_motion_and_holds_at_rest() {
        let mut rubbing = ports(vec![Law::DryFriction(2.0)]);
        assert_eq!(rubbing.load(0, 0.0, 5.0), 2.25);
        assert_eq!(rubbing.load(1, 0.0, -5.0), -1.75);
        // the brake of sample 1 still shows: the load alone sped the mass of 1 up meanwhile
        let mut held = ports(vec![Law::DryFriction(2.0)]);
        assert_eq!(held.load(0, 0.0, 0.0), 0.25);
        let speed = -0.25 * 0.01;
        let next = held.load(1, 0.0, speed);
        assert!((next - (0.25 + 2.0 * speed / 0.01)).abs() < 1e-12, "{next}");
    }

    #[test]
    fn a_machine_at_rest_stays_there_under_friction() {
        let (mut rubbing, mut speed) = (ports(vec![Law::DryFriction(2.0)]), 0.3);
        for sample in 0..50 {
            speed += 0.01 * (1.0 - rubbing.load(sample, 0.0, speed));
        }
        assert!(speed.abs() < 1e-9, "{speed}");
    }

    #[test]
    fn a_stage_that_asks_again_replaces_its_sample() {
        let mut plain = ports(Vec::new());
        assert_eq!(plain.drive(0, 1.0), 1.0);
        assert_eq!(plain.drive(0, 3.0), 3.0);
        assert_eq!(plain.sensor(2, 7.0), 7.0);
        assert_eq!(plain.seen(), &Seen::default());
    }
}
