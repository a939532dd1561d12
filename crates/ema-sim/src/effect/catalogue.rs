//! The catalogue: every effect with its equation, numbers, look-alikes and source.
//!
//! Torques are against positive motion. `s` is the sign of the speed, `ω` the speed and `θ_m`
//! the angle of the motor, `θ` the position of the surface; of a servo axis all are its own,
//! and of a linear one torques are forces and angles lengths.

use super::{EffectClass, EffectInfo, EffectParameter, Port, Role};

/// Identity of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum EffectId {
    /// `E01`, friction that falls with speed.
    Stribeck,
    /// `E02`, friction with a power of speed.
    NonlinearViscous,
    /// `E03`, friction that differs between the directions.
    DirectionalFriction,
    /// `E04`, friction with the torque passed on.
    LoadFriction,
    /// `E05`, elastic motion before sliding.
    Presliding,
    /// `E06`, friction of a worn region.
    WornRegion,
    /// `E07`, friction that falls as the machine warms.
    FrictionDrift,
    /// `E08`, elastic shaft between motor and surface.
    Compliance,
    /// `E09`, error of the gear's ratio over the turn.
    TransmissionError,
    /// `E10`, gravity, imbalance, springs.
    Imbalance,
    /// `E11`, torque of a fixed order of the motor angle.
    Cogging,
    /// `E12`, torque ripple with the current.
    CurrentRipple,
    /// `E13`, torque constant that falls with current.
    Saturation,
    /// `E14`, torque constant lower than thought.
    MagnetLoss,
    /// `E15`, resistance that rises with temperature.
    ResistanceDrift,
    /// `E16`, inductance and eddy currents.
    InductanceEddy,
    /// `E17`, voltage lost in the inverter.
    DeadTime,
    /// `E18`, supply that sags with current.
    BusSag,
    /// `E19`, gain, offset and lag of the current sensor.
    CurrentSensor,
    /// `E20`, lag, eccentricity and steps of the position sensor.
    PositionSensor,
    /// `E21`, gains, limit and delay of the controller.
    ControllerMismatch,
    /// `E22`, load of a fixed frequency.
    Vibration,
    /// `E23`, shape of the back-EMF.
    BackEmfShape,
    /// `E24`, torque missing after commutation.
    CommutationOverlap,
    /// `E25`, commutation at a wrong angle.
    HallOffset,
    /// `U`, a measured curve without a cause.
    Tabulated,
}

pub(super) const MOST: f64 = 1e9;

/// A size: zero by default.
const fn size(
    rotary_key: &'static str,
    linear_key: &'static str,
    bounds: (f64, f64),
    meaning: &'static str,
) -> EffectParameter {
    number((rotary_key, linear_key), (0.0, 0.0), bounds, Role::Amplitude, meaning)
}

const fn number(
    (rotary_key, linear_key): (&'static str, &'static str),
    (rotary_default, linear_default): (f64, f64),
    (least, most): (f64, f64),
    role: Role,
    meaning: &'static str,
) -> EffectParameter {
    EffectParameter {
        rotary_key,
        linear_key,
        rotary_default,
        linear_default,
        least,
        most,
        role,
        meaning,
    }
}

/// Periods in a turn of the rotor; of a linear axis the wave number.
const fn order(default: f64) -> EffectParameter {
    let keys = ("order", "wavenumber_rad_per_m");
    number(keys, (default, default), (0.0, 1e6), Role::Order, "n, periods a turn (rad per m)")
}

/// What the prototype study measured the sizes with.
const CHOICE: &str = "textbook form; the project's choice";

impl EffectId {
    /// All effects, `E01` to `E25` and `U`.
    pub const ALL: [Self; 26] = [
        Self::Stribeck,
        Self::NonlinearViscous,
        Self::DirectionalFriction,
        Self::LoadFriction,
        Self::Presliding,
        Self::WornRegion,
        Self::FrictionDrift,
        Self::Compliance,
        Self::TransmissionError,
        Self::Imbalance,
        Self::Cogging,
        Self::CurrentRipple,
        Self::Saturation,
        Self::MagnetLoss,
        Self::ResistanceDrift,
        Self::InductanceEddy,
        Self::DeadTime,
        Self::BusSag,
        Self::CurrentSensor,
        Self::PositionSensor,
        Self::ControllerMismatch,
        Self::Vibration,
        Self::BackEmfShape,
        Self::CommutationOverlap,
        Self::HallOffset,
        Self::Tabulated,
    ];

    /// The effect of a catalogue symbol, `E01` to `E25` or `U`.
    pub fn find(symbol: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|id| id.info().symbol == symbol)
    }

    /// What is known of it.
    pub fn info(self) -> &'static EffectInfo {
        &CATALOGUE[self as usize]
    }
}

static CATALOGUE: [EffectInfo; 26] = [
    EffectInfo {
        symbol: "E01",
        name: "Stribeck friction",
        port: Port::MotorTorque,
        class: EffectClass::FrictionSpeed,
        equation: "T = a·s·exp(−(|ω|/ω_s)^d)",
        parameters: &[
            size("stribeck_n_m", "stribeck_n", (0.0, MOST), "a"),
            number(
                ("stribeck_speed_rad_per_s", "stribeck_speed_m_per_s"),
                (5.0, 0.02),
                (1e-6, 1e6),
                Role::Shape(&[0.2, 0.5, 1.0, 2.0, 5.0]),
                "ω_s",
            ),
            number(
                ("stribeck_exponent", "stribeck_exponent"),
                (1.0, 1.0),
                (0.25, 4.0),
                Role::Shape(&[1.0, 2.0]),
                "d",
            ),
        ],
        mimics: "k1",
        separated_by: "slow reversals and fast plateaus",
        source: "MuJoCo, DC motor technical note; Duclusaud et al., ICRA 2025",
    },
    EffectInfo {
        symbol: "E02",
        name: "non-linear viscous friction",
        port: Port::MotorTorque,
        class: EffectClass::FrictionSpeed,
        equation: "T = a·s·(|ω|/ω_0)^n",
        parameters: &[
            size("viscous_at_reference_n_m", "viscous_at_reference_n", (-MOST, MOST), "a"),
            number(
                ("reference_speed_rad_per_s", "reference_speed_m_per_s"),
                (100.0, 0.1),
                (1e-6, 1e6),
                Role::Shape(&[1.0]),
                "ω_0, fixes the unit of a",
            ),
            number(
                ("viscous_exponent", "viscous_exponent"),
                (2.0, 2.0),
                (0.3, 2.5),
                Role::Shape(&[0.25, 0.5, 0.75, 1.0, 1.25]),
                "n",
            ),
        ],
        mimics: "k1, viscous drag",
        separated_by: "a wide range of speed",
        source: "shear thinning and churning of grease; the project's choice of form",
    },
    EffectInfo {
        symbol: "E03",
        name: "direction-dependent friction",
        port: Port::MotorTorque,
        class: EffectClass::Asymmetry,
        equation: "T = a·|s| + c·|ω|",
        parameters: &[
            size("coulomb_asymmetry_n_m", "coulomb_asymmetry_n", (-MOST, MOST), "a"),
            size(
                "viscous_asymmetry_n_m_s_per_rad",
                "viscous_asymmetry_n_s_per_m",
                (-MOST, MOST),
                "c",
            ),
        ],
        mimics: "E19 offset, load bias",
        separated_by: "slow ramps",
        source: "Janot, Gautier, Brunot 2019 (EMPS): 16 % between the directions",
    },
    EffectInfo {
        symbol: "E04",
        name: "load-dependent friction",
        port: Port::MotorTorque,
        class: EffectClass::Load,
        equation: "T = s·|a_m·T_m − a_e·T_e|, T_e the load at the motor shaft",
        parameters: &[
            size("motor_share_ratio", "motor_share_ratio", (0.0, 1.0), "a_m"),
            size("load_share_ratio", "load_share_ratio", (0.0, 1.0), "a_e"),
        ],
        mimics: "k1",
        separated_by: "two levels of load",
        source: "Duclusaud et al., ICRA 2025: 6 to 20 % of the torque",
    },
    EffectInfo {
        symbol: "E05",
        name: "presliding",
        port: Port::MotorTorque,
        class: EffectClass::MicroMotion,
        equation: "T = σ0·z + σ1·z', z' = ω − |ω|·σ0·z/g(ω), σ0 = F_d/z_0, \
                   g = F_d + (F_s − F_d)·exp(−(ω/ω_s)²); in place of the dry friction",
        parameters: &[
            number(
                ("presliding_rad", "presliding_m"),
                (0.0, 0.0),
                (0.0, 1.0),
                Role::Amplitude,
                "z_0, deflection at which the kinetic friction is reached",
            ),
            number(
                ("bristle_damping_n_m_s_per_rad", "bristle_damping_n_s_per_m"),
                (0.0, 0.0),
                (0.0, MOST),
                Role::Shape(&[]),
                "σ1",
            ),
            number(
                ("stribeck_speed_rad_per_s", "stribeck_speed_m_per_s"),
                (1.0, 0.005),
                (1e-6, 1e6),
                Role::Shape(&[0.3, 1.0, 3.0]),
                "ω_s",
            ),
        ],
        mimics: "k2",
        separated_by: "small reversals",
        source: "LuGre (Canudas de Wit et al. 1995), as in the MuJoCo DC motor technical note",
    },
    EffectInfo {
        symbol: "E06",
        name: "worn region",
        port: Port::MotorTorque,
        class: EffectClass::Position,
        equation: "T = a·s·exp(−((θ − c)/w)²/2)",
        parameters: &[
            size("worn_n_m", "worn_n", (-MOST, MOST), "a"),
            number(("centre_rad", "centre_m"), (0.0, 0.0), (-1e6, 1e6), Role::Place, "c"),
            number(
                ("width_rad", "width_m"),
                (0.02, 0.02),
                (1e-6, 1e6),
                Role::Shape(&[0.2, 0.5, 1.0, 2.0, 5.0]),
                "w",
            ),
        ],
        mimics: "k1",
        separated_by: "a slow full stroke, both ways",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E07",
        name: "friction drift",
        port: Port::MotorTorque,
        class: EffectClass::Time,
        equation: "F → F·(1 − a·(1 − exp(−t/τ)))",
        parameters: &[
            size("friction_drop_ratio", "friction_drop_ratio", (-1.0, 1.0), "a"),
            number(
                ("time_constant_s", "time_constant_s"),
                (10.0, 10.0),
                (1e-3, 1e6),
                Role::Shape(&[0.1, 0.3, 1.0, 3.0, 10.0]),
                "τ",
            ),
        ],
        mimics: "k1",
        separated_by: "the same move cold and warm",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E08",
        name: "torsional compliance",
        port: Port::Transmission,
        class: EffectClass::Transmission,
        equation: "J_u·θ'' = τ − T_load, τ = d/κ + c·d', d the twist beyond the backlash",
        parameters: &[
            size("compliance_rad_per_n_m", "compliance_m_per_n", (0.0, 1.0), "κ"),
            number(
                ("damping_n_m_s_per_rad", "damping_n_s_per_m"),
                (0.0, 0.0),
                (0.0, MOST),
                Role::Shape(&[]),
                "c",
            ),
            number(
                ("load_inertia_kg_m2", "load_mass_kg"),
                (0.0, 0.0),
                (0.0, MOST),
                Role::Shape(&[]),
                "J_u; 0 takes the surface's own, which a servo axis does not have",
            ),
        ],
        mimics: "k2",
        separated_by: "an encoder at the output, a chirp through the resonance",
        source: "motulator, two-mass mechanics; MSL ElastoBacklash",
    },
    EffectInfo {
        symbol: "E09",
        name: "transmission error",
        port: Port::Transmission,
        class: EffectClass::AnglePeriodic,
        equation: "θ → θ + a·sin(n·θ_m) + b·cos(n·θ_m), and the load's work with it",
        parameters: &[
            size("error_sin_rad", "error_sin_m", (-1.0, 1.0), "a"),
            size("error_cos_rad", "error_cos_m", (-1.0, 1.0), "b"),
            order(1.0),
        ],
        mimics: "k6",
        separated_by: "constant speed, both ways",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E10",
        name: "gravity, imbalance, spring",
        port: Port::MotorTorque,
        class: EffectClass::Position,
        equation: "T = a·sin θ + b·cos θ + c·θ (θ in rad; of a linear axis in m)",
        parameters: &[
            size("imbalance_sin_n_m", "imbalance_sin_n", (-MOST, MOST), "a"),
            size("imbalance_cos_n_m", "imbalance_cos_n", (-MOST, MOST), "b"),
            size("spring_n_m_per_rad", "spring_n_per_m", (-MOST, MOST), "c"),
        ],
        mimics: "load",
        separated_by: "a slow full stroke",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E11",
        name: "cogging",
        port: Port::MotorTorque,
        class: EffectClass::AnglePeriodic,
        equation: "T = a·sin(n·θ_m) + b·cos(n·θ_m)",
        parameters: &[
            size("cogging_sin_n_m", "cogging_sin_n", (-MOST, MOST), "a"),
            size("cogging_cos_n_m", "cogging_cos_n", (-MOST, MOST), "b"),
            order(24.0),
        ],
        mimics: "k6, k7",
        separated_by: "a constant slow speed without load",
        source: "MuJoCo, DC motor technical note: 1 to 5 % of the rated torque",
    },
    EffectInfo {
        symbol: "E12",
        name: "current ripple",
        port: Port::MotorTorque,
        class: EffectClass::AnglePeriodic,
        equation: "T_m → T_m·(1 + a·sin(n·θ_m) + b·cos(n·θ_m))",
        parameters: &[
            size("ripple_sin_ratio", "ripple_sin_ratio", (-1.0, 1.0), "a"),
            size("ripple_cos_ratio", "ripple_cos_ratio", (-1.0, 1.0), "b"),
            order(24.0),
        ],
        mimics: "k3 to k6",
        separated_by: "a constant slow speed at two loads",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E13",
        name: "torque constant saturation",
        port: Port::MotorTorque,
        class: EffectClass::Current,
        equation: "k → k·max(1 − a·I², 0.1), torque and back-EMF",
        parameters: &[size("saturation_per_a2", "saturation_per_a2", (0.0, 1e3), "a")],
        mimics: "k3 to k5",
        separated_by: "high and low current",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E14",
        name: "magnet loss",
        port: Port::MotorTorque,
        class: EffectClass::Gain,
        equation: "k → k·(1 − a), torque and back-EMF; the controller keeps its gains",
        parameters: &[size(
            "torque_constant_loss_ratio",
            "torque_constant_loss_ratio",
            (-0.5, 0.9),
            "a",
        )],
        mimics: "k3 to k5 alike, load scale",
        separated_by: "a step of known load",
        source: "NdFeB −0.1 %/K: Modelica Magnetic.FluxTubes, HardMagnetic.NdFeB",
    },
    EffectInfo {
        symbol: "E15",
        name: "resistance drift",
        port: Port::Electrical,
        class: EffectClass::Electrical,
        equation: "R → R·(1 + α·ΔT), τ·ΔT' = R_th·R·I² − ΔT",
        parameters: &[
            size("resistance_rise_per_k", "resistance_rise_per_k", (0.0, 0.1), "α; copper 0.0039"),
            number(
                ("thermal_resistance_k_per_w", "thermal_resistance_k_per_w"),
                (3.0, 3.0),
                (0.0, 1e4),
                Role::Shape(&[0.3, 1.0, 3.0]),
                "R_th",
            ),
            number(
                ("thermal_time_constant_s", "thermal_time_constant_s"),
                (30.0, 30.0),
                (1e-2, 1e6),
                Role::Shape(&[0.1, 1.0, 10.0]),
                "τ",
            ),
        ],
        mimics: "k3 to k5, with the other sign",
        separated_by: "a held current, then a move",
        source: "MSL Electrical.Machines.Thermal.Constants",
    },
    EffectInfo {
        symbol: "E16",
        name: "inductance and eddy loss",
        port: Port::Electrical,
        class: EffectClass::Electrical,
        equation: "V = R·I + L·I' + k·ω, T = c·ω",
        parameters: &[
            size("inductance_henry", "inductance_henry", (0.0, 10.0), "L of the conducting pair"),
            size("eddy_n_m_s_per_rad", "eddy_n_s_per_m", (0.0, MOST), "c"),
        ],
        mimics: "viscous drag",
        separated_by: "a chirp",
        source: "MuJoCo, DC motor technical note",
    },
    EffectInfo {
        symbol: "E17",
        name: "inverter dead time",
        port: Port::Electrical,
        class: EffectClass::Electrical,
        equation: "V → V − V_d·tanh(I/I_0)",
        parameters: &[
            size("dead_time_v", "dead_time_v", (0.0, 1e3), "V_d = V_dc·t_d·f_sw"),
            number(
                ("dead_time_current_a", "dead_time_current_a"),
                (0.1, 0.1),
                (1e-6, 1e3),
                Role::Shape(&[0.3, 1.0, 3.0]),
                "I_0",
            ),
        ],
        mimics: "resistance",
        separated_by: "reversals at low current",
        source: "gym-electric-motor, interlocking term of its converters",
    },
    EffectInfo {
        symbol: "E18",
        name: "bus sag",
        port: Port::Electrical,
        class: EffectClass::Electrical,
        equation: "|V| ≤ V_dc − R_b·|I|",
        parameters: &[size("source_resistance_ohm", "source_resistance_ohm", (0.0, 1e3), "R_b")],
        mimics: "k1 at speed",
        separated_by: "fast moves",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E19",
        name: "current sensor",
        port: Port::Sensor,
        class: EffectClass::Sensor,
        equation: "τ·y' = (1 + g)·I + o − y; in the loop I = (I_ref − o)/(1 + g)",
        parameters: &[
            size("gain_error_ratio", "gain_error_ratio", (-0.5, 0.5), "g"),
            size("offset_a", "offset_a", (-1e3, 1e3), "o"),
            size("lag_s", "lag_s", (0.0, 1.0), "τ, of what is shown"),
            number(
                ("in_loop", "in_loop"),
                (0.0, 0.0),
                (0.0, 1.0),
                Role::Switch,
                "1 where the current loop uses this sensor",
            ),
        ],
        mimics: "E14, E03",
        separated_by: "standstill, slow ramps",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E20",
        name: "position sensor",
        port: Port::Sensor,
        class: EffectClass::Sensor,
        equation: "τ·y' = θ + a·sin θ_m + b·cos θ_m − y, in steps of q",
        parameters: &[
            size("lag_s", "lag_s", (0.0, 1.0), "τ"),
            size("eccentricity_sin_rad", "eccentricity_sin_m", (-1.0, 1.0), "a"),
            size("eccentricity_cos_rad", "eccentricity_cos_m", (-1.0, 1.0), "b"),
            size("step_rad", "step_m", (0.0, 1.0), "q"),
        ],
        mimics: "k2, k6",
        separated_by: "a chirp",
        source: "SimpleFOC, calibrated sensor: eccentric magnets",
    },
    EffectInfo {
        symbol: "E21",
        name: "controller mismatch",
        port: Port::Controller,
        class: EffectClass::Controller,
        equation: "gains and limit times (1 + e); its output acts T_d later",
        parameters: &[
            size(
                "position_gain_error_ratio",
                "position_gain_error_ratio",
                (-0.9, 9.0),
                "e of the position gains",
            ),
            size(
                "speed_gain_error_ratio",
                "speed_gain_error_ratio",
                (-0.9, 9.0),
                "e of the speed gain",
            ),
            size(
                "integral_error_ratio",
                "integral_error_ratio",
                (-1.0, 9.0),
                "e of the speed integral",
            ),
            size("limit_error_ratio", "limit_error_ratio", (-0.9, 9.0), "e of the output limit"),
            size("delay_s", "delay_s", (0.0, 0.1), "T_d"),
        ],
        mimics: "any",
        separated_by: "the controller replayed on what it measured",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E22",
        name: "vibration",
        port: Port::MotorTorque,
        class: EffectClass::TimePeriodic,
        equation: "T = a·sin(2π·f·t) + b·cos(2π·f·t)",
        parameters: &[
            size("vibration_sin_n_m", "vibration_sin_n", (-MOST, MOST), "a"),
            size("vibration_cos_n_m", "vibration_cos_n", (-MOST, MOST), "b"),
            number(
                ("frequency_hz", "frequency_hz"),
                (10.0, 10.0),
                (0.0, 1e4),
                Role::Frequency,
                "f",
            ),
        ],
        mimics: "nothing; free in phase between recordings",
        separated_by: "a repeat at another time",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E23",
        name: "back-EMF shape",
        port: Port::MotorTorque,
        class: EffectClass::AnglePeriodic,
        equation: "f(x) → trapezoid with flat 120° − 2δ + h5·sin 5x + h7·sin 7x, torque and back-EMF",
        parameters: &[
            size(
                "flat_loss_rad",
                "flat_loss_rad",
                (0.0, 1.0),
                "δ, electrical, at each end of the flat top",
            ),
            size("fifth_harmonic_ratio", "fifth_harmonic_ratio", (-0.5, 0.5), "h5"),
            size("seventh_harmonic_ratio", "seventh_harmonic_ratio", (-0.5, 0.5), "h7"),
        ],
        mimics: "k3 to k5, E12",
        separated_by: "a constant speed at two loads, the open winding",
        source: "FREEDOM paper's machine is drawn with 120°; real ones have 90° to 120° (choice)",
    },
    EffectInfo {
        symbol: "E24",
        name: "commutation overlap",
        port: Port::MotorTorque,
        class: EffectClass::AnglePeriodic,
        equation: "T_m → T_m·(1 − a·exp(−t_c/τ)), t_c the time since the last commutation",
        parameters: &[
            size("commutation_dip_ratio", "commutation_dip_ratio", (0.0, 1.0), "a"),
            number(
                ("time_constant_s", "time_constant_s"),
                (3.4e-4, 3.4e-4),
                (1e-6, 1.0),
                Role::Shape(&[0.3, 1.0, 3.0]),
                "τ, about L/R",
            ),
        ],
        mimics: "E12, viscous drag",
        separated_by: "two speeds",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "E25",
        name: "commutation (Hall) offset",
        port: Port::Sensor,
        class: EffectClass::AnglePeriodic,
        equation: "sector of θ_e + d in place of θ_e",
        parameters: &[size("hall_offset_rad", "hall_offset_rad", (-0.5, 0.5), "d, electrical")],
        mimics: "k3 to k5, E14",
        separated_by: "both directions of rotation",
        source: CHOICE,
    },
    EffectInfo {
        symbol: "U",
        name: "tabulated",
        port: Port::MotorTorque,
        class: EffectClass::Unknown,
        equation: "T = scale·y(x) or scale·s·y(x), x the motor angle, speed, position or time",
        parameters: &[size("scale_ratio", "scale_ratio", (-1e3, 1e3), "scale of the curve")],
        mimics: "whatever its curve is like",
        separated_by: "another coordinate than the curve's",
        source: "measured",
    },
];
