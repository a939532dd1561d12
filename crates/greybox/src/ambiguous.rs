//! Fault levels that numbers of the model file leave open.

use ema_sim::FaultId;
use inference::Whitener;
use nalgebra::DMatrix;

use crate::{
    fit::{Fitted, inverse},
    interval::ECCENTRICITY,
    known::Known,
    structure::{Free, Target},
};

/// Share of its variance that a level keeps at most where all numbers are known: half of its standard
/// deviation.
const KEPT_VARIANCE: f64 = 0.25;
/// Squared correlation with a level from which on a number is one of those that leave it open.
const LEAST_SHARED: f64 = 0.25;
/// Standard deviation of a level below which nobody asks what leaves it open.
const LEAST_STD: f64 = 0.01;

/// Fault levels whose standard deviation would halve if the numbers of the model file were known, each
/// with the keys of those that leave it open, the most first.
///
/// By the covariance `C = F⁻¹` with the information `F` of the recordings fitted, by the noise alone, and
/// of what is known beforehand. A level `i` is ambiguous where its variance with all numbers known is
/// at most a quarter of `C_ii` and `√C_ii` is above 0.01; a number `j` leaves it open where
/// `C_ij²/(C_ii·C_jj)` is a quarter or more.
pub(crate) fn ambiguous(fitted: &Fitted, noise: &Whitener) -> Vec<(String, Vec<String>)> {
    let known = Known::new(fitted, noise);
    let free = &known.structure.free;
    let is_number = |free: &Free| matches!(free.target, Target::Rough(_));
    let numbers: Vec<usize> = (0..free.len()).filter(|&place| is_number(&free[place])).collect();
    let others: Vec<usize> = (0..free.len()).filter(|&place| !is_number(&free[place])).collect();
    if numbers.is_empty() {
        return Vec::new();
    }
    let all = inverse(&known.information);
    let block = |i: usize, j: usize| known.information[(others[i], others[j])];
    let beside = inverse(&DMatrix::from_fn(others.len(), others.len(), block));
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    for (place, &level) in others.iter().enumerate() {
        let Target::Fault(coordinate) = free[level].target else { continue };
        let variance = all[(level, level)];
        let is_open = variance > LEAST_STD * LEAST_STD;
        if !is_open || beside[(place, place)] > KEPT_VARIANCE * variance {
            continue;
        }
        let shared = |number: usize| {
            let common = all[(level, number)];
            common * common / (variance * all[(number, number)]).max(f64::MIN_POSITIVE)
        };
        let mut with: Vec<usize> =
            numbers.iter().copied().filter(|&number| shared(number) >= LEAST_SHARED).collect();
        with.sort_by(|a, b| shared(*b).total_cmp(&shared(*a)));
        let keys = with.into_iter().map(|number| free[number].key.clone()).collect();
        let key = if coordinate < ECCENTRICITY {
            free[level].key.clone()
        } else {
            FaultId::Eccentricity.symbol().to_owned()
        };
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
            ambiguous(&fitted, &Whitener::white(1.0))
        };
        let key = structure.free[number].key.clone();
        assert_eq!(answer(0.1, 10.0), [("k1".to_owned(), vec![key])]);
        assert!(answer(0.3, 10.0).is_empty());
        assert!(answer(0.1, 0.1).is_empty());
    }
}
