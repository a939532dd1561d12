//! Points in time that are written as text: `2026-11-21 09:30:00.0001`, `09:30:00,5`,
//! `11/21/2026 9:30:00.5 AM`.

/// Nanoseconds of a day.
const DAY_NS: i64 = 86_400_000_000_000;
/// Decimals of a nanosecond.
const NANO_DECIMALS: usize = 9;

/// A point in time, or a time of day.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stamp {
    /// Nanoseconds since 1970, or since midnight.
    pub(super) ns: i64,
    /// True where a day was written.
    pub(super) has_day: bool,
    /// Decimals of the second as written.
    pub(super) decimals: i32,
}

impl Stamp {
    /// Reads `[DAY ]HH:MM:SS[.frac][zone]`, with `T` or a blank after the day, a point or a comma
    /// before decimals, and `AM` or `PM` behind them. A day is year, month, day with `-` or `/`; day,
    /// month, year with points; or month, day, year with `/`, day before month where no month is that
    /// large.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let (text, half) = Half::split(text.trim());
        let (day, clock) = match text.split_once(['T', ' ']) {
            Some((day, clock)) => (Some(days_since_1970(day)?), clock.trim()),
            None => (None, text),
        };
        let (clock, zone_s) = without_zone(clock)?;
        let mut parts = clock.split(':');
        let (hours, minutes, seconds) = (parts.next()?, parts.next()?, parts.next()?);
        let (seconds, decimals) = seconds.split_once(['.', ',']).unwrap_or((seconds, ""));
        if parts.next().is_some() || decimals.len() > NANO_DECIMALS {
            return None;
        }
        let (hours, minutes, seconds) = (whole(hours)?, whole(minutes)?, whole(seconds)?);
        let hours = half.map_or(Some(hours), |half| half.hours(hours))?;
        // a leap second is written as 60
        if hours > 23 || minutes > 59 || seconds > 60 {
            return None;
        }
        let nanos = if decimals.is_empty() { 0 } else { whole(decimals)? };
        let nanos = nanos * 10i64.pow((NANO_DECIMALS - decimals.len()) as u32);
        let of_day = ((hours * 60 + minutes) * 60 + seconds - zone_s) * 1_000_000_000 + nanos;
        let ns = day.unwrap_or(0).checked_mul(DAY_NS)?.checked_add(of_day)?;
        Some(Self { ns, has_day: day.is_some(), decimals: decimals.len() as i32 })
    }
}

/// Half of the day that a time is in.
#[derive(Clone, Copy)]
enum Half {
    Am,
    Pm,
}

impl Half {
    /// A text without `AM` or `PM` at its end, and which it was.
    fn split(text: &str) -> (&str, Option<Self>) {
        for (ending, half) in [("AM", Self::Am), ("PM", Self::Pm)] {
            let Some(at) = text.len().checked_sub(ending.len()) else { continue };
            if text.is_char_boundary(at) && text[at..].eq_ignore_ascii_case(ending) {
                return (text[..at].trim_end(), Some(half));
            }
        }
        (text, None)
    }

    /// Hours since midnight of those that a clock of twelve shows.
    fn hours(self, shown: i64) -> Option<i64> {
        let since_twelve = (1..=12).contains(&shown).then_some(shown % 12)?;
        Some(match self {
            Self::Am => since_twelve,
            Self::Pm => since_twelve + 12,
        })
    }
}

/// Seconds since the first of points in time; one of a time of day that is half a day or more
/// before the last is of the next day.
#[derive(Clone, Debug, Default)]
pub(super) struct StampClock {
    first_ns: Option<i64>,
    last_ns: i64,
    days: i64,
}

impl StampClock {
    pub(super) fn seconds(&mut self, stamp: Stamp) -> f64 {
        let mut ns = stamp.ns + self.days * DAY_NS;
        if self.first_ns.is_some() && !stamp.has_day && self.last_ns - ns >= DAY_NS / 2 {
            self.days += 1;
            ns += DAY_NS;
        }
        let first_ns = *self.first_ns.get_or_insert(ns);
        self.last_ns = ns;
        (ns - first_ns) as f64 / 1e9
    }
}

/// Digits alone.
fn whole(text: &str) -> Option<i64> {
    let is_digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    is_digits.then(|| text.parse().ok())?
}

/// A time of day without its zone, and the seconds that the zone is ahead.
fn without_zone(clock: &str) -> Option<(&str, i64)> {
    if let Some(clock) = clock.strip_suffix('Z') {
        return Some((clock, 0));
    }
    let Some(at) = clock.find(['+', '-']) else { return Some((clock, 0)) };
    let (clock, zone) = clock.split_at(at);
    let sign = if zone.starts_with('-') { -1 } else { 1 };
    let digits: String = zone[1..].chars().filter(|letter| *letter != ':').collect();
    let digits = whole(&digits).filter(|_| digits.len() == 4)?;
    Some((clock, sign * (digits / 100 * 3600 + digits % 100 * 60)))
}

/// Days from 1970-01-01 to a day of the Gregorian calendar.
///
/// # Source
/// H. Hinnant, "chrono-compatible low-level date algorithms": years begin in March, so that a leap
/// day is the last of its year.
fn days_since_1970(text: &str) -> Option<i64> {
    let apart = |separator: char| {
        let mut parts = text.split(separator);
        let three = [parts.next()?, parts.next()?, parts.next()?];
        parts.next().is_none().then_some(three)
    };
    let [year, month, day] = match apart('.') {
        Some([day, month, year]) => [year, month, day],
        None => match apart('-').or_else(|| apart('/'))? {
            [day, month, year] if year.len() == 4 && whole(month)? > 12 => [year, day, month],
            [month, day, year] if year.len() == 4 && whole(month)? > 12 => [year, day, month],
            [month, day, year] if year.len() == 4 => [year, month, day],
            as_is => as_is,
        },
    };
    if year.len() != 4 {
        return None;
    }
    let (year, month, day) = (whole(year)?, whole(month)?, whole(day)?);
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let year_of_era = year.rem_euclid(400);
    let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    Some(era * 146_097 + day_of_era - 719_468)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_and_times_are_nanoseconds() {
        let ns = |text: &str| Stamp::parse(text).map(|stamp| stamp.ns);
        assert_eq!(ns("1970-01-01T00:00:00Z"), Some(0));
        // date -u -d '2026-11-21 09:30:00' +%s
        assert_eq!(ns("2026-11-21 09:30:00"), Some(1_795_253_400_000_000_000));
        assert_eq!(ns("21.11.2026 09:30:00"), ns("2026/11/21 09:30:00"));
        assert_eq!(ns("2026-11-21T10:30:00.5+01:00"), Some(1_795_253_400_500_000_000));
        assert_eq!(ns("00:00:01,0001"), Some(1_000_100_000));
        assert_eq!(ns("11/21/2026 9:30:00 AM"), ns("2026-11-21 09:30:00"));
        assert_eq!(ns("21/11/2026 09:30:00"), ns("2026-11-21 09:30:00"));
        assert_eq!(ns("12:00:00.5 am"), Some(500_000_000));
        assert_eq!(ns("12:00:00PM"), ns("12:00:00"));
        assert_eq!(ns("13:00:00 PM"), None);
        let text = ["1.5", "12:30", "25:00:00", "2026-13-01 00:00:00", "a:b:c", "", "21.11.2026"];
        for no_stamp in text {
            assert_eq!(Stamp::parse(no_stamp), None, "{no_stamp}");
        }
        assert_eq!(Stamp::parse("09:30:00.1234").unwrap().decimals, 4);
    }

    #[test]
    fn midnight_is_passed() {
        let mut clock = StampClock::default();
        let times = ["23:59:59.5", "00:00:00.0", "00:00:00.5"];
        let seconds = times.map(|text| clock.seconds(Stamp::parse(text).unwrap()));
        assert_eq!(seconds, [0.0, 0.5, 1.0]);
    }
}
