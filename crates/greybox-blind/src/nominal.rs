//! The machines without anything hidden and without noise: what a null check compares.

use crate::{
    chance::{Chance, Purpose},
    command::{self, Course, Limits, Move},
    information::fine,
    machine::{Machine, Numbers},
    plant::{Faults, Subject, Test, simulate},
    recording::rounded,
};

/// A recording of the nominal machine, with faults where it has them, free of noise.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct NominalRun {
    /// The machine.
    pub machine: Machine,
    /// Command and load that it was given.
    pub course: Course,
    /// Start angle of the motor; of the servo the position, which the command starts from.
    pub start_rad: f64,
    /// Faults `k1` to `k5`, `k6·cos φ`, `k6·sin φ`.
    pub faults: [f64; 7],
    /// Current at each sample, A, before the controller acts on it.
    pub current_a: Vec<f64>,
    /// Motor angle at each sample, rad.
    pub motor_angle_rad: Vec<f64>,
}

impl NominalRun {
    /// Runs a command of the menu, drawn by a seed; odd seeds bring faults, seeds that four
    /// divides a load that changes in steps.
    ///
    /// # Examples
    ///
    /// ```
    /// use greybox_blind::{Machine, Move, NominalRun};
    ///
    /// let run = NominalRun::draw(Machine::Servo, Move::Chirp, 2);
    /// assert_eq!(run.current_a.len(), 10_000);
    /// assert_eq!(run.current_a[0], 0.0);
    /// ```
    pub fn draw(machine: Machine, kind: Move, seed: u64) -> Self {
        let mut chance = Chance::new(seed, Purpose::Truth, 1 << 20 | kind as u64);
        let mut course = command::draw(kind, machine, 5.0, &mut chance);
        if seed.is_multiple_of(4) {
            let samples = course.command_rad.len();
            course.load_n_m = command::load_steps(&Limits::of(machine), samples, &mut chance);
        }
        course.round();
        let start_rad = rounded(chance.between(-3.0, 3.0), 6);
        let mut faults: Faults = [0.0; 7];
        if seed % 2 == 1 {
            for k in &mut faults[..machine.fault_count()] {
                *k = chance.between(0.0, 0.05);
            }
        }
        let numbers = Numbers::nominal(machine);
        let subject = Subject { numbers, faults, hidden: &[] };
        let trace =
            simulate(&subject, &Test { course: &course, start_rad, seed: 0, steps: fine(machine) });
        let (current_a, motor_angle_rad) = (trace.current, trace.position);
        Self { machine, course, start_rad, faults, current_a, motor_angle_rad }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The work of the motor is in friction, load and motion.
    #[test]
    fn law_energy() {
        for machine in Machine::ALL {
            for kind in Move::MENU {
                let mut chance = Chance::new(11, Purpose::Truth, kind as u64);
                let course = command::draw(kind, machine, 4.0, &mut chance);
                let numbers = Numbers::nominal(machine);
                let mut worst = [0.0; 2];
                for (error, steps) in worst.iter_mut().zip([2, 8]) {
                    let subject = Subject { numbers, faults: [0.0; 7], hidden: &[] };
                    let test = Test { course: &course, start_rad: 0.3, seed: 0, steps };
                    let e = simulate(&subject, &test).energy;
                    *error = (e.motor - e.rubbed - e.load - e.kinetic) / e.rubbed;
                    assert!(e.rubbed > 0.0, "{machine:?} {kind:?} moves");
                }
                // the trapezoidal rule of the books is of second order in the step, and in the
                // servo's smooth acceleration over half a millisecond that is 1e-4 of the losses
                assert!(worst[0].abs() < 2e-4, "{machine:?} {kind:?} {worst:?}");
                assert!(worst[1].abs() < 2e-5, "{machine:?} {kind:?} {worst:?}");
            }
        }
    }
}
