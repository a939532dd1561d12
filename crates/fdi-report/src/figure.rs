//! Drawings as self-contained SVG, one file a kind of answer.

mod compression;
mod convergence;
mod diagnosis;
mod drawing;
mod evaluation;
mod explanation;
mod identifiability;
mod mode;

pub use compression::{CompressionCurve, CompressionPanel, compression_figure_svg};
pub use convergence::convergence_figure_svg;
pub use diagnosis::{fault_figure_svg, fit_figure_svg, search_figure_svg, trend_figure_svg};
pub use evaluation::detection_figure_svg;
pub(crate) use explanation::four_digits;
pub use explanation::{
    fault_change_figure_svg, held_out_figure_svg, residual_curve_figure_svg,
    residual_curves_figure_svg,
};
pub use identifiability::identifiability_figure_svg;
pub use mode::{DrawnMode, mode_figure_svg};
