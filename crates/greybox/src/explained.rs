//! The answer of an explanation, and the model with it.

use ema_sim::{
    Effect, EffectId,
    model_file::{Annotation, EffectBlock, MachineModel},
};

use crate::{
    curve::{Hypothesis, ResidualCurve},
    floor::NoiseFloor,
    machine::Machine,
    observation::Observation,
    show::{RecordFit, Remainder},
    signal_chain::{SignalFind, standing},
    unexplained::unexplained_block,
};

/// The answer in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The model explains the recordings to the noise.
    Adequate,
    /// The model explains the recordings with one effect more.
    Named,
    /// An effect is there, and something else is left, which no effect explains surely.
    NamedWithRemainder,
    /// One of several effects that explain the recordings equally well.
    OneOf,
    /// Something is left that no effect of the catalogue explains.
    Unknown,
    /// Damage or tolerance that the recordings show may be an effect: they cannot tell.
    Absorbed,
    /// The recordings do not suffice.
    Inconclusive,
}

/// A 95 % interval of a number.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberInterval {
    /// Key of the number.
    pub key: String,
    /// Ends of the interval, in the unit of the key.
    pub interval_95: [f64; 2],
}

/// An effect that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// With its numbers.
    pub effect: Effect,
    /// 95 % intervals of the numbers that were fitted, each key once: of a number that differs
    /// between recordings that of the first.
    pub interval_95: Vec<NumberInterval>,
    /// Family-wise chance of such a score from noise alone.
    pub p_familywise: f64,
    /// Gain in log-likelihood on recordings not fitted, nats.
    pub holdout_gain_nats: f64,
    /// Standard error of the gain held out.
    pub holdout_gain_se: f64,
    /// Gain in evidence of the recordings fitted, nats.
    pub evidence_nats: f64,
    /// Effect found that an alternative may be instead of.
    pub instead_of: Option<EffectId>,
}

/// A fault level as a fit gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultLevel {
    /// The level.
    pub value: f64,
    /// Standard deviation with the effects of the answer: by the scatter over half-second blocks,
    /// and no smaller than recordings held out that would have it elsewhere leave it.
    pub std: f64,
    /// 95 % interval, within what a level can be. That of an eccentricity, an amount without a
    /// direction, begins at zero where its two components are zero within 95 %. In the end it
    /// holds those of all explanations that are left open: of what is tied, and of effects that
    /// are no chance but did not pass the gates.
    pub interval_95: [f64; 2],
}

/// A fault level without and with what was found.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultChange {
    /// Fault level: `k1` to `k6`.
    pub key: String,
    /// With the nominal model.
    pub before: FaultLevel,
    /// With the effects found.
    pub after: FaultLevel,
    /// Keys of numbers of the model file that leave the level open, the most first: were all numbers
    /// known, its standard deviation would halve.
    pub ambiguous_with: Vec<String>,
}

/// A number of the data sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberFit {
    /// Key of the model file.
    pub key: String,
    /// Value in the model file.
    pub nominal: f64,
    /// Value fitted together with the effects.
    pub fitted: f64,
}

/// Number of the model file that is wrong: recordings have it beyond its tolerance.
#[derive(Clone, Debug, PartialEq)]
pub struct WrongNumber {
    /// Key of the model file.
    pub key: String,
    /// Value in the model file.
    pub nominal: f64,
    /// Half-width of its tolerance, in the unit of the key.
    pub tolerance: f64,
    /// Value by the recordings.
    pub value: f64,
    /// 95 % interval of the value.
    pub interval_95: [f64; 2],
    /// Chance that noise alone makes any number leave its tolerance by as much.
    pub p_familywise: f64,
    /// Gain in log-likelihood, over the number within its tolerance, on recordings not fitted, nats.
    pub holdout_gain_nats: f64,
    /// Standard error of the gain held out.
    pub holdout_gain_se: f64,
}

/// Smallest size of an effect that these recordings would have named, whatever its sign and phase.
#[derive(Clone, Debug, PartialEq)]
pub struct SmallestNamed {
    /// The effect, of that size, with the shape that shows best.
    pub effect: Effect,
    /// Key of its first number.
    pub key: String,
    /// Size of that number, in the unit of the key.
    pub size: f64,
}

/// How well a recording is explained without and with what was found.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordChange {
    /// Use of the recording.
    pub role: Use,
    /// With the nominal model.
    pub before: RecordFit,
    /// With the effects found.
    pub after: RecordFit,
}

/// Use that was made of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Fitted.
    Train,
    /// Held out.
    Holdout,
    /// Repetition of a training recording.
    Repeat,
}

/// The answer.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Explained {
    /// In a word.
    pub verdict: Verdict,
    /// Why it is no more than that, where it is not.
    pub reason: Option<String>,
    /// Effects found, strongest first, but for one in doubt before the others.
    pub effects: Vec<Finding>,
    /// Effects that explain the recordings as well as one of those found does.
    pub alternatives: Vec<Finding>,
    /// Numbers of the model file that are wrong.
    pub numbers: Vec<WrongNumber>,
    /// Effects that could hide in damage or tolerances.
    pub absorbed: Vec<EffectId>,
    /// Root mean square of the residual held out: nominal, and with the effects.
    pub holdout_rms: Option<[f64; 2]>,
    /// Level of the noise.
    pub noise_floor: Option<NoiseFloor>,
    /// Model that predicted the recordings.
    pub observation: Option<Observation>,
    /// Unit of the signal compared, `a` or `v`.
    pub drive_unit: &'static str,
    /// Fault levels.
    pub faults: Vec<FaultChange>,
    /// Numbers of the data sheet that are known only roughly.
    pub rough: Vec<NumberFit>,
    /// Smallest size of each effect's first number that would have been named nine times in ten.
    pub smallest_named_90: Vec<SmallestNamed>,
    /// How well each recording is explained: training, held out, repeated; nominal and with
    /// the effects.
    pub records: Vec<RecordChange>,
    /// Description of what is left, where something is.
    pub remainder: Option<Remainder>,
    /// How each effect of the catalogue fared against the nominal model, best first.
    pub hypotheses: Vec<Hypothesis>,
    /// The residual over each coordinate, before and after.
    pub curves: Vec<ResidualCurve>,
    /// Finds of the signal chain: those that were corrected, then those that stand, for which there
    /// is no conclusion.
    pub signals: Vec<SignalFind>,
    /// Trace of the rounds, for who wants to know.
    pub log: Vec<String>,
}

impl Explained {
    /// No answer, and why.
    pub fn inconclusive(reason: String) -> Self {
        Self {
            verdict: Verdict::Inconclusive,
            reason: Some(reason),
            effects: Vec::new(),
            alternatives: Vec::new(),
            numbers: Vec::new(),
            absorbed: Vec::new(),
            holdout_rms: None,
            noise_floor: None,
            observation: None,
            drive_unit: "a",
            faults: Vec::new(),
            rough: Vec::new(),
            smallest_named_90: Vec::new(),
            records: Vec::new(),
            remainder: None,
            hypotheses: Vec::new(),
            curves: Vec::new(),
            signals: Vec::new(),
            log: Vec::new(),
        }
    }

    /// No answer of recordings whose signal chain is not sound.
    pub fn unsound(signals: Vec<SignalFind>) -> Self {
        let reason = standing(&signals).map(SignalFind::sentence).unwrap_or_default();
        Self { signals, ..Self::inconclusive(reason) }
    }

    /// The model with the effects found, or numbers that are wrong, and the rough numbers fitted beside
    /// them, to which their sizes belong. Where the verdict is [`Verdict::Unknown`] the curve of the coordinate that
    /// what is left follows most is added to the model, marked as unknown, if it follows one.
    /// Without either it is the model given, bit for bit.
    pub fn extend(&self, model: &MachineModel) -> MachineModel {
        if self.effects.is_empty() && self.numbers.is_empty() {
            let mut extended = model.clone();
            extended.effects_mut().extend(unexplained_block(self, model));
            return extended;
        }
        let fitted = self.rough.iter().map(|number| (number.key.as_str(), number.fitted));
        let mut extended = Machine::new(model).with_numbers(fitted);
        for finding in &self.effects {
            let mut block = EffectBlock::from(finding.effect.clone());
            let interval = |one: &NumberInterval| (one.key.clone(), one.interval_95);
            block.interval_95 = finding.interval_95.iter().map(interval).collect();
            let text = |text: &str| Annotation::Text(text.to_owned());
            let id = finding.effect.id();
            let instead = self.alternatives.iter().filter(|one| one.instead_of == Some(id));
            let symbols: Vec<_> = instead.map(|f| text(f.effect.id().info().symbol)).collect();
            let status = if symbols.is_empty() { "named" } else { "one-of" };
            block.annotations.push(("status".to_owned(), text(status)));
            if !symbols.is_empty() {
                block.annotations.push(("alternatives".to_owned(), Annotation::List(symbols)));
            }
            let mut evidence = vec![
                ("p-familywise".to_owned(), Annotation::Number(finding.p_familywise)),
                ("holdout-gain-nats".to_owned(), Annotation::Number(finding.holdout_gain_nats)),
                ("holdout-gain-se".to_owned(), Annotation::Number(finding.holdout_gain_se)),
            ];
            if let (Some([before, after]), Some(floor)) = (self.holdout_rms, self.noise_floor) {
                evidence.push(("holdout-rms-before".to_owned(), Annotation::Number(before)));
                evidence.push(("holdout-rms-after".to_owned(), Annotation::Number(after)));
                evidence.push(("noise-floor".to_owned(), Annotation::Number(floor.rms)));
            }
            block.annotations.push(("evidence".to_owned(), Annotation::Table(evidence)));
            extended.effects_mut().push(block);
        }
        extended
    }
}
