//! Data that are kept come back bit for bit, and bad data are refused.

use gp_bayesopt::{
    Ask, Bounds, Criterion, Design, GaussianProcess, GpOptions, Matrix, Outcome, Study,
    StudyOptions, StudyState,
};
use serde_json::{Value, from_value, json, to_value};

fn bounds() -> Bounds {
    Bounds::new(&[0.0, -1.0, 0.0, 0.0], &[2.0, 1.0, 3.0, 1.0])
        .and_then(|b| b.with_periodic(1))
        .and_then(|b| b.with_polar(2, 3))
        .unwrap()
}

fn outputs(x: &[f64]) -> Vec<f64> {
    vec![(3.0 * x[0]).sin() + x[2] * (6.0 * x[3]).cos(), x[0] * (3.0 * x[1]).cos()]
}

/// A process that was fitted to twenty points and then grew by three.
fn process() -> GaussianProcess {
    let points = Design::Sobol.points(&bounds(), 23, 3).unwrap();
    let rows: Vec<Vec<f64>> = points.iter().map(|x| outputs(x)).collect();
    let first = Matrix::from_rows(&rows[..20]).unwrap();
    let options = GpOptions::default();
    let mut gp = GaussianProcess::fit_many(&bounds(), &points[..20], &first, &options).unwrap();
    for i in 20..23 {
        gp.append(&points[i], &rows[i]).unwrap();
    }
    gp
}

#[test]
fn a_process_predicts_the_same_bits() {
    let gp = process();
    let copy: GaussianProcess = from_value(to_value(&gp).unwrap()).unwrap();
    assert_eq!(copy.report(), gp.report());
    for x in Design::Sobol.points(&bounds(), 50, 9).unwrap() {
        assert_eq!(copy.predict_with_slope(&x).unwrap(), gp.predict_with_slope(&x).unwrap());
    }
    assert_eq!(copy.leave_one_out(1), gp.leave_one_out(1));
    assert_eq!(to_value(&copy).unwrap(), to_value(&gp).unwrap());
}

#[test]
fn a_process_of_bad_data_is_refused() {
    let good = to_value(process()).unwrap();
    let refused = |pointer: &str, with: Value, why: &str| {
        let mut bad = good.clone();
        *bad.pointer_mut(pointer).unwrap() = with;
        let error = from_value::<GaussianProcess>(bad).unwrap_err().to_string();
        assert!(error.contains(why), "{pointer}: {error}");
    };
    refused("/version", json!(2), "layout of version 2, 1 is read");
    refused("/bounds/lower/0", json!(5.0), "is not an interval");
    refused("/bounds/kinds/3", json!("linear"), "cannot be joined");
    refused("/bounds/kinds/3", json!({ "polar_angle": { "radius": 9 } }), "input 9");
    refused("/options/starts", json!(0), "starts is 0");
    refused("/options/kernel", json!("cubic"), "unknown variant");
    refused("/unit_points/4", json!([0.5]), "point 4 is unusable");
    refused("/unit_points/4/0", json!(null), "invalid type");
    refused("/outputs/7", json!([1.0]), "observation 7 has 1 outputs");
    refused("/outputs", json!([]), "23 points but 0 observations");
    refused("/appended", json!(23), "23 of 23 observations appended");
    refused("/hyperparameters", json!([0.0]), "hyperparameters: 1 numbers for 5 inputs");
    refused("/hyperparameters/0", json!(1e6), "hyperparameter 0 is 1000000");
    let mut unknown = good.clone();
    unknown["more"] = json!(1);
    assert!(from_value::<GaussianProcess>(unknown).is_err());
}

fn study(options: &StudyOptions, until: usize) -> Study {
    let mut study = Study::new(options.clone()).unwrap();
    go_on(&mut study, until);
    study
}

fn go_on(study: &mut Study, until: usize) {
    while study.evaluations() < until
        && let Ask::Evaluate(x) = study.ask().unwrap()
    {
        let failed = study.evaluations() == 4;
        let outcome = if failed { Outcome::Failed } else { Outcome::Residual(outputs(&x)) };
        study.tell(&x, outcome).unwrap();
    }
}

#[test]
fn a_study_goes_on_with_the_same_bits() {
    let options = StudyOptions::residual(bounds(), 18);
    let whole = study(&options, 18);
    let mut half = study(&options, 11);
    half.ask().unwrap(); // a point is pending
    let state: StudyState = from_value(to_value(half.state()).unwrap()).unwrap();
    assert_eq!(&state, half.state());
    let mut later = Study::resume(options, state).unwrap();
    let pending = later.state().pending[0].clone();
    later.tell(&pending, Outcome::Residual(outputs(&pending))).unwrap();
    go_on(&mut later, 18);
    assert_eq!(later.state(), whole.state());
}

#[test]
fn a_study_of_bad_data_is_refused() {
    let options = StudyOptions::residual(bounds(), 9);
    let good = to_value(study(&options, 9).state()).unwrap();
    let refused = |pointer: &str, with: Value, why: &str| {
        let mut bad = good.clone();
        *bad.pointer_mut(pointer).unwrap() = with;
        let error = from_value::<StudyState>(bad).unwrap_err().to_string();
        assert!(error.contains(why), "{pointer}: {error}");
    };
    refused("/version", json!(0), "layout of version 0, 1 is read");
    refused("/points", json!([]), "0 points but 9 outcomes");
    refused("/earlier", json!(10), "10 of them of earlier runs");
    refused("/points/2", json!([0.1]), "point 2 has 1 coordinates, the first has 4");
    refused("/outcomes/5", json!({ "residual": [1.0] }), "outcome 5 is of another kind");
    refused("/outcomes/5", json!({ "value": 1.0 }), "outcome 5 is of another kind");
    refused("/outcomes/5", json!("lost"), "unknown variant");
    let scalar = StudyOptions::scalar(bounds(), Criterion::ExpectedImprovement, 9);
    assert!(Study::resume(scalar, from_value(good).unwrap()).is_err(), "other options");
}
