//! E08, elastic shaft between motor and surface.

use libm::sqrt;

use crate::effect::{
    capabilities::ModelCapabilities,
    info::{EffectClass, EffectInfo, LoopPart, Port, Repetition},
    law::EffectLaw,
    number::{Limit, MOST, Range, Role, Size, Trials, number, numbers, size},
    part::{Parts, SHORTEST_RATIO, elastic_shaft::ElasticShaft},
    quantity::Quantity,
};

numbers! {
    /// Numbers of torsional compliance.
    Compliance {
        softness: size(
            ["compliance_rad_per_n_m", "compliance_m_per_n"],
            Quantity::Compliance,
            Size {
                least: 0.0,
                most: 1.0,
                // a twist of a thousandth of the travel under the usual torque
                typical: |s| 1e-3 * s.travel / s.positive_torque(),
                limit: Limit::Catalogue,
            },
            "κ",
        ),
        damping: number(
            ["damping_n_m_s_per_rad", "damping_n_s_per_m"],
            Quantity::Drag,
            Range { defaults: [0.0, 0.0], least: 0.0, most: MOST },
            Role::Shape(&[]),
            "c",
        ),
        /// Inertia of the load; zero for the machine's own.
        load_inertia: number(
            ["load_inertia_kg_m2", "load_mass_kg"],
            Quantity::Inertia,
            Range { defaults: [0.0, 0.0], least: 0.0, most: MOST },
            Role::Shape(&[]),
            "J_u; 0 takes the surface's own, which a servo axis does not have",
        )
        .tried(Trials::OfInertia(&[0.3, 0.6])),
    }
}

pub(super) const INFO: EffectInfo = EffectInfo {
    symbol: "E08",
    name: "torsional compliance",
    port: Port::Transmission,
    class: EffectClass::Transmission,
    equation: "J_u·θ'' = τ − T_load, τ = d/κ + c·d', d the twist beyond the backlash",
    parameters: Compliance::NUMBERS,
    mimics: "k2",
    separated_by: "an encoder at the output, a chirp through the resonance",
    source: "motulator, two-mass mechanics; MSL ElastoBacklash",
    repetition: Repetition::Once,
    differs_by_recording: false,
    // a softness: the smaller, the shorter the steps of the simulation
    nonlinear_in_size: true,
    acts_through: LoopPart::Machine,
    takes_curve: false,
};

const RUBBING_SURFACE: &str = "the friction of the surface is not modelled behind a spring";
const UNDIVIDED: &str = "the load's inertia is to be given, a part of the axis'";

/// Phase of the elastic shaft's swing that a segment covers at most.
const LONGEST_SWING_RAD: f64 = 0.05;
/// Share of the elastic shaft's time of decay that a segment covers at most.
const LONGEST_DECAY: f64 = 0.2;
/// Least share of the whole inertia that stays on the motor's side.
const LEAST_MOTOR_SHARE: f64 = 1e-6;
/// Least inertia of a load, kg·m² or kg.
const LEAST_INERTIA: f64 = 1e-12;

impl Compliance {
    /// Inertia of the load, and the one that is left to the motor.
    fn divided(&self, parts: &Parts) -> [f64; 2] {
        let machine = &parts.machine;
        let r = machine.per_gear_ratio;
        let given = self.load_inertia > 0.0;
        let load = if given { self.load_inertia } else { machine.load_inertia_kg_m2 };
        let reflected = load * r * r;
        let motor = if given && machine.load_inertia_kg_m2 == 0.0 {
            machine.inertia_kg_m2 - reflected
        } else {
            let own = machine.load_inertia_kg_m2 * r * r;
            machine.inertia_kg_m2 - own
        };
        [load.max(LEAST_INERTIA), motor.max(LEAST_MOTOR_SHARE * machine.inertia_kg_m2)]
    }
}

impl EffectLaw for Compliance {
    fn refusal(&self, model: &ModelCapabilities) -> Option<&'static str> {
        if model.surface_rubs {
            return Some(RUBBING_SURFACE);
        }
        let whole = model.undivided_inertia?;
        let outside = self.load_inertia <= 0.0 || self.load_inertia >= whole;
        outside.then_some(UNDIVIDED)
    }

    fn idle(&self, _: &ModelCapabilities) -> Option<&'static str> {
        None
    }

    fn can_feed(&self) -> bool {
        false
    }

    fn rubs(&self) -> bool {
        false
    }

    /// Sets the surface free of the motor's shaft and ties it by a spring.
    fn install(&self, parts: &mut Parts) {
        let [inertia, motor_inertia] = self.divided(parts);
        let machine = parts.machine;
        let motor_at_surface = motor_inertia / (machine.per_gear_ratio * machine.per_gear_ratio);
        // a shaft that the shortest segments cannot follow is as good as rigid
        let per_mass = 1.0 / inertia + 1.0 / motor_at_surface;
        let fastest = LONGEST_SWING_RAD / (SHORTEST_RATIO * machine.tick_s);
        let stiffness = (1.0 / self.softness).min(fastest * fastest / per_mass);
        let swing = sqrt(stiffness * per_mass);
        parts.bound_span_s(LONGEST_SWING_RAD / swing);
        let most_damping = LONGEST_DECAY / (SHORTEST_RATIO * machine.tick_s * per_mass);
        let damping = self.damping.min(most_damping);
        parts.bound_span_s(LONGEST_DECAY / (damping * per_mass).max(1e-9));
        parts.motor_inertia_kg_m2 = motor_inertia;
        parts.elastic_shaft = Some(ElasticShaft {
            stiffness,
            damping,
            inertia,
            half_play_rad: machine.half_play_rad,
            efficiency_ratio: machine.efficiency_ratio,
            // as the drive train stands where the surface is taken off it
            angle_rad: 0.0,
            speed_rad_per_s: 0.0,
            load_n_m: 0.0,
            followed: false,
        });
    }
}
