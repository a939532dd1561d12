//! The generated page of commands.

use std::{fs, path::Path};

#[test]
fn the_page_of_commands_is_the_one_of_this_command_line() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/cli.md");
    let written = fs::read_to_string(&page).unwrap();
    assert_eq!(written, fdi_cli::reference(), "run `cargo xtask docs`");
}
