//! Laws of effects for many runs at once.
#![expect(
    clippy::inline_always,
    reason = "the loop is compiled once for each instruction set, which inlining makes possible"
)]

use pulp::NullaryFnOnce;

use crate::{
    effect::{
        catalogue::{self, EffectId},
        law::{EffectLaw, Function, Given},
        number::MOST_PARAMETERS,
        quantity::Geometry,
        shaft_load::{Moment, ShaftLoad},
    },
    lane_exp::exp_of_lanes,
    lane_sine::sincos_of_lanes,
    vectors::Vectors,
    wide::Wide,
};

/// An effect that acts in all lanes, with numbers of its own in each.
#[derive(Clone, Debug)]
pub(crate) struct EffectLanes<const N: usize> {
    id: EffectId,
    geometry: Geometry,
    values: [[f64; MOST_PARAMETERS]; N],
}

impl<const N: usize> EffectLanes<N> {
    /// No numbers yet.
    pub(crate) fn new(id: EffectId, geometry: Geometry) -> Self {
        Self { id, geometry, values: [[0.0; MOST_PARAMETERS]; N] }
    }

    /// Takes over the numbers of a lane.
    pub(crate) fn put(&mut self, lane: usize, values: &[f64; MOST_PARAMETERS]) {
        self.values[lane] = *values;
    }

    /// The numbers of a lane.
    #[inline(always)]
    pub(crate) fn given(&self, lane: usize) -> Given<'_> {
        Given { values: &self.values[lane], curve: None, geometry: self.geometry }
    }
}

/// [`Moment`] of each lane.
#[derive(Clone, Debug)]
pub(crate) struct Moments<const N: usize> {
    pub(crate) motor_rad: Wide<N>,
    pub(crate) speed_rad_per_s: Wide<N>,
    pub(crate) position_rad: Wide<N>,
    pub(crate) time_s: Wide<N>,
    pub(crate) motor_n_m: Wide<N>,
    pub(crate) load_n_m: Wide<N>,
    pub(crate) per_gear_ratio: Wide<N>,
    pub(crate) since_commutation_s: Wide<N>,
}

impl<const N: usize> Moments<N> {
    pub(crate) fn none() -> Self {
        let zero = [0.0; N];
        Self {
            motor_rad: zero,
            speed_rad_per_s: zero,
            position_rad: zero,
            time_s: zero,
            motor_n_m: zero,
            load_n_m: zero,
            per_gear_ratio: zero,
            since_commutation_s: zero,
        }
    }

    #[inline(always)]
    pub(crate) fn of(&self, lane: usize) -> Moment {
        Moment {
            motor_rad: self.motor_rad[lane],
            speed_rad_per_s: self.speed_rad_per_s[lane],
            position_rad: self.position_rad[lane],
            time_s: self.time_s[lane],
            motor_n_m: self.motor_n_m[lane],
            load_n_m: self.load_n_m[lane],
            per_gear_ratio: self.per_gear_ratio[lane],
            since_commutation_s: self.since_commutation_s[lane],
        }
    }
}

/// [`ShaftLoad`] of each lane.
#[derive(Clone, Debug)]
pub(crate) struct ShaftLoads<const N: usize> {
    pub(crate) against_n_m: Wide<N>,
    friction_ratio: Wide<N>,
    dry_n_m: [[Wide<N>; 2]; 2],
}

impl<const N: usize> ShaftLoads<N> {
    /// The loads without effects.
    #[inline(always)]
    pub(crate) fn new(against_n_m: Wide<N>) -> Self {
        Self { against_n_m, friction_ratio: [1.0; N], dry_n_m: [[[0.0; N]; 2]; 2] }
    }

    #[inline(always)]
    pub(crate) fn of(&self, lane: usize) -> ShaftLoad {
        let [[a, b], [c, d]] = &self.dry_n_m;
        ShaftLoad {
            against_n_m: self.against_n_m[lane],
            friction_ratio: self.friction_ratio[lane],
            dry_n_m: [[a[lane], b[lane]], [c[lane], d[lane]]],
        }
    }

    #[inline(always)]
    pub(crate) fn put(&mut self, lane: usize, load: &ShaftLoad) {
        self.against_n_m[lane] = load.against_n_m;
        self.friction_ratio[lane] = load.friction_ratio;
        for (wide, of) in
            self.dry_n_m.as_flattened_mut().iter_mut().zip(load.dry_n_m.as_flattened())
        {
            wide[lane] = *of;
        }
    }
}

/// Adds what an effect does to the loads of all lanes.
pub(crate) struct Adding<'a, const N: usize> {
    pub(crate) effect: &'a EffectLanes<N>,
    pub(crate) at: &'a Moments<N>,
    pub(crate) loads: &'a mut ShaftLoads<N>,
}

impl<const N: usize> Adding<'_, N> {
    /// Adds with the widest vectors. Apart from the loops of runs, whose code the whole catalogue
    /// would multiply.
    #[inline(never)]
    pub(crate) fn by(self, vectors: Vectors) {
        vectors.run(self);
    }
}

impl<const N: usize> NullaryFnOnce for Adding<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        catalogue::add_in_lanes(self.effect.id, self.effect, self.at, self.loads);
    }
}

/// Adds what a law does in each lane.
#[inline(always)]
pub(super) fn add<const N: usize, L: EffectLaw>(
    law: impl Fn(usize) -> L,
    at: &Moments<N>,
    loads: &mut ShaftLoads<N>,
) {
    let arguments: Wide<N> = core::array::from_fn(|lane| law(lane).argument(&at.of(lane)));
    let [first, second] = match law(0).function() {
        Function::None => [[0.0; N]; 2],
        Function::Sine => sincos_of_lanes(&arguments),
        Function::Exponential => [exp_of_lanes(&arguments), [0.0; N]],
    };
    for lane in 0..N {
        let mut load = loads.of(lane);
        law(lane).load(&at.of(lane), [first[lane], second[lane]], &mut load);
        loads.put(lane, &load);
    }
}
