//! The table of effects: one line each, and one file each beside it.
//!
//! Torques are against positive motion. `s` is the sign of the speed, `ω` the speed and `θ_m`
//! the angle of the motor, `θ` the position of the surface; of a servo axis all are its own,
//! and of a linear one torques are forces and angles lengths.

use crate::effect::{
    info::EffectInfo,
    lanes::{self, EffectLanes, Moments, ShaftLoads},
    law::{self, EffectLaw, Given},
    shaft_load::{Moment, ShaftLoad},
};

/// Makes of the table the modules, the identities, the descriptions and the ways to the laws.
macro_rules! effects {
    ($($file:ident: $id:ident, $doc:literal;)*) => {
        $(mod $file;)*

        /// Identity of an effect.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum EffectId {
            $(#[doc = $doc] $id,)*
        }

        impl EffectId {
            /// All effects, in the order of the catalogue.
            pub const ALL: [Self; INFOS.len()] = [$(Self::$id),*];
        }

        static INFOS: [&EffectInfo; [$(stringify!($id)),*].len()] = [$(&$file::INFO),*];

        /// Gives the law of an effect to a function.
        pub(crate) fn with_law<T>(
            id: EffectId,
            given: &Given<'_>,
            then: impl FnOnce(&dyn EffectLaw) -> T,
        ) -> T {
            match id {
                $(EffectId::$id => then(&$file::$id::of(given)),)*
            }
        }

        /// Adds what an effect does on the moving shaft; called in each segment of a run.
        #[inline]
        pub(crate) fn load(id: EffectId, given: &Given<'_>, at: &Moment, shaft: &mut ShaftLoad) {
            match id {
                $(EffectId::$id => law::add(&$file::$id::of(given), at, shaft),)*
            }
        }

        /// Adds what an effect does in many runs at once.
        #[inline(always)]
        pub(crate) fn add_in_lanes<const N: usize>(
            id: EffectId,
            effect: &EffectLanes<N>,
            at: &Moments<N>,
            loads: &mut ShaftLoads<N>,
        ) {
            match id {
                $(EffectId::$id => {
                    lanes::add(|lane| $file::$id::of(&effect.given(lane)), at, loads);
                })*
            }
        }
    };
}

effects! {
    stribeck: Stribeck, "`E01`, friction that falls with speed.";
    nonlinear_viscous: NonlinearViscous, "`E02`, friction with a power of speed.";
    directional_friction: DirectionalFriction, "`E03`, friction that differs between the directions.";
    load_friction: LoadFriction, "`E04`, friction with the torque passed on.";
    presliding: Presliding, "`E05`, elastic motion before sliding.";
    worn_region: WornRegion, "`E06`, friction of a worn region.";
    friction_drift: FrictionDrift, "`E07`, friction that falls as the machine warms.";
    compliance: Compliance, "`E08`, elastic shaft between motor and surface.";
    transmission_error: TransmissionError, "`E09`, error of the gear's ratio over the turn.";
    imbalance: Imbalance, "`E10`, gravity, imbalance, springs.";
    cogging: Cogging, "`E11`, torque of a fixed order of the motor angle.";
    current_ripple: CurrentRipple, "`E12`, torque ripple with the current.";
    saturation: Saturation, "`E13`, torque constant that falls with current.";
    magnet_loss: MagnetLoss, "`E14`, torque constant lower than thought.";
    resistance_drift: ResistanceDrift, "`E15`, resistance that rises with temperature.";
    inductance_eddy: InductanceEddy, "`E16`, inductance and eddy currents.";
    dead_time: DeadTime, "`E17`, voltage lost in the inverter.";
    bus_sag: BusSag, "`E18`, supply that sags with current.";
    current_sensor: CurrentSensor, "`E19`, gain, offset and lag of the current sensor.";
    position_sensor: PositionSensor, "`E20`, lag, eccentricity and steps of the position sensor.";
    controller_mismatch: ControllerMismatch, "`E21`, gains, limit and delay of the controller.";
    vibration: Vibration, "`E22`, load of a fixed frequency.";
    back_emf_shape: BackEmfShape, "`E23`, shape of the back-EMF.";
    commutation_overlap: CommutationOverlap, "`E24`, torque missing after commutation.";
    hall_offset: HallOffset, "`E25`, commutation at a wrong angle.";
    tabulated: Tabulated, "`U`, a measured curve without a cause.";
}

impl EffectId {
    /// The effect of a catalogue symbol, `E` and a number or `U`.
    pub fn find(symbol: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|id| id.info().symbol == symbol)
    }

    /// Description of the effect.
    pub fn info(self) -> &'static EffectInfo {
        INFOS[self as usize]
    }
}
