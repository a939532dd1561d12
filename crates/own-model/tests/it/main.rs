//! Simulations of somebody else, with and without something hidden.

mod pendulum;
