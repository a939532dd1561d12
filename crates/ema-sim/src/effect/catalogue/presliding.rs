//! E05, elastic motion before sliding.

use libm::sqrt;

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, MOST, Range, Role, Size, Trials, number, numbers, size},
    part::{LONGEST_PHASE_RAD, Parts, bristles::Bristles},
    quantity::Quantity,
};

numbers! {
    /// Numbers of presliding.
    Presliding {
        /// Deflection at which the kinetic friction is reached.
        distance: size(
            ["presliding_rad", "presliding_m"],
            Quantity::Angle,
            Size {
                least: 0.0,
                most: 1.0,
                typical: |s| 3e-3 * s.motor_travel,
                limit: Limit::Catalogue,
            },
            "z_0, deflection at which the kinetic friction is reached",
        ),
        damping: number(
            ["bristle_damping_n_m_s_per_rad", "bristle_damping_n_s_per_m"],
            Quantity::Drag,
            Range { defaults: [0.0, 0.0], least: 0.0, most: MOST },
            Role::Shape(&[]),
            "σ1",
        )
        .limited_by(Limit::Drag),
        stribeck_speed: number(
            ["stribeck_speed_rad_per_s", "stribeck_speed_m_per_s"],
            Quantity::Speed,
            Range { defaults: [1.0, 0.005], least: 1e-6, most: 1e6 },
            Role::Shape(&[0.3, 1.0, 3.0]),
            "ω_s",
        )
        .tried(Trials::OfSpeed(&[0.1])),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E05",
    name: "presliding",
    port: Port::MotorTorque,
    class: EffectClass::MicroMotion,
    equation: "T = σ0·z + σ1·z', z' = ω − |ω|·σ0·z/g(ω), σ0 = F_d/z_0, \
               g = F_d + (F_s − F_d)·exp(−(ω/ω_s)²); in place of the dry friction",
    parameters: Presliding::NUMBERS,
    mimics: "k2",
    separated_by: "small reversals",
    source: "LuGre (Canudas de Wit et al. 1995), as in the MuJoCo DC motor technical note",
    repetition: Repetition::Once,
    differs_by_recording: false,
    // a softness: the smaller, the shorter the steps of the simulation
    nonlinear_in_size: true,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

const NO_FRICTION: &str = "the machine has no dry friction that it could change";

impl EffectLaw for Presliding {
    fn refusal(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn idle(&self, model: &ModelCapabilities) -> Option<&'static str> {
        (!model.dry_friction && !model.rubbing_effect).then_some(NO_FRICTION)
    }

    fn can_feed(&self) -> bool {
        false
    }

    fn rubs(&self) -> bool {
        false
    }

    fn install(&self, parts: &mut Parts) {
        let stiffness = parts.friction_n_m[0] / self.distance;
        // the bristles and the inertia swing at this rate
        let swing = sqrt(stiffness / parts.machine.inertia_kg_m2);
        parts.bristles = Some(Bristles {
            distance_rad: self.distance,
            damping: self.damping,
            stribeck_rad_per_s: self.stribeck_speed,
            deflection_rad: 0.0,
            level_n_m: parts.friction_n_m,
            longest_s: LONGEST_PHASE_RAD / swing,
            longest_rad: 0.25 * self.distance,
        });
    }
}
