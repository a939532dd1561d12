//! Options of `fdi effects`.

use clap::Args;

/// Options of `fdi effects`.
///
/// An effect is something that a machine does besides the base model: `fdi explain` looks for it,
/// and an `[[effect]]` block of a model file switches it on.
#[derive(Clone, Debug, Args)]
pub struct EffectsArgs {
    /// Effects to show with all their numbers: `E01 E11` [default: all, in a table]
    #[arg(value_name = "EFFECT")]
    pub effects: Vec<String>,
    /// Show keys and units of a machine that slides in place of one that turns
    #[arg(long)]
    pub linear: bool,
}
