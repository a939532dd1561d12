//! The LAAS drone motor: what inertia and viscous drag alone leave out.

use core::f64::consts::TAU;

use anyhow::{Result, bail};
use ema_sim::{
    AxisInput, AxisScenario, AxisStart, AxisTrace, Command, Effect, HealthState,
    ServoAxisSimulation,
    model_file::{AxisModel, MachineModel, parse_machine},
};
use greybox::{
    Calibrated, CommandKind, Explained, Options, Record, Recordings, calibrate, explain, rms,
};

use super::{
    recording::{columns, interpolated},
    setting::JOBS,
};

const RATE_HZ: f64 = 1000.0;
/// Samples of a held position differ by less, rad; the next position is 2 mrad on.
const HELD_RAD: f64 = 5e-4;
/// Mean pace at which the map of held positions is taken to have been passed, rad/s.
const PACE_RAD_PER_S: f64 = 0.6;
/// Times that the pace swings on the way.
const PACE_SWINGS: f64 = 2.0;
/// Bins of a turn.
const BINS: usize = 1440;

pub(crate) fn model() -> Result<MachineModel> {
    Ok(parse_machine(include_str!("../../../../../fixtures/models/laas.toml"))?)
}

/// Angle and current at equal times.
fn record(name: &str, angle_rad: Vec<f64>, current_a: Vec<f64>) -> Record {
    Record {
        name: name.to_owned(),
        rate_hz: RATE_HZ,
        command: angle_rad.clone(),
        kind: CommandKind::Motion,
        drive: current_a,
        position: Some(angle_rad),
        load: None,
        filter_hz: None,
        start_rad: None,
    }
}

/// Mean angle and current of each held position, one after another in the direction of the sweep.
fn held(angle_rad: &[f64], current_a: &[f64]) -> Vec<(f64, f64)> {
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let (mut points, mut first) = (Vec::new(), 0);
    for n in 1..=angle_rad.len() {
        if n == angle_rad.len() || (angle_rad[n] - angle_rad[first]).abs() > HELD_RAD {
            points.push((mean(&angle_rad[first..n]), mean(&current_a[first..n])));
            first = n;
        }
    }
    let (Some(&start), Some(&end)) = (points.first(), points.last()) else { return points };
    let direction = (end.0 - start.0).signum();
    let mut onward = vec![start];
    for point in points {
        if onward.last().is_some_and(|last| (point.0 - last.0) * direction > 1e-6) {
            onward.push(point);
        }
    }
    onward
}

/// A slow passage over held positions. Its pace swings: at a constant one an order of the angle
/// would be a frequency.
fn sweep(name: &str, points: &[(f64, f64)]) -> Record {
    let (start, end) = (points[0].0, points[points.len() - 1].0);
    let duration_s = (end - start).abs() / PACE_RAD_PER_S;
    let turns = TAU * PACE_SWINGS / duration_s;
    let at = |n: usize| {
        let t = n as f64 / RATE_HZ;
        let gone = t - (turns * t).sin() / (2.0 * turns);
        start + (end - start).signum() * PACE_RAD_PER_S * gone
    };
    let angle: Vec<f64> = (0..(duration_s * RATE_HZ) as usize).map(at).collect();
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (angles, currents): (Vec<f64>, Vec<f64>) = sorted.into_iter().unzip();
    let current = angle.iter().map(|x| interpolated(&angles, &currents, *x)).collect();
    record(name, angle, current)
}

/// Columns at equal times, straight between samples: recordings have gaps of a few ms. The first
/// column holds the times.
pub(super) fn at_equal_times(columns: &[Vec<f64>], rate_hz: f64) -> Vec<Vec<f64>> {
    let (start, end) = (columns[0][0], columns[0][columns[0].len() - 1]);
    let samples = ((end - start) * rate_hz) as usize;
    let at = |column: &Vec<f64>| {
        let of = |n: usize| interpolated(&columns[0], column, start + n as f64 / rate_hz);
        (0..samples).map(of).collect()
    };
    columns.iter().map(at).collect()
}

/// The recordings to learn from.
pub(crate) struct Data {
    up: Record,
    down: Record,
    first: Record,
    second: Record,
}

impl Data {
    pub(crate) fn read() -> Result<Self> {
        let map = columns("laas_cogging/stopped_data.csv.gz")?;
        let (angle, current) = (&map[1], &map[3]);
        let top = (0..angle.len()).fold(0, |top, n| if angle[n] > angle[top] { n } else { top });
        let run = at_equal_times(&columns("laas_cogging/acc_current.csv.gz")?, RATE_HZ);
        let half = run[0].len() / 2;
        let part = |name: &str, range: core::ops::Range<usize>| {
            record(name, run[1][range.clone()].to_vec(), run[3][range].to_vec())
        };
        Ok(Self {
            up: sweep("held positions, upwards", &held(&angle[..top], &current[..top])),
            down: sweep("held positions, downwards", &held(&angle[top..], &current[top..])),
            first: part("2 Hz current, first half", 0..half),
            second: part("2 Hz current, second half", half..run[0].len()),
        })
    }

    /// The first samples of each recording.
    #[cfg(test)]
    pub(super) fn shortened(mut self, samples: usize) -> Self {
        for record in [&mut self.up, &mut self.down, &mut self.first, &mut self.second] {
            record.command.truncate(samples);
            record.drive.truncate(samples);
            record.position.as_mut().expect("a motion").truncate(samples);
        }
        self
    }

    /// Inertia, drag and dry friction of a healthy motor.
    pub(super) fn calibrated(&self) -> Result<Calibrated> {
        let train = vec![self.up.clone(), self.down.clone(), self.first.clone()];
        let holdout = vec![self.second.clone()];
        let recordings = Recordings { train, holdout, repeat: Vec::new() };
        Ok(calibrate(&model()?, &recordings, JOBS)?)
    }

    /// One way over the map and half of the run fitted, the others held out.
    pub(super) fn explained(&self, model: &MachineModel, options: &Options) -> Result<Explained> {
        Ok(explain(model, &self.recordings(), options)?)
    }

    /// One way over the map and half of the run to fit, the others held out.
    pub(crate) fn recordings(&self) -> Recordings {
        Recordings {
            train: vec![self.up.clone(), self.first.clone()],
            holdout: vec![self.down.clone(), self.second.clone()],
            repeat: Vec::new(),
        }
    }
}

/// Order of a turn and its amplitude, largest first.
pub(super) fn orders_of_table() -> Result<Vec<(usize, f64)>> {
    let table = columns("laas_cogging/cogging_table.csv.gz")?;
    let (angle, current) = (&table[0], &table[1]);
    let mut orders: Vec<(usize, f64)> =
        (1..=200).map(|order| (order, amplitude(angle, current, order as f64))).collect();
    orders.sort_by(|a, b| b.1.total_cmp(&a.1));
    Ok(orders)
}

/// Amplitude of an order of the angle in a signal.
fn amplitude(angle_rad: &[f64], signal: &[f64], order: f64) -> f64 {
    let [sin, cos] = in_and_out(angle_rad, signal, order);
    sin.hypot(cos)
}

/// Phase of an order of the angle in a signal: of `a·cos(order·angle − phase)`.
fn phase(angle_rad: &[f64], signal: &[f64], order: f64) -> f64 {
    let [sin, cos] = in_and_out(angle_rad, signal, order);
    sin.atan2(cos)
}

/// Sizes of sine and cosine of an order.
fn in_and_out(angle_rad: &[f64], signal: &[f64], order: f64) -> [f64; 2] {
    let mean = signal.iter().sum::<f64>() / signal.len() as f64;
    let (mut sin, mut cos) = (0.0, 0.0);
    for (angle, value) in angle_rad.iter().zip(signal) {
        sin += (value - mean) * (order * angle).sin();
        cos += (value - mean) * (order * angle).cos();
    }
    [sin, cos].map(|sum| 2.0 * sum / signal.len() as f64)
}

/// The phase of a speed test in which the drive's own table is off.
pub(super) struct TableOff {
    pub(super) flag: f64,
    /// Ripple of speed at order 72 with this flag and with the other, rad/s.
    pub(super) ripples: [f64; 2],
    reference: Vec<f64>,
    angle: Vec<f64>,
    speed: Vec<f64>,
    current: Vec<f64>,
}

impl TableOff {
    /// Flag of a file whose speed ripples more at order 72.
    pub(super) fn read(file: &str) -> Result<Self> {
        let all = columns(&format!("laas_cogging/{file}.csv.gz"))?;
        let phase = |flag: f64| -> Vec<Vec<f64>> {
            let keep = |column: &Vec<f64>| {
                column.iter().zip(&all[5]).filter(|(_, f)| **f == flag).map(|(x, _)| *x).collect()
            };
            all.iter().map(keep).collect()
        };
        let phases = [phase(0.0), phase(1.0)];
        let ripple = |columns: &[Vec<f64>]| amplitude(&columns[1], &columns[2], 72.0);
        let ripples = [ripple(&phases[0]), ripple(&phases[1])];
        let off = usize::from(ripples[1] > ripples[0]);
        let [_, angle, speed, reference, current, _] = &at_equal_times(&phases[off], RATE_HZ)[..]
        else {
            bail!("{file}: six columns");
        };
        Ok(Self {
            flag: off as f64,
            ripples: [ripples[off], ripples[1 - off]],
            reference: reference.clone(),
            angle: angle.clone(),
            speed: speed.clone(),
            current: current.clone(),
        })
    }

    fn simulated(&self, model: &AxisModel, from: usize, samples: usize) -> Result<AxisTrace> {
        let scenario = AxisScenario {
            input: AxisInput::Speed(Command::Recorded {
                values_rad: self.reference[from..from + samples].to_vec(),
                rate_hz: RATE_HZ,
            }),
            load: 0.0,
            duration_s: samples as f64 / RATE_HZ,
            start: AxisStart {
                position: self.angle[from],
                speed: self.speed[from],
                ..AxisStart::default()
            },
        };
        let effects: Vec<Effect> = model.effects.iter().map(|b| b.effect.clone()).collect();
        let simulation =
            ServoAxisSimulation::new(&model.axis, &scenario)?.with_effects(&effects)?;
        Ok(simulation.try_simulate(&(&HealthState::HEALTHY).into())?)
    }

    /// Remainder of the recording after a model in closed loop.
    pub(super) fn judged(&self, model: &AxisModel) -> Result<Judged> {
        let trace = self.simulated(model, 0, self.angle.len())?;
        let apart = |measured: &[f64], model: &[f64]| {
            rms(&measured.iter().zip(model).map(|(a, b)| a - b).collect::<Vec<f64>>())
        };
        let over = |measured: &[f64], model: &[f64]| {
            over_angle((&self.angle, measured), (&trace.position, model))
        };
        Ok(Judged {
            mean_speed: trace.speed.iter().sum::<f64>() / trace.speed.len() as f64,
            in_time: [apart(&self.speed, &trace.speed), apart(&self.current, &trace.output)],
            over_angle: [over(&self.speed, &trace.speed), over(&self.current, &trace.output)],
            ripple: amplitude(&trace.position, &trace.output, 72.0),
        })
    }

    /// Root mean square of what a model leaves of speed and current where it is started anew from
    /// measured angle and speed each so many samples.
    pub(super) fn restarted(&self, model: &AxisModel, samples: usize) -> Result<[f64; 2]> {
        let (mut speed, mut current) = (Vec::new(), Vec::new());
        for from in (0..self.angle.len() - samples).step_by(samples) {
            let trace = self.simulated(model, from, samples)?;
            speed.extend((0..samples).map(|n| self.speed[from + n] - trace.speed[n]));
            current.extend((0..samples).map(|n| self.current[from + n] - trace.output[n]));
        }
        Ok([rms(&speed), rms(&current)])
    }

    /// How the recorded signals hang together.
    pub(super) fn signals(&self) -> Signals {
        let slope: Vec<f64> =
            self.angle.windows(3).map(|w| 0.5 * RATE_HZ * (w[2] - w[0])).collect();
        let speed = &self.speed[1..=slope.len()];
        let lawful: Vec<f64> =
            self.reference.iter().zip(&self.speed).map(|(r, v)| SPEED_GAIN * (r - v)).collect();
        Signals {
            slope_ratio: amplitude(&self.angle[1..=slope.len()], speed, 72.0)
                / amplitude(&self.angle[1..=slope.len()], &slope, 72.0),
            speed_late_ms: late(&slope, speed).0,
            current_late_ms: late(&lawful, &self.current).0,
            current_off_a: late(&lawful, &self.current).1,
            phase_deg: phase(&self.angle, &self.current, 72.0).to_degrees(),
        }
    }

    pub(super) fn mean_speed(&self) -> f64 {
        self.speed.iter().sum::<f64>() / self.speed.len() as f64
    }

    /// Amplitude of order 72 in the measured current, A.
    pub(super) fn ripple(&self) -> f64 {
        amplitude(&self.angle, &self.current, 72.0)
    }
}

/// Gain of the speed loop of these recordings, A·s/rad.
const SPEED_GAIN: f64 = 0.09;
/// Most samples that a signal is tried later than another.
const MOST_LATE: usize = 8;

/// Delays and remainders between the recorded signals of a speed test.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signals {
    /// Ripple of order 72 of the recorded speed over that of the slope of the recorded angle.
    pub(super) slope_ratio: f64,
    /// By how much the recorded speed fits that slope best when later, ms.
    pub(super) speed_late_ms: f64,
    /// Delay between the recorded current and the law of the speed loop, ms.
    pub(super) current_late_ms: f64,
    /// Remainder between these two then, A.
    pub(super) current_off_a: f64,
    /// Phase of order 72 of the recorded current, degrees.
    pub(super) phase_deg: f64,
}

/// Milliseconds by which `signal` follows `source`, and the root mean square between them then.
fn late(source: &[f64], signal: &[f64]) -> (f64, f64) {
    let off = |samples: usize| {
        let pairs = source.iter().zip(&signal[samples..]);
        rms(&pairs.take(source.len() - MOST_LATE).map(|(a, b)| a - b).collect::<Vec<f64>>())
    };
    let tried = (0..=MOST_LATE).map(|samples| (samples as f64 * 1e3 / RATE_HZ, off(samples)));
    tried.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.0, 0.0))
}

/// Remainders after a model: speed in rad/s, current in A.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    pub(super) mean_speed: f64,
    /// Root mean square of the difference at equal times.
    pub(super) in_time: [f64; 2],
    /// Remainders of the means over each quarter of a degree of a turn.
    pub(super) over_angle: [f64; 2],
    /// Amplitude of order 72 in the simulated current, A.
    pub(super) ripple: f64,
}

/// Difference of two signals, each the mean over the bins of a turn by its own angle.
fn over_angle(measured: (&[f64], &[f64]), simulated: (&[f64], &[f64])) -> f64 {
    let means = |(angle, signal): (&[f64], &[f64])| {
        let mut sums = vec![(0.0, 0.0); BINS];
        for (angle, value) in angle.iter().zip(signal) {
            let bin = (angle.rem_euclid(TAU) / TAU * BINS as f64) as usize;
            let (sum, count) = &mut sums[bin.min(BINS - 1)];
            *sum += value;
            *count += 1.0;
        }
        sums
    };
    let pairs = means(measured).into_iter().zip(means(simulated));
    let both = pairs.filter(|(a, b)| a.1 > 0.0 && b.1 > 0.0);
    rms(&both.map(|(a, b)| a.0 / a.1 - b.0 / b.1).collect::<Vec<f64>>())
}
