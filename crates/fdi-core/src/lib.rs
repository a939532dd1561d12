//! Fault detection and isolation of electromechanical actuators from stator current.
