//! The stator envelope current: from phase currents to the signal that is diagnosed.

use core::f64::consts::{FRAC_2_PI, TAU};

use crate::phase::{ContinuingPhase, PerPhase, Sector};

/// Definition of the envelope.
///
/// With two phases carrying `I` all of them give `I`; they differ in what they make of the idle
/// phase and of commutation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Envelope {
    /// `½·Σ|i_j|`, always positive: the idle phase's ripple adds to it. Kept for likeness with
    /// the paper.
    HalfAbsSum,
    /// `½·Σ s_j·i_j`, the projection on the six-step pattern.
    SignedProjection,
    /// `s_j·i_j` of the phase that goes on conducting through commutation.
    ConductingPhase,
    /// The current in quadrature to the rotor, for sinusoidal drives.
    QAxis,
}

impl Envelope {
    /// Variance of a sample for white noise of unit variance on each of three phases that were
    /// measured, with two of them carrying a current that is large beside the noise.
    ///
    /// ```text
    /// conducting phase: 1    projection: 2/4    quadrature: (2/3)²·Σ sin²(θ_e − 120°·j) = 2/3
    /// half sum of magnitudes: 2/4 + (1 − 2/π)/4
    /// ```
    pub const fn noise_variance(self) -> f64 {
        match self {
            Self::HalfAbsSum => 0.5 + 0.25 * (1.0 - FRAC_2_PI),
            Self::SignedProjection => 0.5,
            Self::ConductingPhase => 1.0,
            Self::QAxis => 2.0 / 3.0,
        }
    }

    /// Envelope of a recording of three phases with the angle of the motor, whose electrical angle
    /// is `p·θ_m` with `p` pole pairs.
    ///
    /// # Panics
    ///
    /// When the channels differ in length: a programming error.
    pub fn of_phases_at(
        self,
        phases_a: [&[f64]; 3],
        motor_angle_rad: &[f64],
        pole_pairs: u32,
    ) -> Vec<f64> {
        let electrical: Vec<f64> =
            motor_angle_rad.iter().map(|theta| theta * f64::from(pole_pairs)).collect();
        self.of_phases(phases_a, &electrical)
    }

    /// The envelope of a recording of three phases with the rotor's electrical angle.
    ///
    /// # Panics
    ///
    /// When the channels differ in length: a programming error.
    pub fn of_phases(self, phases_a: [&[f64]; 3], electrical_angle_rad: &[f64]) -> Vec<f64> {
        let samples = electrical_angle_rad.len();
        assert!(
            phases_a.iter().all(|channel| channel.len() == samples),
            "channels differ in length"
        );
        let mut follow = None;
        (0..samples)
            .map(|k| {
                let i = phases_a.map(|channel| channel[k]);
                let theta_e = electrical_angle_rad[k];
                let sector = Sector::of_electrical_angle(theta_e);
                let follow = follow.get_or_insert_with(|| ContinuingPhase::new(sector));
                follow.update(sector);
                match self {
                    Self::HalfAbsSum => 0.5 * i.iter().map(|a| a.abs()).sum::<f64>(),
                    Self::SignedProjection => {
                        0.5 * sector.pattern().iter().zip(i).map(|(s, a)| s * a).sum::<f64>()
                    }
                    Self::ConductingPhase => follow.current_a(&i),
                    Self::QAxis => quadrature_a(&i, theta_e),
                }
            })
            .collect()
    }
}

/// `⅔·Σ i_j·sin(θ_e − 120°·j)`: the amplitude of a balanced sine in phase with the back-EMF.
fn quadrature_a(i: &PerPhase, theta_e: f64) -> f64 {
    let along = |j: usize| i[j] * libm::sin(theta_e - TAU / 3.0 * j as f64);
    2.0 / 3.0 * (along(0) + along(1) + along(2))
}

/// How the envelope is filtered and sampled: two equal first-order low-passes, then every n-th
/// sample.
///
/// Each stage is exact for an input that is straight between samples, so that recordings of
/// different rates agree:
///
/// ```text
/// y_n = a·y_{n−1} + b_1·x_{n−1} + b_0·x_n,  a = exp(−r), r = 2π·f_c/f_s
/// b_0 = 1 − (1 − a)/r,  b_1 = 1 − a − b_0
/// ```
///
/// Both stages start at zero.
///
/// # Source
///
/// Ramp-invariant discretisation of a first-order low-pass; see `docs/models/envelope.md`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvelopeFilter {
    /// Corner of each stage, `f_c`.
    pub corner_hz: f64,
    /// Rate of the result.
    pub output_hz: f64,
}

/// Signals that are filtered side by side.
const SIDE_BY_SIDE: usize = 8;

impl EnvelopeFilter {
    /// The default: 200 Hz, 2 kHz.
    pub const DEFAULT: Self = Self { corner_hz: 200.0, output_hz: 2000.0 };

    /// Filters a signal and keeps every n-th sample, beginning with the first.
    ///
    /// `keep_every` is the input's rate over [`output_hz`](Self::output_hz).
    pub fn apply(&self, signal: &[f64], rate_hz: f64) -> Vec<f64> {
        let [filtered] = self.side_by_side([signal], rate_hz);
        filtered
    }

    /// Filters several signals: what [`apply`](Self::apply) gives of each, to the last bit. Those that
    /// follow one another with as many samples go side by side, since each sample waits for the one before.
    pub fn apply_each<S: AsRef<[f64]>>(&self, signals: &[S], rate_hz: f64) -> Vec<Vec<f64>> {
        let mut filtered = Vec::with_capacity(signals.len());
        for alike in signals.chunk_by(|a, b| a.as_ref().len() == b.as_ref().len()) {
            let (together, rest) = alike.as_chunks::<SIDE_BY_SIDE>();
            for chunk in together {
                let chunk = chunk.each_ref().map(AsRef::as_ref);
                filtered.extend(self.side_by_side(chunk, rate_hz));
            }
            filtered.extend(rest.iter().map(|signal| self.apply(signal.as_ref(), rate_hz)));
        }
        filtered
    }

    /// Filters signals, all as long as the first.
    fn side_by_side<const N: usize>(&self, signals: [&[f64]; N], rate_hz: f64) -> [Vec<f64>; N] {
        let keep_every = libm::round(rate_hz / self.output_hz).max(1.0) as usize;
        let samples = signals[0].len();
        let mut filtered = [(); N].map(|()| Vec::with_capacity(samples.div_ceil(keep_every)));
        let (a, b0, b1) = self.coefficients(rate_hz);
        let [mut x1, mut y1, mut z1] = [[0.0; N]; 3];
        let signals = signals.map(|signal| &signal[..samples]);
        for begin in (0..samples).step_by(keep_every) {
            for n in begin..samples.min(begin + keep_every) {
                for lane in 0..N {
                    let x = signals[lane][n];
                    let y = a * y1[lane] + b1 * x1[lane] + b0 * x;
                    z1[lane] = a * z1[lane] + b1 * y1[lane] + b0 * y;
                    (x1[lane], y1[lane]) = (x, y);
                }
                if n == begin {
                    for (filtered, z) in filtered.iter_mut().zip(z1) {
                        filtered.push(z);
                    }
                }
            }
        }
        filtered
    }

    /// Response of the two stages to a unit impulse, until it has died to 1e-9 of its sum.
    pub fn impulse_response(&self, rate_hz: f64) -> Vec<f64> {
        let samples = libm::ceil(30.0 * rate_hz / (TAU * self.corner_hz)) as usize + 2;
        let mut impulse = vec![0.0; samples];
        impulse[0] = 1.0;
        Self { output_hz: rate_hz, ..*self }.apply(&impulse, rate_hz)
    }

    fn coefficients(&self, rate_hz: f64) -> (f64, f64, f64) {
        let r = TAU * self.corner_hz / rate_hz;
        let a = libm::exp(-r);
        let b0 = 1.0 - (1.0 - a) / r;
        (a, b0, 1.0 - a - b0)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::noise::NoiseSource;

    /// Rounding of a mean over three phases, A.
    const MEAN_A: f64 = 1e-14;
    /// Rounding of a current read off its phase, A.
    const PHASE_A: f64 = 1e-15;

    /// Rounding of a few hundred steps of the recursion.
    const FILTER_REL: f64 = 1e-12;

    #[test]
    fn signals_side_by_side_are_those_alone() {
        let mut noise = NoiseSource::new(4);
        let lengths = [400; 11].into_iter().chain([77, 400, 0]);
        let signals: Vec<Vec<f64>> =
            lengths.map(|length| (0..length).map(|_| noise.normal()).collect()).collect();
        let filter = EnvelopeFilter::DEFAULT;
        let alone: Vec<_> = signals.iter().map(|signal| filter.apply(signal, 10_000.0)).collect();
        assert_eq!(filter.apply_each(&signals, 10_000.0), alone);
        assert_eq!((alone[0].len(), alone[11].len()), (80, 16));
    }

    #[test]
    fn a_ramp_passes_exactly_at_any_rate() {
        // For x = t the two stages settle to t − 2τ; exact between samples means exact here.
        let filter = EnvelopeFilter { corner_hz: 200.0, output_hz: 1000.0 };
        let tau = 1.0 / (TAU * 200.0);
        for rate_hz in [1000.0, 2000.0, 10_000.0] {
            let ramp: Vec<f64> = (0..(rate_hz as usize)).map(|n| n as f64 / rate_hz).collect();
            let out = filter.apply(&ramp, rate_hz);
            let end = 0.999;
            assert_abs_diff_eq!(out[999], (end - 2.0 * tau), epsilon = FILTER_REL);
        }
    }

    #[test]
    fn all_definitions_agree_on_two_phases() {
        let angle: Vec<f64> = (0..600).map(|k| f64::from(k) * 0.02).collect();
        let current = 1.5;
        let channel = |j: usize| -> Vec<f64> {
            angle.iter().map(|&t| current * Sector::of_electrical_angle(t).pattern()[j]).collect()
        };
        let phases = [channel(0), channel(1), channel(2)];
        let views = [&phases[0][..], &phases[1][..], &phases[2][..]];
        for envelope in
            [Envelope::HalfAbsSum, Envelope::SignedProjection, Envelope::ConductingPhase]
        {
            for i in envelope.of_phases(views, &angle) {
                assert_abs_diff_eq!(i, current, epsilon = PHASE_A);
            }
        }
    }

    #[test]
    fn the_quadrature_of_a_balanced_sine_is_its_amplitude() {
        let angle: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.13).collect();
        let channel = |j: usize| -> Vec<f64> {
            angle.iter().map(|t| 2.0 * libm::sin(t - TAU / 3.0 * j as f64)).collect()
        };
        let phases = [channel(0), channel(1), channel(2)];
        for i in Envelope::QAxis.of_phases([&phases[0], &phases[1], &phases[2]], &angle) {
            assert_abs_diff_eq!(i, 2.0, epsilon = MEAN_A);
        }
    }

    #[test]
    fn white_noise_of_the_phases_has_the_stated_variance_in_each_envelope() {
        let samples = 60_000;
        let angle: Vec<f64> = (0..samples).map(|k| f64::from(k) * 0.013).collect();
        let (current_a, noise_a) = (5.0, 0.1);
        let mut noise = NoiseSource::new(3);
        let mut channel = |j: usize, noise_a: f64| -> Vec<f64> {
            let of_angle = |&t: &f64| current_a * Sector::of_electrical_angle(t).pattern()[j];
            angle.iter().map(|t| of_angle(t) + noise_a * noise.normal()).collect()
        };
        let noisy = [0, 1, 2].map(|j| channel(j, noise_a));
        let clean = [0, 1, 2].map(|j| channel(j, 0.0));
        for envelope in [
            Envelope::HalfAbsSum,
            Envelope::SignedProjection,
            Envelope::ConductingPhase,
            Envelope::QAxis,
        ] {
            let of = |phases: &[Vec<f64>; 3]| {
                envelope.of_phases(phases.each_ref().map(Vec::as_slice), &angle)
            };
            let (noisy, clean) = (of(&noisy), of(&clean));
            let off: Vec<f64> = noisy.iter().zip(clean).map(|(a, b)| (a - b) / noise_a).collect();
            let mean = off.iter().sum::<f64>() / f64::from(samples);
            let square: f64 = off.iter().map(|x| (x - mean) * (x - mean)).sum();
            // four standard deviations of a variance of so many samples: 4·√(2/60 000)
            assert_abs_diff_eq!(
                square / f64::from(samples),
                envelope.noise_variance(),
                epsilon = 0.023
            );
        }
    }
}
