//! A real-coded genetic algorithm.

use super::crowd::{Crowd, Ended, ranking};
use crate::random::{Purpose, Stream};

const ELITES: usize = 2;

/// Generations until the crowd ends the run.
pub(super) fn run<E, F>(crowd: &mut Crowd<'_, F>, members: usize) -> Ended<E>
where
    F: FnMut(&[f64]) -> Result<f64, E>,
{
    let mut stream = Stream::new(crowd.options.seed, Purpose::Population, 0);
    let mut parents = crowd.uniform(&mut stream, members);
    let mut values = match crowd.values(&parents) {
        Ok(values) => values,
        Err(ended) => return ended,
    };
    // the mutation shrinks by a hundredth with each generation
    let mut sigma = 0.1;
    loop {
        sigma *= 0.99;
        let order = ranking(&values);
        let mut children: Vec<Vec<f64>> =
            order[..ELITES].iter().map(|&i| parents[i].clone()).collect();
        let mut fitness: Vec<f64> = order[..ELITES].iter().map(|&i| values[i]).collect();
        while children.len() < members {
            let [a, b] = [0, 0].map(|_: i32| tournament(&mut stream, &values));
            let child = offspring(&mut stream, &parents[a], &parents[b], sigma);
            match crowd.value(&child) {
                Ok(value) => fitness.push(value),
                Err(ended) => return ended,
            }
            children.push(child);
        }
        (parents, values) = (children, fitness);
    }
}

/// The best of three members.
fn tournament(stream: &mut Stream, values: &[f64]) -> usize {
    let mut winner = stream.index(values.len());
    for _ in 0..2 {
        let other = stream.index(values.len());
        if values[other] < values[winner] {
            winner = other;
        }
    }
    winner
}

/// BLX-½ crossover and mutation.
fn offspring(stream: &mut Stream, a: &[f64], b: &[f64], sigma: f64) -> Vec<f64> {
    let rate = 1.0 / a.len() as f64;
    a.iter()
        .zip(b)
        .map(|(&a, &b)| {
            let reach = 0.5 * (a - b).abs();
            let mut x = stream.between(a.min(b) - reach, a.max(b) + reach);
            if stream.uniform() < rate {
                x += sigma * stream.normal();
            }
            x.clamp(0.0, 1.0)
        })
        .collect()
}
