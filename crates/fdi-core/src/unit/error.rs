//! Error of the low-fidelity model on units, learnt over damage and tolerances together.
//!
//! ```text
//! y_HF − y_LF(q) = Σ b_t·f_t(a) + r,    a = (q − q̄)/s,    r ~ N(0, S)
//! ```
//!
//! with `q` the quantities that the current shows: the error, like the signal, then keeps the
//! symmetries of the current. The terms `f_t` are a constant, each `a`, squares and products of
//! those that damage moves, and the size of each phase's imbalance. `S` is tapered as that of the
//! nominal machine's error is (`error_model`). Each time that the gear crosses its play the models part
//! a little, and a wide play is crossed for longer: `S` is learnt on machines with a narrow play and on
//! machines with a wide one, and mixed between them. What the taper leaves out of it is an error of the
//! quantities themselves (`embedded_error`).
//!
//! The motor's voltage of the same units tells how far the numbers that it shows are off (`voltage`).
//!
//! # Source
//!
//! Trends and what is left beside them: `trend`.

use std::borrow::Cow;

use crate::{
    offline::{
        bundle::StartAngle,
        error_model::{ErrorModelError, add_scaled},
        factor::joined,
    },
    seed::{Draws, Purpose, RootSeed},
    simulation::experiment::Experiment,
    statistics::parallel::in_parallel,
    unit::{
        design::{Session, Unit, draw, simulated},
        effect_error::EffectError,
        embedded_error::{Beside, EmbeddedError, Off, Scatter, Score},
        evidence::InCommon,
        monitor::UnitMonitor,
        quantities::{Bent, Quantities},
        trend::{FARTHEST, LEAST_MACHINES, Rows, trend},
        unmodelled::absent,
        voltage::{UnitVoltages, VoltageError, VoltageReading, VoltageRun},
    },
};
use ema_sim::{EffectId, SimulationError};
use inference::{
    BandedCholesky, BandedMatrix, NotPositiveDefinite, dot, gaspari_cohn, tapered_covariance,
};
use nalgebra::DMatrix;

/// Time that the taper of the covariance reaches, s: an electrical revolution of the fast part of
/// a test; longer ones make diagnoses of units left out no better.
const TAPER_S: f64 = 0.03;
/// Play over that as built from which a machine's covariance is that of a wide play, and the half-width
/// over which the two are mixed.
const WIDE_PLAY: f64 = 2.0;
const PLAY_BLEND: f64 = 0.5;
/// Machines on which the part of the error that looks like another machine is learnt.
const MOST_SCORED: usize = 600;
/// Machines on which the part that looks like an effect is learnt, where each has a start of its own and
/// so slopes of its own in every effect.
const MOST_SCORED_TURNED: usize = 200;
/// Shares of a guessed error that recordings of one unit have in common, near those of the embedded
/// bundles.
const GUESSED_IN_COMMON: InCommon = InCommon { unit: 0.1, state: 0.2, session: 0.55 };

/// Why the error on units could not be learnt.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UnitErrorError {
    /// A machine cannot be simulated.
    #[error("a machine within the tolerances cannot be simulated: {0}")]
    Simulation(#[from] SimulationError),
    /// The units determine no trend.
    #[error(transparent)]
    Trend(#[from] ErrorModelError),
}

/// The learnt error of the low-fidelity model on units.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UnitError {
    pub(crate) start: StartAngle,
    pub(crate) centre: Vec<f64>,
    pub(crate) spread: Vec<f64>,
    /// Places of the quantities that damage moves and bends.
    pub(crate) bent: Bent,
    /// One row a term.
    pub(crate) coefficients: Vec<Vec<f64>>,
    /// `S` of machines with a narrow play, or of all.
    pub(crate) covariance: BandedMatrix,
    /// `S` of machines with a wide play, where it was learnt apart.
    pub(crate) wide: Option<BandedMatrix>,
    /// Part of the error that looks like another machine.
    pub(crate) embedded: EmbeddedError,
    /// Part of the error that looks like effects, by effect.
    pub(crate) effects: Vec<EffectError>,
    /// Shares of `S` that recordings of one unit have in common.
    pub(crate) in_common: InCommon,
    /// Mean of ln(misfit) of units left out, with the bundle's noise.
    pub(crate) ln_misfit_mean: f64,
    /// Standard deviation of ln(misfit) of units left out.
    pub(crate) ln_misfit_std: f64,
    /// Error of what the motor's voltage shows, where the drive has one.
    pub(crate) voltage: Option<VoltageError>,
}

impl UnitError {
    /// Reading that the motor's voltage would give of a machine at a point of the unknowns; `None` where it was
    /// not learnt.
    pub(crate) fn expected_voltage(
        &self,
        quantities: &Quantities,
        point: &[f64],
    ) -> Option<VoltageReading> {
        self.voltage.as_ref()?.expected(quantities.volts_at(point))
    }

    /// Learns from units drawn with a seed.
    pub(crate) fn learn(
        experiment: &Experiment,
        start: StartAngle,
        unit_noise: &BandedMatrix,
        noise_a: f64,
        root: RootSeed,
        jobs: usize,
    ) -> Result<Self, UnitErrorError> {
        let quantities = Quantities::new(experiment);
        let drawn = |session| draw(experiment, quantities.layout(), start, session, root);
        let compared = |units: &[Unit]| compared(experiment, &quantities, units, jobs);
        let units = drawn(Session::First);
        let Compared { at, differences, voltages } = compared(&units)?;
        let (centre, spread) = centre_and_spread(&at);
        let mut learnt = Self::unlearnt(&quantities, start, centre, spread);
        let terms: Vec<Vec<f64>> = at.iter().map(|at| learnt.terms(at)).collect();
        let (coefficients, residuals) = trend(&terms, &differences)?;
        learnt.coefficients = coefficients;
        learnt.learn_covariance(&at, &residuals, taper_samples(experiment.filter.output_hz));
        learnt.learn_misfits(&at, &residuals, unit_noise, noise_a, root)?;
        let factors = learnt.factors(&unit_noise.scaled(noise_a * noise_a));
        let factors = factors.map_err(ErrorModelError::from)?;
        let machine = Machine { experiment, quantities: &quantities };
        let mut machines = machine.off(&units, &at, &residuals);
        machines.truncate(MOST_SCORED);
        let scores = learnt.scores(&machines, &factors, jobs)?;
        let scatter = learnt.learn_embedded(&machines, &scores);
        learnt.learn_effects(machine, &units, &machines, &factors, jobs)?;
        let bent = |at: &Rows| at.iter().map(|at| learnt.terms(at)).collect::<Vec<_>>();
        let is_wide: Vec<bool> = at.iter().map(|at| learnt.is_wide(at)).collect();
        let mut volts = VoltageError::learn(&bent(&at), &is_wide, &voltages)?;
        let in_common = |session| -> Result<[f64; 3], UnitErrorError> {
            let again_units = drawn(session);
            let Compared { at: again_at, differences: mut again, voltages } =
                compared(&again_units)?;
            for (at, difference) in again_at.iter().zip(&mut again) {
                learnt.take_mean(at, difference);
            }
            let of_voltage = volts.as_ref().and_then(|(error, first)| {
                error.share_in_common(
                    &is_wide,
                    first,
                    &error.beside_mean(&bent(&again_at), &voltages)?,
                )
            });
            let of_current = learnt.in_common(&at, &residuals, &again, &factors);
            let again = machine.off(&again_units, &again_at, &again);
            let again_scores = learnt.scores(&again, &factors, jobs)?;
            let of_embedded = learnt.embedded_in_common(
                &scatter,
                [(&machines, &scores), (&again, &again_scores)],
                of_current,
            );
            Ok([of_current, of_voltage.unwrap_or_default(), of_embedded])
        };
        let unit = in_common(Session::Undamaged)?;
        let state = in_common(Session::Second)?;
        let session = in_common(Session::Again)?;
        let nested = |of: usize| InCommon::nested(unit[of], state[of], session[of]);
        if let Some((error, _)) = &mut volts {
            error.in_common = nested(1);
        }
        (learnt.in_common, learnt.embedded.in_common) = (nested(0), nested(2));
        learnt.voltage = volts.map(|(error, _)| error);
        Ok(learnt)
    }

    /// Guesses the error in a test that it has not been learnt for, of a few machines without damage: a
    /// trend that is straight in the quantities, and a covariance with a size for each time and one
    /// correlation for all, tapered as a learnt one is:
    ///
    /// ```text
    /// S_ij = s_i·s_j·ρ(|i − j|)
    /// ```
    pub(crate) fn guessed(
        experiment: &Experiment,
        quantities: &Quantities,
        root: RootSeed,
        jobs: usize,
    ) -> Result<Self, UnitErrorError> {
        let start = StartAngle::Zero;
        let units = draw(experiment, quantities.layout(), start, Session::Undamaged, root);
        let Compared { at, differences, voltages } =
            compared(experiment, quantities, &units, jobs)?;
        let (centre, spread) = drawn_spread(experiment, quantities, root);
        let mut guessed = Self::unlearnt(quantities, start, centre, spread);
        let straight = |at: &Vec<f64>| [vec![1.0], guessed.away(at)].concat();
        let terms: Vec<Vec<f64>> = at.iter().map(straight).collect();
        let (coefficients, residuals) = trend(&terms, &differences)?;
        guessed.voltage =
            VoltageError::learn(&terms, &vec![false; at.len()], &voltages)?.map(|(error, _)| error);
        let support = taper_samples(experiment.filter.output_hz);
        guessed.coefficients = coefficients;
        guessed.covariance = sized_covariance(&residuals, support);
        guessed.in_common = GUESSED_IN_COMMON;
        Ok(guessed)
    }

    /// An error of which nothing is learnt but where machines are.
    fn unlearnt(
        quantities: &Quantities,
        start: StartAngle,
        centre: Vec<f64>,
        spread: Vec<f64>,
    ) -> Self {
        let bent = quantities.bent();
        Self {
            start,
            embedded: EmbeddedError::none(bent.damage.len()),
            effects: Vec::new(),
            bent,
            centre,
            spread,
            coefficients: Vec::new(),
            covariance: BandedMatrix::zeros(0, 0),
            wide: None,
            in_common: InCommon::default(),
            ln_misfit_mean: 0.0,
            ln_misfit_std: 0.0,
            voltage: None,
        }
    }

    /// Scores of machines, each by the error of its own kind.
    fn scores(
        &self,
        machines: &[Off<'_>],
        factors: &[BandedCholesky; 2],
        jobs: usize,
    ) -> Result<Vec<Option<Score>>, SimulationError> {
        in_parallel(machines, jobs, |_, machine| machine.score(&self.beside(machine, factors)))
    }

    /// Learnt error beside which a machine is scored.
    fn beside<'a>(&'a self, machine: &Off<'_>, factors: &'a [BandedCholesky; 2]) -> Beside<'a> {
        let wide = self.wide.as_ref().filter(|_| self.is_wide(machine.at));
        Beside {
            places: &self.bent.damage,
            spread: &self.spread,
            covariance: wide.unwrap_or(&self.covariance),
            whole: &factors[usize::from(wide.is_some())],
        }
    }

    /// Part of the error that looks like effects that the machine does not have.
    fn learn_effects(
        &mut self,
        machine: Machine<'_>,
        units: &[Unit],
        machines: &[Off<'_>],
        factors: &[BandedCholesky; 2],
        jobs: usize,
    ) -> Result<(), SimulationError> {
        let Machine { experiment, quantities } = machine;
        let effects = absent(&experiment.effects);
        let nominal = quantities.nominal();
        // all begin where the first does
        let (same, most) = match (self.start, machines.first()) {
            (StartAngle::Zero, Some(first)) => {
                (Some(first.monitor.effect_slopes(&nominal, &effects)?), MOST_SCORED)
            }
            _ => (None, MOST_SCORED_TURNED),
        };
        let machines = &machines[..machines.len().min(most)];
        let scores = in_parallel(machines, jobs, |place, machine| {
            let own = match &same {
                Some(_) => None,
                None => Some(machine.monitor.effect_slopes(&nominal, &effects)?),
            };
            let slopes = same.as_ref().or(own.as_ref()).map_or(&[][..], Vec::as_slice);
            let beside = self.beside(machine, factors);
            let scores = machine.effect_scores(quantities, &units[place].point, slopes, &beside)?;
            let ids = slopes.iter().map(|one| one.effect);
            Ok::<_, SimulationError>(ids.zip(scores).collect::<Vec<_>>())
        })?;
        let learnt = effects.into_iter().filter_map(|effect| {
            let of_kind = |is_wide: bool| -> Vec<&Score> {
                let own = machines.iter().zip(&scores);
                let own = own.filter(|(machine, _)| self.is_wide(machine.at) == is_wide);
                let of_effect = own.flat_map(|(_, scores)| scores);
                let of_effect = of_effect.filter(|(id, _)| *id == effect);
                of_effect.filter_map(|(_, score)| score.as_ref()).collect()
            };
            EffectError::of(effect, &of_kind(false), &of_kind(true))
        });
        self.effects = learnt.collect();
        Ok(())
    }

    /// Covariance of an effect's amplitudes by which the error looks like it, with a share of that of a
    /// wide play.
    pub(crate) fn effect_error(&self, effect: EffectId, wideness: f64) -> Option<DMatrix<f64>> {
        let own = self.effects.iter().find(|one| one.effect == effect)?;
        Some(own.mixed(wideness))
    }

    /// Part of the error that looks like another machine, of the scores of units left out; the scatter of
    /// machines with a narrow play and with a wide one.
    fn learn_embedded(
        &mut self,
        machines: &[Off<'_>],
        scores: &[Option<Score>],
    ) -> [Option<Scatter>; 2] {
        let scatter = |is_wide: bool| {
            let own = machines.iter().zip(scores);
            let own = own.filter(|(machine, _)| self.is_wide(machine.at) == is_wide);
            Scatter::of(&own.filter_map(|(_, score)| score.as_ref()).collect::<Vec<_>>())
        };
        let both = [scatter(false), scatter(true)];
        let none = &self.embedded.narrow;
        let excess = |of: &Option<Scatter>| {
            of.as_ref().map_or_else(|| none.clone(), |scatter| scatter.excess.clone())
        };
        let [narrow, wide] = [excess(&both[0]), excess(&both[1])];
        self.embedded = EmbeddedError { narrow, wide, ..self.embedded };
        both
    }

    /// Share of the part of the error that looks like another machine that recordings of one have in
    /// common, by machines that were recorded twice, beside that of the rest.
    fn embedded_in_common(
        &self,
        scatter: &[Option<Scatter>; 2],
        [first, second]: [(&Vec<Off<'_>>, &Vec<Option<Score>>); 2],
        rest: f64,
    ) -> f64 {
        let [mut common, mut beyond] = [0.0; 2];
        let first = first.0.iter().zip(first.1);
        for ((machine, score), (again, score_again)) in first.zip(second.0.iter().zip(second.1)) {
            let is_wide = self.is_wide(machine.at);
            let scatter = scatter[usize::from(is_wide)].as_ref();
            if let (Some(scatter), Some(score), Some(score_again)) = (scatter, score, score_again)
                && self.is_wide(again.at) == is_wide
            {
                let of_pair = scatter.in_common([score, score_again], rest);
                common += of_pair[0];
                beyond += of_pair[1];
            }
        }
        if beyond > 0.0 { common / beyond } else { 0.0 }
    }

    /// Covariance of all quantities by which the error looks like another machine, with a share of that
    /// of a wide play.
    pub(crate) fn embedded_of(&self, wideness: f64) -> DMatrix<f64> {
        let count = self.spread.len();
        let mixed = self.embedded.of(wideness);
        let mut all = DMatrix::zeros(count, count);
        for (row, &place) in self.bent.damage.iter().enumerate() {
            for (column, &other) in self.bent.damage.iter().enumerate() {
                all[(place, other)] = mixed[(row, column)];
            }
        }
        all
    }

    /// `S` of machines with a narrow play and with a wide one; of all, where few have either.
    fn learn_covariance(&mut self, at: &[Vec<f64>], residuals: &[Vec<f64>], support: usize) {
        let (wide, narrow): (Vec<_>, Vec<_>) =
            residuals.iter().zip(at).partition(|(_, at)| self.is_wide(at));
        let covariance = |of: &[(&Vec<f64>, &Vec<f64>)]| {
            tapered_covariance(
                &of.iter().map(|(residual, _)| residual).collect::<Vec<_>>(),
                support,
            )
        };
        if wide.len().min(narrow.len()) < LEAST_MACHINES {
            self.covariance = tapered_covariance(residuals, support);
        } else {
            (self.covariance, self.wide) = (covariance(&narrow), Some(covariance(&wide)));
        }
    }

    /// True where a machine with some quantities has a wide play.
    fn is_wide(&self, at: &[f64]) -> bool {
        self.bent.play.is_some_and(|play| at[play] > WIDE_PLAY)
    }

    /// Share of the covariance of a wide play in that of a machine with some quantities.
    pub(crate) fn wideness(&self, at: &[f64]) -> f64 {
        match (self.bent.play, &self.wide) {
            (Some(play), Some(_)) => {
                ((at[play] - WIDE_PLAY) / (2.0 * PLAY_BLEND) + 0.5).clamp(0.0, 1.0)
            }
            _ => 0.0,
        }
    }

    /// `S` with a share of that of a wide play.
    pub(crate) fn covariance_of(&self, wideness: f64) -> Cow<'_, BandedMatrix> {
        match &self.wide {
            Some(wide) if wideness > 0.0 => {
                Cow::Owned(self.covariance.scaled(1.0 - wideness).plus(&wide.scaled(wideness)))
            }
            _ => Cow::Borrowed(&self.covariance),
        }
    }

    /// Factors of `S` with noise, for a narrow play and for a wide one.
    fn factors(&self, noise: &BandedMatrix) -> Result<[BandedCholesky; 2], NotPositiveDefinite> {
        let factor = |wideness| joined(&self.covariance_of(wideness), noise).cholesky();
        Ok([factor(0.0)?, factor(1.0)?])
    }

    /// Share of the error that units have again in other recordings, over what a diagnosis weighs:
    /// `Σ r₁ᵀ·Σ⁻¹·r₂ / Σ |L⁻¹·r₁|·|L⁻¹·r₂|`.
    fn in_common(
        &self,
        at: &[Vec<f64>],
        first: &[Vec<f64>],
        second: &[Vec<f64>],
        factors: &[BandedCholesky; 2],
    ) -> f64 {
        let (mut together, mut own) = (0.0, 0.0);
        for ((first, second), at) in first.iter().zip(second).zip(at) {
            let whole = &factors[usize::from(self.is_wide(at))];
            let white = |residual: &Vec<f64>| {
                let mut white = residual.clone();
                whole.whiten(&mut white);
                white
            };
            let (first, second) = (white(first), white(second));
            together += dot(&first, &second);
            own += (dot(&first, &first) * dot(&second, &second)).sqrt();
        }
        together / own.max(f64::MIN_POSITIVE)
    }

    /// Takes the mean error at some quantities off a difference of the models.
    fn take_mean(&self, at: &[f64], difference: &mut [f64]) {
        let mut mean = vec![0.0; difference.len()];
        self.add_mean(at, &mut mean);
        for (value, mean) in difference.iter_mut().zip(mean) {
            *value -= mean;
        }
    }

    /// Mean and scatter of ln(misfit) over residuals of units left out, with noise added.
    fn learn_misfits(
        &mut self,
        at: &[Vec<f64>],
        residuals: &[Vec<f64>],
        unit_noise: &BandedMatrix,
        noise_a: f64,
        root: RootSeed,
    ) -> Result<(), ErrorModelError> {
        let noise = unit_noise.scaled(noise_a * noise_a);
        // the noise of a quiet start has next to no variance, and a factor needs some
        let mut regular = noise.clone();
        regular.add_to_diagonal(1e-6 * noise.mean_diagonal());
        let colour = regular.cholesky()?;
        let factors = self.factors(&noise)?;
        let mut random = Draws::new(root.derive(Purpose::Units, u64::MAX));
        let logs = residuals.iter().zip(at).map(|(residual, at)| {
            let mut sample: Vec<f64> = residual.iter().map(|_| random.normal()).collect();
            colour.colour(&mut sample);
            add_scaled(&mut sample, 1.0, residual);
            factors[usize::from(self.is_wide(at))].whiten(&mut sample);
            (dot(&sample, &sample) / sample.len() as f64).ln()
        });
        let logs: Vec<f64> = logs.collect();
        let count = logs.len() as f64;
        self.ln_misfit_mean = logs.iter().sum::<f64>() / count;
        let square = |log: &f64| (log - self.ln_misfit_mean) * (log - self.ln_misfit_mean);
        self.ln_misfit_std = (logs.iter().map(square).sum::<f64>() / (count - 1.0)).sqrt();
        Ok(())
    }

    fn away(&self, at: &[f64]) -> Vec<f64> {
        let places = at.iter().zip(&self.centre).zip(&self.spread);
        places.map(|((value, centre), spread)| (value - centre) / spread).collect()
    }

    /// The terms of the trend at some quantities.
    pub(crate) fn terms(&self, at: &[f64]) -> Vec<f64> {
        let away: Vec<f64> =
            self.away(at).into_iter().map(|x| x.clamp(-FARTHEST, FARTHEST)).collect();
        let mut terms = vec![1.0];
        terms.extend(&away);
        for (n, &first) in self.bent.damage.iter().enumerate() {
            terms.extend(self.bent.damage[n..].iter().map(|&second| away[first] * away[second]));
        }
        if let Some([a, b]) = self.bent.imbalance {
            let (a, b) = (at[a] / self.spread[a], at[b] / self.spread[b]);
            terms.extend([a, b, a + b].map(|x| x.abs().min(FARTHEST)));
        }
        terms
    }

    /// Number of terms of a trend in some quantities.
    pub(crate) fn terms_of(quantities: usize, bent: &Bent) -> usize {
        let damage = bent.damage.len();
        1 + quantities + damage * (damage + 1) / 2 + if bent.imbalance.is_some() { 3 } else { 0 }
    }

    /// Adds the mean error at some quantities to a signal.
    pub(crate) fn add_mean(&self, at: &[f64], signal: &mut [f64]) {
        for (coefficient, term) in self.coefficients.iter().zip(self.terms(at)) {
            add_scaled(signal, term, coefficient);
        }
    }

    /// Largest misfit of a unit that the model explains.
    pub(crate) fn largest_misfit(&self, deviations: f64) -> f64 {
        (self.ln_misfit_mean + deviations * self.ln_misfit_std).exp()
    }
}

/// A type of machine in a test.
#[derive(Clone, Copy)]
struct Machine<'a> {
    experiment: &'a Experiment,
    quantities: &'a Quantities,
}

impl<'a> Machine<'a> {
    /// Units with what their signals are off the model and the trend.
    fn off<'b>(self, units: &[Unit], at: &'b [Vec<f64>], residuals: &'b [Vec<f64>]) -> Vec<Off<'b>>
    where
        'a: 'b,
    {
        let Self { experiment, quantities } = self;
        let monitor = |unit: &Unit| UnitMonitor::new(experiment, quantities, unit.start_angle_rad);
        let all = units.iter().zip(at).zip(residuals);
        all.map(|((unit, at), residual_a)| Off { monitor: monitor(unit), at, residual_a }).collect()
    }
}

/// Units in both fidelities.
struct Compared {
    /// The quantities of each.
    at: Rows,
    /// High less low fidelity of each, A.
    differences: Rows,
    voltages: UnitVoltages,
}

/// Simulates units in both fidelities.
fn compared(
    experiment: &Experiment,
    quantities: &Quantities,
    units: &[Unit],
    jobs: usize,
) -> Result<Compared, SimulationError> {
    let at: Rows = units.iter().map(|unit| quantities.at(&unit.point)).collect();
    let simulated = simulated(experiment, quantities.layout(), units, jobs)?;
    let (mut differences, mut voltages) = (Vec::new(), UnitVoltages::default());
    for ((high, unit), at) in simulated.into_iter().zip(units).zip(&at) {
        let monitor = UnitMonitor::new(experiment, quantities, unit.start_angle_rad);
        let (motion, machine) = monitor.run(at)?;
        let mut difference = high.signal_a;
        for (value, low) in difference.iter_mut().zip(monitor.filtered(&motion.current_a)) {
            *value -= low;
        }
        differences.push(difference);
        let fit = high.voltage_v.and_then(|voltage_v| {
            let run = VoltageRun { motion: &motion, machine: &machine, experiment };
            run.filtered(|channels| monitor.filtered_each(channels)).fit(&voltage_v)
        });
        voltages.fits.push(fit);
        // the model's current is the true one here, whatever its sensors' gains
        let mut shown = quantities.volts_at(&unit.point);
        shown[1] += quantities.mean_phase_gain(&unit.point);
        voltages.shown.push(shown);
    }
    Ok(Compared { at, differences, voltages })
}

/// Mean and standard deviation of each quantity over units.
fn centre_and_spread(at: &[Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
    let count = at.len().max(1) as f64;
    let quantities = at.first().map_or(0, Vec::len);
    let mean = |place: usize| at.iter().map(|at| at[place]).sum::<f64>() / count;
    let centre: Vec<f64> = (0..quantities).map(mean).collect();
    let spread = |place: usize| {
        let square = |at: &Vec<f64>| (at[place] - centre[place]) * (at[place] - centre[place]);
        (at.iter().map(square).sum::<f64>() / count).sqrt().max(1e-12)
    };
    let spread = (0..quantities).map(spread).collect();
    (centre, spread)
}

/// Mean and standard deviation of each quantity over the machines drawn.
pub(crate) fn drawn_spread(
    experiment: &Experiment,
    quantities: &Quantities,
    root: RootSeed,
) -> (Vec<f64>, Vec<f64>) {
    let units = draw(experiment, quantities.layout(), StartAngle::Zero, Session::First, root);
    let at: Rows = units.iter().map(|unit| quantities.at(&unit.point)).collect();
    centre_and_spread(&at)
}

fn taper_samples(rate_hz: f64) -> usize {
    (TAPER_S * rate_hz).round().max(2.0) as usize
}

/// Covariance with a size for each time, that of the residuals within the taper's reach, and one
/// correlation.
fn sized_covariance(residuals: &[Vec<f64>], support: usize) -> BandedMatrix {
    let samples = residuals.first().map_or(0, Vec::len);
    let square = |n: usize| residuals.iter().map(|r| r[n] * r[n]).sum::<f64>();
    let squares: Vec<f64> = (0..samples).map(square).collect();
    let size = |n: usize| {
        let near = n.saturating_sub(support / 2)..samples.min(n + support / 2 + 1);
        let count = (near.len() * residuals.len()) as f64;
        (squares[near].iter().sum::<f64>() / count).sqrt().max(f64::MIN_POSITIVE)
    };
    let sizes: Vec<f64> = (0..samples).map(size).collect();
    let product = |lag: usize| {
        let of_one = |r: &Vec<f64>| {
            let pairs = (lag..samples).map(|n| r[n] / sizes[n] * (r[n - lag] / sizes[n - lag]));
            pairs.sum::<f64>()
        };
        residuals.iter().map(of_one).sum::<f64>()
    };
    let whole = product(0).max(f64::MIN_POSITIVE);
    let mut covariance = BandedMatrix::zeros(samples, support.saturating_sub(1));
    for lag in 0..support.min(samples) {
        let correlation = product(lag) / whole * gaspari_cohn(lag as f64 / support as f64);
        for n in lag..samples {
            *covariance.at_mut(n, n - lag) = sizes[n] * sizes[n - lag] * correlation;
        }
    }
    covariance
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An error that has a covariance alone.
    pub(crate) fn with_covariance(covariance: BandedMatrix) -> UnitError {
        UnitError {
            start: StartAngle::Zero,
            bent: Bent { damage: Vec::new(), imbalance: None, play: None },
            centre: Vec::new(),
            spread: Vec::new(),
            coefficients: Vec::new(),
            covariance,
            wide: None,
            embedded: EmbeddedError::none(0),
            effects: Vec::new(),
            in_common: InCommon::default(),
            ln_misfit_mean: 0.0,
            ln_misfit_std: 0.0,
            voltage: None,
        }
    }
}
