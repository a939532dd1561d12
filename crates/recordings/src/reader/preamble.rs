//! Sample periods and rates in the lines before a table.

use super::number_text;

/// Lines that are looked at.
const LOOKED_AT_LINES: usize = 400;
/// Words of a line that states a rate, in lower case.
const OF_RATES: [&str; 8] =
    ["rate", "frequency", "abtastrate", "messrate", "fréquence", "frequenza", "fs", "sampling"];
/// Words of a line that states a time between samples.
const OF_PERIODS: [&str; 9] = [
    "period",
    "interval",
    "increment",
    "step",
    "sampletime",
    "abtastzeit",
    "delta",
    "dt",
    "période",
];
/// Units of rates, in hertz.
const HERTZ: [(&str, f64); 6] =
    [("hz", 1.0), ("khz", 1e3), ("mhz", 1e6), ("s/s", 1.0), ("ks/s", 1e3), ("sps", 1.0)];
/// Units of times, in seconds.
const SECONDS: [(&str, f64); 5] =
    [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("ns", 1e-9)];

/// The time between samples that the lines before a table seem to state, s; a guess, to be shown
/// and not to be taken.
pub(super) fn step_s(before: &[u8]) -> Option<f64> {
    let text = String::from_utf8_lossy(before);
    let lines: Vec<&str> = text.lines().take(LOOKED_AT_LINES).collect();
    let in_line = lines.iter().find_map(|line| of_line(line));
    in_line.or_else(|| lines.windows(2).find_map(|pair| of_column(pair[0], pair[1])))
}

/// A time between samples that stands under its name, as in the two lines of an oscilloscope's header.
fn of_column(names: &str, values: &str) -> Option<f64> {
    let cells =
        |line: &str| line.split([',', ';', '\t']).map(str::to_lowercase).collect::<Vec<_>>();
    let (names, values) = (cells(names), cells(values));
    let place = names.iter().position(|name| OF_PERIODS.contains(&name.trim()))?;
    let step_s = number_text::parse(values.get(place)?.trim(), false)?;
    (step_s.is_finite() && step_s > 0.0).then_some(step_s)
}

fn of_line(line: &str) -> Option<f64> {
    let lower = line.to_lowercase();
    let mut words = lower
        .split(|letter: char| letter.is_whitespace() || ";:=,[]()\"#".contains(letter))
        .filter(|word| !word.is_empty());
    let all: Vec<&str> = words.by_ref().collect();
    let has = |of: &[&str]| all.iter().any(|word| of.contains(word));
    let value = all.iter().find_map(|word| number_text::parse(word, false))?;
    let unit = |of: &[(&str, f64)]| {
        all.iter().find_map(|word| of.iter().find(|(name, _)| name == word).map(|(_, size)| *size))
    };
    let step_s = if has(&OF_PERIODS) {
        value * unit(&SECONDS).unwrap_or(1.0)
    } else if has(&OF_RATES) {
        (value * unit(&HERTZ).unwrap_or(1.0)).recip()
    } else {
        return None;
    };
    (step_s.is_finite() && step_s > 0.0).then_some(step_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_and_periods_are_seen() {
        for (line, step) in [
            ("Sampling rate;10000 Hz", Some(1e-4)),
            ("Messrate: 10 kHz", Some(1e-4)),
            ("Sample period: 0.1 ms", Some(1e-4)),
            ("Sample Interval,1.0e-04", Some(1e-4)),
            ("SampleTime[ms]\t0.1", Some(1e-4)),
            ("X,CH1,Start,Increment,\nSequence,A,0.0e+00,1.0e-04,", Some(1e-4)),
            ("Drive X-7", None),
            ("rate: unknown", None),
        ] {
            let found = step_s(line.as_bytes());
            let near = |(found, step): (f64, f64)| (found / step - 1.0).abs() < 1e-12;
            assert!(
                found.is_some() == step.is_some() && found.zip(step).is_none_or(near),
                "{line}"
            );
        }
    }
}
