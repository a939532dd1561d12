//! The actuator as the high-fidelity model has it, a box a module: the FREEDOM paper's figure 2.

use std::{fs, path::Path};

use anyhow::{Context, Result, ensure};

use super::svg::{Svg, TextBox, wrapped};

const WIDTH: f64 = 240.0;
const HEIGHT: f64 = 104.0;
const MARGIN: f64 = 20.0;
/// Gaps between columns and between rows.
const GAPS: [f64; 2] = [70.0, 54.0];
const CHARACTERS: usize = 38;
const FOLDER: &str = "crates/ema-sim/src";
const MACHINE: &str = "#e8f0fb";
const ELECTRONICS: &str = "#fdf1dd";
const BESIDES: &str = "#eef6ea";

/// A block: its name, its module, and where it stands. What it is its module says in its first line.
struct Block {
    name: &'static str,
    module: &'static str,
    column: usize,
    row: usize,
    fill: &'static str,
}

const fn block(
    name: &'static str,
    module: &'static str,
    [column, row]: [usize; 2],
    fill: &'static str,
) -> Block {
    Block { name, module, column, row, fill }
}

const BLOCKS: [Block; 9] = [
    block("controller", "controller", [0, 0], ELECTRONICS),
    block("current loop, six-step", "current_loop", [1, 0], ELECTRONICS),
    block("inverter, engine of events", "engine", [2, 0], ELECTRONICS),
    block("current loop, field-oriented", "field_oriented", [1, 1], ELECTRONICS),
    block("winding and shaft", "winding", [2, 2], MACHINE),
    block("gear, play, friction, stops", "drive_train", [1, 2], MACHINE),
    block("load on the surface", "load", [0, 2], MACHINE),
    block("faults k1 to k7", "fault", [1, 3], BESIDES),
    block("shorted turns (option)", "shorted_loops", [2, 3], BESIDES),
];

/// Place of an arrow's end on a box.
#[derive(Clone, Copy)]
enum Side {
    Left,
    Right,
    LeftAt(f64),
    RightAt(f64),
    Top(f64),
    Bottom(f64),
}

/// An arrow between two blocks, with the signal that it carries.
struct Arrow {
    from: (usize, Side),
    to: (usize, Side),
    signal: &'static str,
    /// Place of the signal's name from the arrow's middle.
    off: [f64; 2],
}

const fn arrow(
    from: (usize, Side),
    to: (usize, Side),
    signal: &'static str,
    off: [f64; 2],
) -> Arrow {
    Arrow { from, to, signal, off }
}

const ARROWS: [Arrow; 15] = [
    arrow((0, Side::Right), (1, Side::Left), "I_ref", [-24.0, -5.0]),
    arrow((0, Side::Right), (3, Side::Left), "I_ref, θ_m", [-80.0, 30.0]),
    arrow((1, Side::Right), (2, Side::Left), "duty", [-24.0, -5.0]),
    arrow((2, Side::LeftAt(0.85)), (1, Side::RightAt(0.85)), "i_phase", [-24.0, 16.0]),
    arrow((3, Side::Right), (2, Side::Bottom(0.2)), "duties", [12.0, 14.0]),
    arrow((2, Side::Bottom(0.8)), (4, Side::Top(0.8)), "v_A, v_B, v_C", [-92.0, 4.0]),
    arrow((4, Side::Top(0.2)), (3, Side::Bottom(0.8)), "i_A, i_B, i_C", [14.0, -8.0]),
    arrow((4, Side::Left), (5, Side::Right), "T_m", [-24.0, -5.0]),
    arrow((5, Side::RightAt(0.85)), (4, Side::LeftAt(0.85)), "ω_m, θ_m", [-33.0, -5.0]),
    arrow((6, Side::Right), (5, Side::Left), "T_load", [-24.0, -5.0]),
    arrow((5, Side::Top(0.02)), (0, Side::Bottom(0.5)), "θ_u, θ_m, ω_m", [-112.0, 22.0]),
    arrow((7, Side::Top(0.5)), (5, Side::Bottom(0.5)), "k1, k2", [-52.0, 4.0]),
    arrow((7, Side::Top(0.9)), (4, Side::Bottom(0.2)), "k3 to k7", [-10.0, -10.0]),
    arrow((7, Side::Right), (8, Side::Left), "k3 to k5", [-30.0, -5.0]),
    arrow((8, Side::Top(0.7)), (4, Side::Bottom(0.7)), "f_A, f_B, f_C", [8.0, 4.0]),
];

impl Block {
    fn corner(&self) -> [f64; 2] {
        [
            MARGIN + self.column as f64 * (WIDTH + GAPS[0]),
            MARGIN + 20.0 + self.row as f64 * (HEIGHT + GAPS[1]),
        ]
    }

    fn at(&self, side: Side) -> [f64; 2] {
        let [left, top] = self.corner();
        match side {
            Side::Left => [left, top + HEIGHT / 2.0],
            Side::Right => [left + WIDTH, top + HEIGHT / 2.0],
            Side::LeftAt(share) => [left, top + share * HEIGHT],
            Side::RightAt(share) => [left + WIDTH, top + share * HEIGHT],
            Side::Top(share) => [left + share * WIDTH, top],
            Side::Bottom(share) => [left + share * WIDTH, top + HEIGHT],
        }
    }
}

/// First line of a module's documentation.
fn first_line(root: &Path, module: &str) -> Result<String> {
    let path = root.join(FOLDER).join(module).with_extension("rs");
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let line = text.lines().next().and_then(|line| line.strip_prefix("//! "));
    Ok(line.with_context(|| format!("{} has no first line", path.display()))?.to_owned())
}

/// The drawing.
///
/// # Errors
///
/// When a block has no module.
pub(super) fn drawing(root: &Path) -> Result<String> {
    let library = fs::read_to_string(root.join(FOLDER).join("lib.rs"))?;
    let size = [3.0 * WIDTH + 2.0 * GAPS[0], 4.0 * HEIGHT + 3.0 * GAPS[1] + 20.0];
    let mut svg = Svg::new(size[0] + 2.0 * MARGIN, size[1] + 2.0 * MARGIN);
    let [x, y] = BLOCKS[0].at(Side::Top(0.5));
    svg.down([x, y - 24.0], [x, y]);
    svg.label(x + 10.0, y - 12.0, "θ_cmd");
    for block in &BLOCKS {
        ensure!(
            library.contains(&format!("mod {};", block.module)),
            "no module `{}`",
            block.module
        );
        let [left, top] = block.corner();
        let mut lines = wrapped(&first_line(root, block.module)?, CHARACTERS);
        lines.push(format!("ema-sim/src/{}.rs", block.module));
        svg.text_box(&TextBox {
            left,
            top,
            width: WIDTH,
            height: HEIGHT,
            title: block.name,
            lines: &lines,
            fill: block.fill,
        });
    }
    for Arrow { from, to, signal, off } in &ARROWS {
        let (start, end) = (BLOCKS[from.0].at(from.1), BLOCKS[to.0].at(to.1));
        match from.1 {
            Side::Top(_) | Side::Bottom(_) => svg.down(start, end),
            _ if matches!(to.1, Side::Bottom(_)) => svg.down(start, end),
            _ => svg.across(start, end),
        }
        let middle = [f64::midpoint(start[0], end[0]), f64::midpoint(start[1], end[1])];
        svg.label(middle[0] + off[0], middle[1] + off[1], signal);
    }
    Ok(svg.finish("The high-fidelity model of the actuator, a box a module"))
}
