//! `docs/guide/first-diagnosis.md` as it stands.

#![cfg(unix)]

use std::{fmt::Write as _, fs, path::Path};

use crate::guides::{check, run};

/// Writes `bench.csv`: a simulated recording with the names and units of a bench.
fn record(folder: &Path) {
    let damage = "--faults k1=0.02,k4=0.015 --noise-a 0.02 --adc-bits 12";
    run(folder, &format!("fdi simulate {damage} -o simulated.csv"));
    let simulated = fs::read_to_string(folder.join("simulated.csv")).unwrap();
    let rows = simulated.lines().skip_while(|line| !line.starts_with("time_s")).skip(1);
    let mut text = "# actuator-id = \"A-7\"\n# command = \"chirp\"\n# noise-a = 0.02\n\
                    t_ms,iu_mA,iv_mA,iw_mA,theta_deg\n"
        .to_owned();
    for row in rows {
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [time_s, a, b, c, angle_rad] = cells[..] else { panic!("five columns: {row}") };
        let [time_ms, a, b, c] = [time_s, a, b, c].map(|value| 1e3 * value);
        let angle_deg = angle_rad.to_degrees();
        writeln!(text, "{time_ms:.2},{a:.3},{b:.3},{c:.3},{angle_deg:.8}").unwrap();
    }
    fs::write(folder.join("bench.csv"), text).unwrap();
    fs::remove_file(folder.join("simulated.csv")).unwrap();
}

#[test]
fn what_the_guide_prints_is_what_its_commands_print() {
    let folder = tempfile::tempdir().unwrap();
    record(folder.path());
    check(include_str!("../../../../docs/guide/first-diagnosis.md"), folder.path());
}
