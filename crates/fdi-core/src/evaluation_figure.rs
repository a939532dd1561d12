//! Drawings of an evaluation: how the searches converge, and which faults are detected.

use crate::{
    drawing::{opening, push, push_line, push_text, ticks},
    report::{ConvergencePoint, DetectionPoint, Evaluation, FaultEvaluation, MethodEvaluation},
};

/// Colours that are told apart by every kind of colour vision (Okabe and Ito, 2008), each with a
/// dash of its own, so that they are told apart in grey too.
const STROKES: [(&str, &str); 8] = [
    ("#000000", ""),
    ("#0072b2", "7 3"),
    ("#d55e00", "2 3"),
    ("#009e73", "10 3 2 3"),
    ("#cc79a7", "5 5"),
    ("#56b4e9", "1 2"),
    ("#e69f00", "12 4"),
    ("#777777", "4 2 1 2"),
];

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
    let plane = Plane { x: Axis::linear([0.0, most]), y: Axis::linear([0.0, 1.02]), left: 0.0 };
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

/// A scale of a drawing.
#[derive(Clone, Copy)]
struct Axis {
    range: [f64; 2],
    logarithmic: bool,
}

impl Axis {
    fn linear(range: [f64; 2]) -> Self {
        Self { range, logarithmic: false }
    }

    /// Whole decades around positive values; `None` without any.
    fn decades(values: impl Iterator<Item = f64>) -> Option<Self> {
        let positive = values.filter(|value| *value > 0.0 && value.is_finite());
        let (low, high) = positive
            .fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
        let range = [low.log10().floor(), high.log10().ceil()];
        let range = if range[0] == range[1] { [range[0], range[0] + 1.0] } else { range };
        (high > 0.0).then_some(Self { range, logarithmic: true })
    }

    /// Place of a value, 0 to 1.
    fn share(self, value: f64) -> f64 {
        let [low, high] = self.range;
        let value = if self.logarithmic { value.max(f64::MIN_POSITIVE).log10() } else { value };
        ((value - low) / (high - low)).clamp(0.0, 1.0)
    }

    /// Places with their labels.
    fn ticks(self) -> Vec<(f64, String)> {
        if !self.logarithmic {
            return ticks(self.range);
        }
        (self.range[0] as i32..=self.range[1] as i32)
            .map(|power| {
                let value = 10f64.powi(power);
                let label = if (-3..=4).contains(&power) {
                    value.to_string()
                } else {
                    format!("1e{power}").replace('-', "−")
                };
                (value, label)
            })
            .collect()
    }
}

/// Where values lie on a drawing.
struct Plane {
    x: Axis,
    y: Axis,
    left: f64,
}

impl Plane {
    fn at(&self, x: f64, y: f64) -> [f64; 2] {
        let [left, top, right, bottom] = MARGINS;
        [
            self.left + left + (PANEL_WIDTH - left - right) * self.x.share(x),
            HEIGHT - bottom - (HEIGHT - top - bottom) * self.y.share(y),
        ]
    }

    fn push_axes(&self, svg: &mut String, x_label: &str, y_label: &str) {
        let [left, top, right, bottom] = MARGINS;
        let (x0, x1) = (self.left + left, self.left + PANEL_WIDTH - right);
        let (y0, y1) = (HEIGHT - bottom, top);
        for (value, label) in self.x.ticks() {
            let x = x0 + (x1 - x0) * self.x.share(value);
            push_line(svg, [x, y0], [x, y1], "#ddd");
            push_text(svg, [x, y0 + 18.0], "text-anchor=\"middle\"", &label);
        }
        for (value, label) in self.y.ticks() {
            let y = y0 + (y1 - y0) * self.y.share(value);
            push_line(svg, [x0, y], [x1, y], "#ddd");
            push_text(svg, [x0 - 8.0, y + 4.5], "text-anchor=\"end\"", &label);
        }
        push_line(svg, [x0, y0], [x1, y0], "#222");
        push_line(svg, [x0, y0], [x0, y1], "#222");
        let middle = f64::midpoint(x0, x1);
        push_text(svg, [middle, y0 + 40.0], "text-anchor=\"middle\"", x_label);
        let (x, y) = (self.left + 16.0, f64::midpoint(y0, y1));
        let turned = format!("text-anchor=\"middle\" transform=\"rotate(-90 {x:.1} {y:.1})\"");
        push_text(svg, [x, y], &turned, y_label);
    }
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
        let plane = Plane { x: self.x, y: self.y, left };
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

fn path(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// A curve in the stroke of its place; a single point is drawn as one.
fn push_curve(svg: &mut String, place: usize, points: &[[f64; 2]]) {
    let (colour, dash) = STROKES[place % STROKES.len()];
    if let [[x, y]] = points {
        push(svg, &format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/>"));
        return;
    }
    push(
        svg,
        &format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" \
             stroke-dasharray=\"{dash}\"/>",
            path(points)
        ),
    );
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
        drawing::tests::assert_tags_match,
        report::{EvaluationSettings, FaultId, Quartiles},
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

    #[test]
    fn decades_hold_all_values() {
        let axis = Axis::decades([0.0, 0.02, 3.0].into_iter()).unwrap();
        assert_eq!(axis.range, [-2.0, 1.0]);
        assert!(Axis::decades([0.0].into_iter()).is_none());
    }
}
