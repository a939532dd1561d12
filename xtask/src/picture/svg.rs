//! Boxes, arrows and lines of text as SVG, legible on light and dark pages.

use std::fmt::Write;

/// Height of a line of text.
const LINE: f64 = 15.0;

/// A drawing that grows.
pub(super) struct Svg {
    body: String,
    width: f64,
    height: f64,
}

/// A box with a title and lines of text.
pub(super) struct TextBox<'a> {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) title: &'a str,
    pub(super) lines: &'a [String],
    pub(super) fill: &'a str,
}

impl Svg {
    pub(super) fn new(width: f64, height: f64) -> Self {
        Self { body: String::new(), width, height }
    }

    pub(super) fn text_box(&mut self, of: &TextBox<'_>) {
        let TextBox { left, top, width, height, title, lines, fill } = of;
        let middle = left + width / 2.0;
        self.push(format_args!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" rx=\"6\" \
             fill=\"{fill}\" stroke=\"#334\"/>"
        ));
        self.push(format_args!(
            "<text x=\"{middle}\" y=\"{}\" font-size=\"14\" font-weight=\"bold\">{}</text>",
            top + 19.0,
            escaped(title)
        ));
        for (place, line) in lines.iter().enumerate() {
            let y = top + 21.0 + LINE * (place + 1) as f64;
            self.push(format_args!(
                "<text x=\"{middle}\" y=\"{y}\" font-size=\"11\">{}</text>",
                escaped(line)
            ));
        }
    }

    /// A curve with a head from the lower edge of one box to the upper edge of another.
    pub(super) fn down(&mut self, from: [f64; 2], to: [f64; 2]) {
        let [x, y] = from;
        let [to_x, to_y] = to;
        let bend = (to_y - y) * 0.45;
        self.push(format_args!(
            "<path d=\"M{x:.1} {y:.1}C{x:.1} {:.1} {to_x:.1} {:.1} {to_x:.1} {:.1}\" fill=\"none\" \
             stroke=\"#557\" stroke-width=\"1.3\" marker-end=\"url(#head)\"/>",
            y + bend,
            to_y - bend,
            to_y - 1.0
        ));
    }

    /// A curve with a head from the right edge of one box to the left edge of another.
    pub(super) fn across(&mut self, from: [f64; 2], to: [f64; 2]) {
        let [x, y] = from;
        let [to_x, to_y] = to;
        let bend = (to_x - x) * 0.5;
        self.push(format_args!(
            "<path d=\"M{x:.1} {y:.1}C{:.1} {y:.1} {:.1} {to_y:.1} {:.1} {to_y:.1}\" fill=\"none\" \
             stroke=\"#557\" stroke-width=\"1.3\" marker-end=\"url(#head)\"/>",
            x + bend,
            to_x - bend,
            to_x - 1.0
        ));
    }

    /// A word at the left edge.
    pub(super) fn label(&mut self, left: f64, y: f64, text: &str) {
        self.push(format_args!(
            "<text x=\"{left}\" y=\"{y}\" font-size=\"12\" fill=\"#557\" style=\"text-anchor:start\">{}</text>",
            escaped(text)
        ));
    }

    pub(super) fn finish(self, title: &str) -> String {
        let Self { body, width, height } = self;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" role=\"img\" \
             style=\"text-anchor:middle\">\n<title>{}</title>\n\
             <defs><marker id=\"head\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" \
             markerHeight=\"7\" orient=\"auto\"><path d=\"M0 0L8 4L0 8z\" fill=\"#557\"/></marker>\
             </defs>\n<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n{body}</svg>\n",
            escaped(title)
        )
    }

    fn push(&mut self, element: std::fmt::Arguments<'_>) {
        writeln!(self.body, "{element}").expect("a string grows");
    }
}

/// A text cut into lines of at most so many characters, between words.
pub(super) fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_between_words() {
        assert_eq!(wrapped("one two three", 7), ["one two", "three"]);
        assert_eq!(wrapped("", 7), Vec::<String>::new());
    }
}
