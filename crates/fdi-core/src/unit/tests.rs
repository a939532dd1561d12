use ema_sim::{FaultCoordinates, Level, Spread, Tolerance, UncertainNumber, presets};
use inference::BandedMatrix;

use super::{
    error::UnitError,
    finding::Findings,
    monitor::UnitMonitor,
    quantities::Quantities,
    search::{Observed, UnitFit, explain},
};
use crate::{
    Bundle, EMBEDDED_BUNDLES, simulation::experiment::Experiment,
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
        let noise = unit_noise_covariance(&experiment.filter, 10e3, experiment.samples());
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
        let observed =
            Observed { signal_a, start_angle_rad: 0.0, shares: None, noise: &self.noise };
        explain(&self.bundle.experiment, &self.quantities, self.error(), &observed).unwrap()
    }

    fn point(&self, set: &[(&str, f64)]) -> Vec<f64> {
        let layout = self.quantities.layout();
        let mut point = vec![0.0; layout.len()];
        for (name, value) in set {
            let damage = FaultCoordinates::NAMES.iter().position(|one| one == name);
            let number = || layout.numbers.iter().position(|number| number.key == *name);
            let place = damage.or_else(|| Some(layout.sought.len() + number()?)).unwrap();
            point[place] = *value;
        }
        point
    }
}

#[test]
fn what_the_current_cannot_tell_is_left_to_the_tolerances() {
    let chirp = Chirp::new();
    let fit = chirp.fit(&chirp.signal(&chirp.point(&[])));
    let std = |place: usize| fit.covariance[(place, place)].sqrt();
    // k1 is half a tolerance of dry friction, 20 % between units and 3 % between sessions, over a torque
    // constant that the inertia tells to its 3 %
    let friction = 0.5 * 0.20_f64.hypot(0.03).hypot(0.03);
    assert!((std(0) / friction - 1.0).abs() < 0.01, "{}", std(0));
    // k2 of 0.01 is a play twice as wide, 30 %
    assert!((std(1) / (0.30 / 99.0) - 1.0).abs() < 0.02, "{}", std(1));
    // eccentricity as built, 2 % over both directions
    assert!((std(5) / (0.02 / 2f64.sqrt()) - 1.0).abs() < 0.01, "{}", std(5));
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
        let findings = Findings::of(&chirp.quantities, &fit);
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

#[test]
fn levels_of_one_number_add_in_squares() {
    let number = UncertainNumber::find("motor.inertia-kg-m2").unwrap();
    let of = |level, std| Tolerance { number, spread: Spread::Std(std), level };
    let tolerance = vec![of(Level::Unit, 0.03), of(Level::Session, 0.04)];
    let quantities = Quantities::new(&Experiment { tolerance, ..Experiment::chirp() });
    let numbers = &quantities.layout().numbers;
    assert!(numbers.len() == 1 && (numbers[0].std - 0.05).abs() < 1e-12);
    assert!(presets::ema_48_tolerance().len() > numbers.len());
}
