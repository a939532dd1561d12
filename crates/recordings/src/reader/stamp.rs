//! Points in time that are written as text: `2026-11-21 09:30:00.0001`, `09:30:00,5`,
//! `11/21/2026 9:30:00.5 AM`; and elapsed times: `0 days 00:00:00.5`, `PT0.5S`, `0.5 sec`.

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
    ///
    /// Elapsed times are `N days [+]HH:MM:SS[.frac]` (pandas), `P…D T…H…M…S` of ISO 8601 without years and
    /// months, seconds with their word, and `MM:SS.frac`. A fraction may stand after a colon.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        Self::of_clock(text).or_else(|| Self::of_elapsed(text))
    }

    /// Reads an elapsed time.
    fn of_elapsed(text: &str) -> Option<Self> {
        if let Some((days, clock)) = text.split_once(" days ").or(text.split_once(" day ")) {
            let clock = Self::of_clock(clock.trim_start_matches('+'))?;
            let days = whole(days)?.checked_mul(DAY_NS)?;
            return Some(Self { ns: days.checked_add(clock.ns)?, has_day: true, ..clock });
        }
        if let Some(iso) = text.strip_prefix('P') {
            return Self::of_iso_duration(iso);
        }
        let ending = [" seconds", " second", " sec", " s"];
        if let Some(seconds) = ending.iter().find_map(|ending| text.strip_suffix(ending)) {
            return Self::of_seconds(seconds.trim_end(), 0);
        }
        // minutes and seconds; without a fraction they could be hours and minutes
        let (minutes, seconds) = text.split_once(':')?;
        if !seconds.contains(['.', ',']) || seconds.contains(':') {
            return None;
        }
        Self::of_seconds(seconds, whole(minutes)?.checked_mul(60)?)
    }

    /// Reads what follows the `P` of a duration of ISO 8601.
    fn of_iso_duration(text: &str) -> Option<Self> {
        let (days, clock) = text.split_once('T').unwrap_or((text, ""));
        let mut base_s = if days.is_empty() {
            0
        } else {
            whole(days.strip_suffix('D')?)?.checked_mul(86_400)?
        };
        let mut rest = clock;
        for (letter, seconds) in [('H', 3600), ('M', 60)] {
            if let Some((number, after)) = rest.split_once(letter) {
                base_s += whole(number)?.checked_mul(seconds)?;
                rest = after;
            }
        }
        if rest.is_empty() && text.len() > 1 {
            return Self::of_seconds("0", base_s);
        }
        Self::of_seconds(rest.strip_suffix('S')?, base_s)
    }

    /// Seconds with decimals after whole ones.
    fn of_seconds(text: &str, base_s: i64) -> Option<Self> {
        let (text, power) = match text.split_once(['e', 'E']) {
            Some((text, power)) => (text, power.parse::<i32>().ok()?),
            None => (text, 0),
        };
        let (seconds, decimals) = text.split_once(['.', ',']).unwrap_or((text, ""));
        let shown = decimals.len() as i32 - power;
        let (nanos, is_fine) = (NANO_DECIMALS as i32, decimals.len() <= 2 * NANO_DECIMALS);
        if !is_fine || !(-nanos..=2 * nanos).contains(&shown) {
            return None;
        }
        let digits = whole(&format!("{seconds}{decimals}"))?;
        let by = 10i64.checked_pow((nanos - shown).unsigned_abs())?;
        let ns = if shown <= nanos { digits.checked_mul(by)? } else { digits / by };
        let ns = base_s.checked_mul(1_000_000_000)?.checked_add(ns)?;
        Some(Self { ns, has_day: true, decimals: shown.clamp(0, nanos) })
    }

    /// Reads a point in time.
    fn of_clock(text: &str) -> Option<Self> {
        let (text, half) = Half::split(text);
        let (day, clock) = match text.split_once(['T', ' ']) {
            Some((day, clock)) => (Some(days_since_1970(day)?), clock.trim()),
            None => (None, text),
        };
        let (clock, zone_s) = without_zone(clock)?;
        let mut parts = clock.split(':');
        let (hours, minutes, seconds) = (parts.next()?, parts.next()?, parts.next()?);
        let after_colon = parts.next();
        let (seconds, decimals) = match after_colon {
            Some(decimals) => (seconds, decimals),
            None => seconds.split_once(['.', ',']).unwrap_or((seconds, "")),
        };
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
    fn elapsed_times_are_nanoseconds() {
        let read = |text: &str| Stamp::parse(text).map(|stamp| (stamp.ns, stamp.decimals));
        assert_eq!(read("0 days 00:00:00.000100"), Some((100_000, 6)));
        assert_eq!(read("1 days 00:00:01"), Some((DAY_NS + 1_000_000_000, 0)));
        assert_eq!(read("PT0S"), Some((0, 0)));
        assert_eq!(read("PT0.0001S"), Some((100_000, 4)));
        assert_eq!(read("P1DT1H1M1.5S"), Some((DAY_NS + 3_661_500_000_000, 1)));
        assert_eq!(read("0.0001 sec"), Some((100_000, 4)));
        assert_eq!(read("1e-04 sec"), Some((100_000, 4)));
        assert_eq!(read("01:00.5"), Some((60_500_000_000, 1)));
        assert_eq!(read("10:00:00:0001"), read("10:00:00.0001"));
        for no_time in ["x sec", "12:30", "1:2:3:4:5"] {
            assert_eq!(read(no_time), None, "{no_time}");
        }
    }

    #[test]
    fn midnight_is_passed() {
        let mut clock = StampClock::default();
        let times = ["23:59:59.5", "00:00:00.0", "00:00:00.5"];
        let seconds = times.map(|text| clock.seconds(Stamp::parse(text).unwrap()));
        assert_eq!(seconds, [0.0, 0.5, 1.0]);
    }
}
