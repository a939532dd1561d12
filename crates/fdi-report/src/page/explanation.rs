//! The report of what a model misses.

use super::{
    content::{Block, Cell, Column, Figure, Page, Section, Table},
    diagnosis::capitalised,
};
use crate::{
    EffectFinding, Explanation, ExplanationVerdict, FaultBeforeAfter, HypothesisOutcome,
    HypothesisRefit, NominalChange, NumberFinding, RecordFit, Sensitivity, SignalFinding, Standing,
    fault_change_figure_svg, figure::four_digits as rounded, held_out_figure_svg,
    residual_curve_figure_svg, residual_curves_figure_svg,
};

/// Standard deviations to either end of a 95 % interval.
const Z_95: f64 = 1.96;
/// Chance below which a residual is called not white.
const NOT_WHITE: f64 = 0.01;

/// The page of an answer.
pub(super) fn page(answer: &Explanation) -> Page {
    let sections = [
        signals(answer),
        found(answer),
        residual(answer),
        faults(answer),
        recordings(answer),
        hypotheses(answer),
        left(answer),
        sensitivity(answer),
        Some(basis(answer)),
    ];
    Page {
        subject: String::new(),
        title: format!("What the model “{}” misses", answer.model),
        answer: answer.sentence.clone(),
        sections: sections.into_iter().flatten().collect(),
    }
}

fn section(heading: &str, blocks: Vec<Block>) -> Option<Section> {
    (!blocks.is_empty()).then(|| Section::new(heading, blocks))
}

fn figure(
    answer: &Explanation,
    (name, roles): (&str, &[&str]),
    svg: Option<String>,
    caption: String,
) -> Option<Block> {
    let name = format!("explanation-{name}");
    let of = |svg| Figure { name, svg, caption, source: source(answer, roles) };
    svg.map(of).map(Block::Figure)
}

/// Uses of recordings, by the names of their roles.
const ROLES: [(&str, &str); 3] =
    [("train", "fitted"), ("holdout", "held out"), ("repeat", "repetitions")];

/// The recordings of these uses.
fn source(answer: &Explanation, roles: &[&str]) -> String {
    let of = |(role, word): (&str, &str)| {
        let names: Vec<&str> = answer
            .records
            .iter()
            .filter(|record| record.role == role)
            .map(|record| record.recording.as_str())
            .collect();
        (!names.is_empty()).then(|| format!("{} ({word})", names.join(", ")))
    };
    let wanted = ROLES.into_iter().filter(|(role, _)| roles.contains(role));
    wanted.filter_map(of).collect::<Vec<_>>().join("; ")
}

/// Finds of the signal chain.
fn signals(answer: &Explanation) -> Option<Section> {
    if answer.signals.is_empty() {
        return None;
    }
    let row = |signal: &SignalFinding| {
        let done = if signal.corrected { "set right by `--correct`" } else { &signal.remedy };
        vec![Cell::text(capitalised(&signal.told)), Cell::text(done.to_owned())]
    };
    let table = Table {
        caption: "What controller, motion and samples say before any physics.".to_owned(),
        columns: vec![Column::text("recording and lack"), Column::text("remedy")],
        rows: answer.signals.iter().map(row).collect(),
    };
    section("The signal chain", vec![Block::Table(table)])
}

/// Effects found, in numbers, and their worth on recordings that were not fitted.
fn found(answer: &Explanation) -> Option<Section> {
    let mut blocks = Vec::new();
    for (effects, caption) in [
        (&answer.effects, "Effects found, with their numbers by the keys of the model file."),
        (
            &answer.alternatives,
            "Effects that explain the recordings as well as one of those above.",
        ),
    ] {
        if !effects.is_empty() {
            blocks.push(Block::Table(effect_table(effects, caption)));
        }
    }
    if !answer.numbers.is_empty() {
        blocks.push(Block::Table(number_table(&answer.numbers)));
    }
    let worth = |effect: &EffectFinding| {
        format!(
            "{} ({}) acts at the port {}. Chance that noise alone makes any effect score as much: \
             {} at most. Gain in log-likelihood on recordings that were not fitted: {:.1} ± {:.1} nats. \
             What tells it from its look-alikes: {}.",
            capitalised(&effect.name),
            effect.id,
            effect.port,
            effect.p_familywise,
            effect.holdout_gain_nats,
            effect.holdout_gain_se,
            effect.separated_by
        )
    };
    if !answer.effects.is_empty() {
        blocks.push(Block::List(answer.effects.iter().map(worth).collect()));
    }
    if let Some(holdout) = &answer.holdout {
        let closed = holdout.gap_closed_frac.map_or(
            "the nominal model is within 2 % of the noise already".to_owned(),
            |share| {
                if share >= 1.0 {
                    return "the gap to the noise is closed".to_owned();
                }
                format!("{:.1} % of the gap to the noise is closed", 100.0 * share)
            },
        );
        let floor = answer.floor_name();
        let caption = format!(
            "Root mean square of measured less modelled in recordings that were not fitted, with \
             the nominal model and with what was found, and of the {floor}: {closed}."
        );
        blocks.extend(figure(
            answer,
            ("held-out", &["holdout"]),
            held_out_figure_svg(answer),
            caption,
        ));
    }
    let heading = match answer.verdict {
        ExplanationVerdict::OneOf => "One of these",
        _ if answer.effects.is_empty() && answer.numbers.is_empty() => {
            "Recordings that were not fitted"
        }
        _ => "What was found",
    };
    section(heading, blocks)
}

fn interval_cell([low, high]: [f64; 2]) -> Cell {
    Cell::number(Some(low), |low| format!("{} to {}", rounded(low), rounded(high)))
}

fn number_table(numbers: &[NumberFinding]) -> Table {
    let row = |number: &NumberFinding| {
        vec![
            Cell::text(number.key()),
            Cell::number(Some(number.nominal), rounded),
            Cell::number(Some(number.value), rounded),
            interval_cell(number.interval_95),
            Cell::number(Some(number.tolerance), rounded),
        ]
    };
    let mut columns = vec![Column::text("number of the model file")];
    let heads = ["in the file", "by the recordings", "95 % interval", "tolerance, ±"];
    columns.extend(heads.map(Column::number));
    Table {
        caption:
            "Numbers that the recordings have beyond their tolerance: the model file is wrong."
                .to_owned(),
        columns,
        rows: numbers.iter().map(row).collect(),
    }
}

fn effect_table(effects: &[EffectFinding], caption: &str) -> Table {
    let mut columns = ["effect", "number"].map(Column::text).to_vec();
    columns.extend(["value", "95 % interval"].map(Column::number));
    let mut rows = Vec::new();
    for effect in effects {
        let instead = instead(effect);
        for (key, number) in &effect.parameters {
            let interval = number.interval_95.map_or_else(
                || Cell { text: "not fitted".to_owned(), ..Cell::default() },
                interval_cell,
            );
            rows.push(vec![
                Cell::text(format!("{} {}{instead}", effect.id, effect.name)),
                Cell::text(key.as_str()),
                Cell::number(Some(number.value), rounded),
                interval,
            ]);
        }
    }
    Table { caption: caption.to_owned(), columns, rows }
}

/// The residual over the coordinates.
fn residual(answer: &Explanation) -> Option<Section> {
    let first = answer.curves.first()?;
    let caption = format!(
        "Measured less modelled, averaged over stretches of the coordinate that explains most of \
         it: beyond chance {:.1} % of the whole residual's variance with the nominal model, {:.1} % with what was found. White \
         noise alone would leave 19 of 20 means in the grey band. Below, the samples behind each \
         mean; means of very few are not drawn.",
        100.0 * first.share_before,
        100.0 * first.share_after
    );
    let others = "The same over the other coordinates, with the share of the whole residual's variance \
                  that each explains alone.";
    let blocks = [
        figure(
            answer,
            ("residual", &["train", "holdout"]),
            residual_curve_figure_svg(answer),
            caption,
        ),
        figure(
            answer,
            ("residual-others", &["train", "holdout"]),
            residual_curves_figure_svg(answer),
            others.to_owned(),
        ),
    ];
    section("The residual, before and after", blocks.into_iter().flatten().collect())
}

/// Damage and numbers with a tolerance, before and after.
fn faults(answer: &Explanation) -> Option<Section> {
    let caption = "Fault levels with the nominal model and with what was found: what a model \
                   misses shows up in its levels, as damage that is not there or too little of \
                   what is. The dashed line is a machine as new.";
    let mut blocks = Vec::new();
    blocks.extend(figure(
        answer,
        ("faults", &["train"]),
        fault_change_figure_svg(answer),
        caption.to_owned(),
    ));
    if !answer.nominal.is_empty() {
        let mut columns = vec![Column::text("number")];
        columns.extend(["model file", "fitted", "change, %"].map(Column::number));
        let row = |(key, number): (&String, &NominalChange)| {
            vec![
                Cell::text(key.as_str()),
                Cell::number(Some(number.nominal), rounded),
                Cell::number(Some(number.fitted), rounded),
                Cell::number(number.change_percent(), |v| format!("{v:+.2}")),
            ]
        };
        blocks.push(Block::Table(Table {
            caption: "Numbers of the model file that may be off, as fitted together with \
                      what was found."
                .to_owned(),
            columns,
            rows: answer.nominal.iter().map(row).collect(),
        }));
    }
    let open = answer.faults.iter().filter(|(_, level)| !level.ambiguous_with.is_empty());
    let row = |(key, level): (&String, &FaultBeforeAfter)| {
        vec![Cell::text(key.as_str()), Cell::text(level.ambiguous_with.join(", "))]
    };
    let rows: Vec<Vec<Cell>> = open.map(row).collect();
    if !rows.is_empty() {
        blocks.push(Block::Table(Table {
            caption: "Levels that numbers of the model file leave open: were those known, their \
                      standard deviation would halve. `--exact` pins a number that was measured."
                .to_owned(),
            columns: vec![Column::text("level"), Column::text("ambiguous with")],
            rows,
        }));
    }
    section("Fault levels and numbers with a tolerance", blocks)
}

/// How well each recording is explained.
fn recordings(answer: &Explanation) -> Option<Section> {
    if answer.records.is_empty() {
        return None;
    }
    let unit = answer.holdout.as_ref().map_or("a", |holdout| holdout.unit.as_str()).to_uppercase();
    let mut columns = vec![Column::text("recording"), Column::text("use")];
    let rms = |when: &str| Column::number(&format!("rms {when}, {unit}"));
    columns.extend([rms("before"), rms("after")]);
    let others = ["fit before, %", "fit after, %", "whiteness p"];
    columns.extend(others.map(Column::number));
    let role = |record: &RecordFit| {
        let known = ROLES.iter().find(|(role, _)| *role == record.role);
        known.map_or("", |(_, word)| *word)
    };
    let row = |record: &RecordFit| {
        vec![
            Cell::text(record.recording.as_str()),
            Cell::text(role(record)),
            Cell::number(Some(record.rms_before), rounded),
            Cell::number(Some(record.rms_after), rounded),
            Cell::number(Some(record.fit_percent_before), |v| format!("{v:.2}")),
            Cell::number(Some(record.fit_percent_after), |v| format!("{v:.2}")),
            Cell::number(Some(record.whiteness_p), chance).marked(record.whiteness_p < NOT_WHITE),
        ]
    };
    let table = Table {
        caption: format!(
            "Root mean square of measured less modelled; fit, 100 for a model without error and 0 \
             for a constant; chance that white noise is as little white as what is left, \
             underlined below {NOT_WHITE}."
        ),
        columns,
        rows: answer.records.iter().map(row).collect(),
    };
    section("Recordings", vec![Block::Table(table)])
}

/// Every effect of the catalogue.
fn hypotheses(answer: &Explanation) -> Option<Section> {
    if answer.hypotheses.is_empty() {
        return None;
    }
    let mut columns = ["effect", "standing"].map(Column::text).to_vec();
    let numbers =
        ["log10 chance", "visible, %", "gain held out, nats", "± se", "gain in evidence, nats"];
    columns.extend(numbers.map(Column::number));
    let row = |one: &HypothesisOutcome| {
        let refit = |of: fn(&HypothesisRefit) -> f64| {
            Cell::number(one.refit.as_ref().map(of), |v| format!("{v:.1}"))
        };
        let on_bound = one.refit.is_some_and(|refit| refit.on_bound);
        let standing = match one.standing {
            Standing::Found => "found",
            Standing::AsLikely => "as likely",
            Standing::FellShort if on_bound => "fell short, on a bound",
            Standing::FellShort => "fell short",
            Standing::NotFitted => "not fitted",
        };
        let holds = matches!(one.standing, Standing::Found | Standing::AsLikely);
        vec![
            Cell::text(format!("{} {}", one.id, one.name)),
            Cell::text(standing).marked(holds),
            Cell::number(Some(one.log10_p), |v| format!("{:.1}", v + 0.0)),
            Cell::number(Some(one.visible_share), |v| format!("{:.0}", 100.0 * v)),
            refit(|refit| refit.holdout_gain_nats),
            refit(|refit| refit.holdout_gain_se),
            refit(|refit| refit.evidence_nats),
        ]
    };
    let table = Table {
        caption: "Every effect of the catalogue against the nominal model, best first: decimal \
                  logarithm of the chance that noise alone scores as much for it; share of it that \
                  damage and numbers within their tolerance cannot imitate; and, for the best, what \
                  fitting it together with everything else gained. An effect may be found only after \
                  another has been added."
            .to_owned(),
        columns,
        rows: answer.hypotheses.iter().map(row).collect(),
    };
    section("Hypotheses", vec![Block::Table(table)])
}

/// Remainder, and effects that cannot be told apart.
fn left(answer: &Explanation) -> Option<Section> {
    let mut blocks = Vec::new();
    if let Some(remainder) = &answer.remainder {
        let shares: Vec<String> = remainder
            .shares
            .iter()
            .map(|one| format!("{} {:.0} %", one.coordinate, 100.0 * one.share))
            .collect();
        blocks.push(Block::Text(format!(
            "Something is left that nothing in the catalogue surely explains. Shares of \
             its variance, noise included, that each coordinate explains alone: {}. Kurtosis {:.1} (3 for normal \
             noise, more for bursts).",
            shares.join(", "),
            remainder.kurtosis
        )));
    }
    if !answer.absorbed.is_empty() {
        blocks.push(Block::Text(format!(
            "These recordings cannot tell from damage or tolerance: {}.",
            answer.absorbed.join(", ")
        )));
    }
    section("What is left open", blocks)
}

/// Least effects that would have been seen.
fn sensitivity(answer: &Explanation) -> Option<Section> {
    if answer.sensitivity.is_empty() {
        return None;
    }
    let columns = vec![
        Column::text("effect"),
        Column::text("number"),
        Column::number("smallest size"),
        Column::text("at"),
    ];
    let row = |one: &Sensitivity| {
        let shape = one.shape.iter().map(|(key, value)| format!("{key} {}", rounded(*value)));
        vec![
            Cell::text(one.id.as_str()),
            Cell::text(one.parameter.as_str()),
            Cell::number(Some(one.smallest_named_90), rounded),
            Cell::text(shape.collect::<Vec<_>>().join(", ")),
        ]
    };
    let table = Table {
        caption:
            "Smallest size of each effect that these recordings would have named, whatever its \
                  sign and phase; the unit ends the key."
                .to_owned(),
        columns,
        rows: answer.sensitivity.iter().map(row).collect(),
    };
    section("What would have been seen", vec![Block::Table(table)])
}

/// Makes the section on the basis of the answer.
fn basis(answer: &Explanation) -> Section {
    let mut facts = vec![format!("Program: {}, seed {}.", answer.tool, answer.seed)];
    if !answer.records.is_empty() {
        facts.push(format!("Recordings: {}.", source(answer, &ROLES.map(|(role, _)| role))));
    }
    facts.push(format!("Model: {}.", answer.model));
    facts.push(format!(
        "Intervals are the estimate ± {Z_95} standard deviations, of fault levels within 0 and 1; \
         that of an eccentricity begins at zero where its two components are zero within 95 %. With \
         what was found they hold those of all explanations that are left open."
    ));
    facts.extend(answer.stamp.as_ref().map(|stamp| format!("Made: {stamp}.")));
    facts.extend(answer.elapsed_s.map(|s| format!("Computed in {s:.1} s.")));
    Section::new("What this rests on", vec![Block::List(facts)])
}

/// The effect that an alternative may be the cause instead of.
fn instead(effect: &EffectFinding) -> String {
    let instead = effect.instead_of.as_ref();
    instead.map_or_else(String::new, |id| format!(", instead of {id}"))
}

/// A chance, as short as it says enough.
fn chance(p: f64) -> String {
    if p >= 0.001 { format!("{p:.3}") } else { "below 0.001".to_owned() }
}
