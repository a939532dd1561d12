//! The end of a run whose shaft is driven away.
//!
//! Supply and back-EMF hold the speed of a machine, and so does the time that its motor has. What
//! feeds the motion knows no such end; where the speed has gone far beyond what the machine could
//! make, the run ends and says so.

use core::fmt;

use crate::{
    effect::{Effect, EffectId, Geometry},
    error::{SimulationError, Told},
    fault::PhysicalFaults,
    load::Load,
    params::Actuator,
    scenario::Scenario,
};

/// Speeds of an actuator over the one at which its back-EMF is all of the supply. Without
/// effects none goes beyond that one but by its load and its start, which are added; the air gap
/// and a weaker magnet (E14) let it rise by up to twenty and ten times.
const OVER_NO_LOAD: f64 = 100.0;
/// Speeds of an axis over what its drive, its offset and its load make together in the whole
/// test, a bound by Newton's law that no friction and no controller raises.
const OVER_IMPULSE: f64 = 10.0;

/// A run that ended early, since its shaft went beyond any speed that the machine could make.
#[derive(Clone, Debug, PartialEq)]
pub struct Runaway {
    /// When, from the start of the test.
    pub time_s: f64,
    /// Speed of the motor then, rad/s, of a linear axis m/s.
    pub speed: f64,
    /// Speed beyond which a run ends: of an actuator a hundred times the one at which its
    /// back-EMF is all of its supply, of an axis ten times what its drive, offset and load make
    /// in the whole test; start and load are added to the former.
    pub most: f64,
    /// Unit of both.
    pub geometry: Geometry,
    /// The effects of the model that can put energy into the motion, in its order.
    pub feeding: Vec<EffectId>,
}

impl fmt::Display for Runaway {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = match self.geometry {
            Geometry::Rotary => "rad/s",
            Geometry::Linear => "m/s",
        };
        let [time_s, speed, most] = [self.time_s, self.speed, self.most].map(brief);
        write!(
            f,
            "the machine is driven away: {speed} {unit} at {time_s} s, beyond the {most} {unit} \
             that its drive and load could ever make; "
        )?;
        let Some((last, others)) = self.feeding.split_last() else {
            return write!(
                f,
                "no effect of the model feeds the motion: loop, load or parameters are unstable, \
                 or an effect is too strong to be followed"
            );
        };
        for id in others {
            write!(f, "{}, ", Named(*id))?;
        }
        write!(f, "{} can feed the motion", Named(*last))
    }
}

/// A number to four digits.
fn brief(x: f64) -> Told {
    if x == 0.0 || !x.is_finite() {
        return Told(x);
    }
    // by a whole power, so that the digits stay decimal ones
    let exponent = 3 - libm::floor(libm::log10(x.abs())) as i32;
    let scale = libm::pow(10.0, f64::from(exponent.abs()));
    Told(if exponent < 0 { libm::round(x / scale) * scale } else { libm::round(x * scale) / scale })
}

/// An effect as a message calls it.
struct Named(EffectId);

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.0.info().symbol, self.0.info().name)
    }
}

/// A trace that knows whether its run came to its end.
pub(crate) trait Ended: Sized {
    /// Why it did not.
    fn runaway(&self) -> Option<&Runaway>;

    /// All its channels.
    fn channels(&mut self) -> Vec<&mut Vec<f64>>;

    /// With NaN where a run that ended early has no samples, so that nothing takes it for whole.
    fn filled(mut self, samples: usize) -> Self {
        if self.runaway().is_some() {
            for channel in self.channels() {
                channel.resize(samples, f64::NAN);
            }
        }
        self
    }

    /// The trace of a whole run.
    fn whole(self) -> Result<Self, SimulationError> {
        match self.runaway() {
            Some(runaway) => Err(SimulationError::Runaway(Box::new(runaway.clone()))),
            None => Ok(self),
        }
    }
}

/// Looks after the speed of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpeedGuard {
    most: f64,
    /// Time and speed at which it went beyond.
    passed: Option<(f64, f64)>,
}

impl SpeedGuard {
    /// None at all.
    pub(crate) const OFF: Self = Self { most: f64::MAX, passed: None };

    /// Of an actuator in a test.
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

    /// Of an axis: speed at the start, largest force of drive, offset and load, inertia, time.
    pub(crate) fn of_axis(start: f64, force: f64, inertia: f64, duration_s: f64) -> Self {
        Self { most: OVER_IMPULSE * (start.abs() + force * duration_s / inertia), passed: None }
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

    /// Whether it has gone beyond.
    #[inline]
    pub(crate) fn has_passed(&self) -> bool {
        self.passed.is_some()
    }

    /// What to tell of it.
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
