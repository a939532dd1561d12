//! Keys of the metadata: one table.

/// A key of the metadata.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MetadataKey {
    /// Name, as it stands in a file.
    pub name: &'static str,
    /// Type of its value: `text`, `date` or `number`.
    pub kind: &'static str,
    /// Meaning, with the unit of a number.
    pub meaning: &'static str,
}

const fn key(name: &'static str, kind: &'static str, meaning: &'static str) -> MetadataKey {
    MetadataKey { name, kind, meaning }
}

/// The keys of the metadata, in the order of the documentation.
pub const METADATA_KEYS: [MetadataKey; 14] = [
    key("actuator-id", "text", "which actuator the recording is of"),
    key("date", "date", "when it was taken, with or without time"),
    key("operator", "text", "who took it; a report says so"),
    key("session", "text", "which session of the actuator it was taken in; else its day"),
    key("command", "text", "name of the command (`chirp`, `sine`, `planned`), or `recorded`"),
    key("rate-hz", "number", "sample rate of the file, Hz"),
    key(
        "filter-hz",
        "number",
        "corner of the filter that `current_a` went through, Hz; of the drive's low-pass of first \
         order that `q_axis_current_a` did",
    ),
    key(
        "envelope",
        "text",
        "what `current_a` is: `half-abs-sum`, `signed-projection`, `q-axis` or `conducting-phase`",
    ),
    key("start-angle-rad", "number", "mechanical rotor angle at the first sample, rad"),
    key("noise-a", "number", "rms of the noise on each phase per sample, A"),
    key("phase-rate-hz", "number", "rate of the phase samples that `noise-a` is of, Hz"),
    key("winding-temperature-k", "number", "temperature of the motor's winding, K"),
    key("winding-temperature-sd-k", "number", "its standard deviation, K; 3 where it is not given"),
    key(
        "load-n-m",
        "number",
        "constant load torque on an actuator's surface, N·m, where there is no column `load_n_m`; that \
         of the test where neither is given",
    ),
];

/// The names of the keys.
pub(super) fn keys() -> [&'static str; 14] {
    METADATA_KEYS.map(|key| key.name)
}
