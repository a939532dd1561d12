//! Residuals of recordings that were not fitted, where some effects have another size in each.

use inference::Whitener;
use nalgebra::DVector;

use crate::{
    error::GreyboxError,
    gram::{Gram, solve},
    problem::{PerRecord, Problem},
    structure::{Structure, set},
};

/// Residuals with what differs between recordings fitted to each by least squares, linearly.
pub(crate) fn elsewhere(
    problem: &Problem<'_>,
    structure: &Structure,
    values: &[f64],
    whitener: &Whitener,
) -> Result<PerRecord, GreyboxError> {
    Ok(drive_and_residuals(problem, structure, values, whitener)?.1)
}

/// Drive signals without what differs between recordings, and the residuals of [`elsewhere`].
pub(crate) fn drive_and_residuals(
    problem: &Problem<'_>,
    structure: &Structure,
    values: &[f64],
    whitener: &Whitener,
) -> Result<(PerRecord, PerRecord), GreyboxError> {
    let state = structure.state_elsewhere(problem.machine, values);
    let mut states = vec![state.clone()];
    for (effect, size) in structure.by_record(values) {
        for place in 0..2 {
            let mut on = state.clone();
            set(&mut on.effects[effect], place, size);
            states.push(on);
        }
    }
    let mut drives = problem.drives(&states)?;
    let mut residuals = problem.residuals(&drives[0]);
    for (record, residual) in residuals.iter_mut().enumerate() {
        let changes: Vec<Vec<f64>> = drives[1..]
            .iter()
            .map(|on| on[record].iter().zip(&drives[0][record]).map(|(a, b)| a - b).collect())
            .collect();
        if changes.is_empty() {
            break;
        }
        let mut columns: Vec<Vec<f64>> = changes.iter().map(|c| whitener.apply(c)).collect();
        columns.push(whitener.apply(residual));
        let (gram, target) = (Gram::new(&columns), changes.len());
        let by: Vec<usize> = (0..target).collect();
        let right = DVector::from_iterator(target, by.iter().map(|&i| gram.get(i, target)));
        let sizes = solve(&gram.block(&by), &right);
        for (change, size) in changes.iter().zip(sizes.iter()) {
            for (r, c) in residual.iter_mut().zip(change) {
                *r -= size * c;
            }
        }
    }
    Ok((drives.swap_remove(0), residuals))
}
