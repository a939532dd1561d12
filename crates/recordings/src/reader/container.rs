//! Recordings in files that are not text: what all such formats share.
//!
//! A reader says which columns a file has and gives the numbers of those that are
//! asked for; here they become channels, each with its own time axis.

use std::ops::Range;

use crate::{
    Channel, ChannelName, ColumnMap, METADATA_KEYS, Metadata, MetadataKey, OtherColumn,
    RecordError, Recording, RecordingDate, SharedNumbers,
    column_map::{Entry, Target},
    evened::{Evener, OutOfOrder, Untimely},
    held_rows::HeldRows,
    long_form::is_long_form,
    property::Property,
    reader::chosen_rows::ChosenRows,
    recording::MOST_PLAUSIBLE,
    rows_beside::TimedRows,
    unit::{self, Scale, StatedUnit},
};

/// Most numbers that one recording may hold in its channels: a day of six channels at
/// 250 Hz, in 1 GiB.
pub(super) const LIMIT_NUMBERS: usize = 1 << 27;

/// Size below which a double holds each whole number.
const WHOLE_BELOW: f64 = 9_007_199_254_740_992.0;
/// Samples before one that may be the first of another recording.
const LEAST_ROWS: usize = 100;
/// Finest step that a clock is taken to resolve where its numbers do not show one, s.
const FINEST_CLOCK_S: f64 = 1e-9;
/// Decimals of that step.
const FINEST_CLOCK_DECIMALS: i32 = 9;

/// One column of a file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Head {
    /// Group of columns with one time axis; `None` where all columns share one.
    pub(super) group: Option<String>,
    /// Name of the column, without its group.
    pub(super) name: String,
    /// Group and name as the format's other programs join them.
    pub(super) path: String,
    /// Samples, as far as the file's own index tells.
    pub(super) samples: usize,
    /// The time axis that the format gives it.
    pub(super) clock: Clock,
    /// The unit that the file states for it.
    pub(super) unit: Option<String>,
}

impl Head {
    /// Scale that makes SI of the numbers as this channel, and what is to be told of it.
    fn scale(
        &self,
        target: Target,
        mapped: Option<&Entry>,
    ) -> Result<(Scale, Option<StatedUnit>), RecordError> {
        unit::stated_scale(&self.path, self.unit.as_deref(), target, mapped)
    }
}

/// The time axis that a format itself gives a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Clock {
    /// None: a column named `time_s` is to be found.
    Unstated,
    /// Sample `i` is at `start_s + i·step_s`.
    Uniform {
        /// Time of the first sample, s.
        start_s: f64,
        /// Time between samples, s.
        step_s: f64,
    },
    /// Another column, by its index, in seconds.
    Column(usize),
}

/// The numbers of a column.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Samples {
    pub(super) values: Vec<f64>,
    /// Which of them are there; `None` where all are.
    pub(super) present: Option<Vec<bool>>,
    /// True where the file holds the numbers in single precision.
    pub(super) single: bool,
}

impl Samples {
    pub(super) fn of(values: Vec<f64>) -> Self {
        Self { values, ..Self::default() }
    }
}

/// The numbers of a column that others may read too.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Numbers {
    pub(super) values: SharedNumbers,
    /// Which of them are there; `None` where all are.
    pub(super) present: Option<Vec<bool>>,
    /// True where they were held in single precision.
    pub(super) single: bool,
}

impl Numbers {
    fn is_present(&self, index: usize) -> bool {
        self.present.as_ref().is_none_or(|present| present[index])
    }

    fn has_any(&self) -> bool {
        (0..self.values.len()).any(|index| self.is_present(index))
    }

    /// Takes each NaN for a missing sample.
    fn without_nan(self) -> Self {
        if !self.values.iter().any(|value| value.is_nan()) {
            return self;
        }
        let there = |(index, value): (usize, &f64)| self.is_present(index) && !value.is_nan();
        let present = Some(self.values.iter().enumerate().map(there).collect());
        let values = self.values.iter().map(|value| if value.is_nan() { 0.0 } else { *value });
        Self { values: values.collect(), present, ..self }
    }

    /// The sum with as many others, which lack the same samples; where gaps are bridged, either may
    /// lack some, and the sum lacks them.
    fn plus(&self, other: &Self, is_bridged: bool) -> Option<Self> {
        let count = self.values.len();
        let are_alike = |index| self.is_present(index) == other.is_present(index);
        if other.values.len() != count || !(is_bridged || (0..count).all(are_alike)) {
            return None;
        }
        let is_there = |index| self.is_present(index) && other.is_present(index);
        let is_whole = self.present.is_none() && other.present.is_none();
        let present = (!is_whole).then(|| (0..count).map(is_there).collect());
        let values = self.values.iter().zip(other.values.iter()).map(|(own, other)| own + other);
        let single = self.single || other.single;
        Some(Self { values: values.collect(), present, single })
    }

    /// Brings all of them to a scale; on their own they stay where they are.
    fn scaled(self, scale: Scale) -> Self {
        if scale == Scale::ONE {
            return self;
        }
        Self { values: self.values.iter().map(|&value| scale.of(value)).collect(), ..self }
    }
}

/// A file that is not text, open for reading.
pub(super) trait Container {
    /// Columns of the file.
    fn heads(&self) -> &[Head];

    /// Properties that the file states.
    fn properties(&self) -> Vec<(String, Property)>;

    /// The numbers of a column; points in time as seconds since the first.
    fn read(&self, column: usize) -> Result<Samples, RecordError>;

    /// The numbers of a column, shared with whoever else holds them.
    fn numbers(&self, column: usize) -> Result<Numbers, RecordError> {
        let Samples { values, present, single } = self.read(column)?;
        Ok(Numbers { values: values.into(), present, single })
    }

    /// Visits the cells of a column as text; one without a value is empty.
    fn each_cell(&self, column: usize, visit: &mut dyn FnMut(&str)) -> Result<(), RecordError> {
        each_number(&self.read(column)?, visit);
        Ok(())
    }

    /// Samples of a column whose rows are lists that are in these rows of the table; `None` where a
    /// sample is a row.
    fn in_rows(
        &self,
        _column: usize,
        _rows: &[usize],
    ) -> Result<Option<Range<usize>>, RecordError> {
        Ok(None)
    }

    /// Place of the first sample of a column in the file, from which its clock counts.
    ///
    /// # Errors
    /// [`RecordError::RowsApart`] where samples that are not read stand between those that are.
    fn first_place(&self, _column: usize) -> Result<usize, RecordError> {
        Ok(0)
    }
}

/// Visits numbers as text; one that is not there is empty. Of those that stand for several whole numbers
/// it is said that they are rounded, so that none is taken for another.
pub(super) fn each_number(samples: &Samples, visit: &mut dyn FnMut(&str)) {
    for (index, value) in samples.values.iter().enumerate() {
        let is_there = samples.present.as_ref().is_none_or(|present| present[index]);
        visit(&match value {
            _ if !is_there => String::new(),
            value if value.abs() >= WHOLE_BELOW => format!("{value} (rounded)"),
            value if samples.single => (*value as f32).to_string(),
            value => value.to_string(),
        });
    }
}

/// Makes a recording of the columns that are channels.
pub(super) fn assemble(
    name: String,
    container: &dyn Container,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    let metadata = metadata(container.properties())?;
    assemble_with(name, metadata, container, map)
}

/// Makes a recording of the columns that are channels, with metadata that are known.
pub(super) fn assemble_with(
    name: String,
    metadata: Metadata,
    container: &dyn Container,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    let chosen;
    let container = if map.rows().is_empty() {
        container
    } else {
        chosen = ChosenRows::new(container, map.rows())?;
        &chosen
    };
    let plan = Plan::new(container.heads(), map)?;
    let paths = || container.heads().iter().map(|head| head.path.clone()).collect::<Vec<_>>();
    if plan.channels.is_empty() && is_long_form(&paths()) {
        return Err(RecordError::LongForm { columns: paths() });
    }
    let mut axes = Axes { container, plan: &plan, metadata: &metadata, read: Vec::new() };
    let mut stamped = Vec::with_capacity(plan.channels.len());
    let mut evener = Evener::new(map.gaps());
    for (index, wanted) in plan.channels.iter().enumerate() {
        let (before, from) = plan.channels.split_at(index);
        let is_of_sum = |other: &&Wanted| other.channel == wanted.channel;
        if !before.iter().any(|other| is_of_sum(&other)) {
            let parts: Vec<_> = from.iter().filter(is_of_sum).collect();
            stamped.extend(Stamped::of(&parts, container, &mut axes, evener.bridges())?);
        }
    }
    axes.look_at_rows(&mut stamped, &mut evener)?;
    let channels = stamped.into_iter().map(|channel| channel.evened(&axes, &mut evener));
    let channels = channels.collect::<Result<Vec<_>, _>>()?;
    let heads = container.heads();
    let is_empty = |wanted: &Wanted| heads[wanted.column].path.clone();
    if channels.is_empty() && !heads.is_empty() {
        let columns: Vec<_> = plan.channels.iter().map(is_empty).collect();
        let rowless = heads.iter().all(|head| head.samples == 0);
        if !columns.is_empty() || rowless {
            return Err(RecordError::NoRows { columns });
        }
    }
    let other_columns = plan.others.iter().map(|&index| {
        let head = &container.heads()[index];
        OtherColumn::unread(head.path.clone(), head.samples)
    });
    let mut recording = Recording {
        name,
        metadata,
        channels,
        other_columns: other_columns.collect(),
        lines: None,
        stated_units: plan.units.clone(),
        clock_notes: evener.into_notes(),
        dialect: None,
        computed_phase: None,
        gaps: map.gaps(),
    };
    recording.complete_star();
    recording.settle_rate()?;
    Ok(recording)
}

/// The metadata among the properties of a file: `rate-hz`, or `rate_hz` where a format
/// knows no hyphen. The others are somebody else's.
fn metadata(properties: Vec<(String, Property)>) -> Result<Metadata, RecordError> {
    let mut metadata = Metadata::default();
    for (name, value) in properties {
        let key = name.replace('_', "-");
        let Some(MetadataKey { name: key, kind, .. }) =
            METADATA_KEYS.iter().find(|row| row.name == key)
        else {
            continue;
        };
        let ours = match (&value, *kind) {
            (Property::Number(_), kind) => kind == "number",
            // programs write dates in many ways; what reads as no date is somebody else's
            (Property::Text(text), "date") => RecordingDate::parse(text).is_some(),
            (Property::Text(_), _) => true,
        };
        if ours {
            metadata.set_property(key, &value)?;
        }
    }
    Ok(metadata)
}

/// A column that is to be read.
#[derive(Clone, Copy, Debug)]
struct Wanted {
    column: usize,
    channel: ChannelName,
    scale: Scale,
}

/// A column that may be a time axis.
#[derive(Clone, Copy, Debug)]
struct TimeColumn {
    column: usize,
    factor: f64,
}

/// Targets that the columns of a file are taken for.
#[derive(Debug, Default)]
struct Plan {
    channels: Vec<Wanted>,
    times: Vec<TimeColumn>,
    others: Vec<usize>,
    units: Vec<StatedUnit>,
    /// Time between rows that a map gives, s.
    row_step_s: Option<f64>,
}

impl Plan {
    fn new(heads: &[Head], map: &ColumnMap) -> Result<Self, RecordError> {
        let paths = || heads.iter().map(|head| head.path.clone()).collect::<Vec<_>>();
        let names =
            |head: &Head, entry: &Entry| head.path == entry.column || head.name == entry.column;
        let mut row_step_s = None;
        for entry in map.entries() {
            let exact = heads.iter().filter(|head| head.path == entry.column).count();
            let found: Vec<_> = heads.iter().filter(|head| names(head, entry)).collect();
            if found.is_empty() && entry.is_of_rows() {
                row_step_s = Some(entry.row_step_s());
                continue;
            }
            if found.is_empty() {
                return Err(RecordError::MappedColumnMissing {
                    line: None,
                    column: entry.column.clone(),
                    channel: entry.target.column(),
                    columns: paths(),
                });
            }
            if found.len() > 1 && exact != 1 && entry.target != Target::Time {
                let columns = found.iter().map(|head| head.path.clone()).collect();
                return Err(RecordError::ColumnAmbiguous { column: entry.column.clone(), columns });
            }
        }
        let mut plan = Self { row_step_s, ..Self::default() };
        for (column, head) in heads.iter().enumerate() {
            let by_path = map.entries().iter().find(|entry| entry.column == head.path);
            let by_name = map.entries().iter().find(|entry| {
                // a name that is one column's whole path means that column alone
                entry.column == head.name && heads.iter().all(|other| other.path != entry.column)
            });
            let mapped = by_path.or(by_name);
            let own = || Target::from_column(&head.name).filter(|&own| !map.maps(own));
            let target = mapped.map(|entry| entry.target).or_else(own);
            let used = target.or_else(|| is_clock(heads, column).then_some(Target::Time));
            let unscaled = Ok((Scale::ONE, None));
            let (scale, told) = used.map_or(unscaled, |used| head.scale(used, mapped))?;
            plan.units.extend(told);
            match target {
                Some(Target::Time) => {
                    plan.times.push(TimeColumn { column, factor: scale.factor });
                }
                Some(Target::Channel(channel)) => {
                    let is_part = map.columns_of(Target::Channel(channel)) > 1;
                    plan.want(heads, Wanted { column, channel, scale }, is_part)?;
                }
                // the axis that other columns point at is no column of its own
                None if is_clock(heads, column) => {}
                None => plan.others.push(column),
            }
        }
        let total = plan.channels.iter().map(|wanted| heads[wanted.column].samples);
        if total.fold(0, usize::saturating_add) > LIMIT_NUMBERS {
            return Err(RecordError::TooManyNumbers { limit: LIMIT_NUMBERS });
        }
        Ok(plan)
    }

    fn want(&mut self, heads: &[Head], wanted: Wanted, is_part: bool) -> Result<(), RecordError> {
        let twice = self.channels.iter().find(|earlier| earlier.channel == wanted.channel);
        if let Some(earlier) = twice.filter(|_| !is_part) {
            let columns = [earlier.column, wanted.column].map(|index| heads[index].path.clone());
            let column = wanted.channel.column().to_owned();
            return Err(RecordError::ColumnAmbiguous { column, columns: columns.to_vec() });
        }
        self.channels.push(wanted);
        Ok(())
    }
}

fn is_clock(heads: &[Head], column: usize) -> bool {
    heads.iter().any(|head| head.clock == Clock::Column(column))
}

/// Times of the samples of a column, and the step to which they are rounded.
#[derive(Clone, Debug)]
struct Axis {
    times_s: SharedNumbers,
    /// Which times are there; `None` where all are.
    present: Option<Vec<bool>>,
    quantum_s: f64,
}

/// The time axes of a file, each read once.
struct Axes<'a> {
    container: &'a dyn Container,
    plan: &'a Plan,
    metadata: &'a Metadata,
    read: Vec<(usize, Axis)>,
}

impl Axes<'_> {
    /// The axis of a column: a column `time_s` beside it, else what the format states,
    /// else the one column `time_s` that is as long, else the stated rate.
    fn of(&mut self, column: usize, samples: usize) -> Result<Axis, RecordError> {
        let heads = self.container.heads();
        let head = &heads[column];
        let length = |time: &TimeColumn| heads[time.column].samples;
        let beside = |time: &TimeColumn| heads[time.column].group == head.group;
        let times = &self.plan.times;
        let own = times.iter().find(|time| beside(time) && length(time) == head.samples);
        let period = times.iter().find(|time| beside(time) && length(time) == 1 && samples > 1);
        if let Some(&time) = own {
            return self.column(time);
        }
        if let Some(step_s) = self.plan.row_step_s {
            return self.uniform(0.0, step_s, samples, column);
        }
        match head.clock {
            Clock::Column(column) => {
                let (scale, _) = heads[column].scale(Target::Time, None)?;
                return self.column(TimeColumn { column, factor: scale.factor });
            }
            Clock::Uniform { start_s, step_s } => {
                return self.uniform(start_s, step_s, samples, column);
            }
            Clock::Unstated => {}
        }
        let alike: Vec<_> = times.iter().filter(|time| length(time) == head.samples).collect();
        let rate_hz = self.metadata.rate_hz;
        match (alike.as_slice(), period, rate_hz) {
            (&[&time], ..) => self.column(time),
            (_, Some(time), _) => {
                let step = self.container.read(time.column)?.values;
                let step_s = step.first().copied().unwrap_or(0.0) * time.factor;
                self.uniform(0.0, step_s, samples, column)
            }
            (_, None, Some(rate_hz)) => self.uniform(0.0, 1.0 / rate_hz, samples, column),
            (several, None, None) => Err(self.no_axis(head, several.len())),
        }
    }

    /// Evenly spaced times from 0 or a start.
    fn uniform(
        &self,
        start_s: f64,
        step_s: f64,
        samples: usize,
        column: usize,
    ) -> Result<Axis, RecordError> {
        if !(step_s.is_finite() && step_s > 0.0 && start_s.is_finite()) {
            let column = self.container.heads()[column].path.clone();
            return Err(RecordError::Step { column, step_s });
        }
        let first = self.container.first_place(column)?;
        let rate_hz = step_s.recip().round();
        // a step of 1e-4 s means 10 kHz, and i/10 000 is the nearer double
        let exact = (rate_hz * step_s - 1.0).abs() < f64::EPSILON;
        let at = |index: usize| {
            let index = (first + index) as f64;
            start_s + if exact { index / rate_hz } else { index * step_s }
        };
        let times_s = (0..samples).map(at).collect();
        Ok(Axis { times_s, present: None, quantum_s: 0.0 })
    }

    /// A choice of rows by one of the other columns of a channel's table.
    fn choice_by(
        &self,
        column: usize,
        choice: impl Fn(&OtherColumn) -> Option<String>,
    ) -> Option<String> {
        let heads = self.container.heads();
        let is_beside = |other: &&usize| {
            let (own, other) = (&heads[column], &heads[**other]);
            own.group == other.group && own.samples == other.samples
        };
        self.plan.others.iter().filter(is_beside).find_map(|&other| {
            let mut cells = OtherColumn::new(heads[other].path.clone());
            let visited = self.container.each_cell(other, &mut |cell| cells.push(0.0, cell));
            visited.ok().and_then(|()| choice(&cells))
        })
    }

    /// Looks at the rows of each table as a whole: what repeats the row before is noted, what is held
    /// is taken for missing or refused, and so are rows of several recordings that have the same times.
    fn look_at_rows(
        &self,
        stamped: &mut [Stamped],
        evener: &mut Evener,
    ) -> Result<(), RecordError> {
        let mut seen = Vec::new();
        for at in 0..stamped.len() {
            let (times_s, quantum_s) = (stamped[at].times_s.clone(), stamped[at].quantum_s);
            if stamped[at].rows.is_some() || seen.contains(&times_s.as_ptr()) {
                continue;
            }
            seen.push(times_s.as_ptr());
            let is_beside =
                |one: &&Stamped| one.rows.is_none() && one.times_s.as_ptr() == times_s.as_ptr();
            let beside = stamped.iter().filter(is_beside);
            let channels = beside.map(|one| (one.channel, &one.values[..])).collect();
            let table = TimedRows::new(&times_s, channels);
            table.check(|| None, |choice| self.choice_by(stamped[at].column, choice))?;
            evener.note_repeated(&times_s, quantum_s, &table.repeated());
            let Some(held) = HeldRows::of(&table) else { continue };
            held.check(&times_s, evener.bridges(), |_| None)?;
            let beside = |one: &&mut Stamped| is_beside(&&**one);
            stamped.iter_mut().filter(beside).for_each(|one| one.take_out(&held));
        }
        Ok(())
    }

    fn no_axis(&self, head: &Head, alike: usize) -> RecordError {
        let heads = self.container.heads();
        if self.plan.times.is_empty() {
            let columns = heads.iter().map(|head| head.path.clone()).collect();
            return RecordError::NoTime { line: None, columns, step_s: self.step_of_scalar_s() };
        }
        RecordError::NoAxis { column: head.path.clone(), samples: head.samples, alike }
    }

    /// The inverse of a number that is called like a rate, s.
    fn step_of_scalar_s(&self) -> Option<f64> {
        const RATES: [&str; 5] = ["fs", "rate", "sample_rate", "samplerate", "fsample"];
        let heads = self.container.heads();
        let is_rate = |head: &Head| {
            head.samples == 1 && RATES.contains(&head.name.to_ascii_lowercase().as_str())
        };
        let column = heads.iter().position(is_rate)?;
        let rate_hz = *self.container.read(column).ok()?.values.first()?;
        let step_s = rate_hz.recip();
        (step_s.is_finite() && step_s > 0.0).then_some(step_s)
    }

    fn column(&mut self, time: TimeColumn) -> Result<Axis, RecordError> {
        if let Some((_, axis)) = self.read.iter().find(|(column, _)| *column == time.column) {
            return Ok(axis.clone());
        }
        let samples = self.container.numbers(time.column)?;
        let single = samples.single;
        let decimals = samples.values.iter().map(|&value| decimals(value)).max().unwrap_or(0);
        let largest = samples.values.iter().fold(0.0, |most: f64, value| value.abs().max(most));
        let step = if single {
            // half a unit in the last place on either side
            f64::from(f32::EPSILON) * largest
        } else {
            10f64.powi(-decimals).max(FINEST_CLOCK_S)
        };
        let samples = samples.scaled(Scale::by(time.factor));
        let axis = Axis {
            times_s: samples.values,
            present: samples.present,
            quantum_s: step * time.factor.abs(),
        };
        self.read.push((time.column, axis.clone()));
        Ok(axis)
    }
}

/// Decimals of the shortest number that is this double, at most those of the finest clock.
fn decimals(value: f64) -> i32 {
    let text = format!("{value:e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let after_point = digits.split_once('.').map_or(0, |(_, part)| part.len() as i32);
    let decimals = after_point.saturating_sub(exponent.parse().unwrap_or(0));
    decimals.clamp(0, FINEST_CLOCK_DECIMALS)
}

/// The samples of one channel with their times, as the file has them.
struct Stamped {
    channel: ChannelName,
    column: usize,
    times_s: SharedNumbers,
    values: SharedNumbers,
    quantum_s: f64,
    /// Rows of the samples; `None` where each row has one.
    rows: Option<Vec<usize>>,
}

impl Stamped {
    /// One channel, the sum of its columns, or none where they hold no sample.
    fn of(
        parts: &[&Wanted],
        container: &dyn Container,
        axes: &mut Axes<'_>,
        is_bridged: bool,
    ) -> Result<Option<Self>, RecordError> {
        let &[wanted, ref others @ ..] = parts else { return Ok(None) };
        let head = &container.heads()[wanted.column];
        let read = |part: &Wanted| {
            let samples = container.numbers(part.column)?.scaled(part.scale);
            Ok(if is_bridged { samples.without_nan() } else { samples })
        };
        let mut samples = read(wanted)?;
        let mut has_any = samples.has_any();
        for part in others {
            let part = read(part)?;
            has_any |= part.has_any();
            let sum = samples.plus(&part, is_bridged);
            samples = sum.ok_or(RecordError::SumTimes { channel: wanted.channel })?;
        }
        if !has_any {
            return Ok(None);
        }
        if !samples.has_any() {
            return Err(RecordError::SumTimes { channel: wanted.channel });
        }
        let count = samples.values.len();
        if wanted.channel == ChannelName::HallState {
            let sector = |value: f64| (1..=6).any(|sector| value == f64::from(sector));
            let wrong = (0..count).find(|&i| samples.is_present(i) && !sector(samples.values[i]));
            if let Some(index) = wrong {
                let (column, found) = (head.path.clone(), samples.values[index]);
                return Err(RecordError::HallState { line: None, column, found });
            }
        }
        let wild = |&index: &usize| samples.values[index].abs() > MOST_PLAUSIBLE;
        if let Some(index) = (0..count).find(|index| samples.is_present(*index) && wild(index)) {
            let (column, found) = (head.path.clone(), samples.values[index]);
            let finite = found.is_finite();
            return Err(if finite {
                RecordError::Implausible { line: None, column, found, limit: MOST_PLAUSIBLE }
            } else {
                let is_lacking = found.is_nan();
                RecordError::ChannelNotFinite { channel: wanted.channel, index, is_lacking }
            });
        }
        let axis = axes.of(wanted.column, count)?;
        for part in others {
            if axes.of(part.column, count)?.times_s != axis.times_s {
                return Err(RecordError::SumTimes { channel: wanted.channel });
            }
        }
        if axis.times_s.len() != count {
            let (channel, times) = (wanted.channel, axis.times_s.len());
            return Err(RecordError::ChannelLength { channel, times, values: count });
        }
        let (channel, column, quantum_s) = (wanted.channel, wanted.column, axis.quantum_s);
        let (times_s, values) = (axis.times_s, samples.values.clone());
        if samples.present.is_none() && axis.present.is_none() {
            return Ok(Some(Self { channel, column, times_s, values, quantum_s, rows: None }));
        }
        let timed = |index: usize| axis.present.as_ref().is_none_or(|present| present[index]);
        let rows: Vec<usize> = (0..count).filter(|&index| samples.is_present(index)).collect();
        if let Some(&index) = rows.iter().find(|&&index| !timed(index)) {
            return Err(RecordError::SampleWithoutTime { channel, index });
        }
        let times_s = rows.iter().map(|&index| times_s[index]).collect();
        let values = rows.iter().map(|&index| values[index]).collect();
        Ok(Some(Self { channel, column, times_s, values, quantum_s, rows: Some(rows) }))
    }

    /// Takes held samples for missing.
    fn take_out(&mut self, held: &HeldRows) {
        if let Some(rows) = held.measured(&self.values) {
            self.times_s = rows.iter().map(|&row| self.times_s[row]).collect();
            self.values = rows.iter().map(|&row| self.values[row]).collect();
            self.rows = Some(rows);
        }
    }

    /// The channel on its clock.
    fn evened(self, axes: &Axes<'_>, evener: &mut Evener) -> Result<Channel, RecordError> {
        let Self { channel, column, times_s, values, quantum_s, rows } = self;
        let finite = |(time_s, value): (&f64, &f64)| time_s.is_finite() && value.is_finite();
        if let Some(index) = times_s.iter().zip(values.iter()).position(|pair| !finite(pair)) {
            let is_lacking = times_s[index].is_finite() && values[index].is_nan();
            return Err(RecordError::ChannelNotFinite { channel, index, is_lacking });
        }
        let made = evener.channel(channel, times_s.clone(), values, quantum_s);
        made.map_err(|problem| match problem {
            Untimely::NotAfter(OutOfOrder { at, can_be_bridged }) => {
                let begins_again = at >= LEAST_ROWS && times_s[at] <= times_s[0];
                let row = rows.as_ref().map_or(at, |rows| rows[at]);
                let error = RecordError::ChannelTime {
                    channel,
                    index: at,
                    can_be_bridged,
                    begins_again,
                    rows_before: None,
                };
                let choice = || axes.choice_by(column, |other| other.choice_of_rows_before(row));
                if begins_again { error.with_rows_before(choice()) } else { error }
            }
            Untimely::Lacking(gap) => gap.error(channel, None),
        })
    }
}

#[cfg(test)]
mod tests;
