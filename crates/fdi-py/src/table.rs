//! Tables as recordings: one, one a row, one a group, or the files that they name or hold.

use fdi_cli::Source;
use fdi_core::{ChannelName, ColumnMap, Metadata, Recording, report::Failure};
use recordings::{METADATA_KEYS, MemoryColumn, Property};

use crate::column::{Cells, Column, Numbers};

/// Column with the names of recordings.
const NAME: &str = "recording";
/// Column with the places of files.
const PATH: &str = "path";
/// Column with the contents of files.
const CONTENT: &str = "content";

/// How a table is read.
pub(crate) struct Reading<'a> {
    /// Which columns are which channels.
    pub(crate) map: &'a ColumnMap,
    /// Column whose values tell recordings apart in a long table.
    pub(crate) group: Option<&'a str>,
    /// Metadata of every recording.
    pub(crate) metadata: &'a Metadata,
    /// Name of a recording that has none.
    pub(crate) name: &'a str,
}

/// Why a table holds no recordings.
#[derive(Debug)]
pub(crate) struct TableError {
    pub(crate) message: String,
    pub(crate) column: Option<String>,
}

/// Recordings of a table.
pub(crate) fn sources(
    columns: &[Column],
    reading: &Reading<'_>,
) -> Result<Vec<Source>, TableError> {
    let named = |name: &str| columns.iter().find(|column| column.name == name);
    let rows = columns.first().map_or(0, |column| column.cells.rows());
    let has_lists = columns.iter().any(|column| matches!(column.cells, Cells::Lists(_)));
    let is_one = reading.group.is_none() && !has_lists && named(PATH).is_none();
    // a single recording may have channels of several lengths
    let uneven = columns.iter().find(|column| column.cells.rows() != rows);
    if let (false, Some(uneven)) = (is_one, uneven) {
        let (name, found) = (&uneven.name, uneven.cells.rows());
        let message = format!("column `{name}` has {found} rows, expected {rows} as the others");
        return Err(TableError { message, column: Some(name.clone()) });
    }
    if let Some(group) = reading.group {
        let Some(column) = named(group) else {
            let known: Vec<_> = columns.iter().map(|column| format!("`{}`", column.name)).collect();
            let message =
                format!("no column `{group}` to group by; the columns are {}", known.join(", "));
            return Err(TableError { message, column: Some(group.to_owned()) });
        };
        if !matches!(column.cells, Cells::Texts(_) | Cells::Numbers(_)) {
            let what = column.cells.what();
            let message =
                format!("column `{group}` holds {what}, expected texts or numbers to group by");
            return Err(TableError { message, column: Some(group.to_owned()) });
        }
        return Ok(of_groups(columns, column, reading));
    }
    if has_lists {
        return Ok(of_rows(columns, reading));
    }
    if let Some(path) = named(PATH) {
        let content = named(CONTENT).map(|column| &column.cells);
        return Ok(of_files(&path.cells, content));
    }
    let first = named(NAME).filter(|column| column.cells.rows() > 0);
    let name = first.and_then(|column| column.cells.text(0));
    let name = name.unwrap_or_else(|| reading.name.to_owned());
    Ok(vec![source(&name, one(&name, columns, None, reading))])
}

/// A source, or why there is none.
fn source(name: &str, read: Result<Recording, String>) -> Source {
    match read {
        Ok(recording) => Source::Recording(Box::new(recording)),
        Err(error) => broken(name, error),
    }
}

fn broken(name: &str, error: String) -> Source {
    Source::Broken(Failure { recording: name.to_owned(), actuator_id: None, date: None, error })
}

/// One recording of some rows of a long table, or of all.
pub(crate) fn one(
    name: &str,
    columns: &[Column],
    rows: Option<&[usize]>,
    reading: &Reading<'_>,
) -> Result<Recording, String> {
    let mut metadata = reading.metadata.clone();
    let mut channels = Vec::new();
    for column in columns {
        let is_read = is_channel(&column.name, reading.map);
        let wrong = match &column.cells {
            Cells::Numbers(numbers) if is_read || key(&column.name).is_none() => {
                if is_time(&column.name)
                    && let Some(row) = numbers.first_gap()
                {
                    return Err(format!("column `{}` has no number at row {row}", column.name));
                }
                let own = rows.map_or_else(|| numbers.clone(), |rows| numbers.of_rows(rows));
                channels.push(memory(&column.name, own));
                continue;
            }
            Cells::Numbers(_) | Cells::Texts(_) if key(&column.name).is_some() => {
                let row = rows.map_or(Some(0), |rows| rows.first().copied());
                if let Some(row) = row.filter(|&row| row < column.cells.rows()) {
                    set(&mut metadata, &column.name, &column.cells, row)?;
                }
                continue;
            }
            Cells::Numbers(_) => continue,
            other => other.what(),
        };
        if is_read {
            return Err(format!("column `{}` holds {wrong}, expected numbers", column.name));
        }
    }
    read(name, metadata, channels, reading.map)
}

/// Tells whether a channel, or the time, is read from the column.
fn is_channel(column: &str, map: &ColumnMap) -> bool {
    is_time(column) || ChannelName::from_column(column).is_some() || map.reads(column)
}

/// Tells whether the column has the name of the time.
fn is_time(column: &str) -> bool {
    column == "time_s"
}

fn read(
    name: &str,
    metadata: Metadata,
    channels: Vec<MemoryColumn>,
    map: &ColumnMap,
) -> Result<Recording, String> {
    let of = Recording::from_columns(name, metadata, channels, map);
    of.map_err(|error| error.to_string())
}

fn memory(name: &str, numbers: Numbers) -> MemoryColumn {
    let Numbers { values, present, single } = numbers;
    MemoryColumn { name: name.to_owned(), values, present, single }
}

/// The key of the metadata that a column has the name of.
fn key(column: &str) -> Option<&'static str> {
    let spelt = column.replace('_', "-");
    METADATA_KEYS.iter().map(|key| key.name).find(|name| *name == spelt)
}

/// Puts a cell into the metadata where its column is one of theirs.
fn set(metadata: &mut Metadata, column: &str, cells: &Cells, row: usize) -> Result<(), String> {
    let Some(key) = key(column) else { return Ok(()) };
    let property = match cells {
        Cells::Numbers(numbers) => numbers.at(row).map(Property::Number),
        other => other.text(row).map(Property::Text),
    };
    let Some(property) = property else { return Ok(()) };
    let refused = |error| format!("column `{column}`: {error}");
    metadata.set_property(key, &property).map_err(refused)
}

/// A recording a group of rows, in the order in which the groups begin.
fn of_groups(columns: &[Column], group: &Column, reading: &Reading<'_>) -> Vec<Source> {
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    let mut without = Vec::new();
    let mut places = std::collections::BTreeMap::new();
    for row in 0..group.cells.rows() {
        let Some(name) = group.cells.text(row) else {
            without.push(row);
            continue;
        };
        // rows of one group mostly follow one another
        if let Some((last, rows)) = groups.last_mut().filter(|(last, _)| *last == name) {
            let _ = last;
            rows.push(row);
            continue;
        }
        let place = *places.entry(name.clone()).or_insert(groups.len());
        match groups.get_mut(place) {
            Some((_, rows)) => rows.push(row),
            None => groups.push((name, vec![row])),
        }
    }
    let others: Vec<Column> =
        columns.iter().filter(|column| column.name != group.name).cloned().collect();
    let recording =
        |(name, rows): &(String, Vec<usize>)| source(name, one(name, &others, Some(rows), reading));
    let mut sources: Vec<Source> = groups.iter().map(recording).collect();
    if let Some(first) = without.first() {
        let (name, count) = (&group.name, without.len());
        let error = format!("column `{name}` is empty in {count} rows, from row {first} on");
        sources.push(broken(reading.name, error));
    }
    sources
}

/// A recording a row, whose channels are lists.
fn of_rows(columns: &[Column], reading: &Reading<'_>) -> Vec<Source> {
    let rows = columns.first().map_or(0, |column| column.cells.rows());
    let name = columns.iter().find(|column| column.name == NAME);
    let row = |row: usize| {
        let own = name.and_then(|column| column.cells.text(row));
        let own = own.unwrap_or_else(|| row.to_string());
        source(&own, of_row(&own, columns, row, reading))
    };
    (0..rows).map(row).collect()
}

fn of_row(
    name: &str,
    columns: &[Column],
    row: usize,
    reading: &Reading<'_>,
) -> Result<Recording, String> {
    let mut metadata = reading.metadata.clone();
    let mut channels = Vec::new();
    for column in columns {
        match &column.cells {
            Cells::Lists(lists) => {
                channels.extend(lists[row].clone().map(|numbers| memory(&column.name, numbers)));
            }
            cells if is_channel(&column.name, reading.map) => {
                let (name, what) = (&column.name, cells.what());
                return Err(format!("column `{name}` holds {what}, expected lists of numbers"));
            }
            cells => set(&mut metadata, &column.name, cells, row)?,
        }
    }
    read(name, metadata, channels, reading.map)
}

/// Files that a table names, or holds.
fn of_files(paths: &Cells, content: Option<&Cells>) -> Vec<Source> {
    let row = |row: usize| {
        let Some(path) = paths.text(row) else {
            return broken(&row.to_string(), "column `path` is empty".to_owned());
        };
        let path = local(&path).to_owned();
        match content {
            None => Source::File(path.into()),
            Some(Cells::Files(files)) => match &files[row] {
                Some(bytes) => Source::Bytes { name: path, bytes: bytes.clone() },
                None => broken(&path, "column `content` is empty".to_owned()),
            },
            Some(_) => broken(&path, "column `content` holds no bytes".to_owned()),
        }
    };
    (0..paths.rows()).map(row).collect()
}

/// The path of a file whose address says that it is on this machine.
fn local(address: &str) -> &str {
    match address.strip_prefix("file:") {
        // file:/a/b, file:///a/b
        Some(rest) => match rest.strip_prefix("//") {
            Some(path) if path.starts_with('/') => path,
            _ => rest,
        },
        None => address,
    }
}
