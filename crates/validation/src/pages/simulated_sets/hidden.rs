//! Effects that are hidden in simulated sets, and how much of them the recordings show.

use anyhow::{Context, Result};
use ema_sim::{
    Effect, EffectId, FaultCoordinates, HighFidelity, Imperfections, LowFidelity, MachineScales,
    ModelFidelity, PhysicalFaults,
};
use experiments::{effect_of_size, effects_of_both};
use fdi_core::{Experiment, Purpose};
use inference::{BandedCholesky, dot, tapered_covariance};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::set::{Choice, NOISE_A};
use crate::pages::chance::Chance;

/// Evidence λ of the effects: the least asked for, and the most drawn.
const LAMBDA: [f64; 2] = [60.0, 600.0];
/// Runs of the truth with and without an effect, each pair with a noise of its own.
const RUNS: usize = 8;
/// Time from which on samples share no noise of the loop, s.
const MEMORY_S: f64 = 0.15;
/// Damage that may take up an effect, and the step of its slopes.
const FREE: [usize; 7] = [0, 1, 2, 3, 4, 5, 6];
const STEP: f64 = 0.002;
/// Draws until an effect shows, and steps towards the evidence that is drawn.
const MOST_DRAWS: u64 = 60;
const STEPS: usize = 6;

/// Machine of a set as it moves there without an effect.
pub(super) struct Outlook<'a> {
    choice: &'a Choice<'a>,
    tests: Vec<Test>,
    damage: Damage,
    scales: MachineScales,
    effects: Vec<EffectId>,
}

/// One test of the set.
struct Test {
    experiment: Experiment,
    /// Signals without an effect, a noise each, A.
    plain: Vec<Vec<f64>>,
    /// Factor of the covariance of sensors and loop.
    noise: BandedCholesky,
    /// Whitened slopes with damage.
    slopes: Vec<Vec<f64>>,
}

impl<'a> Outlook<'a> {
    pub(super) fn new(choice: &'a Choice<'a>) -> Result<Self> {
        let experiments = choice.tests()?;
        let first = experiments.first().context("a set has tests")?;
        let low = LowFidelity::new(&first.actuator, &first.scenario)?;
        let healthy = PhysicalFaults::from(&FaultCoordinates([0.0; 7]));
        let scales = low.scales(&low.try_simulate(&healthy)?);
        let high = HighFidelity::new(&first.actuator, &first.scenario)?;
        let effects = effects_of_both(&low, &high);
        let tests = experiments.into_iter().enumerate();
        let tests: Vec<Test> = tests
            .map(|(place, experiment)| Test::new(choice, experiment, place))
            .collect::<Result<_>>()?;
        let damage = Damage::of(&tests)?;
        Ok(Self { choice, tests, damage, scales, effects })
    }

    /// An effect that shows.
    pub(super) fn draw(&self) -> Result<Effect> {
        for stream in 0..MOST_DRAWS {
            let mut chance = Chance::new(self.choice.seed.derive(Purpose::Units, stream));
            let place = (self.effects.len() as f64 * chance.uniform()) as usize;
            let id = self.effects[place.min(self.effects.len() - 1)];
            let wanted = LAMBDA[0] * (LAMBDA[1] / LAMBDA[0]).powf(chance.uniform());
            let sizes: Vec<f64> = id.info().parameters.iter().map(|_| chance.normal()).collect();
            if let Some(found) = self.scaled(id, &sizes, wanted) {
                return Ok(found);
            }
        }
        anyhow::bail!("no effect shows in this set")
    }

    /// The effect with sizes in some proportion, scaled to an evidence; `None` where it cannot have
    /// it.
    fn scaled(&self, id: EffectId, sizes: &[f64], wanted: f64) -> Option<Effect> {
        let mut scale = 0.3;
        for _ in 0..STEPS {
            let effect = effect_of_size(id, sizes, scale, &self.scales)?;
            let lambda = self.lambda(&effect).ok()?;
            if (wanted / 1.4..=wanted * 1.4).contains(&lambda) && lambda >= LAMBDA[0] {
                return Some(effect);
            }
            scale *= (wanted / lambda.max(1.0)).sqrt().clamp(0.1, 10.0);
        }
        None
    }

    /// Energy of what an effect changes, in units of the noise, beside damage that is fitted to it.
    ///
    /// ```text
    /// λ = |P·z̄|² − tr cov(P·z̄),   z_r = L⁻¹·(y_r with − y_r without),   P off the slopes with damage
    /// ```
    ///
    /// The second term is what the noise of so few runs adds to the first.
    fn lambda(&self, effect: &Effect) -> Result<f64> {
        let mut changes: Vec<Vec<f64>> = vec![Vec::new(); RUNS];
        for (place, test) in self.tests.iter().enumerate() {
            let mut experiment = test.experiment.clone();
            experiment.effects.push(effect.clone());
            let with = signals(self.choice, &experiment, place)?;
            for ((joined, with), without) in changes.iter_mut().zip(with).zip(&test.plain) {
                let mut change: Vec<f64> = with.iter().zip(without).map(|(a, b)| a - b).collect();
                test.noise.whiten(&mut change);
                joined.extend(change);
            }
        }
        for change in &mut changes {
            self.damage.take_off(change);
        }
        let n = RUNS as f64;
        let mean: Vec<f64> = (0..changes[0].len())
            .map(|t| changes.iter().map(|change| change[t]).sum::<f64>() / n)
            .collect();
        let scatter = changes
            .iter()
            .map(|change| change.iter().zip(&mean).map(|(a, b)| (a - b) * (a - b)).sum::<f64>());
        Ok(dot(&mean, &mean) - scatter.sum::<f64>() / (n * (n - 1.0)))
    }
}

impl Test {
    fn new(choice: &Choice<'_>, experiment: Experiment, place: usize) -> Result<Self> {
        let plain = signals(choice, &experiment, place)?;
        let (output_hz, phase_hz) =
            (experiment.filter.output_hz, experiment.actuator.controller.sample_hz);
        let mean: Vec<f64> = (0..plain[0].len())
            .map(|t| plain.iter().map(|run| run[t]).sum::<f64>() / RUNS as f64)
            .collect();
        let less = |run: &Vec<f64>| run.iter().zip(&mean).map(|(a, b)| a - b).collect();
        let scatter: Vec<Vec<f64>> = plain.iter().map(less).collect();
        let support = (MEMORY_S * output_hz).ceil() as usize;
        let mut covariance = tapered_covariance(&scatter, support);
        covariance.scale(RUNS as f64 / (RUNS as f64 - 1.0));
        // the density that the noise of the phases has within the band
        covariance.add_to_diagonal(NOISE_A * NOISE_A * output_hz / phase_hz);
        let noise = covariance.cholesky()?;
        let healthy = FaultCoordinates([0.0; 7]);
        let mut slopes = experiment.monitor(0.0)?.jacobian(&healthy, &FREE, STEP);
        noise.whiten_each(&mut slopes);
        Ok(Self { experiment, plain, noise, slopes })
    }
}

/// Signals of the truth in a test, a noise each, A.
fn signals(choice: &Choice<'_>, test: &Experiment, place: usize) -> Result<Vec<Vec<f64>>> {
    let healthy = FaultCoordinates([0.0; 7]);
    let run = |run: usize| -> Result<Vec<f64>> {
        let seed = choice.seed.derive(Purpose::Acceptance, (RUNS * place + run) as u64);
        Ok(match choice.fidelity {
            ModelFidelity::High => {
                let model = test.high_fidelity(0.0, Imperfections::REAL)?.with_seed(seed);
                test.high_fidelity_signal(&model, &PhysicalFaults::from(&healthy))
            }
            ModelFidelity::Low => {
                test.noisy_monitor(0.0, Imperfections::REAL, seed)?.signal(&healthy)
            }
        })
    };
    (0..RUNS).map(run).collect()
}

/// Damage that may take up a change in all tests of a set, each level with a standard deviation of
/// one.
struct Damage {
    /// Whitened slopes, a level each.
    slopes: Vec<Vec<f64>>,
    gram: Cholesky<f64, Dyn>,
}

impl Damage {
    fn of(tests: &[Test]) -> Result<Self> {
        let slopes: Vec<Vec<f64>> = (0..FREE.len())
            .map(|k| tests.iter().flat_map(|test| test.slopes[k].iter().copied()).collect())
            .collect();
        let gram = DMatrix::from_fn(FREE.len(), FREE.len(), |i, j| {
            dot(&slopes[i], &slopes[j]) + if i == j { 1.0 } else { 0.0 }
        });
        let gram = gram.cholesky().context("a level with a prior is determined")?;
        Ok(Self { slopes, gram })
    }

    /// Takes what damage imitates off a whitened change.
    fn take_off(&self, change: &mut [f64]) {
        let ahead = DVector::from_fn(FREE.len(), |i, _| dot(&self.slopes[i], change));
        let levels = self.gram.solve(&ahead);
        for (slope, level) in self.slopes.iter().zip(levels.iter()) {
            for (x, s) in change.iter_mut().zip(slope) {
                *x -= level * s;
            }
        }
    }
}
