//! Blind cases: a machine with something hidden in it, four recordings, and the truth sealed.
//!
//! The crate depends on no other of the workspace, since those hold the catalogue of effects: its
//! plant, its integrator and the forms of its effects are its own. What it shares is the
//! nominal contract alone: parameters, controller, sampling, dry friction, play. See
//! `docs/models/blind-test.md`.
//!
//! # Examples
//!
//! ```
//! use greybox_blind::{Case, Class, Role};
//!
//! let case = Case::draw(1, Class::Single)?;
//! let seal = case.seal(); // printed before anybody explains
//! let files = case.files();
//! assert_eq!(files.iter().filter(|file| file.role == Role::Train).count(), 2);
//! assert_eq!(case.seal(), seal);
//! assert_eq!(case.truth().hidden.len(), 1);
//! # Ok::<_, greybox_blind::BlindError>(())
//! ```

mod case;
mod chance;
mod class;
mod command;
mod effect;
mod error;
mod information;
mod machine;
mod noise;
mod nominal;
mod plant;
mod recording;
mod tie;
mod truth;

pub use case::{Case, TIED_LAMBDA, VISIBLE_LAMBDA};
pub use class::Class;
pub use command::{Course, Move};
pub use error::BlindError;
pub use machine::{Machine, RATE_HZ};
pub use noise::{LOWEST_NOISE_A, UnusualNoise};
pub use nominal::NominalRun;
pub use recording::{File, Role};
pub use tie::TIES;
pub use truth::{HiddenTruth, TieTruth, Truth, sha256_hex};
