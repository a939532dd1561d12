//! Decisions of a report, machine by machine: the worst first.

use super::content::{Block, Cell, Column, Section, Table};
use crate::{
    Action, Failure, FaultAction, Fleet, RecordDiagnosis, Severity, percent, three_digits,
};

/// Machines that the answer names.
const NAMED: usize = 5;

/// A machine, by the latest recording of it that is believed.
struct Machine<'a> {
    /// Place of that recording.
    place: usize,
    name: &'a str,
    date: Option<&'a str>,
    action: &'a Action,
    /// Later recordings that could not be judged.
    unjudged: usize,
}

/// Decisions about the machines of a batch, the most urgent first: by severity, then by the probability
/// that the worst fault is above its levels.
pub(super) struct Decisions<'a> {
    machines: Vec<Machine<'a>>,
}

impl<'a> Decisions<'a> {
    pub(super) fn of(
        records: &'a [RecordDiagnosis],
        failures: &[Failure],
        names: &[&'a str],
    ) -> Self {
        let machine = |place: usize| {
            let record = &records[place];
            let action = record.action.as_ref()?;
            let id = record.actuator_id.as_deref();
            let date = record.date.as_deref();
            let is_later = |other: &Option<String>, taken: &Option<String>| {
                let (Some(taken), Some(date)) = (taken, date) else { return false };
                id.is_some() && other.as_deref() == id && Fleet::is_later(taken, date)
            };
            let unjudged =
                records.iter().filter(|one| is_later(&one.actuator_id, &one.date)).count()
                    + failures.iter().filter(|one| is_later(&one.actuator_id, &one.date)).count();
            Some(Machine { place, name: id.unwrap_or(names[place]), date, action, unjudged })
        };
        let mut machines: Vec<_> = Fleet::latest(records).into_iter().filter_map(machine).collect();
        let above = |one: &Machine<'_>| {
            one.action.probability_above.map_or([0.0; 2], |above| [above.act, above.watch])
        };
        machines.sort_by(|a, b| {
            let by_severity = b.action.severity.cmp(&a.action.severity);
            let ([act, watch], [others, other]) = (above(b), above(a));
            by_severity.then(act.total_cmp(&others)).then(watch.total_cmp(&other))
        });
        Self { machines }
    }

    /// Places of the recordings that they are by.
    pub(super) fn places(&self) -> Vec<usize> {
        self.machines.iter().map(|machine| machine.place).collect()
    }

    /// The decisions in a sentence; `None` where none were made.
    pub(super) fn sentence(&self) -> Option<String> {
        let machines = &self.machines;
        let [first, ..] = &machines[..] else { return None };
        if let [only] = &machines[..] {
            let Action { severity, reason, .. } = only.action;
            return Some(format!("{}: {reason}. Next: {}.", heading(*severity), only.next()));
        }
        let told: Vec<String> = [Severity::Act, Severity::Watch, Severity::Undecided]
            .into_iter()
            .filter_map(|severity| {
                let of = machines.iter().filter(|one| one.action.severity == severity);
                let of: Vec<&str> = of.map(|one| one.name).collect();
                let named = of[..of.len().min(NAMED)].join(", ");
                let more = match of.len().saturating_sub(NAMED) {
                    0 => String::new(),
                    more => format!(" and {more} more"),
                };
                let name = heading(severity).to_lowercase();
                (!of.is_empty()).then(|| format!("{} {name} ({named}{more})", of.len()))
            })
            .collect();
        let all = machines.len();
        if told.is_empty() {
            return Some(format!("Nothing to do on {all} machines: {}.", first.action.next));
        }
        let is_nothing = |one: &&Machine<'_>| one.action.severity == Severity::Nothing;
        let rest = match machines.iter().filter(is_nothing).count() {
            0 => String::new(),
            rest => format!(", {rest} with nothing to do"),
        };
        Some(format!("{all} machines: {}{rest}.", told.join(", ")))
    }

    /// The section; `None` where no decisions were made.
    pub(super) fn section(&self) -> Option<Section> {
        let machines = &self.machines;
        let with_date = machines.iter().any(|one| one.date.is_some());
        let rows: Vec<_> = machines.iter().map(|machine| machine.row(with_date)).collect();
        let caption = format!(
            "Each machine by its latest recording that is believed, the most urgent first. Worst \
             fault: median of its size and 95 % interval. Above: probability that the size is above \
             the level for watching and for acting{}.",
            levels(machines)
        );
        let mut columns = vec![Column::text("machine")];
        columns.extend(with_date.then(|| Column::text("date")));
        columns.extend(["decision", "worst fault"].map(Column::text));
        columns.extend(["above watch", "above act"].map(Column::number));
        columns.push(Column::text("next step"));
        let blocks = vec![Block::Table(Table { caption, columns, rows })];
        (!machines.is_empty()).then(|| Section::new("What to do", blocks))
    }
}

impl Machine<'_> {
    /// The next step, and later recordings that it knows nothing of.
    fn next(&self) -> String {
        let next = &self.action.next;
        match self.unjudged {
            0 => next.clone(),
            1 => format!("{next}; a later recording could not be judged"),
            count => format!("{next}; {count} later recordings could not be judged"),
        }
    }

    fn row(&self, with_date: bool) -> Vec<Cell> {
        let Action { severity, fault, probability_above, reason, faults, .. } = self.action;
        let others = |one: &&FaultAction| Some(one.id) != *fault && one.severity >= Severity::Watch;
        let sized = |known: &FaultAction| {
            let FaultAction { id, size, interval_95, unit, .. } = known;
            let [size, low, high] = [*size, interval_95[0], interval_95[1]].map(three_digits);
            format!("{} {size} ({low} to {high}) {unit}", id.name())
        };
        let worst = faults.iter().find(|known| Some(known.id) == *fault);
        let told: Vec<String> =
            worst.into_iter().chain(faults.iter().filter(others)).map(sized).collect();
        let mut cells = vec![Cell::text(self.name)];
        cells.extend(with_date.then(|| Cell::text(self.date.unwrap_or("–"))));
        cells.push(Cell::text(heading(*severity)).marked(*severity >= Severity::Watch));
        cells.push(Cell::text(if told.is_empty() { reason.clone() } else { told.join("; ") }));
        let short = |share| percent(share).replace("more than", ">").replace("less than", "<");
        let shown = |above: Option<f64>| Cell::number(above, short);
        cells.push(shown(probability_above.map(|above| above.watch)));
        cells.push(shown(probability_above.map(|above| above.act)));
        cells.push(Cell::text(self.next()));
        cells
    }
}

/// Levels for watching and for acting, those of the three phases once where they are the same.
fn levels(machines: &[Machine<'_>]) -> String {
    let known = machines.iter().find(|one| !one.action.faults.is_empty());
    let mut told: Vec<String> = Vec::new();
    for fault in known.map_or(&[][..], |one| &one.action.faults) {
        let name = fault.id.name();
        let name = ["A", "B", "C"].iter().fold(name.to_owned(), |name, phase| {
            name.replace(&format!("phase {phase}"), "a phase")
        });
        let [watch, act] = [fault.levels.watch, fault.levels.act].map(three_digits);
        let line = format!("{name} {watch} and {act} {}", fault.unit);
        if told.last() != Some(&line) {
            told.push(line);
        }
    }
    if told.is_empty() { String::new() } else { format!(": {}", told.join("; ")) }
}

/// A decision as a heading.
fn heading(severity: Severity) -> &'static str {
    match severity {
        Severity::Nothing => "Nothing to do",
        Severity::Undecided => "Undecided",
        Severity::Watch => "To be watched",
        Severity::Act => "To be acted on",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FaultId, Limits, Verdict, document::tests::record};

    fn decided(id: &str, date: &str, severity: Severity, act: f64) -> RecordDiagnosis {
        let above = Limits { watch: 0.5 + 0.5 * act, act };
        let fault = FaultAction {
            id: FaultId::K1,
            severity,
            size: 12.345,
            interval_95: [10.0, 14.0],
            unit: "% of friction torque above nominal".to_owned(),
            levels: Limits { watch: 20.0, act: 40.0 },
            probability_above: above,
            prior_above: Limits { watch: 0.1, act: 0.01 },
        };
        let action = Action {
            severity,
            fault: Some(FaultId::K1),
            probability_above: Some(above),
            reason: "worn".to_owned(),
            next: "look".to_owned(),
            faults: vec![fault],
        };
        let (id, date) = (Some(id.to_owned()), Some(date.to_owned()));
        RecordDiagnosis { actuator_id: id, date, action: Some(action), ..record() }
    }

    #[test]
    fn the_most_urgent_machine_is_first_by_its_latest_recording() {
        let records = [
            decided("A", "2026-01-02", Severity::Nothing, 0.0),
            decided("A", "2026-01-01", Severity::Act, 0.99),
            decided("B", "2026-01-01", Severity::Watch, 0.1),
            decided("C", "2026-01-01", Severity::Act, 0.91),
            decided("D", "2026-01-01", Severity::Act, 0.95),
        ];
        let names = ["r"; 5];
        let decisions = Decisions::of(&records, &[], &names);
        let found: Vec<&str> = decisions.machines.iter().map(|one| one.name).collect();
        assert_eq!(found, ["D", "C", "B", "A"]);
        let told = decisions.sentence().unwrap();
        let want =
            "4 machines: 2 to be acted on (D, C), 1 to be watched (B), 1 with nothing to do.";
        assert_eq!(told, want);
        let of = |records| Decisions::of(records, &[], &names).sentence();
        assert_eq!(of(&records[2..3]).unwrap(), "To be watched: worn. Next: look.");
        assert_eq!(of(&[record()]), None);
    }

    #[test]
    fn a_recording_that_is_not_believed_takes_no_decision_back() {
        let mut strange = decided("A", "2026-02-01", Severity::Undecided, 0.0);
        strange.verdict = Verdict::ModelInadequate;
        let records = [decided("A", "2026-01-01", Severity::Act, 0.99), strange];
        let broken = Failure {
            recording: "r3".to_owned(),
            actuator_id: Some("A".to_owned()),
            date: Some("2026-03-01".to_owned()),
            error: "cut".to_owned(),
        };
        let told = Decisions::of(&records, &[broken], &["r"; 2]).sentence().unwrap();
        let want = "To be acted on: worn. Next: look; 2 later recordings could not be judged.";
        assert_eq!(told, want);
    }
}
