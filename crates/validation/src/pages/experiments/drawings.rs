//! Drawings: method, actuator, response, a mode with its map.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use fdi_core::{
    Bundle, EMBEDDED_BUNDLES, MASK_POINTS, Purpose, ReferenceDesign, RootSeed,
    ema_sim::{HealthState, Imperfections, LowFidelity, PhysicalFaults, Scenario},
};
use reduction::{
    CompressionConfig, CompressionMap, Dmd, DmdConfig, Snapshots, Som, SomConfig, TrainingScaling,
    TrainingSet,
};

use crate::pages::figure::Rendered;

const WIDTH: f64 = 900.0;
/// Left and right edge of what the axes enclose.
const EDGES: [f64; 2] = [86.0, 884.0];
/// Strokes in order: colour, width, dashes. They differ in grey as well.
const STROKES: [(&str, f64, &str); 3] =
    [("#a0a0a0", 4.0, ""), ("#000", 1.4, ""), ("#b23a00", 1.4, "7 4")];

/// The section.
pub(super) fn write(page: &mut Rendered) -> Result<()> {
    let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes)?;
    page.drawings.push(("response.svg".to_owned(), response(&bundle)?));
    page.drawings.push(("mode-and-map.svg".to_owned(), mode_and_map(&bundle)?));
    writeln!(page.markdown, "{TEXT}")?;
    Ok(())
}

/// A curve over time or over the samples of a signal.
struct Curve {
    name: &'static str,
    points: Vec<[f64; 2]>,
}

/// A plane with axes.
struct Panel {
    x: [f64; 2],
    y: [f64; 2],
    top: f64,
    bottom: f64,
}

impl Panel {
    /// A panel that holds curves.
    fn around(curves: &[Curve], [top, bottom]: [f64; 2]) -> Self {
        let span = |n: usize| {
            let values = || curves.iter().flat_map(|curve| curve.points.iter().map(move |p| p[n]));
            let low = values().fold(f64::INFINITY, f64::min);
            let high = values().fold(f64::NEG_INFINITY, f64::max);
            [low, high]
        };
        let [low, high] = span(1);
        let margin = 0.07 * (high - low).max(f64::MIN_POSITIVE);
        Self { x: span(0), y: [low - margin, high + margin], top, bottom }
    }

    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let share = |[low, high]: [f64; 2], value: f64| (value - low) / (high - low);
        [
            EDGES[0] + (EDGES[1] - EDGES[0]) * share(self.x, x),
            self.bottom - (self.bottom - self.top) * share(self.y, y),
        ]
    }

    /// Axes with ticks, and what they are.
    fn axes(&self, svg: &mut String, label: &str, x_label: &str) -> Result<()> {
        let grid = "stroke=\"#ddd\"";
        for (value, text) in ticks(self.x, 10.0) {
            let [x, _] = self.at([value, 0.0]);
            line(svg, [[x, self.top], [x, self.bottom]], grid)?;
            if !x_label.is_empty() {
                writeln!(
                    svg,
                    "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{text}</text>",
                    self.bottom + 18.0
                )?;
            }
        }
        for (value, text) in ticks(self.y, 4.0) {
            let [_, y] = self.at([0.0, value]);
            line(svg, [[EDGES[0], y], [EDGES[1], y]], grid)?;
            writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
                EDGES[0] - 8.0,
                y + 4.5
            )?;
        }
        line(svg, [[EDGES[0], self.bottom], [EDGES[1], self.bottom]], "stroke=\"#222\"")?;
        line(svg, [[EDGES[0], self.top], [EDGES[0], self.bottom]], "stroke=\"#222\"")?;
        let middle = f64::midpoint(self.top, self.bottom);
        writeln!(
            svg,
            "<text x=\"18\" y=\"{middle:.1}\" text-anchor=\"middle\" transform=\"rotate(-90 18 {middle:.1})\">{label}</text>"
        )?;
        let centre = f64::midpoint(EDGES[0], EDGES[1]);
        writeln!(
            svg,
            "<text x=\"{centre:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{x_label}</text>",
            self.bottom + 38.0
        )?;
        Ok(())
    }

    /// Curves with their names above the panel.
    fn curves(&self, svg: &mut String, curves: &[Curve], first: usize) -> Result<()> {
        let mut left = EDGES[0];
        for (place, curve) in curves.iter().enumerate() {
            let (colour, width, dashes) = STROKES[(place + first) % STROKES.len()];
            let attributes = format!(
                "fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-dasharray=\"{dashes}\""
            );
            let path: Vec<String> = curve
                .points
                .iter()
                .map(|point| {
                    let [x, y] = self.at(*point);
                    format!("{x:.1},{y:.1}")
                })
                .collect();
            writeln!(svg, "<polyline points=\"{}\" {attributes}/>", path.join(" "))?;
            let y = self.top - 10.0;
            line(svg, [[left, y], [left + 34.0, y]], &attributes)?;
            writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                left + 40.0,
                y + 4.5,
                curve.name
            )?;
            left += 64.0 + 7.3 * curve.name.chars().count() as f64;
        }
        Ok(())
    }
}

fn line(svg: &mut String, [[x1, y1], [x2, y2]]: [[f64; 2]; 2], attributes: &str) -> Result<()> {
    writeln!(
        svg,
        "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {attributes}/>"
    )?;
    Ok(())
}

/// Round numbers within a range, about so many.
fn ticks([low, high]: [f64; 2], about: f64) -> Vec<(f64, String)> {
    let rough = (high - low) / about;
    let decade = 10f64.powf(rough.log10().floor());
    let wide = [1.0, 2.0, 5.0, 10.0].into_iter().find(|step| step * decade >= rough * 0.999);
    let step = wide.unwrap_or(10.0) * decade;
    let digits = (-step.log10().floor()).max(0.0) as usize;
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    let of = |n: i64| {
        let value = n as f64 * step;
        (value, format!("{value:.digits$}").replace('-', "−"))
    };
    (first..=last).map(of).collect()
}

fn opening(height: f64, title: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\" role=\"img\" font-family=\"sans-serif\" font-size=\"14\" fill=\"#222\">\n\
         <title>{title}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <text x=\"16\" y=\"24\" font-size=\"16\">{title}</text>\n"
    )
}

/// A channel over time, thinned to what a page shows.
fn over_time(name: &'static str, values: &[f64], rate_hz: f64, factor: f64) -> Curve {
    let step = (values.len() / 1000).max(1);
    let of = |(n, value): (usize, &f64)| [n as f64 / rate_hz, factor * value];
    Curve { name, points: values.iter().enumerate().step_by(step).map(of).collect() }
}

/// Response of the low-fidelity model to the chirp, beside the high-fidelity one.
fn response(bundle: &Bundle) -> Result<String> {
    let experiment = &bundle.experiment;
    let healthy = PhysicalFaults::from(&HealthState::HEALTHY);
    let high = experiment.high_fidelity(0.0, Imperfections::NONE)?.try_simulate(&healthy)?;
    let scenario = Scenario { imperfections: Imperfections::NONE, ..experiment.scenario.clone() };
    let monitor = LowFidelity::new(&experiment.actuator, &scenario)?;
    let low = monitor.try_simulate(&healthy)?;
    let filtered = |current_a: &[f64]| experiment.filter.apply(current_a, low.rate_hz);
    let envelope_a = high.envelope_a(experiment.envelope, experiment.actuator.motor.pole_pairs);
    let (signal_a, monitored_a) = (filtered(&envelope_a), filtered(&low.current_a));
    let rate_hz = experiment.filter.output_hz;
    let change = |name, fault: usize| -> Result<Curve> {
        let mut levels = [0.0; 7];
        (levels[fault], levels[6]) = (0.05, 0.5);
        let worn = PhysicalFaults::from(&HealthState::new(levels)?);
        let worn_a = filtered(&monitor.try_simulate(&worn)?.current_a);
        let away: Vec<f64> = worn_a.iter().zip(&monitored_a).map(|(a, b)| a - b).collect();
        Ok(over_time(name, &away, rate_hz, 1.0))
    };
    let panels = [
        (
            "surface, mrad",
            vec![
                over_time("command", &high.command_rad, high.rate_hz, 1e3),
                over_time("surface, low fidelity", &low.surface_angle_rad, low.rate_hz, 1e3),
            ],
        ),
        (
            "motor, rad/s",
            vec![
                over_time("high fidelity", &high.motor_speed_rad_per_s, high.rate_hz, 1.0),
                over_time("low fidelity", &low.motor_speed_rad_per_s, low.rate_hz, 1.0),
            ],
        ),
        (
            "envelope, A",
            vec![
                over_time("high fidelity", &signal_a, rate_hz, 1.0),
                over_time("low fidelity", &monitored_a, rate_hz, 1.0),
            ],
        ),
        (
            "change, A",
            vec![
                change("friction k1 = 0.05", 0)?,
                change("short circuit k3 = 0.05", 2)?,
                change("eccentricity k6 = 0.05", 5)?,
            ],
        ),
    ];
    let mut svg = opening(
        820.0,
        "Simulated response to the chirp, healthy, and what faults change of the current",
    );
    for (place, (label, curves)) in panels.iter().enumerate() {
        let top = 66.0 + 184.0 * place as f64;
        let panel = Panel::around(curves, [top, top + 140.0]);
        let last = place + 1 == panels.len();
        panel.axes(&mut svg, label, if last { "time, s" } else { "" })?;
        panel.curves(&mut svg, curves, 0)?;
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

/// First dynamic mode of the bundle's signals with the neurons of its map, and the points kept.
fn mode_and_map(bundle: &Bundle) -> Result<String> {
    let dataset = bundle.dataset(ReferenceDesign::Incipient).context("no incipient signals")?;
    let snapshots = Snapshots::from_columns(&dataset.signals_a)?;
    let dmd = Dmd::fit(&snapshots, &DmdConfig::default())?;
    let weights: Vec<f64> = dmd.amplitudes().iter().map(|amplitude| amplitude.modulus()).collect();
    let set = TrainingSet::new(dmd.real_modes(), &weights, TrainingScaling::default());
    let seed = RootSeed(dataset.seed).derive(Purpose::Map, 0);
    let som = SomConfig { seed, ..SomConfig::default() };
    let map = Som::fit(set.rows(), &som)?;
    let config = CompressionConfig { som, ..CompressionConfig::default() };
    let kept = CompressionMap::fit(&(&snapshots).into(), &config)?;
    let points = kept.locations().context("a map keeps points")?;
    let rate_hz = bundle.experiment.filter.output_hz;
    let neuron = |n: usize| {
        [set.location_of(map.weights().column(0)[n]) / rate_hz, map.weights().column(1)[n]]
    };
    let scaled = set.rows().column(1);
    let mode = [over_time("first dynamic mode", scaled, rate_hz, 1.0)];
    let panel = Panel::around(&mode, [66.0, 430.0]);
    let mut svg = opening(
        500.0,
        "First dynamic mode of the chirp's signals and the map that is trained on the modes",
    );
    panel.axes(&mut svg, "mode, standard deviations", "time, s")?;
    for n in 0..map.grid().neurons() {
        for other in (n + 1..map.grid().neurons()).filter(|&other| map.grid().adjacent(n, other)) {
            let ends = [panel.at(neuron(n)), panel.at(neuron(other))];
            line(&mut svg, ends, "stroke=\"#3a6ea5\" stroke-opacity=\"0.55\"")?;
        }
    }
    panel.curves(&mut svg, &mode, 0)?;
    for &point in points {
        let [x, y] = panel.at([point as f64 / rate_hz, scaled[point]]);
        writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.5\" fill=\"#000\"/>")?;
    }
    for n in 0..map.grid().neurons() {
        let [x, y] = panel.at(neuron(n));
        writeln!(
            svg,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"8\" height=\"8\" fill=\"#fff\" stroke=\"#3a6ea5\" stroke-width=\"1.6\"/>",
            x - 4.0,
            y - 4.0
        )?;
    }
    writeln!(
        svg,
        "<rect x=\"290\" y=\"52\" width=\"8\" height=\"8\" fill=\"#fff\" stroke=\"#3a6ea5\" stroke-width=\"1.6\"/>"
    )?;
    writeln!(svg, "<text x=\"306\" y=\"60.5\">neuron, neighbours joined</text>")?;
    writeln!(svg, "<circle cx=\"520\" cy=\"56\" r=\"4.5\" fill=\"#000\"/>")?;
    writeln!(
        svg,
        "<text x=\"532\" y=\"60.5\">sample that its neuron stands for: one of {MASK_POINTS} kept</text>"
    )?;
    svg.push_str("</svg>\n");
    Ok(svg)
}

const TEXT: &str = "\n## Method, actuator, response, mode: drawings\n\n\
Drawings beside the paper's Figures 1, 2 and 5, and of a response. Method and actuator are drawn by `cargo xtask docs` from the modules of the code, whose first line each box of the actuator\n\
shows; a module that is not there is an error, and `cargo xtask docs --check` compares the drawings. Response, mode and map are computed here.\n\n\
As the paper's Figure 1, the method: offline once for an actuator and a test, online for every recording.\n\n\
![the way of a recording, from model and reference signals to the report](../figures/way-of-a-recording.svg)\n\n\
As its Figure 2, the actuator in high fidelity: electronics, machine, faults.\n\n\
![the high-fidelity model, a box a module, with the signals between them](../figures/actuator.svg)\n\n\
The response of the low-fidelity model beside the high-fidelity one: preset `ema-48`, chirp, without noise and steps of the electronics.\n\n\
![command, surface, motor speed, envelope, and its change by three faults, over time](figures/response.svg)\n\n\
As its Figure 5, the first dynamic mode of the 100 incipient reference signals of the embedded bundle, and the self-organising map of 6 by 5 neurons that is trained on\n\
place and all modes, with the points that it keeps. The signals are those that the bundle stores, rounded; its own 30 points were placed before that, by a map of its own.\n\n\
![first dynamic mode over time with the neurons of the map and the samples kept](figures/mode-and-map.svg)";
