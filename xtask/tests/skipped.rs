//! The count of the tests that were skipped, as the last test binary of `cargo test --workspace`.
//!
//! Cargo runs the test binaries in the order of their packages, and this package is the last;
//! examples in documentation come after it.

#![expect(clippy::print_stdout, reason = "the count is for people at a terminal")]

fn main() {
    // a list of tests is asked for by test runners
    if std::env::args().any(|argument| argument == "--list") {
        return;
    }
    let skipped = skipped_tests::take_noted();
    skipped.iter().for_each(|line| println!("{line}"));
    println!("{} tests skipped", skipped.len());
}
