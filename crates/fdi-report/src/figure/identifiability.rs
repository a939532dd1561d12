//! Drawing of how well a recording tells each fault.

use crate::{
    document::{Identifiability, RecordDiagnosis},
    figure::drawing::{Axis, Plane, opening, push, push_line, push_text},
    sentence::two_digits,
};

/// Width of the drawing, px.
const WIDTH: f64 = 760.0;
/// Height of a fault's row, px.
const ROW: f64 = 40.0;
/// Upper edge of the rows, px.
const TOP: f64 = 72.0;
/// Left and right edges of what the axis encloses, px.
const EDGES: [f64; 2] = [110.0, 400.0];
/// Place of the words beside a row, px.
const WORDS: f64 = 416.0;

/// Standard deviation of each fault: now, with the further recording or reading that would tell most,
/// and at best; with the number of the machine that it is shared with. `None` where nothing is known of
/// it.
pub fn identifiability_figure_svg(record: &RecordDiagnosis) -> Option<String> {
    let faults = &record.identifiability;
    let further = faults.iter().filter_map(|one| Some(one.would_help.as_ref()?.std));
    let stds = faults.iter().flat_map(|one| [one.std, one.least_std]).chain(further);
    let x = Axis::decades(stds)?;
    let bottom = TOP + ROW * faults.len() as f64;
    let plane = Plane { x, y: Axis::linear([0.0, 1.0]), frame: [EDGES[0], TOP, EDGES[1], bottom] };
    let title = format!("{}: how well each fault is told", record.recording);
    let mut svg = opening(WIDTH, bottom + 52.0, &title);
    let heading = "How well this recording tells each fault (standard deviation of its level)";
    push_text(&mut svg, [16.0, 22.0], "font-size=\"15\"", heading);
    legend(&mut svg);
    plane.push_x_axis(&mut svg, "standard deviation, 1");
    for (row, fault) in faults.iter().enumerate() {
        push_fault(&mut svg, &plane, TOP + ROW * (row as f64 + 0.5), fault);
    }
    svg.push_str("</svg>\n");
    Some(svg)
}

fn legend(svg: &mut String) {
    let y = 46.0;
    for (at, mark, words) in [
        (EDGES[0], now as fn(f64, f64) -> String, "now"),
        (EDGES[0] + 76.0, with_further, "with what would help"),
        (EDGES[0] + 262.0, at_best, "without noise, the model exact"),
    ] {
        push(svg, &mark(at, y));
        push_text(svg, [at + 12.0, y + 4.5], "", words);
    }
}

/// A filled circle.
fn now(x: f64, y: f64) -> String {
    format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5.5\" fill=\"#000\"/>")
}

/// An open circle.
fn with_further(x: f64, y: f64) -> String {
    format!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"#fff\" stroke=\"#000\" stroke-width=\"2\"/>"
    )
}

/// An upright bar.
fn at_best(x: f64, y: f64) -> String {
    format!(
        "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"3\" height=\"16\" fill=\"#000\"/>",
        x - 1.5,
        y - 8.0
    )
}

fn push_fault(svg: &mut String, plane: &Plane, y: f64, fault: &Identifiability) {
    let x = |std: f64| plane.at(std, 0.0)[0];
    push_text(svg, [EDGES[0] - 12.0, y + 4.5], "text-anchor=\"end\"", &fault.id.short_name());
    push_line(svg, [x(fault.least_std), y], [x(fault.std), y], "#888");
    push(svg, &at_best(x(fault.least_std), y));
    if let Some(further) = &fault.would_help {
        push(svg, &with_further(x(further.std), y));
    }
    push(svg, &now(x(fault.std), y));
    let mut words = vec![two_digits(fault.std)];
    words.extend(
        fault
            .would_help
            .as_ref()
            .map(|further| format!("{} with {}", two_digits(further.std), further.what.in_words())),
    );
    let attributes = "font-size=\"12\"";
    push_text(svg, [WORDS, y - 3.0], attributes, &words.join("; "));
    let shared = fault.shared_with.as_ref().map(|shared| format!("shared with {}", shared.key));
    let shared = shared.unwrap_or_else(|| "shared with no single number".to_owned());
    push_text(svg, [WORDS, y + 12.0], "font-size=\"12\" fill=\"#555\"", &shared);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        FaultId, Further, SharedWith, WouldHelp, document::tests::record,
        figure::drawing::tests::assert_tags_match,
    };

    #[test]
    fn each_fault_has_a_row_with_what_would_help() {
        assert!(identifiability_figure_svg(&record()).is_none());
        let mut known = record();
        let shared = SharedWith { key: "test.winding-temperature-k".to_owned(), std: 0.002 };
        known.identifiability = vec![
            Identifiability {
                id: FaultId::K3,
                std: 0.0041,
                least_std: 0.0031,
                shared_with: Some(shared),
                would_help: Some(WouldHelp { what: Further::Voltage, std: 0.0015 }),
            },
            Identifiability {
                id: FaultId::K6,
                std: 0.0008,
                least_std: 0.000_02,
                shared_with: None,
                would_help: None,
            },
        ];
        let svg = identifiability_figure_svg(&known).unwrap();
        assert_tags_match(&svg);
        for words in [
            "0.0041; 0.0015 with the motor's voltage",
            "shared with test.winding-temperature-k",
            "shared with no single number",
        ] {
            assert!(svg.contains(words), "{words}: {svg}");
        }
    }
}
