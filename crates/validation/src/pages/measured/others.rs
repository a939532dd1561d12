//! Machines beside EMPS and LAAS: a geared servo with a pendulum, three axes of a robot, and an
//! actuator with seeded faults.

use anyhow::{Context, Result, bail};
use ema_sim::model_file::{MachineModel, parse_machine};
use greybox::{
    Calibrated, CommandKind, Explained, GreyboxError, Options, Record, Recordings, calibrate,
    explain,
};

use super::{
    laas::at_equal_times,
    recording::{columns, rows},
    setting::{JOBS, axis as axis_of},
};

/// Weight of the pendulum at its arm, N·m: 0.49 kg at 0.1 m.
const PENDULUM_N_M: f64 = 0.49 * 9.81 * 0.1;
/// Rate that the servo's recordings, of about 190 Hz, are brought to, Hz.
const SERVO_HZ: f64 = 200.0;
/// Gain of the firmware that the model file has, and gains of the recordings.
const SERVO_GAIN: f64 = 400.0;
pub(super) const SERVO_GAINS: [&str; 2] = ["100", "400"];
/// Full scale of the recorded duty.
const FULL_DUTY: f64 = 885.0;
/// Trajectories of the servo that are fitted, and those held out.
const SERVO_FITTED: [&str; 2] = ["sin_sin", "up_and_down"];
const SERVO_HELD_OUT: [&str; 2] = ["sin_time_square", "lift_and_drop"];

/// Rate of the robot's recordings, Hz.
const ROBOT_HZ: f64 = 250.0;
/// The robot's trajectory: its beginning and end are fitted, its middle is held out.
const ROBOT_PARTS: [(&str, usize, usize); 3] =
    [("0 to 3.5 s", 0, 875), ("6.5 to 10 s", 1625, 2501), ("3.5 to 6.5 s", 875, 1625)];
/// Samples on either side over which the robot's acceleration is taken from its speed.
const ROBOT_REACH: usize = 10;
/// Columns of an axis: angle, speed, torque; inertia, gravity and Coriolis torque of the model.
const ROBOT_COLUMNS: [usize; 6] = [0, 2, 3, 5, 6, 7];
const COLUMNS_OF_AXIS: usize = 8;

/// Rate of the actuator's recordings, Hz.
const ACTUATOR_HZ: f64 = 25.0;
/// Loads of the actuator's recordings that are fitted, and the one held out, kgf.
const ACTUATOR_FITTED: [&str; 2] = ["20", "40"];
const ACTUATOR_HELD_OUT: &str = "-40";
/// Newtons of a kilogram-force.
const NEWTONS_PER_KGF: f64 = 9.806_65;

/// A model file with recordings of its machine.
pub(super) struct Set {
    pub(super) model: MachineModel,
    pub(super) recordings: Recordings,
}

/// Answer of `explain`, of `calibrate` before it where the file lacks friction, or what either
/// refuses.
pub(super) struct Answer {
    pub(super) calibrated: Option<Calibrated>,
    pub(super) explained: Result<Explained, GreyboxError>,
}

impl Set {
    /// Judges the recordings by the model file as it is.
    pub(super) fn explained(&self) -> Answer {
        let options = Options { jobs: JOBS, ..Options::default() };
        Answer { calibrated: None, explained: explain(&self.model, &self.recordings, &options) }
    }

    /// Calibrates the model first, by the same recordings.
    pub(super) fn calibrated_first(&self) -> Answer {
        match calibrate(&self.model, &self.recordings, JOBS) {
            Ok(calibrated) => {
                let set =
                    Self { model: calibrated.model.clone(), recordings: self.recordings.clone() };
                Answer { calibrated: Some(calibrated), ..set.explained() }
            }
            Err(refused) => Answer { calibrated: None, explained: Err(refused) },
        }
    }
}

fn motion(name: String, rate_hz: f64, position: Vec<f64>, drive: Vec<f64>) -> Record {
    Record {
        name,
        rate_hz,
        command: position.clone(),
        kind: CommandKind::Motion,
        drive,
        position: Some(position),
        load: None,
        filter_hz: None,
        start_rad: None,
    }
}

fn servo_model() -> Result<MachineModel> {
    Ok(parse_machine(include_str!("../../../../../fixtures/models/xl330.toml"))?)
}

/// The servo with a pendulum at some gains of its firmware. A trajectory that lets go is taken as far
/// as the motor holds.
fn servo_recordings(gains: &[&str], kind: CommandKind) -> Result<Recordings> {
    let rows = rows("bam_xl330/bam_xl330_pendulum.csv.gz")?;
    let of = |trajectories: [&str; 2]| -> Result<Vec<Record>> {
        let mut records = Vec::new();
        for gain in gains {
            for trajectory in trajectories {
                records.push(servo_record(&rows, trajectory, gain, kind)?);
            }
        }
        Ok(records)
    };
    let (train, holdout) = (of(SERVO_FITTED)?, of(SERVO_HELD_OUT)?);
    Ok(Recordings { train, holdout, repeat: Vec::new() })
}

/// The servo under its own controller, at a gain of its firmware that the file is of or another.
pub(super) fn servo_in_loop(gain: &str) -> Result<Set> {
    let mut model = axis_of(servo_model()?)?;
    let ratio = gain.parse::<f64>()? / SERVO_GAIN;
    model.axis.controller.position_gain_per_s *= ratio;
    let recordings = servo_recordings(&[gain], CommandKind::Position)?;
    Ok(Set { model: MachineModel::ServoAxis(model), recordings })
}

/// The motion of the servo at both gains.
pub(super) fn servo() -> Result<Set> {
    let recordings = servo_recordings(&SERVO_GAINS, CommandKind::Motion)?;
    Ok(Set { model: servo_model()?, recordings })
}

fn servo_record(
    rows: &[Vec<String>],
    trajectory: &str,
    gain: &str,
    kind: CommandKind,
) -> Result<Record> {
    let mut signals = vec![Vec::new(); 4];
    for row in rows.iter().filter(|row| row[1] == trajectory && row[2] == gain && row[12] == "1") {
        let number = |place: usize| row[place].parse::<f64>().context("a number");
        let voltage = number(7)? / FULL_DUTY * number(8)?;
        for (signal, value) in
            signals.iter_mut().zip([number(10)?, number(5)?, voltage, number(11)?])
        {
            signal.push(value);
        }
    }
    let even = at_equal_times(&signals, SERVO_HZ);
    let [_, position, drive, command] = &even[..] else { bail!("{trajectory}: four columns") };
    let load = position.iter().map(|angle| PENDULUM_N_M * angle.sin()).collect();
    let name = format!("{trajectory}, gain {gain}");
    let record = motion(name, SERVO_HZ, position.clone(), drive.clone());
    let command = if kind == CommandKind::Motion { position } else { command };
    Ok(Record { load: Some(load), kind, command: command.clone(), ..record })
}

/// An axis of the robot, 1 to 3. What its rigid-body model knows beside a constant inertia is a load.
pub(super) fn robot(axis: usize) -> Result<Set> {
    let texts = [
        include_str!("../../../../../fixtures/models/kr300-axis-1.toml"),
        include_str!("../../../../../fixtures/models/kr300-axis-2.toml"),
        include_str!("../../../../../fixtures/models/kr300-axis-3.toml"),
    ];
    let model = parse_machine(texts[axis - 1])?;
    let inertia = axis_of(model.clone())?.axis.inertia;
    let all = columns("kuka_kr300/traj_A.csv.gz")?;
    let [angle, speed, torque, of_model, gravity, coriolis] =
        ROBOT_COLUMNS.map(|place| &all[1 + COLUMNS_OF_AXIS * (axis - 1) + place]);
    let acceleration = |n: usize| {
        if n < ROBOT_REACH || n + ROBOT_REACH >= speed.len() {
            return 0.0;
        }
        let change = speed[n + ROBOT_REACH] - speed[n - ROBOT_REACH];
        change * ROBOT_HZ / (2 * ROBOT_REACH) as f64
    };
    let load = |n: usize| gravity[n] + coriolis[n] + (of_model[n] - inertia) * acceleration(n);
    let part = |(name, first, end): (&str, usize, usize)| {
        let (angle, torque) = (angle[first..end].to_vec(), torque[first..end].to_vec());
        let record = motion(name.to_owned(), ROBOT_HZ, angle, torque);
        Record { load: Some((first..end).map(load).collect()), ..record }
    };
    let [out, back, middle] = ROBOT_PARTS.map(part);
    let recordings =
        Recordings { train: vec![out, back], holdout: vec![middle], repeat: Vec::new() };
    Ok(Set { model, recordings })
}

/// The first run of a file of the actuator with seeded faults, a recording a load.
pub(super) fn actuator(file: &str) -> Result<Set> {
    let model = parse_machine(include_str!("cranfield.toml"))?;
    let rows = rows(&format!("cranfield_ema/{file}.csv.gz"))?;
    let of = |load: &str| -> Result<Record> {
        let (mut position, mut current) = (Vec::new(), Vec::new());
        for row in rows.iter().filter(|row| row[4] == load && row[5] == "1") {
            let number = |place: usize| row[place].parse::<f64>().context("a number");
            position.push(1e-3 * (number(0)? - number(1)?));
            current.push(number(2)?);
        }
        let newtons = NEWTONS_PER_KGF * load.parse::<f64>()?;
        let load_n = vec![newtons; position.len()];
        let record = motion(format!("{load} kgf"), ACTUATOR_HZ, position, current);
        Ok(Record { load: Some(load_n), ..record })
    };
    let train = ACTUATOR_FITTED.into_iter().map(of).collect::<Result<Vec<Record>>>()?;
    let holdout = vec![of(ACTUATOR_HELD_OUT)?];
    Ok(Set { model, recordings: Recordings { train, holdout, repeat: Vec::new() } })
}
