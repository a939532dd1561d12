//! Grey wolf optimiser.

use super::crowd::{Crowd, Ended, ranking};
use crate::random::{Purpose, Stream};

/// Moves until the crowd ends the run.
pub(super) fn run<E, F>(crowd: &mut Crowd<'_, F>, members: usize) -> Ended<E>
where
    F: FnMut(&[f64]) -> Result<f64, E>,
{
    let mut stream = Stream::new(crowd.options.seed, Purpose::Population, 0);
    let mut at = crowd.uniform(&mut stream, members);
    let d = crowd.dimension();
    // the three best points ever seen lead
    let mut leaders: Vec<(f64, Vec<f64>)> = Vec::new();
    loop {
        let values = match crowd.values(&at) {
            Ok(values) => values,
            Err(ended) => return ended,
        };
        leaders.extend(ranking(&values).into_iter().take(3).map(|i| (values[i], at[i].clone())));
        leaders.sort_by(|a, b| a.0.total_cmp(&b.0));
        leaders.truncate(3);
        let done = crowd.evaluations as f64 / crowd.options.max_evaluations as f64;
        let reach = 2.0 * (1.0 - done).max(0.0);
        for wolf in &mut at {
            for j in 0..d {
                let sum: f64 = leaders
                    .iter()
                    .map(|(_, leader)| {
                        let a = reach * (2.0 * stream.uniform() - 1.0);
                        let c = 2.0 * stream.uniform();
                        leader[j] - a * (c * leader[j] - wolf[j]).abs()
                    })
                    .sum();
                wolf[j] = (sum / leaders.len() as f64).clamp(0.0, 1.0);
            }
        }
    }
}
