//! Intervals of fault levels and of sizes of effects.

use core::cmp::Ordering;

use ema_sim::FaultId;
use nalgebra::{DMatrix, Matrix2, Vector2};

use crate::{
    explained::{FaultLevel, NumberInterval},
    fit::Fitted,
    structure::{Free, Target},
};

/// Standard deviations to either end of a 95 % interval.
pub(crate) const Z_95: f64 = 1.96;
/// Bound of the squared length of a standard normal vector of two in 95 %: −2·ln 0.05.
const CHI_SQUARED_2_95: f64 = 5.991_464_547_107_98;
/// Place of the first of the two coordinates of an eccentricity.
const ECCENTRICITY: usize = 5;

/// Fault levels; of an eccentricity its amount, whatever its direction.
pub(crate) fn levels(fitted: &Fitted, covariance: &DMatrix<f64>) -> Vec<(String, FaultLevel)> {
    let of = |(p, free): (usize, &Free)| {
        let Target::Fault(place) = free.target else { return None };
        match place.cmp(&ECCENTRICITY) {
            Ordering::Less => {
                let std = libm::sqrt(covariance[(p, p)].max(0.0));
                Some((level_key(place, free), level(fitted.values[p], std)))
            }
            Ordering::Equal => {
                let parts = [fitted.values[p], fitted.values[p + 1]];
                let covariance = covariance.fixed_view::<2, 2>(p, p);
                Some((level_key(place, free), amount(parts, &covariance.into_owned())))
            }
            Ordering::Greater => None,
        }
    };
    fitted.structure.free.iter().enumerate().filter_map(of).collect()
}

/// Key of the level that a coordinate of damage belongs to: of both of an eccentricity its amount.
pub(crate) fn level_key(coordinate: usize, free: &Free) -> String {
    let is_alone = coordinate < ECCENTRICITY;
    if is_alone { free.key.clone() } else { FaultId::Eccentricity.symbol().to_owned() }
}

/// A level that lies between 0 and 1.
fn level(value: f64, std: f64) -> FaultLevel {
    // two components within 1 may be longer together
    let end = |z: f64| (value + z * std).clamp(0.0, value.max(1.0));
    FaultLevel { value, std, interval_95: [end(-Z_95), end(Z_95)] }
}

/// The length of a vector, with the standard deviation along it. Noise alone gives it some length,
/// in a direction of its own (Rayleigh's distribution): where the vector is zero within 95 %, so is
/// its length.
fn amount(parts: [f64; 2], covariance: &Matrix2<f64>) -> FaultLevel {
    let vector = Vector2::from(parts);
    let length = vector.norm();
    let along = if length > 0.0 { vector / length } else { Vector2::x() };
    let std = libm::sqrt(along.dot(&(covariance * along)).max(0.0));
    let mut amount = level(length, std);
    let is_none = covariance
        .try_inverse()
        .is_none_or(|information| vector.dot(&(information * vector)) <= CHI_SQUARED_2_95);
    if is_none {
        amount.interval_95[0] = 0.0;
    }
    amount
}

/// Moves the interval of the only size of an effect off zero where the fit speaks against none, by the
/// fall of the objective without the effect: beside a shape that leaves open how large the size is,
/// slopes take it for none. The root of the fall is taken to be straight over the size.
pub(crate) fn hold_off_zero(
    intervals: &mut [NumberInterval],
    fitted: &Fitted,
    effect: usize,
    fall_nats: f64,
) {
    let structure = &fitted.structure;
    let stds = libm::sqrt(2.0 * fall_nats.max(0.0));
    let &[size] = &structure.sizes_of_effect(effect)[..] else { return };
    if stds <= Z_95 {
        return;
    }
    let (value, key) = (fitted.values[size], &structure.free[size].key);
    let end = value * (1.0 - Z_95 / stds);
    for interval in intervals.iter_mut().filter(|interval| interval.key == *key) {
        let [low, high] = &mut interval.interval_95;
        if *low <= 0.0 && *high >= 0.0 {
            *(if value > 0.0 { low } else { high }) = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use ema_sim::{Effect, EffectId};
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};

    use super::*;
    use crate::{
        explain::tests::nothing_recorded,
        random::normal,
        rival::Judged,
        structure::{Number, Structure},
    };

    /// Intervals of an amount hold it in 95 % at least, also where there is none: there the plain
    /// one of 1.96 standard deviations would in 85 %.
    #[test]
    fn law_the_interval_of_an_amount_holds_it() {
        let covariance = Matrix2::new(1e-6, 0.0, 0.0, 1e-6);
        let mut random = ChaCha8Rng::seed_from_u64(11);
        for truth in [0.0, 0.001, 0.002, 0.01] {
            let mut held = 0;
            for _ in 0..4000 {
                let parts = [truth + 1e-3 * normal(&mut random), 1e-3 * normal(&mut random)];
                let [low, high] = amount(parts, &covariance).interval_95;
                held += u32::from((low..=high).contains(&truth));
            }
            let share = f64::from(held) / 4000.0;
            assert!((0.935..0.995).contains(&share), "{truth}: {share}");
        }
    }

    /// A drop of friction whose time is open may be of any size, but not of none.
    #[test]
    fn a_size_that_the_fit_asks_for_is_not_zero() {
        let (machine, ..) = nothing_recorded();
        let drop = Effect::new(EffectId::FrictionDrift, machine.geometry());
        let number = |place| Number { place, in_record: None, step: 1.0, least: -9.0, most: 9.0 };
        let structure = Structure::nominal(&machine).with_effect(drop, &[number(0), number(1)]);
        let sized = |size: f64, interval_95: [f64; 2], fall: f64| {
            let mut values = structure.starts();
            values[structure.sizes_of_effect(0)[0]] = size;
            let stds = vec![0.0; values.len()];
            let judged = Judged::at(structure.clone(), values, stds, 0.0);
            let key = "friction_drop_ratio".to_owned();
            let mut intervals = [NumberInterval { key, interval_95 }];
            hold_off_zero(&mut intervals, &judged.fitted, 0, fall);
            intervals[0].interval_95
        };
        let near = |size: f64, fall: f64| size * (1.0 - Z_95 / libm::sqrt(2.0 * fall));
        assert_eq!(sized(-0.1, [-0.3, 0.1], 180.0), [-0.3, near(-0.1, 180.0)]);
        assert_eq!(sized(0.1, [-0.1, 0.3], 180.0), [near(0.1, 180.0), 0.3]);
        assert_eq!(sized(0.1, [0.05, 0.15], 180.0), [0.05, 0.15]);
        assert_eq!(sized(0.1, [-0.1, 0.3], 1.0), [-0.1, 0.3]);
    }

    #[test]
    fn a_level_stays_within_what_it_can_be() {
        assert_eq!(level(0.001, 0.001).interval_95, [0.0, 0.001 + Z_95 * 0.001]);
        assert_eq!(level(0.999, 0.01).interval_95[1], 1.0);
    }
}
