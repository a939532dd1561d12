//! Counting rules and bars.

use ema_sim::EffectId;
use greybox_blind::VISIBLE_LAMBDA;

use super::{
    bound::Rate,
    case_file::{Answer, Line},
};
use crate::median::median;

/// A bar with what was counted.
#[derive(Clone, Debug)]
pub(crate) struct Bar {
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    pub(crate) measured: Measured,
}

/// Rate or figure that is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// A rate at most this, its bound from above at most a multiple of it.
    AtMost { rate: f64, bound: f64 },
    /// A rate at least this, its bound from below at least 5 points less.
    AtLeast { rate: f64 },
    /// A rate within two values.
    Within { from: f64, to: f64 },
    /// A figure at most this.
    Figure { most: f64 },
}

/// Rate or figure that was found.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Measured {
    Rate(Rate),
    Figure { value: f64, of: usize },
}

/// Points by which a lower bound may stay behind its bar.
const BEHIND: f64 = 0.05;

impl Bar {
    /// True where the bar is met; none where nothing was counted.
    pub(crate) fn met(&self) -> Option<bool> {
        match (self.kind, self.measured) {
            (_, Measured::Rate(Rate { of: 0, .. }) | Measured::Figure { of: 0, .. }) => None,
            (Kind::AtMost { rate, bound }, Measured::Rate(found)) => {
                Some(found.value() <= rate && found.at_most() <= bound)
            }
            (Kind::AtLeast { rate }, Measured::Rate(found)) => {
                Some(found.value() >= rate && found.at_least() >= rate - BEHIND)
            }
            (Kind::Within { from, to }, Measured::Rate(found)) => {
                Some((from..=to).contains(&found.value()))
            }
            (Kind::Figure { most }, Measured::Figure { value, .. }) => Some(value <= most),
            _ => None,
        }
    }

    fn at_most(name: &'static str, rate: f64, found: Rate) -> Self {
        let bound = if rate <= 0.01 { 3.0 * rate } else { 2.0 * rate };
        Self { name, kind: Kind::AtMost { rate, bound }, measured: Measured::Rate(found) }
    }

    fn at_least(name: &'static str, rate: f64, found: Rate) -> Self {
        Self { name, kind: Kind::AtLeast { rate }, measured: Measured::Rate(found) }
    }
}

/// An answer of a case; one that gave none counts as inconclusive.
fn answer(line: &Line) -> Answer {
    line.answer
        .clone()
        .unwrap_or_else(|| Answer { verdict: "inconclusive".to_owned(), ..Answer::default() })
}

/// True where something is claimed and nothing is hidden.
fn alarms(line: &Line) -> bool {
    let answer = answer(line);
    answer.names() || answer.verdict == "unknown"
}

fn true_id(line: &Line) -> &str {
    line.truth.hidden.first().map_or("", |hidden| hidden.id.as_str())
}

fn same_class(a: &str, b: &str) -> bool {
    let class = |id: &str| EffectId::find(id).map(|id| id.info().class);
    class(a).is_some() && class(a) == class(b)
}

fn wrong_name(line: &Line) -> bool {
    let answer = answer(line);
    answer.names() && !answer.set().contains(&true_id(line))
}

/// True where the answer says that the truth is tied with its partner.
fn states_tie(line: &Line) -> bool {
    let answer = answer(line);
    let partner_in =
        |ids: &[&str]| line.truth.tied_with.iter().any(|partner| ids.contains(&partner.as_str()));
    let (set, absorbed) = (answer.set(), answer.absorbed_ids());
    match answer.verdict.as_str() {
        "one-of" => set.contains(&true_id(line)) && partner_in(&set),
        "absorbed" => absorbed.contains(&true_id(line)) && partner_in(&absorbed),
        _ => false,
    }
}

/// True where the proposed recording leaves the truth and not its partner.
fn breaks_tie(line: &Line) -> bool {
    let Some(second) = &line.second else { return false };
    let set = second.set();
    second.first() == Some(true_id(line))
        && !line.truth.tied_with.iter().any(|partner| set.contains(&partner.as_str()))
}

/// True where two effects are found: each in a place of its own, one of them by name, the other by
/// name or as an alternative to what is there.
fn finds_both(line: &Line) -> bool {
    let answer = answer(line);
    let [a, b] = &line.truth.hidden[..] else { return false };
    let places = || 0..answer.effects.len();
    let finds = |named: &str, other: &str| {
        places().any(|place| {
            answer.effects[place].id == named
                && places().any(|beside| beside != place && answer.has_at(beside, other))
        })
    };
    answer.names() && (finds(&a.id, &b.id) || finds(&b.id, &a.id))
}

/// Errors of fault levels before and after, and whether the interval holds the truth; `k7` is a
/// direction and left out.
#[derive(Default)]
pub(crate) struct FaultErrors {
    pub(crate) before: Vec<f64>,
    pub(crate) after: Vec<f64>,
    pub(crate) covered: Rate,
    /// Half widths of the intervals.
    pub(crate) half_widths: Vec<f64>,
    /// Fault levels that the answers do not give.
    pub(crate) missing: usize,
}

/// Two-sided 95 % of a normal.
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Which fault levels are pooled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pooled<'a> {
    All,
    /// Levels of one fault.
    Of(&'a str),
    /// Levels that by the generator's slopes the effect shifts by more than the half width of the
    /// interval given for them in the end.
    Moved,
}

/// Pools the fault errors of cases.
pub(crate) fn fault_errors(lines: &[&Line], pooled: Pooled<'_>) -> FaultErrors {
    let mut all = FaultErrors::default();
    for line in lines {
        let answer = answer(line);
        for (id, truth) in line.truth.faults.iter().filter(|(id, _)| *id != "k7") {
            let fault = answer.faults.get(id).cloned().unwrap_or_default();
            let levels = fault.before.zip(fault.after);
            let interval = fault.interval_95_after.or_else(|| {
                let (after, half) = (fault.after?, NORMAL_95 * fault.std_after?);
                Some([after - half, after + half])
            });
            let shift = line.truth.shifts.get(id).copied().unwrap_or_default();
            let is_moved = interval.is_none_or(|[low, high]| shift.abs() > 0.5 * (high - low));
            let wanted = match pooled {
                Pooled::All => true,
                Pooled::Of(only) => only == id,
                Pooled::Moved => shift != 0.0 && is_moved,
            };
            if !wanted {
                continue;
            }
            all.covered.of += 1;
            let Some((before, after)) = levels else {
                all.missing += 1;
                continue;
            };
            all.before.push((before - truth).abs());
            all.after.push((after - truth).abs());
            all.half_widths.extend(interval.map(|[low, high]| 0.5 * (high - low)));
            if interval.is_some_and(|[low, high]| low <= *truth && *truth <= high) {
                all.covered.hits += 1;
            }
        }
    }
    all
}

/// The cases of a class.
pub(crate) fn of_class<'a>(lines: &'a [Line], class: &str) -> Vec<&'a Line> {
    lines.iter().filter(|line| line.class == class).collect()
}

/// Singles whose effect is visible.
pub(crate) fn visible_singles(lines: &[Line]) -> Vec<&Line> {
    let singles = of_class(lines, "single").into_iter();
    singles.filter(|line| line.truth.hidden.iter().all(|h| h.visible)).collect()
}

/// Singles whose effect is visible by slopes alone and not when damage follows its own course, and
/// how many of them are named right.
pub(crate) fn imitated_singles(lines: &[Line]) -> Rate {
    let singles = of_class(lines, "single").into_iter();
    let is_imitated = |line: &&Line| {
        line.truth.hidden.iter().all(|h| !h.visible && h.lambda_by_slopes >= VISIBLE_LAMBDA)
    };
    let imitated: Vec<&Line> = singles.filter(is_imitated).collect();
    Rate::of(&imitated, |line| answer(line).first() == Some(true_id(line)))
}

/// Excess from which what is outside the catalogue must be told.
const TOLD_EXCESS: f64 = 1.3;

/// All bars.
pub(crate) fn bars(lines: &[Line]) -> Vec<Bar> {
    let count =
        |class: &str, test: fn(&Line) -> bool| Rate::of(&of_class(lines, class), |line| test(line));
    let visible = visible_singles(lines);
    let rate = |test: fn(&Line) -> bool| Rate::of(&visible, |line| test(line));
    let sizes: Vec<f64> = visible
        .iter()
        .map(|line| answer(line))
        .filter(Answer::names)
        .map(|answer| answer.set().len() as f64)
        .collect();
    let outside = of_class(lines, "outside");
    let loud: Vec<&Line> =
        outside.iter().filter(|line| line.truth.excess >= TOLD_EXCESS).copied().collect();
    let errors = fault_errors(&visible, Pooled::All);
    vec![
        Bar::at_most("false alarm, Gaussian nulls", 0.01, count("null", alarms)),
        Bar::at_most("false alarm, unusual noise", 0.03, count("unusual-null", alarms)),
        Bar::at_most("fault called an effect", 0.02, count("fault-only", alarms)),
        Bar::at_least(
            "right class, visible singles",
            0.95,
            rate(|line| answer(line).first().is_some_and(|id| same_class(id, true_id(line)))),
        ),
        Bar::at_least(
            "right effect, visible singles",
            0.90,
            rate(|line| answer(line).first() == Some(true_id(line))),
        ),
        Bar::at_most("wrong name, visible singles", 0.04, rate(wrong_name)),
        Bar::at_least(
            "truth in the answered set, visible singles",
            0.97,
            rate(|line| answer(line).set().contains(&true_id(line))),
        ),
        Bar {
            name: "mean size of the answered set",
            kind: Kind::Figure { most: 1.5 },
            measured: Measured::Figure {
                value: sizes.iter().sum::<f64>() / sizes.len() as f64,
                of: sizes.len(),
            },
        },
        Bar::at_most(
            "outside the catalogue, named without a remainder",
            0.03,
            Rate::of(&outside, |line| {
                let answer = answer(line);
                answer.names() && answer.verdict != "named-with-remainder"
            }),
        ),
        Bar::at_least(
            "outside, told where the excess is 1.3 or more",
            0.95,
            Rate::of(&loud, |line| {
                matches!(answer(line).verdict.as_str(), "unknown" | "named-with-remainder")
            }),
        ),
        Bar::at_least("two effects, both found", 0.70, count("double", finds_both)),
        Bar::at_least("tie stated", 0.90, count("tied", states_tie)),
        Bar::at_least("tie broken by the proposed recording", 0.90, count("tied", breaks_tie)),
        Bar {
            name: "median fault error after / before, visible singles",
            kind: Kind::Figure { most: 0.2 },
            measured: Measured::Figure {
                value: median(&errors.after) / median(&errors.before),
                of: errors.after.len(),
            },
        },
        Bar {
            name: "95 % intervals of k that hold the truth, visible singles",
            kind: Kind::Within { from: 0.90, to: 0.98 },
            measured: Measured::Rate(errors.covered),
        },
    ]
}

/// Counts of `fdi explain` and of baselines alike.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Tally {
    pub(crate) null: Rate,
    pub(crate) unusual: Rate,
    pub(crate) fault_only: Rate,
    /// Rate over visible singles.
    pub(crate) right: Rate,
    pub(crate) wrong: Rate,
    /// Named although outside the catalogue, and that without saying that something remains.
    pub(crate) outside: Rate,
    pub(crate) outside_without_remainder: Rate,
}

/// An answer as far as a tally needs it: whether it claims something, the effects of which it says
/// one is there, the first the best, and whether it says that something remains.
struct Claim {
    claims: bool,
    names: Vec<String>,
    remains: bool,
}

impl Tally {
    /// Counts of `fdi explain`.
    pub(crate) fn of_explain(lines: &[&Line]) -> Self {
        Self::of(lines, |line| {
            let answer = answer(line);
            let first = answer.first().into_iter().map(str::to_owned);
            let names = first.chain(answer.set().into_iter().map(str::to_owned)).collect();
            let remains = answer.verdict == "named-with-remainder";
            Claim { claims: alarms(line), names, remains }
        })
    }

    /// Counts of a baseline. Several names claim as many effects and are no alternatives: the first is
    /// its answer.
    pub(crate) fn of_rule(lines: &[&Line], rule: &str) -> Self {
        Self::of(lines, |line| {
            let names = line.baselines.as_ref().and_then(|all| all.get(rule)?.first());
            let names: Vec<String> = names.into_iter().cloned().collect();
            Claim { claims: !names.is_empty(), names, remains: false }
        })
    }

    fn of(lines: &[&Line], said: impl Fn(&Line) -> Claim) -> Self {
        let count = |class: &str, test: &dyn Fn(&Line, Claim) -> bool| {
            let of: Vec<&Line> = lines.iter().filter(|line| line.class == class).copied().collect();
            Rate::of(&of, |line| test(line, said(line)))
        };
        let claims = |_: &Line, claim: Claim| claim.claims;
        let singles: Vec<&Line> = lines
            .iter()
            .filter(|line| line.class == "single" && line.truth.hidden.iter().all(|h| h.visible))
            .copied()
            .collect();
        let is_true = |line: &Line, name: &String| name == true_id(line);
        Self {
            null: count("null", &claims),
            unusual: count("unusual-null", &claims),
            fault_only: count("fault-only", &claims),
            right: Rate::of(&singles, |line| {
                said(line).names.first().is_some_and(|name| is_true(line, name))
            }),
            wrong: Rate::of(&singles, |line| {
                let names = said(line).names;
                !names.is_empty() && !names.iter().any(|name| is_true(line, name))
            }),
            outside: count("outside", &|_, claim| !claim.names.is_empty()),
            outside_without_remainder: count("outside", &|_, claim| {
                !claim.names.is_empty() && !claim.remains
            }),
        }
    }
}

/// Visible singles and doubles of whose named effects one at least is not there: neither it nor an
/// alternative to it is hidden.
pub(crate) fn false_names(lines: &[Line]) -> [Rate; 2] {
    let names_falsely = |line: &Line| {
        let answer = answer(line);
        let is_there = |place| line.truth.hidden.iter().any(|h| answer.has_at(place, &h.id));
        answer.names() && !(0..answer.effects.len()).all(is_there)
    };
    [visible_singles(lines), of_class(lines, "double")]
        .map(|lines| Rate::of(&lines, |line| names_falsely(line)))
}

/// Counts of the answered against the true effect of visible singles; an answer without a name
/// stands under its verdict.
pub(crate) fn confusion(lines: &[Line]) -> std::collections::BTreeMap<(String, String), usize> {
    let mut counts = std::collections::BTreeMap::new();
    for line in visible_singles(lines) {
        let answer = answer(line);
        let said = answer.first().map_or(answer.verdict.clone(), str::to_owned);
        *counts.entry((true_id(line).to_owned(), said)).or_insert(0) += 1;
    }
    counts
}

/// Bounds of the severities in the power curve.
pub(crate) const SEVERITIES: [f64; 8] = [0.0, 0.5, 1.0, 1.414, 2.0, 4.0, 8.0, f64::INFINITY];

/// Share of singles that are named, and rightly, by severity.
pub(crate) fn power(lines: &[Line]) -> Vec<(f64, f64, Rate, Rate)> {
    let singles = of_class(lines, "single");
    let bounds = SEVERITIES.windows(2);
    bounds
        .map(|pair| {
            let within = |line: &&&Line| {
                let severity = line.truth.hidden.first().map_or(0.0, |h| h.severity);
                severity >= pair[0] && severity < pair[1]
            };
            let part: Vec<&Line> = singles.iter().filter(within).copied().collect();
            let right = Rate::of(&part, |line| answer(line).first() == Some(true_id(line)));
            (pair[0], pair[1], right, Rate::of(&part, |line| wrong_name(line)))
        })
        .collect()
}

/// Cases by class and verdict.
pub(crate) fn verdicts(lines: &[Line]) -> std::collections::BTreeMap<(String, String), usize> {
    let mut counts = std::collections::BTreeMap::new();
    for line in lines {
        let said = line.answer.as_ref().map_or("no answer".to_owned(), |a| a.verdict.clone());
        *counts.entry((line.class.clone(), said)).or_insert(0) += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blind::case_file::{Fault, Hidden, Named, Truth};
    use approx::assert_abs_diff_eq;

    fn line(class: &str, hidden: &[&str], verdict: &str, effects: &[&str]) -> Line {
        let named = |ids: &[&str]| {
            ids.iter().map(|id| Named { id: (*id).to_owned(), ..Named::default() }).collect()
        };
        Line {
            class: class.to_owned(),
            truth: Truth {
                class: class.to_owned(),
                hidden: hidden
                    .iter()
                    .map(|id| Hidden { id: (*id).to_owned(), visible: true, ..Hidden::default() })
                    .collect(),
                excess: 1.5,
                faults: [("k1".to_owned(), 0.02), ("k7".to_owned(), 0.5)].into(),
                ..Truth::default()
            },
            answer: Some(Answer {
                verdict: verdict.to_owned(),
                effects: named(effects),
                ..Answer::default()
            }),
            ..Line::default()
        }
    }

    fn rate(lines: &[Line], name: &str) -> Rate {
        let bar = bars(lines).into_iter().find(|bar| bar.name == name).unwrap();
        match bar.measured {
            Measured::Rate(rate) => rate,
            Measured::Figure { .. } => panic!("{name} is a figure"),
        }
    }

    #[test]
    fn unknown_is_a_false_alarm_and_inconclusive_is_none() {
        for (class, name) in [
            ("null", "false alarm, Gaussian nulls"),
            ("unusual-null", "false alarm, unusual noise"),
            ("fault-only", "fault called an effect"),
        ] {
            let lines: Vec<Line> =
                ["adequate", "unknown", "inconclusive", "absorbed", "named", "one-of"]
                    .map(|verdict| {
                        let names = ["named", "one-of"].contains(&verdict);
                        line(class, &[], verdict, if names { &["E01"] } else { &[] })
                    })
                    .to_vec();
            assert_eq!(rate(&lines, name), Rate { hits: 3, of: 6 });
        }
    }

    #[test]
    fn singles_are_counted_over_all_visible_ones() {
        let mut tied = line("single", &["E01"], "one-of", &["E02"]);
        tied.answer.as_mut().unwrap().alternatives =
            vec![Named { id: "E01".to_owned(), ..Named::default() }];
        let mut invisible = line("single", &["E01"], "named", &["E11"]);
        invisible.truth.hidden[0].visible = false;
        let mut silent = line("single", &["E01"], "", &[]);
        silent.answer = None;
        let lines = [
            line("single", &["E01"], "named", &["E01"]),
            tied,
            line("single", &["E01"], "named", &["E11"]),
            line("single", &["E01"], "inconclusive", &[]),
            invisible,
            silent,
        ];
        assert_eq!(rate(&lines, "right effect, visible singles"), Rate { hits: 1, of: 5 });
        // E01 and E02 are both friction against speed
        assert_eq!(rate(&lines, "right class, visible singles"), Rate { hits: 2, of: 5 });
        assert_eq!(rate(&lines, "wrong name, visible singles"), Rate { hits: 1, of: 5 });
        let set = "truth in the answered set, visible singles";
        assert_eq!(rate(&lines, set), Rate { hits: 2, of: 5 });
        let sizes = bars(&lines).into_iter().find(|b| b.name.starts_with("mean size")).unwrap();
        assert!(matches!(sizes.measured, Measured::Figure { value, of: 3 } if value == 4.0 / 3.0));
    }

    /// A baseline's second name is no alternative, and what `explain` leaves unknown is an alarm.
    #[test]
    fn baselines_are_counted_by_their_first_name() {
        let with = |class: &str, hidden: &[&str], names: &[&str]| {
            let mut line = line(class, hidden, "unknown", &[]);
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            line.baselines = Some([("rule".to_owned(), names)].into());
            line
        };
        let mut hidden = with("single", &["E01"], &["E01"]);
        hidden.truth.hidden[0].visible = false;
        let lines = [
            with("single", &["E01"], &["E01", "E02"]),
            with("single", &["E01"], &["E02", "E01"]),
            with("single", &["E01"], &[]),
            hidden,
            with("null", &[], &["E01"]),
            with("null", &[], &[]),
            with("outside", &["X1"], &["E01"]),
        ];
        let lines: Vec<&Line> = lines.iter().collect();
        let rate = |hits, of| Rate { hits, of };
        let rule = Tally::of_rule(&lines, "rule");
        assert_eq!((rule.right, rule.wrong), (rate(1, 3), rate(1, 3)));
        assert_eq!((rule.null, rule.outside), (rate(1, 2), rate(1, 1)));
        let explain = Tally::of_explain(&lines);
        assert_eq!((explain.null, explain.outside), (rate(2, 2), rate(0, 1)));
        assert_eq!(Tally::of_rule(&lines, "another").null, rate(0, 2));
    }

    #[test]
    fn two_effects_need_two_names() {
        let or_e11 = |effects: &[&str]| {
            let mut line = line("double", &["E01", "E11"], "one-of", effects);
            line.answer.as_mut().unwrap().alternatives =
                vec![Named { id: "E11".to_owned(), ..Named::default() }];
            line
        };
        let lines = [
            line("double", &["E01", "E11"], "named", &["E11", "E01"]),
            line("double", &["E01", "E11"], "named", &["E11"]),
            line("double", &["E01", "E11"], "named", &["E11", "E02"]),
            or_e11(&["E01"]),
            // another name for the first is no second effect, but may be the first
            or_e11(&["E01", "E02"]),
            or_e11(&["E12", "E01"]),
        ];
        assert_eq!(rate(&lines, "two effects, both found"), Rate { hits: 2, of: 6 });
        // an alternative stands in one place, and one of two is to be named
        let instead = |id: &str, of: &str| Named {
            id: id.to_owned(),
            instead_of: Some(of.to_owned()),
            ..Named::default()
        };
        let beside = |alternatives: Vec<Named>| {
            let mut line = line("double", &["E01", "E11"], "one-of", &["E02", "E11"]);
            line.answer.as_mut().unwrap().alternatives = alternatives;
            line
        };
        let mut neither = line("double", &["E01", "E11"], "one-of", &["E02", "E03"]);
        neither.answer.as_mut().unwrap().alternatives =
            vec![instead("E01", "E02"), instead("E11", "E03")];
        let lines =
            [beside(vec![instead("E01", "E02")]), beside(vec![instead("E01", "E11")]), neither];
        assert_eq!(rate(&lines, "two effects, both found"), Rate { hits: 1, of: 3 });
    }

    #[test]
    fn one_false_name_of_several_counts() {
        let mut tie = line("single", &["E11"], "one-of", &["E12"]);
        tie.answer.as_mut().unwrap().alternatives =
            vec![Named { id: "E11".to_owned(), ..Named::default() }];
        let lines = [
            line("single", &["E01"], "named", &["E01"]),
            line("single", &["E01"], "named", &["E01", "E16"]),
            line("single", &["E01"], "unknown", &[]),
            tie,
            line("double", &["E01", "E11"], "named", &["E11", "E01"]),
            line("double", &["E01", "E11"], "named", &["E11", "E02"]),
        ];
        assert_eq!(false_names(&lines), [Rate { hits: 1, of: 4 }, Rate { hits: 1, of: 2 }]);
    }

    #[test]
    fn a_tie_is_stated_with_its_partner_and_broken_without() {
        let tied = |second: &[&str]| {
            let mut line = line("tied", &["E11"], "one-of", &["E12"]);
            line.truth.tied_with = vec!["E12".to_owned()];
            line.answer.as_mut().unwrap().alternatives =
                vec![Named { id: "E11".to_owned(), ..Named::default() }];
            let named = second
                .iter()
                .map(|id| Named { id: (*id).to_owned(), ..Named::default() })
                .collect();
            let verdict = "named".to_owned();
            line.second = Some(Answer { verdict, effects: named, ..Answer::default() });
            line
        };
        let mut alone = line("tied", &["E11"], "named", &["E11"]);
        alone.truth.tied_with = vec!["E12".to_owned()];
        let lines = [tied(&["E11"]), tied(&["E12"]), tied(&["E11", "E12"]), alone];
        assert_eq!(rate(&lines, "tie stated"), Rate { hits: 3, of: 4 });
        let broken = "tie broken by the proposed recording";
        assert_eq!(rate(&lines, broken), Rate { hits: 1, of: 4 });
    }

    #[test]
    fn outside_the_catalogue_a_name_needs_a_remainder() {
        let mut quiet = line("outside", &["X1"], "adequate", &[]);
        quiet.truth.excess = 1.1;
        let lines = [
            line("outside", &["X1"], "named", &["E01"]),
            line("outside", &["X1"], "one-of", &["E01"]),
            line("outside", &["X1"], "named-with-remainder", &["E01"]),
            line("outside", &["X1"], "unknown", &[]),
            quiet,
        ];
        let named = "outside the catalogue, named without a remainder";
        assert_eq!(rate(&lines, named), Rate { hits: 2, of: 5 });
        let told = "outside, told where the excess is 1.3 or more";
        assert_eq!(rate(&lines, told), Rate { hits: 2, of: 4 });
    }

    #[test]
    fn fault_errors_are_pooled_and_what_is_missing_is_not_covered() {
        let mut good = line("single", &["E01"], "named", &["E01"]);
        let fault = Fault {
            before: Some(0.12),
            after: Some(0.03),
            std_after: Some(0.01),
            interval_95_after: None,
        };
        good.answer.as_mut().unwrap().faults = [("k1".to_owned(), fault)].into();
        good.truth.shifts = [("k1".to_owned(), 0.1)].into();
        let lines = [good, line("single", &["E01"], "inconclusive", &[])];
        let of = |pooled| fault_errors(&lines.iter().collect::<Vec<_>>(), pooled);
        let errors = of(Pooled::All);
        assert_abs_diff_eq!(errors.before[0], 0.1, epsilon = 1e-12);
        assert_abs_diff_eq!(errors.after[0], 0.01, epsilon = 1e-12);
        assert_eq!((errors.covered, errors.missing), (Rate { hits: 1, of: 2 }, 1));
        // shifted by a tenth, of an interval of two hundredths either way; the other by nothing
        assert_eq!(of(Pooled::Moved).covered, Rate { hits: 1, of: 1 });
        assert_eq!(of(Pooled::Of("k2")).covered.of, 0);
        let ratio = bars(&lines).into_iter().find(|b| b.name.starts_with("median")).unwrap();
        assert_eq!(ratio.met(), Some(true));
    }

    #[test]
    fn bars_ask_for_the_bound_too() {
        let alarms = |hits, of| Bar::at_most("x", 0.01, Rate { hits, of }).met();
        assert_eq!(
            (alarms(0, 60), alarms(0, 400), alarms(4, 400)),
            (Some(false), Some(true), Some(true))
        );
        assert_eq!((alarms(5, 400), alarms(0, 0)), (Some(false), None));
        let right = |hits, of| Bar::at_least("x", 0.90, Rate { hits, of }).met();
        assert_eq!(
            (right(270, 300), right(9, 10), right(267, 300)),
            (Some(true), Some(false), Some(false))
        );
    }
}
