//! A test: command, load, duration, initial state, and the imperfections of the electronics.

use libm::{floor, sin};

use crate::{params::Actuator, simulation_error::SimulationError};

/// Meaning of a [`Command`]'s numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ControlMode {
    /// Angles of the surface, rad.
    #[default]
    Position,
    /// Speeds of the surface, rad/s, whatever their fields are called; the speed loop follows
    /// them, times the gear ratio, and the position loop rests.
    Speed,
}

/// Command to the position loop, at the surface; in speed mode ([`ControlMode`]) to the speed loop.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Command {
    /// Linear chirp from rest, `a·sin(2π·(f_0·t + (f_1 − f_0)/(2·T)·t²))`.
    Chirp {
        /// Amplitude `a`.
        amplitude_rad: f64,
        /// Frequency at the start, `f_0`.
        start_hz: f64,
        /// Frequency at the end of the sweep, `f_1`.
        end_hz: f64,
        /// Length of the sweep, `T`.
        sweep_s: f64,
    },
    /// `a·sin(2π·f·t)`.
    Sine {
        /// Amplitude `a`.
        amplitude_rad: f64,
        /// Frequency `f`.
        frequency_hz: f64,
    },
    /// Sum of sines, `Σ a_n·sin(2π·f_n·t + φ_n)`.
    MultiSine(Vec<Tone>),
    /// Held at each knot's value until the next knot; zero before the first.
    Steps(Vec<Knot>),
    /// Straight between knots, constant before the first and after the last.
    Ramps(Vec<Knot>),
    /// Up from zero in equal steps, each held for a time, and down again by as many.
    Staircase {
        /// Height of a step; negative to begin downward.
        step_rad: f64,
        /// Time on each step.
        dwell_s: f64,
        /// Steps up.
        steps: u32,
    },
    /// Samples at a fixed rate, held straight between them and constant after the last.
    Recorded {
        /// Angles.
        values_rad: Vec<f64>,
        /// Rate of the samples.
        rate_hz: f64,
    },
}

/// One sine of a [`Command::MultiSine`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// Amplitude `a_n`.
    pub amplitude_rad: f64,
    /// Frequency `f_n`.
    pub frequency_hz: f64,
    /// Phase at the start, `φ_n`.
    pub phase_rad: f64,
}

/// A time and the command there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// When; knots are in order of time.
    pub time_s: f64,
    /// Command.
    pub value_rad: f64,
}

impl Command {
    /// The chirp of the FREEDOM paper, section IV: 5 mrad, 0 to 15 Hz in 0.5 s.
    ///
    /// The printed start frequency is unreadable; 0 Hz is this project's reading.
    pub const CHIRP: Self =
        Self::Chirp { amplitude_rad: 5e-3, start_hz: 0.0, end_hz: 15.0, sweep_s: 0.5 };

    /// The sine of the FREEDOM paper's bench: 0.12 rad, 0.2 Hz.
    pub const SINE: Self = Self::Sine { amplitude_rad: 0.12, frequency_hz: 0.2 };

    /// Numbers of the command with their bounds.
    fn fields(&self) -> Vec<(&'static str, f64, f64, f64)> {
        let most = 1e6;
        match self {
            Self::Chirp { amplitude_rad, start_hz, end_hz, sweep_s } => vec![
                ("command.amplitude-rad", *amplitude_rad, -most, most),
                ("command.start-hz", *start_hz, 0.0, most),
                ("command.end-hz", *end_hz, 0.0, most),
                ("command.sweep-s", *sweep_s, f64::MIN_POSITIVE, most),
            ],
            Self::Sine { amplitude_rad, frequency_hz } => vec![
                ("command.amplitude-rad", *amplitude_rad, -most, most),
                ("command.frequency-hz", *frequency_hz, 0.0, most),
            ],
            Self::MultiSine(tones) => tones
                .iter()
                .flat_map(|tone| {
                    [
                        ("command.amplitude-rad", tone.amplitude_rad, -most, most),
                        ("command.frequency-hz", tone.frequency_hz, 0.0, most),
                        ("command.phase-rad", tone.phase_rad, -most, most),
                    ]
                })
                .collect(),
            Self::Steps(knots) | Self::Ramps(knots) => {
                let mut earliest = -most;
                let bounds = |knot: &Knot| {
                    let field = ("command.time-s", knot.time_s, earliest, most);
                    earliest = knot.time_s;
                    field
                };
                knots.iter().map(bounds).collect()
            }
            Self::Staircase { step_rad, dwell_s, .. } => vec![
                ("command.step-rad", *step_rad, -most, most),
                ("command.dwell-s", *dwell_s, f64::MIN_POSITIVE, most),
            ],
            Self::Recorded { rate_hz, .. } => {
                vec![("command.rate-hz", *rate_hz, f64::MIN_POSITIVE, 1e9)]
            }
        }
    }

    /// Refuses numbers out of bounds.
    pub(crate) fn check(&self) -> Result<(), SimulationError> {
        for (field, value, least, most) in self.fields() {
            if !(value >= least && value <= most) {
                return Err(SimulationError::Scenario { field, value, least, most });
            }
        }
        Ok(())
    }

    /// The command at a time.
    pub fn at(&self, time_s: f64) -> f64 {
        use core::f64::consts::TAU;
        match self {
            Self::Chirp { amplitude_rad, start_hz, end_hz, sweep_s } => {
                let t = time_s;
                let turns = start_hz * t + 0.5 * (end_hz - start_hz) / sweep_s * t * t;
                amplitude_rad * sin(TAU * turns)
            }
            Self::Sine { amplitude_rad, frequency_hz } => {
                amplitude_rad * sin(TAU * frequency_hz * time_s)
            }
            Self::MultiSine(tones) => tones
                .iter()
                .map(|t| t.amplitude_rad * sin(TAU * t.frequency_hz * time_s + t.phase_rad))
                .sum(),
            Self::Steps(knots) => {
                let passed = knots.partition_point(|knot| knot.time_s <= time_s);
                if passed == 0 { 0.0 } else { knots[passed - 1].value_rad }
            }
            Self::Ramps(knots) => ramp(knots, time_s),
            Self::Staircase { step_rad, dwell_s, steps } => {
                let (passed, top) = (floor(time_s / dwell_s), f64::from(*steps));
                step_rad * (top - (passed - top).abs()).max(0.0)
            }
            Self::Recorded { values_rad, rate_hz } => {
                // not negative, so that cutting it off is its floor
                let place = (time_s * rate_hz).max(0.0);
                let before = place as usize;
                match (values_rad.get(before), values_rad.get(before + 1)) {
                    (Some(a), Some(b)) => a + (b - a) * (place - before as f64),
                    _ => values_rad.last().copied().unwrap_or(0.0),
                }
            }
        }
    }
}

/// Straight between knots.
fn ramp(knots: &[Knot], time_s: f64) -> f64 {
    let passed = knots.partition_point(|knot| knot.time_s <= time_s);
    match (passed.checked_sub(1).map(|n| knots[n]), knots.get(passed)) {
        (Some(a), Some(b)) => {
            a.value_rad + (b.value_rad - a.value_rad) * (time_s - a.time_s) / (b.time_s - a.time_s)
        }
        (Some(end), None) => end.value_rad,
        (None, Some(start)) => start.value_rad,
        (None, None) => 0.0,
    }
}

/// Imperfections of the control electronics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Imperfections {
    /// Noise on measured speed and current.
    pub controller_noise: bool,
    /// Steps of the encoder and of the current set-point.
    pub digitisation: bool,
}

impl Imperfections {
    /// Noise and digitisation on, as in a real drive.
    pub const REAL: Self = Self { controller_noise: true, digitisation: true };
    /// Neither.
    pub const NONE: Self = Self { controller_noise: false, digitisation: false };
}

/// Ticks of a test: an hour at 10 kHz, whose trace takes 2 GB.
pub(crate) const MOST_TICKS: f64 = 4e7;

/// State at the start besides the rotor's angle and the place in the backlash.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InitialState {
    /// Speed of the motor; the surface is carried along where the play is closed on its side.
    pub motor_speed_rad_per_s: f64,
    /// Integral part of the current set-point, `ξ`.
    pub speed_integral_a: f64,
    /// Integral part of the current loop's voltage.
    pub current_integral_v: f64,
}

/// A test of an actuator.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Set-point of the surface.
    pub command: Command,
    /// Meaning of the command: an angle or a speed.
    pub mode: ControlMode,
    /// Hinge moment on the surface, positive against positive motion.
    pub load_n_m: f64,
    /// Dry torque of a brake on the motor shaft, before the play: it adds to the friction of the
    /// transmission, static and kinetic, and no fault changes it.
    pub brake_n_m: f64,
    /// Length.
    pub duration_s: f64,
    /// Mechanical angle of the rotor at the start; zero where phase A's electrical angle is.
    pub start_angle_rad: f64,
    /// Place of the surface in the backlash at the start, −1 to 1 (1: the upper side touches).
    pub backlash_side_ratio: f64,
    /// Speed and integrators at the start.
    pub initial: InitialState,
    /// Imperfections of the electronics.
    pub imperfections: Imperfections,
    /// Seed of the controller's noise.
    pub seed: u64,
}

impl Scenario {
    /// The chirp test of the paper's numerical experiments: 0.5 s with a load of 0.5 N·m.
    pub fn chirp() -> Self {
        Self {
            command: Command::CHIRP,
            mode: ControlMode::Position,
            load_n_m: 0.5,
            brake_n_m: 0.0,
            duration_s: 0.5,
            start_angle_rad: 0.0,
            backlash_side_ratio: 0.0,
            initial: InitialState::default(),
            imperfections: Imperfections::NONE,
            seed: 0,
        }
    }

    /// The sine test of the paper's bench: one period of 5 s without load.
    pub fn sine() -> Self {
        Self { command: Command::SINE, load_n_m: 0.0, duration_s: 5.0, ..Self::chirp() }
    }

    /// Turns the rotor at the start.
    #[must_use]
    pub fn turned_to(mut self, start_angle_rad: f64) -> Self {
        self.start_angle_rad = start_angle_rad;
        self
    }

    /// Takes real electronics, with a seed for their noise.
    #[must_use]
    pub fn with_real_electronics(mut self, seed: u64) -> Self {
        self.imperfections = Imperfections::REAL;
        self.seed = seed;
        self
    }

    /// A constant load within its bounds.
    pub(crate) fn check_load(load_n_m: f64) -> Result<(), SimulationError> {
        bounded("scenario.load-n-m", load_n_m, -1e6, 1e6)
    }

    /// The command at each tick of the controller.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] for a field out of bounds or a command beyond the stops.
    pub(crate) fn sampled_command(&self, actuator: &Actuator) -> Result<Vec<f64>, SimulationError> {
        let sample_hz = actuator.controller.sample_hz;
        Self::check_load(self.load_n_m)?;
        bounded("scenario.brake-n-m", self.brake_n_m, 0.0, 1e6)?;
        let longest_s = (MOST_TICKS / sample_hz).min(1e4);
        bounded("scenario.duration-s", self.duration_s, 1.0 / sample_hz, longest_s)?;
        bounded("scenario.start-angle-rad", self.start_angle_rad, -1e6, 1e6)?;
        bounded("scenario.backlash-side-ratio", self.backlash_side_ratio, -1.0, 1.0)?;
        let start = &self.initial;
        bounded("scenario.motor-speed-rad-per-s", start.motor_speed_rad_per_s, -1e5, 1e5)?;
        bounded("scenario.speed-integral-a", start.speed_integral_a, -1e6, 1e6)?;
        bounded("scenario.current-integral-v", start.current_integral_v, -1e6, 1e6)?;
        self.command.check()?;
        let ticks = libm::round(self.duration_s * sample_hz) as usize;
        let stop_rad = match self.mode {
            ControlMode::Position => actuator.transmission.stop_rad,
            ControlMode::Speed => 1e6,
        };
        let time_s = |tick: usize| tick as f64 / sample_hz;
        let commands_rad: Vec<f64> = (0..ticks).map(|tick| self.command.at(time_s(tick))).collect();
        let within = |command_rad: &f64| command_rad.abs() <= stop_rad;
        if let Some(tick) = commands_rad.iter().position(|command_rad| !within(command_rad)) {
            let (command_rad, time_s) = (commands_rad[tick], time_s(tick));
            match self.mode {
                ControlMode::Position => {
                    return Err(SimulationError::CommandBeyondStops {
                        command_rad,
                        time_s,
                        stop_rad,
                    });
                }
                ControlMode::Speed => {
                    bounded("command.speed-rad-per-s", command_rad, -stop_rad, stop_rad)?;
                }
            }
        }
        Ok(commands_rad)
    }
}

fn bounded(field: &'static str, value: f64, least: f64, most: f64) -> Result<(), SimulationError> {
    if value >= least && value <= most {
        Ok(())
    } else {
        Err(SimulationError::Scenario { field, value, least, most })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(command: &Command, times_s: &[f64]) -> Vec<f64> {
        times_s.iter().map(|time_s| command.at(*time_s)).collect()
    }

    #[test]
    fn a_staircase_goes_up_and_down() {
        let command = Command::Staircase { step_rad: 0.1, dwell_s: 1.0, steps: 2 };
        let found = at(&command, &[0.5, 1.5, 2.5, 3.5, 4.5, 9.5]);
        assert_eq!(found, [0.0, 0.1, 0.2, 0.1, 0.0, 0.0]);
    }

    #[test]
    fn knots_are_held_or_joined() {
        let knots =
            vec![Knot { time_s: 1.0, value_rad: 0.2 }, Knot { time_s: 3.0, value_rad: -0.2 }];
        let times_s = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(at(&Command::Steps(knots.clone()), &times_s), [0.0, 0.2, 0.2, -0.2, -0.2]);
        assert_eq!(at(&Command::Ramps(knots), &times_s), [0.2, 0.2, 0.0, -0.2, -0.2]);
        assert_eq!(at(&Command::Ramps(Vec::new()), &[1.0]), [0.0]);
    }

    #[test]
    fn one_tone_is_the_sine() {
        let tone = Tone { amplitude_rad: 0.12, frequency_hz: 0.2, phase_rad: 0.0 };
        for time_s in [0.1, 1.0, 3.3] {
            assert_eq!(Command::MultiSine(vec![tone]).at(time_s), Command::SINE.at(time_s));
        }
    }
}
