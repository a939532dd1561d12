//! Work beside diagnoses: explanations, decompositions, fits of surrogates and a study.

use anyhow::{Context, Result, ensure};
use fdi_benches::{bayesopt::regression, reduce::waves};
use gp_bayesopt::{Bounds, GaussianProcess, GpOptions, Outcome, Study, StudyOptions};
use reduction::thin_svd;

use super::over;
use crate::{
    pages::explaining::explanation,
    processor::{processor_s, reference_s},
    terminal::say,
};

/// Evaluations of the study.
const EVALUATIONS: usize = 60;
/// Most by which it may miss the least of Branin's function.
const MOST_MISSED: f64 = 1e-4;

/// Work that is done some times in a row.
struct Work {
    name: &'static str,
    times: u32,
    /// Makes it ready; that is not measured.
    prepare: fn() -> Result<Prepared>,
    /// Most processor time of one, in runs of the reference loop: about twice the ratio that was
    /// measured when the budget was set.
    limit_ratio: f64,
}

/// Work that is ready to be done; it fails where what came out is wrong.
type Prepared = Box<dyn Fn() -> Result<()>>;

const WORK: [Work; 9] = [
    Work {
        name: "explanation, healthy axis",
        times: 1,
        prepare: || Ok(explained(explanation(0, false, true)?, &[])),
        limit_ratio: 5.0,
    },
    Work {
        name: "explanation, axis",
        times: 1,
        prepare: || Ok(explained(explanation(0, true, true)?, &["E11"])),
        limit_ratio: 13.0,
    },
    Work {
        name: "explanation, healthy EMA-48",
        times: 1,
        prepare: || Ok(explained(explanation(1, false, true)?, &[])),
        limit_ratio: 13.0,
    },
    Work {
        name: "explanation, EMA-48",
        times: 1,
        prepare: || Ok(explained(explanation(1, true, true)?, &["E11"])),
        limit_ratio: 38.0,
    },
    Work {
        name: "explanation, axis, free",
        times: 1,
        prepare: || Ok(explained(explanation(0, true, false)?, &["E11"])),
        limit_ratio: 24.0,
    },
    Work {
        name: "explanation, EMA-48, free",
        times: 1,
        prepare: || Ok(explained(explanation(1, true, false)?, &["E11"])),
        limit_ratio: 75.0,
    },
    Work {
        name: "decomposition, 5000 x 100",
        times: 20,
        prepare: decomposition,
        limit_ratio: 0.05,
    },
    Work {
        name: "surrogate, 200 points",
        times: 20,
        prepare: || Ok(surrogate()),
        limit_ratio: 0.1,
    },
    Work { name: "study of 60 evaluations", times: 1, prepare: || Ok(study()), limit_ratio: 0.8 },
];

/// Budgets that are exceeded.
pub(super) fn exceeded() -> Result<Vec<String>> {
    let told = WORK.iter().map(|work| work.exceeded().context(work.name));
    Ok(told.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
}

impl Work {
    fn exceeded(&self) -> Result<Option<String>> {
        let Self { name, times, prepare, limit_ratio } = self;
        let once = prepare()?;
        let before_s = reference_s();
        let start_s = processor_s();
        for _ in 0..*times {
            once()?;
        }
        let took_s = (processor_s() - start_s) / f64::from(*times);
        let ratio = took_s / before_s.min(reference_s());
        say(&format!("{name:<28} {times:>6} {took_s:>12.3} {ratio:>9.2} {limit_ratio:>9.2}"));
        Ok(over(name, ratio, *limit_ratio))
    }
}

/// An explanation that names these effects.
fn explained(
    answer: impl Fn() -> Result<Vec<&'static str>> + 'static,
    named: &'static [&'static str],
) -> Prepared {
    Box::new(move || {
        let found = answer()?;
        ensure!(found == named, "{found:?} named, {named:?} expected");
        Ok(())
    })
}

/// Singular values and vectors.
fn decomposition() -> Result<Prepared> {
    let snapshots = waves(5000, 100)?;
    Ok(Box::new(move || {
        let values = thin_svd(&snapshots)?;
        ensure!(values.singular_values().len() == 100, "all singular values expected");
        Ok(())
    }))
}

/// A Gaussian process fitted to a smooth function of seven inputs.
fn surrogate() -> Prepared {
    let (bounds, points, values) = regression(200);
    Box::new(move || {
        let fitted = GaussianProcess::fit(&bounds, &points, &values, &GpOptions::default())?;
        let q2 = fitted.leave_one_out(0).q2.context("values that vary")?;
        ensure!(q2 > 0.9, "predictive coefficient {q2:.3}, more than 0.9 expected");
        Ok(())
    })
}

/// Search for the least of Branin's function, 0.397887, with the settings as they are.
fn study() -> Prepared {
    Box::new(|| {
        let bounds = Bounds::new(&[-5.0, 0.0], &[10.0, 15.0])?;
        let mut study = Study::new(StudyOptions::adaptive(bounds, EVALUATIONS))?;
        study.run(|x| Ok::<_, std::convert::Infallible>(Outcome::Value(branin(x[0], x[1]))))?;
        let missed = study.best().context("evaluations")?.value - 0.397_887;
        ensure!(missed < MOST_MISSED, "the least is missed by {missed:.1e}");
        Ok(())
    })
}

/// Branin's function.
///
/// # Source
///
/// Dixon and Szegő, *Towards Global Optimisation 2* (1978).
fn branin(x: f64, y: f64) -> f64 {
    use std::f64::consts::PI;
    let valley = y - 5.1 / (4.0 * PI * PI) * x * x + 5.0 / PI * x - 6.0;
    valley * valley + 10.0 * (1.0 - 1.0 / (8.0 * PI)) * x.cos() + 10.0
}
