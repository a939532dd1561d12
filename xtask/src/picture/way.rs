//! The way of a recording, from a file to a report.

use std::path::Path;

use anyhow::{Result, bail};

use super::svg::{Svg, TextBox, wrapped};

const WIDTH: f64 = 250.0;
const HEIGHT: f64 = 96.0;
const GAP: f64 = 34.0;
const MARGIN: f64 = 20.0;
const CHARACTERS: usize = 44;
const FILL: &str = "#e8f0fb";

/// A step: what the data are there, the file of the code, and what the step decides.
struct Step {
    name: &'static str,
    file: &'static str,
    decides: &'static str,
}

const fn step(name: &'static str, file: &'static str, decides: &'static str) -> Step {
    Step { name, file, decides }
}

/// The offline stage, and the online stage that uses its bundle.
const STAGES: [(&str, &[Step]); 2] = [
    (
        "offline: once for an actuator and a test",
        &[
            step(
                "model",
                "crates/fdi-core/src/simulation/model_source.rs",
                "parameters and faults of a machine; refuses what no machine has",
            ),
            step(
                "reference signals",
                "crates/fdi-core/src/offline/dataset.rs",
                "fault conditions of a design, simulated with the high-fidelity model",
            ),
            step(
                "informative points",
                "crates/reduction/src/compression.rs",
                "dynamic modes, then a self-organising map: 30 samples of the signal",
            ),
            step(
                "error model",
                "crates/fdi-core/src/offline/error_model.rs",
                "mean and covariance of high less low fidelity",
            ),
            step(
                "bundle",
                "crates/fdi-core/src/offline/bundle.rs",
                "the file with signals, mask, trend and taper",
            ),
        ],
    ),
    (
        "online: for every recording",
        &[
            step(
                "recording",
                "crates/recordings/src/recording.rs",
                "channels, units, time axes; refuses what is not one",
            ),
            step(
                "observation",
                "crates/fdi-core/src/online/observation.rs",
                "envelope and filter of the experiment, start angle, noise of the sensors",
            ),
            step(
                "likelihood",
                "crates/fdi-core/src/online/likelihood.rs",
                "whitening, covariance of the estimate, limit of an adequate fit",
            ),
            step(
                "search",
                "crates/fdi-core/src/online/method.rs",
                "fault levels at which monitor and learnt error explain the signal",
            ),
            step(
                "posterior",
                "crates/fdi-core/src/online/posterior.rs",
                "intervals cut at zero, detection, eccentricity from two coordinates",
            ),
            step(
                "report",
                "crates/fdi-report/src/lib.rs",
                "the words and numbers that are published: table, JSON, CSV, HTML page",
            ),
        ],
    ),
];

/// The drawing.
///
/// # Errors
///
/// When a step names a file that is not there.
pub(super) fn drawing(root: &Path) -> Result<String> {
    let most = STAGES.iter().map(|(_, steps)| steps.len()).max().unwrap_or(0) as f64;
    let width = 3.0 * MARGIN + 2.0 * WIDTH + 60.0;
    let height = 2.0 * MARGIN + 28.0 + most * (HEIGHT + GAP) - GAP;
    let mut svg = Svg::new(width, height);
    for (column, (name, steps)) in STAGES.iter().enumerate() {
        let left = MARGIN + column as f64 * (WIDTH + MARGIN + 60.0);
        svg.label(left, MARGIN + 12.0, name);
        for (row, step) in steps.iter().enumerate() {
            if !root.join(step.file).is_file() {
                bail!("the way of a recording names `{}`, which is not there", step.file);
            }
            let top = MARGIN + 28.0 + row as f64 * (HEIGHT + GAP);
            if row > 0 {
                let middle = left + WIDTH / 2.0;
                svg.down([middle, top - GAP], [middle, top]);
            }
            let mut lines = wrapped(step.decides, CHARACTERS);
            lines.push(step.file.trim_start_matches("crates/").to_owned());
            svg.text_box(&TextBox {
                left,
                top,
                width: WIDTH,
                height: HEIGHT,
                title: step.name,
                lines: &lines,
                fill: FILL,
            });
        }
    }
    let last = STAGES[0].1.len() as f64 - 1.0;
    let bundle = MARGIN + 28.0 + last * (HEIGHT + GAP) + HEIGHT;
    let likelihood = MARGIN + 28.0 + 2.0 * (HEIGHT + GAP);
    svg.across(
        [MARGIN + WIDTH, bundle - HEIGHT / 2.0],
        [2.0 * MARGIN + WIDTH + 60.0, likelihood + HEIGHT / 2.0],
    );
    Ok(svg.finish("The way of a recording, and the bundle that it meets"))
}
