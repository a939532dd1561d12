//! One recording with all that its signal chain shows.

use super::{
    balance::Balance,
    channels::{Steps, plateaus},
    equations,
    fault::{SignalCheck, SignalFault},
    inputs::Inputs,
    judged::Judged,
    law::Law,
    view::View,
};
use crate::{error::GreyboxError, machine::Machine, record::Record};

/// A recording, judged.
#[derive(Debug)]
pub(super) struct Recorded {
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
        Ok(Self { check, faults })
    }
}
