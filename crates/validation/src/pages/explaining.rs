//! `docs/validation/explaining.md`: how long an explanation takes.

use std::{f64::consts::TAU, fmt::Write as _};

use anyhow::{Context, Result};
use ema_sim::{
    AxisInput, AxisScenario, AxisStart, Command, Effect, EffectId, Geometry, HealthState, Load,
    LowFidelity, PhaseSensors, PhysicalFaults, Scenario, ServoAxisSimulation,
    model_file::{MachineModel, Model, parse_machine, parse_machine_onto},
    presets::EMA_48,
};
use greybox::{
    CommandKind, Explained, Options, Record, Recordings, explain, numbers_without_tolerance,
};

use super::{bar::met, figure::Figure, measured::verdict};
use crate::terminal::clock;

/// Rate of the recordings.
const RATE_HZ: f64 = 4e3;
/// Sines of each recording, Hz; the last two are held out.
const SINES_HZ: [&[f64]; 5] =
    [&[0.31, 0.9, 1.7], &[0.23, 1.1], &[0.5, 1.3], &[0.41, 0.77, 2.1], &[0.6, 1.9]];
const HELD_OUT: usize = 2;
/// Time that an explanation may take, s.
const MOST_S: f64 = 20.0;
/// Simulations and noise from a seed agree to rounding.
const SIMULATED_REL: f64 = 1e-6;

/// Recordings of a machine.
#[derive(Clone, Copy, Debug)]
struct Recorded {
    count: usize,
    length_s: f64,
    /// False for a machine within the tolerances of its model.
    has_cogging: bool,
}

/// Recordings of the page.
const OF_PAGE: Recorded = Recorded { count: SINES_HZ.len(), length_s: 10.0, has_cogging: true };

/// A machine that is not quite what its model says.
struct Machine {
    name: &'static str,
    nominal: MachineModel,
    order: f64,
    cogging_n_m: f64,
    amplitude_rad: f64,
    load_n_m: f64,
    noise_a: f64,
}

fn machines() -> Result<[Machine; 2]> {
    let base = MachineModel::Actuator(Model::from(EMA_48));
    Ok([
        Machine {
            name: "servo axis",
            nominal: parse_machine(include_str!("explaining/servo.toml"))?,
            order: 12.0,
            cogging_n_m: 0.004,
            amplitude_rad: 1.0,
            load_n_m: 0.0,
            noise_a: 0.01,
        },
        Machine {
            name: "EMA-48",
            nominal: parse_machine_onto(include_str!("explaining/actuator.toml"), &base)?,
            order: 24.0,
            cogging_n_m: 0.01,
            amplitude_rad: 0.012,
            load_n_m: 0.5,
            noise_a: 0.02,
        },
    ])
}

impl Machine {
    fn cogging(&self) -> Result<Effect> {
        let effect = Effect::new(EffectId::Cogging, Geometry::Rotary);
        Ok(effect.with("cogging_sin_n_m", self.cogging_n_m)?.with("order", self.order)?)
    }

    fn command(&self, sines_hz: &[f64], length_s: f64) -> Vec<f64> {
        let of = |t: f64| -> f64 {
            let sines = sines_hz.iter().zip(1..);
            sines.map(|(hz, n)| (TAU * hz * t).sin() / f64::from(n)).sum()
        };
        let samples = (length_s * RATE_HZ) as usize;
        (0..samples).map(|n| self.amplitude_rad * of(n as f64 / RATE_HZ)).collect()
    }

    /// Current and position of the machine as it is, at the rate of the recordings.
    fn run(&self, command: &Command, recorded: Recorded) -> Result<[Vec<f64>; 2]> {
        let Recorded { length_s, has_cogging, .. } = recorded;
        let healthy = PhysicalFaults::from(&HealthState::HEALTHY);
        let effects = if has_cogging { vec![self.cogging()?] } else { Vec::new() };
        let (rate_hz, current, position) = match &self.nominal {
            MachineModel::ServoAxis(model) => {
                let mut axis = model.axis;
                (axis.inertia, axis.viscous) = (1.03 * axis.inertia, 0.9 * axis.viscous);
                let scenario = AxisScenario {
                    input: AxisInput::Position(command.clone()),
                    load: self.load_n_m,
                    duration_s: length_s,
                    start: AxisStart::default(),
                };
                let simulation =
                    ServoAxisSimulation::new(&axis, &scenario)?.with_effects(&effects)?;
                let trace = simulation.simulate(&healthy);
                (trace.rate_hz, trace.current, trace.position)
            }
            MachineModel::Actuator(model) => {
                let mut actuator = model.actuator;
                actuator.motor.inertia_kg_m2 *= 1.03;
                actuator.motor.viscous_n_m_s_per_rad *= 0.9;
                let scenario = Scenario {
                    command: command.clone(),
                    load_n_m: 0.0,
                    duration_s: length_s,
                    ..Scenario::chirp()
                };
                let samples = (length_s * RATE_HZ) as usize;
                let load = vec![self.load_n_m; samples];
                let load = Load::Recorded { values_n_m: load, rate_hz: RATE_HZ };
                let simulation = LowFidelity::new(&actuator, &scenario)?
                    .with_effects(&effects)?
                    .with_load(load)?;
                let trace = simulation.simulate(&healthy);
                (trace.rate_hz, trace.current_a, trace.motor_angle_rad)
            }
        };
        let step = (rate_hz / RATE_HZ).round() as usize;
        Ok([current, position].map(|values| values.into_iter().step_by(step).collect()))
    }

    fn record(&self, place: usize, recorded: Recorded) -> Result<Record> {
        let values = self.command(SINES_HZ[place], recorded.length_s);
        let command = Command::Recorded { values_rad: values.clone(), rate_hz: RATE_HZ };
        let [current, position] = self.run(&command, recorded)?;
        let sensor = PhaseSensors { noise_a: self.noise_a, converter: None };
        let [drive, _, _] = sensor.measure([&current, &[], &[]], place as u64);
        Ok(Record {
            name: format!("{} {place}", self.name),
            rate_hz: RATE_HZ,
            command: values,
            kind: CommandKind::Position,
            load: Some(vec![self.load_n_m; drive.len()]),
            drive,
            position: Some(position),
            filter_hz: None,
            start_rad: None,
        })
    }

    fn recordings(&self, recorded: Recorded) -> Result<Recordings> {
        let mut train: Vec<Record> =
            (0..recorded.count).map(|place| self.record(place, recorded)).collect::<Result<_>>()?;
        let holdout = train.split_off(recorded.count - HELD_OUT);
        Ok(Recordings { train, holdout, repeat: Vec::new() })
    }

    /// The answer with so many threads, and the time that it took.
    fn explained(&self, recordings: &Recordings, options: &Options) -> Result<(Explained, f64)> {
        let start = clock();
        let answer = explain(&self.nominal, recordings, options)?;
        Ok((answer, start.elapsed().as_secs_f64()))
    }
}

/// Explanation of four recordings of 4 s of one of the machines, two of them held out, by the numbers
/// with a stated tolerance alone or with all that may be off: the symbols of the effects that it
/// names.
pub(crate) fn explanation(
    place: usize,
    has_cogging: bool,
    is_exact: bool,
) -> Result<impl Fn() -> Result<Vec<&'static str>>> {
    let machine = machines()?.into_iter().nth(place).context("one of the machines")?;
    let exact = if is_exact { numbers_without_tolerance(&machine.nominal) } else { Vec::new() };
    let options = Options { jobs: 1, exact, ..Options::default() };
    let recordings = machine.recordings(Recorded { count: 4, length_s: 4.0, has_cogging })?;
    Ok(move || {
        let (answer, _) = machine.explained(&recordings, &options)?;
        Ok(answer.effects.iter().map(|found| found.effect.id().info().symbol).collect())
    })
}

/// Example of the recordings: the current of the first.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let figure = |machine: &Machine| -> Result<Figure> {
        let record = machine.record(0, OF_PAGE)?;
        Ok(Figure {
            id: format!("{}-current", machine.name.replace(' ', "-")),
            value: greybox::rms(&record.drive),
            tolerance_rel: SIMULATED_REL,
            unit: "A".to_owned(),
        })
    };
    machines()?.iter().map(figure).collect()
}

pub(super) fn text() -> Result<String> {
    let mut page = include_str!("explaining/head.md").to_owned();
    for machine in machines()? {
        let recordings = machine.recordings(OF_PAGE)?;
        let with = |jobs| Options { jobs, ..Options::default() };
        let (one, one_s) = machine.explained(&recordings, &with(1))?;
        let (two, two_s) = machine.explained(&recordings, &with(2))?;
        let [before, after] = two.holdout_rms.context("recordings held out")?;
        let floor = two.noise_floor.context("a floor")?.rms;
        let size = |effect: &Effect| {
            let number = |key: &str| effect.get(key).unwrap_or_default();
            let size_n_m = number("cogging_sin_n_m").hypot(number("cogging_cos_n_m"));
            let (symbol, order) = (effect.id().info().symbol, number("order"));
            format!("{symbol} of order {order}, {:.2} mN·m", 1e3 * size_n_m)
        };
        let found: Vec<String> = two.effects.iter().map(|f| size(&f.effect)).collect();
        let truth = machine.cogging()?;
        writeln!(
            page,
            "| {} | {} | {} ({}) | {:.2} | {:.2} | {:.2} | {one_s:.1} | {two_s:.1} | {} | {} |",
            machine.name,
            verdict(two.verdict),
            found.join(", "),
            size(&truth),
            1e3 * before,
            1e3 * after,
            1e3 * floor,
            if one == two { "yes" } else { "**no**" },
            met(two_s <= MOST_S),
        )?;
    }
    page.push_str(include_str!("explaining/foot.md"));
    Ok(page)
}
