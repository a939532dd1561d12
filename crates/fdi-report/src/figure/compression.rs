//! Drawing of the error that a compression leaves, against the numbers that it keeps.

use crate::figure::drawing::{Axis, Plane, STROKES, dashed, opening, push, push_curve, push_text};

/// Errors by one way of compressing, fewest numbers first.
#[derive(Clone, Debug, PartialEq)]
pub struct CompressionCurve {
    /// Name of the way.
    pub name: String,
    /// Numbers kept and average error in percent.
    pub points: Vec<(usize, f64)>,
}

/// Errors in one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct CompressionPanel {
    /// Name of the setting.
    pub title: String,
    /// Average error of the whole signal, %.
    pub whole_percent: f64,
    /// A curve a way of compressing; the same ways in every panel.
    pub curves: Vec<CompressionCurve>,
}

/// Average error of a diagnosis against the numbers that it looks at, a panel a setting, on
/// logarithmic axes; `None` without a positive error.
pub fn compression_figure_svg(panels: &[CompressionPanel]) -> Option<String> {
    let points = || panels.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.points);
    let x = Axis::decades(points().map(|(numbers, _)| *numbers as f64))?;
    let whole = panels.iter().map(|panel| panel.whole_percent);
    let y = Axis::decades(points().map(|(_, percent)| *percent).chain(whole))?;
    let width = PANEL_WIDTH * panels.len() as f64;
    let title = "Average error of a diagnosis against the numbers that it looks at";
    let mut svg = opening(width, HEIGHT, title);
    for (place, panel) in panels.iter().enumerate() {
        let left = PANEL_WIDTH * place as f64;
        let frame = [left + 76.0, 40.0, left + PANEL_WIDTH - 30.0, FOOT];
        let plane = Plane { x, y, frame };
        push_text(&mut svg, [left + 76.0, 26.0], "font-size=\"15\"", &panel.title);
        plane.push_axes(&mut svg, "numbers looked at", "average error, %");
        let [_, level] = plane.at(1.0, panel.whole_percent);
        push(&mut svg, &dashed([frame[0], level], [frame[2], level], "#000"));
        let placed = || panel.curves.iter().enumerate();
        for (place, curve) in placed().filter(|(_, curve)| curve.points.len() > 1) {
            push_marked(&mut svg, &plane, place, curve);
        }
        // on top, where a curve passes through one of them
        for (place, curve) in placed() {
            if let [(numbers, percent)] = curve.points[..] {
                push_ring(&mut svg, place, plane.at(numbers as f64, percent));
            }
        }
    }
    let names = panels.first().map_or(&[][..], |panel| &panel.curves);
    for (place, curve) in names.iter().enumerate() {
        let column = (width - 76.0) / COLUMNS as f64;
        let x = 76.0 + column * (place % COLUMNS) as f64;
        let y = FOOT + 66.0 + 22.0 * (place / COLUMNS) as f64;
        match curve.points.len() {
            1 => push_ring(&mut svg, place, [x + 17.0, y]),
            _ => push_curve(&mut svg, place, &[[x, y], [x + 34.0, y]]),
        }
        push_text(&mut svg, [x + 42.0, y + 4.5], "", &curve.name);
    }
    let foot = FOOT + 66.0 + 22.0 * names.len().div_ceil(COLUMNS) as f64;
    push(&mut svg, &dashed([76.0, foot], [110.0, foot], "#000"));
    push_text(&mut svg, [118.0, foot + 4.5], "", "level of the whole signal");
    svg.push_str("</svg>\n");
    Some(svg)
}

/// Width of a panel, px.
const PANEL_WIDTH: f64 = 330.0;
/// Height of the drawing, px.
const HEIGHT: f64 = 492.0;
/// Lower end of the panels, px.
const FOOT: f64 = 360.0;
/// Names beside each other in the legend.
const COLUMNS: usize = 4;

/// The only point of a way, open so that a curve behind it is seen.
fn push_ring(svg: &mut String, place: usize, [x, y]: [f64; 2]) {
    let (colour, _) = STROKES[place % STROKES.len()];
    let ring = format!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6.5\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.5\"/>"
    );
    push(svg, &ring);
}

fn push_marked(svg: &mut String, plane: &Plane, place: usize, curve: &CompressionCurve) {
    let at = |&(numbers, percent): &(usize, f64)| plane.at(numbers as f64, percent);
    let points: Vec<[f64; 2]> = curve.points.iter().map(at).collect();
    push_curve(svg, place, &points);
    for point in points {
        push_curve(svg, place, &[point]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::drawing::tests::assert_tags_match;

    fn panel() -> CompressionPanel {
        let curve = |name: &str, points: &[(usize, f64)]| CompressionCurve {
            name: name.to_owned(),
            points: points.to_vec(),
        };
        CompressionPanel {
            title: "with noise".to_owned(),
            whole_percent: 2.0,
            curves: vec![
                curve("a map's points", &[(10, 60.0), (100, 9.0)]),
                curve("raw", &[(5000, 3.0)]),
            ],
        }
    }

    #[test]
    fn the_drawing_is_well_formed() {
        let svg = compression_figure_svg(&[panel(), panel()]).unwrap();
        assert_tags_match(&svg);
        // the way with one point: in each panel and in the legend
        assert_eq!(
            svg.matches("fill=\"none\" stroke=").count() - svg.matches("<polyline").count(),
            3
        );
        // the level: in each panel and in the legend
        assert_eq!(svg.matches("level of the whole signal").count(), 1);
        assert_eq!(svg.matches("stroke-width=\"1.5\" stroke-dasharray").count(), 3);
        assert_eq!(compression_figure_svg(&[]), None);
    }
}
