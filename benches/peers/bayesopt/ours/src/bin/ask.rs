//! An adaptive study over a pipe, for `benches/peers/bayesopt/global.py`: `ask BUDGET SEED [LOWER UPPER]...` writes a
//! point a line and reads its value.

use std::io::{BufRead, stdin};

use gp_bayesopt::{Ask, Bounds, Outcome, Study, StudyOptions};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let budget = arguments[0].parse().expect("a number of evaluations");
    let seed = arguments[1].parse().expect("a seed");
    let sides: Vec<f64> = arguments[2..].iter().map(|v| v.parse().expect("a limit")).collect();
    let lower: Vec<f64> = sides.iter().step_by(2).copied().collect();
    let upper: Vec<f64> = sides.iter().skip(1).step_by(2).copied().collect();
    let bounds = Bounds::new(&lower, &upper).expect("a box");
    let options = StudyOptions { seed, ..StudyOptions::adaptive(bounds, budget) };
    let mut study = Study::new(options).expect("usable settings");
    let mut values = stdin().lock().lines();
    while let Ask::Evaluate(point) = study.ask().expect("a proposal") {
        let row: Vec<String> = point.iter().map(|x| format!("{x:?}")).collect();
        println!("{}", row.join(" "));
        let value = values.next().expect("a value").expect("readable").parse().expect("a number");
        study.tell(&point, Outcome::Value(value)).expect("a value");
    }
}
