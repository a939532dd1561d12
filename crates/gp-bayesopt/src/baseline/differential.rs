//! Differential evolution, best/1/bin.

use super::crowd::{Crowd, Ended, ranking};
use crate::random::{Purpose, Stream};

const CROSSOVER: f64 = 0.7;

/// Generations until the crowd ends the run.
pub(super) fn run<E, F>(crowd: &mut Crowd<'_, F>, members: usize) -> Ended<E>
where
    F: FnMut(&[f64]) -> Result<f64, E>,
{
    let mut stream = Stream::new(crowd.options.seed, Purpose::Population, 0);
    let mut at = crowd.uniform(&mut stream, members);
    let mut values = match crowd.values(&at) {
        Ok(values) => values,
        Err(ended) => return ended,
    };
    loop {
        let factor = stream.between(0.5, 1.0);
        for i in 0..members {
            let leader = ranking(&values)[0];
            let trial = mutant(&mut stream, &at, [i, leader], factor);
            match crowd.value(&trial) {
                Ok(value) if value <= values[i] => {
                    values[i] = value;
                    at[i] = trial;
                }
                Ok(_) => {}
                Err(ended) => return ended,
            }
        }
    }
}

/// The leader plus a scaled difference, crossed with member `i`; inputs that
/// leave the cube are drawn anew.
fn mutant(stream: &mut Stream, at: &[Vec<f64>], [i, leader]: [usize; 2], factor: f64) -> Vec<f64> {
    let mut pick = || loop {
        let k = stream.index(at.len());
        if k != i {
            return k;
        }
    };
    let (a, b) = (pick(), pick());
    let d = at[i].len();
    let forced = stream.index(d);
    (0..d)
        .map(|j| {
            if j != forced && stream.uniform() >= CROSSOVER {
                return at[i][j];
            }
            let x = at[leader][j] + factor * (at[a][j] - at[b][j]);
            if (0.0..=1.0).contains(&x) { x } else { stream.uniform() }
        })
        .collect()
}
