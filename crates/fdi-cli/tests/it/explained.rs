//! Recordings of an axis with more friction at rest than its model knows, for `fdi explain`.

use std::{fmt::Write as _, fs, path::Path};

use tempfile::TempDir;

use crate::binary::fdi;

/// Samples of a command at 500 Hz.
const SAMPLES: u32 = 1000;
/// Standard deviation of what is added to the voltage, V.
const NOISE_V: f64 = 0.02;

/// A folder with `nominal.toml` and `a.csv`, `b.csv`, `c.csv` of the axis that the model does
/// not quite describe.
pub(crate) fn machine() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/models");
    let nominal = fs::read_to_string(models.join("emps.toml")).unwrap();
    fs::write(at("nominal.toml"), &nominal).unwrap();
    let hidden = "[[effect]]\nid = \"E01\"\n\
                  parameters = { stribeck-n = 12.0, stribeck-speed-m-per-s = 0.01 }\n";
    fs::write(at("true.toml"), format!("{nominal}\n{hidden}")).unwrap();
    for (name, frequencies) in
        [("a", [3.0, 7.0, 11.0]), ("b", [2.2, 5.3, 9.1]), ("c", [2.7, 6.1, 12.7])]
    {
        fs::write(at("command.csv"), command(frequencies)).unwrap();
        let file = at(&format!("{name}.csv"));
        let (model, command) = (at("true.toml"), at("command.csv"));
        let simulate = ["simulate", "--model", &model, "--command", &command, "-o", &file];
        assert_eq!(fdi(&simulate), (0, String::new(), String::new()));
        let seed = u64::from(name.as_bytes()[0]);
        fs::write(&file, measured(&fs::read_to_string(&file).unwrap(), seed)).unwrap();
    }
    folder
}

/// A command in m, of three frequencies in rad/s.
fn command([first, second, third]: [f64; 3]) -> String {
    (0..SAMPLES).fold("time_s,command_m\n".to_owned(), |mut rows, n| {
        let t = f64::from(n) / 500.0;
        let squared = |frequency: f64| (frequency * t).sin().powi(2);
        let command_m = 0.05
            + 0.012 * (1.0 - (first * t).cos())
            + 0.006 * squared(second)
            + 0.002 * squared(third);
        writeln!(rows, "{t:.3},{command_m:.9}").unwrap();
        rows
    })
}

/// What a bench would write: noise on the voltage, and no column of the force.
fn measured(text: &str, seed: u64) -> String {
    let mut state = seed;
    let mut uniform = || {
        // Knuth's linear congruential generator: enough for noise in a test
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut columns: Option<(usize, usize)> = None;
    let mut rows = String::new();
    for line in text.lines() {
        if line.starts_with('#') {
            writeln!(rows, "{line}").unwrap();
            continue;
        }
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        let place = |name: &str| cells.iter().position(|cell| cell == name).unwrap();
        let (voltage, force) = match columns {
            Some(known) => {
                // a sum of twelve uniform numbers is near enough to normal
                let noise: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                let value: f64 = cells[known.0].parse().unwrap();
                cells[known.0] = format!("{:.6}", value + NOISE_V * noise);
                known
            }
            None => (place("voltage_v"), place("force_n")),
        };
        columns = Some((voltage, force));
        cells.remove(force);
        writeln!(rows, "{}", cells.join(",")).unwrap();
    }
    rows
}

/// The arguments of `fdi explain` on them, from within the folder.
pub(crate) const EXPLAIN: [&str; 8] =
    ["explain", "--model", "nominal.toml", "--train", "a.csv", "b.csv", "--holdout", "c.csv"];
