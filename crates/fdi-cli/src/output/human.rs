//! A table, what it means, and what to know about it.

use std::{
    collections::BTreeMap,
    fmt::{self, Write as _},
    io::{self, Write},
};

use anstyle::{AnsiColor, Style};
use fdi_report::{
    Action, Fault, FaultId, Identifiability, NoticeCode, OpenFindings, PooledLevel,
    PooledRecording, RecordDiagnosis, Verdict, common_folder, detected_findings, plus_minus,
    sentence, two_digits,
};

use super::{
    answer::{Answer, AnswerWriter, Head},
    table,
};

/// How a detected fault is marked, besides colour.
const MARK: &str = " *";

/// Collects the rows, since a table is as wide as its widest cell.
pub(super) struct Human<'a> {
    out: &'a mut dyn Write,
    styled: bool,
    rows: Vec<Row>,
    /// Rows by what is detected beyond tolerances.
    detected: BTreeMap<String, Vec<usize>>,
    open: OpenFindings,
    notices: BTreeMap<(NoticeCode, String), Vec<usize>>,
}

/// Parts of a record that the table and the sentences need.
struct Row {
    recording: String,
    cells: Vec<String>,
    sentence: Option<String>,
    detected: bool,
    /// True where it has levels that are not to be believed.
    is_doubtful: bool,
    /// Severity and next step.
    action: Option<String>,
    together: Vec<PooledRecording>,
    identifiability: Vec<Identifiability>,
}

impl<'a> Human<'a> {
    pub(super) fn new(out: &'a mut dyn Write, styled: bool) -> Self {
        Self {
            out,
            styled,
            rows: Vec::new(),
            detected: BTreeMap::new(),
            open: OpenFindings::default(),
            notices: BTreeMap::new(),
        }
    }

    fn names(&self) -> Vec<&str> {
        let full: Vec<_> = self.rows.iter().map(|row| row.recording.as_str()).collect();
        let folder = common_folder(&full);
        full.iter().map(|name| &name[folder..]).collect()
    }

    /// The table, what it means, and what to know about it.
    fn tell(&self, text: &mut String) -> fmt::Result {
        let names = self.names();
        let header = ["recording", "verdict"].map(str::to_owned).into_iter();
        let header: Vec<_> =
            header.chain(FaultId::ALL.map(FaultId::short_name)).chain(["fit".into()]).collect();
        let with_name = |(name, row): (&&str, &Row)| {
            std::iter::once((*name).to_owned()).chain(row.cells.iter().cloned()).collect()
        };
        let rows: Vec<Vec<String>> = names.iter().zip(&self.rows).map(with_name).collect();
        table(text, &header, &rows)?;
        let told = |is_told: &dyn Fn(&Row) -> bool, words: &'static str| {
            if self.rows.iter().any(is_told) { words } else { "" }
        };
        let marked = told(&|row| row.detected, "* detected; ");
        let doubtful = told(&|row| row.is_doubtful, "( ) not to be relied on; ");
        let rest = "- not determined; fit: residual over noise and learnt error";
        writeln!(text, "\n{marked}{doubtful}{rest}")?;
        let sentence = |(name, row): (&&str, &Row)| {
            row.sentence.as_ref().map(|sentence| format!("{name}: {sentence}\n"))
        };
        let sentences: Vec<_> = names.iter().zip(&self.rows).filter_map(sentence).collect();
        let action = |(name, row): (&&str, &Row)| {
            row.action.as_ref().map(|action| format!("{name}: {action}\n"))
        };
        let actions: Vec<_> = names.iter().zip(&self.rows).filter_map(action).collect();
        let notice = |((code, message), of): (&(NoticeCode, String), &Vec<usize>)| {
            format!("{}: {message} ({})\n", code.code(), listed(of, &names))
        };
        let notices: Vec<_> = self.notices.iter().map(notice).collect();
        let mut findings: Vec<(&str, &[usize])> =
            self.detected.iter().map(|(line, of)| (line.as_str(), &of[..])).collect();
        findings.sort_by_key(|(_, of)| of.first());
        let open = self.open.lines();
        findings.extend(open.iter().map(|(line, of)| (line.as_str(), *of)));
        let finding = |(line, of): (&str, &[usize])| format!("{line} ({})\n", listed(of, &names));
        let findings: Vec<_> = findings.into_iter().map(finding).collect();
        for block in [actions, sentences, findings, notices] {
            if !block.is_empty() {
                write!(text, "\n{}", block.concat())?;
            }
        }
        names.iter().zip(&self.rows).try_for_each(|(name, row)| {
            members(text, name, row)?;
            identifiability(text, name, row)
        })
    }
}

impl AnswerWriter for Human<'_> {
    fn begin(&mut self, _head: &Head) -> io::Result<()> {
        Ok(())
    }

    fn answer(&mut self, answer: &Answer) -> io::Result<()> {
        let Answer::Diagnosed(record) = answer else { return Ok(()) };
        let row = self.rows.len();
        if let Some(line) = detected_findings(record) {
            self.detected.entry(line).or_default().push(row);
        }
        self.open.push(row, record);
        for notice in &record.notices {
            let of = self.notices.entry((notice.code, notice.message.clone())).or_default();
            of.push(row);
        }
        self.rows.push(Row {
            recording: record.recording.clone(),
            cells: cells(record),
            // what a notice says is said with its code
            sentence: sentence(record)
                .filter(|sentence| record.notices.iter().all(|one| one.message != *sentence)),
            detected: record.is_believed() && record.any_detected(),
            is_doubtful: !record.is_believed() && record.faults.iter().any(|f| f.std.is_some()),
            action: record.action.as_ref().map(|one| {
                let Action { severity, reason, next, .. } = one;
                format!("{severity}: {reason}: {next}")
            }),
            together: record.together.clone(),
            identifiability: record.identifiability.clone(),
        });
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let mut text = String::new();
        self.tell(&mut text).expect("a String takes all text");
        if !self.styled {
            text = anstream::adapter::strip_str(&text).to_string();
        }
        self.out.write_all(text.as_bytes())
    }
}

/// The recordings that an answer is of, with what each shows by itself.
fn members(text: &mut String, name: &str, row: &Row) -> fmt::Result {
    if row.together.len() < 2 {
        return Ok(());
    }
    writeln!(text, "\n{name}, each by itself (in brackets ± of the answer without it):\n")?;
    let full: Vec<&str> = row.together.iter().map(|one| one.recording.as_str()).collect();
    let folder = common_folder(&full);
    let ids = &FaultId::ALL[..6];
    let header: Vec<String> = ["recording", "session", "verdict"].map(str::to_owned).into();
    let header = [header, ids.iter().map(|id| id.short_name()).collect()].concat();
    let cells = |one: &PooledRecording| -> Vec<String> {
        let level =
            |&id: &FaultId| one.level(id).map_or_else(|| "-".to_owned(), PooledLevel::in_words);
        let session = one.session.clone().unwrap_or_else(|| "-".to_owned());
        let verdict = match one.left_out {
            Some(_) => format!("{} (left out)", one.verdict),
            None => one.verdict.to_string(),
        };
        let told = vec![one.recording[folder..].to_owned(), session, verdict];
        [told, ids.iter().map(level).collect()].concat()
    };
    let rows: Vec<Vec<String>> = row.together.iter().map(cells).collect();
    table(text, &header, &rows)
}

/// How well each fault can be told, and what would tell more.
fn identifiability(text: &mut String, name: &str, row: &Row) -> fmt::Result {
    if row.identifiability.is_empty() {
        return Ok(());
    }
    writeln!(text, "\n{name}, standard deviation of each fault:\n")?;
    let header = ["fault", "now", "without noise and error", "shared with", "would help most"];
    let cells = |one: &Identifiability| {
        let with = |what: &str, std: f64| format!("{what}: {}", two_digits(std));
        let shared = one.shared_with.as_ref().map(|one| with(&one.key, one.std));
        let help = one.would_help.as_ref().map(|one| with(one.what.in_words(), one.std));
        let [now, least] = [one.std, one.least_std].map(two_digits);
        let open = [shared, help].map(|cell| cell.unwrap_or_else(|| "-".to_owned()));
        [vec![one.id.short_name(), now, least], open.to_vec()].concat()
    };
    let rows: Vec<Vec<String>> = row.identifiability.iter().map(cells).collect();
    table(text, &header.map(str::to_owned), &rows)
}

/// The recordings of a notice; a long list is cut, JSON has it all.
fn listed(rows: &[usize], names: &[&str]) -> String {
    const SHOWN: usize = 6;
    if rows.len() == names.len() && rows.len() > 1 {
        return "all recordings".to_owned();
    }
    let shown: Vec<_> = rows.iter().take(SHOWN).map(|&row| names[row]).collect();
    let rest = rows.len().saturating_sub(SHOWN);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

fn cells(record: &RecordDiagnosis) -> Vec<String> {
    let mut cells = vec![paint(record.verdict.word(), of_verdict(record.verdict))];
    let is_believed = record.is_believed();
    let cell = |fault: &Fault| level(fault, is_believed);
    for id in FaultId::ALL {
        cells.push(record.fault(id).map_or_else(|| "-".to_owned(), cell));
    }
    let fit = record.fit.ratio().map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.2}"));
    let fit = if record.fit.adequate { fit } else { format!("{fit} !") };
    cells.push(fit);
    cells
}

/// A level, marked where the fault is detected, and in brackets where it is not to be believed.
fn level(fault: &Fault, is_believed: bool) -> String {
    let (Some(value), Some(std)) = (fault.value, fault.std) else { return "-".to_owned() };
    let text = plus_minus(value, std, "±");
    if !is_believed {
        format!("({text})")
    } else if fault.detected == Some(true) {
        paint(&(text + MARK), Style::new().bold().fg_color(Some(AnsiColor::Red.into())))
    } else {
        text
    }
}

fn of_verdict(verdict: Verdict) -> Style {
    let color = match verdict {
        Verdict::Healthy => AnsiColor::Green,
        Verdict::Faulty => AnsiColor::Red,
        Verdict::Undetermined | Verdict::ModelInadequate => AnsiColor::Yellow,
    };
    Style::new().fg_color(Some(color.into()))
}

/// Text in a style; the stream takes the escape sequences out where there is no
/// colour.
fn paint(text: &str, style: Style) -> String {
    format!("{style}{text}{style:#}")
}
