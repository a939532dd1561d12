//! The report of a batch of diagnoses.

use std::collections::BTreeSet;

use super::{
    content::{Block, Cell, Column, Figure, Page, Section, Table},
    decisions::Decisions,
    findings, together,
};
use crate::{
    ActuatorTrend, Change, FALSE_ALARM_RATE, FAMILY_FALSE_ALARM_RATE, Failure, Fault, FaultChange,
    FaultId, FitSignals, Fleet, INCIPIENT_LEVEL, NoticeCode, RecordDiagnosis, Severity, Status,
    TrendPoint, Verdict, common_folder, detected_findings, fault_figure_svg, fit_figure_svg,
    identifiability_figure_svg, plus_minus, search_figure_svg, sentence, trend_figure_svg,
};

/// Recordings, and actuators, that are drawn; the tables have all.
const FIGURES_SHOWN: usize = 12;

/// A setting that is not left at its default.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingRow {
    /// Name of the setting, `diagnose.noise-a`.
    pub name: String,
    /// Value of the setting.
    pub value: String,
    /// Where the value is from: a flag, a variable, or a file with the line.
    pub origin: String,
}

/// Material of a report of diagnoses.
#[derive(Clone, Debug)]
pub struct DiagnosisPage<'a> {
    /// The answers.
    pub records: &'a [RecordDiagnosis],
    /// Tests that answers may be of: SHA-256 of the bundle, name of the test.
    pub tests: &'a [(String, String)],
    /// Recordings that could not be diagnosed.
    pub failures: &'a [Failure],
    /// Trends of the actuators.
    pub fleet: &'a Fleet,
    /// Name and version of the program, `fdi 0.1.0`.
    pub tool: &'a str,
    /// SHA-256 of the bundle, hexadecimal.
    pub bundle: &'a str,
    /// Seed of the run.
    pub seed: u64,
    /// Date and time of the run, RFC 3339, where the page is to say it.
    pub stamp: Option<&'a str>,
    /// Command to run next, where the model does not explain a recording.
    pub next: Option<String>,
    /// Settings with their origins.
    pub settings: Vec<SettingRow>,
}

/// The recordings to draw, at most [`FIGURES_SHOWN`]: the latest of machines that are to be watched or
/// acted on, then what the model does not explain, then the largest detected levels; among equals the
/// order of the input. `urgent` are the latest recordings of the machines, the most urgent first, and
/// in that order of their machines they are drawn.
fn drawn(records: &[RecordDiagnosis], urgent: &[usize]) -> Vec<usize> {
    let rank = |record: &RecordDiagnosis| match record.verdict {
        Verdict::ModelInadequate => 0,
        Verdict::Faulty => 1,
        Verdict::Undetermined => 2,
        Verdict::Healthy => 3,
    };
    let mut order: Vec<usize> = (0..records.len()).collect();
    let is_pressing = |index: &usize| {
        let severity = records[*index].action.as_ref().map(|action| action.severity);
        severity >= Some(Severity::Watch) && urgent.contains(index)
    };
    order.sort_by(|&a, &b| {
        let by_level = largest(&records[b]).total_cmp(&largest(&records[a]));
        let by_verdict = rank(&records[a]).cmp(&rank(&records[b]));
        is_pressing(&b).cmp(&is_pressing(&a)).then(by_verdict).then(by_level)
    });
    order.truncate(FIGURES_SHOWN);
    let is_of = |one: usize, other: usize| {
        let id = |index: usize| records[index].actuator_id.as_ref();
        one == other || id(one).is_some() && id(one) == id(other)
    };
    let place = |index: usize| urgent.iter().position(|&latest| is_of(latest, index));
    order.sort_by_key(|&index| (place(index).unwrap_or(urgent.len()), index));
    order
}

/// The largest level that is detected.
fn largest(record: &RecordDiagnosis) -> f64 {
    worst(record).and_then(|fault| fault.value).unwrap_or(0.0)
}

fn worst(record: &RecordDiagnosis) -> Option<&Fault> {
    let detected = record.faults.iter().filter(|fault| fault.detected == Some(true));
    detected.max_by(|a, b| a.value.unwrap_or(0.0).total_cmp(&b.value.unwrap_or(0.0)))
}

impl DiagnosisPage<'_> {
    /// The page; `signals` gives the signals behind a diagnosis that is drawn, where they can be had.
    ///
    /// # Errors
    /// Those of `signals`.
    pub fn page<E>(
        &self,
        signals: impl Fn(&RecordDiagnosis) -> Result<Option<FitSignals>, E>,
    ) -> Result<Page, E> {
        let names = self.names();
        let decisions = Decisions::of(self.records, self.failures, &names);
        let mut sections: Vec<Section> = decisions.section().into_iter().collect();
        sections.push(self.overview(&names));
        if !self.fleet.actuators.is_empty() {
            sections.push(self.trends());
        }
        let mut taken = BTreeSet::new();
        let latest = Fleet::latest(self.records);
        for index in drawn(self.records, &decisions.places()) {
            let signals = signals(&self.records[index])?;
            let mut section = self.recording(index, names[index], signals.as_ref(), &mut taken);
            if !latest.contains(&index) {
                section.details.splice(..0, section.blocks.drain(..));
            }
            sections.push(section);
        }
        if !self.failures.is_empty() {
            sections.push(self.failed());
        }
        sections.push(self.basis());
        let (title, subject) = (self.title(), self.subject());
        Ok(Page { title, subject, answer: self.answer(&decisions, &names), sections })
    }

    /// The one machine that all answers are of.
    fn machine(&self) -> Option<&str> {
        let id = self.records.first()?.actuator_id.as_deref()?;
        self.records.iter().all(|one| one.actuator_id.as_deref() == Some(id)).then_some(id)
    }

    fn title(&self) -> String {
        match (self.machine(), self.records) {
            (Some(id), _) => format!("Diagnosis of {id}"),
            (None, [one]) => format!("Diagnosis of {}", one.recording),
            (None, records) => format!("Diagnosis of {} recordings", records.len()),
        }
    }

    /// Recordings, test, dates and operators.
    fn subject(&self) -> String {
        let of = |text: fn(&RecordDiagnosis) -> Option<&String>| -> BTreeSet<&str> {
            self.records.iter().filter_map(text).map(String::as_str).collect()
        };
        let named = |one: &str, several: &str, names: BTreeSet<&str>| {
            let names: Vec<&str> = names.into_iter().collect();
            let noun = if names.len() == 1 { one } else { several };
            (!names.is_empty()).then(|| format!("{noun} {}", listed(&names)))
        };
        let count = match self.records.len() {
            1 => "1 recording".to_owned(),
            count => format!("{count} recordings"),
        };
        let bundles = self.records.iter().map(|one| one.bundle.as_deref().unwrap_or(self.bundle));
        let bundles: BTreeSet<&str> = bundles.collect();
        let is_used = |(sha256, _): &&(String, String)| bundles.contains(sha256.as_str());
        let tests = self.tests.iter().filter(is_used).map(|(_, name)| name.as_str()).collect();
        let dates = of(|one| one.date.as_ref());
        let dates = match (dates.first(), dates.last()) {
            (Some(first), Some(last)) if first != last => Some(format!("{first} to {last}")),
            (first, _) => first.map(|&day| day.to_owned()),
        };
        let told = [
            Some(count),
            named("test", "tests", tests),
            dates,
            named("operator", "operators", of(|one| one.operator.as_ref())),
        ];
        told.into_iter().flatten().collect::<Vec<_>>().join(" · ")
    }

    /// Names of the recordings without the folder that they share.
    fn names(&self) -> Vec<&str> {
        let full: Vec<&str> = self.records.iter().map(|one| one.recording.as_str()).collect();
        let shared = common_folder(&full);
        full.into_iter().map(|name| &name[shared..]).collect()
    }

    /// The answer in a sentence or two.
    fn answer(&self, decisions: &Decisions<'_>, names: &[&str]) -> String {
        let mut told: Vec<String> = decisions.sentence().into_iter().collect();
        told.push(match (self.records, names) {
            ([], _) => "No recording could be diagnosed.".to_owned(),
            ([record], _) => of_one(record),
            (records, names) => of_many(records, names),
        });
        told.extend(self.warned());
        match self.failures.len() {
            0 => {}
            1 => told.push("1 recording could not be diagnosed.".to_owned()),
            count => told.push(format!("{count} recordings could not be diagnosed.")),
        }
        told.join(" ")
    }

    /// The actuators whose change is a warning.
    fn warned(&self) -> Option<String> {
        let fleet = self.fleet;
        let warned: Vec<String> = fleet
            .actuators
            .iter()
            .filter(|trend| trend.change == Change::Warning)
            .map(|trend| {
                let most = risen_most(trend).and_then(|fault| {
                    Some((fault.id.name(), fault.difference?, fault.difference_std?))
                });
                let by = most.map(|(name, rise, std)| format!("{name} +{rise:.4} ± {std:.4} "));
                let (id, since) = (&trend.actuator_id, &trend.reference_date);
                format!("{id} ({}since {since})", by.unwrap_or_default())
            })
            .collect();
        let noun = match warned.len() {
            0 => return None,
            1 => "Actuator that has",
            _ => "Actuators that have",
        };
        let named: Vec<&str> = warned.iter().map(String::as_str).collect();
        let change = fleet.warning_change;
        Some(format!(
            "{noun} worsened by the warning change of {change} or more: {}.",
            listed(&named)
        ))
    }

    fn overview(&self, names: &[&str]) -> Section {
        let with_id = self.records.iter().any(|record| record.actuator_id.is_some());
        let with_date = self.records.iter().any(|record| record.date.is_some());
        let mut columns = vec![Column::text("recording")];
        columns.extend(with_id.then(|| Column::text("actuator")));
        columns.extend(with_date.then(|| Column::text("date")));
        columns.push(Column::text("verdict"));
        columns.extend(FaultId::ALL.map(|id| Column::number(&id.short_name())));
        columns.push(Column::number("fit"));
        let row = |(record, name): (&RecordDiagnosis, &&str)| {
            let text = |text: &Option<String>| Cell::text(text.as_deref().unwrap_or("–"));
            let mut cells = vec![Cell::text(*name)];
            cells.extend(with_id.then(|| text(&record.actuator_id)));
            cells.extend(with_date.then(|| text(&record.date)));
            let unsound = matches!(record.verdict, Verdict::ModelInadequate | Verdict::Faulty);
            cells.push(Cell::text(record.verdict.word()).marked(unsound));
            cells.extend(FaultId::ALL.map(|id| level(record.fault(id), record.is_believed())));
            let ratio = record.fit.ratio();
            let cell = Cell::number(ratio, |ratio| format!("{ratio:.2}"));
            cells.push(cell.marked(!record.fit.adequate));
            cells
        };
        let rows: Vec<_> = self.records.iter().zip(names).map(row).collect();
        let caption = "Levels (0 as new, 1 full damage) ± standard deviation; underlined with *: \
                       detected; – : not determined; in brackets: not to be believed, for no levels explain \
                       the recording or the search did not finish. Fit: rms of the residual over what noise and \
                       learnt error explain, underlined where that is too much. A heading sorts.";
        let table = Table { caption: caption.to_owned(), columns, rows };
        let mut blocks = vec![Block::Table(table)];
        blocks.extend(self.next.iter().map(|next| Block::Text(next.clone())));
        Section::new("Recordings", blocks)
    }

    /// How the actuators change over time.
    fn trends(&self) -> Section {
        let fleet = self.fleet;
        let rows: Vec<_> = fleet.actuators.iter().map(|trend| trend_row(trend, fleet)).collect();
        let numbers = ["recordings", "largest change", "± sd", "seen from", "slope per 100 days"];
        let mut columns = vec![Column::text("actuator"), Column::text("change")];
        columns.push(Column::text("fault that rose most"));
        columns.extend(numbers.map(Column::number));
        columns.push(Column::text("reference"));
        columns.push(Column::text("latest"));
        let mut notices = self.records.iter().flat_map(|record| &record.notices);
        let by_itself = if notices.any(|one| one.code == NoticeCode::ReferenceUsed) {
            ""
        } else {
            " Each recording was taken by itself; beside recordings of the machine as new \
             (`--reference`, `--unit`) smaller changes are seen."
        };
        let caption = format!(
            "The latest recording of each actuator that the model explains, against its reference: \
             the earliest that it explains. Warning: a rise of {} or more and beyond {} standard \
             deviations; changed: beyond these alone. Seen from: the least rise of this fault that \
             would be a warning.{}",
            fleet.warning_change, fleet.significance, by_itself
        );
        let mut blocks = vec![Block::Table(Table { caption, columns, rows })];
        if !fleet.left_out.is_empty() {
            let count = fleet.left_out.len();
            blocks.push(Block::Text(format!(
                "In no trend, for want of an actuator id or a date: {count} of the recordings."
            )));
        }
        let mut order: Vec<&ActuatorTrend> =
            fleet.actuators.iter().filter(|trend| trend.points.len() > 1).collect();
        order.sort_by_key(|trend| std::cmp::Reverse(trend.change));
        let mut taken = BTreeSet::new();
        for trend in order.into_iter().take(FIGURES_SHOWN) {
            let Some(svg) = trend_figure_svg(trend, fleet.warning_change) else { continue };
            let from: Vec<_> = trend.points.iter().map(|p| p.recording.as_str()).collect();
            blocks.push(Block::Figure(Figure {
                name: file_name(&format!("trend-{}", trend.actuator_id), &mut taken),
                svg,
                caption: format!(
                    "Levels of actuator {} in days since its reference recording.",
                    trend.actuator_id
                ),
                source: listed(&from),
            }));
        }
        Section::new("Actuators over time", blocks)
    }

    /// One recording in figures.
    fn recording(
        &self,
        index: usize,
        name: &str,
        signals: Option<&FitSignals>,
        taken: &mut BTreeSet<String>,
    ) -> Section {
        let record = &self.records[index];
        let stem = file_name(name, taken);
        let figure = |kind: &str, svg: String, caption: String| {
            let name = format!("{stem}-{kind}");
            Block::Figure(Figure { name, svg, caption, source: record.recording.clone() })
        };
        let mut blocks = vec![Block::Text(of_one(record))];
        let detected = detected_findings(record);
        blocks.extend(detected.map(|told| Block::Text(format!("{}.", capitalised(&told)))));
        let detected = if record.findings.is_empty() {
            format!("Detected means a false-alarm rate of {FALSE_ALARM_RATE} at most.")
        } else {
            format!(
                "Detected means that a finding is: over all of them together, the false-alarm rate \
                 of a healthy machine within its tolerances is {FAMILY_FALSE_ALARM_RATE} at most."
            )
        };
        let caption = format!(
            "Fault levels with 95 % intervals. The dashed line is the end of the incipient range, \
             {INCIPIENT_LEVEL}. {detected}"
        );
        blocks.push(figure("levels", fault_figure_svg(record), caption));
        if !record.notices.is_empty() {
            let notices = record.notices.iter();
            let told = notices.map(|notice| format!("{}: {}", notice.code.code(), notice.message));
            blocks.push(Block::List(told.collect()));
        }
        let mut details: Vec<Block> =
            findings::table(record).map(Block::Table).into_iter().collect();
        if let Some(svg) = identifiability_figure_svg(record) {
            let caption = "Standard deviation of each level: now, with the one further recording or \
                           reading that would tell most (the same test again or on another day, \
                           recordings of the machine as new, the winding's temperature to 3 K, the \
                           motor's voltage), and with this recording \
                           free of noise and the model exact. Shared with: the number of the machine \
                           that would lower it most, were it known.";
            details.push(figure("identifiability", svg, caption.to_owned()));
        }
        details.extend(together::table(record).map(Block::Table));
        if let Some(signals) = signals {
            let caption = format!(
                "Filtered envelope of the stator current in A at {} Hz: measured, and the \
                 monitoring model at the levels above with the mean of its learnt error. Below, \
                 measured less modelled: {:.4} A rms, of which noise and learnt error explain \
                 {:.4} A. Noise on each phase sample: {:.4} A ({}).",
                signals.rate_hz,
                record.fit.rms_a,
                record.fit.noise_floor_a,
                record.fit.noise_a,
                record.fit.noise_source
            );
            details.push(figure("current", fit_figure_svg(record, signals), caption));
            if let Some(svg) = search_figure_svg(record, signals) {
                let caption = format!(
                    "Least rms of the residual in A that the method `{}` had reached after each \
                     evaluation of the model; {} evaluations in all.",
                    record.method, record.evaluations
                );
                details.push(figure("search", svg, caption));
            }
        }
        Section::new(name, blocks).with_details(details)
    }

    fn failed(&self) -> Section {
        let row = |failure: &Failure| {
            vec![Cell::text(failure.recording.as_str()), Cell::text(failure.error.as_str())]
        };
        let table = Table {
            caption: "Recordings that could not be diagnosed, and why.".to_owned(),
            columns: vec![Column::text("recording"), Column::text("reason")],
            rows: self.failures.iter().map(row).collect(),
        };
        Section::new("Not diagnosed", vec![Block::Table(table)])
    }

    /// Makes the section on the basis of the answer.
    fn basis(&self) -> Section {
        let mut facts = vec![format!("Program: {}, seed {}.", self.tool, self.seed)];
        let others: BTreeSet<&str> = self
            .records
            .iter()
            .filter_map(|record| record.bundle.as_deref())
            .filter(|bundle| *bundle != self.bundle)
            .collect();
        facts.push(format!("Bundle (SHA-256): {}.", self.bundle));
        if !others.is_empty() {
            let others: Vec<_> = others.into_iter().collect();
            facts.push(format!("Recordings of other tests: bundle {}.", others.join(", ")));
        }
        facts.extend(self.stamp.map(|stamp| format!("Made: {stamp}.")));
        if self.records.len() > FIGURES_SHOWN {
            facts.push(format!(
                "Drawn are {FIGURES_SHOWN} recordings: the latest of machines that are to be watched \
                 or acted on, what the model does not explain, then the largest detected levels. To \
                 draw another, diagnose it alone."
            ));
        }
        let mut blocks = vec![Block::List(facts)];
        if !self.settings.is_empty() {
            let rows = self.settings.iter().map(|one| {
                let words = [&one.name, &one.value, &one.origin];
                words.map(|word| Cell::text(word.as_str())).into()
            });
            blocks.push(Block::Table(Table {
                caption: "Settings that are not left at their defaults.".to_owned(),
                columns: ["setting", "value", "from"].map(Column::text).into(),
                rows: rows.collect(),
            }));
        }
        Section::new("What this rests on", blocks)
    }
}

/// One recording in a sentence.
fn of_one(record: &RecordDiagnosis) -> String {
    if let Some(found) = sentence(record) {
        return format!("{}: {found}.", capitalised(record.verdict.word()));
    }
    let highs = record.faults.iter().filter(|fault| fault.id != FaultId::K7);
    let most =
        highs.filter_map(|fault| fault.interval_95.map(|[_, high]| high)).fold(0.0, f64::max);
    let whole = if record.status == Status::Ok { "" } else { " (not everything was determined)" };
    format!("Healthy: no fault is detected, and none above {most:.3} is likely to hide{whole}.")
}

/// A batch in a sentence.
fn of_many(records: &[RecordDiagnosis], names: &[&str]) -> String {
    let told = [
        (Verdict::Faulty, "faulty"),
        (Verdict::Healthy, "healthy"),
        (Verdict::Undetermined, "undetermined"),
        (Verdict::ModelInadequate, "not explained by the model"),
    ]
    .map(|(verdict, word)| (records.iter().filter(|one| one.verdict == verdict).count(), word));
    let told: Vec<_> = told
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, word)| format!("{count} {word}"))
        .collect();
    let counts = format!("{} recordings: {}.", records.len(), told.join(", "));
    let believed = (0..records.len()).filter(|&i| records[i].verdict == Verdict::Faulty);
    let gravest = believed.max_by(|&a, &b| largest(&records[a]).total_cmp(&largest(&records[b])));
    if let Some(index) = gravest
        && let Some(Fault { name, value: Some(value), std: Some(std), .. }) = worst(&records[index])
    {
        let level = plus_minus(*value, *std, " ± ");
        return format!("{counts} The largest level is {name} {level} in {}.", names[index]);
    }
    counts
}

/// The latest recording that the model explains.
fn latest(trend: &ActuatorTrend) -> Option<&TrendPoint> {
    trend.points.iter().rev().find(|point| point.is_judged())
}

/// The level that has risen most by then.
fn risen_most(trend: &ActuatorTrend) -> Option<&FaultChange> {
    let known = latest(trend)?.faults.iter().filter(|fault| fault.difference.is_some());
    known.max_by(|a, b| a.difference.unwrap_or(0.0).total_cmp(&b.difference.unwrap_or(0.0)))
}

/// The row of an actuator.
fn trend_row(trend: &ActuatorTrend, fleet: &Fleet) -> Vec<Cell> {
    let latest = latest(trend);
    let most = risen_most(trend);
    let slope = most.and_then(|fault| trend.slopes.iter().find(|slope| slope.id == fault.id));
    let std = most.and_then(|fault| fault.difference_std);
    let signed = |value: f64| format!("{value:+.4}");
    vec![
        Cell::text(trend.actuator_id.as_str()),
        Cell::text(match trend.change {
            // what is too small to be seen may be there
            Change::Steady => "none seen",
            other => other.word(),
        })
        .marked(trend.change == Change::Warning),
        Cell::text(
            most.map_or("–".to_owned(), |fault| format!("{} {}", fault.id, fault.id.name())),
        ),
        Cell::number(Some(trend.points.len() as f64), |count| count.to_string()),
        Cell::number(most.and_then(|fault| fault.difference), signed)
            .marked(trend.change == Change::Warning),
        Cell::number(std, |std| format!("{std:.4}")),
        Cell::number(std.map(|std| fleet.seen_from(std)), |least| format!("{least:.4}")),
        Cell::number(slope.map(|slope| 100.0 * slope.per_day), signed),
        Cell::text(trend.reference_date.as_str()),
        Cell::text(latest.map_or("–", |point| point.date.as_str())),
    ]
}

/// The level of a fault with its standard deviation, in brackets where it is not to be believed.
fn level(fault: Option<&Fault>, believed: bool) -> Cell {
    let Some(Fault { value: Some(value), std: Some(std), detected, .. }) = fault else {
        return Cell::number(None, |value| value.to_string());
    };
    let text = plus_minus(*value, *std, "±");
    if !believed {
        return Cell::number(Some(*value), |_| format!("({text})"));
    }
    let detected = *detected == Some(true);
    let mark = if detected { " *" } else { "" };
    Cell::number(Some(*value), |_| format!("{text}{mark}")).marked(detected)
}

/// Some of a list, and how many more there are.
fn listed(names: &[&str]) -> String {
    const LISTED: usize = 8;
    let shown = names[..names.len().min(LISTED)].join(", ");
    match names.len().saturating_sub(LISTED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// A name for the drawings of a recording that no other has.
fn file_name(name: &str, taken: &mut BTreeSet<String>) -> String {
    let safe = |letter: char| {
        let plain = letter.is_ascii_alphanumeric() || "-_.".contains(letter);
        if plain { letter } else { '-' }
    };
    let stem: String = name.trim_start_matches('.').chars().map(safe).collect();
    let numbered = (2..).map(|count| format!("{stem}-{count}"));
    let mut names = std::iter::once(stem.clone()).chain(numbered);
    let free = names.find(|name| !taken.contains(name)).expect("there is no end of numbers");
    taken.insert(free.clone());
    free
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawings_have_names_of_their_own() {
        let mut taken = BTreeSet::new();
        let names = ["a/b.csv", "a-b.csv", "../x.csv", "ü"].map(|n| file_name(n, &mut taken));
        assert_eq!(names, ["a-b.csv", "a-b.csv-2", "-x.csv", "-"]);
    }
}
