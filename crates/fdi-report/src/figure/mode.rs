//! A dynamic mode and the points kept of it, as a drawing.

use crate::figure::drawing::{opening, push, push_line, push_text, ticks};

/// Width of the drawing, px.
const WIDTH: f64 = 900.0;
/// Height of the drawing, px.
const HEIGHT: f64 = 420.0;
/// Left, top, right and bottom margins of the plane, px.
const MARGINS: [f64; 4] = [78.0, 46.0, 20.0, 86.0];

/// A mode over the samples of a test, with the points kept of it.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnMode {
    /// Name of the test.
    pub test: String,
    /// Rate of the samples, Hz.
    pub rate_hz: f64,
    /// Value at each sample, unit norm.
    pub mode: Vec<f64>,
    /// Samples kept.
    pub points: Vec<usize>,
    /// Samples at which the mode has an extremum.
    pub extrema: Vec<usize>,
    /// Mean distance of a point from the nearest extremum, samples.
    pub mean_distance: f64,
    /// Mean distance of any sample from the nearest extremum, samples.
    pub mean_distance_by_chance: f64,
}

/// Draws a mode with the points kept of it and its extrema: the FREEDOM paper's figure 5, as a
/// self-contained SVG that reads without colour.
pub fn mode_figure_svg(drawn: &DrawnMode) -> String {
    let DrawnMode { test, rate_hz, mode, .. } = drawn;
    let rate_hz = *rate_hz;
    let plane = Plane::of(mode, rate_hz);
    let title = format!("First dynamic mode of the incipient signals, test “{test}”");
    let mut svg = opening(WIDTH, HEIGHT, &title);
    push_text(&mut svg, [WIDTH / 2.0, 26.0], "text-anchor=\"middle\" font-size=\"16\"", &title);
    plane.push_axes(&mut svg);
    let place = |sample: usize| plane.at(sample as f64 / rate_hz, mode[sample]);
    let path: Vec<String> = (0..mode.len())
        .map(|sample| {
            let [x, y] = place(sample);
            format!("{x:.1},{y:.1}")
        })
        .collect();
    push(
        &mut svg,
        &format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"#555\" stroke-width=\"1.4\"/>",
            path.join(" ")
        ),
    );
    for &extremum in &drawn.extrema {
        push_extremum(&mut svg, place(extremum));
    }
    for &point in &drawn.points {
        push_point(&mut svg, place(point));
    }
    push_legend(&mut svg, drawn);
    svg.push_str("</svg>\n");
    svg
}

/// Where times and values lie on the drawing.
struct Plane {
    /// First and last time, s.
    time_s: [f64; 2],
    /// Least and largest value shown.
    value: [f64; 2],
}

impl Plane {
    fn of(mode: &[f64], rate_hz: f64) -> Self {
        let low = mode.iter().copied().fold(f64::INFINITY, f64::min);
        let high = mode.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let margin = (0.06 * (high - low)).max(f64::MIN_POSITIVE);
        Self { time_s: [0.0, mode.len() as f64 / rate_hz], value: [low - margin, high + margin] }
    }

    fn at(&self, time_s: f64, value: f64) -> [f64; 2] {
        let [left, top, right, bottom] = MARGINS;
        let share = |[low, high]: [f64; 2], x: f64| (x - low) / (high - low);
        [
            left + (WIDTH - left - right) * share(self.time_s, time_s),
            HEIGHT - bottom - (HEIGHT - top - bottom) * share(self.value, value),
        ]
    }

    /// Frame, ticks with their numbers, and what the axes are.
    fn push_axes(&self, svg: &mut String) {
        let [x0, y0] = self.at(self.time_s[0], self.value[0]);
        let [x1, y1] = self.at(self.time_s[1], self.value[1]);
        for (time_s, label) in ticks(self.time_s) {
            let [x, _] = self.at(time_s, 0.0);
            push_line(svg, [x, y0], [x, y1], "#ddd");
            push_text(svg, [x, y0 + 18.0], "text-anchor=\"middle\"", &label);
        }
        for (value, label) in ticks(self.value) {
            let [_, y] = self.at(0.0, value);
            push_line(svg, [x0, y], [x1, y], "#ddd");
            push_text(svg, [x0 - 8.0, y + 4.5], "text-anchor=\"end\"", &label);
        }
        push_line(svg, [x0, y0], [x1, y0], "#222");
        push_line(svg, [x0, y0], [x0, y1], "#222");
        let middle = f64::midpoint(x0, x1);
        push_text(svg, [middle, y0 + 40.0], "text-anchor=\"middle\"", "time, s");
        let y = f64::midpoint(y0, y1);
        let turned = format!("text-anchor=\"middle\" transform=\"rotate(-90 20 {y:.1})\"");
        push_text(svg, [20.0, y], &turned, "mode, 1 (unit norm)");
    }
}

fn push_point(svg: &mut String, [x, y]: [f64; 2]) {
    push(
        svg,
        &format!(
            "<circle class=\"point\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.5\" fill=\"#000\" stroke=\"#fff\"/>"
        ),
    );
}

/// A ring around an extremum, wide enough that a point in it can be seen.
fn push_extremum(svg: &mut String, [x, y]: [f64; 2]) {
    push(
        svg,
        &format!(
            "<circle class=\"extremum\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"9\" fill=\"none\" stroke=\"#222\"/>"
        ),
    );
}

/// Below the plane: what line, dots and rings are, and how near the dots are to the rings.
fn push_legend(svg: &mut String, drawn: &DrawnMode) {
    let y = HEIGHT - 18.0;
    push_line(svg, [88.0, y], [118.0, y], "#555");
    push_text(svg, [126.0, y + 4.5], "", "first dynamic mode");
    push(
        svg,
        &format!("<rect x=\"262\" y=\"{:.1}\" width=\"9\" height=\"9\" rx=\"4.5\"/>", y - 4.5),
    );
    push_text(svg, [280.0, y + 4.5], "", &format!("the {} points", drawn.points.len()));
    push(
        svg,
        &format!(
            "<rect x=\"380\" y=\"{:.1}\" width=\"18\" height=\"18\" rx=\"9\" fill=\"none\" stroke=\"#222\"/>",
            y - 9.0
        ),
    );
    let ms = |samples: f64| 1e3 * samples / drawn.rate_hz;
    let text = format!(
        "its extrema; points are {:.0} ms from one in the mean, by chance {:.0} ms",
        ms(drawn.mean_distance),
        ms(drawn.mean_distance_by_chance)
    );
    push_text(svg, [407.0, y + 4.5], "", &text);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::drawing::tests::assert_tags_match;

    #[test]
    fn the_drawing_is_well_formed_and_has_every_point() {
        let drawn = DrawnMode {
            test: "a<b & c".to_owned(),
            rate_hz: 100.0,
            mode: (0..200).map(|i| (0.1 * f64::from(i)).sin() / 10.0).collect(),
            points: (0..30).map(|i| 6 * i).collect(),
            extrema: vec![16, 47, 79],
            mean_distance: 2.0,
            mean_distance_by_chance: 8.0,
        };
        let svg = mode_figure_svg(&drawn);
        assert_eq!(svg.matches("<circle class=\"point\"").count(), 30);
        assert_eq!(svg.matches("<circle class=\"extremum\"").count(), 3);
        assert!(svg.contains("a&lt;b &amp; c"));
        assert!(svg.contains("20 ms from one in the mean, by chance 80 ms"));
        assert_tags_match(&svg);
    }
}
