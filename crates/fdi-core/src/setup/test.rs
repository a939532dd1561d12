//! Tests that move a machine enough to show its damage, and others.

use std::f64::consts::TAU;

use ema_sim::{HealthState, PhysicalFaults};

use crate::{
    report::SetupRefusalCode, setup::error::SetupError, simulation::experiment::Experiment,
    statistics::range,
};

/// Turns of the electrical angle over which each phase conducts in each of its sectors.
const LEAST_ELECTRICAL_TURNS: f64 = 1.0;

/// Checks that a test shows faults at all: that the rotor reverses, over more than the play, and turns
/// through all sectors.
///
/// # Errors
///
/// [`SetupError::Refused`] with the reason.
pub fn check_test(experiment: &Experiment) -> Result<(), SetupError> {
    checked_travel_rad(experiment).map(drop)
}

/// Checks a test; gives how far the rotor of the healthy machine travels in it, rad.
pub(super) fn checked_travel_rad(experiment: &Experiment) -> Result<f64, SetupError> {
    let model = experiment.low_fidelity(&experiment.scenario)?;
    let trace = model.try_simulate(&PhysicalFaults::from(&HealthState::HEALTHY))?;
    let angle_rad = &trace.motor_angle_rad;
    let gear = &experiment.actuator.transmission;
    let play_rad = gear.backlash_rad * gear.gear_ratio;
    if reversals(angle_rad, play_rad.max(f64::EPSILON)) == 0 {
        let reason =
            "the machine never turns back by more than its play in this test: friction and \
                      play show where it reverses; take a command that goes there and back"
                .to_owned();
        return Err(SetupError::refused(SetupRefusalCode::NoReversal, None, reason));
    }
    let travel_rad = range(angle_rad);
    let turns = f64::from(experiment.actuator.motor.pole_pairs) * travel_rad / TAU;
    if turns < LEAST_ELECTRICAL_TURNS {
        let reason = format!(
            "the rotor turns by {turns:.2} of an electrical revolution in this test, so that not every \
             phase conducts both ways: take a command that moves it by one at least"
        );
        return Err(SetupError::refused(SetupRefusalCode::TooShort, None, reason));
    }
    Ok(travel_rad)
}

/// Times that a signal turns round by more than some distance.
fn reversals(signal: &[f64], more_than: f64) -> usize {
    let Some(&first) = signal.first() else { return 0 };
    // the farthest point in the present direction; the direction itself once it is known
    let (mut extreme, mut direction, mut count) = (first, 0.0, 0);
    for &value in signal {
        let back = direction * (extreme - value);
        if direction == 0.0 {
            if (value - first).abs() > more_than {
                direction = (value - first).signum();
                extreme = value;
            }
        } else if back > more_than {
            count += 1;
            direction = -direction;
            extreme = value;
        } else if back < 0.0 {
            extreme = value;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reversals_are_counted_beyond_the_play() {
        let wave: Vec<f64> = (0..1000).map(|n| (0.02 * f64::from(n)).sin()).collect();
        assert_eq!(reversals(&wave, 0.1), 6);
        assert_eq!(reversals(&wave, 2.1), 0);
        let ramp: Vec<f64> = (0..100).map(|n| f64::from(n) + 0.4 * f64::from(n % 2)).collect();
        assert_eq!(reversals(&ramp, 0.5), 0);
        assert_eq!(reversals(&[], 0.1), 0);
    }
}
