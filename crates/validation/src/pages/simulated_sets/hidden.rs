//! Effects that are hidden in simulated sets, and how much of them the recordings show.

use core::ops::Range;

use anyhow::{Context, Result};
use ema_sim::{
    Effect, EffectId, FaultCoordinates, HighFidelity, Imperfections, LowFidelity, MachineKind as _,
    MachineScales, NumberValue, PhysicalFaults,
};
use experiments::{effect_of_size, effects_of_both};
use fdi_core::{Experiment, Purpose, RootSeed};
use inference::{
    BandedCholesky, QuadraticForm, SymmetricMatrix, dot, least_in_box, tapered_covariance,
};

use super::set::{Choice, HEALTHY};
use crate::pages::chance::Chance;

/// Evidence λ of the effects: the least asked for, and the most drawn.
const LAMBDA: [f64; 2] = [60.0, 600.0];
/// Runs of the truth without an effect, each with a noise of its own, that tell the noise.
const NOISE_RUNS: usize = 200;
/// Runs beyond those that tell how large the noise is that their covariance leaves equal.
const CHECKED: Range<usize> = 200..300;
/// Runs of these beside which an effect is sized, and those beside which its evidence is told: of many
/// sizes of many effects some look larger than they are.
const SIZING: Range<usize> = 0..8;
const TELLING: Range<usize> = 8..56;
/// Time from which on samples share no noise of the loop, s.
const MEMORY_S: f64 = 0.15;
/// Levels of damage that may take up an effect, and the step of their slopes.
const LEVELS: usize = 7;
const STEP: f64 = 0.01;
/// Step of the slopes of numbers, over their standard deviations.
const NUMBER_STEP: f64 = 0.2;
/// Standard deviations that a number may be off: no bound.
const FARTHEST_STDS: f64 = 100.0;
/// Least levels: an eccentricity has a direction.
const LEAST: [f64; LEVELS] = [0.0, 0.0, 0.0, 0.0, 0.0, -1.0, -1.0];
/// Rate of the signals, Hz: each sample is the mean of the recorded ones.
const SIGNAL_HZ: f64 = 500.0;
/// Without the steps of the encoder and of the current set-point. Each change, however small, moves the
/// places where they fall: a pattern like white noise, which no fit can follow and which is not the
/// effect's.
const WITHOUT_STEPS: Imperfections = Imperfections { digitisation: false, ..Imperfections::REAL };
/// Draws until an effect shows, and steps towards the evidence that is drawn.
const MOST_DRAWS: u64 = 60;
const STEPS: usize = 6;

/// Machine of a set as it moves there without an effect.
pub(super) struct Outlook<'a> {
    choice: &'a Choice<'a>,
    tests: Vec<Test>,
    absorbing: Absorbing,
    scales: MachineScales,
    effects: Vec<EffectId>,
}

/// One test of the set.
struct Test {
    experiment: Experiment,
    /// Signals without an effect and [without steps](WITHOUT_STEPS), a noise each, A.
    plain: Vec<Vec<f64>>,
    /// Factor of the covariance of sensors and loop.
    noise: BandedCholesky,
    /// Runs that the covariance was not told by, whitened, less their mean.
    checked: Vec<Vec<f64>>,
    /// Whitened slopes with damage, then those with numbers, over their standard deviations.
    slopes: Vec<Vec<f64>>,
}

impl<'a> Outlook<'a> {
    pub(super) fn new(choice: &'a Choice<'a>) -> Result<Self> {
        let experiments = choice.tests()?;
        let first = experiments.first().context("a set has tests")?;
        let low = LowFidelity::new(&first.actuator, &first.scenario)?;
        let healthy = PhysicalFaults::from(&HEALTHY);
        let scales = low.scales(&low.try_simulate(&healthy)?);
        let high = HighFidelity::new(&first.actuator, &first.scenario)?;
        let effects = effects_of_both(&low, &high);
        let tests = experiments.into_iter().enumerate();
        let off: Vec<Vec<Experiment>> = choice
            .machine
            .usual_tolerances()
            .iter()
            .map(|number| {
                let mut off = choice.machine.clone();
                let by = NUMBER_STEP * number.half_width_frac / 3.0_f64.sqrt();
                let value = (1.0 + by) * off.number(number.place);
                off.set_numbers(&[NumberValue { place: number.place, value }]);
                choice.tests_of(&off)
            })
            .collect::<Result<_>>()?;
        let tests: Vec<Test> = tests
            .map(|(place, experiment)| {
                let off: Vec<&Experiment> = off.iter().map(|tests| &tests[place]).collect();
                Test::new(choice, experiment, &off, place)
            })
            .collect::<Result<_>>()?;
        let absorbing = Absorbing::of(&tests);
        Ok(Self { choice, tests, absorbing, scales, effects })
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
    /// it, or has less than is asked for.
    fn scaled(&self, id: EffectId, sizes: &[f64], wanted: f64) -> Option<Effect> {
        let mut scale = 0.3;
        for _ in 0..STEPS {
            let effect = effect_of_size(id, sizes, scale, &self.scales)?;
            let lambda = self.lambda(&effect, SIZING).ok()?;
            if (wanted / 1.4..=wanted * 1.4).contains(&lambda) {
                let told = self.lambda(&effect, TELLING).ok()?;
                return (told >= LAMBDA[0]).then_some(effect);
            }
            scale *= (wanted / lambda.max(1.0)).sqrt().clamp(0.1, 10.0);
        }
        None
    }

    /// Energy of what an effect changes, in units of the noise, beside damage and numbers that are
    /// fitted to it.
    ///
    /// ```text
    /// λ = (min_{k,ν} |e|² + |ν|² − tr cov z̄)/v,   e = z̄ − S·k − N·ν,   z_r = L⁻¹·(y_r with − y_r without)
    /// ```
    ///
    /// with the slopes `S` with damage `k` and `N` with numbers `ν` in standard deviations.
    /// The last term is what the noise of so few runs adds; `v` is the variance along `e` of whitened
    /// runs that the covariance was not told by: in those that told it, noise looks smaller than it is.
    fn lambda(&self, effect: &Effect, runs: Range<usize>) -> Result<f64> {
        let changes = self.changes(effect, runs)?;
        let n = changes.len() as f64;
        let mean = mean_of(&changes);
        let (left, cost) = self.absorbing.left_of(&mean);
        let scatter =
            changes.iter().map(|change| less(change, &mean).iter().map(|x| x * x).sum::<f64>());
        let told = dot(&left, &left) + cost - scatter.sum::<f64>() / (n * (n - 1.0));
        Ok(told / self.variance_along(&left))
    }

    /// Variance along a direction of the noise that the covariance was not told by.
    fn variance_along(&self, direction: &[f64]) -> f64 {
        let mut from = 0;
        let mut along = vec![0.0; CHECKED.len()];
        for test in &self.tests {
            for (along, run) in along.iter_mut().zip(&test.checked) {
                *along += dot(&direction[from..from + run.len()], run);
            }
            from += test.plain[0].len();
        }
        dot(&along, &along) / ((CHECKED.len() - 1) as f64 * dot(direction, direction))
    }

    /// Whitened changes of all tests by an effect, by runs.
    fn changes(&self, effect: &Effect, runs: Range<usize>) -> Result<Vec<Vec<f64>>> {
        let mut changes: Vec<Vec<f64>> = vec![Vec::new(); runs.len()];
        for (place, test) in self.tests.iter().enumerate() {
            let mut experiment = test.experiment.clone();
            experiment.effects.push(effect.clone());
            let with = Ask::without_steps(self.choice, &experiment, place).signals(runs.clone())?;
            let pairs = with.iter().zip(&test.plain[runs.clone()]);
            for (joined, (with, without)) in changes.iter_mut().zip(pairs) {
                let mut change = less(with, without);
                test.noise.whiten(&mut change);
                joined.extend(change);
            }
        }
        Ok(changes)
    }
}

impl Test {
    /// A test, and the same of machines of which a number each is [off](NUMBER_STEP).
    fn new(
        choice: &Choice<'_>,
        experiment: Experiment,
        off: &[&Experiment],
        place: usize,
    ) -> Result<Self> {
        let ask = Ask::without_steps(choice, &experiment, place);
        let recorded = Ask { imperfections: Imperfections::REAL, ..ask };
        let runs = recorded.signals(0..NOISE_RUNS)?;
        let mean = mean_of(&runs);
        let scatter: Vec<Vec<f64>> = runs.iter().map(|run| less(run, &mean)).collect();
        let support = (MEMORY_S * SIGNAL_HZ).ceil() as usize;
        let mut covariance = tapered_covariance(&scatter, support);
        covariance.scale(NOISE_RUNS as f64 / (NOISE_RUNS as f64 - 1.0));
        let noise = covariance.cholesky()?;
        let mut checked = recorded.signals(CHECKED)?;
        for run in &mut checked {
            noise.whiten(run);
        }
        let middle = mean_of(&checked);
        let checked = checked.iter().map(|run| less(run, &middle)).collect();
        let plain = ask.signals(0..TELLING.end)?;
        let known = mean_of(&plain[SIZING]);
        let slope = |with: Ask<'_>, step: f64| -> Result<Vec<f64>> {
            let mut slope = less(&mean_of(&with.signals(SIZING)?), &known);
            for x in &mut slope {
                *x /= step;
            }
            noise.whiten(&mut slope);
            Ok(slope)
        };
        let damaged = (0..LEVELS).map(|level| {
            let mut faults = HEALTHY;
            faults.0[level] = STEP;
            slope(Ask { faults, ..ask }, STEP)
        });
        let off = off.iter().map(|test| slope(Ask { test, ..ask }, NUMBER_STEP));
        let slopes = damaged.chain(off).collect::<Result<_>>()?;
        Ok(Self { experiment, plain, noise, checked, slopes })
    }
}

/// Truth of which recordings are asked for.
#[derive(Clone, Copy)]
struct Ask<'a> {
    choice: &'a Choice<'a>,
    test: &'a Experiment,
    faults: FaultCoordinates,
    imperfections: Imperfections,
    /// Place of the test in the set.
    place: u64,
}

impl<'a> Ask<'a> {
    /// A test without damage and without steps.
    fn without_steps(choice: &'a Choice<'a>, test: &'a Experiment, place: usize) -> Self {
        Self { choice, test, faults: HEALTHY, imperfections: WITHOUT_STEPS, place: place as u64 }
    }

    /// Signals as some recordings hold them, a noise each, A.
    fn signals(&self, among: Range<usize>) -> Result<Vec<Vec<f64>>> {
        let of = |run: usize| -> Result<Vec<f64>> {
            let seed = RootSeed(self.choice.seed.derive(Purpose::Acceptance, run as u64));
            let Self { choice, test, faults, imperfections, place } = *self;
            let record = choice.record(test, faults, imperfections, place, seed)?;
            let samples = (record.rate_hz / SIGNAL_HZ).round() as usize;
            let mean = |samples: &[f64]| samples.iter().sum::<f64>() / samples.len() as f64;
            Ok(record.drive.chunks_exact(samples).map(mean).collect())
        };
        among.map(of).collect()
    }
}

fn mean_of(runs: &[Vec<f64>]) -> Vec<f64> {
    let n = runs.len() as f64;
    (0..runs[0].len()).map(|t| runs.iter().map(|run| run[t]).sum::<f64>() / n).collect()
}

fn less(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Damage and numbers that may take up a change in all tests of a set: levels within what there can
/// be, numbers as their standard deviations let them.
struct Absorbing {
    /// Whitened slopes, those of levels first.
    slopes: Vec<Vec<f64>>,
    /// Products of the slopes, with what is known of the numbers beforehand.
    gram: SymmetricMatrix,
}

impl Absorbing {
    fn of(tests: &[Test]) -> Self {
        let count = tests.first().map_or(0, |test| test.slopes.len());
        let slopes: Vec<Vec<f64>> = (0..count)
            .map(|k| tests.iter().flat_map(|test| test.slopes[k].iter().copied()).collect())
            .collect();
        let gram = SymmetricMatrix::from_fn(count, |i, j| {
            let known = f64::from(u8::from(i == j && i >= LEVELS));
            dot(&slopes[i], &slopes[j]) + known
        });
        Self { slopes, gram }
    }

    /// Rest of a whitened change beside the nearest damage and numbers, and the cost of numbers that
    /// are off by so much.
    fn left_of(&self, change: &[f64]) -> (Vec<f64>, f64) {
        let descent: Vec<f64> = self.slopes.iter().map(|slope| dot(slope, change)).collect();
        let form = QuadraticForm { curvature: self.gram.clone(), descent };
        let count = self.slopes.len();
        let of_level = |bounds: [f64; LEVELS], beyond: f64| {
            bounds.into_iter().chain(core::iter::repeat_n(beyond, count - LEVELS)).collect()
        };
        let least: Vec<f64> = of_level(LEAST, -FARTHEST_STDS);
        let most: Vec<f64> = of_level([1.0; LEVELS], FARTHEST_STDS);
        let sizes = least_in_box(&form, &least, &most);
        let mut left = change.to_vec();
        for (slope, size) in self.slopes.iter().zip(&sizes) {
            left.iter_mut().zip(slope).for_each(|(x, s)| *x -= size * s);
        }
        (left, sizes[LEVELS..].iter().map(|size| size * size).sum())
    }
}
