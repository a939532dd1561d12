//! The jobs of `../peers.py` with `gp-bayesopt`, in the same CSV.

use std::{fs, hint::black_box, time::Instant};

use gp_bayesopt::{
    Acquisition, Ask, Bounds, Fantasies, GaussianProcess, GpOptions, Maximiser, Outcome, Study,
    StudyOptions, TwoStep,
};

fn table(path: &str) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(path).expect("readable");
    text.lines().map(|l| l.split(',').map(|v| v.parse().expect("a number")).collect()).collect()
}

/// CPU time of this thread in ms, where the system tells.
fn cpu_ms() -> f64 {
    let text = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|v| v.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-6
}

/// Smallest wall time of a call, and CPU time a call over groups long enough for the clock.
fn report(job: &str, mut work: impl FnMut() -> f64) {
    let mut quality = work();
    let start = Instant::now();
    let _first = black_box(work());
    let once = start.elapsed().as_secs_f64() * 1e3;
    let group = (100.0 / once).ceil().max(1.0) as usize;
    let (mut wall, mut cpu) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..7 {
        let before = cpu_ms();
        for _ in 0..group {
            let start = Instant::now();
            quality = black_box(work());
            wall = wall.min(start.elapsed().as_secs_f64() * 1e3);
        }
        cpu = cpu.min((cpu_ms() - before) / group as f64);
    }
    println!("{job},gp-bayesopt,{wall:.4},{cpu:.4},{quality:.6}");
}

fn main() {
    let case = std::env::args().nth(1).expect("folder of the case");
    let train = table(&format!("{case}/train.csv"));
    let points: Vec<Vec<f64>> = train.iter().map(|r| r[..7].to_vec()).collect();
    let values: Vec<f64> = train.iter().map(|r| r[7]).collect();
    let best = values.iter().copied().fold(f64::INFINITY, f64::min);
    let bounds = Bounds::unit(7).expect("a cube");
    let options = GpOptions::default();
    let fit = || GaussianProcess::fit(&bounds, &points, &values, &options).expect("a fit");
    report("fit", || fit().report().ln_likelihood);
    let gp = fit();
    eprintln!("{:?}", gp.report());
    let maximiser = Maximiser::default();
    report("log-ei", || {
        let ei = Acquisition::LogExpectedImprovement;
        maximiser.maximise(&ei, &gp, best).expect("a maximum").value
    });
    let rule = TwoStep::new(Fantasies::GaussHermite(8)).expect("eight nodes");
    report("two-step", || maximiser.maximise_two_step(&rule, &gp, best).expect("a maximum").value);
    report("predict-1000", || {
        let many: Vec<Vec<f64>> = points.iter().cycle().take(1000).cloned().collect();
        gp.predict_many(&many).expect("predictions")[7].mean[0]
    });
    // thirty outputs at forty observations, refit included
    let mut study = Study::new(StudyOptions {
        design_points: 0,
        ..StudyOptions::residual(bounds.clone(), 1000)
    })
    .expect("usable");
    for x in points.iter().take(40) {
        study.tell_earlier(x, Outcome::Residual(thirty(x))).expect("a residual");
    }
    report("composite", || {
        let mut study = study.clone();
        match study.ask().expect("a proposal") {
            Ask::Evaluate(x) => thirty(&x).iter().map(|r| r * r).sum::<f64>().sqrt(),
            _ => f64::NAN,
        }
    });
    // the step of a running study: hyperparameters warm
    let _asked = study.ask().expect("a proposal");
    let x = &points[41];
    study.tell(x, Outcome::Residual(thirty(x))).expect("a residual");
    report("composite-warm", || {
        let mut study = study.clone();
        match study.ask().expect("a proposal") {
            Ask::Evaluate(x) => thirty(&x).iter().map(|r| r * r).sum::<f64>().sqrt(),
            _ => f64::NAN,
        }
    });
}

/// A smooth map from seven inputs to thirty outputs.
fn thirty(x: &[f64]) -> Vec<f64> {
    (0..30)
        .map(|o| {
            let along: f64 =
                x.iter().enumerate().map(|(i, x)| x * (1.3 * f64::from(o) + 2.1 * i as f64).sin()).sum();
            (2.0 * along).sin() + 0.3 * along * along - 0.2
        })
        .collect()
}
