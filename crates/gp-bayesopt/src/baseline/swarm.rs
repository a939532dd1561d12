//! Particle swarm with constriction.

use super::{Crowd, Ended, ranking};
use crate::random::{Purpose, Stream};

/// Constriction coefficients of Clerc and Kennedy for `φ = 4.1`.
const INERTIA: f64 = 0.729_8;
const PULL: f64 = 1.496_18;

/// Moves until the crowd ends the run.
pub(super) fn run<E, F>(crowd: &mut Crowd<'_, F>, members: usize) -> Ended<E>
where
    F: FnMut(&[f64]) -> Result<f64, E>,
{
    let mut stream = Stream::new(crowd.options.seed, Purpose::Population, 0);
    let mut at = crowd.uniform(&mut stream, members);
    let d = crowd.dimension();
    let mut speed: Vec<Vec<f64>> =
        (0..members).map(|_| (0..d).map(|_| stream.between(-0.1, 0.1)).collect()).collect();
    let mut best = at.clone();
    let mut values = match crowd.values(&at) {
        Ok(values) => values,
        Err(ended) => return ended,
    };
    loop {
        let leader = best[ranking(&values)[0]].clone();
        for i in 0..members {
            for j in 0..d {
                let own = PULL * stream.uniform() * (best[i][j] - at[i][j]);
                let shared = PULL * stream.uniform() * (leader[j] - at[i][j]);
                speed[i][j] = INERTIA * speed[i][j] + own + shared;
                at[i][j] += speed[i][j];
                if !(0.0..=1.0).contains(&at[i][j]) {
                    speed[i][j] *= -0.5;
                    at[i][j] = at[i][j].clamp(0.0, 1.0);
                }
            }
            match crowd.value(&at[i]) {
                Ok(value) if value < values[i] => {
                    values[i] = value;
                    best[i].clone_from(&at[i]);
                }
                Ok(_) => {}
                Err(ended) => return ended,
            }
        }
    }
}
