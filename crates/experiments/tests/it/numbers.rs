//! Numbers of hidden units, as `docs/validation/units.md` has them of many.

use experiments::{NumberScore, NumbersLine, evaluate_numbers};
use fdi_core::{Bundle, Diagnoser, EMBEDDED_BUNDLES};

const UNITS: usize = 8;

fn scores() -> Vec<NumberScore> {
    let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap();
    let diagnoser = Diagnoser::new(bundle).unwrap();
    let line = NumbersLine { references: 3, units: UNITS };
    let result = evaluate_numbers(&diagnoser, &line, 5, 2).unwrap();
    assert_eq!(result.learnt, UNITS);
    result.numbers
}

#[test]
fn numbers_of_hidden_units_are_found_and_no_more_is_claimed() {
    let scores = scores();
    let score = |key: &str| {
        scores.iter().find(|score| score.key == key).unwrap_or_else(|| panic!("{key}: {scores:?}"))
    };
    // a gain that all sensors have is one that the noise of the signal could be taken for
    for phase in ["a", "b", "c"] {
        let gain = score(&format!("sensors.phase-gain.{phase}"));
        assert!(gain.covered >= UNITS - 2 && gain.determined == UNITS, "{gain:?}");
    }
    let ratio = score("motor.inertia-kg-m2 / motor.back-emf-v-s-per-rad");
    assert!(ratio.covered >= UNITS - 2 && ratio.within_2_percent >= UNITS - 1, "{ratio:?}");
    // neither of the two shows, nor does the resistance
    for key in ["motor.inertia-kg-m2", "motor.back-emf-v-s-per-rad", "motor.resistance-ohm"] {
        assert_eq!(score(key).determined, 0, "{:?}", score(key));
    }
}
