//! Simulation of an electromechanical actuator with incipient faults: a high-fidelity model
//! that goes from event to event, and a low-fidelity one for monitoring.
//!
//! ```text
//!            ┌────────────┐ I_ref ┌──────────┐ v_j ┌─────────┐ T_m ┌──────────────┐ θ_u
//! command ──▶│ controller │──────▶│ inverter │────▶│ winding │────▶│ transmission │──────▶
//!            └────────────┘       └──────────┘     └─────────┘     └──────────────┘
//!               ▲   ▲   ω_m, θ_u       ▲  i_j           │ i_j            │    ▲ load
//!               └───┴──────────────────┴────────────────┴────────────────┘    │
//! ```
//!
//! Everything is in SI units, deterministic, and free of input, output, clocks and environment.
//!
//! # Examples
//!
//! ```
//! use ema_sim::{
//!     Envelope, EnvelopeFilter, FaultId, FaultLevel, HealthState, HighFidelity, Scenario,
//!     presets::EMA_48,
//! };
//!
//! let worn = HealthState::HEALTHY.with(FaultId::Friction, FaultLevel::new(0.05)?);
//! let model = HighFidelity::new(&EMA_48, &Scenario::chirp())?;
//! let trace = model.simulate(&(&worn).into());
//! let envelope = trace.envelope_a(Envelope::ConductingPhase, EMA_48.motor.pole_pairs);
//! let signal = EnvelopeFilter::DEFAULT.apply(&envelope, trace.rate_hz);
//! assert_eq!(signal.len(), 1000);
//! # Ok::<_, Box<dyn std::error::Error>>(())
//! ```

mod actuator_capabilities;
mod axis_parameter;
mod back_emf;
mod bounds;
mod controller;
mod current_loop;
mod drive_train;
mod effect;
mod ended;
mod energy;
mod engine;
mod envelope;
mod event_limit;
mod extension;
mod fault;
mod field_oriented;
mod high_fidelity;
mod lane_exp;
mod lane_sine;
mod load;
mod logger;
mod low_fidelity;
#[cfg(feature = "model-file")]
mod machine_kind;
#[cfg(feature = "model-file")]
pub mod model_file;
mod motion_term;
mod noise;
mod number_format;
mod parameter;
mod parameter_error;
mod params;
mod phase;
mod phase_sensor;
mod plant;
pub mod presets;
mod probe;
mod quantisation;
mod runaway;
mod scenario;
mod series;
mod servo_axis;
mod servo_control;
mod shape_function;
mod shorted_loops;
mod shorted_turns;
mod simulation_error;
mod speed_guard;
mod temperature;
mod tolerance;
mod trace;
mod valid_range;
pub mod vector_math;
mod vectors;
mod waveform;
mod wide;
mod winding;

pub use axis_parameter::AxisParameter;
pub use back_emf::BackEmfTable;
pub use effect::{
    Coordinate, Curve, CurveError, CurveKind, Effect, EffectClass, EffectError, EffectId,
    EffectInfo, EffectParameter, Geometry, LoopPart, MOST_PARAMETERS, MachineScales, Port,
    Quantity, Repetition, Role, ShaftMoment, ShaftTorque, ShapeScales,
};
pub use energy::EnergyLedger;
pub use envelope::{Envelope, EnvelopeFilter};
pub use fault::{
    FAULT_COUNT, FaultCoordinates, FaultId, FaultLevel, FaultLevelError, HealthState,
    PhysicalFaults,
};
pub use high_fidelity::{CurrentControl, HighFidelity};
pub use load::{HingeMoment, Load};
pub use logger::LoggedCurrents;
pub use low_fidelity::LowFidelity;
#[cfg(feature = "model-file")]
pub use machine_kind::{
    CommandKind, DriveRun, DriveUnit, Electronics, LoopGains, MachineKind, MachineNumber,
    MachineRun, MachineSignals, MachineTest, MachineTestError, ModelFidelity, NumberTolerance,
    NumberValue, PreparedTest, bandwidth_hz, resolved_hz, shown_while_followed, testable_rate_hz,
};
pub use motion_term::MotionTerm;
pub use parameter::{Block, Parameter};
pub use parameter_error::ParameterError;
pub use params::{
    Actuator, BackEmfShape, Commutation, Controller, Inverter, Motor, PositionSensor, Sensing,
    Transmission,
};
pub use phase::{ContinuingPhase, PerPhase, Sector};
pub use phase_sensor::{Converter, PhaseSensors};
pub use runaway::Runaway;
pub use scenario::{Command, ControlMode, Imperfections, InitialState, Knot, Scenario, Tone};
pub use servo_axis::{
    AxisInput, AxisScenario, AxisStart, AxisTrace, ServoAxis, ServoAxisSimulation,
};
pub use servo_control::{AxisController, Drive, Feedback};
pub use shorted_turns::ShortedTurns;
pub use simulation_error::SimulationError;
pub use temperature::{TemperatureLaw, ThermalCoefficient, ThermalNumber};
pub use tolerance::{Level, Spread, Tolerance, UncertainNumber};
pub use trace::{HighFidelityTrace, LowFidelityTrace, MotorMotion};
pub use valid_range::{Departure, RangeOf, ValidRange, VisitedRange};
