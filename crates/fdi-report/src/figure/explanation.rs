//! Drawings of what a model misses: the residual over the coordinates, before and after, the fault
//! levels, and what is left of recordings that were not fitted.
//!
//! Nothing is told by colour alone: what is nominal is grey with open marks, what holds with the
//! effects found is black with filled ones.

use crate::{
    document::{CurveBin, Explanation, FaultBeforeAfter, FaultId, Holdout, ResidualCurve},
    figure::drawing::{
        Axis, Plane, Stroke, around, dashed, opening, path, push, push_line, push_stroke, push_text,
    },
};

/// Width of a drawing, px.
const WIDTH: f64 = 760.0;
/// Left edge of what the axes enclose, px.
const LEFT: f64 = 96.0;
/// Right edge of the same, px.
const RIGHT: f64 = 744.0;
/// Standard deviations to either end of a 95 % interval.
const Z_95: f64 = 1.96;
/// Stroke of the nominal model.
const BEFORE: Stroke = ("#8a8a8a", 1.5);
/// Stroke of the model with the effects found.
const AFTER: Stroke = ("#000", 1.5);

/// Mean residual over the coordinate that explains most of it, with the number of samples below;
/// the band is where means of white noise of the floor's size are, 19 times in 20. `None` where
/// the recordings do not suffice for a curve.
pub fn residual_curve_figure_svg(explanation: &Explanation) -> Option<String> {
    let curve = explanation.curves.first()?;
    let floor = floor(explanation);
    let (x, y) = axes(curve, floor);
    let top = Plane { x, y, frame: [LEFT, 58.0, RIGHT, 320.0] };
    let title = format!("Residual over {}, before and after", named(curve));
    let mut svg = opening(WIDTH, 470.0, &title);
    push_text(&mut svg, [16.0, 22.0], "font-size=\"15\"", &title);
    top.push_axes(&mut svg, "", &format!("mean residual, {}", drive_unit(explanation)));
    push_curve(&mut svg, &top, curve, floor, 3.5);
    push_key(&mut svg, floor.is_some(), 46.5);
    let most = curve.bins.iter().map(|bin| bin.samples).max().unwrap_or(0) as f64;
    let y = Axis::linear([0.0, 1.05 * most.max(1.0)]);
    let bottom = Plane { x, y, frame: [LEFT, 348.0, RIGHT, 424.0] };
    bottom.push_axes(&mut svg, &labelled(curve), "samples");
    push_counts(&mut svg, &bottom, &curve.bins);
    svg.push_str("</svg>\n");
    Some(svg)
}

/// The residual over the other coordinates, one panel each. `None` where there is none.
pub fn residual_curves_figure_svg(explanation: &Explanation) -> Option<String> {
    const COLUMNS: usize = 2;
    const HEIGHT: f64 = 236.0;
    let curves = explanation.curves.get(1..).filter(|curves| !curves.is_empty())?;
    let floor = floor(explanation);
    let rows = curves.len().div_ceil(COLUMNS);
    let title = "Residual over the other coordinates, before and after";
    let mut svg = opening(WIDTH, 52.0 + HEIGHT * rows as f64, title);
    push_text(&mut svg, [16.0, 22.0], "font-size=\"15\"", title);
    push_key(&mut svg, floor.is_some(), 46.5);
    // one scale for all: what is flat beside the others looks it
    let y = around(curves.iter().flat_map(means));
    for (place, curve) in curves.iter().enumerate() {
        let left = (WIDTH / COLUMNS as f64) * (place % COLUMNS) as f64 + 84.0;
        let top = 76.0 + HEIGHT * (place / COLUMNS) as f64;
        let frame = [left, top, left + WIDTH / COLUMNS as f64 - 100.0, top + HEIGHT - 86.0];
        let plane = Plane { x: axes(curve, floor).0, y, frame };
        let told = format!(
            "{}: explains {:.0} % before, {:.0} % after",
            named(curve),
            100.0 * curve.share_before,
            100.0 * curve.share_after
        );
        push_text(&mut svg, [left, top - 8.0], "font-size=\"12\"", &told);
        let unit = format!("residual, {}", drive_unit(explanation));
        plane.push_axes(&mut svg, &labelled(curve), if place % COLUMNS == 0 { &unit } else { "" });
        push_curve(&mut svg, &plane, curve, floor, 2.2);
    }
    svg.push_str("</svg>\n");
    Some(svg)
}

/// The fault levels with the nominal model and with what was found, with 95 % intervals. `None`
/// where no level was fitted.
pub fn fault_change_figure_svg(explanation: &Explanation) -> Option<String> {
    const ROW: f64 = 44.0;
    const TOP: f64 = 64.0;
    if explanation.faults.is_empty() {
        return None;
    }
    let bottom = TOP + ROW * explanation.faults.len() as f64;
    let ends = explanation.faults.values().flat_map(|fault| {
        let [before, after] = both(fault);
        let shown = [before, after].into_iter().map(|(_, interval)| interval);
        shown.filter(|interval| FaultBeforeAfter::determines(*interval)).flatten()
    });
    let least = ends.clone().fold(0.0, f64::min);
    let most = ends.fold(0.02, f64::max);
    let room = 0.03 * (most - least);
    let x = Axis::linear([(least - room).max(-1.0), (most + room).min(1.0)]);
    let plane = Plane { x, y: Axis::linear([0.0, 1.0]), frame: [210.0, TOP, 500.0, bottom] };
    let title = "Fault levels before and after, with 95 % intervals";
    let mut svg = opening(WIDTH, bottom + 52.0, title);
    push_text(&mut svg, [16.0, 22.0], "font-size=\"15\"", title);
    push_key(&mut svg, false, 46.5);
    plane.push_x_axis(&mut svg, "level, 1 (0 as new, 1 full damage)");
    for (row, (key, fault)) in explanation.faults.iter().enumerate() {
        let y = TOP + ROW * (row as f64 + 0.5);
        push_text(&mut svg, [198.0, y + 4.5], "text-anchor=\"end\"", &fault_name(key));
        for (place, (level, ends)) in both(fault).into_iter().enumerate() {
            let y = y - 8.0 + 16.0 * place as f64;
            if FaultBeforeAfter::determines(ends) {
                push_interval(&mut svg, &plane, y, (level, ends), place == 1);
            }
            if place == 0 {
                let [zero, _] = plane.at(0.0, 0.0);
                push(&mut svg, &dashed([zero, y - 14.0], [zero, y + 30.0], "#777"));
            }
            push_text(
                &mut svg,
                [516.0, y + 4.5],
                "font-size=\"12\"",
                &interval(level, ends, place),
            );
        }
    }
    svg.push_str("</svg>\n");
    Some(svg)
}

/// Root mean square of the residual of recordings that were not fitted: nominal, with what was
/// found, and the noise. `None` where none was held out.
pub fn held_out_figure_svg(explanation: &Explanation) -> Option<String> {
    const ROW: f64 = 40.0;
    const TOP: f64 = 44.0;
    let holdout = explanation.holdout.as_ref()?;
    let bottom = TOP + 3.0 * ROW;
    let Holdout { rms_before, rms_after, noise_floor, .. } = *holdout;
    let most = rms_before.max(rms_after).max(noise_floor);
    let unit = spelt(&holdout.unit);
    let plane = Plane {
        x: Axis::linear([0.0, 1.05 * most.max(f64::MIN_POSITIVE)]),
        y: Axis::linear([0.0, 1.0]),
        frame: [210.0, TOP, 600.0, bottom],
    };
    let title = "What is left of recordings that were not fitted";
    let mut svg = opening(WIDTH, bottom + 52.0, title);
    push_text(&mut svg, [16.0, 22.0], "font-size=\"15\"", title);
    plane.push_x_axis(&mut svg, &format!("rms of the residual, {unit}"));
    let bars = [
        ("nominal model", rms_before, "#c4c4c4"),
        ("with what was found", rms_after, "#333"),
        (explanation.floor_name(), noise_floor, "#fff"),
    ];
    for (row, (name, value, fill)) in bars.into_iter().enumerate() {
        let y = TOP + ROW * (row as f64 + 0.5);
        let ([from, _], [to, _]) = (plane.at(0.0, 0.0), plane.at(value, 0.0));
        let (top, wide) = (y - 11.0, to - from);
        push(
            &mut svg,
            &format!(
                "<rect x=\"{from:.1}\" y=\"{top:.1}\" width=\"{wide:.1}\" height=\"22\" \
                 fill=\"{fill}\" stroke=\"#222\"/>"
            ),
        );
        push_text(&mut svg, [198.0, y + 4.5], "text-anchor=\"end\"", name);
        push_text(&mut svg, [616.0, y + 4.5], "", &format!("{} {unit}", four_digits(value)));
    }
    svg.push_str("</svg>\n");
    Some(svg)
}

/// Standard deviation of the noise, where it is known.
fn floor(explanation: &Explanation) -> Option<f64> {
    explanation.holdout.as_ref().map(|holdout| holdout.noise_floor)
}

fn drive_unit(explanation: &Explanation) -> &str {
    explanation.holdout.as_ref().map_or("A", |holdout| spelt(&holdout.unit))
}

/// Samples below which a mean is not drawn: it would be noise on a scale of its own.
const FEWEST: u64 = 8;
/// Share of all samples below which it is not drawn either.
const LEAST_SHARE: f64 = 0.002;

/// The bins that are drawn.
fn shown(curve: &ResidualCurve) -> Vec<CurveBin> {
    let all: u64 = curve.bins.iter().map(|bin| bin.samples).sum();
    let fewest = FEWEST.max((LEAST_SHARE * all as f64) as u64);
    curve.bins.iter().filter(|bin| bin.samples >= fewest).copied().collect()
}

/// Neighbouring bins in runs: nothing is drawn across stretches without samples.
fn runs(bins: &[CurveBin]) -> impl Iterator<Item = &[CurveBin]> {
    let gaps = bins.windows(2).map(|pair| pair[1].centre - pair[0].centre);
    let width = gaps.fold(f64::INFINITY, f64::min);
    bins.chunk_by(move |one, next| next.centre - one.centre < 1.5 * width)
}

/// Where the mean of so many samples of white noise is 19 times in 20.
fn scatter(bin: &CurveBin, floor: f64) -> f64 {
    Z_95 * floor / (bin.samples.max(1) as f64).sqrt()
}

fn means(curve: &ResidualCurve) -> impl Iterator<Item = f64> {
    shown(curve).into_iter().flat_map(|bin| [bin.mean_before, bin.mean_after])
}

/// Axes that hold the means of a curve, and the band of the noise in bins of the common size.
fn axes(curve: &ResidualCurve, floor: Option<f64>) -> (Axis, Axis) {
    let band = |bin: &CurveBin| floor.map_or(0.0, |floor| scatter(bin, floor));
    let mut bands: Vec<f64> = shown(curve).iter().map(band).collect();
    bands.sort_by(f64::total_cmp);
    let band = bands.get(bands.len() / 2).copied().unwrap_or(0.0);
    (around(curve.bins.iter().map(|bin| bin.centre)), around(means(curve).chain([-band, band])))
}

/// Band of the noise, zero, and both means.
fn push_curve(
    svg: &mut String,
    plane: &Plane,
    curve: &ResidualCurve,
    floor: Option<f64>,
    radius: f64,
) {
    let bins = shown(curve);
    if let Some(floor) = floor {
        for run in runs(&bins) {
            let edge =
                |sign: f64| move |bin: &CurveBin| plane.at(bin.centre, sign * scatter(bin, floor));
            let mut band: Vec<[f64; 2]> = run.iter().map(edge(1.0)).collect();
            band.extend(run.iter().rev().map(edge(-1.0)));
            let points = path(&band);
            push(svg, &format!("<polygon points=\"{points}\" fill=\"#dcdcdc\" stroke=\"none\"/>"));
        }
    }
    let [left, _, right, _] = plane.frame;
    let [_, zero] = plane.at(0.0, 0.0);
    push_line(svg, [left, zero], [right, zero], "#777");
    for (stroke, fill, is_after) in [(BEFORE, "#fff", false), (AFTER, "#000", true)] {
        let mean = |bin: &CurveBin| if is_after { bin.mean_after } else { bin.mean_before };
        let points = |run: &[CurveBin]| -> Vec<[f64; 2]> {
            run.iter().map(|bin| plane.at(bin.centre, mean(bin))).collect()
        };
        for run in runs(&bins) {
            push_stroke(svg, stroke, &points(run));
        }
        for point in points(&bins) {
            push_mark(svg, point, radius, (fill, stroke.0));
        }
    }
}

fn push_mark(svg: &mut String, [x, y]: [f64; 2], radius: f64, (fill, stroke): (&str, &str)) {
    push(
        svg,
        &format!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{fill}\" \
             stroke=\"{stroke}\" stroke-width=\"1.5\"/>"
        ),
    );
}

/// Draws the key of the marks.
fn push_key(svg: &mut String, with_band: bool, y: f64) {
    let marks =
        [("nominal model", LEFT, BEFORE, "#fff"), ("with what was found", 250.0, AFTER, "#000")];
    for (name, at, stroke, fill) in marks {
        push_stroke(svg, stroke, &[[at, y - 4.5], [at + 34.0, y - 4.5]]);
        push_mark(svg, [at + 17.0, y - 4.5], 3.5, (fill, stroke.0));
        push_text(svg, [at + 42.0, y], "", name);
    }
    if with_band {
        let top = y - 11.5;
        push(
            svg,
            &format!(
                "<rect x=\"450\" y=\"{top:.1}\" width=\"34\" height=\"14\" fill=\"#dcdcdc\" \
                 stroke=\"#888\"/>"
            ),
        );
        push_text(svg, [492.0, y], "", "means of white noise, 95 %");
    }
}

/// Numbers of samples as bars.
fn push_counts(svg: &mut String, plane: &Plane, bins: &[CurveBin]) {
    let gaps = bins.windows(2).map(|pair| pair[1].centre - pair[0].centre);
    let width = gaps.fold(f64::INFINITY, f64::min);
    for bin in bins {
        let reach = if width.is_finite() { 0.42 * width } else { 0.0 };
        let [left, top] = plane.at(bin.centre - reach, bin.samples as f64);
        let [right, bottom] = plane.at(bin.centre + reach, 0.0);
        push(
            svg,
            &format!(
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" \
                 fill=\"#c4c4c4\" stroke=\"#777\"/>",
                (right - left).max(1.0),
                bottom - top
            ),
        );
    }
}

/// One level with its interval; an interval wider than the axis ends with it.
fn push_interval(
    svg: &mut String,
    plane: &Plane,
    y: f64,
    (level, [low, high]): (f64, [f64; 2]),
    is_after: bool,
) {
    let x = |level: f64| plane.at(level, 0.0)[0];
    let (stroke, fill) = if is_after { (AFTER, "#000") } else { (BEFORE, "#fff") };
    push_stroke(svg, (stroke.0, 2.0), &[[x(low), y], [x(high), y]]);
    push_mark(svg, [x(level), y], 4.0, (fill, stroke.0));
}

/// Levels before and after, with their intervals.
fn both(fault: &FaultBeforeAfter) -> [(f64, [f64; 2]); 2] {
    [(fault.before, fault.interval_95_before), (fault.after, fault.interval_95_after)]
}

fn interval(level: f64, [low, high]: [f64; 2], place: usize) -> String {
    let word = ["before", "after"][place];
    if !FaultBeforeAfter::determines([low, high]) {
        return format!("{word} not determined");
    }
    format!("{word} {level:.4} ({low:.4} to {high:.4})").replace('-', "−")
}

/// A fault level as it is read.
fn fault_name(key: &str) -> String {
    let fault = FaultId::ALL.into_iter().find(|fault| fault.to_string() == key);
    format!("{key} {}", fault.map_or("", FaultId::name)).trim_end().to_owned()
}

/// Names a coordinate in a sentence.
fn named(curve: &ResidualCurve) -> &str {
    match curve.coordinate.as_str() {
        "motor-angle" => "motor angle",
        "drive" if curve.unit == "v" => "motor voltage",
        "drive" => "motor current",
        other => other,
    }
}

fn labelled(curve: &ResidualCurve) -> String {
    let within =
        if curve.coordinate == "motor-angle" { " within a period of the current" } else { "" };
    format!("{}{within}, {}", named(curve), spelt(&curve.unit))
}

/// A unit as people write it.
fn spelt(unit: &str) -> &str {
    match unit {
        "a" => "A",
        "v" => "V",
        "n" => "N",
        "n_m" => "N·m",
        "rad_per_s" => "rad/s",
        "m_per_s" => "m/s",
        other => other,
    }
}

/// Four significant digits.
pub(crate) fn four_digits(value: f64) -> String {
    format!("{value:.3e}").parse::<f64>().map_or_else(|_| value.to_string(), |v| v.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ExplanationVerdict, figure::drawing::tests::assert_tags_match};

    fn explanation() -> Explanation {
        let bin = |place: usize| CurveBin {
            centre: place as f64,
            // two bins in the middle hold next to nothing
            samples: if (4..6).contains(&place) { 1 } else { 100 },
            mean_before: if place == 4 { 9.0 } else { 0.01 * place as f64 },
            mean_after: 0.001,
        };
        let curve = |coordinate: &str, unit: &str| ResidualCurve {
            coordinate: coordinate.to_owned(),
            unit: unit.to_owned(),
            share_before: 0.5,
            share_after: 0.0,
            bins: (0..10).map(bin).collect(),
        };
        let level = FaultBeforeAfter {
            before: 0.2,
            std_before: 0.01,
            interval_95_before: [0.1804, 0.2196],
            after: 0.1,
            std_after: 0.02,
            interval_95_after: [0.0608, 0.1392],
            ambiguous_with: Vec::new(),
        };
        Explanation {
            schema_version: 1,
            tool: "fdi".to_owned(),
            seed: 0,
            stamp: None,
            model: "m".to_owned(),
            prediction: None,
            verdict: ExplanationVerdict::Named,
            sentence: String::new(),
            signal: None,
            signals: Vec::new(),
            effects: Vec::new(),
            alternatives: Vec::new(),
            numbers: Vec::new(),
            absorbed: Vec::new(),
            holdout: Some(Holdout {
                rms_before: 0.5,
                rms_after: 0.25,
                noise_floor: 0.1,
                gap_closed_frac: None,
                unit: "v".to_owned(),
            }),
            faults: [("k1".to_owned(), level.clone()), ("k6".to_owned(), level)].into(),
            nominal: [].into(),
            records: Vec::new(),
            remainder: None,
            sensitivity: Vec::new(),
            hypotheses: Vec::new(),
            curves: vec![curve("speed", "m_per_s"), curve("drive", "v"), curve("time", "s")],
            elapsed_s: None,
        }
    }

    #[test]
    fn drawings_are_well_formed() {
        let explanation = explanation();
        for svg in [
            residual_curve_figure_svg(&explanation),
            residual_curves_figure_svg(&explanation),
            fault_change_figure_svg(&explanation),
            held_out_figure_svg(&explanation),
        ] {
            assert_tags_match(&svg.unwrap());
        }
    }

    #[test]
    fn means_of_next_to_nothing_are_not_drawn() {
        let svg = residual_curve_figure_svg(&explanation()).unwrap();
        // eight bins before and after, and two marks of the key
        assert_eq!(svg.matches("<circle").count(), 2 * 8 + 2);
        // in two runs, each with its band and both curves, and two strokes of the key
        assert_eq!((svg.matches("<polygon").count(), svg.matches("<polyline").count()), (2, 6));
        assert!(svg.contains("speed, m/s") && svg.contains("mean residual, V"), "{svg}");
    }

    #[test]
    fn bars_are_as_long_as_what_they_stand_for() {
        let svg = held_out_figure_svg(&explanation()).unwrap();
        // the axis is 390 px for 1.05 times 0.5
        for value in [0.5, 0.25, 0.1] {
            let width = 390.0 * value / (1.05 * 0.5);
            assert!(svg.contains(&format!("width=\"{width:.1}\" height=\"22\"")), "{value}");
        }
        let svg = fault_change_figure_svg(&explanation()).unwrap();
        assert!(svg.contains("before 0.2000 (0.1804 to 0.2196)"), "{svg}");
        assert!(svg.contains("k6 "), "{svg}");
    }

    #[test]
    fn a_level_that_may_be_anything_is_not_determined() {
        let mut answer = explanation();
        let level = answer.faults.get_mut("k6").unwrap();
        (level.before, level.interval_95_before) = (0.4321, [0.0, 1.0]);
        let svg = fault_change_figure_svg(&answer).unwrap();
        assert_tags_match(&svg);
        assert_eq!(svg.matches("before not determined").count(), 1);
        assert!(!svg.contains("0.4321"), "the level is not drawn");
        assert_eq!(svg.matches("after 0.1000 (").count(), 2);
    }

    #[test]
    fn without_curves_levels_or_recordings_held_out_nothing_is_drawn() {
        let nothing =
            Explanation { curves: Vec::new(), faults: [].into(), holdout: None, ..explanation() };
        assert_eq!(residual_curve_figure_svg(&nothing), None);
        assert_eq!(residual_curves_figure_svg(&nothing), None);
        assert_eq!(fault_change_figure_svg(&nothing), None);
        assert_eq!(held_out_figure_svg(&nothing), None);
    }
}
