//! Drawings of a diagnosis: what was measured and modelled, the levels, the search, the trend.
//!
//! Nothing is told by colour alone: curves differ in dash, marks in shape or filling.

use crate::{
    FitSignals,
    decision::INCIPIENT_LEVEL,
    document::{
        ActuatorTrend, Change, Fault, FaultChange, FaultId, RecordDiagnosis, TrendPoint, Verdict,
    },
    figure::drawing::{
        Axis, Plane, Stroke, around, dashed, opening, push, push_line, push_stroke, push_text,
    },
};

/// Width of a drawing, px.
const WIDTH: f64 = 760.0;
/// Left edge of what the axes enclose, px.
const LEFT: f64 = 78.0;
/// Right edge of the same, px.
const RIGHT: f64 = 744.0;
/// Columns of pixels that a signal is thinned to; a screen shows no more.
const COLUMNS: usize = 666;
/// Standard deviations to either end of a 95 % interval.
const Z_95: f64 = 1.96;
/// A dark curve on a wide grey one, so that both are seen where they coincide.
const MEASURED: Stroke = ("#a0a0a0", 4.5);
const MODELLED: Stroke = ("#000", 1.3);
const RESIDUAL: Stroke = ("#000", 1.0);
/// Colour of conspicuous marks, dark in grey too.
const ALARM: &str = "#b23a00";

/// Measured and modelled envelope over time, below them the residual with the band in which noise
/// and the learnt error of the model leave it (two standard deviations).
pub fn fit_figure_svg(record: &RecordDiagnosis, signals: &FitSignals) -> String {
    let rate_hz = signals.rate_hz;
    let end_s = (signals.measured_a.len().max(2) - 1) as f64 / rate_hz;
    let residual_a = signals.residual_a();
    let x = Axis::linear([0.0, end_s]);
    let both = signals.measured_a.iter().chain(&signals.modelled_a);
    let top = Plane { x, y: around(both.copied()), frame: [LEFT, 58.0, RIGHT, 268.0] };
    let band_a = 2.0 * record.fit.noise_floor_a;
    let shown = residual_a.iter().copied().chain([-1.2 * band_a, 1.2 * band_a]);
    let bottom = Plane { x, y: around(shown), frame: [LEFT, 304.0, RIGHT, 424.0] };
    let mut svg = opening(WIDTH, 470.0, &format!("{}: measured and modelled", record.recording));
    let heading = "Stator current (filtered envelope) over time, and what the model leaves of it";
    push_text(&mut svg, [16.0, 22.0], "font-size=\"15\"", heading);
    top.push_axes(&mut svg, "", "current, A");
    bottom.push_axes(&mut svg, "time from the start of the test, s", "residual, A");
    push_band(&mut svg, &bottom, [-band_a, band_a], [0.0, end_s]);
    push_stroke(&mut svg, MEASURED, &curve(&top, &signals.measured_a, rate_hz));
    push_stroke(&mut svg, MODELLED, &curve(&top, &signals.modelled_a, rate_hz));
    push_stroke(&mut svg, RESIDUAL, &curve(&bottom, &residual_a, rate_hz));
    for (place, at, name) in [(MEASURED, LEFT, "measured"), (MODELLED, LEFT + 130.0, "modelled")] {
        push_stroke(&mut svg, place, &[[at, 42.0], [at + 34.0, 42.0]]);
        push_text(&mut svg, [at + 42.0, 46.5], "", name);
    }
    let at = LEFT + 260.0;
    push(
        &mut svg,
        &format!(
            "<rect x=\"{at:.1}\" y=\"35\" width=\"34\" height=\"14\" fill=\"#ccc\" \
             stroke=\"#888\"/>"
        ),
    );
    let band = format!("explained by noise and learnt error, ±{band_a:.4} A (2 sd)");
    push_text(&mut svg, [at + 42.0, 46.5], "", &band);
    svg.push_str("</svg>\n");
    svg
}

/// The levels k1 to k6 as bars with their 95 % intervals, against the end of the incipient range.
pub fn fault_figure_svg(record: &RecordDiagnosis) -> String {
    const ROW: f64 = 34.0;
    const TOP: f64 = 62.0;
    let shown: Vec<&Fault> = record.faults.iter().filter(|fault| fault.id != FaultId::K7).collect();
    let bottom = TOP + ROW * shown.len() as f64;
    let ends = shown.iter().filter_map(|fault| fault.interval_95.map(|[_, high]| high));
    let most = ends.chain([1.2 * INCIPIENT_LEVEL]).fold(0.0, f64::max).min(1.0);
    let (x, y) = (Axis::linear([0.0, 1.02 * most]), Axis::linear([0.0, 1.0]));
    let plane = Plane { x, y, frame: [200.0, TOP, 520.0, bottom] };
    let title = format!("{}: levels of the faults", record.recording);
    let mut svg = opening(WIDTH, bottom + 52.0, &title);
    let believed = record.verdict != Verdict::ModelInadequate;
    let heading = if believed {
        "Fault levels (0 as new, 1 full damage) with 95 % intervals"
    } else {
        "Fault levels that come nearest; the model does not explain the recording"
    };
    push_text(&mut svg, [16.0, 22.0], "font-size=\"15\"", heading);
    plane.push_x_axis(&mut svg, "level, 1");
    for (row, fault) in shown.iter().enumerate() {
        push_level(&mut svg, &plane, TOP + ROW * (row as f64 + 0.5), fault, believed);
    }
    let [limit, _] = plane.at(INCIPIENT_LEVEL, 0.0);
    push(&mut svg, &dashed([limit, TOP - 6.0], [limit, bottom], "#000"));
    let label = format!("incipient below {INCIPIENT_LEVEL}");
    push_text(&mut svg, [limit, TOP - 12.0], "text-anchor=\"middle\"", &label);
    svg.push_str("</svg>\n");
    svg
}

/// One bar with its interval and its figures.
fn push_level(svg: &mut String, plane: &Plane, y: f64, fault: &Fault, believed: bool) {
    let label = format!("{} {}", fault.id, fault.name);
    push_text(svg, [188.0, y + 4.5], "text-anchor=\"end\"", &label);
    let (Some(value), Some(std), Some([low, high])) = (fault.value, fault.std, fault.interval_95)
    else {
        push_text(svg, [208.0, y + 4.5], "fill=\"#555\"", "not determined");
        return;
    };
    let x = |level: f64| plane.at(level, 0.0)[0];
    let detected = believed && fault.detected == Some(true);
    let (fill, stroke) = if detected { (ALARM, "#5c1e00") } else { ("#e8e8e8", "#555") };
    let (from, wide) = (x(0.0), x(value) - x(0.0));
    push(
        svg,
        &format!(
            "<rect x=\"{from:.1}\" y=\"{:.1}\" width=\"{wide:.1}\" height=\"16\" fill=\"{fill}\" \
             stroke=\"{stroke}\"/>",
            y - 8.0
        ),
    );
    // a line that is seen on the bar and beside it
    for (stroke, width) in [("#fff", 5.0), ("#000", 2.0)] {
        let (low, high) = (x(low), x(high));
        push(
            svg,
            &format!(
                "<path d=\"M{low:.1} {:.1}v8M{low:.1} {y:.1}H{high:.1}M{high:.1} {:.1}v8\" \
                 fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\"/>",
                y - 4.0,
                y - 4.0
            ),
        );
    }
    let (weight, word) = if detected { ("bold", ", detected") } else { ("normal", "") };
    let attributes = format!("font-weight=\"{weight}\"");
    push_text(svg, [540.0, y + 4.5], &attributes, &format!("{value:.4} ± {std:.4}{word}"));
}

/// Least residual reached over the evaluations of the monitor, against what noise and learnt error
/// explain. `None` where nothing was searched.
pub fn search_figure_svg(record: &RecordDiagnosis, signals: &FitSignals) -> Option<String> {
    let mut least = f64::INFINITY;
    let reached: Vec<f64> = signals
        .searched_rms_a
        .iter()
        .map(|&rms_a| {
            least = least.min(rms_a);
            least
        })
        .collect();
    let floor_a = record.fit.noise_floor_a;
    let x = Axis::decades((1..=reached.len()).map(|count| count as f64))?;
    let y = Axis::decades(reached.iter().copied().chain([floor_a]))?;
    let plane = Plane { x, y, frame: [LEFT, 44.0, 540.0, 284.0] };
    let title = format!("{}: convergence of the search", record.recording);
    let mut svg = opening(WIDTH, 340.0, &title);
    push_text(&mut svg, [16.0, 22.0], "font-size=\"15\"", "Convergence of the search");
    plane.push_axes(&mut svg, "evaluations of the model", "least residual, A rms");
    let points: Vec<[f64; 2]> =
        reached.iter().enumerate().map(|(i, &rms_a)| plane.at((i + 1) as f64, rms_a)).collect();
    push_stroke(&mut svg, ("#000", 2.0), &points);
    let [from, level] = plane.at(1.0, floor_a);
    push(&mut svg, &dashed([from, level], [540.0, level], ALARM));
    push_text(&mut svg, [548.0, level - 2.0], "", "what noise and learnt");
    push_text(&mut svg, [548.0, level + 14.0], "", &format!("error explain, {floor_a:.4} A"));
    svg.push_str("</svg>\n");
    Some(svg)
}

/// The levels of one actuator over time, one panel a fault, with the level from which on a change
/// is a warning. `None` where no level is determined.
pub fn trend_figure_svg(trend: &ActuatorTrend, warning_change: f64) -> Option<String> {
    let faults: Vec<FaultId> = FaultId::ALL
        .into_iter()
        .filter(|&id| trend.points.iter().any(|point| of_fault(&point.faults, id).is_some()))
        .collect();
    if faults.is_empty() {
        return None;
    }
    let days = || trend.points.iter().map(|point| point.days);
    let [first, last] = [days().fold(0.0, f64::min), days().fold(0.0, f64::max)];
    let margin = 0.06 * (last - first).max(1.0);
    let x = Axis::linear([first - margin, last + margin]);
    let rows = faults.len().div_ceil(TREND_COLUMNS);
    let title = format!("{}: levels over time", trend.actuator_id);
    let mut svg = opening(WIDTH, 44.0 + TREND_HEIGHT * rows as f64 + 30.0, &title);
    let heading = format!(
        "{}: fault levels since {} (95 % intervals)",
        trend.actuator_id, trend.reference_date
    );
    push_text(&mut svg, [16.0, 22.0], "font-size=\"15\"", &heading);
    for (place, &id) in faults.iter().enumerate() {
        let left = 62.0 + (WIDTH / TREND_COLUMNS as f64) * (place % TREND_COLUMNS) as f64;
        let top = 62.0 + TREND_HEIGHT * (place / TREND_COLUMNS) as f64;
        let right = left + WIDTH / TREND_COLUMNS as f64 - 78.0;
        let frame = [left, top, right, top + TREND_HEIGHT - 78.0];
        push_trend(&mut svg, trend, id, x, frame, warning_change);
    }
    let foot = 44.0 + TREND_HEIGHT * rows as f64 + 14.0;
    let key = "● level   ■ warning   - - reference plus warning change   × not explained";
    push_text(&mut svg, [16.0, foot], "", key);
    svg.push_str("</svg>\n");
    Some(svg)
}

/// Panels beside one another.
const TREND_COLUMNS: usize = 3;
/// Height of a panel with its labels, px.
const TREND_HEIGHT: f64 = 216.0;

fn of_fault(faults: &[FaultChange], id: FaultId) -> Option<&FaultChange> {
    faults.iter().find(|fault| fault.id == id)
}

/// The panel of one fault.
fn push_trend(
    svg: &mut String,
    trend: &ActuatorTrend,
    id: FaultId,
    x: Axis,
    frame: [f64; 4],
    warning_change: f64,
) {
    let at_reference = trend.points.iter().find(|point| point.recording == trend.reference);
    let reference = at_reference.and_then(|point| of_fault(&point.faults, id));
    let warning = reference.map(|fault| fault.value + warning_change);
    let explained = |point: &&TrendPoint| point.verdict != Verdict::ModelInadequate;
    let levels: Vec<(f64, FaultChange)> = trend
        .points
        .iter()
        .filter(explained)
        .filter_map(|point| of_fault(&point.faults, id).map(|fault| (point.days, *fault)))
        .collect();
    let highs = levels.iter().map(|(_, fault)| fault.value + Z_95 * fault.std);
    let most = highs.chain(warning).fold(1e-3, f64::max);
    let plane = Plane { x, y: Axis::linear([0.0, 1.08 * most]), frame };
    let name = format!("{id} {}", id.name());
    push_text(svg, [frame[0], frame[1] - 8.0], "font-size=\"12.5\"", &name);
    plane.push_axes(svg, "days", "");
    if let Some(level) = warning {
        let [_, y] = plane.at(0.0, level);
        push(svg, &dashed([frame[0], y], [frame[2], y], ALARM));
    }
    let line: Vec<[f64; 2]> =
        levels.iter().map(|(days, fault)| plane.at(*days, fault.value)).collect();
    push_stroke(svg, ("#888", 1.0), &line);
    for (days, fault) in levels {
        let [at, y] = plane.at(days, fault.value);
        let [_, low] = plane.at(days, fault.value - Z_95 * fault.std);
        let [_, high] = plane.at(days, fault.value + Z_95 * fault.std);
        push_line(svg, [at, low], [at, high], "#000");
        let mark = if fault.change == Some(Change::Warning) {
            let (left, top) = (at - 5.0, y - 5.0);
            format!(
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"10\" height=\"10\" \
                 fill=\"{ALARM}\" stroke=\"#000\"/>"
            )
        } else {
            format!("<circle cx=\"{at:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"#000\"/>")
        };
        push(svg, &mark);
    }
    for point in trend.points.iter().filter(|point| !explained(point)) {
        let [at, _] = plane.at(point.days, 0.0);
        push_text(svg, [at, frame[1] + 11.0], "text-anchor=\"middle\"", "×");
    }
}

/// The places of a signal, thinned to the least and the greatest value in each column of pixels.
fn curve(plane: &Plane, values: &[f64], rate_hz: f64) -> Vec<[f64; 2]> {
    let at = |index: usize| plane.at(index as f64 / rate_hz, values[index]);
    let width = values.len().div_ceil(COLUMNS);
    if width <= 2 {
        return (0..values.len()).map(at).collect();
    }
    let mut points = Vec::with_capacity(2 * COLUMNS);
    for start in (0..values.len()).step_by(width) {
        let column = start..(start + width).min(values.len());
        let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
        let (least, most) = (column.clone().min_by(by_value), column.max_by(by_value));
        let (Some(least), Some(most)) = (least, most) else { continue };
        points.push(at(least.min(most)));
        points.push(at(least.max(most)));
    }
    points
}

/// A grey band between two values.
fn push_band(svg: &mut String, plane: &Plane, [low, high]: [f64; 2], [from, to]: [f64; 2]) {
    let ([x0, y0], [x1, y1]) = (plane.at(from, low), plane.at(to, high));
    push(
        svg,
        &format!(
            "<rect x=\"{x0:.1}\" y=\"{y1:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#ccc\" \
             stroke=\"#888\"/>",
            x1 - x0,
            y0 - y1
        ),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        document::{Fleet, tests::record},
        figure::drawing::tests::assert_tags_match,
    };

    fn signals(samples: usize) -> FitSignals {
        let wave = |i: usize| (i as f64 * 0.01).sin();
        FitSignals {
            rate_hz: 2000.0,
            measured_a: (0..samples).map(|i| 4.0 * wave(i)).collect(),
            modelled_a: (0..samples).map(|i| 3.99 * wave(i)).collect(),
            searched_rms_a: vec![0.5, 0.7, 0.01],
        }
    }

    #[test]
    fn drawings_are_well_formed() {
        let mut record = record();
        record.recording = "a<b&\"c\".csv".to_owned();
        assert_tags_match(&fault_figure_svg(&record));
        assert_tags_match(&search_figure_svg(&record, &signals(1000)).unwrap());
        for samples in [1, 2, 1000, 10_000] {
            assert_tags_match(&fit_figure_svg(&record, &signals(samples)));
        }
        let nothing = FitSignals { searched_rms_a: Vec::new(), ..signals(9) };
        assert_eq!(search_figure_svg(&record, &nothing), None);
    }

    #[test]
    fn a_level_is_drawn_where_it_is() {
        let svg = fault_figure_svg(&record());
        // the axis is 320 px for 1.02 times 0.06
        let width = 0.021 / (1.02 * 0.06) * 320.0;
        assert!(svg.contains(&format!("width=\"{width:.1}\" height=\"16\" fill=\"{ALARM}\"")));
        assert_eq!(svg.matches("not determined").count(), 5);
        assert!(svg.contains("0.0210 ± 0.0010, detected"));
    }

    #[test]
    fn a_long_signal_keeps_its_extremes() {
        let mut values = vec![0.0; 10_000];
        values[4321] = 1.0;
        values[4322] = -1.0;
        let axis = Axis::linear([-1.0, 1.0]);
        let plane = Plane { x: Axis::linear([0.0, 5.0]), y: axis, frame: [0.0, 0.0, 100.0, 100.0] };
        let points = curve(&plane, &values, 2000.0);
        assert!(points.len() <= 2 * COLUMNS);
        let count = |y: f64| points.iter().filter(|point| point[1] == y).count();
        assert_eq!((count(0.0), count(100.0)), (1, 1));
    }

    #[test]
    fn a_trend_has_a_panel_for_each_fault_that_is_determined() {
        let mut first = record();
        first.actuator_id = Some("A-7".to_owned());
        first.date = Some("2026-01-01".to_owned());
        let mut second = first.clone();
        second.recording = "later".to_owned();
        second.date = Some("2026-02-01".to_owned());
        second.faults[0] = Fault::determined(FaultId::K1, 0.05, 0.001, [0.0, 0.1], Some(true));
        let one = Fleet::of(&[first.clone()], "fdi", 0.02);
        assert_tags_match(&trend_figure_svg(&one.actuators[0], 0.02).unwrap());
        let two = Fleet::of(&[first, second], "fdi", 0.02);
        let svg = trend_figure_svg(&two.actuators[0], 0.02).unwrap();
        assert_tags_match(&svg);
        assert_eq!((svg.matches("<circle").count(), svg.matches("width=\"10\"").count()), (1, 1));
    }
}
