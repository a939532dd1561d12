//! The first dynamic mode of a bundle's signals and the points kept of it.

use fdi_report::DrawnMode;
use reduction::{CompressionError, Dmd, DmdConfig, ModeFigure, Snapshots};

use crate::offline::{
    bundle::{Bundle, BundleError},
    dataset::ReferenceDesign,
};

/// Share of its range by which an extremum of the mode stands out.
const PROMINENCE_RATIO: f64 = 0.05;

/// Draws the first dynamic mode of the incipient signals with the mask's points on it: the
/// FREEDOM paper's figure 5, as a self-contained SVG that reads without colour.
///
/// # Errors
///
/// [`BundleError`] without an incipient dataset, or when it has no dynamic modes.
pub fn mode_figure_svg(bundle: &Bundle) -> Result<String, BundleError> {
    let dataset = bundle.dataset(ReferenceDesign::Incipient).ok_or(BundleError::NoIncipient)?;
    let snapshots = Snapshots::from_columns(&dataset.signals_a)?;
    let dmd = Dmd::fit(&snapshots, &DmdConfig::default()).map_err(CompressionError::from)?;
    let mode = dmd.real_modes().column(0).to_vec();
    let figure = ModeFigure::new(mode.clone(), bundle.mask.clone(), PROMINENCE_RATIO);
    Ok(fdi_report::mode_figure_svg(&DrawnMode {
        test: bundle.experiment.name.clone(),
        rate_hz: bundle.experiment.filter.output_hz,
        mode,
        points: bundle.mask.clone(),
        mean_distance: figure.mean_distance_to_extremum(),
        mean_distance_by_chance: figure.mean_distance_by_chance(),
        extrema: figure.extrema,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::offline::embedded::EMBEDDED_BUNDLES;

    #[test]
    fn the_drawing_has_every_point_of_the_mask() {
        for embedded in EMBEDDED_BUNDLES {
            let bundle = Bundle::from_bytes(embedded.bytes).unwrap();
            let svg = mode_figure_svg(&bundle).unwrap();
            assert_eq!(svg.matches("<circle class=\"point\"").count(), 30);
            assert_eq!(bundle.mask.len(), 30);
            assert!(svg.contains("class=\"extremum\""));
            assert_eq!(svg, mode_figure_svg(&bundle).unwrap());
        }
    }
}
