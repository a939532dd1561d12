//! Tests of the crate as others use it.

mod analytic;
mod bad_input;
mod batch;
mod bench;
mod bench_effects;
mod brute_force;
mod dead_time;
mod effect_table;
mod effects;
mod effects_high_fidelity;
mod energy;
mod fidelities;
mod idle_effects;
mod logger;
mod measured;
mod model_file;
mod motulator;
mod own_lanes;
mod runaway;
mod servo_axis;
mod severe;
mod shorted_turns;
