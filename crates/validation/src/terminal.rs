//! Lines and times of tasks for people at a terminal.

use std::time::Instant;

/// Writes a line to standard error.
#[expect(clippy::print_stderr, reason = "a task for people at a terminal")]
pub fn say(line: &str) {
    eprintln!("{line}");
}

/// The time now, for durations that are shown or judged.
#[expect(clippy::disallowed_methods, reason = "tells how long a step takes")]
pub fn clock() -> Instant {
    Instant::now()
}
