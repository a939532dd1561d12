//! Motions that a test is put together from.

use std::f64::consts::TAU;

use ema_sim::Actuator;

use crate::report::MotionLimits;

/// Rate of a planned command.
pub(super) const RATE_HZ: f64 = 1000.0;
/// Difference of times that is rounding, s.
pub(super) const SAME_TIME_S: f64 = 1e-9;
/// Rest behind each motion, s.
const REST_S: f64 = 0.05;
/// Speeds of triangles, over the limit of speed.
const SPEED_SHARES: [f64; 8] = [0.01, 0.03, 0.06, 0.11, 0.22, 0.44, 0.67, 1.0];
/// Lengths of triangles, s.
const PERIODS_S: [f64; 5] = [0.2, 0.4, 0.8, 1.6, 3.2];
/// Peak speeds of sines, over the limit of speed.
const SINE_SHARES: [f64; 3] = [0.11, 0.33, 0.8];
/// Frequencies of sines, Hz.
const SINES_HZ: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
/// Periods of a sine.
const SINE_PERIODS: f64 = 2.0;
/// Least amplitude over the play: a smaller motion stays within it.
const LEAST_PLAYS: f64 = 3.0;

/// A motion from rest at zero to rest at zero.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Motion {
    shape: Shape,
    pub(super) amplitude_rad: f64,
    moving_s: f64,
    /// Largest speed of the rotor that the command asks for.
    pub(super) rotor_rad_per_s: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// There, to the other side, and back, at one speed.
    Triangle,
    Sine,
}

impl Motion {
    /// Motions of a machine within some limits, none longer than some time.
    pub(super) fn menu(actuator: &Actuator, limits: &MotionLimits, within_s: f64) -> Vec<Self> {
        let gear = actuator.transmission.gear_ratio;
        let most_rad_per_s = limits.speed_rad_per_s;
        let triangles = SPEED_SHARES.iter().flat_map(|share| {
            PERIODS_S.map(|period_s| {
                let rotor_rad_per_s = share * most_rad_per_s;
                let amplitude_rad = rotor_rad_per_s / gear * period_s / 4.0;
                Self { shape: Shape::Triangle, amplitude_rad, moving_s: period_s, rotor_rad_per_s }
            })
        });
        let sines = SINE_SHARES.iter().flat_map(|share| {
            SINES_HZ.map(|frequency_hz| {
                let rotor_rad_per_s = share * most_rad_per_s;
                let amplitude_rad = rotor_rad_per_s / gear / (TAU * frequency_hz);
                let moving_s = SINE_PERIODS / frequency_hz;
                Self { shape: Shape::Sine, amplitude_rad, moving_s, rotor_rad_per_s }
            })
        });
        let least_rad = LEAST_PLAYS * actuator.transmission.backlash_rad;
        let fits = |motion: &Self| {
            (least_rad..=limits.travel_rad).contains(&motion.amplitude_rad)
                && motion.duration_s() <= within_s + SAME_TIME_S
        };
        triangles.chain(sines).filter(fits).collect()
    }

    /// Length with the rest behind it.
    pub(super) fn duration_s(&self) -> f64 {
        self.moving_s + REST_S
    }

    /// Samples of the command, rad.
    pub(super) fn command_rad(&self) -> Vec<f64> {
        let samples = (self.duration_s() * RATE_HZ).round() as usize;
        (0..samples).map(|n| self.at(n as f64 / RATE_HZ)).collect()
    }

    fn at(&self, time_s: f64) -> f64 {
        if time_s >= self.moving_s {
            return 0.0;
        }
        let part = time_s / self.moving_s;
        let unit = match self.shape {
            Shape::Triangle if part < 0.25 => 4.0 * part,
            Shape::Triangle if part < 0.75 => 2.0 - 4.0 * part,
            Shape::Triangle => 4.0 * part - 4.0,
            Shape::Sine => (TAU * SINE_PERIODS * part).sin(),
        };
        self.amplitude_rad * unit
    }

    /// The motion in words.
    pub(super) fn in_words(&self) -> String {
        let mrad = 1e3 * self.amplitude_rad;
        match self.shape {
            Shape::Triangle => format!("triangle of ±{mrad:.3} mrad in {:.1} s", self.moving_s),
            Shape::Sine => {
                let frequency_hz = SINE_PERIODS / self.moving_s;
                format!("sine of ±{mrad:.3} mrad, {frequency_hz:.0} Hz, {SINE_PERIODS:.0} periods")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planning::request::motion_limits;
    use ema_sim::presets::EMA_48;

    #[test]
    fn motions_keep_within_their_limits_and_end_at_rest() {
        let limits = motion_limits(&EMA_48);
        let menu = Motion::menu(&EMA_48, &limits, 2.0);
        assert!(menu.len() > 20, "{}", menu.len());
        for motion in &menu {
            let command = motion.command_rad();
            let most = command.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            assert!(most <= limits.travel_rad && command.len() as f64 <= 2.0 * RATE_HZ);
            assert_eq!((command[0], command[command.len() - 1]), (0.0, 0.0));
            let pace = |pair: &[f64]| (pair[1] - pair[0]).abs() * RATE_HZ;
            let fastest = command.windows(2).map(pace).fold(0.0, f64::max);
            assert!(
                fastest * EMA_48.transmission.gear_ratio <= 1.001 * limits.speed_rad_per_s,
                "{motion:?}"
            );
        }
        assert!(Motion::menu(&EMA_48, &limits, 0.1).is_empty());
    }
}
