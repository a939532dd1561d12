//! Named actuators with a source for each number.
//!
//! The FREEDOM paper prints no parameter of its actuator. `EMA-48` is this project's choice of a
//! consistent set, argued in `docs/models/ema-48.md`; "choice" below means a realistic value
//! without a published source.

use crate::params::{
    Actuator, BackEmfShape, Commutation, Controller, Inverter, Motor, PositionSensor, Sensing,
    Transmission,
};

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
