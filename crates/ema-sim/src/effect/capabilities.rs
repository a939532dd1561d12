//! Facts of a model and its machine by which effects are taken or refused.

use crate::effect::{number::Limit, quantity::Geometry};

/// Reason of a refusal that several effects give: a drive without voltage.
pub(crate) const NO_VOLTAGE: &str =
    "the drive regulates the current, and its voltage is not modelled";
/// Reason of a refusal that several effects give: an axis without commutation.
pub(crate) const NO_COMMUTATION: &str = "the axis has no commutation";
/// Reason of a refusal that several effects give: a drive without sectors.
pub(crate) const NO_SECTORS: &str = "a field-oriented drive has no sectors";

/// How a machine is commutated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Commutated {
    /// An axis: not modelled.
    Not,
    /// Two phases conduct in each of six sectors.
    BySectors,
    /// The current is held in quadrature to the rotor.
    Smoothly,
}

/// Legs of the inverter, in a model that has some.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Legs {
    /// Switched by a carrier.
    Switched {
        /// Dead time of each change.
        dead_s: f64,
        /// Voltage lost over dead time.
        lost_v_per_s: f64,
        /// Longest dead time that the model follows.
        most_dead_s: f64,
    },
    /// At their averages, without a carrier.
    Averaged,
    /// Switched by comparators on the phases.
    Compared,
}

/// How the winding is modelled.
#[derive(Clone, Copy, Debug)]
pub(crate) enum WindingModel {
    /// A drive makes the current, and no voltage is modelled.
    Regulated,
    /// The current follows the voltage at once.
    Quasistatic,
    /// Phases with their inductance, behind an inverter.
    Phases {
        legs: Legs,
        /// True for a back-EMF that is a trapezoid.
        trapezoidal: bool,
    },
}

/// A model of a machine, as far as effects depend on it.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
pub(crate) struct ModelCapabilities {
    /// The model as errors call it.
    pub(crate) name: &'static str,
    pub(crate) geometry: Geometry,
    pub(crate) commutated: Commutated,
    pub(crate) winding: WindingModel,
    /// True where the position loop is closed on the motor's shaft.
    pub(crate) encoder_on_motor: bool,
    /// True where the surface has dry friction of its own.
    pub(crate) surface_rubs: bool,
    /// Inertia of which the load's is a part that an effect has to give; none where the machine
    /// knows its own.
    pub(crate) undivided_inertia: Option<f64>,
    /// Gains of the controller: position, speed, integral of the speed.
    pub(crate) gains: [f64; 3],
    /// True where the machine itself has dry friction.
    pub(crate) dry_friction: bool,
    /// True where an effect of the model adds dry friction.
    pub(crate) rubbing_effect: bool,
    /// True where the current is recorded.
    pub(crate) current_recorded: bool,
    pub(crate) admissible: AdmissibleSize,
}

/// Torque that an effect may have, over what the motor makes at its limit.
const MOST_OVER_PEAK: f64 = 100.0;

/// Largest sizes of effects on a machine.
///
/// The catalogue bounds a number for any machine. On a given one a torque far beyond the motor's,
/// or a drag or spring that the controller's tick is too long for, drives the shaft where no
/// series of a segment holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdmissibleSize {
    /// Torque on the moving shaft.
    pub(crate) torque: f64,
    /// Drag, `J/T`.
    pub(crate) drag: f64,
    /// Torque on the shaft over the surface's position, `J·i_g/T²`.
    pub(crate) spring: f64,
    /// Torque over position at the stop; infinite where nothing stops the surface.
    pub(crate) spring_at_stop: f64,
    /// Largest voltage on the winding.
    pub(crate) supply_v: f64,
    /// Largest output of the controller, mostly a current.
    pub(crate) output: f64,
}

/// Numbers of a machine from which its admissible sizes follow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SizingData {
    /// Torque of the motor at the controller's limit.
    pub(crate) peak_torque: f64,
    /// Inertia at the motor.
    pub(crate) inertia: f64,
    pub(crate) gear_ratio: f64,
    /// Tick of the controller.
    pub(crate) tick_s: f64,
    /// Stop of the surface.
    pub(crate) stop_rad: Option<f64>,
    pub(crate) supply_v: f64,
    /// Largest output of the controller.
    pub(crate) output: f64,
}

const SUPPLY: &str = "all of its supply";
const OUTPUT: &str = "all that its controller asks for";
const TORQUE: &str = "a hundred times what its motor makes";
const DRAG: &str = "the inertia over the controller's tick";
const SPRING: &str = "the inertia over the square of the controller's tick";
const SPRING_AT_STOP: &str = "at the stop a hundred times what its motor makes";

/// A bound on a size of either sign, and what sets it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bound {
    pub(crate) most: f64,
    pub(crate) reason: &'static str,
}

impl AdmissibleSize {
    /// The largest sizes on a machine.
    pub(crate) fn new(data: &SizingData) -> Self {
        let torque = MOST_OVER_PEAK * data.peak_torque;
        Self {
            torque,
            drag: data.inertia / data.tick_s,
            spring: data.inertia * data.gear_ratio / (data.tick_s * data.tick_s),
            spring_at_stop: data.stop_rad.map_or(f64::INFINITY, |stop| torque / stop),
            supply_v: data.supply_v,
            output: data.output,
        }
    }

    /// The bound on a torque.
    pub(crate) fn torque_bound(&self) -> Bound {
        Bound { most: self.torque, reason: TORQUE }
    }

    /// The bound that a size breaks, if any.
    pub(crate) fn broken(&self, limit: Limit, size: f64) -> Option<Bound> {
        let bound = |most, reason| Bound { most, reason };
        let bounds = match limit {
            Limit::Catalogue => return None,
            Limit::Torque => [self.torque_bound(); 2],
            Limit::Drag => [bound(self.drag, DRAG); 2],
            Limit::Spring => {
                [bound(self.spring, SPRING), bound(self.spring_at_stop, SPRING_AT_STOP)]
            }
            Limit::Supply => [bound(self.supply_v, SUPPLY); 2],
            Limit::ControllerOutput => [bound(self.output, OUTPUT); 2],
        };
        // its bounds in the catalogue have made sure that the size is finite
        bounds.into_iter().find(|bound| size.abs() > bound.most)
    }
}
