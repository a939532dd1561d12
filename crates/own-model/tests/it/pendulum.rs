//! A pendulum under a position controller, written as a user would write it.

use own_model::{
    Geometry, ModelError, Number, OwnExplanation, OwnModel, OwnVerdict, Ports, PortsInUse, Record,
    Recordings, Test, calibrate, explain, propose,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const RATE_HZ: f64 = 200.0;

/// What the machine has and the model has not.
#[derive(Clone, Copy, Default)]
struct Hidden {
    friction: f64,
    delay_samples: usize,
    inertia_ratio: f64,
    /// A torque of no cause in the catalogue: its frequency rises over the test.
    wandering: f64,
}

struct Pendulum {
    numbers: Vec<Number>,
    signals: Vec<String>,
    hidden: Hidden,
}

impl Pendulum {
    fn new(hidden: Hidden) -> Self {
        let numbers = vec![
            Number::exact("inertia_kg_m2", 0.02),
            Number::exact("drag_n_m_s_per_rad", 0.02),
            Number::rough("weight_n_m", 0.5, 0.02),
        ];
        let signals = ["torque_n_m", "angle_rad"].map(str::to_owned).to_vec();
        Self { numbers, signals, hidden }
    }
}

impl OwnModel for Pendulum {
    fn numbers(&self) -> &[Number] {
        &self.numbers
    }

    fn signals(&self) -> &[String] {
        &self.signals
    }

    fn ports(&self) -> Ports {
        Ports { load: true, drive: true, sensor: true }
    }

    fn run(
        &self,
        numbers: &[f64],
        test: &Test,
        ports: &mut PortsInUse,
    ) -> Result<Vec<Vec<f64>>, ModelError> {
        let [inertia, drag, weight] = numbers else { panic!("three numbers") };
        let inertia = inertia * (1.0 + self.hidden.inertia_ratio);
        let (mut angle, mut speed, step_s) = (test.command[0], 0.0_f64, 1.0 / test.rate_hz);
        let (mut torques, mut angles, mut asked) = (Vec::new(), Vec::new(), Vec::new());
        for (sample, command) in test.command.iter().enumerate() {
            let seen = ports.sensor(sample, angle);
            asked.push(8.0 * (command - seen) - 0.4 * speed);
            let late = asked[sample.saturating_sub(self.hidden.delay_samples)];
            let torque = ports.drive(sample, late);
            torques.push(torque);
            angles.push(angle);
            let time_s = sample as f64 * step_s;
            let unknown = self.hidden.wandering * (0.9 * time_s * time_s).sin();
            let load = ports.load(sample, angle, speed) + unknown;
            let own = drag * speed + weight * angle.sin() + load;
            let free = speed + step_s * (torque - own) / inertia;
            // dry friction as a pendulum has it: it stops what it can
            let stop = step_s * self.hidden.friction / inertia;
            speed = if free.abs() <= stop { 0.0 } else { free - stop.copysign(free) };
            angle += step_s * speed;
        }
        Ok(vec![torques, angles])
    }
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (core::f64::consts::TAU * v).cos()
}

fn command(seed: u64) -> Vec<f64> {
    let phase = (seed % 97) as f64 / 10.0;
    (0..1600)
        .map(|n| {
            let t = f64::from(n) / RATE_HZ;
            0.8 * (1.3 * t + phase).sin() + 0.3 * ((4.0 + 0.5 * phase) * t).sin()
        })
        .collect()
}

fn record(machine: &Pendulum, seed: u64) -> Record {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let test = Test { rate_hz: RATE_HZ, command: command(seed), load: Vec::new() };
    let numbers: Vec<f64> = machine.numbers.iter().map(|number| number.value).collect();
    let mut signals =
        machine.run(&numbers, &test, &mut PortsInUse::none(&test)).expect("a model that runs");
    for (signal, noise) in signals.iter_mut().zip([0.02, 5e-4]) {
        for x in signal {
            *x += noise * normal(&mut random);
        }
    }
    Record { name: format!("recording {seed}"), test, signals }
}

fn told(hidden: Hidden, seed: u64) -> OwnExplanation {
    let machine = Pendulum::new(hidden);
    let train = [record(&machine, seed), record(&machine, seed + 1)];
    let holdout = [record(&machine, seed + 2)];
    let recordings = Recordings { train: &train, holdout: &holdout };
    explain(&Pendulum::new(Hidden::default()), Geometry::Rotary, recordings).expect("an answer")
}

fn sentence(told: &OwnExplanation) -> String {
    let causes: Vec<String> = told
        .causes
        .iter()
        .map(|c| format!("{} {:.4} {:?} {:?}", c.name, c.probability, c.sizes, c.tied_with))
        .collect();
    format!("{:?} {causes:?} {:?} {:?} {}", told.verdict, told.sets, told.signals, told.runs)
}

#[test]
fn a_model_that_is_right_is_adequate() {
    for seed in [1, 11, 21, 31] {
        let told = told(Hidden::default(), seed);
        assert_eq!(told.verdict, OwnVerdict::Adequate, "{}", sentence(&told));
        assert!(told.causes.is_empty());
    }
}

#[test]
fn hidden_friction_is_named_with_its_size() {
    for (seed, friction) in [(1, 0.05), (11, 0.1)] {
        let told = told(Hidden { friction, ..Hidden::default() }, seed);
        assert_eq!(
            told.causes.first().map(|c| c.name.as_str()),
            Some("dry friction"),
            "{}",
            sentence(&told)
        );
        let size = &told.causes[0].sizes[0];
        assert!((size.value - friction).abs() < 0.05 * friction, "{}", sentence(&told));
        assert!(told.holdout_gain().expect("held out") > 0.2, "{}", sentence(&told));
    }
}

#[test]
fn a_hidden_delay_of_the_drive_is_named_with_its_size() {
    for (seed, delay_samples) in [(1, 2), (11, 4)] {
        let told = told(Hidden { delay_samples, ..Hidden::default() }, seed);
        assert_eq!(told.verdict, OwnVerdict::Named, "{}", sentence(&told));
        assert_eq!(told.causes[0].name, "drive delay", "{}", sentence(&told));
        let size = &told.causes[0].sizes[0];
        let delay_s = delay_samples as f64 / RATE_HZ;
        assert!((size.value - delay_s).abs() < 4.0 * size.std + 1e-4, "{}", sentence(&told));
        assert!(told.holdout_gain().expect("held out") > 0.2, "{}", sentence(&told));
    }
}

#[test]
fn a_wrong_number_is_named() {
    let told = told(Hidden { inertia_ratio: 0.3, ..Hidden::default() }, 1);
    assert_eq!(told.verdict, OwnVerdict::Named, "{}", sentence(&told));
    assert_eq!(told.causes[0].name, "number inertia_kg_m2");
    assert!((told.causes[0].sizes[0].value - 0.026).abs() < 3e-4, "{}", sentence(&told));
}
#[test]
fn small_causes_and_several_at_once_are_named() {
    let hidden = Hidden::default();
    let cases: [(Hidden, &[&str]); 4] = [
        (Hidden { friction: 0.005, ..hidden }, &["dry friction"]),
        (Hidden { inertia_ratio: 0.05, ..hidden }, &["number inertia_kg_m2"]),
        (Hidden { friction: 0.05, delay_samples: 2, ..hidden }, &["drive delay", "dry friction"]),
        (
            Hidden { friction: 0.05, delay_samples: 2, inertia_ratio: 0.2, ..hidden },
            &["drive delay", "dry friction", "number inertia_kg_m2"],
        ),
    ];
    for (hidden, expected) in cases {
        for seed in [40, 50] {
            let told = told(hidden, seed);
            let mut names: Vec<&str> = told.causes.iter().map(|c| c.name.as_str()).collect();
            names.sort_unstable();
            assert_eq!(names, expected, "{}", sentence(&told));
            assert_eq!(told.verdict, OwnVerdict::Named, "{}", sentence(&told));
        }
    }
}

#[test]
fn what_no_cause_explains_is_not_given_one() {
    for seed in [1, 11, 21, 31, 41, 51] {
        let told = told(Hidden { wandering: 0.1, ..Hidden::default() }, seed);
        let left = [OwnVerdict::Unknown, OwnVerdict::Inconclusive];
        assert!(left.contains(&told.verdict), "{}", sentence(&told));
    }
}

#[test]
fn numbers_are_calibrated_with_intervals_that_hold_the_truth() {
    let machine = Pendulum::new(Hidden { inertia_ratio: 0.1, ..Hidden::default() });
    let train = [record(&machine, 3), record(&machine, 4)];
    let holdout = [record(&machine, 5)];
    let recordings = Recordings { train: &train, holdout: &holdout };
    let told = calibrate(&Pendulum::new(Hidden::default()), recordings).expect("a model that runs");
    for (number, truth) in told.numbers.iter().zip([0.022, 0.02, 0.5]) {
        assert!((number.value - truth).abs() < 4.0 * number.std, "{number:?}, not {truth}");
        assert!(number.std < 0.02 * truth, "{number:?}");
    }
    assert!(told.signals.iter().all(|signal| signal.left_ratio < 0.05), "{:?}", told.signals);
}

#[test]
fn the_test_that_separates_ties_is_put_first() {
    // at a slow creep friction and a torque that does not change sign are one
    let creep = |n: usize| 0.02 * n as f64 / RATE_HZ;
    let machine = Pendulum::new(Hidden { friction: 0.05, ..Hidden::default() });
    let mut train = [record(&machine, 1)];
    train[0].test.command = (0..1600).map(creep).collect();
    let numbers: Vec<f64> = machine.numbers.iter().map(|number| number.value).collect();
    let test = train[0].test.clone();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut signals =
        machine.run(&numbers, &test, &mut PortsInUse::none(&test)).expect("a model that runs");
    for (signal, noise) in signals.iter_mut().zip([0.02, 5e-4]) {
        for x in signal {
            *x += noise * normal(&mut random);
        }
    }
    train[0].signals = signals;
    let recordings = Recordings { train: &train, holdout: &[] };
    let model = Pendulum::new(Hidden::default());
    let there_and_back = Test { command: command(2), ..test.clone() };
    let tests = [("creep".to_owned(), test), ("there and back".to_owned(), there_and_back)];
    let proposal =
        propose(&model, Geometry::Rotary, recordings, &tests).expect("a model that runs");
    assert_eq!(proposal.tests[0].name, "there and back", "{proposal:?}");
    let least = |n: usize| proposal.tests[n].least().expect("a model that runs");
    assert!(least(0) > 10.0 * least(1).max(1.0), "{proposal:?}");
}

#[test]
fn bad_recordings_are_refused_by_name() {
    let machine = Pendulum::new(Hidden::default());
    let refused = |change: fn(&mut Record)| {
        let mut train = [record(&machine, 1)];
        change(&mut train[0]);
        let recordings = Recordings { train: &train, holdout: &[] };
        explain(&machine, Geometry::Rotary, recordings).unwrap_err().to_string()
    };
    assert_eq!(
        refused(|record| record.signals[1].truncate(1000)),
        "recording 1: signal `angle_rad` has 1000 samples, expected 1600 as in the command"
    );
    assert_eq!(
        refused(|record| record.signals[0][7] = f64::NAN),
        "recording 1: sample 7 of `torque_n_m` is not finite"
    );
    assert_eq!(
        refused(|record| record.test.command.truncate(50)),
        "recording 1: signal `torque_n_m` has 1600 samples, expected 50 as in the command"
    );
}

/// A pendulum that also tells a flag, fails at trials that it cannot bear, or both.
struct Fussy(Pendulum);

impl OwnModel for Fussy {
    fn numbers(&self) -> &[Number] {
        self.0.numbers()
    }

    fn signals(&self) -> &[String] {
        self.0.signals()
    }

    fn ports(&self) -> Ports {
        self.0.ports()
    }

    fn run(
        &self,
        numbers: &[f64],
        test: &Test,
        ports: &mut PortsInUse,
    ) -> Result<Vec<Vec<f64>>, ModelError> {
        let mut signals = self.0.run(numbers, test, ports)?;
        if signals.concat().iter().any(|x| x.abs() > 100.0) {
            return Err(ModelError::Run("too far".to_owned()));
        }
        if self.signals().len() > signals.len() {
            signals.push(vec![0.0; test.command.len()]);
        }
        Ok(signals)
    }
}

fn names(told: &OwnExplanation) -> Vec<&str> {
    told.causes.iter().map(|cause| cause.name.as_str()).collect()
}

#[test]
fn a_flag_that_is_always_zero_and_trials_that_fail_hide_no_cause() {
    let machine = Pendulum::new(Hidden { friction: 0.05, ..Hidden::default() });
    let mut train = [record(&machine, 1), record(&machine, 2)];
    let mut model = Fussy(Pendulum::new(Hidden::default()));
    model.0.signals.push("flag".to_owned());
    for record in &mut train {
        record.signals.push(vec![0.0; record.test.command.len()]);
    }
    let recordings = Recordings { train: &train, holdout: &[] };
    let told = explain(&model, Geometry::Rotary, recordings).expect("an answer");
    assert_eq!(names(&told), ["dry friction"], "{}", sentence(&told));
    assert!(told.sets.iter().all(|set| set.probability.is_finite()), "{}", sentence(&told));
}

#[test]
fn a_standstill_first_changes_no_name() {
    let machine = Pendulum::new(Hidden { friction: 0.05, ..Hidden::default() });
    let mut still = record(&Pendulum::new(Hidden::default()), 1);
    still.test.command.fill(0.0);
    let mut random = ChaCha8Rng::seed_from_u64(9);
    for (signal, noise) in still.signals.iter_mut().zip([0.02, 5e-4]) {
        signal.fill_with(|| noise * normal(&mut random));
    }
    let train = [still, record(&machine, 1)];
    let recordings = Recordings { train: &train, holdout: &[] };
    let model = Pendulum::new(Hidden::default());
    let told = explain(&model, Geometry::Rotary, recordings).expect("an answer");
    assert_eq!(names(&told), ["dry friction"], "{}", sentence(&told));
}

#[test]
fn noise_with_a_memory_is_no_cause_beside_a_short_recording() {
    let machine = Pendulum::new(Hidden::default());
    for seed in [1, 2, 3] {
        let mut train = [record(&machine, seed), record(&machine, seed + 50)];
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for record in &mut train {
            for (signal, size) in record.signals.iter_mut().zip([0.02, 5e-4]) {
                let mut last = 0.0;
                for x in signal {
                    last = 0.9 * last + size * normal(&mut random);
                    *x += last;
                }
            }
        }
        train[1].test.command.truncate(15);
        for signal in &mut train[1].signals {
            signal.truncate(15);
        }
        let recordings = Recordings { train: &train, holdout: &[] };
        let told = explain(&machine, Geometry::Rotary, recordings).expect("an answer");
        assert_eq!(told.verdict, OwnVerdict::Unknown, "{}", sentence(&told));
    }
}

#[test]
fn a_number_that_is_three_times_too_large_is_found() {
    for seed in [1, 11, 21] {
        let told = told(Hidden { inertia_ratio: 2.0, ..Hidden::default() }, seed);
        assert_eq!(names(&told), ["number inertia_kg_m2"], "{}", sentence(&told));
        let size = &told.causes[0].sizes[0];
        assert!((size.value - 0.06).abs() < 4.0 * size.std + 1e-5, "{}", sentence(&told));
    }
}
