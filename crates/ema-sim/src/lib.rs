//! Simulation of an electromechanical actuator with incipient faults: high- and low-fidelity models.
