//! Decimals of the times of a text, as written and as their values need them.

/// Share of the steps that are one step where a text writes times as finely as it knows them.
const STEADY_SHARE: f64 = 0.9;
/// Decimals of a nanosecond.
const NANO_DECIMALS: i32 = 9;

/// Decimals of the times so far.
#[derive(Debug, Default)]
pub(super) struct TimeDecimals {
    /// Most that were written.
    written: i32,
    /// Most that a value needs: noughts at the end are none.
    needed: i32,
}

impl TimeDecimals {
    /// Looks at a number as written.
    pub(super) fn look_at(&mut self, cell: &[u8]) {
        self.add(decimals(cell, false), decimals(cell, true));
    }

    /// Looks at a point in time that was written with so many decimals of the second.
    pub(super) fn look_at_stamp(&mut self, ns: i64, written: i32) {
        let zeros = (0..NANO_DECIMALS).take_while(|&place| ns % 10i64.pow(place as u32 + 1) == 0);
        self.add(written, NANO_DECIMALS - zeros.count() as i32);
    }

    fn add(&mut self, written: i32, needed: i32) {
        self.written = self.written.max(written);
        self.needed = self.needed.max(needed);
    }

    /// The unit of the last decimal of these times, in which one unit of the text is `unit_s`.
    ///
    /// Noughts at the end of all times tell nothing where times are even with them. Else the times were
    /// rounded before they were written.
    pub(super) fn quantum_s(&self, times_s: &[f64], unit_s: f64) -> f64 {
        let of = |decimals: i32| 10f64.powi(-decimals) * unit_s;
        let is_as_written = self.needed >= self.written || is_steady(times_s, of(self.written));
        of(if is_as_written { self.written } else { self.needed })
    }
}

/// Tells whether nearly all steps are one, above zero.
fn is_steady(times_s: &[f64], within_s: f64) -> bool {
    let mut steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return true;
    }
    let count = steps.len();
    let typical_s = *steps.select_nth_unstable_by(count / 2, f64::total_cmp).1;
    // half a unit in the last place more, by which arithmetic is off
    let near = steps.iter().filter(|step_s| (**step_s - typical_s).abs() <= 1.5 * within_s);
    typical_s > 0.0 && near.count() as f64 >= STEADY_SHARE * count as f64
}

/// Decimal places of a number as written, less its exponent; with or without noughts at the end.
fn decimals(cell: &[u8], without_zeros: bool) -> i32 {
    let split = cell.iter().position(|&byte| byte == b'e' || byte == b'E');
    let (mantissa, exponent) = cell.split_at(split.unwrap_or(cell.len()));
    let point = mantissa.iter().position(|&byte| byte == b'.' || byte == b',');
    let after = point.map_or(&[][..], |at| &mantissa[at + 1..]);
    let zeros = after.iter().rev().take_while(|&&byte| without_zeros && byte == b'0').count();
    let places = i32::try_from(after.len() - zeros).unwrap_or(i32::MAX);
    let exponent = exponent.get(1..).and_then(|digits| str::from_utf8(digits).ok());
    let exponent: i32 = exponent.and_then(|digits| digits.parse().ok()).unwrap_or(0);
    places.saturating_sub(exponent).clamp(-300, 300)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_counted_with_their_exponent() {
        let both = |text: &str| (decimals(text.as_bytes(), false), decimals(text.as_bytes(), true));
        assert_eq!(both("0.001000"), (6, 3));
        assert_eq!(both("1.0000e-03"), (7, 3));
        assert_eq!(both("1,5"), (1, 1));
        for (text, want) in [("12", 0), ("0.0005", 4), ("1e-4", 4), ("2.5E-3", 4), ("1e3", -3)] {
            assert_eq!(both(text), (want, want), "{text}");
        }
        assert_eq!(both("7."), (0, 0));
    }

    #[test]
    fn padding_counts_where_times_are_even_with_it() {
        let quantum = |rate_hz: f64, decimals: usize, lost: &[usize]| {
            let mut all = TimeDecimals::default();
            let rows = (0..1000).filter(|row| !lost.contains(row));
            let time = |row: usize| format!("{:.decimals$}000", row as f64 / rate_hz);
            let texts: Vec<String> = rows.map(time).collect();
            for text in &texts {
                all.look_at(text.as_bytes());
            }
            let times_s: Vec<f64> = texts.iter().map(|text| text.parse().unwrap()).collect();
            all.quantum_s(&times_s, 1.0)
        };
        assert_eq!(quantum(10_000.0, 3, &[]), 1e-3);
        assert_eq!(quantum(25_600.0, 4, &[]), 1e-4);
        assert_eq!(quantum(6000.0, 4, &[]), 1e-4);
        // the same file as one of exact times, which show each lost sample
        assert_eq!(quantum(10_000.0, 4, &[]), 1e-7);
        assert_eq!(quantum(10_000.0, 4, &[5, 100, 101]), 1e-7);
    }

    #[test]
    fn points_in_time_may_be_padded_too() {
        let mut all = TimeDecimals::default();
        all.look_at_stamp(1_795_253_400_500_000_000, 6);
        assert_eq!((all.written, all.needed), (6, 1));
        all.look_at_stamp(1_795_253_400_001_000_000, 6);
        assert_eq!((all.written, all.needed), (6, 3));
        all.look_at_stamp(0, 6);
        assert_eq!((all.written, all.needed), (6, 3));
    }
}
