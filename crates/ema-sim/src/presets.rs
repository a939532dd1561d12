//! Named actuators with a source for each number.
//!
//! The FREEDOM paper prints no parameter of its actuator. `EMA-48` is this project's choice of a
//! consistent set, argued in `docs/models/ema-48.md`; "choice" below means a realistic value
//! without a published source.

use crate::{
    Parameter,
    params::{
        Actuator, BackEmfShape, Commutation, Controller, Inverter, Motor, PositionSensor, Sensing,
        Transmission,
    },
    shorted_turns::ShortedTurns,
    temperature::{TemperatureLaw, ThermalCoefficient},
    tolerance::{Level, Spread, Tolerance, UncertainNumber},
};

/// The actuators that a model file can start from.
pub const PRESETS: [(&str, Actuator); 2] = [("ema-48", EMA_48), ("bench", BENCH)];

/// Torque constant with two phases conducting, N·m/A.
const TORQUE_CONSTANT: f64 = 0.0752;
/// Inertia at the motor shaft, kg·m²: the rotor's and 0.2 kg·m² behind the gear.
const TOTAL_INERTIA: f64 = 2.5e-5 + 0.2 / (500.0 * 500.0);
/// Bandwidth of the speed loop, rad/s.
const SPEED_BANDWIDTH: f64 = core::f64::consts::TAU * 60.0;

/// A 48 V actuator of a secondary flight control.
///
/// | field | value | source |
/// |---|---|---|
/// | pole pairs | 4 | FREEDOM paper III.B (the bench motor); choice for this machine |
/// | resistance | 1.065 Ω a phase | choice: with 48 V a stall current of 22.5 A |
/// | inductance | 360 µH a phase | choice: 0.34 ms electrical time constant |
/// | back-EMF | 0.0376 V·s/rad a phase | choice: 638 rad/s no-load speed at 48 V |
/// | rotor inertia | 2.5e-5 kg·m² | choice |
/// | viscous drag | 3e-5 N·m·s/rad | choice |
/// | kinetic friction | 0.030 N·m | choice: 0.40 A; measured joints of this size 0.07 N·m |
/// | static friction | 0.045 N·m | choice: 1.5 times kinetic |
/// | gear ratio | 500 | choice |
/// | surface inertia | 0.2 kg·m² | choice: 3 % of the motor's after the gear |
/// | backlash | 5e-5 rad | choice: 100 times it is the chirp's amplitude |
/// | efficiency | 0.85 | choice: gears of this kind 0.7 to 0.9 |
/// | end stops | 0.35 rad | choice |
/// | carrier | 20 kHz | choice |
/// | dead time | 0 | choice: an ideal inverter |
/// | current loop | 1 kHz | choice: a twentieth of the carrier |
/// | cascade | 10 kHz, 60 1/s, 60 Hz | choice: position loop of 10 Hz |
/// | encoder | 16 bit over ±45° | choice |
/// | current set-point | 12 bit over ±20 A | choice |
/// | speed noise | 0.1 rad/s rms | choice |
/// | current noise | uniform ±10 mA | choice |
///
/// # Examples
///
/// ```
/// let motor = ema_sim::presets::EMA_48.motor;
/// assert_eq!(motor.torque_constant_n_m_per_a(), 0.0752);
/// ```
pub const EMA_48: Actuator = Actuator {
    motor: Motor {
        pole_pairs: 4,
        resistance_ohm: 1.065,
        inductance_henry: 360e-6,
        back_emf_v_s_per_rad: 0.5 * TORQUE_CONSTANT,
        back_emf_shape: BackEmfShape::Trapezoid,
        inertia_kg_m2: 2.5e-5,
        viscous_n_m_s_per_rad: 3e-5,
        shorted_turns: ShortedTurns::Removed,
    },
    inverter: Inverter {
        bus_voltage_v: 48.0,
        carrier_hz: 20e3,
        current_bandwidth_hz: 1000.0,
        dead_time_s: 0.0,
        commutation: Commutation::SixStep,
    },
    transmission: Transmission {
        gear_ratio: 500.0,
        surface_inertia_kg_m2: 0.2,
        backlash_rad: 5e-5,
        kinetic_friction_n_m: 0.030,
        static_friction_n_m: 0.045,
        surface_friction_n_m: 0.0,
        efficiency_ratio: 0.85,
        stop_rad: 0.35,
    },
    controller: Controller {
        sample_hz: 10e3,
        position_gain_per_s: 60.0,
        speed_limit_rad_per_s: 600.0,
        speed_gain_a_s_per_rad: TOTAL_INERTIA * SPEED_BANDWIDTH / TORQUE_CONSTANT,
        speed_integral_a_per_rad: TOTAL_INERTIA * SPEED_BANDWIDTH / TORQUE_CONSTANT
            * SPEED_BANDWIDTH
            / 5.0,
        speed_derivative_a_s2_per_rad: 0.0,
        current_limit_a: 20.0,
        position_sensor: PositionSensor::Surface,
    },
    sensing: Sensing {
        surface_step_rad: core::f64::consts::FRAC_PI_2 / 65536.0,
        current_reference_step_a: 40.0 / 4096.0,
        speed_noise_rad_per_s: 0.1,
        current_noise_half_width_a: 0.010,
    },
};

/// The test bench of the FREEDOM paper, section III.B, as far as it is printed; the rest is
/// `EMA-48` with a sinusoidal machine of the same torque constant.
///
/// | field | value | source |
/// |---|---|---|
/// | pole pairs | 4 | FREEDOM paper, III.B |
/// | star, three phases | | FREEDOM paper, III.B |
/// | back-EMF | sinusoidal | FREEDOM paper, III.B: "permanent magnet synchronous motor"; the shape is choice |
/// | peak back-EMF | 0.0752/1.5 = 0.0501 V·s/rad a phase | choice: torque constant of EMA-48 |
/// | commutation | field-oriented | choice: what an industrial drive with an absolute encoder does |
/// | encoder | on the motor shaft, for commutation and speed loop | FREEDOM paper, III.B |
/// | encoder's step | 16 bit a turn of the motor | choice |
/// | position loop | on the motor's angle | choice: no other sensor is mentioned |
/// | brake | on the motor shaft, before the play | FREEDOM paper, III.B: `Scenario::brake_n_m` |
/// | friction of the user shaft | 2 N·m | choice: 4.7 mN·m at the motor, a sixth of what is before the play |
/// | speed limit | 450 rad/s | choice: below the no-load speed of 479 rad/s, as in EMA-48 |
/// | current loop | 1 kHz | choice, as EMA-48; gains `L·ω_c`, `R·ω_c` in the rotor's axes |
/// | all else | | choice, as EMA-48 |
///
/// The bench's own supply is 400 V, three-phase; no rating of its motor is printed, so that a
/// consistent machine of another voltage stands in its place.
///
/// # Examples
///
/// ```
/// use ema_sim::presets::{BENCH, EMA_48};
///
/// let (bench, ema) = (BENCH.torque_constant_n_m_per_a(), EMA_48.torque_constant_n_m_per_a());
/// assert!((bench - ema).abs() < 1e-15);
/// ```
pub const BENCH: Actuator = Actuator {
    motor: Motor {
        back_emf_v_s_per_rad: TORQUE_CONSTANT / 1.5,
        back_emf_shape: BackEmfShape::Sinusoid,
        ..EMA_48.motor
    },
    inverter: Inverter { commutation: Commutation::FieldOriented, ..EMA_48.inverter },
    transmission: Transmission { surface_friction_n_m: 2.0, ..EMA_48.transmission },
    controller: Controller {
        speed_limit_rad_per_s: 450.0,
        position_sensor: PositionSensor::MotorShaft,
        ..EMA_48.controller
    },
    sensing: Sensing {
        surface_step_rad: core::f64::consts::TAU / 65536.0 / EMA_48.transmission.gear_ratio,
        ..EMA_48.sensing
    },
};

/// Scatter of a number that is usual in the field.
struct Usual {
    number: UncertainNumber,
    level: Level,
    std: f64,
}

const fn unit(number: UncertainNumber, std: f64) -> Usual {
    Usual { number, level: Level::Unit, std }
}

const fn session(number: UncertainNumber, std: f64) -> Usual {
    Usual { number, level: Level::Session, std }
}

/// Standard deviations of a machine like [`EMA_48`], by key: between units, and between sessions
/// of one unit.
const EMA_48_SCATTER: [Usual; 25] = [
    unit(UncertainNumber::Eccentricity, 0.02),
    unit(UncertainNumber::Turns, 0.003),
    unit(UncertainNumber::Parameter(&Parameter::BUS_VOLTAGE), 0.01),
    session(UncertainNumber::Parameter(&Parameter::BUS_VOLTAGE), 0.01),
    unit(UncertainNumber::Parameter(&Parameter::BACK_EMF), 0.03),
    unit(UncertainNumber::Parameter(&Parameter::INDUCTANCE), 0.10),
    unit(UncertainNumber::Parameter(&Parameter::MOTOR_INERTIA), 0.03),
    unit(UncertainNumber::Parameter(&Parameter::RESISTANCE), 0.05),
    unit(UncertainNumber::Parameter(&Parameter::VISCOUS), 0.30),
    session(UncertainNumber::Parameter(&Parameter::VISCOUS), 0.05),
    unit(UncertainNumber::PhaseGain, 0.01),
    session(UncertainNumber::PhaseGain, 0.002),
    unit(UncertainNumber::PhaseOffset, 0.020),
    session(UncertainNumber::PhaseOffset, 0.010),
    unit(UncertainNumber::VoltageGain, 0.01),
    session(UncertainNumber::VoltageGain, 0.001),
    unit(UncertainNumber::Load, 0.103),
    session(UncertainNumber::WindingTemperature, 15.0),
    unit(UncertainNumber::Parameter(&Parameter::BACKLASH), 0.30),
    unit(UncertainNumber::Parameter(&Parameter::EFFICIENCY), 0.02 / 0.85),
    unit(UncertainNumber::Parameter(&Parameter::KINETIC_FRICTION), 0.20),
    session(UncertainNumber::Parameter(&Parameter::KINETIC_FRICTION), 0.03),
    unit(UncertainNumber::StaticOverKinetic, 0.10),
    session(UncertainNumber::StaticOverKinetic, 0.03),
    unit(UncertainNumber::Parameter(&Parameter::SURFACE_INERTIA), 0.05),
];

/// Scatter of what [`BENCH`] has besides: the user shaft's friction is dry friction too.
const BENCH_SCATTER: [Usual; 2] = [
    unit(UncertainNumber::Parameter(&Parameter::SURFACE_FRICTION), 0.20),
    session(UncertainNumber::Parameter(&Parameter::SURFACE_FRICTION), 0.03),
];

fn normal(usual: &[Usual]) -> Vec<Tolerance> {
    let tolerance = |usual: &Usual| Tolerance {
        number: usual.number,
        spread: Spread::Std(usual.std),
        level: usual.level,
    };
    usual.iter().map(tolerance).collect()
}

/// Tolerances of [`EMA_48`] that are usual in the field, in the order of their keys.
///
/// All are normal. A model made of an actuator has none of them: it has those that its file, or
/// its maker, gives.
///
/// | number | standard deviation between units | between sessions | source |
/// |---|---|---|---|
/// | back-EMF | 3 % | | Parker, Trilogy: magnets differ by 3 to 5 % from lot to lot |
/// | resistance | 5 % | | the same: ±10 %, as two standard deviations |
/// | inductance | 10 % | | the same: ±30 %, as three standard deviations |
/// | motor inertia | 3 % | | IEC 60034-1: ±10 %, as three standard deviations |
/// | surface inertia | 5 % | | choice |
/// | kinetic friction | 20 % | 3 % | choice; it changes with load and temperature (Bittencourt and Gunnarsson) |
/// | static over kinetic friction | 10 % | 3 % | choice |
/// | viscous drag | 30 % | 5 % | choice |
/// | play | 30 % | | choice |
/// | efficiency | 0.02 of 0.85 | | choice; IEC 60034-1 allows a motor 15 % of its losses, 0.0225 here |
/// | winding's temperature | | 15 K | choice: halls and days |
/// | load | 0.103 N·m | | choice: 5 % of 0.5 N·m and 0.1 N·m, in squares |
/// | supply | 1 % | 1 % | choice |
/// | gain of a phase's sensor | 1 % | 0.2 % | choice: that of a shunt |
/// | offset of a phase's sensor | 20 mA | 10 mA | choice: 0.1 % of ±20 A, and half of it |
/// | gain of the voltage's measurement | 1 % | 0.1 % | choice: a divider of 1 % resistors, 50 ppm/K over 20 K |
/// | turns of a phase | 0.3 % | | choice |
/// | eccentricity | 2 % of the air gap | | choice |
///
/// # Source
///
/// Parker Hannifin, "Winding Tolerances and Resistance Measurement", support page 187 of the
/// Trilogy linear motors, "similar to rotary servo motor tolerances". IEC 60034-1, schedule of
/// tolerances, as gear-motor manuals print it. A. C. Bittencourt and S. Gunnarsson, "Static
/// Friction in a Robot Joint", LiTH-ISY-R-3038, 2011.
///
/// # Examples
///
/// ```
/// use ema_sim::{Level, presets::ema_48_tolerance};
///
/// let of_units = ema_48_tolerance().into_iter().filter(|one| one.level == Level::Unit);
/// assert_eq!(of_units.count(), 17);
/// ```
pub fn ema_48_tolerance() -> Vec<Tolerance> {
    normal(&EMA_48_SCATTER)
}

/// How numbers of [`EMA_48`] follow the temperature of its winding.
///
/// | number | coefficient, %/K | standard deviation, %/K | source |
/// |---|---|---|---|
/// | back-EMF | -0.11 | 0.02 | remanence of sintered neodymium magnets, -0.12 to -0.09 by grade (Advanced Magnets) |
/// | resistance | 0.39 | 0 | copper, IEC 60028 |
/// | dry friction | -0.4 | 0.1 | choice; it falls with temperature (Bittencourt and Gunnarsson) |
/// | viscous drag | -2 | 0.5 | choice; that of greases falls by more than half over 40 K (the same) |
///
/// The model file's numbers are those at 20 °C, 293.15 K.
///
/// # Source
///
/// Advanced Magnets, "What are permanent magnets temperature coefficients (α and β)?",
/// advancedmagnets.com. IEC 60028, resistance of annealed copper. A. C. Bittencourt and S. Gunnarsson, "Static Friction in a Robot Joint",
/// LiTH-ISY-R-3038, 2011.
pub fn ema_48_temperature() -> TemperatureLaw {
    let coefficient = |per_k, std_per_k| ThermalCoefficient { per_k, std_per_k };
    TemperatureLaw {
        nominal_k: 293.15,
        coefficients: [
            coefficient(-0.0011, 0.0002),
            coefficient(0.0039, 0.0),
            coefficient(-0.004, 0.001),
            coefficient(-0.02, 0.005),
        ],
    }
}

/// Tolerances of [`BENCH`] that are usual in the field: [`ema_48_tolerance`],
/// and dry friction of the user shaft, 20 % between units and 3 % between sessions (choice, as the
/// friction of EMA-48).
pub fn bench_tolerance() -> Vec<Tolerance> {
    let mut tolerances = ema_48_tolerance();
    tolerances.extend(normal(&BENCH_SCATTER));
    tolerances.sort_by_key(Tolerance::key);
    tolerances
}
