//! Severe damage of machines within their tolerances, as `docs/validation/units.md` has it of more.

use experiments::{HiddenDamage, UnitsLine, evaluate_units};
use fdi_core::{Bundle, Diagnoser, EMBEDDED_BUNDLES, report::FaultId};

const MACHINES: usize = 6;

/// The low-fidelity model errs more than was learnt where damage is beyond the design. Taken at the
/// noise that the phases show, no machine within the tolerances would explain such a recording, and
/// levels would be those of a machine that is exactly its model file.
#[test]
fn tolerances_hold_beside_severe_damage() {
    let bundle = Bundle::from_bytes(EMBEDDED_BUNDLES[0].bytes).unwrap();
    let diagnoser = Diagnoser::new(bundle).unwrap();
    let line = UnitsLine {
        scale: 1.0,
        damage: HiddenDamage::Alone(FaultId::K6, 0.5),
        misstated: 1.0,
        any_start: true,
        as_built: true,
        machines: MACHINES,
        twins: MACHINES,
    };
    let result = evaluate_units(&diagnoser, &line, 11, 2).unwrap();
    let score = &result.with_tolerances;
    assert_eq!(score.detected_of[5], MACHINES, "{score:?}");
    assert!(score.covered.iter().all(|&count| count >= MACHINES - 1), "{score:?}");
    // anti-test: taken to be exactly its model file, such a machine is not described
    let twin = &result.without;
    assert!(twin.covered.iter().any(|&count| count <= MACHINES / 2), "{twin:?}");
}
