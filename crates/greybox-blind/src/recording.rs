//! Recordings and commands as text.

use std::fmt::Write;

use crate::{
    chance::Chance,
    command::Course,
    error::BlindError,
    information::Setting,
    machine::{Machine, RATE_HZ},
};

/// Use of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Role {
    /// Fitting.
    Train,
    /// Judging: another command.
    HoldOut,
    /// The floor of the noise: a training command once more.
    Repeat,
}

impl Role {
    /// Name in listings and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::HoldOut => "holdout",
            Self::Repeat => "repeat",
        }
    }
}

/// A recording to be written to disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// Name, which tells nothing.
    pub name: String,
    /// Use of the recording.
    pub role: Role,
    /// CSV with metadata.
    pub text: String,
}

/// Columns of a recording.
pub(crate) struct Columns<'a> {
    pub(crate) setting: &'a Setting,
    pub(crate) current: &'a [f64],
    pub(crate) position: &'a [f64],
}

/// To a number of decimals.
pub(crate) fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = libm::pow(10.0, f64::from(decimals));
    libm::floor(value * scale + 0.5) / scale
}

/// Step of the actuator's motor encoder, rad: 16 bit a turn.
const MOTOR_STEP: f64 = core::f64::consts::TAU / 65536.0;

/// Writes a recording with its columns in a random order after the time.
pub(crate) fn write(machine: Machine, columns: &Columns<'_>, chance: &mut Chance) -> String {
    let setting = columns.setting;
    let servo = machine == Machine::Servo;
    let origin = if servo { setting.start_rad } else { 0.0 };
    let step = if servo { 1e-6 } else { MOTOR_STEP };
    let current = if servo { "q_axis_current_a" } else { "current_a" };
    let course = &setting.course;
    let column = |name: &str, n: usize| -> f64 {
        match name {
            "command_rad" => course.command_rad[n] + origin,
            "motor_angle_rad" => step * libm::floor(columns.position[n] / step + 0.5),
            "load_n_m" => course.load_n_m[n],
            _ => columns.current[n],
        }
    };
    let mut order = ["command_rad", "motor_angle_rad", current, "load_n_m"];
    chance.shuffle(&mut order);
    let mut text = String::with_capacity(columns.current.len() * 56);
    let _ = writeln!(text, "# command = \"recorded\"\n# rate-hz = {RATE_HZ:?}");
    if !servo {
        text.push_str("# envelope = \"conducting-phase\"\n");
    }
    let _ = writeln!(text, "# start-angle-rad = {:?}", setting.start_rad);
    let _ = writeln!(text, "time_s,{}", order.join(","));
    for n in 0..columns.current.len() {
        let _ = write!(text, "{:.4}", n as f64 / RATE_HZ);
        for name in order {
            let value = column(name, n);
            let _ = match name {
                "load_n_m" => write!(text, ",{value:.4}"),
                "command_rad" => write!(text, ",{value:.8}"),
                "motor_angle_rad" => write!(text, ",{value:.7}"),
                _ => write!(text, ",{value:.6}"),
            };
        }
        text.push('\n');
    }
    text
}

/// Most samples of a proposed recording: a minute.
const MOST_SAMPLES: usize = 120_000;

/// Reads a command; with its first value.
pub(crate) fn read_command(text: &str) -> Result<(Course, f64), BlindError> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| {
        let line = line.trim();
        !line.is_empty() && !line.starts_with('#')
    });
    let names: Vec<&str> =
        lines.next().map_or("", |(_, line)| line).split(',').map(str::trim).collect();
    let place = |column: &'static str| {
        names.iter().position(|name| *name == column).ok_or(BlindError::NoColumn { column })
    };
    let (time, command) = (place("time_s")?, place("command_rad")?);
    let load = place("load_n_m").ok();
    let mut knots: Vec<[f64; 3]> = Vec::new();
    for (n, line) in lines {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |place: usize| fields.get(place).and_then(|f| f.trim().parse::<f64>().ok());
        let read = || {
            let at_load = load.map_or(Some(0.0), number)?;
            Some([number(time)?, number(command)?, at_load])
        };
        let knot = read().filter(|knot| knot.iter().all(|v| v.is_finite()));
        knots.push(knot.ok_or(BlindError::NotNumbers { line: n + 1 })?);
    }
    let length = |samples| BlindError::Length { samples, most: MOST_SAMPLES };
    if knots.len() < 2 {
        return Err(length(knots.len()));
    }
    let start_s = knots[0][0];
    let samples = ((knots[knots.len() - 1][0] - start_s) * RATE_HZ + 1.5) as usize;
    if !(2..=MOST_SAMPLES).contains(&samples) {
        return Err(length(samples));
    }
    let at = |time_s: f64, column: usize| {
        let next = knots.partition_point(|k| k[0] <= time_s).clamp(1, knots.len() - 1);
        let (a, b) = (&knots[next - 1], &knots[next]);
        let part =
            if b[0] > a[0] { ((time_s - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0) } else { 1.0 };
        a[column] + (b[column] - a[column]) * part
    };
    let sampled = |column: usize, decimals: i32| -> Vec<f64> {
        let times = (0..samples).map(|n| start_s + n as f64 / RATE_HZ);
        times.map(|t| rounded(at(t, column), decimals)).collect()
    };
    let course = Course { command_rad: sampled(1, 8), load_n_m: sampled(2, 4) };
    let first = course.command_rad[0];
    Ok((course, first))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_read_at_any_rate() {
        let text = "# made up\ntime_s,load_n_m,command_rad\n0,0,1\n0.001,2,3\n0.002,2,3\n";
        let (course, first) = read_command(text).unwrap();
        assert_eq!(first, 1.0);
        assert_eq!(course.command_rad, [1.0, 2.0, 3.0, 3.0, 3.0]);
        assert_eq!(course.load_n_m, [0.0, 1.0, 2.0, 2.0, 2.0]);
    }

    #[test]
    fn what_is_no_command_is_refused_by_name() {
        let error = |text| read_command(text).unwrap_err().to_string();
        assert_eq!(error("time_s\n0\n"), "the command has no column `command_rad`");
        assert_eq!(error("time_s,command_rad\n0,1\n1,x\n"), "line 3 of the command is not numbers");
        assert_eq!(
            error("time_s,command_rad\n0,1\n"),
            "the command has 1 samples, expected 2 to 120000"
        );
    }
}
