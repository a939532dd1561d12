//! Drawing of an evaluation: which faults are detected.

use crate::{
    document::{DetectionPoint, Evaluation, FaultEvaluation},
    figure::drawing::{Axis, Plane, opening, push_curve, push_text},
};

/// Probability of detection against the level, one curve a fault; `None` where it was not
/// evaluated.
pub fn detection_figure_svg(evaluation: &Evaluation) -> Option<String> {
    let faults: Vec<&FaultEvaluation> = evaluation
        .methods
        .iter()
        .flat_map(|method| &method.faults)
        .filter(|fault| !fault.detection.is_empty())
        .collect();
    let levels = || faults.iter().flat_map(|fault| &fault.detection).map(|point| point.level);
    let most = levels().fold(0.0, f64::max);
    if most <= 0.0 {
        return None;
    }
    let plane =
        Plane { x: Axis::linear([0.0, most]), y: Axis::linear([0.0, 1.02]), frame: frame(0.0) };
    let width = PANEL_WIDTH + LEGEND_WIDTH;
    let settings = &evaluation.settings;
    let title = format!(
        "Probability of detection, phases at {} Hz with {} A of noise",
        settings.phase_rate_hz, settings.sensor_noise_a
    );
    let mut svg = opening(width, HEIGHT, &title);
    push_text(&mut svg, [16.0, 26.0], "font-size=\"15\"", &title);
    plane.push_axes(&mut svg, "level, 1", "detected, share of the recordings");
    for (place, fault) in faults.iter().enumerate() {
        let at = |point: &DetectionPoint| plane.at(point.level, point.detected_frac);
        push_curve(&mut svg, place, &fault.detection.iter().map(at).collect::<Vec<_>>());
    }
    let names: Vec<String> = faults.iter().map(|fault| fault.id.to_string()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    push_legend(&mut svg, width - LEGEND_WIDTH + 8.0, &names);
    svg.push_str("</svg>\n");
    Some(svg)
}

/// Height of a drawing, px.
const HEIGHT: f64 = 420.0;
/// Width of a panel, px.
const PANEL_WIDTH: f64 = 460.0;
/// Room for the legend, px.
const LEGEND_WIDTH: f64 = 150.0;
/// Left, top, right and bottom margins of a panel, px.
const MARGINS: [f64; 4] = [76.0, 44.0, 16.0, 60.0];

/// The frame of the panel that begins at `left`.
fn frame(left: f64) -> [f64; 4] {
    let [before, top, after, bottom] = MARGINS;
    [left + before, top, left + PANEL_WIDTH - after, HEIGHT - bottom]
}

fn push_legend(svg: &mut String, x: f64, names: &[&str]) {
    for (place, name) in names.iter().enumerate() {
        let y = MARGINS[1] + 14.0 + 22.0 * place as f64;
        push_curve(svg, place, &[[x, y], [x + 34.0, y]]);
        push_text(svg, [x + 42.0, y + 4.5], "", name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{convergence::tests::evaluation, drawing::tests::assert_tags_match};

    #[test]
    fn the_drawing_is_well_formed() {
        let mut evaluation = evaluation();
        assert_tags_match(&detection_figure_svg(&evaluation).unwrap());
        evaluation.methods[0].faults.clear();
        assert_eq!(detection_figure_svg(&evaluation), None);
    }
}
