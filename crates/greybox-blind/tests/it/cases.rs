//! Cases as they are drawn, written and sealed.

use std::fmt::Write;

use greybox_blind::{Case, Class, Machine, RATE_HZ, Role, TIED_LAMBDA, VISIBLE_LAMBDA, sha256_hex};

fn columns(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<String> =
        lines.next().expect("a header").split(',').map(str::to_owned).collect();
    let mut values = vec![Vec::new(); names.len()];
    for line in lines {
        for (column, field) in values.iter_mut().zip(line.split(',')) {
            column.push(field.parse().expect("a number"));
        }
    }
    (names, values)
}

fn column(text: &str, name: &str) -> Vec<f64> {
    let (names, mut values) = columns(text);
    values.swap_remove(names.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name}")))
}

#[test]
fn a_seed_is_a_case() {
    for seed in [4, 5] {
        let (a, b) =
            (Case::draw(seed, Class::Single).unwrap(), Case::draw(seed, Class::Single).unwrap());
        assert_eq!(a.truth_json(), b.truth_json());
        assert_eq!(a.files(), b.files());
        // the low bits choose the machine, so that another case of it is 2 further
        let other = Case::draw(seed + 2, Class::Single).unwrap();
        assert_ne!(a.truth_json(), other.truth_json());
        assert_ne!(a.files()[0].text, other.files()[0].text);
    }
}

#[test]
fn the_seal_is_of_the_truth_alone() {
    let case = Case::draw(0, Class::FaultOnly).unwrap();
    assert_eq!(case.seal(), sha256_hex(case.truth_json().as_bytes()));
    assert_ne!(case.seal(), Case::draw(2, Class::FaultOnly).unwrap().seal());
}

#[test]
fn recordings_are_four_with_shuffled_names_and_the_channels_of_the_machine() {
    let mut orders = Vec::new();
    for seed in 0..6 {
        let case = Case::draw(seed, Class::Null).unwrap();
        let files = case.files();
        let mut names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
        orders.push(names.join(" "));
        names.sort_unstable();
        assert_eq!(names, ["rec01.csv", "rec02.csv", "rec03.csv", "rec04.csv"]);
        let roles: Vec<Role> = files.iter().map(|file| file.role).collect();
        assert_eq!(roles, [Role::Train, Role::Train, Role::HoldOut, Role::Repeat]);
        let mut seconds = 0.0;
        for file in &files {
            let (mut names, values) = columns(&file.text);
            assert_eq!(names[0], "time_s");
            names.sort_unstable();
            let current =
                if case.machine() == Machine::Servo { "q_axis_current_a" } else { "current_a" };
            let mut want = ["time_s", "command_rad", "motor_angle_rad", "load_n_m", current];
            want.sort_unstable();
            assert_eq!(names, want);
            seconds += values[0].len() as f64 / RATE_HZ;
        }
        assert!((20.0..=25.0).contains(&seconds), "{seconds}");
        let command = |n: usize| column(&files[n].text, "command_rad");
        assert_eq!(command(0), command(3), "a repeat has the command of a training recording");
        assert_ne!(command(0)[..9000], command(2)[..9000]);
        assert_ne!(files[0].text, files[3].text, "and another noise");
        let load = column(&files[1].text, "load_n_m");
        assert!(load.iter().any(|l| *l != load[0]), "a load that changes");
    }
    orders.dedup();
    assert!(orders.len() > 1, "names are shuffled");
}

/// At rest the current shows the noise alone, with the rms that the truth states.
#[test]
fn law_standstill_shows_the_noise() {
    for seed in 0..8 {
        let case = Case::draw(seed, Class::Null).unwrap();
        let current =
            if case.machine() == Machine::Servo { "q_axis_current_a" } else { "current_a" };
        let mut power = 0.0;
        for file in case.files() {
            let values = column(&file.text, current);
            power += values[..700].iter().map(|i| i * i).sum::<f64>() / 2800.0;
        }
        let ratio = power.sqrt() / case.truth().noise.1;
        // 2800 samples; at the strongest colour, 0.92, as good as 230 independent ones: five
        // standard errors of an rms are 5/√460
        assert!((ratio - 1.0).abs() < 0.24, "seed {seed}: {ratio}");
    }
}

#[test]
fn every_class_is_what_it_says() {
    for seed in [10, 11] {
        for class in Class::ALL {
            let case = Case::draw(seed, class).unwrap();
            let truth = case.truth();
            let symbols: Vec<&str> = truth.hidden.iter().map(|h| h.symbol).collect();
            match class {
                Class::Double => {
                    assert_eq!(symbols.len(), 2);
                    assert_ne!(symbols[0], symbols[1]);
                    assert!(truth.hidden.iter().all(|h| h.visible && h.lambda >= VISIBLE_LAMBDA));
                }
                Class::Single => assert!(symbols.len() == 1 && symbols[0].starts_with('E')),
                Class::Tied => {
                    let tie = truth.tie.as_ref().unwrap();
                    assert!(tie.lambda < TIED_LAMBDA && truth.hidden[0].visible);
                    assert!(!tie.partners.contains(&symbols[0]));
                }
                Class::Outside => {
                    assert!(symbols.len() == 1 && symbols[0].starts_with('X'));
                    assert!(truth.excess > 1.0, "nothing is left on what is held out");
                }
                _ => assert!(symbols.is_empty() && truth.excess == 1.0),
            }
            if class == Class::FaultOnly {
                let worst = truth.faults.iter().filter(|(id, _)| *id != "k7");
                assert!(worst.map(|(_, k)| *k).fold(0.0, f64::max) >= 0.05);
            }
        }
    }
}

/// Running seeds bring every effect of a machine, here the servo, which the odd ones are of.
#[test]
fn property_running_seeds_cover_the_catalogue() {
    let draw = |place: u64| Case::draw(9 << 16 | (2 * place + 1), Class::Single).unwrap();
    let cases: Vec<Case> = (0..18).map(draw).collect();
    assert!(cases.iter().all(|case| case.machine() == Machine::Servo));
    let mut seen: Vec<&str> = cases.iter().map(|c| c.truth().hidden[0].symbol).collect();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 18, "{seen:?}");
    // sizes are log-uniform about the visible one: two thirds are visible
    let visible = cases.iter().filter(|c| c.truth().hidden[0].visible).count();
    assert!((6..=17).contains(&visible), "{visible} of 18");
}

#[test]
fn a_proposed_command_is_recorded_with_the_same_machine() {
    for seed in [0, 1] {
        let case = Case::draw(seed, Class::Tied).unwrap();
        let servo = case.machine() == Machine::Servo;
        let origin = if servo { 1.25 } else { 0.0 };
        let size = if servo { 1.0 } else { 0.02 };
        let mut command = String::from("time_s,command_rad\n");
        for n in 0..=400 {
            let t = f64::from(n) * 0.01;
            writeln!(command, "{t},{}", origin + size * (2.0 * t).sin()).unwrap();
        }
        let file = case.record_for(&command).unwrap();
        assert_eq!(column(&file.text, "time_s").len(), 8001);
        let angle = column(&file.text, "motor_angle_rad");
        let moved = angle.iter().fold(0.0_f64, |most, a| most.max((a - angle[0]).abs()));
        assert!(moved > 0.9 * size * if servo { 1.0 } else { 500.0 }, "{moved}");
        if servo {
            assert!((angle[0] - 1.25).abs() < 1e-5);
        }
        assert_eq!(file, case.record_for(&command).unwrap());
    }
}
