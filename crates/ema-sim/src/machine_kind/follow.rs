//! Recordings taken under a controller that is not known: a controller of our own holds the axis
//! on the measured position, and what it needs for that is compared with what was measured. These
//! are the inverse dynamics of the machine, without derivatives of a measured signal.

use crate::{
    scenario::Command,
    servo_axis::ServoAxis,
    servo_control::{AxisController, Feedback},
};

/// Ticks of the follower in a sample of the recording.
const TICKS_PER_SAMPLE: f64 = 10.0;
/// Ticks in `1/ω`, with `ω` the bandwidth of its loop in rad/s: as stiff as it can be, since it
/// has to hold the axis where it was measured against whatever acts on it.
const TICKS_PER_RADIAN: f64 = 6.0;
/// Gain of the position over that of the speed and `ω`: critical damping.
const POSITION_SHARE: f64 = 0.25;
/// `K_d`: so large that the speed asked for is followed as that of the motor is held back.
const DERIVATIVE_RATIO: f64 = 1e4;
/// Samples over which motion and drive signal are averaged, three times over: the noise of a
/// position is not to pass for torque.
const SMOOTHED_SAMPLES: f64 = 15.0;

/// Rate that a signal is worth after the averages of a followed motion, Hz: a tenth of the power
/// is left at its half.
pub fn resolved_hz(rate_hz: f64) -> f64 {
    0.9 * rate_hz / SMOOTHED_SAMPLES
}

/// A measured drive signal as the run of a followed motion would show it: averaged as the motion
/// is, and through the loop of the follower.
pub fn shown_while_followed(drive: &[f64], rate_hz: f64) -> Vec<f64> {
    followed(&smoothed(drive), rate_hz)
}

/// A signal averaged over the time around each sample, three times over: without a delay. Over
/// less at the ends.
fn smoothed(signal: &[f64]) -> Vec<f64> {
    let reach = (0.5 * SMOOTHED_SAMPLES) as usize;
    (0..3).fold(signal.to_vec(), |signal, _| averaged(&signal, reach))
}

/// Means over as many samples before as after.
fn averaged(signal: &[f64], reach: usize) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let mean = |n: usize| {
        let reach = reach.min(n).min(last - n);
        let around = &signal[n - reach..=n + reach];
        around.iter().sum::<f64>() / around.len() as f64
    };
    (0..signal.len()).map(mean).collect()
}

/// The motion to follow at the ticks of the follower, without kinks in it.
pub(super) fn motion(position: &[f64], rate_hz: f64) -> Command {
    let position = smoothed(position);
    let ticks = TICKS_PER_SAMPLE as usize;
    let between = |n: usize| {
        let (before, part) = (position[n / ticks], (n % ticks) as f64 / TICKS_PER_SAMPLE);
        let after = position[(n / ticks + 1).min(position.len() - 1)];
        before + part * (after - before)
    };
    let fine: Vec<f64> = (0..position.len() * ticks).map(between).collect();
    Command::Recorded {
        values_rad: averaged(&fine, ticks / 2),
        rate_hz: rate_hz * TICKS_PER_SAMPLE,
    }
}

/// Bandwidth of the follower, rad/s.
fn bandwidth(rate_hz: f64) -> f64 {
    TICKS_PER_SAMPLE * rate_hz / TICKS_PER_RADIAN
}

/// The controller that follows a position recorded at a rate with an axis, by the error and its
/// rate: `u = (M·ω/k)·(ė + ω·e/4)`.
pub(super) fn follower(axis: &ServoAxis, rate_hz: f64) -> AxisController {
    let bandwidth = bandwidth(rate_hz);
    AxisController {
        sample_hz: TICKS_PER_SAMPLE * rate_hz,
        position_gain_per_s: DERIVATIVE_RATIO * POSITION_SHARE * bandwidth,
        position_integral_per_s2: 0.0,
        position_derivative_ratio: DERIVATIVE_RATIO,
        speed_limit: f64::MAX,
        speed_gain: axis.inertia * bandwidth / axis.force_constant / DERIVATIVE_RATIO,
        speed_integral: 0.0,
        output_limit: f64::MAX,
        speed_samples: 0,
        encoder_step: 0.0,
        feedback: Feedback::Motor,
    }
}

/// A drive signal as the follower would show it: position and torques pass its loop,
///
/// ```text
/// T(s) = ω·(s + ω/4) / (s² + ω·s + ω²/4)
/// ```
///
/// sampled as in the simulation, with the signal held between its samples.
///
/// # Source
///
/// Transfer function of a double integrator under [`follower`]; `docs/models/greybox.md`.
fn followed(drive: &[f64], rate_hz: f64) -> Vec<f64> {
    let bandwidth = bandwidth(rate_hz);
    let tick_s = 1.0 / (TICKS_PER_SAMPLE * rate_hz);
    let (mut angle, mut speed) = (0.0, 0.0);
    let mut shown = Vec::with_capacity(drive.len());
    for &needed in drive {
        for tick in 0..TICKS_PER_SAMPLE as usize {
            // an axis of unit inertia, held at rest against the signal
            let output = bandwidth * (-POSITION_SHARE * bandwidth * angle - speed);
            if tick == 0 {
                shown.push(-output);
            }
            let rate = output + needed;
            angle += (speed + 0.5 * rate * tick_s) * tick_s;
            speed += rate * tick_s;
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        AxisInput, AxisScenario, AxisStart, Drive, Geometry, HealthState, PhysicalFaults,
        ServoAxisSimulation,
    };

    /// The follower needs what passes its loop for a motion whose inertia and drag are known.
    #[test]
    fn the_follower_needs_the_inverse_dynamics_behind_its_loop() {
        let (inertia, viscous, constant, rate_hz) = (5e-6, 2e-5, 0.03, 1000.0);
        let motion = |n: usize| {
            let t = n as f64 / rate_hz;
            let turn = |amplitude: f64, w: f64| {
                let (sin, cos) = libm::sincos(w * t);
                [amplitude * sin, amplitude * w * cos, -amplitude * w * w * sin]
            };
            let (a, b) = (turn(3.0, 6.0), turn(2.0, 14.0));
            [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
        };
        let states: Vec<[f64; 3]> = (0..4000).map(motion).collect();
        let needed: Vec<f64> =
            states.iter().map(|s| (inertia * s[2] + viscous * s[1]) / constant).collect();
        let axis = ServoAxis {
            geometry: Geometry::Rotary,
            inertia,
            viscous,
            kinetic_friction: 0.0,
            static_friction: 0.0,
            offset: 0.0,
            backlash: 0.0,
            drive: Drive::Current,
            force_constant: constant,
            resistance_ohm: 1.0,
            controller: AxisController {
                sample_hz: rate_hz,
                position_gain_per_s: 0.0,
                position_integral_per_s2: 0.0,
                position_derivative_ratio: 0.0,
                speed_limit: 1e9,
                speed_gain: 1.0,
                speed_integral: 0.0,
                output_limit: 1e9,
                speed_samples: 0,
                encoder_step: 0.0,
                feedback: Feedback::Motor,
            },
        };
        let axis = ServoAxis { controller: follower(&axis, rate_hz), ..axis };
        let scenario = AxisScenario {
            input: AxisInput::Position(super::motion(
                &states.iter().map(|s| s[0]).collect::<Vec<_>>(),
                rate_hz,
            )),
            load: 0.0,
            duration_s: 4.0,
            start: AxisStart { position: states[0][0], ..AxisStart::default() },
        };
        let trace = ServoAxisSimulation::new(&axis, &scenario)
            .unwrap()
            .simulate(&PhysicalFaults::from(&HealthState::HEALTHY));
        let expected = followed(&smoothed(&needed), rate_hz);
        let (mut off, mut size) = (0.0_f64, 0.0_f64);
        for n in 500..3900 {
            off = off.max((trace.output[10 * n] - expected[n]).abs());
            size = size.max(expected[n].abs());
        }
        assert!(off < 0.01 * size, "{off} of {size}");
    }
}
