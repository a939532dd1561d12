//! Options with which a file that is not read would be.

use std::path::Path;

use fdi_core::{Channel, ColumnMap, Gaps, OtherColumn, RecordError, Recording, guess_columns};

use crate::{args::MapArgs, shell::quoted};

/// Options that are tried one after another.
const MOST_TRIED: usize = 6;

/// Options that read a file: those that were given, and others that it seems to ask for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ReadingOptions {
    maps: Vec<String>,
    is_bridged: bool,
    skipped_lines: usize,
    rows: Vec<String>,
}

impl ReadingOptions {
    /// The options with which a file that is not read so would be; `None` where none are found, or
    /// nothing but those that were given is needed.
    pub(crate) fn of(path: &Path, given: &MapArgs) -> Option<Self> {
        let given = Self {
            maps: given.map.clone(),
            is_bridged: given.is_bridged(),
            skipped_lines: given.skip_lines,
            rows: given.rows.clone(),
        };
        let mut options = given.clone();
        for _ in 0..MOST_TRIED {
            let read = Recording::read(path, &options.column_map()?);
            let was = options.clone();
            match read {
                Ok(recording) => options.add_for(&recording),
                Err(error) => options.add_against(&error),
            }
            if options == was {
                break;
            }
        }
        let is_read = Recording::read(path, &options.column_map()?).is_ok();
        (is_read && options != given).then_some(options)
    }

    /// The options with which a recording that is not diagnosed could be, where it is the reading
    /// that fails.
    pub(crate) fn of_failure(path: &Path, given: &MapArgs) -> Option<Self> {
        let shows_current = |map: ColumnMap| {
            Recording::read(path, &map).is_ok_and(|recording| has_whole_current(&recording))
        };
        if shows_current(given.column_map().ok()?) {
            return None;
        }
        Self::of(path, given).filter(|options| options.column_map().is_some_and(shows_current))
    }

    /// Words before the options that say on what condition they are right.
    pub(crate) fn condition(&self) -> &'static str {
        if self.maps.is_empty() { "" } else { "if the names mean what they seem to, " }
    }

    /// The options as words of a command line.
    pub(crate) fn words(&self) -> String {
        let maps = self.maps.iter().map(|entry| format!("--map {}", quoted(entry)));
        let gaps = self.is_bridged.then(|| "--gaps bridge".to_owned());
        let skip = (self.skipped_lines > 0).then(|| format!("--skip-lines {}", self.skipped_lines));
        let rows = self.rows.iter().map(|choice| format!("--where {}", quoted(choice)));
        maps.chain(gaps).chain(skip).chain(rows).collect::<Vec<_>>().join(" ")
    }

    fn column_map(&self) -> Option<ColumnMap> {
        let gaps = if self.is_bridged { Gaps::Bridge } else { Gaps::Refuse };
        let map = ColumnMap::new(&self.maps).ok()?.with_rows(&self.rows).ok()?;
        Some(map.with_gaps(gaps).with_skipped_lines(self.skipped_lines))
    }

    fn add_guesses<S: AsRef<str>>(&mut self, columns: &[S]) {
        let target = |entry: &str| entry.split('=').next().map(str::trim).map(str::to_owned);
        let taken: Vec<_> = self.maps.iter().map(|entry| target(entry)).collect();
        let guesses = guess_columns(columns).into_iter().map(|guess| guess.to_string());
        self.maps.extend(guesses.filter(|guess| !taken.contains(&target(guess))));
    }

    /// Adds what a recording lacks that can be read.
    fn add_for(&mut self, recording: &Recording) {
        let others: Vec<_> = recording.other_columns().iter().map(OtherColumn::name).collect();
        self.add_guesses(&others);
        if let Some(channel) = current(recording)
            && let Err(error) = recording.require_no_gap(channel)
        {
            self.add_against(&error);
        }
    }

    /// Adds what an error asks for.
    fn add_against(&mut self, error: &RecordError) {
        match error {
            RecordError::NoTime { columns, step_s, .. } => {
                self.add_guesses(columns);
                if let Some(step_s) = step_s {
                    // what a file states goes before the guess at a column without a name
                    self.maps.retain(|entry| !entry.starts_with("time_s=column "));
                    if !self.maps.iter().any(|entry| entry.starts_with("time_s=")) {
                        self.maps.push(format!("time_s=row*{step_s}"));
                    }
                }
            }
            RecordError::NotFinite { found, .. } | RecordError::NotANumber { found, .. }
                if RecordError::is_lacking(found) =>
            {
                self.is_bridged = true;
            }
            RecordError::ChannelNotFinite { is_lacking: true, .. }
            | RecordError::Gap { can_be_bridged: true, .. }
            | RecordError::Held { can_be_bridged: true, .. }
            | RecordError::TimeNotIncreasing { can_be_bridged: true, .. }
            | RecordError::ChannelTime { can_be_bridged: true, .. } => self.is_bridged = true,
            RecordError::RecordingsBeside { rows_of_one: Some(choice), .. }
            | RecordError::TimeNotIncreasing { rows_before: Some(choice), .. }
            | RecordError::ChannelTime { rows_before: Some(choice), .. } => {
                self.rows.push(choice.clone());
            }
            RecordError::MetadataSyntax { line, .. } | RecordError::MetadataKey { line, .. } => {
                let line = usize::try_from(*line).unwrap_or(0);
                self.skipped_lines = self.skipped_lines.max(line);
            }
            _ => {}
        }
    }
}

/// The channel of the current that a diagnosis looks at first.
fn current(recording: &Recording) -> Option<&Channel> {
    recording.require_current().ok().map(|current| current.channel())
}

fn has_whole_current(recording: &Recording) -> bool {
    current(recording).is_some_and(|channel| recording.require_no_gap(channel).is_ok())
}
