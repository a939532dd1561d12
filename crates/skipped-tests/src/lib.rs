//! Tests that are skipped for want of data or programs: each told, all counted.
//!
//! A test that cannot run here calls [`skip`] and returns. The harness of Rust would show it as
//! passed; `skip` writes a line past the harness's capture of output and notes the test in a file
//! below the target folder. The last test binary of the workspace, `xtask/tests/skipped.rs`, ends
//! `cargo test --workspace` with the count; `cargo xtask ci` repeats it at its end.

use std::{
    env, fs,
    io::{self, Write},
    panic::Location,
    path::PathBuf,
    thread,
};

/// Tells and notes that the test that calls it is skipped.
///
/// The name is the thread's, which the harness calls like the test; where tests run on the main
/// thread it is the place of the call.
#[track_caller]
pub fn skip(reason: &str) {
    let caller = Location::caller();
    let place = format!("{}:{}", caller.file(), caller.line());
    let name = match thread::current().name() {
        Some(name) if name != "main" => name.to_owned(),
        _ => place,
    };
    let line = format!("skipped: {name}: {reason}\n");
    // what cannot be written is told by nobody, and no reason to fail
    let _ = io::stderr().write_all(line.as_bytes());
    let Some(file) = note_file() else { return };
    let _ = file.parent().map(fs::create_dir_all);
    if let Ok(mut file) = fs::OpenOptions::new().create(true).append(true).open(file) {
        let _ = file.write_all(line.as_bytes());
    }
}

/// The skipped tests that were noted by the test binaries of one call of cargo, in order of their
/// names; the notes are removed.
pub fn take_noted() -> Vec<String> {
    let Some(file) = note_file() else { return Vec::new() };
    let text = fs::read_to_string(&file).unwrap_or_default();
    let _ = file.parent().map(fs::remove_dir_all);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines.sort_unstable();
    lines.dedup();
    lines
}

/// The file of the notes: one for each process that starts tests, below the profile's folder.
fn note_file() -> Option<PathBuf> {
    // target/debug/deps/NAME-HASH
    let profile = env::current_exe().ok()?.ancestors().nth(2)?.to_owned();
    Some(profile.join("skipped-tests").join(starter().to_string()))
}

/// The process that started this one.
fn starter() -> u32 {
    #[cfg(unix)]
    return std::os::unix::process::parent_id();
    #[cfg(not(unix))]
    return 0;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notes_stand_below_the_profile() {
        let file = note_file().expect("a test binary has a folder");
        assert!(file.parent().is_some_and(|folder| folder.ends_with("skipped-tests")));
    }
}
