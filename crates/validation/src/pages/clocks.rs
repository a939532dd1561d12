//! `docs/validation/clocks.md`: recordings whose times are not those of an even clock.

use std::fmt::Write as _;

use anyhow::{Context, Result};
use experiments::{
    AnswersScore,
    ClockFault::{
        self, CountedDoubled, CountedLost, Cumulated, Doubled, Even, Gap, Jittered,
        JitteredAndLost, Lost, Rounded, RoundedAndLost, SamplesOff, SamplesOffByCommand,
        StampsJittered, StampsOff, Swapped,
    },
    ClocksRequest, ClocksScore, evaluate_clocks,
};

use super::{bar::met, figure::Figure, machine::ema_48};
use crate::processor::jobs;

/// Root seed of the page; the reading of clocks was developed on other recordings.
const SEED: u64 = 20_261_202;
/// Machines without damage, and as many with some.
const MACHINES: usize = 250;
/// Recordings of each machine and kind.
const RECORDINGS: usize = 2;
/// Machines of the quick figures, with one recording each.
const FEW: usize = 4;
/// Bars: percent of intervals that hold the truth; false alarms beyond the twins', percent of the sound
/// machines; refusals, percent of all.
const HOLD_PERCENT: [f64; 2] = [92.0, 98.0];
const MORE_ALARMS_PERCENT: f64 = 1.0;
const MOST_REFUSED_PERCENT: f64 = 2.0;
/// Bars of the median standard deviation over the twin's: usual, and of much jitter.
const MOST_WIDTH: f64 = 1.2;
const MOST_JITTERED_WIDTH: f64 = 2.0;
/// Jitter from which the second bar holds, as a share of a sample.
const MUCH_JITTER: f64 = 0.1;

const FAULTS: [ClockFault; 17] = [
    Lost([1, 50]),
    Doubled([1, 20]),
    Swapped([1, 20]),
    Gap([2, 8]),
    Jittered([0.001, MUCH_JITTER]),
    Jittered([MUCH_JITTER, 0.3]),
    JitteredAndLost([0.001, MUCH_JITTER], [1, 20]),
    StampsJittered([0.001, MUCH_JITTER]),
    StampsJittered([MUCH_JITTER, 0.3]),
    Rounded([3, 9]),
    RoundedAndLost([3, 9], [1, 20]),
    Cumulated,
    StampsOff(100.0),
    SamplesOff(100.0),
    SamplesOffByCommand(100.0),
    CountedLost([1, 20]),
    CountedDoubled([1, 20]),
];

/// Kinds of the quick figures.
const QUICK: [ClockFault; 3] = [FAULTS[0], FAULTS[4], FAULTS[7]];

fn scores(faults: &[ClockFault], machines: usize, recordings: usize) -> Result<Vec<ClocksScore>> {
    let bundle = ema_48()?;
    let request =
        ClocksRequest { bundle: &bundle, faults, machines, recordings, seed: SEED, jobs: jobs() };
    evaluate_clocks(&request).context("recordings with wrong times")
}

/// Four machines of either kind: seconds.
pub(super) fn quick() -> Result<Vec<Figure>> {
    let scores = scores(&QUICK, FEW, 1)?;
    let of = |(score, name): (&ClocksScore, &str)| {
        let figure = |what: &str, value: usize| Figure {
            id: format!("{name}-{what}"),
            value: value as f64,
            tolerance_rel: 0.0,
            unit: "1".to_owned(),
        };
        let answers = &score.answers;
        [
            figure("healthy", answers.healthy),
            figure("faulty", answers.faulty),
            figure("refused", answers.refused),
            figure("miscounted", score.miscounted),
        ]
    };
    Ok(scores.iter().zip(["twin", "lost", "jitter", "stamps"]).flat_map(of).collect())
}

pub(super) fn text() -> Result<String> {
    let mut page = String::from(HEAD);
    let scores = scores(&FAULTS, MACHINES, RECORDINGS)?;
    let twin = &scores[0].answers;
    scores.iter().try_for_each(|score| row(&mut page, score, twin))?;
    page.push_str(LIMITS);
    Ok(page)
}

fn row(page: &mut String, score: &ClocksScore, twin: &AnswersScore) -> Result<()> {
    let ClocksScore { fault, answers, miscounted } = score;
    let [sound, damaged] = answers.recordings;
    let percent = |count: usize, of: usize| 100.0 * count as f64 / of as f64;
    let alarms = percent(answers.false_alarms, sound);
    let most_alarms = percent(twin.false_alarms, sound) + MORE_ALARMS_PERCENT;
    let refused = percent(answers.refused, sound + damaged);
    let held = answers.held_percent();
    let [least_held, most_held] = HOLD_PERCENT;
    writeln!(
        page,
        "| {} | {alarms:.1} {} | {:.1} | {} | {refused:.1} {} | {held:.1} {} | {:.2}, {:.2} {} | {} |",
        name(fault),
        met(alarms <= most_alarms),
        percent(answers.faulty, damaged),
        answers.inadequate,
        met(refused <= MOST_REFUSED_PERCENT),
        met((least_held..=most_held).contains(&held)),
        answers.width.0,
        answers.width.1,
        met(answers.width.0 <= most_width(fault)),
        counted(fault, *miscounted),
    )?;
    Ok(())
}

fn most_width(fault: &ClockFault) -> f64 {
    match fault {
        Jittered([least, _]) | StampsJittered([least, _]) if *least >= MUCH_JITTER => {
            MOST_JITTERED_WIDTH
        }
        _ => MOST_WIDTH,
    }
}

/// Recordings whose samples are counted wrong, with the bar where samples are lost.
fn counted(fault: &ClockFault, miscounted: usize) -> String {
    match fault {
        Lost(_) | Gap(_) | JitteredAndLost(..) | CountedLost(_) => {
            format!("{miscounted} {}", met(miscounted == 0))
        }
        _ => miscounted.to_string(),
    }
}

fn name(fault: &ClockFault) -> String {
    let range = |[least, most]: &[usize; 2]| format!("{least} to {most}");
    let share = |[least, most]: &[f64; 2]| format!("jitter of {least} to {most} of a sample");
    match fault {
        Even => "twin".to_owned(),
        Lost(lost) => format!("{} samples lost", range(lost)),
        Doubled(twice) => format!("{} rows twice", range(twice)),
        Swapped(swapped) => format!("{} pairs of rows exchanged", range(swapped)),
        Gap(lost) => format!("a gap of {} samples", range(lost)),
        Jittered(size) => share(size),
        JitteredAndLost(size, lost) => format!("{}, {} lost", share(size), range(lost)),
        StampsJittered(size) => format!("stamps of even samples with a {}", share(size)),
        Rounded(decimals) => format!("{} decimals", range(decimals)),
        RoundedAndLost(decimals, lost) => {
            format!("{} decimals, {} lost", range(decimals), range(lost))
        }
        Cumulated => "stamps that are sums of steps".to_owned(),
        StampsOff(ppm) => format!("stamps of even samples {ppm} ppm off"),
        SamplesOff(ppm) => format!("samples {ppm} ppm off, stamps even"),
        SamplesOffByCommand(ppm) => {
            format!("samples {ppm} ppm off, stamps even, the command recorded")
        }
        CountedLost(lost) => {
            format!("{} samples lost, stamps count rows, the command recorded", range(lost))
        }
        CountedDoubled(twice) => {
            format!("{} rows twice, stamps count rows, the command recorded", range(twice))
        }
    }
}

const HEAD: &str = include_str!("clocks/head.md");
const LIMITS: &str = include_str!("clocks/limits.md");
