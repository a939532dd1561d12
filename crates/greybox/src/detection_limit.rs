//! Detection limits: the smallest size of each effect that these recordings would have named.
//!
//! An effect `c` of size `s` is added to what the fit in the end leaves, of the recordings fitted
//! and of those held out: `r + s·c`. All else is as linear there as it is in the scan, so that the
//! fits without and with the effect, and what is held out before either, follow from products of
//! whitened columns. The gates of the search decide ([`Session::stands`]); the limit is where they
//! begin to let the effect pass, whatever its sign and phase, with noise to spare for nine times in ten.

use core::f64::consts::TAU;

use ema_sim::EffectId;
use inference::Whitener;
use nalgebra::DVector;

use crate::{
    error::{GreyboxError, if_run},
    explain::Session,
    explained::SmallestNamed,
    fit::{Fitted, Normal, each_whitened, whitened},
    gain::{Gain, Share, block_length},
    gram::{Gram, solve},
    hypothesis::{Scales, differs_by_record, is_nonlinear_in_size, numbers},
    known::{Known, There, Unfitted},
    machine::State,
    plausible::Plausible,
    problem::PerRecord,
    rival::{Claim, Shortlisted, is_on_bound},
    scan::{Scored, is_signed},
    search::{Round, Search, may_repeat},
    structure::{Structure, set},
    trial::{Tried, alone},
};

/// Standard deviations that nine of ten are within, to one side.
const NINE_IN_TEN: f64 = 1.2816;
/// Phases of an effect that has one.
const PHASES: usize = 8;
/// Angle that spreads phases of several recordings evenly.
const GOLDEN: f64 = TAU * 0.381_966;
/// Standard deviations by which the first size tried shows.
const FIRST_SHOWN: f64 = 6.0;
/// Most doublings of it, and most halvings.
const MOST_DOUBLINGS: usize = 12;
/// Halvings of the logarithm of the factor of two between a size that is named and one that is not.
const HALVINGS: usize = 3;

impl Session<'_> {
    /// Detection limits of the effects of the last round.
    pub(crate) fn detection_limits(
        &self,
        search: &Search,
    ) -> Result<Vec<SmallestNamed>, GreyboxError> {
        let Some(round) = search.rounds.last() else { return Ok(Vec::new()) };
        let scales = self.scales(&search.current.fitted)?;
        let limits = Limits::new(self, search, &scales)?;
        limits.map_or_else(|| Ok(Vec::new()), |limits| limits.of(round))
    }
}

/// The fit in the end, as all limits go by it.
struct Limits<'s> {
    session: &'s Session<'s>,
    whitener: &'s Whitener,
    fitted: &'s Fitted,
    /// Effects found, the nats that they explain, and the fall that another has to have beside them:
    /// that of the weakest where no more are looked for.
    found: Vec<EffectId>,
    explained: f64,
    least_fall: f64,
    /// Whitened sensitivities of what was fitted, and the residual.
    columns: Vec<Vec<f64>>,
    residual: Vec<f64>,
    /// Prediction of what was held out; its sensitivities of the numbers that are one in all
    /// recordings and its residual, whitened.
    drive_there: PerRecord,
    columns_there: Vec<PerRecord>,
    residual_there: PerRecord,
    plausible: Plausible,
}

/// An effect added.
struct Added<'l> {
    limits: &'l Limits<'l>,
    round: &'l Round,
    shortlisted: Shortlisted<'l>,
    /// Free numbers with the effect, its sizes last, and where they begin.
    with: Structure,
    values: Vec<f64>,
    /// Products of the whitened columns of all these, and last of the residual.
    products: Gram,
    /// Products of each block held out, with its samples: numbers that are one in all recordings, the
    /// effect's columns there, the residual.
    blocks: Vec<(Gram, usize)>,
    /// Products of all blocks, with their samples.
    there: (Gram, usize),
    /// Numbers of the model without the effect that are one in all recordings.
    known: Vec<usize>,
    /// Columns of the effect in what was held out.
    sizes_there: usize,
}

/// An explanation of the recordings with the effect added.
struct Fit {
    values: Vec<f64>,
    objective: f64,
    /// Log-likelihood of what was fitted, but for a constant.
    train: f64,
    /// Parts of the columns held out that are left, the size of the noise there, and the price.
    left: Vec<f64>,
    size: f64,
    price_nats: f64,
}

impl<'s> Limits<'s> {
    fn new(
        session: &'s Session<'s>,
        search: &'s Search,
        scales: &Scales,
    ) -> Result<Option<Self>, GreyboxError> {
        let (fitted, whitener) = (&search.current.fitted, &search.floor.whitener);
        let there = Unfitted::new(&session.holdout, fitted, search.current.own_noise());
        let Some(Unfitted { drive, residuals, sensitivities }) = if_run(there)? else {
            return Ok(None);
        };
        let is_full = search.found.len() == session.options.most_effects;
        let falls = search.found.iter().map(|found| found.rival.claim.fall);
        Ok(Some(Self {
            session,
            whitener,
            fitted,
            found: search.found.iter().map(|found| found.rival.id).collect(),
            explained: search.explained(),
            least_fall: if is_full { falls.fold(f64::INFINITY, f64::min) } else { 0.0 },
            columns: fitted.sensitivities.iter().map(|c| whitened(whitener, c)).collect(),
            residual: whitened(whitener, &fitted.residuals),
            drive_there: drive,
            columns_there: sensitivities.iter().map(|c| each_whitened(whitener, c)).collect(),
            residual_there: each_whitened(whitener, &residuals),
            plausible: Plausible::new(session.machine, scales),
        }))
    }

    /// The limit of each effect of a round that has one.
    fn of(&self, round: &Round) -> Result<Vec<SmallestNamed>, GreyboxError> {
        let scored = round.scan.scored.iter();
        let asked: Vec<&Scored> = scored.filter(|scored| self.is_asked(round, scored)).collect();
        let tried = |scored: &&Scored| &round.tried[scored.tried];
        let there = self.changes_there(&asked.iter().map(tried).collect::<Vec<_>>());
        let mut limits = Vec::new();
        for (scored, there) in asked.into_iter().zip(there) {
            let Some(there) = if_run(there)? else { continue };
            let shortlisted = Shortlisted {
                scored,
                tried: &round.tried[scored.tried],
                family: &round.families[scored.family],
                plausible: self.plausible,
                questions: round.families.len() as f64,
            };
            limits.extend(Added::new(self, round, shortlisted, &there).limit());
        }
        Ok(limits)
    }

    /// Tells whether an effect may still be found, and shows.
    fn is_asked(&self, round: &Round, scored: &Scored) -> bool {
        let id = round.families[scored.family].id;
        scored.energy > 0.0 && (may_repeat(id) || !self.found.contains(&id))
    }

    /// Changes of what was held out by the sizes tried.
    fn changes_there(&self, tried: &[&Tried]) -> Vec<Result<Vec<PerRecord>, GreyboxError>> {
        let Fitted { structure, values, .. } = self.fitted;
        let holdout = &self.session.holdout;
        let state = structure.state_elsewhere(self.session.machine, values);
        let sizes = |tried: &Tried| -> Vec<(usize, f64)> {
            let mut sizes = tried.sizes.clone();
            sizes.dedup();
            sizes
        };
        let on = |tried: &&Tried| {
            let one = |(place, size)| {
                let mut effect = tried.plain.clone();
                set(&mut effect, place, size);
                let mut on = state.clone();
                on.add(&effect);
                on
            };
            sizes(tried).into_iter().map(one).collect::<Vec<_>>()
        };
        let states: Vec<State> = tried.iter().flat_map(on).collect();
        let drives = holdout.drives_of_each(&states);
        let mut drives = drives.into_iter();
        let less = |with: PerRecord| -> PerRecord {
            let of = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| a - b).collect();
            with.iter().zip(&self.drive_there).map(of).collect()
        };
        let of = |tried: &&Tried| {
            let own: Vec<_> = drives.by_ref().take(sizes(tried).len()).collect();
            let changes: Vec<PerRecord> =
                own.into_iter().map(|with| with.map(less)).collect::<Result<_, _>>()?;
            if !differs_by_record(tried.plain.id()) {
                return Ok(changes);
            }
            let each = |change: &PerRecord| {
                (0..change.len()).map(|record| alone(change, record)).collect::<Vec<_>>()
            };
            Ok(changes.iter().flat_map(each).collect())
        };
        tried.iter().map(of).collect()
    }
}

impl Limits<'_> {
    /// Products of what was held out with the columns of an effect there, block by block.
    fn blocks(&self, tried: &Tried, there: &[PerRecord]) -> Vec<(Gram, usize)> {
        let per_unit = |(place, column): (usize, &PerRecord)| -> PerRecord {
            // what differs by recording has its sizes of one place one after the other
            let (_, size) = tried.sizes[place * tried.sizes.len() / there.len()];
            let white = each_whitened(self.whitener, column);
            white.iter().map(|signal| signal.iter().map(|x| x / size).collect()).collect()
        };
        let mut columns = self.columns_there.clone();
        columns.extend(there.iter().enumerate().map(per_unit));
        columns.push(self.residual_there.clone());
        let mut blocks = Vec::new();
        for (record, prepared) in self.session.holdout.records.iter().enumerate() {
            let length = block_length(prepared);
            let samples = self.residual_there[record].len();
            for start in (0..samples).step_by(length) {
                let range = start..(start + length).min(samples);
                let of = |column: &PerRecord| column[record][range.clone()].to_vec();
                blocks.push((Gram::new(&columns.iter().map(of).collect::<Vec<_>>()), range.len()));
            }
        }
        blocks
    }
}

impl<'l> Added<'l> {
    fn new(
        limits: &'l Limits<'l>,
        round: &'l Round,
        shortlisted: Shortlisted<'l>,
        there: &[PerRecord],
    ) -> Self {
        let (fitted, noise) = (limits.fitted, limits.whitener);
        let Shortlisted { tried, plausible, .. } = shortlisted;
        let mut sizes = numbers(&tried.plain, &tried.sizes, &[], &plausible);
        let by_record = differs_by_record(tried.plain.id());
        if by_record {
            let records = limits.session.train.records.len();
            let places = sizes.iter_mut().enumerate();
            places.for_each(|(n, number)| number.in_record = Some((n % records, 0.0)));
        }
        let mut with = fitted.structure.with_effect(tried.plain.clone(), &sizes);
        // a linear fit may go where it leads
        with.free.iter_mut().for_each(|free| free.reach = f64::INFINITY);
        let values = fitted.values.iter().copied().chain(sizes.iter().map(|_| 0.0)).collect();
        let mut columns = limits.columns.clone();
        let per_unit = |(column, (_, size)): (&PerRecord, &(usize, f64))| -> Vec<f64> {
            whitened(noise, column).iter().map(|x| x / size).collect()
        };
        columns.extend(tried.columns.iter().zip(&tried.sizes).map(per_unit));
        columns.push(limits.residual.clone());
        let blocks = limits.blocks(tried, there);
        let none = (Gram::zeros(limits.columns_there.len() + there.len() + 1), 0);
        let sum = |(all, samples): (Gram, usize), (gram, more): &(Gram, usize)| {
            (all.plus(gram), samples + more)
        };
        Self {
            limits,
            round,
            shortlisted,
            with,
            values,
            products: Gram::new(&columns),
            there: blocks.iter().fold(none, sum),
            blocks,
            known: fitted.structure.same_everywhere(),
            sizes_there: there.len(),
        }
    }

    /// The smallest size from which on the effect is named, of the sign and phase that show it least;
    /// `None` where no size that there can be is.
    fn limit(&self) -> Option<SmallestNamed> {
        let Shortlisted { tried, scored, .. } = self.shortlisted;
        let &(place, size) = tried.sizes.first()?;
        let first = FIRST_SHOWN * size.abs() * libm::sqrt(tried.sizes.len() as f64 / scored.energy);
        let limit_of = |direction: usize| self.limit_of(direction, first);
        let size = (0..self.directions())
            .map(limit_of)
            .try_fold(0.0_f64, |most, limit| limit.map(|limit| most.max(limit)))?;
        let size = size + self.there_already();
        let id = tried.plain.id();
        let parameter = &id.info().parameters[place];
        let key = parameter.key(self.limits.session.machine.geometry()).to_owned();
        let mut effect = tried.plain.clone();
        set(&mut effect, place, size);
        let is_possible = size <= self.shortlisted.plausible.most(parameter);
        is_possible.then_some(SmallestNamed { effect, key, size })
    }

    /// Signs or phases of the effect.
    fn directions(&self) -> usize {
        match self.shortlisted.tried.sizes.len() {
            1 if self.has_one_sign() => 1,
            1 => 2,
            _ => PHASES,
        }
    }

    fn has_one_sign(&self) -> bool {
        let Tried { plain, sizes, .. } = self.shortlisted.tried;
        sizes.len() == 1 && is_signed(plain, sizes[0].0)
    }

    /// Size of an effect of one sign in the recordings, by the scan: so much is not added to them. Of
    /// an effect that may have either, or any phase, the worst has to make up for it.
    fn there_already(&self) -> f64 {
        let Shortlisted { tried, scored, .. } = self.shortlisted;
        let is_linear = !is_nonlinear_in_size(tried.plain.id());
        if self.has_one_sign() && is_linear { scored.sizes[0].max(0.0) } else { 0.0 }
    }

    /// The smallest size of a sign or phase that is named, from a first one.
    fn limit_of(&self, direction: usize, first: f64) -> Option<f64> {
        let is_named = |size: f64| self.is_named(direction, size);
        let doubled = |times: usize| first * f64::from(1_u32 << times);
        let (mut least, mut most) = if is_named(first) {
            let halved = (1..=MOST_DOUBLINGS).map(|times| first / f64::from(1_u32 << times));
            // named without it: the recordings are not what the linear picture takes them for
            let least = halved.into_iter().find(|size| !is_named(*size))?;
            (least, 2.0 * least)
        } else {
            let most = (1..=MOST_DOUBLINGS).map(doubled).find(|size| is_named(*size))?;
            (0.5 * most, most)
        };
        for _ in 0..HALVINGS {
            let middle = libm::sqrt(least * most);
            if is_named(middle) { most = middle } else { least = middle }
        }
        Some(most)
    }

    /// Tells whether the gates let the effect of a size pass.
    fn is_named(&self, direction: usize, size: f64) -> bool {
        let limits = self.limits;
        let sized = |columns| -> Vec<f64> {
            parts(direction, columns).iter().map(|part| size * part).collect()
        };
        let sizes = self.shortlisted.tried.sizes.len();
        let (here, there) = (sized(sizes), sized(self.sizes_there));
        let [without, with] = [false, true].map(|has| self.fit(has, &here, &there));
        let asked = self.shortlisted.asked();
        let samples = limits.residual.len();
        // nine times in ten noise takes no more of either
        let fall = without.objective - with.objective;
        let by_chance = NINE_IN_TEN * libm::sqrt(2.0 * fall.max(0.0));
        let fall = fall - by_chance;
        let mut gain = Gain::of(&self.shares(&with, &without));
        gain.nats -= NINE_IN_TEN * gain.std_error;
        let evidence = with.train - without.train - by_chance - asked.price_nats(samples);
        let effect = self.with.effects.len() - 1;
        let by_record = differs_by_record(self.shortlisted.tried.plain.id());
        let claim = Claim {
            fall,
            log_p: asked.log_chance(fall),
            log_p_alone: asked.log_chance_alone(fall),
            gain,
            evidence,
            on_bound: is_on_bound(&self.with, &with.values, effect, sizes),
            fits_there: by_record,
        };
        let alpha = limits.session.alarm_rate(limits.found.len());
        let id = self.shortlisted.tried.plain.id();
        fall > limits.least_fall
            && asked.log_chance_of_scan(fall) <= libm::log(alpha)
            && limits.session.stands(id, &claim, limits.explained, alpha)
            && self.is_refitted(&here)
    }

    /// Tells whether the scan has the effect with these sizes among those that are refitted.
    fn is_refitted(&self, sizes: &[f64]) -> bool {
        let Shortlisted { scored, tried, .. } = self.shortlisted;
        let Round { families, tried: all, scan } = self.round;
        let times = sizes.iter().zip(&tried.sizes).map(|(size, (_, tried))| size / tried);
        let times: Vec<f64> = times.collect();
        scan.better_than((families, all), scored, &times) < self.limits.session.options.refitted
    }

    /// The recordings with the effect of these sizes added, explained with it or without.
    fn fit(&self, has_effect: bool, here: &[f64], there: &[f64]) -> Fit {
        let all = self.values.len();
        let free = if has_effect { all } else { all - here.len() };
        // of the columns of all numbers and the residual
        let mut left: Vec<f64> = vec![0.0; all - here.len()];
        left.extend(here);
        left.push(1.0);
        let structure = self.with.only(&(0..free).collect::<Vec<_>>());
        let from = &self.values[..free];
        let normal = Normal {
            curvature: self.products.first(free),
            descent: DVector::from_fn(free, |n, _| self.products.with(n, &left)),
        };
        let normal = normal.with_priors(&structure.free, from);
        let values = normal.bounded(&structure.free, from, 0.0);
        let moves: Vec<f64> = values.iter().zip(from).map(|(to, from)| to - from).collect();
        left.iter_mut().zip(&moves).for_each(|(left, by)| *left -= by);
        let energy = self.products.energy(&left);
        let samples = self.limits.residual.len() as f64;
        let objective = 0.5 * energy + structure.cost_of(&values);
        let train = -0.5 * samples * libm::log((energy / samples).max(f64::MIN_POSITIVE));
        let known = Known::told_by(&self.products.beside(free, &left), &structure, &values);
        let mut left: Vec<f64> = self.known.iter().map(|&place| -moves[place]).collect();
        left.extend(there);
        left.push(1.0);
        let (size, price_nats) = self.held_out(&known, &moves[all - here.len()..], &mut left);
        Fit { values, objective, train, left, size, price_nats }
    }

    /// Takes off what is `left` of the columns held out what the numbers explain there, as known as
    /// they are, with the sizes of the effect moved from zero. Size of the noise there and price.
    fn held_out(&self, known: &Known, sizes: &[f64], left: &mut [f64]) -> (f64, f64) {
        let of_effect = self.known.len()..self.known.len() + self.sizes_there;
        let by_record = differs_by_record(self.shortlisted.tried.plain.id());
        let (gram, samples) = &self.there;
        let mut fitted_there = 0.0;
        if !by_record {
            let places = left[of_effect.clone()].iter_mut().zip(sizes);
            places.for_each(|(left, size)| *left -= size);
        } else if !sizes.is_empty() {
            let places: Vec<usize> = of_effect.collect();
            let right = DVector::from_fn(places.len(), |i, _| gram.with(places[i], left));
            let taken = solve(&gram.block(&places), &right);
            places.iter().zip(taken.iter()).for_each(|(&place, by)| left[place] -= by);
            fitted_there = places.len() as f64;
        }
        let count = known.values.len();
        let there = There {
            products: gram.first(count),
            descent: DVector::from_fn(count, |n, _| gram.with(n, left)),
            energy: gram.energy(left),
            samples: *samples,
        };
        let moved = known.moved(&there);
        let by = moved.values.iter().zip(&known.values).map(|(to, from)| to - from);
        left.iter_mut().zip(by).for_each(|(left, by)| *left -= by);
        (moved.size, moved.price_nats + fitted_there)
    }

    /// Gains of one explanation over another, block by block.
    fn shares(&self, with: &Fit, without: &Fit) -> Vec<Share> {
        let apart: Vec<f64> = with.left.iter().zip(&without.left).map(|(a, b)| a - b).collect();
        let blocks = self.blocks.len().max(1) as f64;
        let of = |(gram, samples): &(Gram, usize)| {
            let samples = *samples as f64;
            let likelihood = |fit: &Fit| {
                let price = (samples * libm::log(fit.size)) + fit.price_nats / blocks;
                -0.5 * gram.energy(&fit.left) / (fit.size * fit.size) - price
            };
            let mean_square = gram.energy(&with.left) / samples;
            let nats = likelihood(with) - likelihood(without);
            Share::new(nats, gram.energy(&apart), mean_square, with.size * without.size)
        };
        self.blocks.iter().map(of).collect()
    }
}

/// Parts of an effect of size one, of a sign or phase, in so many columns.
fn parts(direction: usize, columns: usize) -> Vec<f64> {
    if columns == 1 {
        return vec![if direction == 0 { 1.0 } else { -1.0 }];
    }
    let records = columns / 2;
    let phase = |record: usize| {
        TAU * direction as f64 / PHASES as f64 + GOLDEN * (record * (direction + 1)) as f64
    };
    let cosines = (0..records).map(|record| libm::cos(phase(record)));
    cosines.chain((0..records).map(|record| libm::sin(phase(record)))).collect()
}
