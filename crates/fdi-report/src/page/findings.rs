//! The table of the findings of a recording.

use super::content::{Cell, Column, Table};
use crate::{Finding, FindingKind, RecordDiagnosis, plus_minus, sentence::to_digits_of};

const CAPTION: &str = "Findings: directions of damage, with what the tolerances of the machine leave open of each. \
     Size: a level (0 as new, 1 full damage) before it is cut at 0, ± standard deviation (sd). \
     Imbalance: a phase less the mean of the others; torque constant: the mean of the phases. \
     Detected: beyond noise and tolerances; open: not told from tolerances. The last two sd: what \
     the tolerances alone and the recording alone leave open.";

/// The findings of a recording; `None` where there are none.
pub(super) fn table(record: &RecordDiagnosis) -> Option<Table> {
    if record.findings.is_empty() {
        return None;
    }
    let believed = record.is_believed();
    let mut caption = CAPTION.to_owned();
    if !believed {
        caption.push_str(
            " In brackets: not to be believed, for no levels explain the recording or the search \
             did not finish.",
        );
    }
    let numbers = ["size ± sd", "95 % interval", "sd by tolerances", "sd by recording"];
    let [size, interval, tolerances, recording] = numbers.map(Column::number);
    let columns = vec![
        Column::text("finding"),
        size,
        interval,
        Column::text("detected"),
        tolerances,
        recording,
        Column::text("would tell"),
    ];
    let rows = record.findings.iter().map(|finding| row(finding, believed)).collect();
    Some(Table { caption, columns, rows })
}

fn row(finding: &Finding, believed: bool) -> Vec<Cell> {
    let Finding { value, std, interval_95: [low, high], .. } = *finding;
    let detected = believed && finding.detected;
    let bracketed = |text: String| if believed { text } else { format!("({text})") };
    let mark = if detected { " *" } else { "" };
    let answer = match finding.kind {
        _ if !believed => "–",
        _ if finding.detected => "yes",
        FindingKind::Ambiguous => "open",
        FindingKind::Known | FindingKind::Changed => "no",
    };
    let sd = |part: f64| Cell::number(Some(part), |part| to_digits_of(part, part));
    vec![
        Cell::text(finding.label()),
        Cell::number(Some(value), |value| bracketed(plus_minus(value, std, "±") + mark))
            .marked(detected),
        Cell::number(Some(low), |low| {
            bracketed(format!("{} to {}", to_digits_of(low, std), to_digits_of(high, std)))
        }),
        Cell::text(answer).marked(detected),
        sd(finding.prior_std),
        sd(finding.posterior_std),
        Cell::text(finding.would_tell.as_deref().unwrap_or("–")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Verdict,
        document::{
            finding_tests::{ambiguous, finding},
            tests::record,
        },
        page::{content::Block, content::Page, content::Section},
    };

    fn found() -> RecordDiagnosis {
        let mut record = record();
        record.findings = vec![
            finding("imbalance-a", &["k3", "as-built.turns"], 0.031, 0.004),
            ambiguous("friction", &["k1"], "a recording & <more>"),
            finding("play", &["k2"], -0.0003, 0.02),
        ];
        record
    }

    fn words(row: &[Cell]) -> Vec<&str> {
        row.iter().map(|cell| cell.text.as_str()).collect()
    }

    #[test]
    fn each_finding_has_a_row() {
        assert!(table(&record()).is_none());
        let table = table(&found()).unwrap();
        assert_eq!(table.columns.len(), table.rows[0].len());
        assert_eq!(
            table.rows.iter().map(|row| words(row)).collect::<Vec<_>>(),
            [
                [
                    "imbalance of phase A (k3)",
                    "0.031±0.004 *",
                    "0.023 to 0.039",
                    "yes",
                    "0.003",
                    "0.002",
                    "–"
                ],
                [
                    "friction (k1)",
                    "0.020±0.100",
                    "-0.180 to 0.220",
                    "open",
                    "0.080",
                    "0.060",
                    "a recording & <more>"
                ],
                ["backlash (k2)", "0.000±0.020", "-0.040 to 0.040", "no", "0.016", "0.012", "–"],
            ]
        );
        let marked = |row: &Vec<Cell>| row.iter().filter(|cell| cell.marked).count();
        assert_eq!(table.rows.iter().map(marked).collect::<Vec<_>>(), [2, 0, 0]);
    }

    #[test]
    fn findings_that_are_not_to_be_believed_are_in_brackets() {
        let mut record = found();
        record.verdict = Verdict::ModelInadequate;
        let table = table(&record).unwrap();
        assert_eq!(words(&table.rows[0])[1..4], ["(0.031±0.004)", "(0.023 to 0.039)", "–"]);
        assert!(table.rows.iter().flatten().all(|cell| !cell.marked));
        assert!(table.caption.contains("In brackets"));
    }

    #[test]
    fn what_would_tell_cannot_become_markup() {
        let blocks = vec![Block::Table(table(&found()).unwrap())];
        let section = Section::new("", blocks);
        let page = Page { sections: vec![section], ..Page::default() };
        assert!(page.html().contains("a recording &amp; &lt;more&gt;"));
    }
}
