//! Fault levels that numbers of the model file leave open.

use inference::Whitener;
use nalgebra::DMatrix;

use crate::{
    fit::{Fitted, inverse, whitened},
    gram::Gram,
    interval::level_key,
    known::Known,
    structure::Target,
};

/// Share of its variance that a level keeps at most where all numbers are known: half of its standard
/// deviation.
const KEPT_VARIANCE: f64 = 0.25;
/// Squared cosine from which on a number does what a level does.
const LEAST_ALIKE: f64 = 0.25;
/// Standard deviation of a level below which nobody asks what leaves it open.
const LEAST_STD: f64 = 0.01;

/// Fault levels whose standard deviation would halve if the numbers of the model file were known, each
/// with the keys of those that leave it open, the most first.
///
/// A level `i` is ambiguous where its variance `C_ii`, which is also that of fits without damage, is
/// above 0.01² and four times or more that with all numbers known, `(F_oo⁻¹)_ii`, with the information
/// `F` of the recordings fitted and of what is known beforehand among the levels and sizes `o` of
/// effects. A number `j` leaves it open where the whitened changes of the prediction with either have
/// a squared cosine of a quarter or more.
pub(crate) fn ambiguous(
    fitted: &Fitted,
    covariance: &DMatrix<f64>,
    noise: &Whitener,
) -> Vec<(String, Vec<String>)> {
    let free = &fitted.structure.free;
    let is_number = |place: &usize| matches!(free[*place].target, Target::Rough(_));
    let (numbers, others): (Vec<usize>, Vec<usize>) =
        fitted.structure.same_everywhere().into_iter().partition(is_number);
    if numbers.is_empty() {
        return Vec::new();
    }
    let known = inverse(&Known::new(&fitted.only(&others), noise).information);
    let columns: Vec<Vec<f64>> =
        fitted.sensitivities.iter().map(|column| whitened(noise, column)).collect();
    let products = Gram::new(&columns);
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    for (place, &level) in others.iter().enumerate() {
        let Target::Fault(coordinate) = free[level].target else { continue };
        let variance = covariance[(level, level)];
        let is_open = variance > LEAST_STD * LEAST_STD;
        if !is_open || known[(place, place)] > KEPT_VARIANCE * variance {
            continue;
        }
        let alike = |number: usize| {
            let common = products.get(level, number);
            let sizes = products.get(level, level) * products.get(number, number);
            common * common / sizes.max(f64::MIN_POSITIVE)
        };
        let mut with: Vec<usize> =
            numbers.iter().copied().filter(|&number| alike(number) >= LEAST_ALIKE).collect();
        with.sort_by(|a, b| alike(*b).total_cmp(&alike(*a)));
        let keys = with.into_iter().map(|number| free[number].key.clone()).collect();
        let key = level_key(coordinate, &free[level]);
        if found.iter().all(|(known, _)| *known != key) {
            found.push((key, keys));
        }
    }
    found.retain(|(_, with)| !with.is_empty());
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{explain::tests::nothing_recorded, structure::Structure};

    /// Friction as damage and a drag that do the same are not told apart; where they do not, or the
    /// drag is known, the level is not ambiguous.
    #[test]
    fn a_level_is_ambiguous_with_the_number_that_does_the_same() {
        let (machine, ..) = nothing_recorded();
        let structure = Structure::nominal(&machine);
        let of = |target: Target| {
            structure.free.iter().position(|free| free.target == target).expect("a free number")
        };
        let (level, number) = (of(Target::Fault(0)), of(Target::Rough(0)));
        let std = structure.free[number].prior.expect("a tolerance").std;
        let wave = |pace: f64, size: f64| {
            vec![(0..500).map(|n| size * libm::sin(pace * f64::from(n))).collect::<Vec<f64>>()]
        };
        let answer = |pace: f64, size: f64| {
            let mut sensitivities = vec![vec![vec![0.0; 500]]; structure.free.len()];
            sensitivities[level] = wave(0.1, 100.0);
            sensitivities[number] = wave(pace, size / std);
            let fitted = Fitted {
                structure: structure.clone(),
                values: structure.starts(),
                residuals: vec![vec![0.0; 500]],
                sensitivities,
                objective: 0.0,
                noise_nats: 0.0,
            };
            let white = Whitener::white(1.0);
            let covariance = inverse(&Known::new(&fitted, &white).information);
            ambiguous(&fitted, &covariance, &white)
        };
        let key = structure.free[number].key.clone();
        assert_eq!(answer(0.1, 10.0), [("k1".to_owned(), vec![key])]);
        assert!(answer(0.3, 10.0).is_empty());
        assert!(answer(0.1, 0.1).is_empty());
    }
}
