//! Drawings of an evaluation: how the searches converge, and which faults are detected.

use crate::{
    document::{ConvergencePoint, DetectionPoint, Evaluation, FaultEvaluation, MethodEvaluation},
    figure::drawing::{Axis, Plane, STROKES, opening, path, push, push_curve, push_text},
};

/// Least discrepancy reached against evaluations and, where times are known, against time, with
/// the middle half of the searches as a band: Figs 6-8 of the FREEDOM paper as a self-contained
/// SVG. `None` where nothing was searched.
pub fn convergence_figure_svg(evaluation: &Evaluation) -> Option<String> {
    let searched: Vec<&MethodEvaluation> =
        evaluation.methods.iter().filter(|method| !method.convergence.is_empty()).collect();
    let timed = searched.iter().all(|m| m.convergence.iter().all(|p| p.time_s.is_some()));
    let by_count: fn(&ConvergencePoint) -> f64 = |point| point.evaluations as f64;
    let by_time: fn(&ConvergencePoint) -> f64 = |point| point.time_s.unwrap_or(0.0);
    let mut panels = vec![Panel::of(&searched, "evaluations of the monitor", by_count)?];
    if timed {
        panels.extend(Panel::of(&searched, "time, s", by_time));
    }
    let width = PANEL_WIDTH * panels.len() as f64 + LEGEND_WIDTH;
    let title = format!(
        "Protocol “{}”: least discrepancy on the mask, median and middle half of the searches",
        evaluation.protocol
    );
    let mut svg = opening(width, HEIGHT, &title);
    push_text(&mut svg, [16.0, 26.0], "font-size=\"15\"", &title);
    for (place, panel) in panels.iter().enumerate() {
        panel.push(&mut svg, PANEL_WIDTH * place as f64, &searched);
    }
    let names: Vec<&str> = searched.iter().map(|method| method.method.as_str()).collect();
    push_legend(&mut svg, width - LEGEND_WIDTH + 8.0, &names);
    svg.push_str("</svg>\n");
    Some(svg)
}

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

/// One scale of evaluations or time, with the discrepancies over it.
struct Panel {
    x: Axis,
    y: Axis,
    label: &'static str,
    abscissa: fn(&ConvergencePoint) -> f64,
}

impl Panel {
    fn of(
        methods: &[&MethodEvaluation],
        label: &'static str,
        abscissa: fn(&ConvergencePoint) -> f64,
    ) -> Option<Self> {
        let points = || methods.iter().flat_map(|method| &method.convergence);
        let x = Axis::decades(points().map(abscissa))?;
        let y = Axis::decades(points().flat_map(|p| [p.discrepancy.p25, p.discrepancy.p75]))?;
        Some(Self { x, y, label, abscissa })
    }

    fn push(&self, svg: &mut String, left: f64, methods: &[&MethodEvaluation]) {
        let plane = Plane { x: self.x, y: self.y, frame: frame(left) };
        plane.push_axes(svg, self.label, "discrepancy δ, A");
        for (place, method) in methods.iter().enumerate() {
            let points = &method.convergence;
            let line = |pick: fn(&ConvergencePoint) -> f64| -> Vec<[f64; 2]> {
                points.iter().map(|p| plane.at((self.abscissa)(p), pick(p))).collect()
            };
            let mut band = line(|point| point.discrepancy.p25);
            band.extend(line(|point| point.discrepancy.p75).into_iter().rev());
            let (colour, _) = STROKES[place % STROKES.len()];
            push(
                svg,
                &format!(
                    "<polygon points=\"{}\" fill=\"{colour}\" fill-opacity=\"0.13\"/>",
                    path(&band)
                ),
            );
            push_curve(svg, place, &line(|point| point.discrepancy.median));
        }
    }
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
    use crate::{
        document::{EvaluationSettings, FaultId, Quartiles},
        figure::drawing::tests::assert_tags_match,
    };

    fn evaluation() -> Evaluation {
        let point = |evaluations: u64, median: f64| ConvergencePoint {
            evaluations,
            time_s: Some(1e-3 * evaluations as f64),
            discrepancy: Quartiles { median, p25: 0.5 * median, p75: 2.0 * median, max: 9.0 },
        };
        let detection = |level: f64| DetectionPoint {
            level,
            conditions: 10,
            detected_frac: (level * 40.0).min(1.0),
        };
        let mut fault = FaultEvaluation::of(FaultId::K1);
        fault.detection = vec![detection(0.01), detection(0.03)];
        let method = MethodEvaluation {
            method: "a<b".into(),
            average_percent: 1.0,
            predicted_percent: None,
            evaluations_median: 4.0,
            discrepancy_median: None,
            model_time_s: None,
            wall_time_s: None,
            wall_time_min_s: None,
            coverage_95: None,
            healthy: None,
            convergence: vec![point(1, 0.5), point(4, 0.002)],
            faults: vec![fault],
        };
        Evaluation {
            schema_version: 1,
            protocol: "low".into(),
            conditions: 3,
            seed: 0,
            settings: EvaluationSettings {
                controller_noise: false,
                digitisation: false,
                sensor_noise_a: 0.02,
                phase_rate_hz: 10e3,
                envelope_rate_hz: 2e3,
                snapshots: 100,
                sparse_snapshots: 0,
                largest_level: 1.0,
            },
            methods: vec![method],
        }
    }

    #[test]
    fn drawings_are_well_formed() {
        let mut evaluation = evaluation();
        let convergence = convergence_figure_svg(&evaluation).unwrap();
        assert_tags_match(&convergence);
        assert_eq!(convergence.matches("<polygon").count(), 2);
        assert!(convergence.contains("a&lt;b") && convergence.contains("time, s"));
        assert_tags_match(&detection_figure_svg(&evaluation).unwrap());
        evaluation.methods[0].convergence.clear();
        evaluation.methods[0].faults.clear();
        assert_eq!(convergence_figure_svg(&evaluation), None);
        assert_eq!(detection_figure_svg(&evaluation), None);
    }
}
