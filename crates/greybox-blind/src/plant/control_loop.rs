//! The loops for position and speed, with the sensor of the position.

use libm::floor;

use super::{Run, Subject, delay::late};
use crate::{
    effect::{Form, Hidden},
    machine::{Machine, Numbers},
};

/// Position and speed loop with its position sensor.
pub(super) struct Loop {
    numbers: Numbers,
    /// Where the command begins.
    pub(super) origin: f64,
    gains: [f64; 3],
    integral: f64,
    position_late_s: f64,
    output_late_s: f64,
    positions: Vec<f64>,
    outputs: Vec<f64>,
    play: Option<(f64, f64, f64)>,
    waves: Vec<Hidden>,
}

impl Loop {
    pub(super) fn new(subject: &Subject<'_>, start: f64) -> Self {
        let servo = subject.numbers.machine == Machine::Servo;
        let origin = if servo { start } else { 0.0 };
        let mut all = Self {
            numbers: subject.numbers,
            origin,
            gains: [1.0; 3],
            integral: 0.0,
            position_late_s: 0.0,
            output_late_s: 0.0,
            positions: Vec::new(),
            outputs: vec![0.0],
            play: None,
            waves: Vec::new(),
        };
        for effect in subject.hidden {
            match &effect.form {
                Form::Gains { shares } => {
                    for (gain, share) in all.gains.iter_mut().zip(shares) {
                        *gain += effect.size * share;
                    }
                }
                Form::PositionLate => all.position_late_s += effect.size,
                Form::OutputLate => all.output_late_s += effect.size,
                Form::RatePlay { speed } => all.play = Some((effect.size, *speed, origin)),
                Form::Disc(_) | Form::GearError(_) => all.waves.push(effect.clone()),
                _ => {}
            }
        }
        all
    }

    /// The position as the loop's sensor shows it: of the surface, or of the servo's motor.
    pub(super) fn shown(&mut self, run: &Run<'_>) -> f64 {
        let motor = run.start + run.x[0];
        let mut position = match self.numbers.machine {
            Machine::Ema48 => run.surface(),
            Machine::Servo => motor,
        };
        for effect in &self.waves {
            if let Form::Disc(wave) | Form::GearError(wave) = &effect.form {
                position += effect.size * wave.at(motor);
            }
        }
        if let Some((width, speed, held)) = &mut self.play {
            let half = 0.5 * *width / (1.0 + (run.x[1] / *speed).abs());
            *held = held.clamp(position - half, position + half);
            position = *held;
        }
        if self.position_late_s > 0.0 {
            self.positions.push(position);
            position = late(&self.positions, self.position_late_s * self.numbers.tick_hz);
        }
        position
    }

    /// The current to hold in this tick.
    pub(super) fn step(&mut self, command: f64, shown: f64, speed: f64) -> f64 {
        let n = &self.numbers;
        let step = n.encoder_step;
        let position = if step > 0.0 { step * floor(shown / step + 0.5) } else { shown };
        let wanted_speed = self.gains[0] * n.position_gain * (command - position);
        let error = wanted_speed.clamp(-n.speed_limit, n.speed_limit) - speed;
        let wanted = self.gains[1] * n.speed_gain * error + self.integral;
        if wanted.abs() < n.current_limit {
            self.integral += self.gains[2] * n.speed_integral / n.tick_hz * error;
        }
        let output = wanted.clamp(-n.current_limit, n.current_limit);
        if self.output_late_s == 0.0 {
            return output;
        }
        self.outputs.push(output);
        // the mean over the tick of an output that changes within it
        late(&self.outputs, self.output_late_s * n.tick_hz)
    }
}
