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
    let count = format!("{} tests skipped", skipped.len());
    let told = [skipped, vec![count]].concat().join("\n");
    println!("{told}");
    // for `cargo xtask ci`, which repeats it at its end: target/debug/deps/NAME
    let target = std::env::current_exe().ok();
    let target = target.as_deref().and_then(|test| test.ancestors().nth(3));
    if let Some(target) = target {
        std::fs::write(target.join("skipped-tests.txt"), told).expect("the target folder is there");
    }
}
