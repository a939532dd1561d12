//! The bound on a run's speed, beyond which its shaft counts as driven away.
//!
//! Supply and back-EMF hold the speed of a machine, and so does the time that its motor has. An
//! effect that feeds the motion knows no such end; where the speed has gone far beyond any that
//! the machine could make, the run ends and says so.

use crate::{
    effect::{Effect, Geometry},
    fault::PhysicalFaults,
    load::Load,
    params::Actuator,
    runaway::Runaway,
    scenario::Scenario,
};

/// Speeds of an actuator over the one at which its back-EMF is all of the supply. Without
/// effects none goes beyond that one but by its load and its start, which are added; the air gap
/// and a weaker magnet (E14) let it rise by up to twenty and ten times.
const OVER_NO_LOAD: f64 = 100.0;
/// Speeds of an axis over what its drive, its offset and its load make together in the whole
/// test, a bound by Newton's law that no friction and no controller raises.
const OVER_IMPULSE: f64 = 10.0;

/// Looks after the speed of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpeedGuard {
    most: f64,
    /// Time and speed at which it went beyond.
    passed: Option<(f64, f64)>,
}

impl SpeedGuard {
    /// A guard that never trips.
    pub(crate) const OFF: Self = Self { most: f64::MAX, passed: None };

    /// The guard of an actuator in a test.
    pub(crate) fn of_actuator(
        actuator: &Actuator,
        scenario: &Scenario,
        faults: &PhysicalFaults,
        load: &Load,
    ) -> Self {
        let t = &actuator.transmission;
        let least_turns = faults.healthy_turns_frac.iter().copied().fold(1.0, f64::min);
        let no_load =
            actuator.equivalent_supply_v() / (actuator.torque_constant_n_m_per_a() * least_turns);
        // between two standstills the load works over the travel at most, the gear's loss added
        let load_n_m = scenario.load_n_m.abs() + load.most_n_m(t.stop_rad);
        let work_j = 2.0 * t.stop_rad * load_n_m / t.efficiency_ratio;
        let loaded = libm::sqrt(2.0 * work_j / actuator.motor.inertia_kg_m2);
        let start = scenario.initial.motor_speed_rad_per_s.abs();
        Self { most: OVER_NO_LOAD * no_load + loaded + start, passed: None }
    }

    /// The guard of an axis, from the speed at the start, the largest force of drive, offset and
    /// load, the inertia and the test's length.
    pub(crate) fn of_axis(start: f64, force: f64, inertia: f64, duration_s: f64) -> Self {
        Self { most: OVER_IMPULSE * (start.abs() + force * duration_s / inertia), passed: None }
    }

    /// Largest speed.
    pub(crate) fn most(&self) -> f64 {
        self.most
    }

    /// Looks at the speed at a time.
    #[inline]
    pub(crate) fn watch(&mut self, time_s: f64, speed: f64) {
        // a speed that is no number is beyond as well
        let within = speed.abs() <= self.most && speed.is_finite();
        if !within && self.passed.is_none() {
            self.passed = Some((time_s, speed));
        }
    }

    /// True once the speed has gone beyond the bound.
    #[inline]
    pub(crate) fn has_passed(&self) -> bool {
        self.passed.is_some()
    }

    /// The report of a speed beyond the bound, with the effects that can feed the motion.
    pub(crate) fn told(&self, effects: &[Effect], geometry: Geometry) -> Option<Runaway> {
        let (time_s, speed) = self.passed?;
        let mut feeding = Vec::new();
        for effect in effects.iter().filter(|effect| effect.can_feed()) {
            if !feeding.contains(&effect.id()) {
                feeding.push(effect.id());
            }
        }
        Some(Runaway { time_s, speed, most: self.most, geometry, feeding })
    }
}
