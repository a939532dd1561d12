use approx::assert_abs_diff_eq;
use ema_sim::{EffectId, Level, Spread, Tolerance, UncertainNumber, presets};
use inference::BandedMatrix;

use super::{
    contradiction::Agreement,
    error::UnitError,
    evidence::{Evidence, TemperatureReading},
    finding::{Findings, History, Since},
    joint::{DamageFit, Joint, OfTest, OfUnit, Wear},
    learnt_unit::{Earlier, Learnt, LearntUnit, UnitRecording, UnitState},
    monitor::UnitMonitor,
    quantities::Quantities,
    search::{Observed, UnitFit, explain},
    unmodelled::{EffectSlopes, absent},
};
use crate::{
    Bundle, ColumnMap, DiagnoseOptions, Diagnoser, EMBEDDED_BUNDLES, Recording, ToleranceUse,
    report::NoticeCode, simulation::experiment::Experiment,
    statistics::noise_covariance::unit_noise_covariance,
};

/// Noise of a phase sample, A.
const NOISE_A: f64 = 0.02;

/// The embedded chirp with what a fit needs.
struct Chirp {
    bundle: Bundle,
    quantities: Quantities,
    noise: BandedMatrix,
}

impl Chirp {
    fn new() -> Self {
        let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap();
        let experiment = &bundle.experiment;
        let quantities = Quantities::new(experiment);
        let noise = unit_noise_covariance(experiment, 10e3);
        Self { quantities, noise: noise.scaled(NOISE_A * NOISE_A), bundle }
    }

    fn error(&self) -> &UnitError {
        &self.bundle.units[0]
    }

    /// Signal at a point of the unknowns, without noise.
    fn signal(&self, point: &[f64]) -> Vec<f64> {
        let monitor = UnitMonitor::new(&self.bundle.experiment, &self.quantities, 0.0);
        let at = self.quantities.at(point);
        let (mut signal, shares) = monitor.sensed(&at).unwrap();
        shares.add(self.quantities.layout(), point, &mut signal);
        self.error().add_mean(&at, &mut signal);
        signal
    }

    fn fit(&self, signal_a: &[f64]) -> UnitFit {
        self.fit_within(signal_a, u64::MAX)
    }

    fn fit_within(&self, signal_a: &[f64], most_evaluations: u64) -> UnitFit {
        self.fit_beside(&[], signal_a, most_evaluations)
    }

    /// Slopes of the nominal machine's signal in effects that it does not have.
    fn effect_slopes(&self) -> Vec<EffectSlopes> {
        let monitor = UnitMonitor::new(&self.bundle.experiment, &self.quantities, 0.0);
        monitor.effect_slopes(&self.quantities.nominal(), &absent(&[])).unwrap()
    }

    fn fit_beside(
        &self,
        effects: &[EffectSlopes],
        signal_a: &[f64],
        most_evaluations: u64,
    ) -> UnitFit {
        self.explained(&self.observed(signal_a), effects, most_evaluations)
    }

    fn observed<'a>(&'a self, signal_a: &'a [f64]) -> Observed<'a> {
        Observed {
            signal_a,
            start_angle_rad: 0.0,
            shares: None,
            start_std_s: 0.0,
            damage: &[],
            nominal_slopes: None,
            noise: &self.noise,
            temperature: None,
        }
    }

    fn explained(
        &self,
        observed: &Observed<'_>,
        effects: &[EffectSlopes],
        most_evaluations: u64,
    ) -> UnitFit {
        let experiment = &self.bundle.experiment;
        explain(experiment, &self.quantities, self.error(), observed, effects, most_evaluations)
            .unwrap()
    }

    fn point(&self, set: &[(&str, f64)]) -> Vec<f64> {
        self.quantities.layout().point(set)
    }
}

#[test]
fn what_the_current_cannot_tell_is_left_to_the_tolerances() {
    let chirp = Chirp::new();
    let fit = chirp.fit(&chirp.signal(&chirp.point(&[])));
    let std = |place: usize| fit.covariance[(place, place)].sqrt();
    // k1 is half a tolerance of dry friction, 20 % between units and 3 % between sessions, over a torque
    // constant that the inertia tells to its 3 %
    // and 15 K of temperature add 0.5·15 K of (0.4 % less 0.11 %, and 0.1 % uncertain)
    let friction = 0.5 * 0.20_f64.hypot(0.03).hypot(0.03);
    assert_abs_diff_eq!(std(0) / friction, 1.0, epsilon = 0.05);
    // k2 of 0.01 is a play twice as wide, 30 %
    assert_abs_diff_eq!(std(1) / (0.30 / 99.0), 1.0, epsilon = 0.02);
    // eccentricity as built, 2 % over both directions
    assert_abs_diff_eq!(std(5) / (0.02 / 2f64.sqrt()), 1.0, epsilon = 0.01);
}

#[test]
fn slopes_that_recordings_share_give_the_same_answer() {
    let chirp = Chirp::new();
    let worn = chirp.signal(&chirp.point(&[("k3", 0.03), ("k2", 0.02)]));
    let monitor = UnitMonitor::new(&chirp.bundle.experiment, &chirp.quantities, 0.0);
    let kept = monitor.nominal_slopes(&chirp.error().spread).unwrap();
    let observed = chirp.observed(&worn);
    let by_itself = chirp.explained(&observed, &[], u64::MAX);
    let shared = Observed { nominal_slopes: Some(&kept), ..observed };
    let with_shared = chirp.explained(&shared, &[], u64::MAX);
    assert_eq!(with_shared.point, by_itself.point);
    assert_eq!(with_shared.covariance, by_itself.covariance);
    let runs = 2 * chirp.quantities.nominal().len() as u64;
    assert_eq!(with_shared.evaluations, by_itself.evaluations - runs);
    // anti-test: from other damage they are not those of the point
    let turned = Observed { damage: &[0.01], ..shared };
    let alone = Observed { nominal_slopes: None, ..turned };
    let [with, without] = [turned, alone].map(|one| chirp.explained(&one, &[], u64::MAX));
    assert_eq!((with.point, with.evaluations), (without.point, without.evaluations));
}

#[test]
fn a_residual_in_the_form_of_an_effect_is_told() {
    let chirp = Chirp::new();
    let effects = chirp.effect_slopes();
    let cogging = effects.iter().find(|one| one.effect == EffectId::Cogging).unwrap();
    let machine = chirp.point(&[("k3", 0.03), ("transmission.kinetic-friction-n-m", 0.1)]);
    let unmodelled = |largest_a: f64| {
        let row = &cogging.rows[0];
        let most = row.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let mut signal = chirp.signal(&machine);
        for (value, slope) in signal.iter_mut().zip(row) {
            *value += largest_a * slope / most;
        }
        chirp.fit_beside(&effects, &signal, u64::MAX).evidence.unmodelled
    };
    assert_eq!(unmodelled(0.0), []);
    // within what noise allows
    assert_eq!(unmodelled(1e-3), []);
    assert_eq!(unmodelled(0.05).first(), Some(&EffectId::Cogging));
}

#[test]
fn a_search_ends_when_its_evaluations_are_spent() {
    let chirp = Chirp::new();
    let worn = chirp.signal(&chirp.point(&[("k3", 0.05), ("k2", 0.04)]));
    let whole = chirp.fit(&worn);
    assert!(whole.converged && !whole.cut_short, "{} evaluations", whole.evaluations);
    let short = chirp.fit_within(&worn, 1);
    assert!(short.cut_short && !short.converged, "{} evaluations", short.evaluations);
    // the slopes at the start, and the point that it ends with
    assert!(
        2 * short.evaluations < whole.evaluations,
        "{}, {}",
        short.evaluations,
        whole.evaluations
    );
    let same = chirp.fit_within(&worn, whole.evaluations);
    assert_eq!((same.point, same.cut_short), (whole.point, false));
}

#[test]
fn a_tolerance_and_the_fault_that_does_the_same_have_one_signal() {
    let chirp = Chirp::new();
    let apart = |a: &[(&str, f64)], b: &[(&str, f64)]| {
        let (a, b) = (chirp.signal(&chirp.point(a)), chirp.signal(&chirp.point(b)));
        a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let friction = [("transmission.kinetic-friction-n-m", 0.06)];
    assert!(apart(&[("k1", 0.03)], &friction) < 1e-9);
    let play = [("transmission.backlash-rad", 0.99)];
    assert!(apart(&[("k2", 0.01)], &play) < 1e-9);
    let magnets = [("motor.back-emf-v-s-per-rad", -0.03)];
    assert!(apart(&[("k3", 0.03), ("k4", 0.03), ("k5", 0.03)], &magnets) < 1e-9);
    // anti-test: one phase alone is no torque constant
    assert!(apart(&[("k3", 0.03)], &magnets) > 1e-3);
}

#[test]
fn findings_tell_a_phase_and_leave_a_weak_magnet_open() {
    let chirp = Chirp::new();
    let found = |set: &[(&str, f64)]| {
        let fit = chirp.fit(&chirp.signal(&chirp.point(set)));
        let own = of_unit(&chirp, &fit, 0);
        let joint = Joint::new(&[], &[own], &fit.point).unwrap();
        let layout = chirp.quantities.layout();
        let history = History { joint, worn: None, since: Since::AsBuilt, nth: 1 };
        let findings = Findings::of(layout, &history, &DamageFit::from(&fit));
        let ids = findings.all.iter().filter(|one| one.detected).map(|one| one.id.clone());
        ids.collect::<Vec<_>>()
    };
    assert_eq!(found(&[]), Vec::<String>::new());
    assert_eq!(found(&[("k4", 0.04)]), ["imbalance-b"]);
    assert_eq!(found(&[("motor.back-emf-v-s-per-rad", -0.03)]), Vec::<String>::new());
    assert_eq!(found(&[("k2", 0.03)]), ["play"]);
    assert_eq!(found(&[("k6_cos", 0.08)]), ["eccentricity"]);
    // damage beyond all tolerances is found though a tolerance does the same
    assert_eq!(found(&[("k1", 0.6)]), ["friction"]);
}

fn of_unit<'a>(chirp: &'a Chirp, fit: &'a UnitFit, session: usize) -> OfUnit<'a> {
    let test = OfTest::only(&chirp.quantities);
    OfUnit { evidence: &fit.evidence, test, session, wear: Wear::AsNew, replaced: [0; 3] }
}

/// Standard deviations of a damage beside so many references, each of a day of its own.
fn stds_beside(chirp: &Chirp, fit: &UnitFit, references: usize) -> Vec<f64> {
    let others: Vec<_> = (0..references).map(|day| of_unit(chirp, fit, day)).collect();
    let own = of_unit(chirp, fit, references);
    let joint = Joint::new(&others, &[own], &fit.point).unwrap();
    let damage = joint.damage().unwrap();
    (0..damage.estimate.len()).map(|place| damage.covariance[(place, place)].sqrt()).collect()
}

#[test]
fn references_leave_sessions_and_noise() {
    let chirp = Chirp::new();
    let fit = chirp.fit(&chirp.signal(&chirp.point(&[])));
    let alone = stds_beside(&chirp, &fit, 0);
    let known = DamageFit::from(&fit);
    for (place, std) in alone.iter().enumerate() {
        let marginal = known.covariance[(place, place)].sqrt();
        assert!((std / marginal - 1.0).abs() < 1e-2, "{place}: {std} {marginal}");
    }
    let (one, four) = (stds_beside(&chirp, &fit, 1), stds_beside(&chirp, &fit, 4));
    // friction differs by 3 % from day to day and with 15 K of temperature, play and turns do not
    assert!(alone[0] > 0.09 && four[0] < 0.05 && four[0] > 0.015, "{alone:?} {four:?}");
    for place in 1..7 {
        assert!(one[place] < alone[place] && four[place] < one[place], "{place}: {one:?} {four:?}");
    }
    assert!(four[1] < 0.2 * alone[1] && four[2] < 0.3 * alone[2], "{four:?}");
}

#[test]
fn recordings_of_one_session_have_most_of_the_error_in_common() {
    let chirp = Chirp::new();
    let fit = chirp.fit(&chirp.signal(&chirp.point(&[])));
    let references: Vec<_> = (0..4).map(|day| of_unit(&chirp, &fit, day)).collect();
    let stds = |sessions: &[usize]| -> Vec<f64> {
        let own: Vec<_> = sessions.iter().map(|&day| of_unit(&chirp, &fit, day)).collect();
        let damage = Joint::new(&references, &own, &fit.point).unwrap().damage().unwrap();
        (0..7).map(|place| damage.covariance[(place, place)].sqrt()).collect()
    };
    let one = stds(&[4]);
    let (one_day, four_days) = (stds(&[4; 4]), stds(&[4, 5, 6, 7]));
    for place in 0..7 {
        let (one, day, days) = (one[place], one_day[place], four_days[place]);
        assert!(days < day && day < one, "{place}: {one} {day} {days}");
        // four of one day are not worth four days, and these not four independent ones: both have
        // the references and the unit in common
        assert!(day > 1.05 * days && days > 0.5 * one, "{place}: {one} {day} {days}");
    }
}

#[test]
fn readings_of_one_session_are_those_of_one_thermometer() {
    let chirp = Chirp::new();
    let mut fit = chirp.fit(&chirp.signal(&chirp.point(&[])));
    fit.evidence.temperature = Some(TemperatureReading { away_k: 0.0, std_k: 3.0 });
    let mut precise = fit.clone();
    precise.evidence.temperature = Some(TemperatureReading { away_k: 0.0, std_k: 1.5 });
    let std = |fit: &UnitFit, recordings: usize| {
        let references: Vec<_> = (0..4).map(|day| of_unit(&chirp, fit, day)).collect();
        let own = vec![of_unit(&chirp, fit, 4); recordings];
        let damage = Joint::new(&references, &own, &fit.point).unwrap().damage().unwrap();
        damage.covariance[(2, 2)].sqrt()
    };
    // a thermometer of half the error tells more than four readings of one
    assert!(std(&precise, 1) < std(&fit, 4), "{} {}", std(&precise, 1), std(&fit, 4));
}

#[test]
fn a_change_is_told_from_what_was_there_as_built() {
    let chirp = Chirp::new();
    let fit = |set: &[(&str, f64)]| chirp.fit(&chirp.signal(&chirp.point(set)));
    // a machine with a lopsided winding, weak magnets and a wide play as built
    let built = [("as-built.turns.b", -0.01), ("motor.back-emf-v-s-per-rad", -0.04)];
    let as_new = fit(&built);
    let shows = |later: &[(&str, f64)]| {
        let later = fit(&[&built[..], later].concat());
        let (others, own) = ([of_unit(&chirp, &as_new, 0)], of_unit(&chirp, &later, 1));
        let joint = Joint::new(&others, &[own], &later.point).unwrap();
        let damage = joint.damage().unwrap();
        let layout = chirp.quantities.layout();
        let history = History { joint, worn: None, since: Since::References, nth: 1 };
        let findings = Findings::of(layout, &history, &damage);
        let ids = findings.all.iter().filter(|one| one.detected).map(|one| one.id.clone());
        (damage.estimate, ids.collect::<Vec<_>>())
    };
    let (none, found) = shows(&[]);
    assert!(found.is_empty(), "{found:?}");
    assert!(none.iter().all(|level| level.abs() < 2e-3), "{none:?}");
    let (short, found) = shows(&[("k4", 0.03)]);
    assert!(found.contains(&"imbalance-b".to_owned()), "{found:?}");
    assert!((short[3] - 0.03).abs() < 6e-3, "{short:?}");
}

#[test]
fn a_part_that_was_replaced_is_not_known() {
    let chirp = Chirp::new();
    let fit = chirp.fit(&chirp.signal(&chirp.point(&[])));
    let stds = |replaced: [u32; 3]| {
        let others = [of_unit(&chirp, &fit, 0)];
        let own = OfUnit { replaced, ..of_unit(&chirp, &fit, 1) };
        let joint = Joint::new(&others, &[own], &fit.point).unwrap();
        let damage = joint.damage().unwrap();
        [1, 5].map(|place| damage.covariance[(place, place)].sqrt())
    };
    let ([play, eccentricity], motor) = (stds([0; 3]), stds([1, 0, 0]));
    let gear = stds([0, 1, 0]);
    assert!((motor[0] / play - 1.0).abs() < 0.05 && motor[1] > 5.0 * eccentricity, "{motor:?}");
    assert!(gear[0] > 5.0 * play && (gear[1] / eccentricity - 1.0).abs() < 0.05, "{gear:?}");
}

/// A unit of recordings as new and of later sessions, with the parts replaced before each of these.
fn unit_of(as_new: &[&UnitFit], later: &[(&UnitFit, [u32; 3])]) -> LearntUnit {
    let recording = |fit: &UnitFit, day: usize, state, replaced| UnitRecording {
        name: format!("{day}.csv"),
        session: Some(format!("day {day}")),
        state,
        replaced,
        evidence: fit.evidence.clone(),
    };
    let first = as_new.iter().enumerate();
    let first = first.map(|(day, fit)| recording(fit, day, UnitState::AsNew, [0; 3]));
    let since = later.iter().enumerate().map(|(day, (fit, replaced))| {
        recording(fit, as_new.len() + day, UnitState::Since, *replaced)
    });
    LearntUnit {
        actuator_id: None,
        model_name: "ema-48".to_owned(),
        command: "chirp".to_owned(),
        basis: String::new(),
        replaced: later.last().map_or([0; 3], |(_, replaced)| *replaced),
        recordings: first.chain(since).collect(),
        agreement: Agreement::default(),
    }
}

fn earlier<'a>(chirp: &'a Chirp, unit: &'a LearntUnit, session: Option<&'a str>) -> Earlier<'a> {
    Earlier::of(&[Learnt { unit, test: OfTest::only(&chirp.quantities) }], &[session])
}

/// Findings that a recording of a new day shows with the others of a unit.
fn found_beside(chirp: &Chirp, unit: &LearntUnit, own: &UnitFit) -> Vec<String> {
    let earlier = earlier(chirp, unit, Some("another day"));
    let one = OfUnit { replaced: unit.replaced, ..of_unit(chirp, own, earlier.sessions[0]) };
    let joint = Joint::new(&earlier.others, &[one], &own.point).unwrap();
    let damage = joint.damage().unwrap();
    let worn = OfUnit { wear: earlier.worn, ..one };
    let worn = Joint::worn(&earlier.others, &[worn], &own.point);
    let since = Since::References;
    let history = History { joint, worn, since, nth: earlier.nth };
    let findings = Findings::of(chirp.quantities.layout(), &history, &damage);
    let ids = findings.all.iter().filter(|one| one.detected).map(|one| one.id.clone());
    ids.collect()
}

#[test]
fn a_slow_wear_is_found_over_the_sessions_and_none_where_there_is_none() {
    let chirp = Chirp::new();
    let fit = |k2: f64| chirp.fit(&chirp.signal(&chirp.point(&[("k2", k2)])));
    let (new, worn): (UnitFit, Vec<UnitFit>) =
        (fit(0.0), (1..=6).map(|session| fit(3e-4 * f64::from(session))).collect());
    let later: Vec<_> = worn[..5].iter().map(|fit| (fit, [0; 3])).collect();
    let unit = unit_of(&[&new; 4], &later);
    assert_eq!(earlier(&chirp, &unit, None).nth, 6);
    assert!(found_beside(&chirp, &unit, &worn[5]).contains(&"play".to_owned()));
    // anti-test: the same sessions without wear
    let healthy = unit_of(&[&new; 4], &[(&new, [0; 3]); 5]);
    assert_eq!(found_beside(&chirp, &healthy, &new), Vec::<String>::new());
}

#[test]
fn wear_is_counted_from_the_replacement_of_a_part() {
    let chirp = Chirp::new();
    let fit = chirp.fit(&chirp.signal(&chirp.point(&[])));
    let (old, gear) = ([0; 3], [0, 1, 0]);
    let unit = unit_of(&[&fit], &[(&fit, old), (&fit, old), (&fit, gear), (&fit, gear)]);
    let earlier = earlier(&chirp, &unit, Some("another day"));
    let worn: Vec<Wear> = earlier.others.iter().map(|one| one.wear).chain([earlier.worn]).collect();
    // motor, gear, sensors: the first session with another gear has that gear as new
    let since = |sessions: [usize; 3]| Wear::Since(sessions);
    assert_eq!(
        worn,
        [
            Wear::AsNew,
            since([1, 1, 1]),
            since([2, 2, 2]),
            since([3, 0, 3]),
            since([4, 1, 4]),
            since([5, 2, 5]),
        ]
    );
}

#[test]
fn a_reading_of_the_temperature_tells_magnets_from_a_warm_day() {
    let chirp = Chirp::new();
    let signal = chirp.signal(&chirp.point(&[]));
    let fit = chirp.fit(&signal);
    let read = |fit: &UnitFit, away_k: f64| {
        let mut read = fit.clone();
        read.evidence.temperature = Some(TemperatureReading { away_k, std_k: 1.0 });
        read
    };
    let std = |fit: &UnitFit| {
        let (others, own) = ([of_unit(&chirp, fit, 0)], of_unit(&chirp, fit, 1));
        let joint = Joint::new(&others, &[own], &fit.point).unwrap();
        joint.damage().unwrap().covariance[(2, 2)].sqrt()
    };
    assert!(std(&read(&fit, 0.0)) < 0.9 * std(&fit), "{} {}", std(&read(&fit, 0.0)), std(&fit));
    // 30 K warmer, the drag falls to 55 % and the magnets by 3 %: no change
    let warm = chirp.fit(&chirp.signal(&chirp.point(&[("test.winding-temperature-k", 30.0)])));
    let (new, warm) = (read(&fit, 0.0), read(&warm, 30.0));
    let (others, own) = ([of_unit(&chirp, &new, 0)], of_unit(&chirp, &warm, 1));
    let joint = Joint::new(&others, &[own], &warm.point).unwrap();
    let damage = joint.damage().unwrap();
    assert!(damage.estimate.iter().all(|level| level.abs() < 4e-3), "{:?}", damage.estimate);
}

#[test]
fn units_come_back_from_their_file() {
    let chirp = Chirp::new();
    let fit = chirp.fit(&chirp.signal(&chirp.point(&[])));
    let recording = |name: &str, state, temperature| UnitRecording {
        name: name.to_owned(),
        session: Some("2026-11-21".to_owned()),
        state,
        replaced: [0, 1, 0],
        evidence: Evidence { temperature, ..fit.evidence.clone() },
    };
    let read = TemperatureReading { away_k: 3.5, std_k: 2.0 };
    let unit = LearntUnit {
        actuator_id: Some("A-7".to_owned()),
        model_name: "ema-48".to_owned(),
        command: "chirp".to_owned(),
        basis: "0".repeat(64),
        replaced: [0, 1, 0],
        recordings: vec![
            recording("a.csv", UnitState::AsNew, None),
            recording("b.csv", UnitState::Since, Some(read)),
        ],
        agreement: Agreement::default(),
    };
    let bytes = unit.to_bytes();
    assert!(LearntUnit::from_bytes(&bytes).unwrap() == unit);
    assert_eq!((unit.references(), unit.sessions()), (1, 1));
    let mut bad = bytes.clone();
    *bad.last_mut().unwrap() ^= 1;
    assert!(LearntUnit::from_bytes(&bad).is_err());
    let error = LearntUnit::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap_err().to_string();
    assert_eq!(error, "is a bundle, expected a unit");
}

#[test]
fn levels_of_one_number_add_in_squares() {
    let number = UncertainNumber::find("motor.inertia-kg-m2").unwrap();
    let of = |level, std| Tolerance { number, spread: Spread::Std(std), level };
    let tolerance = vec![of(Level::Unit, 0.03), of(Level::Session, 0.04)];
    let quantities = Quantities::new(&Experiment { tolerance, ..Experiment::chirp() });
    let numbers = &quantities.layout().numbers;
    assert_eq!(numbers.len(), 1);
    assert_abs_diff_eq!(numbers[0].scatter.together(), 0.05, epsilon = 1e-12);
    assert!(presets::ema_48_tolerance().len() > numbers.len());
}

#[test]
fn a_temperature_without_a_law_is_told_not_to_be_used() {
    let read = |has_law: bool, has_reading: bool| {
        let mut bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap();
        if !has_law {
            bundle.experiment.temperature = None;
        }
        let fixtures = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/recordings/r01.csv.gz");
        let map = ColumnMap::new(&[] as &[String]).unwrap();
        let mut recording = Recording::read(fixtures.as_ref(), &map).unwrap();
        recording.metadata.winding_temperature_k = has_reading.then_some(300.0);
        let options =
            DiagnoseOptions { tolerance: ToleranceUse::Model, ..DiagnoseOptions::default() };
        let answer = Diagnoser::new(bundle).unwrap().diagnose(&recording, &options).unwrap();
        answer.notices.iter().any(|notice| notice.code == NoticeCode::TemperatureUnused)
    };
    assert!(read(false, true));
    assert!(!read(true, true) && !read(false, false));
}
