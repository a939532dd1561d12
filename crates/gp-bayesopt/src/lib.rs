//! Gaussian processes, Bayesian optimisation and solvers for inverse problems.
