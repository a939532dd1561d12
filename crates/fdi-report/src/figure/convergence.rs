//! Drawing of an evaluation: how the searches converge.

use crate::{
    document::{ConvergencePoint, Evaluation, FaultEvaluation, MethodEvaluation, Quartiles},
    figure::drawing::{Axis, Plane, STROKES, opening, path, push, push_curve, push_text},
};

/// Width of a column of panels and height of a row, px.
const COLUMN: f64 = 480.0;
const ROW: f64 = 172.0;
/// Room for title and legend, and for the labels of the last row, px.
const TOP: f64 = 62.0;
const BOTTOM: f64 = 42.0;
/// Margins of a panel: left, top, right and bottom, px.
const MARGINS: [f64; 4] = [84.0, 10.0, 14.0, 26.0];
/// Places of the legend, px.
const LEGEND: f64 = 128.0;
/// Share of percentage errors below which they are drawn as this, so that a logarithm exists.
const LEAST_PERCENT: f64 = 1e-3;

/// Least discrepancy reached and the error of each fault at that point, against evaluations and,
/// where times are known, against time, with the middle half of the searches as a band: Figs 6-8
/// of the FREEDOM paper as a self-contained SVG. `None` where nothing was searched.
pub fn convergence_figure_svg(evaluation: &Evaluation) -> Option<String> {
    let searched: Vec<&MethodEvaluation> =
        evaluation.methods.iter().filter(|method| !method.convergence.is_empty()).collect();
    let timed = searched.iter().all(|m| m.convergence.iter().all(|p| p.time_s.is_some()));
    let by_count: fn(&ConvergencePoint) -> f64 = |point| point.evaluations as f64;
    let by_time: fn(&ConvergencePoint) -> f64 = |point| point.time_s.unwrap_or(0.0);
    let mut columns = vec![("evaluations of the model", by_count)];
    if timed {
        columns.push(("time, s", by_time));
    }
    let rows = rows(&searched);
    let faults = searched.first().map_or(&[][..], |method| &method.faults);
    let width = COLUMN * columns.len() as f64;
    let height = TOP + ROW * rows.len() as f64 + BOTTOM;
    let title = format!(
        "Protocol “{}”, domain [0, {}]: best point so far, median and middle half of the searches",
        evaluation.protocol, evaluation.settings.largest_level
    );
    let mut svg = opening(width, height, &title);
    push_text(&mut svg, [16.0, 24.0], "font-size=\"15\"", &title);
    for (place, method) in searched.iter().enumerate() {
        let x = 16.0 + LEGEND * place as f64;
        push_curve(&mut svg, place, &[[x, 44.0], [x + 30.0, 44.0]]);
        push_text(&mut svg, [x + 36.0, 48.5], "", &method.method);
    }
    for (row, quantity) in rows.iter().enumerate() {
        let name = quantity.label(faults);
        for (column, (label, abscissa)) in columns.iter().enumerate() {
            let corner = [COLUMN * column as f64, TOP + ROW * row as f64];
            let panel = Panel::of(&searched, *quantity, *abscissa, corner)?;
            let label = if row + 1 == rows.len() { label } else { "" };
            panel.push(&mut svg, &searched, [label, &name]);
        }
    }
    svg.push_str("</svg>\n");
    Some(svg)
}

/// Quantity that a row of panels shows.
#[derive(Clone, Copy)]
enum Quantity {
    Discrepancy,
    /// Percentage error of the fault at this place.
    Error(usize),
}

impl Quantity {
    fn label(self, faults: &[FaultEvaluation]) -> String {
        let name = |place: usize| faults.get(place).map_or("k".to_owned(), |f| f.id.to_string());
        match self {
            Self::Discrepancy => "δ, A".to_owned(),
            Self::Error(place) => format!("e({}), %", name(place)),
        }
    }

    fn of(self, point: &ConvergencePoint) -> Option<Quartiles> {
        match self {
            Self::Discrepancy => Some(point.discrepancy),
            Self::Error(fault) => point.errors_percent.get(fault).map(|e| Quartiles {
                median: e.median.max(LEAST_PERCENT),
                p25: e.p25.max(LEAST_PERCENT),
                p75: e.p75.max(LEAST_PERCENT),
                max: e.max,
            }),
        }
    }
}

/// The discrepancy, and each fault whose errors are known.
fn rows(methods: &[&MethodEvaluation]) -> Vec<Quantity> {
    let points = methods.iter().flat_map(|method| &method.convergence);
    let faults = points.map(|point| point.errors_percent.len()).max().unwrap_or(0);
    core::iter::once(Quantity::Discrepancy).chain((0..faults).map(Quantity::Error)).collect()
}

/// A quantity over evaluations or time.
struct Panel {
    plane: Plane,
    quantity: Quantity,
    abscissa: fn(&ConvergencePoint) -> f64,
}

impl Panel {
    fn of(
        methods: &[&MethodEvaluation],
        quantity: Quantity,
        abscissa: fn(&ConvergencePoint) -> f64,
        [left, top]: [f64; 2],
    ) -> Option<Self> {
        let points = || methods.iter().flat_map(|method| &method.convergence);
        let x = Axis::decades(points().map(abscissa))?;
        let shown = points().filter_map(|point| quantity.of(point));
        let y = Axis::decades(shown.flat_map(|q| [q.p25, q.p75]))?;
        let [before, above, after, below] = MARGINS;
        let frame = [left + before, top + above, left + COLUMN - after, top + ROW - below];
        Some(Self { plane: Plane { x, y, frame }, quantity, abscissa })
    }

    fn push(&self, svg: &mut String, methods: &[&MethodEvaluation], labels: [&str; 2]) {
        let Self { plane, quantity, abscissa } = self;
        plane.push_axes(svg, labels[0], labels[1]);
        for (place, method) in methods.iter().enumerate() {
            let line = |pick: fn(&Quartiles) -> f64| -> Vec<[f64; 2]> {
                let points = method.convergence.iter();
                let shown = points.filter_map(|p| Some((abscissa(p), quantity.of(p)?)));
                shown.map(|(x, quartiles)| plane.at(x, pick(&quartiles))).collect()
            };
            let mut band = line(|q| q.p25);
            if band.is_empty() {
                continue;
            }
            band.extend(line(|q| q.p75).into_iter().rev());
            let (colour, _) = STROKES[place % STROKES.len()];
            push(
                svg,
                &format!(
                    "<polygon points=\"{}\" fill=\"{colour}\" fill-opacity=\"0.13\"/>",
                    path(&band)
                ),
            );
            push_curve(svg, place, &line(|q| q.median));
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::{
        document::{
            DetectionPoint, Evaluation, EvaluationSettings, FaultEvaluation, FaultId, Quartiles,
        },
        figure::drawing::tests::assert_tags_match,
    };

    pub(crate) fn evaluation() -> Evaluation {
        let point = |evaluations: u64, median: f64| ConvergencePoint {
            evaluations,
            time_s: Some(1e-3 * evaluations as f64),
            discrepancy: Quartiles { median, p25: 0.5 * median, p75: 2.0 * median, max: 9.0 },
            errors_percent: vec![Quartiles { median: 50.0, p25: 0.0, p75: 80.0, max: 9e2 }],
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
        // discrepancy and one fault, each against evaluations and time
        assert_eq!(convergence.matches("<polygon").count(), 4);
        assert!(convergence.contains("a&lt;b") && convergence.contains("time, s"));
        assert!(convergence.contains("e(k1), %") && convergence.contains("domain [0, 1]"));
        for point in &mut evaluation.methods[0].convergence {
            point.time_s = None;
        }
        let untimed = convergence_figure_svg(&evaluation).unwrap();
        assert_eq!(untimed.matches("<polygon").count(), 2);
        assert!(!untimed.contains("time, s"));
        evaluation.methods[0].convergence.clear();
        assert_eq!(convergence_figure_svg(&evaluation), None);
    }
}
