//! Intervals of fault levels that numbers of the model file leave open, by fits with the level held.

use inference::Whitener;

use crate::{
    error::{GreyboxError, if_run},
    explain::Session,
    fit::{Fitted, fit},
    interval::Z_95,
};

/// Rise of the objective at the ends of a 95 % interval, nats: half of the quantile of χ² with one
/// degree of freedom.
const RISE_95: f64 = 0.5 * Z_95 * Z_95;
/// How much further each move of a level goes than the one before.
const FURTHER: f64 = 1.5;
/// Most moves of a level to either side.
const MOST_MOVES: usize = 8;

/// A fit with a number held, and its objective but for what is known of that number beforehand.
struct Held {
    at: f64,
    objective: f64,
}

impl Session<'_> {
    /// Interval of 95 % of a free number, no shorter than one within which it is known to lie: by moves
    /// from the number as fitted on, with all others fitted anew, to where the objective has risen by
    /// 1.92 nats over the least seen (profile likelihood). What is known of the number itself
    /// beforehand does not count: it says where a fit that numbers leave open stands, not how far the
    /// number may go.
    ///
    /// A normal approximation about a fit is too narrow where another number does the same and neither
    /// is known well: what is known beforehand has tails, and friction that damage has raised goes by
    /// the product of both.
    ///
    /// # Source
    ///
    /// Venzon and Moolgavkar, Applied Statistics 37, 1988.
    pub(crate) fn likelihood_interval(
        &self,
        fitted: &Fitted,
        place: usize,
        within: [f64; 2],
        whitener: &Whitener,
    ) -> Result<[f64; 2], GreyboxError> {
        let start = Held {
            at: fitted.values[place],
            objective: fitted.objective - own_cost(fitted, place, fitted.values[place]),
        };
        let mut base = start.objective;
        let [low, high] = within;
        let mut sides = [vec![start], Vec::new()];
        for (side, end) in sides.iter_mut().zip([high, low]) {
            let moved = self.moved_on(fitted, place, end, &mut base, whitener)?;
            side.extend(moved);
        }
        let [mut above, below] = sides;
        let most = end(&above, base).max(high);
        above.truncate(1);
        above.extend(below);
        Ok([end(&above, base).min(low), most])
    }

    /// Fits with a number held ever further off the one fitted, first at an `end`, until the objective
    /// has risen too far over the least seen.
    fn moved_on(
        &self,
        fitted: &Fitted,
        place: usize,
        end: f64,
        base: &mut f64,
        whitener: &Whitener,
    ) -> Result<Vec<Held>, GreyboxError> {
        let free = &fitted.structure.free[place];
        let mut values = fitted.values.clone();
        let mut step = end - values[place];
        let mut all: Vec<Held> = Vec::new();
        for _ in 0..MOST_MOVES {
            let next = (values[place] + step).clamp(free.least, free.most);
            if next == values[place] {
                break;
            }
            let mut structure = fitted.structure.clone().started_at(&values);
            let held = &mut structure.free[place];
            (held.start, held.least, held.most) = (next, next, next);
            let Some(refit) = if_run(fit(&self.train, structure, whitener))? else { break };
            let objective = refit.objective - own_cost(fitted, place, next);
            all.push(Held { at: next, objective });
            *base = base.min(objective);
            if objective > *base + RISE_95 {
                break;
            }
            (values, step) = (refit.values, FURTHER * step);
        }
        Ok(all)
    }
}

/// Cost of a free number by what is known of it beforehand, nats.
fn own_cost(fitted: &Fitted, place: usize, value: f64) -> f64 {
    fitted.structure.free[place].prior.map_or(0.0, |prior| prior.cost(value))
}

/// Where the objective has risen far enough over the least seen, by fits one beyond the other; the last
/// of them where it has not.
fn end(moved: &[Held], base: f64) -> f64 {
    let root = |held: &Held| libm::sqrt((held.objective - base).max(0.0));
    let wanted = libm::sqrt(RISE_95);
    let is_beyond = |pair: &&[Held]| root(&pair[0]) <= wanted && root(&pair[1]) > wanted;
    match moved.windows(2).rfind(is_beyond) {
        // the root of the rise is nearly straight
        Some([from, to]) => {
            from.at + (to.at - from.at) * (wanted - root(from)) / (root(to) - root(from))
        }
        _ => moved.last().map_or(f64::NAN, |held| held.at),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An objective that is a parabola of curvature 4 has its interval end 1.96/2 beside the least,
    /// wherever fits stand.
    #[test]
    fn law_an_interval_of_a_parabola_is_the_normal_one() {
        let held = |at: f64| Held { at, objective: 7.0 + 2.0 * (at - 0.3) * (at - 0.3) };
        let moved = [0.3, 0.7, 1.3, 2.2].map(held);
        assert!((end(&moved, 7.0) - (0.3 + Z_95 / 2.0)).abs() < 1e-9);
        // never so far
        assert_eq!(end(&moved[..2], 7.0), 0.7);
    }
}
