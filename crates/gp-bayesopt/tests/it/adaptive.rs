//! Chosen surrogates, trust regions and noisy incumbents.

use approx::assert_relative_eq;
use gp_bayesopt::{
    Ask, Bounds, ChosenSurrogate, Criterion, Design, GpOptions, Outcome, OutputForm, Study,
    StudyOptions, StudyState,
};

fn rosenbrock(x: &[f64]) -> f64 {
    x.windows(2).map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum()
}

fn valley() -> Bounds {
    Bounds::new(&[-5.0; 4], &[10.0; 4]).unwrap()
}

/// Values that are smooth in the logarithm and span nine orders of magnitude, and smooth ones.
fn samples() -> (Bounds, Vec<Vec<f64>>, Vec<f64>, Vec<f64>) {
    let bounds = Bounds::unit(2).unwrap();
    let points = Design::Sobol.points(&bounds, 40, 3).unwrap();
    let smooth: Vec<f64> =
        points.iter().map(|x| (3.0 * x[0]).sin() + x[1] * x[1] - 0.4 * x[0] * x[1]).collect();
    let steep = smooth.iter().map(|y| (10.0 * y).exp()).collect();
    (bounds, points, smooth, steep)
}

#[test]
fn the_form_that_predicts_best_is_chosen() {
    let (bounds, points, smooth, steep) = samples();
    let options = GpOptions::default();
    let plain = ChosenSurrogate::fit(&bounds, &points, &smooth, &options).unwrap();
    assert_eq!(plain.choice.form, OutputForm::Identity);
    let logarithm = ChosenSurrogate::fit(&bounds, &points, &steep, &options).unwrap();
    assert_eq!(logarithm.choice.form, OutputForm::Logarithm);
    for (x, y) in points.iter().zip(&steep) {
        let mean = logarithm.process.predict(x).unwrap().mean[0];
        assert_relative_eq!(logarithm.transformation.back(mean), *y, max_relative = 1e-3);
    }
}

#[test]
fn property_densities_are_those_of_the_outputs() {
    // in other units the density of the same outputs is another by their product, whatever the
    // transformation: what the slope of the transformation is for
    const UNIT: f64 = 1000.0;
    let (bounds, points, smooth, steep) = samples();
    let options = GpOptions::default();
    for values in [smooth, steep] {
        let scaled: Vec<f64> = values.iter().map(|y| UNIT * y).collect();
        let one = ChosenSurrogate::fit(&bounds, &points, &values, &options).unwrap();
        let other = ChosenSurrogate::fit(&bounds, &points, &scaled, &options).unwrap();
        assert_eq!(one.choice, other.choice);
        let moved = one.ln_density - values.len() as f64 * UNIT.ln();
        assert_relative_eq!(other.ln_density, moved, max_relative = 1e-3);
    }
}

#[test]
fn a_chosen_surrogate_finds_a_valley_that_a_plain_one_does_not() {
    let best = |options: StudyOptions| {
        let mut study = Study::new(options).unwrap();
        study.run(|x| Ok::<_, std::convert::Infallible>(Outcome::Value(rosenbrock(x)))).unwrap();
        study.best().unwrap().value
    };
    for seed in 0..3 {
        let adaptive = best(StudyOptions { seed, ..StudyOptions::adaptive(valley(), 70) });
        let plain = StudyOptions::scalar(valley(), Criterion::ExpectedImprovement, 70);
        let plain = best(StudyOptions { seed, ..plain });
        assert!(adaptive < 0.5 * plain, "{seed}: {adaptive} {plain}");
    }
}

#[test]
fn the_last_points_of_an_adaptive_study_find_the_last_digits() {
    // a bowl of one minimum, 1 at (0.3, 0.6), that no quadratic is
    let bowl = |x: &[f64]| (x[0] - 0.3).powi(2).exp() + 3.0 * (x[1] - 0.6).powi(2).sin();
    for seed in 0..3 {
        let bounds = Bounds::new(&[-1.0; 2], &[1.5; 2]).unwrap();
        let options = StudyOptions { seed, ..StudyOptions::adaptive(bounds, 50) };
        let mut study = Study::new(options).unwrap();
        study.run(|x| Ok::<_, std::convert::Infallible>(Outcome::Value(bowl(x)))).unwrap();
        let above = study.best().unwrap().value - 1.0;
        assert!(above < 1e-8, "{seed}: {above}");
    }
}

#[test]
fn a_batch_of_the_last_points_holds_different_ones() {
    let mut study = Study::new(StudyOptions::adaptive(valley(), 42)).unwrap();
    while study.evaluations() < 39 {
        let Ask::Evaluate(x) = study.ask().unwrap() else { panic!("too early") };
        study.tell(&x, Outcome::Value(rosenbrock(&x))).unwrap();
    }
    let batch = study.ask_batch(3).unwrap();
    assert_eq!(batch.len(), 3);
    for (i, a) in batch.iter().enumerate() {
        let far = |b: &Vec<f64>| a.iter().zip(b).any(|(x, y)| (x - y).abs() > 1e-6);
        assert!(batch[..i].iter().all(far), "{batch:?}");
    }
}

#[test]
fn an_adaptive_study_resumes_bit_for_bit() {
    let mut whole = Study::new(StudyOptions::adaptive(valley(), 40)).unwrap();
    let mut asked = 0;
    while let Ask::Evaluate(x) = whole.ask().unwrap() {
        whole.tell(&x, Outcome::Value(rosenbrock(&x))).unwrap();
        asked += 1;
        if asked % 7 == 0 {
            let state = whole.state().clone();
            let mut again = Study::resume(whole.options().clone(), state).unwrap();
            assert_eq!(again.ask().unwrap(), whole.clone().ask().unwrap());
        }
    }
    let saved = serde_json::to_string(whole.state()).unwrap();
    let loaded: StudyState = serde_json::from_str(&saved).unwrap();
    assert!(loaded.chosen.is_some());
    assert_eq!(loaded.chosen, whole.state().chosen);
}

#[test]
fn the_believed_best_is_not_the_luckiest_observation() {
    // a parabola in noise of a tenth of its height; the offset of one observation is larger
    let bounds = Bounds::new(&[0.0], &[1.0]).unwrap();
    let options = StudyOptions::scalar(bounds, Criterion::ExpectedImprovement, 100);
    let mut study = Study::new(options).unwrap();
    assert!(study.best_believed().unwrap().is_none());
    for i in 0..60_u32 {
        let x = f64::from(i) / 59.0;
        let noise = 0.05 * f64::from((i * 37 + 11) % 17) / 17.0;
        let lucky = if i == 3 { -0.6 } else { 0.0 };
        let value = (x - 0.6).powi(2) + noise + lucky;
        study.tell(&[x], Outcome::Value(value)).unwrap();
    }
    let (seen, believed) = (study.best().unwrap(), study.best_believed().unwrap().unwrap());
    assert_eq!(seen.index, 3);
    assert!((believed.point[0] - 0.6).abs() < 0.1, "{believed:?}");
    assert_eq!(believed.point, study.state().points[believed.index]);
    assert!(believed.value > seen.value);
}
