//! Recordings beside one another, and what only looks like some.

use super::*;

/// A number in ±1 that looks like chance.
fn scatter(index: usize) -> f64 {
    2.0 * ((index as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0) - 1.0
}

/// A movement to and fro, faster and faster, at a time in samples, with noise.
fn moved(at: f64, ahead: f64, noise: f64, seed: usize) -> f64 {
    let at = at + ahead;
    3.0 * (at / 300.0 + (at / 2000.0).powi(2)).sin() + noise * scatter(seed + at as usize)
}

fn times(count: usize, each: usize) -> Vec<f64> {
    (0..count * each).map(|row| (row / each) as f64 / 1e3).collect()
}

fn found(each: usize, name: ChannelName, value: impl Fn(usize, usize) -> f64) -> bool {
    let times_s = times(1000, each);
    let values: Vec<f64> = (0..1000 * each).map(|row| value(row / each, row % each)).collect();
    TimedRows::new(&times_s, vec![(name, &values)]).of_several().is_some()
}

#[test]
fn rows_of_several_recordings_are_told_from_samples_between_two_stamps() {
    for each in [2, 3, 10] {
        for noise in [0.0, 0.002, 0.01] {
            for name in [ChannelName::MotorAngle, ChannelName::PhaseACurrent] {
                let one = |time: usize, row: usize| {
                    moved(5.0 * (time as f64 + row as f64 / each as f64), 0.0, noise, 0)
                };
                assert!(!found(each, name, one), "{each} {noise} {name}");
                // alike to the noise, a little behind one another, and far from one another
                for behind in [0.0, 2.0, 40.0, 300.0] {
                    let several = |time: usize, row: usize| {
                        moved(5.0 * time as f64, -behind * row as f64, noise, 9000 * row)
                    };
                    // without noise the rows of two that are alike repeat one another
                    let are_told = behind > 0.0 || noise > 0.0;
                    assert_eq!(found(each, name, several), are_told, "{each} {noise} {behind}");
                }
            }
        }
    }
}

/// A recording whose angle is a little ahead of that of the one before it is told too.
#[test]
fn a_recording_that_is_a_little_ahead_is_told() {
    for ahead in [0.3, 0.7, 1.0] {
        let two =
            |time: usize, row: usize| moved(5.0 * time as f64, 5.0 * ahead * row as f64, 0.0, 0);
        assert!(found(2, ChannelName::MotorAngle, two), "{ahead}");
    }
}

#[test]
fn what_is_held_or_stands_still_or_repeats_says_nothing() {
    let name = ChannelName::MotorAngle;
    assert!(!found(10, name, |time, _| moved(5.0 * time as f64, 0.0, 0.0, 0)));
    // held over some of the samples of a time
    for held in [2, 5] {
        let value = |time: usize, row: usize| {
            moved(5.0 * time as f64 + (row / held * held) as f64 / 2.0, 0.0, 0.0, 0)
        };
        assert!(!found(10, name, value), "{held}");
    }
    assert!(!found(10, name, |_, _| 0.0));
    assert!(!found(2, name, |time, row| 0.1 * scatter(2 * time + row)));
    // ripple of two samples
    assert!(!found(2, ChannelName::PhaseACurrent, |time, row| {
        moved(0.5 * time as f64, 0.0, 0.0, 0) + 0.5 * (row as f64 - 0.5) * scatter(time)
    }));
}

#[test]
fn angles_may_turn_on() {
    let turned = |time: usize, row: usize| (0.3 * time as f64 + 0.15 * row as f64).rem_euclid(TAU);
    assert!(!found(2, ChannelName::MotorAngle, turned));
    let two = |time: usize, row: usize| {
        let noise = 1e-3 * scatter(2 * time + row);
        (0.3 * time as f64 + noise).rem_euclid(TAU)
    };
    assert!(found(2, ChannelName::MotorAngle, two));
}

/// Sorted by a time that several rows share, rows may stand in any order.
#[test]
fn a_label_in_another_order_at_some_times_tells_recordings_apart() {
    let times_s = times(200, 2);
    let values: Vec<f64> = (0..400).map(|row| 0.1 * scatter(row)).collect();
    let table = TimedRows::new(&times_s, vec![(ChannelName::PhaseACurrent, &values)]);
    let checked = |label: &dyn Fn(usize) -> &'static str| {
        let mut column = OtherColumn::new("run".to_owned());
        (0..400).for_each(|row| column.push(times_s[row], label(row)));
        table.check(|| None, |choice| choice(&column))
    };
    let mixed = |row: usize| if scatter(row / 2) > 0.0 { row % 2 } else { 1 - row % 2 };
    let error = checked(&|row| ["A", "B"][mixed(row)]).unwrap_err().to_string();
    assert!(error.contains("`--where run="), "{error}");
    // a count of the samples within a time, and a label of few rows
    checked(&|row| ["0", "1"][row % 2]).unwrap();
    checked(&|row| if row % 7 == 0 { "A" } else { "B" }).unwrap();
}

#[test]
fn the_column_that_tells_recordings_apart_is_named() {
    let beside = Beside { each: 2, rows: 200, channel: ChannelName::MotorAngle, is_certain: true };
    let column = |cell: &dyn Fn(usize) -> &'static str| {
        let mut column = OtherColumn::new("run".to_owned());
        (0..210).for_each(|row| column.push(0.0, cell(row)));
        column
    };
    let by = |cell: &dyn Fn(usize) -> &'static str| beside.choice_by(&column(cell));
    assert_eq!(by(&|row| ["A", "B"][row % 2]).as_deref(), Some("run=A"));
    assert_eq!(by(&|row| ["A", "B"][(row + row / 2) % 2]).as_deref(), Some("run=A"));
    assert!(beside.check(None, 0.0, None).is_err());
    // currents may be far apart by their ripple
    assert!(Beside { is_certain: false, ..beside }.check(None, 0.0, None).is_ok());
    assert_eq!(by(&|_| "A"), None);
    assert_eq!(by(&|row| if row < 100 { ["A", "B"][row % 2] } else { "C" }), None);
}
