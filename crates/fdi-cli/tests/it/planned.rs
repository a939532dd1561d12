//! A test that is planned for some faults.

use std::fs;

use fdi_core::{
    Schema,
    report::{FaultId, TestPlan},
};
use tempfile::TempDir;

use crate::{
    commands::{answer, output, whole},
    unit::refusal,
};

const PLAN: [&str; 10] = [
    "propose",
    "--faults",
    "k2,k6",
    "--within",
    "0.4s",
    "--output-format",
    "json",
    "--stable",
    "-o",
    "test.csv",
];

#[test]
fn a_planned_test_is_a_command_that_can_be_run() {
    let folder = TempDir::new().unwrap();
    let said = output(folder.path(), &PLAN);
    let plan: TestPlan = answer(&said, Schema::TestPlan);
    assert!(plan.duration_s <= 0.4 && plan.motions.len() == 1, "{plan:?}");
    assert_eq!((plan.compared_with.as_str(), plan.references), ("chirp", 4));
    let asked = |fault: &&fdi_core::report::PlannedFault| fault.is_asked;
    let ids: Vec<FaultId> = plan.faults.iter().filter(asked).map(|fault| fault.id).collect();
    assert_eq!(ids, [FaultId::K2, FaultId::K6]);
    for fault in &plan.faults {
        let (planned, least) = (fault.planned.unwrap(), fault.least.unwrap());
        assert!(planned.alone >= 0.99 * least.alone, "{fault:?}");
        assert!(planned.with_reading <= 1.01 * planned.alone, "{fault:?}");
        assert!(planned.with_voltage <= 1.01 * planned.alone, "{fault:?}");
        let is_short = [FaultId::K3, FaultId::K4, FaultId::K5].contains(&fault.id);
        assert!(!is_short || planned.with_voltage < 0.6 * planned.alone, "{fault:?}");
    }
    // the answer does not hang on the number of threads
    let again = output(folder.path(), &[&PLAN[..], &["--jobs", "1"]].concat());
    assert_eq!(again.stdout, said.stdout);

    let simulate = ["simulate", "--command", "test.csv", "-o", "r.csv"];
    let simulated = output(folder.path(), &simulate);
    assert_eq!(simulated.status.code(), Some(0), "{}", whole(&simulated));
    let recorded = fs::read_to_string(folder.path().join("r.csv")).unwrap();
    assert!(recorded.contains("# command = \"recorded\""), "{}", &recorded[..200]);

    // another plan is compared with this one
    let beside = ["propose", "--faults", "k2", "--within", "0.3", "--before", "test.csv"];
    let words = whole(&output(folder.path(), &beside));
    assert!(words.contains("for k2: ") && words.contains("test.csv, 0 N·m  "), "{words}");
    assert!(words.contains("any test"), "{words}");
}

#[test]
fn what_belongs_to_the_other_kind_of_proposal_is_refused() {
    let folder = TempDir::new().unwrap();
    let cases: [(&[&str], &str); 15] = [
        (&["propose", "--faults", "--output-format", "csv"], "no such form"),
        (&["propose"], "--train <REC>..."),
        (&["propose", "--train", "r.csv", "--within", "3s"], "cannot be used with"),
        (&["propose", "--within", "3s"], "not provided:\n  --faults"),
        (&["propose", "--faults", "k1", "--train", "r.csv"], "cannot be used with"),
        (&["propose", "--faults", "k1", "--correct"], "`--correct`: a test for faults is planned"),
        (&["propose", "--faults", "k7"], "expected `k1` to `k6`"),
        (&["propose", "--faults", "k1", "--within", "0s"], "expected a time from 0 to 600 s"),
        (&["propose", "--faults", "k1", "--within", "-3"], "expected a time from 0 to 600 s"),
        (&["propose", "--faults", "k1", "--within", "11min"], "expected a time from 0 to 600 s"),
        (&["propose", "--faults", "k1", "--within", "1e9s"], "expected a time from 0 to 600 s"),
        (&["propose", "--faults", "k1", "--within", "100 ms"], "no motion of at most 0.1 s stays"),
        (&["propose", "--faults", "k1", "--within", "0.1"], "no motion of at most 0.1 s stays"),
        (
            &["propose", "--faults", "k1", "--within", "0.3", "--load-n-m", "-1000"],
            "under a load of -1000 N·m: allow more time or wider limits, or a smaller load",
        ),
        (
            &["propose", "--faults", "k1", "--most-travel-rad", "5"],
            "a limit of 5 rad, expected at most the",
        ),
    ];
    for (arguments, expected) in cases {
        let said = refusal(&folder, arguments);
        assert!(said.contains(expected), "{arguments:?}: {said}");
    }
    fs::write(folder.path().join("m.toml"), "base = \"ema-48\"\nfaults = [\"k1\", \"k2\"]\n")
        .unwrap();
    let said =
        refusal(&folder, &["propose", "--model", "m.toml", "--faults", "k6", "--within", "0.3"]);
    assert!(said.contains("m.toml") && said.contains("`k6` is no fault"), "{said}");
}
