//! The answer of an explanation, and the model with it.

use ema_sim::{
    Effect, EffectId,
    model_file::{Annotation, EffectBlock, MachineModel},
};

use crate::{
    curve::{Hypothesis, ResidualCurve},
    floor::NoiseSource,
    machine::Machine,
    show::{RecordFit, Remainder},
};

/// The answer in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The model explains the recordings to the noise.
    Adequate,
    /// It does with one effect more.
    Named,
    /// An effect is there, and something else is left, which no effect explains surely.
    NamedWithRemainder,
    /// One of several effects that explain the recordings equally well.
    OneOf,
    /// Something is left that no effect of the catalogue explains.
    Unknown,
    /// What the recordings show as damage or tolerance may be an effect: they cannot tell.
    Absorbed,
    /// The recordings do not suffice.
    Inconclusive,
}

/// An effect that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// With its numbers.
    pub effect: Effect,
    /// 95 % intervals of the numbers that were fitted, by key.
    pub interval_95: Vec<(String, [f64; 2])>,
    /// Family-wise chance of such a score from noise alone.
    pub p_familywise: f64,
    /// Gain in log-likelihood on recordings not fitted, nats.
    pub holdout_gain_nats: f64,
    /// Its standard error.
    pub holdout_gain_se: f64,
    /// Gain in evidence of the recordings fitted, nats.
    pub evidence_nats: f64,
    /// Of an alternative the effect found that it may be instead.
    pub instead_of: Option<EffectId>,
}

/// A fault level as a fit gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultLevel {
    /// The level.
    pub value: f64,
    /// Its standard deviation with the effects of the answer: by the scatter over half-second blocks,
    /// and no smaller than recordings held out that would have it elsewhere leave it.
    pub std: f64,
    /// Its 95 % interval, within what a level can be. That of an eccentricity, an amount without a
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
}

/// What a recording was used for.
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
pub struct Explained {
    /// In a word.
    pub verdict: Verdict,
    /// Why it is no more than that, where it is not.
    pub reason: Option<String>,
    /// What was found, strongest first, but for one in doubt before the others.
    pub effects: Vec<Finding>,
    /// What explains the recordings as well as one of them does.
    pub alternatives: Vec<Finding>,
    /// Effects that could hide in damage or tolerances.
    pub absorbed: Vec<EffectId>,
    /// Root mean square of the residual held out: nominal, and with the effects.
    pub holdout_rms: Option<[f64; 2]>,
    /// Root mean square of the noise, and where that is from.
    pub noise_floor: Option<(f64, NoiseSource)>,
    /// Unit of the signal compared, `a` or `v`.
    pub drive_unit: &'static str,
    /// Fault levels.
    pub faults: Vec<FaultChange>,
    /// Numbers of the data sheet: nominal and fitted with the effects.
    pub rough: Vec<(String, f64, f64)>,
    /// Smallest size of each effect's first number that would have been named nine times in ten.
    pub smallest_named_90: Vec<(EffectId, String, f64)>,
    /// How well each recording is explained: training, held out, repeated; nominal and with
    /// the effects.
    pub records: Vec<(Use, RecordFit, RecordFit)>,
    /// What is left, where something is.
    pub remainder: Option<Remainder>,
    /// How each effect of the catalogue fared against the nominal model, best first.
    pub hypotheses: Vec<Hypothesis>,
    /// The residual over each coordinate, before and after.
    pub curves: Vec<ResidualCurve>,
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
            absorbed: Vec::new(),
            holdout_rms: None,
            noise_floor: None,
            drive_unit: "a",
            faults: Vec::new(),
            rough: Vec::new(),
            smallest_named_90: Vec::new(),
            records: Vec::new(),
            remainder: None,
            hypotheses: Vec::new(),
            curves: Vec::new(),
            log: Vec::new(),
        }
    }

    /// The model with the effects found and the rough numbers fitted beside them, to which their
    /// sizes belong; without an effect it is the model given, bit for bit.
    pub fn extend(&self, model: &MachineModel) -> MachineModel {
        if self.effects.is_empty() {
            return model.clone();
        }
        let fitted: Vec<f64> = self.rough.iter().map(|(_, _, fitted)| *fitted).collect();
        let mut extended = Machine::new(model).with_rough(&fitted);
        for finding in &self.effects {
            let mut block = EffectBlock::from(finding.effect.clone());
            block.interval_95.clone_from(&finding.interval_95);
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
            if let (Some([before, after]), Some((floor, _))) = (self.holdout_rms, self.noise_floor)
            {
                evidence.push(("holdout-rms-before".to_owned(), Annotation::Number(before)));
                evidence.push(("holdout-rms-after".to_owned(), Annotation::Number(after)));
                evidence.push(("noise-floor".to_owned(), Annotation::Number(floor)));
            }
            block.annotations.push(("evidence".to_owned(), Annotation::Table(evidence)));
            extended.effects_mut().push(block);
        }
        extended
    }
}
