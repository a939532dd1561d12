//! Proof that the workspace does what it says: pages of figures, scored blind cases, budgets.
//!
//! Every function is a task of `cargo xtask` and takes the root of the repository. The figures come from
//! simulation and from recordings of other laboratories; the answers of other programs that they are
//! compared with stand in `fixtures/references` and `benches/peers`.

mod blind;
mod budget;
mod median;
mod mutants;
mod pages;
mod processor;
mod same_answers;
mod terminal;

pub use blind::score_blind_cases;
pub use budget::check_budgets;
pub use mutants::break_the_program;
pub use pages::{validate_pages, validate_section};
pub use same_answers::same_answers;
pub use terminal::{clock, say};
