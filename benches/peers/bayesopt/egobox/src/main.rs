//! Fits egobox's Gaussian process on a stored case; prints hyperparameters, predictions and times as CSV.
//! `egobox-peer train.csv probe.csv`: train has inputs then the output, probe has inputs.

use std::{fs, time::Instant};

use egobox_gp::{GaussianProcess, correlation_models::SquaredExponentialCorr, mean_models::ConstantMean};
use linfa::{dataset::Dataset, traits::Fit};
use ndarray::{Array1, Array2};

fn table(path: &str) -> Array2<f64> {
    let rows: Vec<Vec<f64>> = fs::read_to_string(path)
        .expect("readable")
        .lines()
        .map(|l| l.split(',').map(|v| v.parse().expect("a number")).collect())
        .collect();
    Array2::from_shape_fn((rows.len(), rows[0].len()), |(i, j)| rows[i][j])
}

/// CPU time of this process in ms, in steps of a clock tick of 10 ms.
fn cpu_ms() -> f64 {
    let text = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = text.rsplit(')').next().unwrap_or("").split_whitespace().collect();
    fields.iter().skip(11).take(2).map(|v| 10.0 * v.parse::<f64>().unwrap_or(f64::NAN)).sum()
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let train = table(&arguments[1]);
    let probe = table(&arguments[2]);
    let d = train.ncols() - 1;
    let x = train.slice(ndarray::s![.., ..d]).to_owned();
    let y: Array1<f64> = train.column(d).to_owned();
    for starts in [1, 10] {
        let mut times = Vec::new();
        let mut cpus = Vec::new();
        let mut fitted = None;
        for _ in 0..3 {
            let dataset = Dataset::new(x.clone(), y.clone());
            let before = cpu_ms();
            let start = Instant::now();
            let gp = GaussianProcess::<f64, ConstantMean, SquaredExponentialCorr>::params(
                ConstantMean::default(),
                SquaredExponentialCorr::default(),
            )
            .n_start(starts)
            .fit(&dataset)
            .expect("a fit");
            times.push(start.elapsed().as_secs_f64() * 1e3);
            cpus.push(cpu_ms() - before);
            fitted = Some(gp);
        }
        times.sort_by(f64::total_cmp);
        cpus.sort_by(f64::total_cmp);
        let gp = fitted.expect("three fits");
        println!("starts,{starts},fit_ms,{},{},theta,{:?},variance,{}", times[0], cpus[0], gp.theta().to_vec(), gp.variance());
        if starts == 10 {
            let start = Instant::now();
            let mean = gp.predict(&probe).expect("means");
            let variance = gp.predict_var(&probe).expect("variances");
            println!("predict_ms,{}", start.elapsed().as_secs_f64() * 1e3);
            for i in 0..probe.nrows() {
                println!("{:?},{:?}", mean[i], variance[i]);
            }
        }
    }
}
