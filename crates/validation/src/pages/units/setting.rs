//! Machines, seeds and columns that the parts of the page share.

use anyhow::Result;
use experiments::{BoundCase, HiddenDamage, UnitsLine, unit_bounds};
use fdi_core::{Bundle, Diagnoser, EMBEDDED_BUNDLES};

/// Machines of a line, and of those the ones that are diagnosed as their model file's too.
pub(super) const MACHINES: usize = 1000;
pub(super) const TWINS: usize = 100;
/// Root seed of the hidden machines; development used others.
pub(super) const SEED: u64 = 20_261_123;
/// Root seed of what the bundles learn.
pub(super) const BUNDLE_SEED: u64 = 20_231;
/// Threads.
pub(super) const JOBS: usize = 2;
/// Names of the columns of faults.
pub(super) const FAULTS: [&str; 6] = ["k1", "k2", "k3", "k4", "k5", "k6"];

/// The diagnosis with the bundle of the embedded chirp.
pub(super) fn embedded() -> Result<Diagnoser> {
    Ok(Diagnoser::new(Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?)?)
}

/// A line at a share of the tolerances.
pub(super) fn line(scale: f64, damage: HiddenDamage) -> UnitsLine {
    UnitsLine {
        scale,
        damage,
        misstated: 1.0,
        any_start: false,
        as_built: true,
        machines: MACHINES,
        twins: TWINS,
    }
}

/// Share in percent; none of nothing.
pub(crate) fn percent(part: usize, of: usize) -> f64 {
    100.0 * part as f64 / of.max(1) as f64
}

/// Cramér-Rao bounds without and with the error of the low-fidelity model as noise.
pub(super) type Bounds = [[f64; 6]; 2];

/// Bounds of a case.
pub(super) fn both_bounds(bundle: &Bundle, case: BoundCase) -> Result<Bounds> {
    let with_model_error = BoundCase { with_model_error: true, ..case };
    Ok([unit_bounds(bundle, &case, JOBS)?, unit_bounds(bundle, &with_model_error, JOBS)?])
}

/// Standard deviations in thousandths, over each of the bounds.
pub(super) fn beside(stds: [f64; 6], [plain, with_error]: &Bounds) -> String {
    let cells = stds.iter().zip(plain).zip(with_error).map(|((std, plain), with_error)| {
        format!("{:.2} ({:.2}, {:.2})", 1e3 * std, std / plain, std / with_error)
    });
    cells.collect::<Vec<_>>().join(" | ")
}
