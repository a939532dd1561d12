//! One recording with all that its signal chain shows.

use super::{
    SignalChannel, SignalCheck, SignalCode, SignalEquation, SignalFault,
    balance::Balance,
    channels::{Plateau, Steps, jump, plateaus, range},
    correction::Correction,
    equations,
    inputs::Inputs,
    law::Law,
    view::View,
};
use crate::{error::GreyboxError, machine::Machine, record::Record};

/// Part of the controller's limit within which a level is that limit.
const AT_LIMIT: f64 = 0.02;
/// Part of its level that a cut signal would have gone beyond it, at least.
const LEAST_CUT: f64 = 0.02;
/// Drive over the largest recorded one that a controller without a limit is taken to have.
const NO_LIMIT: f64 = 3.0;

/// A recording, judged.
#[derive(Debug)]
pub(super) struct Recorded {
    pub(super) name: String,
    pub(super) check: SignalCheck,
    pub(super) faults: Vec<SignalFault>,
}

impl Recorded {
    pub(super) fn new(machine: &Machine, record: &Record) -> Result<Self, GreyboxError> {
        let view = View::of(machine, record);
        let law = view.map_or(Ok(None), |view| Law::of(machine, view))?;
        let balance = view.and_then(|view| Balance::of(machine, &view));
        let drive_steps = Steps::of(&record.drive);
        let levels = plateaus(&record.drive);
        let late = law.as_ref().map(Law::drive_late);
        let inputs = law.as_ref().zip(view).and_then(|(law, view)| {
            Inputs::of(&law.residual(), &record.drive, record.rate_hz, view.kept())
        });
        let check = SignalCheck {
            record: record.name.clone(),
            law_left: law.as_ref().map(|law| law.likeness.left),
            law_gain: law.as_ref().map(|law| law.likeness.gain),
            law_offset: law.as_ref().map(|law| law.likeness.offset),
            drive_late_s: late.map(|late| late.late_s),
            balance_left: balance.as_ref().map(Balance::left),
            inertia_ratio: balance.as_ref().and_then(|balance| balance.inertia_ratio),
            drive_step: drive_steps.map(|steps| steps.size),
            position_step: record.position.as_deref().and_then(Steps::of).map(|steps| steps.size),
            saturated_share: levels.iter().map(|level| level.share).sum(),
            inputs_s: inputs.as_ref().map_or(0.0, |inputs| inputs.lasting_s),
        };
        let judged = Judged { machine, record, law, balance };
        let mut faults: Vec<SignalFault> = Vec::new();
        faults.extend(judged.gap());
        faults.extend(levels.iter().find_map(|level| judged.cut(level)));
        faults.extend(drive_steps.filter(Steps::are_coarse).map(|steps| judged.coarse(&steps)));
        // a signal that is no longer what it was fails the equations too
        if faults.is_empty() {
            match inputs {
                Some(inputs) => faults.push(judged.inputs(inputs)),
                None => faults.extend(equations::fault(&judged)?),
            }
        }
        Ok(Self { name: record.name.clone(), check, faults })
    }
}

/// A recording with its equations.
pub(super) struct Judged<'a> {
    pub(super) machine: &'a Machine,
    pub(super) record: &'a Record,
    pub(super) law: Option<Law<'a>>,
    pub(super) balance: Option<Balance>,
}

impl Judged<'_> {
    /// A fault without a correction.
    pub(super) fn fault(
        &self,
        code: SignalCode,
        equation: SignalEquation,
        channel: Option<SignalChannel>,
        (value, unit): (f64, &'static str),
        told: &str,
    ) -> SignalFault {
        SignalFault {
            code,
            equation,
            record: self.record.name.clone(),
            channel,
            value,
            unit,
            told: format!("{}: {told}", self.record.name),
            corrected: false,
            correction: None,
        }
    }

    /// Name and unit of the drive signal, as sentences have them.
    pub(super) fn drive(&self) -> (&'static str, &'static str) {
        if self.machine.drive_unit() == "v" { ("voltage", "V") } else { ("current", "A") }
    }

    /// Samples that are missing.
    fn gap(&self) -> Option<SignalFault> {
        let position = self.record.position.as_deref()?;
        let [least, most] = range(&self.record.drive);
        let largest = most.abs().max(least.abs());
        let limit = self.machine.drive_limit();
        let drive = if limit < f64::MAX { limit.max(largest) } else { NO_LIMIT * largest };
        let acceleration = self.machine.constant() * drive / self.machine.inertia();
        let jump = jump(position, self.record.rate_hz, acceleration)?;
        let time_s = jump.sample as f64 / self.record.rate_hz;
        let size = (jump.size, if self.machine.is_linear() { "m" } else { "rad" });
        let told = format!(
            "the position jumps by {:.4} {} at {time_s:.3} s, as no motor moves it: samples are \
             missing there",
            size.0, size.1
        );
        let (code, equation) = (SignalCode::Gap, SignalEquation::Samples);
        Some(self.fault(code, equation, Some(SignalChannel::Position), size, &told))
    }

    /// A level at which the log cuts the signal: controller or motion asked for more.
    fn cut(&self, plateau: &Plateau) -> Option<SignalFault> {
        let level = plateau.level;
        let is_limit = (level.abs() / self.machine.drive_limit() - 1.0).abs() < AT_LIMIT;
        if is_limit {
            return None;
        }
        let of_law = self.law.as_ref().and_then(|law| {
            (law.likeness.left < equations::FITS).then(|| beyond(plateau, &law.replay))
        });
        let is_cut = match of_law {
            Some(beyond) => beyond > LEAST_CUT,
            None => plateau.is_alone && plateau.runs.len() > 1,
        };
        let (name, unit) = self.drive();
        let percent = 100.0 * plateau.share;
        let told = format!(
            "{percent:.1} % of the samples stand at {level} {unit}, a level that the machine did not \
             have: the {name} is cut"
        );
        let size = (level, self.machine.drive_unit());
        let (code, equation) = (SignalCode::Saturated, SignalEquation::Samples);
        is_cut.then(|| self.fault(code, equation, Some(SignalChannel::Drive), size, &told))
    }

    /// Steps that are too coarse.
    fn coarse(&self, steps: &Steps) -> SignalFault {
        let (name, unit) = self.drive();
        let told = format!(
            "the {name} has steps of {:.4} {unit}, {:.0} in its whole range: too coarse to tell \
             causes apart",
            steps.size, steps.levels
        );
        let size = (steps.size, self.machine.drive_unit());
        let (code, equation) = (SignalCode::Quantised, SignalEquation::Samples);
        self.fault(code, equation, Some(SignalChannel::Drive), size, &told)
    }

    /// Inputs behind the controller, or a drive that is switched off.
    fn inputs(&self, inputs: Inputs) -> SignalFault {
        let (name, unit) = self.drive();
        let (code, told) = if inputs.is_off {
            let told = format!(
                "the {name} is off for {:.2} s in which the controller asks for some: the drive is \
                 disabled there",
                inputs.lasting_s
            );
            (SignalCode::Disabled, told)
        } else {
            let told = format!(
                "for {:.2} s the {name} differs from what the controller makes of command and \
                 position by up to {:.3} {unit}: inputs come in behind the controller",
                inputs.lasting_s, inputs.largest
            );
            (SignalCode::Disturbed, told)
        };
        let size = (inputs.largest, self.machine.drive_unit());
        let equation = SignalEquation::Controller;
        let mut fault = self.fault(code, equation, Some(SignalChannel::Drive), size, &told);
        let torque_per_drive = self.machine.constant();
        fault.correction = Some(Correction::Inputs { values: inputs.values, torque_per_drive });
        fault
    }
}

/// By how much a signal goes beyond a plateau while the recorded one stands there, over its
/// level.
fn beyond(plateau: &Plateau, signal: &[f64]) -> f64 {
    let sign = plateau.level.signum();
    let samples = plateau.runs.iter().flat_map(|run| run.from..run.to);
    let over: Vec<f64> = samples.map(|n| sign * (signal[n] - plateau.level)).collect();
    over.iter().sum::<f64>() / over.len().max(1) as f64 / plateau.level.abs()
}
