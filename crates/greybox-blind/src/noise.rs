//! Noise of the current sensor.

use core::f64::consts::TAU;

use libm::{sin, sqrt};

use crate::chance::{Chance, Purpose};

/// Lowest rms of the current noise in any case, A.
pub const LOWEST_NOISE_A: f64 = 0.005;

/// Kind of noise, each with its rms beside it; all but the first two are unusual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum NoiseKind {
    White,
    /// First-order, as the speed loop colours it; the correlation of neighbours.
    Coloured {
        correlation: f64,
    },
    /// Student's t with three degrees of freedom.
    HeavyTails,
    /// White, with stretches some times as loud.
    Bursts {
        per_s: f64,
        loudness: f64,
    },
    /// White, louder with the speed.
    Speed {
        per_speed: f64,
    },
    /// White with the mains and its third harmonic.
    Mains {
        share: f64,
    },
}

/// How far a grid is off its frequency, Hz.
const MOST_OFF_HZ: f64 = 0.05;

impl NoiseKind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Coloured { .. } => "coloured",
            Self::HeavyTails => "heavy-tails",
            Self::Bursts { .. } => "bursts",
            Self::Speed { .. } => "speed-dependent",
            Self::Mains { .. } => "mains",
        }
    }
}

/// Noise of a machine's current sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noise {
    pub(crate) kind: NoiseKind,
    pub(crate) rms_a: f64,
}

impl Noise {
    /// Draws a usual noise, or an unusual one by number.
    pub(crate) fn draw(unusual: Option<usize>, mean_speed: f64, chance: &mut Chance) -> Self {
        let rms_a = chance.log_between(LOWEST_NOISE_A, 4.0 * LOWEST_NOISE_A);
        let kind = match unusual {
            None if chance.chance(0.4) => NoiseKind::White,
            None => NoiseKind::Coloured { correlation: chance.between(0.4, 0.92) },
            Some(0) => NoiseKind::HeavyTails,
            Some(1) => NoiseKind::Bursts {
                per_s: chance.between(0.5, 2.0),
                loudness: chance.between(3.0, 6.0),
            },
            Some(2) => NoiseKind::Speed { per_speed: chance.between(0.5, 1.5) / mean_speed },
            Some(_) => NoiseKind::Mains { share: chance.between(0.5, 1.5) },
        };
        Self { kind, rms_a }
    }

    /// Noise for the samples of a recording at a rate, with the speed at each.
    pub(crate) fn samples(&self, speeds: &[f64], rate_hz: f64, seed: u64) -> Vec<f64> {
        let mut chance = Chance::new(seed, Purpose::Noise, 0);
        let mut values = Vec::with_capacity(speeds.len());
        let mut last = chance.normal();
        let (mut loud_until, mut next) = (0.0, f64::INFINITY);
        if let NoiseKind::Bursts { per_s, .. } = self.kind {
            next = chance.exponential(1.0 / per_s);
        }
        let phases = [chance.angle(), chance.angle()];
        let mains_hz = match self.kind {
            NoiseKind::Mains { .. } => 50.0 + chance.between(-MOST_OFF_HZ, MOST_OFF_HZ),
            _ => 50.0,
        };
        for (n, speed) in speeds.iter().enumerate() {
            let time_s = n as f64 / rate_hz;
            let unit = match self.kind {
                NoiseKind::White => chance.normal(),
                NoiseKind::Coloured { correlation } => {
                    last = correlation * last
                        + sqrt(1.0 - correlation * correlation) * chance.normal();
                    last
                }
                NoiseKind::HeavyTails => chance.student_3(),
                NoiseKind::Bursts { per_s, loudness } => {
                    if time_s > next {
                        loud_until = time_s + chance.between(0.01, 0.06);
                        next += chance.exponential(1.0 / per_s);
                    }
                    chance.normal() * if time_s < loud_until { loudness } else { 1.0 }
                }
                NoiseKind::Speed { per_speed } => chance.normal() * (1.0 + per_speed * speed.abs()),
                NoiseKind::Mains { share } => {
                    let turn = TAU * mains_hz * time_s;
                    let line = sin(turn + phases[0]) + 0.3 * sin(3.0 * turn + phases[1]);
                    chance.normal() + share * line
                }
            };
            values.push(self.rms_a * unit);
        }
        values
    }

    /// A difference of currents in units of the noise: independent and of unit variance where
    /// the noise is Gaussian.
    pub(crate) fn whitened(&self, difference: &[f64]) -> Vec<f64> {
        let NoiseKind::Coloured { correlation } = self.kind else {
            return difference.iter().map(|d| d / self.rms_a).collect();
        };
        let innovation = self.rms_a * sqrt(1.0 - correlation * correlation);
        let mut before = None;
        let whiten = |d: &f64| match before.replace(*d) {
            None => d / self.rms_a,
            Some(last) => (d - correlation * last) / innovation,
        };
        difference.iter().map(whiten).collect()
    }
}

/// A sensor whose noise is as no data sheet has it.
#[derive(Clone, Copy, Debug)]
pub struct UnusualNoise(Noise);

impl UnusualNoise {
    /// Noise of a machine with this mean speed: by its kind, modulo four, of heavy tails, in bursts,
    /// louder with the speed, or with the mains.
    pub fn draw(kind: usize, mean_speed_rad_per_s: f64, seed: u64) -> Self {
        let mut chance = Chance::new(seed, Purpose::Noise, 1);
        Self(Noise::draw(Some(kind % 4), mean_speed_rad_per_s.max(f64::MIN_POSITIVE), &mut chance))
    }

    /// Noise of a recording with these speeds, A.
    pub fn samples_a(&self, speeds_rad_per_s: &[f64], rate_hz: f64, seed: u64) -> Vec<f64> {
        self.0.samples(speeds_rad_per_s, rate_hz, seed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::RATE_HZ;

    fn moments(values: &[f64]) -> (f64, f64) {
        let n = values.len() as f64;
        let power = values.iter().map(|v| v * v).sum::<f64>() / n;
        let neighbours = values.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n;
        (power, neighbours / power)
    }

    #[test]
    fn law_colour_and_rms() {
        let noise = Noise { kind: NoiseKind::Coloured { correlation: 0.7 }, rms_a: 0.01 };
        let values = noise.samples(&vec![0.0; 200_000], RATE_HZ, 5);
        let (power, correlation) = moments(&values);
        // five standard errors: a variance of correlated samples, √(2/n·(1+φ²)/(1−φ²)); √((1−φ²)/n)
        let n = 200_000_f64;
        let spread = 5.0 * (2.0 / n * (1.0 + 0.49) / (1.0 - 0.49)).sqrt();
        assert!((power / 1e-4 - 1.0).abs() < spread, "{power}");
        assert!((correlation - 0.7).abs() < 5.0 * (0.51 / n).sqrt(), "{correlation}");
        let (power, correlation) = moments(&noise.whitened(&values));
        assert!((power - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{power}");
        assert!(correlation.abs() < 5.0 / n.sqrt(), "{correlation}");
        assert_ne!(
            values,
            noise.samples(&vec![0.0; 200_000], RATE_HZ, 6),
            "another seed must differ"
        );
    }

    #[test]
    fn unusual_noises_are_what_they_are_called() {
        let speeds: Vec<f64> = (0..100_000).map(|n| if n < 50_000 { 0.0 } else { 10.0 }).collect();
        let of = |kind| Noise { kind, rms_a: 1.0 }.samples(&speeds, RATE_HZ, 9);
        let fourth = |values: &[f64]| {
            let (power, _) = moments(values);
            values.iter().map(|v| v.powi(4)).sum::<f64>() / values.len() as f64 / power / power
        };
        assert!(fourth(&of(NoiseKind::White)) < 3.2);
        assert!(fourth(&of(NoiseKind::HeavyTails)) > 5.0);
        assert!(fourth(&of(NoiseKind::Bursts { per_s: 2.0, loudness: 5.0 })) > 5.0);
        let fast = of(NoiseKind::Speed { per_speed: 0.1 });
        let ratio = moments(&fast[50_000..]).0 / moments(&fast[..50_000]).0;
        assert!((3.5..4.5).contains(&ratio), "{ratio}");
        let mains = of(NoiseKind::Mains { share: 1.0 });
        let at = |hz: f64| {
            let turn = |n: usize| TAU * hz * n as f64 / RATE_HZ;
            let dot = |f: fn(f64) -> f64| -> f64 {
                mains.iter().enumerate().map(|(n, v)| v * f(turn(n))).sum::<f64>()
            };
            2.0 * dot(f64::sin).hypot(dot(f64::cos)) / mains.len() as f64
        };
        let about = |n: i32| 50.0 + 0.005 * f64::from(n);
        let line = (-20..=20).map(|n| at(about(n))).fold(0.0, f64::max);
        assert!((line - 1.0).abs() < 0.05 && at(70.0) < 0.05);
        // drawn off 50 Hz, and not by more than a grid is
        assert!(at(50.0) < 0.99 && at(49.9) < 0.3 && at(50.1) < 0.3);
    }
}
