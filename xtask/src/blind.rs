//! The scored hidden-effect cases: `cargo xtask blind`.

#[cfg(test)]
mod null_check;
