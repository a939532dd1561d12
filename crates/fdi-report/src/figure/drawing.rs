//! Pieces of self-contained SVG drawings.

use std::fmt::Write as _;

/// The document's start: white ground, dark sans-serif text, a title for those who cannot see it.
pub(crate) fn opening(width: f64, height: f64, title: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         width=\"{width}\" height=\"{height}\" role=\"img\" font-family=\"sans-serif\" \
         font-size=\"13\" fill=\"#222\">\n<title>{}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        escaped(title)
    )
}

/// Steps wanted between the ends of an axis.
const STEPS: f64 = 6.0;

/// Round numbers within a range, with their labels.
pub(crate) fn ticks([low, high]: [f64; 2]) -> Vec<(f64, String)> {
    let rough = (high - low) / STEPS;
    let decade = 10f64.powf(rough.log10().floor());
    let wide = [1.0, 2.0, 5.0, 10.0].into_iter().find(|step| step * decade >= rough * 0.999);
    let step = wide.unwrap_or(10.0) * decade;
    let digits = (-step.log10().floor()).max(0.0) as usize;
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    (first..=last)
        .map(|index| {
            let value = index as f64 * step;
            (value, format!("{value:.digits$}").replace('-', "−"))
        })
        .collect()
}

/// A line of the document.
pub(crate) fn push(svg: &mut String, line: &str) {
    writeln!(svg, "{line}").expect("a String takes all text");
}

/// A straight line.
pub(crate) fn push_line(svg: &mut String, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], stroke: &str) {
    push(
        svg,
        &format!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{stroke}\"/>"
        ),
    );
}

/// A text with attributes.
pub(crate) fn push_text(svg: &mut String, [x, y]: [f64; 2], attributes: &str, text: &str) {
    let text = escaped(text);
    push(svg, &format!("<text x=\"{x:.1}\" y=\"{y:.1}\" {attributes}>{text}</text>"));
}

/// Text as XML has it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Colours that are told apart by every kind of colour vision (Okabe and Ito, 2008), each with a
/// dash of its own, so that they are told apart in grey too.
pub(crate) const STROKES: [(&str, &str); 8] = [
    ("#000000", ""),
    ("#0072b2", "7 3"),
    ("#d55e00", "2 3"),
    ("#009e73", "10 3 2 3"),
    ("#cc79a7", "5 5"),
    ("#56b4e9", "1 2"),
    ("#e69f00", "12 4"),
    ("#777777", "4 2 1 2"),
];

/// A scale of a drawing.
#[derive(Clone, Copy)]
pub(crate) struct Axis {
    range: [f64; 2],
    logarithmic: bool,
}

impl Axis {
    pub(crate) fn linear(range: [f64; 2]) -> Self {
        Self { range, logarithmic: false }
    }

    /// Whole decades around positive values; `None` without any.
    pub(crate) fn decades(values: impl Iterator<Item = f64>) -> Option<Self> {
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
pub(crate) struct Plane {
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    /// Left, top, right and bottom of what the axes enclose, px.
    pub(crate) frame: [f64; 4],
}

impl Plane {
    pub(crate) fn at(&self, x: f64, y: f64) -> [f64; 2] {
        let [left, top, right, bottom] = self.frame;
        [left + (right - left) * self.x.share(x), bottom - (bottom - top) * self.y.share(y)]
    }

    pub(crate) fn push_axes(&self, svg: &mut String, x_label: &str, y_label: &str) {
        self.push_x_axis(svg, x_label);
        let [x0, y1, x1, y0] = self.frame;
        for (value, label) in self.y.ticks() {
            let y = y0 + (y1 - y0) * self.y.share(value);
            push_line(svg, [x0, y], [x1, y], "#ddd");
            push_text(svg, [x0 - 8.0, y + 4.5], "text-anchor=\"end\"", &label);
        }
        push_line(svg, [x0, y0], [x0, y1], "#222");
        let (x, y) = (x0 - 60.0, f64::midpoint(y0, y1));
        let turned = format!("text-anchor=\"middle\" transform=\"rotate(-90 {x:.1} {y:.1})\"");
        push_text(svg, [x, y], &turned, y_label);
    }

    /// The lower axis alone, with its grid.
    pub(crate) fn push_x_axis(&self, svg: &mut String, label: &str) {
        let [x0, y1, x1, y0] = self.frame;
        for (value, label) in self.x.ticks() {
            let x = x0 + (x1 - x0) * self.x.share(value);
            push_line(svg, [x, y0], [x, y1], "#ddd");
            push_text(svg, [x, y0 + 18.0], "text-anchor=\"middle\"", &label);
        }
        push_line(svg, [x0, y0], [x1, y0], "#222");
        let middle = f64::midpoint(x0, x1);
        push_text(svg, [middle, y0 + 38.0], "text-anchor=\"middle\"", label);
    }
}

/// Points as SVG lists them.
pub(crate) fn path(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// A curve in the stroke of its place; a single point is drawn as one.
pub(crate) fn push_curve(svg: &mut String, place: usize, points: &[[f64; 2]]) {
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

/// Colour and width in px of a curve.
pub(crate) type Stroke = (&'static str, f64);

/// A curve in one piece.
pub(crate) fn push_stroke(svg: &mut String, (colour, width): Stroke, points: &[[f64; 2]]) {
    push(
        svg,
        &format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" \
             stroke-width=\"{width}\" stroke-linejoin=\"round\"/>",
            path(points)
        ),
    );
}

/// A dashed straight line.
pub(crate) fn dashed([x1, y1]: [f64; 2], [x2, y2]: [f64; 2], stroke: &str) -> String {
    format!(
        "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{stroke}\" \
         stroke-width=\"1.5\" stroke-dasharray=\"6 4\"/>"
    )
}

/// A linear axis around values, a little wider than they reach.
pub(crate) fn around(values: impl Iterator<Item = f64>) -> Axis {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let room = (0.04 * (high - low)).max(1e-6);
    Axis::linear([low - room, high + room])
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Every tag that opens closes, in turn.
    pub(crate) fn assert_tags_match(svg: &str) {
        let mut open = Vec::new();
        for part in svg.split('<').skip(1) {
            let (tag, text) = part.split_once('>').unwrap();
            assert!(!text.contains('>') && tag.matches('"').count() % 2 == 0, "{part}");
            if let Some(name) = tag.strip_prefix('/') {
                assert_eq!(open.pop(), Some(name));
            } else if !tag.ends_with('/') {
                open.push(tag.split(' ').next().unwrap());
            }
        }
        assert!(open.is_empty());
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let labels = |range| ticks(range).into_iter().map(|(_, label)| label).collect::<Vec<_>>();
        assert_eq!(labels([0.0, 0.5]), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(labels([-0.03, 0.05]), ["−0.02", "0.00", "0.02", "0.04"]);
    }

    #[test]
    fn decades_hold_all_values() {
        let axis = Axis::decades([0.0, 0.02, 3.0].into_iter()).unwrap();
        assert_eq!(axis.range, [-2.0, 1.0]);
        assert!(Axis::decades([0.0].into_iter()).is_none());
    }
}
