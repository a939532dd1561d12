//! Metadata that a recording states: TOML in `#` lines before the header.

use std::{borrow::Cow, fmt, ops::RangeInclusive, str::FromStr};

use toml::de::{DeTable, DeValue};

use crate::{
    METADATA_KEYS, MetadataKey, RecordError, metadata_key::keys, nearest::nearest,
    property::Property,
};

/// Metadata that a recording states; all of it is optional.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// `actuator-id`: which actuator it is of.
    pub actuator_id: Option<String>,
    /// `date`: when it was taken.
    pub date: Option<RecordingDate>,
    /// `operator`: who took it.
    pub operator: Option<String>,
    /// `session`: which session of the actuator, such as a day on a bench, it was taken in.
    pub session: Option<String>,
    /// `command`: what was commanded.
    pub command: Option<CommandSource>,
    /// `rate-hz`: the file's own sample rate, Hz.
    pub rate_hz: Option<f64>,
    /// `filter-hz`: corner of the filter that `current_a` went through, Hz; of the drive's low-pass of
    /// first order that `q_axis_current_a` did.
    pub filter_hz: Option<f64>,
    /// `envelope`: which envelope `current_a` is.
    pub envelope: Option<EnvelopeKind>,
    /// `start-angle-rad`: mechanical rotor angle at the first sample, rad.
    pub start_angle_rad: Option<f64>,
    /// `noise-a`: rms of the noise on each phase per sample, A.
    pub noise_a: Option<f64>,
    /// `phase-rate-hz`: rate of the phase samples that `noise_a` is of, Hz.
    pub phase_rate_hz: Option<f64>,
    /// `winding-temperature-k`: temperature of the motor's winding, K.
    pub winding_temperature_k: Option<f64>,
    /// `winding-temperature-sd-k`: standard deviation of that temperature, K.
    pub winding_temperature_std_k: Option<f64>,
    /// `load-n-m`: constant load torque on the surface, N·m.
    pub load_n_m: Option<f64>,
}

/// The command that a recording was taken with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CommandSource {
    /// The command of the recording's command channel.
    Recorded,
    /// A command with a name, such as `chirp` or `sine`.
    Named(String),
}

/// The definition of the stator-current envelope in `current_a`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvelopeKind {
    /// `half-abs-sum`: half the sum of the absolute phase currents.
    HalfAbsSum,
    /// `signed-projection`: projection on the commutation pattern.
    SignedProjection,
    /// `q-axis`: the quadrature-axis current of a sinusoidal drive.
    QAxis,
    /// `conducting-phase`: the phase that goes on conducting.
    ConductingPhase,
}

impl EnvelopeKind {
    /// Every envelope.
    pub const ALL: [Self; 4] =
        [Self::HalfAbsSum, Self::SignedProjection, Self::QAxis, Self::ConductingPhase];

    /// The name in metadata and bundles.
    pub fn name(self) -> &'static str {
        match self {
            Self::HalfAbsSum => "half-abs-sum",
            Self::SignedProjection => "signed-projection",
            Self::QAxis => "q-axis",
            Self::ConductingPhase => "conducting-phase",
        }
    }

    /// The envelope of that name, if there is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|envelope| envelope.name() == name)
    }
}

impl fmt::Display for EnvelopeKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A date, with or without time, as RFC 3339 writes it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RecordingDate(String);

impl RecordingDate {
    /// The date if `text` is one, such as `2026-11-21` or `2026-11-21T09:30:00Z`.
    pub fn parse(text: &str) -> Option<Self> {
        let date = toml::value::Datetime::from_str(text).ok()?;
        let exists = |day: toml::value::Date| {
            let leap = day.year.is_multiple_of(4)
                && (!day.year.is_multiple_of(100) || day.year.is_multiple_of(400));
            let last = match day.month {
                2 => 28 + u8::from(leap),
                4 | 6 | 9 | 11 => 30,
                _ => 31,
            };
            (1..=last).contains(&day.day)
        };
        date.date.is_some_and(exists).then(|| Self(date.to_string()))
    }

    /// As RFC 3339 text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for RecordingDate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The error of a line `KEY: VALUE` with a key of the metadata.
fn with_colon(text: &str, line: u64) -> Option<RecordError> {
    let (key, value) = text.split_once(':').map(|(key, value)| (key.trim(), value.trim()))?;
    let MetadataKey { name, kind, .. } = METADATA_KEYS.into_iter().find(|row| row.name == key)?;
    let is_whole = kind == "number" || value.starts_with(['"', '\'']);
    let value = if is_whole { value.to_owned() } else { quoted(value) };
    let expected = format!("{name} = {value}");
    DeTable::parse(&expected).is_ok().then_some(())?;
    Some(RecordError::MetadataColon { line, key: name, expected })
}

impl Metadata {
    /// Reads the TOML text; line 1 of it is line `first_line` of the file.
    pub(super) fn parse(text: &str, first_line: u64) -> Result<Self, RecordError> {
        let line_at = |byte: usize| {
            let before = text.as_bytes().iter().take(byte);
            first_line + before.filter(|&&b| b == b'\n').count() as u64
        };
        let table = DeTable::parse(text).map_err(|error| {
            let line = line_at(error.span().map_or(0, |span| span.start));
            let own = text.lines().nth((line - first_line) as usize).unwrap_or_default();
            with_colon(own, line).unwrap_or_else(|| RecordError::MetadataSyntax {
                line,
                reason: error.message().lines().next().unwrap_or_default().to_owned(),
            })
        })?;
        let mut entries: Vec<_> = table.get_ref().iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let mut metadata = Self::default();
        for (key, value) in entries {
            let field = Field { line: line_at(key.span().start), value: value.get_ref() };
            metadata.set(key.get_ref(), &field)?;
        }
        Ok(metadata)
    }

    fn set(&mut self, key: &str, field: &Field<'_>) -> Result<(), RecordError> {
        match key {
            "actuator-id" => self.actuator_id = Some(field.text("actuator-id")?),
            "date" => self.date = Some(field.date()?),
            "operator" => self.operator = Some(field.text("operator")?),
            "session" => self.session = Some(field.text("session")?),
            "command" => self.command = Some(field.command()?),
            "rate-hz" => self.rate_hz = Some(field.number("rate-hz", POSITIVE)?),
            "filter-hz" => self.filter_hz = Some(field.number("filter-hz", POSITIVE)?),
            "envelope" => self.envelope = Some(field.envelope()?),
            "start-angle-rad" => {
                self.start_angle_rad = Some(field.number("start-angle-rad", FINITE)?);
            }
            "noise-a" => self.noise_a = Some(field.number("noise-a", NOT_NEGATIVE)?),
            "phase-rate-hz" => self.phase_rate_hz = Some(field.number("phase-rate-hz", POSITIVE)?),
            "winding-temperature-k" => {
                let key = "winding-temperature-k";
                self.winding_temperature_k = Some(field.number(key, TEMPERATURE_K)?);
            }
            "winding-temperature-sd-k" => {
                let key = "winding-temperature-sd-k";
                self.winding_temperature_std_k = Some(field.number(key, POSITIVE)?);
            }
            "load-n-m" => self.load_n_m = Some(field.number("load-n-m", FINITE)?),
            _ => {
                let (line, key) = (field.line, key.to_owned());
                return Err(match nearest(&key, keys()) {
                    Some(nearest) => RecordError::MetadataKeyMisspelt { line, key, nearest },
                    None => RecordError::MetadataKey { line, key },
                });
            }
        }
        Ok(())
    }

    /// Sets a key from a value that is no line of a text.
    ///
    /// # Errors
    /// [`RecordError::MetadataKey`] or [`RecordError::MetadataKeyMisspelt`] for an unknown key,
    /// [`RecordError::Property`] for a value that the key does not take.
    pub fn set_property(&mut self, key: &str, property: &Property) -> Result<(), RecordError> {
        let text = match property {
            Property::Number(value) => format!("{key} = {value:?}"),
            // a number that was stored as text is a number
            Property::Text(text) if text.parse::<f64>().is_ok_and(f64::is_finite) => {
                let wants_text =
                    METADATA_KEYS.iter().any(|row| row.name == key && row.kind != "number");
                if wants_text {
                    format!("{key} = {}", quoted(text))
                } else {
                    format!("{key} = {:?}", text.parse::<f64>().unwrap_or_default())
                }
            }
            Property::Text(text) => format!("{key} = {}", quoted(text)),
        };
        let table = DeTable::parse(&text).map_err(|error| RecordError::MetadataSyntax {
            line: 1,
            reason: error.message().to_owned(),
        })?;
        for (key, value) in table.get_ref() {
            let field = Field { line: 1, value: value.get_ref() };
            self.set(key.get_ref(), &field).map_err(|error| match error {
                RecordError::MetadataValue { key, expected, found, .. } => {
                    RecordError::Property { key, expected, found }
                }
                other => other,
            })?;
        }
        Ok(())
    }

    /// As TOML, one key a line; reading it again gives the same.
    pub fn to_toml(&self) -> String {
        let number = |value: Option<f64>| value.map(|value| format!("{value:?}"));
        let command = self.command.as_ref().map(|command| match command {
            CommandSource::Recorded => "recorded",
            CommandSource::Named(name) => name,
        });
        let values = [
            self.actuator_id.as_deref().map(quoted),
            self.date.as_ref().map(|date| quoted(date.as_str())),
            self.operator.as_deref().map(quoted),
            self.session.as_deref().map(quoted),
            command.map(quoted),
            number(self.rate_hz),
            number(self.filter_hz),
            self.envelope.map(|envelope| quoted(envelope.name())),
            number(self.start_angle_rad),
            number(self.noise_a),
            number(self.phase_rate_hz),
            number(self.winding_temperature_k),
            number(self.winding_temperature_std_k),
            number(self.load_n_m),
        ];
        let lines = keys().into_iter().zip(values);
        lines.filter_map(|(key, value)| Some(format!("{key} = {}\n", value?))).collect()
    }
}

/// Temperatures of a winding: one outside of them is in another unit.
pub const WINDING_TEMPERATURES_K: RangeInclusive<f64> = 150.0..=600.0;

/// Range that a number in the metadata may be in.
#[derive(Clone, Copy)]
struct Range {
    expected: &'static str,
    holds: fn(f64) -> bool,
}

const FINITE: Range = Range { expected: "a number", holds: f64::is_finite };
const POSITIVE: Range =
    Range { expected: "a positive number", holds: |value| value.is_finite() && value > 0.0 };
const TEMPERATURE_K: Range = Range {
    expected: "a temperature of 150 to 600 K",
    holds: |value| WINDING_TEMPERATURES_K.contains(&value),
};
const NOT_NEGATIVE: Range = Range {
    expected: "a number that is not negative",
    holds: |value| value.is_finite() && value >= 0.0,
};

/// A value of the metadata and where it stands.
struct Field<'a> {
    line: u64,
    value: &'a DeValue<'a>,
}

impl Field<'_> {
    fn number(&self, key: &'static str, range: Range) -> Result<f64, RecordError> {
        let digits = match self.value {
            DeValue::Integer(integer) if integer.radix() == 10 => Some(integer.as_str()),
            DeValue::Float(float) => Some(float.as_str()),
            _ => None,
        };
        digits
            .and_then(|digits| digits.parse().ok())
            .filter(|&value| (range.holds)(value))
            .ok_or_else(|| self.refuse(key, range.expected))
    }

    fn text(&self, key: &'static str) -> Result<String, RecordError> {
        match self.value {
            DeValue::String(text) if !text.is_empty() => Ok(text.clone().into_owned()),
            _ => Err(self.refuse(key, "a text")),
        }
    }

    fn date(&self) -> Result<RecordingDate, RecordError> {
        let text = match self.value {
            DeValue::String(text) => Cow::Borrowed(text.as_ref()),
            DeValue::Datetime(date) => Cow::Owned(date.to_string()),
            _ => Cow::Borrowed(""),
        };
        RecordingDate::parse(&text).ok_or_else(|| self.refuse("date", "a date such as 2026-11-21"))
    }

    fn command(&self) -> Result<CommandSource, RecordError> {
        let expected = "a name such as \"chirp\", or \"recorded\"";
        let name = self.text("command").map_err(|_| self.refuse("command", expected))?;
        Ok(if name == "recorded" { CommandSource::Recorded } else { CommandSource::Named(name) })
    }

    fn envelope(&self) -> Result<EnvelopeKind, RecordError> {
        let expected =
            "\"half-abs-sum\", \"signed-projection\", \"q-axis\" or \"conducting-phase\"";
        match self.value {
            DeValue::String(name) => EnvelopeKind::from_name(name),
            _ => None,
        }
        .ok_or_else(|| self.refuse("envelope", expected))
    }

    fn refuse(&self, key: &'static str, expected: &'static str) -> RecordError {
        let found = match self.value {
            DeValue::String(text) => quoted(text),
            DeValue::Integer(integer) => integer.as_str().to_owned(),
            DeValue::Float(float) => float.as_str().to_owned(),
            DeValue::Boolean(truth) => truth.to_string(),
            DeValue::Datetime(date) => date.to_string(),
            DeValue::Array(_) => "an array".to_owned(),
            DeValue::Table(_) => "a table".to_owned(),
        };
        RecordError::MetadataValue { line: self.line, key, expected, found }
    }
}

/// A TOML basic string on one line.
fn quoted(text: &str) -> String {
    use fmt::Write;
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for letter in text.chars() {
        match letter {
            '"' | '\\' => out.extend(['\\', letter]),
            control if control.is_control() => {
                write!(out, "\\u{:04X}", u32::from(control)).expect("a String takes all text");
            }
            other => out.push(other),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_every_key() {
        let text = "actuator-id = \"A-7\"\ndate = 2026-11-21\ncommand = \"recorded\"\nrate-hz = \
                    10_000\nfilter-hz = 200.0\nenvelope = \"q-axis\"\nstart-angle-rad = -0.5\n\
                    noise-a = 0.02\nphase-rate-hz = 1e4\nsession = \"bench 2\"\n\
                    operator = \"M. Rossi\"\n\
                    winding-temperature-k = 310\nwinding-temperature-sd-k = 2.0\nload-n-m = -1.5\n";
        let metadata = Metadata::parse(text, 1).unwrap();
        assert_eq!(metadata.actuator_id.as_deref(), Some("A-7"));
        assert_eq!(metadata.date.as_ref().unwrap().as_str(), "2026-11-21");
        assert_eq!(metadata.command, Some(CommandSource::Recorded));
        assert_eq!(metadata.envelope, Some(EnvelopeKind::QAxis));
        let numbers = [
            metadata.rate_hz,
            metadata.filter_hz,
            metadata.start_angle_rad,
            metadata.noise_a,
            metadata.phase_rate_hz,
            metadata.winding_temperature_k,
            metadata.winding_temperature_std_k,
            metadata.load_n_m,
        ];
        let expected = [10_000.0, 200.0, -0.5, 0.02, 10_000.0, 310.0, 2.0, -1.5];
        assert_eq!(numbers.map(Option::unwrap), expected);
        assert_eq!(metadata.session.as_deref(), Some("bench 2"));
        assert_eq!(metadata.operator.as_deref(), Some("M. Rossi"));
        assert_eq!(metadata.to_toml().lines().count(), METADATA_KEYS.len());
    }

    #[test]
    fn says_what_is_wrong_with_a_value() {
        let error = |text: &str| Metadata::parse(text, 1).unwrap_err().to_string();
        assert_eq!(
            error("noise-a = 1\nrate_hz = 2000"),
            "line 2: unknown metadata key `rate_hz`; did you mean `rate-hz`?"
        );
        assert_eq!(
            error("sensor-serial = 7"),
            "line 1: unknown metadata key `sensor-serial`; the keys are `actuator-id`, `date`, \
             `operator`, `session`, `command`, `rate-hz`, `filter-hz`, `envelope` and 6 more"
        );
        assert_eq!(
            error("rate-hz = \"fast\""),
            "line 1: metadata `rate-hz`: expected a positive number, found \"fast\""
        );
        assert_eq!(
            error("noise-a = inf"),
            "line 1: metadata `noise-a`: expected a number that is not negative, found inf"
        );
        assert_eq!(
            error("envelope = \"abs-sum\""),
            "line 1: metadata `envelope`: expected \"half-abs-sum\", \"signed-projection\", \
             \"q-axis\" or \"conducting-phase\", found \"abs-sum\""
        );
        assert_eq!(
            error("date = \"yesterday\""),
            "line 1: metadata `date`: expected a date such as 2026-11-21, found \"yesterday\""
        );
        assert_eq!(
            error("command = 3"),
            "line 1: metadata `command`: expected a name such as \"chirp\", or \"recorded\", found 3"
        );
        assert_eq!(
            error("noise-a = 1\nactuator-id: A-7\n"),
            "line 2: metadata `actuator-id`: expected `actuator-id = \"A-7\"`, found a colon after the key"
        );
        assert!(error("rate-hz: 2000").contains("expected `rate-hz = 2000`"));
        assert!(error("rate-hz: 2 kHz").contains("are TOML"));
        assert!(error("remark: bench 3").contains("are TOML"));
        let misspelt = |text: &str| Metadata::parse(text, 1).unwrap_err();
        // a program offers to leave out lines that are none of ours, not a key that is misspelt
        assert!(matches!(
            misspelt("comand = \"chirp\""),
            RecordError::MetadataKeyMisspelt { line: 1, nearest: "command", .. }
        ));
        assert!(matches!(misspelt("bench = 3"), RecordError::MetadataKey { line: 1, .. }));
        let prose = error("noise-a = 1\n recorded on bench 3\n");
        assert!(prose.starts_with("line 2: metadata (`#` lines"), "{prose}");
        let advice = "(`## …` is a comment, `--skip-lines N` leaves out the first N lines)";
        assert!(prose.ends_with(advice), "{prose}");
        assert!(error("rate-hz = 1\nrate-hz = 2").starts_with("line 2: "));
    }

    #[test]
    fn dates_need_a_day() {
        assert!(RecordingDate::parse("2026-11-21T09:30:00Z").is_some());
        assert!(RecordingDate::parse("09:30:00").is_none());
        for (text, is_day) in [
            ("2026-13-01", false),
            ("2026-02-30", false),
            ("2026-02-29", false),
            ("2024-02-29", true),
            ("2000-02-29", true),
            ("1900-02-29", false),
            ("2026-04-31", false),
            ("2026-12-31", true),
            ("2026-02-30T09:30:00Z", false),
        ] {
            assert_eq!(RecordingDate::parse(text).is_some(), is_day, "{text}");
        }
    }
}
