//! Why scalar searches over `[0, 1]` stop where they do: domain, scale of an axis, scale of the scalar.

use std::fmt::Write as _;

use anyhow::Result;
use experiments::{Contender, DiscrepancyRay, EvaluationRequest, Protocol, SeededSearches};

use super::{
    case::{Case, FEW_SEEDS, View, marks, monitor},
    kept::{Kept, Line},
    setting::request,
};
use crate::{
    median::median,
    pages::{
        figure::Rendered,
        plot::{Decades, Drawing, Panel, Place},
    },
};

/// Name of the figure.
const FIGURE: &str = "lookahead-domains.svg";
/// Size of one of its panels, px.
const PANEL: [f64; 2] = [500.0, 330.0];
/// Shares of the way from the truth to a point of the domain.
const SHARES: [f64; 11] = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0];
/// Conditions of the rays.
const RAYS: usize = 60;
/// Level below which a fault counts as found absent: half the least that is there.
const ABSENT: f64 = 0.001;

const VIEWS: [View; 5] =
    [View::Whole, View::LogOfWhole, View::Cubic, View::Logarithmic, View::Incipient];
const METHODS: [Contender; 3] = [Contender::Ei, Contender::Ucb, Contender::TwoStepEi];
const MONITORS: [Protocol; 2] = [Protocol::Low, Protocol::High];

/// Writes the explanation.
pub(super) fn write(page: &mut Rendered, kept: &Kept) -> Result<()> {
    let text = &mut page.markdown;
    writeln!(
        text,
        "\n### Why scalar searches over [0, 1] stop\n\n\
         The same searches with the levels k1 to k6 laid otherwise on the unit interval u that the surrogate sees; the first {FEW_SEEDS} of the\n\
         seeds, {} evaluations. *k = u³*: the whole of [0, 1], a third of each axis below 0.037. *Logarithmic*: k = s((1 + 1/s)^u − 1) with s = 0.002, the\n\
         least level of a test condition; half of each axis below 0.05. *ln δ*: the logarithm of the discrepancy is minimised, over the linear axes.\n\
         Average: mean over the faults of the median error, as in the tables above. *Found absent*: share of k1 to k5 that end below {ABSENT}, none of which is;\n\
         *found severe*: share that end above 0.05, none of which is.\n\n\
         | monitor | domain | method | average, % | mean error e, median, % | δ, median, A | found absent | found severe |\n\
         | --- | --- | --- | --: | --: | --: | --: | --: |",
        marks(Protocol::Low)[5] + 25
    )?;
    for problem in MONITORS {
        for view in VIEWS {
            for method in METHODS {
                row(text, kept, Case { problem, view, contenders: &[], seeds: FEW_SEEDS }, method)?;
            }
        }
    }
    let rays = [of_rays(Protocol::Low)?, of_rays(Protocol::High)?];
    rays_table(text, &rays)?;
    writeln!(
        text,
        "\n![discrepancy on the way from the truth to a point of the domain, and errors against evaluations in five views of the domain](figures/{FIGURE})"
    )?;
    page.drawings.push((FIGURE.to_owned(), figure(kept, &rays)));
    Ok(())
}

/// The searches of a method with the seeds of the explanation.
fn few<'a>(kept: &'a Kept, case: &'a Case, method: &'a str) -> Vec<&'a Line> {
    kept.of(case, method).filter(|line| line.seed < FEW_SEEDS).collect()
}

fn row(text: &mut String, kept: &Kept, case: Case, method: Contender) -> Result<()> {
    let lines = few(kept, &case, method.name());
    let Some(first) = lines.first() else { return Ok(()) };
    let of =
        |pick: &dyn Fn(&Line) -> f64| median(&lines.iter().map(|l| pick(l)).collect::<Vec<_>>());
    let faults = first.errors.len();
    let average =
        (0..faults).map(|fault| of(&|line| line.errors[fault])).sum::<f64>() / faults as f64;
    let share = |is: fn(f64) -> bool| {
        let levels = || lines.iter().flat_map(|line| &line.levels[..5]);
        100.0 * levels().filter(|level| is(**level)).count() as f64 / levels().count() as f64
    };
    writeln!(
        text,
        "| {} | {} | {} | {average:.1} | {:.1} | {:.2e} | {:.0} % | {:.0} % |",
        monitor(case.problem),
        case.view.label(),
        method.name(),
        of(&Line::error),
        of(&Line::discrepancy),
        share(|level| level < ABSENT),
        share(|level| level > 0.05),
    )?;
    Ok(())
}

fn of_rays(problem: Protocol) -> Result<Vec<DiscrepancyRay>> {
    let request = EvaluationRequest { conditions: RAYS, ..request(problem, &METHODS, None) };
    Ok(SeededSearches::prepare(&request)?.rays(&SHARES)?)
}

/// Quartiles of δ at each share.
fn quartiles(rays: &[DiscrepancyRay], at: usize) -> [f64; 3] {
    let mut values: Vec<f64> = rays.iter().map(|ray| ray.along_a[at]).collect();
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len() - 1;
    [values[last / 4], median(&values), values[last - last / 4]]
}

fn rays_table(text: &mut String, rays: &[Vec<DiscrepancyRay>; 2]) -> Result<()> {
    let heads: Vec<String> = SHARES.iter().map(f64::to_string).collect();
    writeln!(
        text,
        "\nδ on the straight way from the truth (0) to a point drawn uniformly from [0, 1]⁶ (1), median over {RAYS} conditions, A; *healthy*: at the machine\n\
         without faults, which has an error of 100 % in every level:\n\n\
         | monitor | healthy | 0 | {} |\n| --- | --: | --: |{}",
        heads.join(" | "),
        " --: |".repeat(SHARES.len())
    )?;
    for (problem, rays) in MONITORS.into_iter().zip(rays) {
        let of =
            |pick: fn(&DiscrepancyRay) -> f64| median(&rays.iter().map(pick).collect::<Vec<_>>());
        let along: Vec<String> =
            (0..SHARES.len()).map(|at| format!("{:.2e}", quartiles(rays, at)[1])).collect();
        writeln!(
            text,
            "| {} | {:.2e} | {:.2e} | {} |",
            monitor(problem),
            of(|ray| ray.at_healthy_a),
            of(|ray| ray.at_truth_a),
            along.join(" | ")
        )?;
    }
    Ok(())
}

fn figure(kept: &Kept, rays: &[Vec<DiscrepancyRay>; 2]) -> String {
    let [width, height] = PANEL;
    let title =
        "Why scalar searches over [0, 1] stop: the discrepancy around the truth, and the domain";
    let mut drawing = Drawing::new([2.0 * width, 2.0 * height + 60.0], title);
    drawing.text([16.0, 22.0], "font-size=\"15\"", title);
    for (place, (problem, rays)) in MONITORS.into_iter().zip(rays).enumerate() {
        let corner = [width * place as f64, 30.0];
        ray_panel(&mut drawing, corner, problem, rays);
        let corner = [width * place as f64, 30.0 + height];
        error_panel(&mut drawing, corner, kept, METHODS[place]);
    }
    drawing.legend([16.0, 2.0 * height + 45.0], 205.0, &VIEWS.map(View::label));
    drawing.finish()
}

fn ray_panel(drawing: &mut Drawing, corner: Place, problem: Protocol, rays: &[DiscrepancyRay]) {
    let line = |quartile: usize| -> Vec<Place> {
        let place = |(at, &share): (usize, &f64)| [share, quartiles(rays, at)[quartile]];
        SHARES.iter().enumerate().map(place).collect()
    };
    let (low, middle, high) = (line(0), line(1), line(2));
    let panel = Panel {
        frame: [corner[0], corner[1], PANEL[0], PANEL[1]],
        x: Decades::around(SHARES),
        y: Decades::around(low.iter().chain(&high).map(|[_, y]| *y)),
        title: format!("{}: δ around the truth", monitor(problem)),
        labels: ["share of the way to a point of [0, 1]⁶", "δ, A"],
    };
    panel.axes(drawing);
    panel.band(drawing, 0, &low, &high);
    panel.curve(drawing, 0, &middle);
}

/// Errors of a method with the low-fidelity monitor, a curve for each view.
fn error_panel(drawing: &mut Drawing, corner: Place, kept: &Kept, method: Contender) {
    let problem = Protocol::Low;
    let curve = |view: View| -> Vec<Place> {
        let case = Case { problem, view, contenders: &[], seeds: FEW_SEEDS };
        let lines = few(kept, &case, method.name());
        let ends = lines.first().map(|line| line.end()[0] as usize);
        let marks = marks(problem).iter().copied().chain(ends);
        let place = |mark: usize| {
            let errors: Vec<f64> =
                lines.iter().filter_map(|line| line.after(mark)).map(|point| point[2]).collect();
            (!errors.is_empty()).then(|| [mark as f64, median(&errors)])
        };
        marks.filter_map(place).collect()
    };
    let curves = VIEWS.map(curve);
    let panel = Panel {
        frame: [corner[0], corner[1], PANEL[0], PANEL[1]],
        x: Decades::around([10.0, 1000.0]),
        y: Decades::around(curves.iter().flatten().map(|[_, y]| *y)),
        title: format!("{}: mean error of {}", monitor(problem), method.name()),
        labels: ["evaluations of the model", "e, median, %"],
    };
    panel.axes(drawing);
    for (place, curve) in curves.iter().enumerate().filter(|(_, curve)| !curve.is_empty()) {
        panel.curve(drawing, place, curve);
    }
}
