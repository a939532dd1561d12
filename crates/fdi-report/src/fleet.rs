//! A fleet over time: how the levels of each actuator differ from its reference recording.

use std::collections::BTreeMap;

use recordings::RecordingDate;

use crate::document::{
    ActuatorTrend, Change, Fault, FaultChange, FaultId, Fleet, LeftOut, RecordDiagnosis,
    SCHEMA_VERSION, Slope, TrendPoint, Verdict,
};

/// Standard deviations beyond which a change is more than noise: 0.003 of the differences of an
/// actuator that does not change are beyond, on either side.
const SIGNIFICANCE: f64 = 2.968;

impl Fleet {
    /// The trends of the actuators that the diagnoses are of.
    ///
    /// Changes are counted from the earliest recording of each actuator that the model explains.
    /// Levels of recordings that it does not explain are told and not judged. The standard
    /// deviation of a difference takes both levels for independent: an error of the model that
    /// they share is counted twice, so that it is too large rather than too small.
    pub fn of(records: &[RecordDiagnosis], tool: &str, warning_change: f64) -> Self {
        let mut by_actuator: BTreeMap<&str, Vec<Dated<'_>>> = BTreeMap::new();
        let mut left_out = Vec::new();
        for record in records {
            match Dated::of(record) {
                Ok((id, dated)) => by_actuator.entry(id).or_default().push(dated),
                Err(reason) => left_out.push(LeftOut {
                    recording: record.recording.clone(),
                    reason: reason.to_owned(),
                }),
            }
        }
        let actuators = by_actuator
            .into_iter()
            .filter_map(|(id, dated)| trend(id, dated, warning_change))
            .collect();
        Self {
            schema_version: SCHEMA_VERSION,
            tool: tool.to_owned(),
            warning_change,
            significance: SIGNIFICANCE,
            actuators,
            left_out,
        }
    }

    /// Places of the latest believed recording of each actuator (of its latest, where none is), and of each
    /// recording without an actuator or a date, in the order of the input.
    pub(crate) fn latest(records: &[RecordDiagnosis]) -> Vec<usize> {
        let mut latest: BTreeMap<&str, ((bool, f64), usize)> = BTreeMap::new();
        let mut places = Vec::new();
        for (place, record) in records.iter().enumerate() {
            match Dated::of(record) {
                Ok((id, dated)) => {
                    let rank = (record.is_believed(), dated.day);
                    let known = latest.entry(id).or_insert((rank, place));
                    if rank >= known.0 {
                        *known = (rank, place);
                    }
                }
                Err(_) => places.push(place),
            }
        }
        places.extend(latest.into_values().map(|(_, place)| place));
        places.sort_unstable();
        places
    }

    /// True where the first of two dates is later than the second.
    pub(crate) fn is_later(date: &str, than: &str) -> bool {
        let [day, other] = [date, than].map(|text| day_number(&RecordingDate::parse(text)?));
        day.zip(other).is_some_and(|(day, other)| day > other)
    }

    /// Least rise of a level that is a warning, where the difference has the standard deviation `std`.
    pub(crate) fn seen_from(&self, std: f64) -> f64 {
        self.warning_change.max(self.significance * std)
    }

    /// The trends as CSV: a header, and one row for each level of each recording.
    pub fn to_csv(&self) -> String {
        let mut text = String::from(
            "actuator_id,date,days,recording,verdict,reference,fault,value,std,difference,\
             difference_std,change\n",
        );
        for trend in &self.actuators {
            for point in &trend.points {
                for fault in &point.faults {
                    let cell = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
                    let row = [
                        quoted(&trend.actuator_id),
                        point.date.clone(),
                        point.days.to_string(),
                        quoted(&point.recording),
                        point.verdict.to_string(),
                        quoted(&trend.reference),
                        fault.id.to_string(),
                        fault.value.to_string(),
                        fault.std.to_string(),
                        cell(fault.difference),
                        cell(fault.difference_std),
                        fault.change.map_or("", Change::word).to_owned(),
                    ];
                    text.push_str(&row.join(","));
                    text.push('\n');
                }
            }
        }
        text
    }
}

/// A cell of CSV (RFC 4180), in quotes where it needs them.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// A diagnosis with its time.
struct Dated<'a> {
    record: &'a RecordDiagnosis,
    date: &'a str,
    day: f64,
}

impl<'a> Dated<'a> {
    /// The actuator with it, or why it is in no trend.
    fn of(record: &'a RecordDiagnosis) -> Result<(&'a str, Self), &'static str> {
        let id = record.actuator_id.as_deref().ok_or("no actuator id")?;
        let date = record.date.as_deref().ok_or("no date")?;
        let parsed = RecordingDate::parse(date).ok_or("not a date")?;
        Ok((id, Self { record, date, day: day_number(&parsed).ok_or("not a date")? }))
    }

    fn explained(&self) -> bool {
        self.record.is_believed()
    }
}

fn trend(id: &str, mut dated: Vec<Dated<'_>>, warning_change: f64) -> Option<ActuatorTrend> {
    // recordings of one time stay in the order of the input
    dated.sort_by(|a, b| a.day.total_cmp(&b.day));
    let reference = dated.iter().find(|one| one.explained()).or(dated.first())?;
    let points: Vec<TrendPoint> = dated
        .iter()
        .map(|one| TrendPoint {
            recording: one.record.recording.clone(),
            date: one.date.to_owned(),
            days: one.day - reference.day,
            verdict: one.record.verdict,
            faults: changes(one, reference.record, warning_change),
        })
        .collect();
    let latest = points.iter().rev().find(|point| point.is_judged());
    let gravest = latest.and_then(|point| point.faults.iter().filter_map(|f| f.change).max());
    Some(ActuatorTrend {
        actuator_id: id.to_owned(),
        reference: reference.record.recording.clone(),
        reference_date: reference.date.to_owned(),
        change: gravest.unwrap_or(Change::Steady),
        slopes: slopes(&points),
        points,
    })
}

/// The levels of a recording against those of the reference.
fn changes(one: &Dated<'_>, reference: &RecordDiagnosis, warning: f64) -> Vec<FaultChange> {
    let determined = |fault: &Fault| Some((fault.value?, fault.std?));
    let of = |fault: &Fault| {
        let (value, std) = determined(fault)?;
        let from = reference.fault(fault.id).and_then(determined);
        let difference = from.map(|(was, _)| value - was);
        let difference_std = from.map(|(_, was)| std.hypot(was));
        let change = difference.zip(difference_std).filter(|_| one.explained()).map(|(d, s)| {
            if d.abs() <= SIGNIFICANCE * s {
                Change::Steady
            } else if d >= warning {
                Change::Warning
            } else {
                Change::Changed
            }
        });
        Some(FaultChange { id: fault.id, value, std, difference, difference_std, change })
    };
    // k7 is a direction and no damage of its own
    one.record.faults.iter().filter(|fault| fault.id != FaultId::K7).filter_map(of).collect()
}

/// Weighted least squares of the level over time, one line a fault.
fn slopes(points: &[TrendPoint]) -> Vec<Slope> {
    let line = |id: FaultId| {
        let samples: Vec<(f64, f64, f64)> = points
            .iter()
            .filter(|point| point.verdict != Verdict::ModelInadequate)
            .filter_map(|point| {
                let fault = point.faults.iter().find(|fault| fault.id == id)?;
                (fault.std > 0.0).then(|| (point.days, fault.value, fault.std.powi(-2)))
            })
            .collect();
        let weight: f64 = samples.iter().map(|(.., w)| w).sum();
        let mean = |pick: fn(&(f64, f64, f64)) -> f64| {
            samples.iter().map(|sample| sample.2 * pick(sample)).sum::<f64>() / weight
        };
        let (day, level) = (mean(|s| s.0), mean(|s| s.1));
        let spread: f64 = samples.iter().map(|(d, _, w)| w * (d - day) * (d - day)).sum();
        let cross: f64 = samples.iter().map(|(d, v, w)| w * (d - day) * (v - level)).sum();
        (spread > 0.0).then(|| Slope {
            id,
            per_day: cross / spread,
            per_day_std: spread.sqrt().recip(),
        })
    };
    FaultId::ALL.into_iter().filter_map(line).collect()
}

/// Days since 1970-01-01 in UTC; without an offset the time is taken for UTC.
fn day_number(date: &RecordingDate) -> Option<f64> {
    let text = date.as_str();
    let mut parts = text.get(..10)?.split('-').map(str::parse::<i64>);
    let (year, month, day) = (parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?);
    let time = text.get(11..).unwrap_or("");
    let (clock, offset_s) = match time.find(['Z', 'z', '+', '-']) {
        Some(at) => (&time[..at], offset_s(&time[at..])?),
        None => (time, 0.0),
    };
    Some(civil_day(year, month, day) as f64 + (seconds(clock)? - offset_s) / 86_400.0)
}

/// Seconds of a clock such as `09:30:00.5`, zero where there is none.
fn seconds(clock: &str) -> Option<f64> {
    if clock.is_empty() {
        return Some(0.0);
    }
    let units = [3600.0, 60.0, 1.0];
    clock.split(':').zip(units).map(|(part, unit)| Some(unit * part.parse::<f64>().ok()?)).sum()
}

/// Seconds that an offset such as `+01:00` is ahead of UTC.
fn offset_s(text: &str) -> Option<f64> {
    let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
    let clock = text.trim_start_matches(['Z', 'z', '+', '-']);
    Some(sign * seconds(clock)?)
}

/// Days from 1970-01-01 to a day of the Gregorian calendar (Hinnant, "chrono-Compatible Low-Level
/// Date Algorithms", `days_from_civil`).
fn civil_day(year: i64, month: i64, day: i64) -> i64 {
    let year = year - i64::from(month <= 2);
    let era = year.div_euclid(400);
    let of_era = year.rem_euclid(400);
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::tests::record;
    use approx::assert_abs_diff_eq;

    fn taken(id: &str, date: &str, k1: f64) -> RecordDiagnosis {
        let mut record = record();
        record.recording = format!("{id}_{date}.csv");
        record.actuator_id = Some(id.to_owned());
        record.date = Some(date.to_owned());
        let interval = [k1 - 0.002, k1 + 0.002];
        record.faults[0] = Fault::determined(FaultId::K1, k1, 0.001, interval, Some(true));
        record
    }

    /// Against `date --utc --date TEXT +%s` of GNU coreutils 9.1, over 86400.
    #[test]
    fn versus_coreutils_days() {
        for (text, seconds) in [
            ("1970-01-01", 0.0),
            ("2000-02-29", 951_782_400.0),
            ("2026-11-21T12:00:00Z", 1_795_262_400.0),
            ("2026-11-21T12:00:00+01:30", 1_795_257_000.0),
            ("1969-12-31T12:00:00", -43_200.0),
        ] {
            let date = RecordingDate::parse(text).unwrap();
            assert_eq!(day_number(&date), Some(seconds / 86_400.0), "{text}");
        }
    }

    #[test]
    fn changes_are_from_the_earliest_recording_that_is_explained() {
        let mut strange = taken("A", "2025-12-01", 0.3);
        strange.verdict = Verdict::ModelInadequate;
        let records = [
            taken("A", "2026-03-01", 0.031),
            taken("A", "2026-01-30", 0.0055),
            strange,
            taken("A", "2025-12-31", 0.004),
            taken("B", "2026-01-01", 0.02),
        ];
        let fleet = Fleet::of(&records, "fdi", 0.02);
        let [a, b] = fleet.actuators.as_slice() else { panic!("two actuators") };
        assert_eq!((a.reference_date.as_str(), a.change), ("2025-12-31", Change::Warning));
        assert_eq!((b.change, b.slopes.len()), (Change::Steady, 0));
        let days: Vec<f64> = a.points.iter().map(|point| point.days).collect();
        assert_eq!(days, [-30.0, 0.0, 30.0, 60.0]);
        let judged: Vec<_> = a.points.iter().map(|point| point.faults[0].change).collect();
        let (steady, warning) = (Some(Change::Steady), Some(Change::Warning));
        assert_eq!(judged, [None, steady, steady, warning]);
        // of (0, 4), (30, 5.5), (60, 31) thousandths: 27 in 60 days
        assert_abs_diff_eq!(a.slopes[0].per_day, 0.027 / 60.0, epsilon = 1e-12);
        assert_abs_diff_eq!(a.slopes[0].per_day_std, 0.001 / 1800f64.sqrt(), epsilon = 1e-12);
    }

    #[test]
    fn the_latest_is_that_which_is_believed() {
        let mut strange = taken("A", "2026-03-01", 0.3);
        strange.verdict = Verdict::ModelInadequate;
        let mut other = strange.clone();
        other.actuator_id = Some("B".to_owned());
        let records =
            [taken("A", "2026-01-01", 0.0), taken("A", "2026-02-01", 0.1), strange, other];
        assert_eq!(Fleet::latest(&records), [1, 3]);
        assert!(Fleet::is_later("2026-03-01", "2026-02-01T09:30:00Z"));
        assert!(!Fleet::is_later("soon", "2026-02-01"));
    }

    #[test]
    fn what_has_no_name_or_date_is_in_no_trend_and_said() {
        let nameless = record();
        let mut undated = taken("A", "2026-01-01", 0.0);
        undated.date = None;
        let fleet = Fleet::of(&[nameless, undated], "fdi", 0.02);
        assert!(fleet.actuators.is_empty());
        let reasons: Vec<_> = fleet.left_out.iter().map(|one| one.reason.as_str()).collect();
        assert_eq!(reasons, ["no actuator id", "no date"]);
    }

    #[test]
    fn rows_have_the_columns_of_the_header() {
        let fleet = Fleet::of(&[taken("A, left", "2026-01-01", 0.01)], "fdi", 0.02);
        let csv = fleet.to_csv();
        let lines: Vec<_> = csv.lines().collect();
        assert_eq!(lines.len(), 2);
        let want = "\"A, left\",2026-01-01,0,\"A, left_2026-01-01.csv\",faulty,";
        assert!(lines[1].starts_with(want), "{csv}");
        assert!(lines[1].ends_with(",k1,0.01,0.001,0,0.001414213562373095,steady"), "{csv}");
    }
}
