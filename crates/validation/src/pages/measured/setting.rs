//! Settings that all sets of the page share.

use anyhow::{Result, bail};
use ema_sim::model_file::{AxisModel, MachineModel};

/// Threads.
pub(super) const JOBS: usize = 2;

/// The axis that a model file describes.
pub(super) fn axis(model: MachineModel) -> Result<AxisModel> {
    match model {
        MachineModel::ServoAxis(model) => Ok(model),
        MachineModel::Actuator(_) => bail!("a servo axis"),
    }
}
