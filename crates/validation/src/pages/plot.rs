//! Panels of points and curves as self-contained SVG.

use std::fmt::Write as _;

/// Colours that every kind of colour vision tells apart (Okabe and Ito, 2008), with a dash each.
const STROKES: [(&str, &str); 6] = [
    ("#0072b2", ""),
    ("#d55e00", "7 3"),
    ("#009e73", "2 3"),
    ("#cc79a7", "10 3 2 3"),
    ("#e69f00", "5 5"),
    ("#000000", "1 2"),
];
/// Margins of a panel: left, top, right and bottom, px.
const MARGINS: [f64; 4] = [68.0, 34.0, 26.0, 46.0];

/// A logarithmic axis over whole decades.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decades {
    from: i32,
    to: i32,
}

impl Decades {
    /// The decades around positive values; those of 1 to 10 without any.
    pub(super) fn around(values: impl IntoIterator<Item = f64>) -> Self {
        let positive = values.into_iter().filter(|v| *v > 0.0 && v.is_finite());
        let (low, high) =
            positive.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        if high == 0.0 {
            return Self { from: 0, to: 1 };
        }
        let from = low.log10().floor() as i32;
        Self { from, to: (high.log10().ceil() as i32).max(from + 1) }
    }

    /// Place of a value, 0 to 1.
    fn share(self, value: f64) -> f64 {
        let place = value.max(f64::MIN_POSITIVE).log10() - f64::from(self.from);
        (place / f64::from(self.to - self.from)).clamp(0.0, 1.0)
    }

    fn ticks(self) -> impl Iterator<Item = (f64, String)> {
        (self.from..=self.to).map(|power| {
            let value = 10f64.powi(power);
            let plain = (-3..=4).contains(&power);
            let label = if plain { value.to_string() } else { format!("1e{power}") };
            (value, label.replace('-', "−"))
        })
    }
}

/// A place on a panel, in the units of its axes.
pub(super) type Place = [f64; 2];

/// A drawing that grows by panels.
#[derive(Debug)]
pub(super) struct Drawing {
    svg: String,
}

/// A panel of a drawing.
#[derive(Clone, Debug)]
pub(super) struct Panel {
    /// Corner and size in the drawing, px: left, top, width, height.
    pub(super) frame: [f64; 4],
    pub(super) x: Decades,
    pub(super) y: Decades,
    pub(super) title: String,
    pub(super) labels: [&'static str; 2],
}

impl Drawing {
    /// Starts a drawing of a size in px.
    pub(super) fn new([width, height]: [f64; 2], title: &str) -> Self {
        let title = escaped(title);
        Self {
            svg: format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
                 width=\"{width}\" height=\"{height}\" role=\"img\" font-family=\"sans-serif\" \
                 font-size=\"13\" fill=\"#222\">\n<title>{title}</title>\n\
                 <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
            ),
        }
    }

    pub(super) fn text(&mut self, [x, y]: Place, attributes: &str, text: &str) {
        self.line(&format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" {attributes}>{}</text>",
            escaped(text)
        ));
    }

    /// A row of strokes with their names.
    pub(super) fn legend(&mut self, [x, y]: Place, step: f64, names: &[&str]) {
        for (place, name) in names.iter().enumerate() {
            let x = x + step * place as f64;
            self.polyline(place, &[[x, y], [x + 30.0, y]]);
            self.text([x + 36.0, y + 4.5], "", name);
        }
    }

    pub(super) fn finish(self) -> String {
        self.svg + "</svg>\n"
    }

    fn line(&mut self, line: &str) {
        writeln!(self.svg, "{line}").expect("a String takes all text");
    }

    fn polyline(&mut self, stroke: usize, points: &[Place]) {
        let (colour, dash) = STROKES[stroke % STROKES.len()];
        self.line(&format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" \
             stroke-dasharray=\"{dash}\"/>",
            path(points)
        ));
    }
}

impl Panel {
    fn at(&self, [x, y]: Place) -> Place {
        let [left, top, width, height] = self.frame;
        let [before, above, after, below] = MARGINS;
        [
            left + before + (width - before - after) * self.x.share(x),
            top + height - below - (height - above - below) * self.y.share(y),
        ]
    }

    /// Draws axes, grid, title and labels.
    pub(super) fn axes(&self, drawing: &mut Drawing) {
        let [low, high] = [self.at([0.0, 0.0]), self.at([f64::MAX, f64::MAX])];
        let grid = |from: Place, to: Place, stroke: &str| {
            let ([x1, y1], [x2, y2]) = (from, to);
            format!(
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{stroke}\"/>"
            )
        };
        for (value, label) in self.x.ticks() {
            let [x, _] = self.at([value, 0.0]);
            drawing.line(&grid([x, low[1]], [x, high[1]], "#ddd"));
            drawing.text([x, low[1] + 17.0], "text-anchor=\"middle\"", &label);
        }
        for (value, label) in self.y.ticks() {
            let [_, y] = self.at([0.0, value]);
            drawing.line(&grid([low[0], y], [high[0], y], "#ddd"));
            drawing.text([low[0] - 6.0, y + 4.5], "text-anchor=\"end\"", &label);
        }
        drawing.line(&grid(low, [high[0], low[1]], "#222"));
        drawing.line(&grid(low, [low[0], high[1]], "#222"));
        let middle = [f64::midpoint(low[0], high[0]), f64::midpoint(low[1], high[1])];
        drawing.text([middle[0], low[1] + 36.0], "text-anchor=\"middle\"", self.labels[0]);
        let (x, y) = (low[0] - 50.0, middle[1]);
        let turned = format!("text-anchor=\"middle\" transform=\"rotate(-90 {x:.1} {y:.1})\"");
        drawing.text([x, y], &turned, self.labels[1]);
        drawing.text([low[0], high[1] - 10.0], "font-weight=\"bold\"", &self.title);
    }

    /// Draws a curve in the stroke of a place.
    pub(super) fn curve(&self, drawing: &mut Drawing, stroke: usize, points: &[Place]) {
        let drawn: Vec<Place> = points.iter().map(|&point| self.at(point)).collect();
        drawing.polyline(stroke, &drawn);
    }

    /// Draws a band between two curves in the colour of a place.
    pub(super) fn band(&self, drawing: &mut Drawing, stroke: usize, low: &[Place], high: &[Place]) {
        let around = low.iter().chain(high.iter().rev());
        let drawn: Vec<Place> = around.map(|&point| self.at(point)).collect();
        let (colour, _) = STROKES[stroke % STROKES.len()];
        drawing.line(&format!(
            "<polygon points=\"{}\" fill=\"{colour}\" fill-opacity=\"0.15\"/>",
            path(&drawn)
        ));
    }

    /// Draws points.
    pub(super) fn points(&self, drawing: &mut Drawing, points: &[Place]) {
        let (colour, _) = STROKES[0];
        for &point in points {
            let [x, y] = self.at(point);
            drawing.line(&format!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{colour}\" fill-opacity=\"0.5\"/>"
            ));
        }
    }
}

fn path(points: &[Place]) -> String {
    points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

/// Text as XML has it.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_hold_their_values_and_have_width() {
        let axis = Decades::around([0.02, 3.0, 0.0]);
        assert_eq!((axis.from, axis.to), (-2, 1));
        assert!(axis.share(0.02) > 0.0 && axis.share(3.0) < 1.0);
        let one = Decades::around([10.0]);
        assert!(one.to > one.from);
    }

    #[test]
    fn a_larger_value_is_drawn_to_the_right_and_above() {
        let panel = Panel {
            frame: [0.0, 0.0, 300.0, 200.0],
            x: Decades { from: 0, to: 2 },
            y: Decades { from: 0, to: 2 },
            title: "a < b".to_owned(),
            labels: ["x", "y"],
        };
        let ([x1, y1], [x2, y2]) = (panel.at([2.0, 2.0]), panel.at([50.0, 50.0]));
        assert!(x1 < x2 && y1 > y2);
        let mut drawing = Drawing::new([300.0, 200.0], "t");
        panel.axes(&mut drawing);
        assert!(drawing.finish().contains("a &lt; b"));
    }
}
