//! Particle swarm, carried by argmin. No other file names argmin.
//!
//! argmin's swarm holds a particle at a face of the box and leaves its velocity, so that it sticks
//! there. The box is therefore mirrored at its faces (and wrapped on circles), and the swarm
//! moves without walls. Figures: `docs/decisions/0110-argmin.md`.

use std::cell::RefCell;

use argmin::{
    core::{CostFunction, PopulationState, Problem, Solver, State},
    solver::particleswarm::{Particle, ParticleSwarm},
};
// its feature `vec` is argmin's arithmetic on `Vec<f64>`
use argmin_math as _;
use rand_xoshiro::{Xoshiro256PlusPlus, rand_core::SeedableRng};

use super::crowd::{Crowd, Ended};
use crate::random::{Purpose, Stream};

/// Largest first speed in each input, as a fraction of its interval.
const FIRST_SPEED: f64 = 0.5;

/// Half the width of the space that argmin clamps to, in intervals; no particle comes near it.
const OPEN: f64 = 1e6;

/// Moves until the crowd ends the run. Inertia and pulls are argmin's: `1/(2·ln 2)` and
/// `½ + ln 2`, those of the standard swarm.
pub(super) fn run<E, F>(crowd: &mut Crowd<'_, F>, members: usize) -> Ended<E>
where
    F: FnMut(&[f64]) -> Result<f64, E>,
{
    let d = crowd.dimension();
    let mut stream = Stream::new(crowd.options.seed, Purpose::Population, 0);
    let places = crowd.uniform(&mut stream, members);
    let values = match crowd.values(&places) {
        Ok(values) => values,
        Err(ended) => return ended,
    };
    let particles = places.into_iter().zip(values).map(|(place, value)| {
        let speed = (0..d).map(|_| stream.between(-FIRST_SPEED, FIRST_SPEED)).collect();
        Particle::new(place, value, speed)
    });
    let particles = particles.collect();
    let mut swarm = ParticleSwarm::new((vec![-OPEN; d], vec![OPEN; d]), members)
        .with_rng_generator(Xoshiro256PlusPlus::seed_from_u64(stream.word()));
    let mut problem =
        Problem::new(Mirrored { crowd: RefCell::new(crowd), ended: RefCell::new(None) });
    // without argmin's executor, which reads the clock
    let mut state = swarm.init(&mut problem, PopulationState::new().population(particles));
    while let Ok((reached, _)) = state {
        state = swarm.next_iter(&mut problem, reached);
    }
    let mirrored = problem.problem.expect("argmin keeps the problem that it was given");
    mirrored.ended.into_inner().expect("the swarm itself raises no error")
}

/// The crowd on the whole space. argmin carries errors that may cross threads; why the run
/// ended stays here.
struct Mirrored<'a, 'b, E, F> {
    crowd: RefCell<&'a mut Crowd<'b, F>>,
    ended: RefCell<Option<Ended<E>>>,
}

impl<E, F> CostFunction for Mirrored<'_, '_, E, F>
where
    F: FnMut(&[f64]) -> Result<f64, E>,
{
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, place: &Vec<f64>) -> Result<f64, argmin::core::Error> {
        let mut crowd = self.crowd.borrow_mut();
        let mirror = |u: f64| 1.0 - (u.rem_euclid(2.0) - 1.0).abs();
        let unit: Vec<f64> = (0..place.len())
            .map(
                |i| if crowd.bounds.wraps(i) { place[i].rem_euclid(1.0) } else { mirror(place[i]) },
            )
            .collect();
        crowd.value(&unit).map_err(|ended| {
            *self.ended.borrow_mut() = Some(ended);
            argmin::core::Error::msg("the run has ended")
        })
    }
}
