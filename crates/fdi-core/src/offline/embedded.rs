//! The bundles that come with the crate.
//!
//! Made by `cargo xtask gen-dataset` from the reference configuration of the preset `EMA-48`;
//! their manifest is `fixtures/datasets/manifest.toml`.

/// A bundle that comes with the crate.
#[derive(Clone, Copy, Debug)]
pub struct EmbeddedBundle {
    /// Command that it is for.
    pub command: &'static str,
    /// The artefact.
    pub bytes: &'static [u8],
}

/// All of them, the default one first.
pub const EMBEDDED_BUNDLES: [EmbeddedBundle; 3] = [
    EmbeddedBundle { command: "chirp", bytes: include_bytes!("../../bundles/chirp.fdi-bundle") },
    EmbeddedBundle { command: "sine", bytes: include_bytes!("../../bundles/sine.fdi-bundle") },
    EmbeddedBundle {
        command: "planned",
        bytes: include_bytes!("../../bundles/planned.fdi-bundle"),
    },
];
