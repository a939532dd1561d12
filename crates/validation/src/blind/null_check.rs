//! Comparison of the generator's nominal machines with those of `ema-sim`.

use anyhow::{Context, Result, bail};
use ema_sim::{
    AxisInput, AxisScenario, AxisStart, Command, FaultCoordinates, InitialState, Load, LowFidelity,
    Scenario, ServoAxisSimulation,
    model_file::{MachineModel, parse_machine},
};
use greybox_blind::{LOWEST_NOISE_A, Machine, Move, NominalRun, RATE_HZ};

/// A command on which both plants were run.
pub(crate) struct NullCheck {
    pub(crate) machine: Machine,
    pub(crate) command: Move,
    /// Largest rms difference of the current over the draws, A.
    pub(crate) worst_rms_a: f64,
}

/// Draws of each command: healthy and faulty, with and without steps of the load.
const DRAWS: u64 = 8;

/// Compares both plants on every command.
pub(crate) fn run() -> Result<Vec<NullCheck>> {
    let all = [Move::OneWay, Move::Triangle];
    let mut checks = Vec::new();
    for machine in Machine::ALL {
        for command in Move::MENU.into_iter().chain(all) {
            let mut worst_rms_a = 0.0_f64;
            for seed in 0..DRAWS {
                let run = NominalRun::draw(machine, command, seed);
                let ours = simulated(&run)?;
                let squares = ours.iter().zip(&run.current_a).map(|(a, b)| (a - b) * (a - b));
                let rms = (squares.sum::<f64>() / ours.len() as f64).sqrt();
                worst_rms_a = worst_rms_a.max(rms);
            }
            checks.push(NullCheck { machine, command, worst_rms_a });
        }
    }
    Ok(checks)
}

/// Refuses a difference of more than a tenth of the lowest noise.
pub(crate) fn judge(checks: &[NullCheck]) -> Result<()> {
    for check in checks {
        if check.worst_rms_a > 0.1 * LOWEST_NOISE_A {
            let (machine, command) = (check.machine.name(), check.command.name());
            bail!("{machine} {command}: the plants are {} A apart", check.worst_rms_a);
        }
    }
    Ok(())
}

/// Signal of the test by the project's own simulator, from the model file of the cases.
fn simulated(run: &NominalRun) -> Result<Vec<f64>> {
    let duration_s = run.course.command_rad.len() as f64 / RATE_HZ;
    let faults = (&FaultCoordinates(run.faults)).into();
    let load = Load::Recorded { values_n_m: run.course.load_n_m.clone(), rate_hz: RATE_HZ };
    let recorded = |origin: f64| Command::Recorded {
        values_rad: run.course.command_rad.iter().map(|c| c + origin).collect(),
        rate_hz: RATE_HZ,
    };
    match parse_machine(run.machine.nominal_toml()).context("nominal model")? {
        MachineModel::Actuator(model) => {
            let scenario = Scenario {
                command: recorded(0.0),
                load_n_m: 0.0,
                duration_s,
                start_angle_rad: run.start_rad,
                initial: InitialState::default(),
                ..Scenario::chirp()
            };
            let trace =
                LowFidelity::new(&model.actuator, &scenario)?.with_load(load)?.simulate(&faults);
            let every = (trace.rate_hz / RATE_HZ).round() as usize;
            Ok(trace.current_a.into_iter().step_by(every).collect())
        }
        MachineModel::ServoAxis(model) => {
            let scenario = AxisScenario {
                input: AxisInput::Position(recorded(run.start_rad)),
                load: 0.0,
                duration_s,
                start: AxisStart { position: run.start_rad, ..AxisStart::default() },
            };
            let simulation = ServoAxisSimulation::new(&model.axis, &scenario)?.with_load(load)?;
            Ok(simulation.simulate(&faults).current)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generator_and_the_simulator_have_the_same_nominal_machines() {
        let checks = run().unwrap();
        assert_eq!(checks.len(), 16);
        judge(&checks).unwrap();
        let mut apart = checks;
        apart[3].worst_rms_a = 0.11 * LOWEST_NOISE_A;
        assert!(judge(&apart).is_err());
    }
}
