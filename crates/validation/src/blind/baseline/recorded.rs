//! A recording as its file has it.

use std::{fs, path::Path};

use anyhow::{Context, Result, bail};

/// Columns of a recording, by sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Recorded {
    pub(super) rate_hz: f64,
    pub(super) start_rad: f64,
    pub(super) time_s: Vec<f64>,
    pub(super) angle_rad: Vec<f64>,
    pub(super) current_a: Vec<f64>,
    pub(super) load_n_m: Vec<f64>,
}

impl Recorded {
    /// Reads a CSV file with its metadata.
    pub(super) fn read(file: &Path) -> Result<Self> {
        let text = fs::read_to_string(file).with_context(|| file.display().to_string())?;
        Self::parse(&text).with_context(|| file.display().to_string())
    }

    fn parse(text: &str) -> Result<Self> {
        let said = |key: &str| -> Option<f64> {
            let line = text.lines().find_map(|l| l.strip_prefix("# ")?.strip_prefix(key))?;
            line.trim_start().strip_prefix('=')?.trim().parse().ok()
        };
        let mut all = Self {
            rate_hz: said("rate-hz").context("no rate")?,
            start_rad: said("start-angle-rad").unwrap_or(0.0),
            ..Self::default()
        };
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let names: Vec<&str> = lines.next().context("no columns")?.split(',').collect();
        let place = |wanted: &[&str]| {
            let found = names.iter().position(|name| wanted.contains(name));
            found.with_context(|| format!("no column {wanted:?}"))
        };
        let (time, angle) = (place(&["time_s"])?, place(&["motor_angle_rad"])?);
        let current = place(&["current_a", "q_axis_current_a"])?;
        let load = place(&["load_n_m"])?;
        for line in lines {
            let row: Vec<f64> = line.split(',').filter_map(|field| field.parse().ok()).collect();
            if row.len() != names.len() {
                bail!("`{line}` is not {} numbers", names.len());
            }
            all.time_s.push(row[time]);
            all.angle_rad.push(row[angle]);
            all.current_a.push(row[current]);
            all.load_n_m.push(row[load]);
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_in_any_order() {
        let text = "# rate-hz = 2000.0\n# start-angle-rad = -0.5\ntime_s,load_n_m,q_axis_current_a,command_rad,motor_angle_rad\n0,1,2,3,4\n0.0005,5,6,7,8\n";
        let all = Recorded::parse(text).unwrap();
        assert_eq!((all.rate_hz, all.start_rad), (2000.0, -0.5));
        assert_eq!((all.load_n_m[1], all.current_a[1], all.angle_rad[1]), (5.0, 6.0, 8.0));
        assert!(Recorded::parse(&text.replace("8\n", "x\n")).is_err());
    }
}
