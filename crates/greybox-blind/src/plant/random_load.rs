//! Loads that change at random.

use core::f64::consts::PI;

use libm::sin;

use crate::{chance::Chance, effect::Form, machine::RATE_HZ};

/// A random load of unit size, at the rate of the recordings.
pub(super) fn series(form: &Form, samples: usize, chance: &mut Chance) -> Vec<f64> {
    let mut values = vec![0.0; samples];
    match *form {
        Form::Pulses { per_s, length_s } => {
            let mut at = 0.35 + chance.exponential(1.0 / per_s);
            while at < samples as f64 / RATE_HZ {
                let (height, length) =
                    (chance.sign() * chance.between(0.4, 1.6), length_s * chance.between(0.5, 2.0));
                for n in (at * RATE_HZ) as usize..(((at + length) * RATE_HZ) as usize).min(samples)
                {
                    let x = (n as f64 / RATE_HZ - at) / length;
                    values[n] += height * sin(PI * x.clamp(0.0, 1.0));
                }
                at += chance.exponential(1.0 / per_s);
            }
        }
        Form::Telegraph { dwell_s } => {
            let (mut until, mut now) = (chance.exponential(dwell_s), chance.sign());
            for (n, value) in values.iter_mut().enumerate() {
                if n as f64 / RATE_HZ > until {
                    now = -now;
                    until += chance.exponential(dwell_s);
                }
                *value = now;
            }
        }
        Form::Chaotic { rate } => {
            // Lorenz' oscillator, its first coordinate over its rms of 8
            let mut x = [chance.between(-5.0, 5.0), chance.between(-5.0, 5.0), 25.0];
            let h = rate / RATE_HZ / 8.0;
            for n in 0..samples + 4000 {
                for _ in 0..8 {
                    let d = |x: &[f64; 3]| {
                        [
                            10.0 * (x[1] - x[0]),
                            x[0] * (28.0 - x[2]) - x[1],
                            x[0] * x[1] - 8.0 / 3.0 * x[2],
                        ]
                    };
                    let k = d(&x);
                    let middle = core::array::from_fn(|i| x[i] + 0.5 * h * k[i]);
                    let k = d(&middle);
                    x = core::array::from_fn(|i| x[i] + h * k[i]);
                }
                if n >= 4000 {
                    values[n - 4000] = x[0] / 8.0;
                }
            }
        }
        _ => {}
    }
    values
}
