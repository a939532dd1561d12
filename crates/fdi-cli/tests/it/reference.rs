//! The generated pages of commands and settings.

use std::{fs, path::Path};

/// Whether a page under `docs` is what it is generated from.
fn assert_page(name: &str, text: &str) {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name);
    assert_eq!(fs::read_to_string(page).unwrap(), text, "run `cargo xtask docs`");
}

#[test]
fn the_page_of_settings_is_the_one_of_this_command_line() {
    assert_page("config.md", &fdi_cli::config_reference());
}

#[test]
fn the_page_of_commands_is_the_one_of_this_command_line() {
    assert_page("cli.md", &fdi_cli::reference());
}
