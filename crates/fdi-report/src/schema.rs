//! The published forms: JSON Schema of what is written, columns of what is read.

use std::fmt::Write;

use recordings::{ChannelName, METADATA_KEYS, MetadataKey};
use schemars::{JsonSchema, generate::SchemaSettings};
use serde::{Deserialize, Serialize};

use crate::document::{
    BundleSummary, Calibration, Diagnosis, EffectCatalogue, Evaluation, Explanation, Fleet,
    Proposal, SetupSummary, TestPlan, UnitSummary, words,
};

/// A form that the program reads or writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Schema {
    /// Columns and metadata of a recording.
    Recording,
    /// The JSON of `diagnose`.
    Diagnosis,
    /// The JSON of `bundle show`.
    Bundle,
    /// The JSON of `evaluate`.
    Evaluation,
    /// The JSON of `explain`.
    Explanation,
    /// The JSON of `calibrate`.
    Calibration,
    /// The JSON of `propose`.
    Proposal,
    /// The JSON of `propose --faults`.
    TestPlan,
    /// The JSON of `effects`.
    Effects,
    /// The JSON of the trends beside a report of `diagnose`.
    Fleet,
    /// The JSON of `unit show`.
    Unit,
    /// The JSON of `setup`.
    Setup,
}

impl Schema {
    /// Every form.
    pub const ALL: [Self; 12] = [
        Self::Recording,
        Self::Diagnosis,
        Self::Bundle,
        Self::Evaluation,
        Self::Explanation,
        Self::Calibration,
        Self::Proposal,
        Self::TestPlan,
        Self::Effects,
        Self::Fleet,
        Self::Unit,
        Self::Setup,
    ];

    /// A JSON Schema (draft 2020-12), or for the recording its tables in Markdown.
    pub fn text(self) -> String {
        match self {
            Self::Recording => recording_tables(),
            Self::Diagnosis => json_schema::<Diagnosis>(),
            Self::Bundle => json_schema::<BundleSummary>(),
            Self::Evaluation => json_schema::<Evaluation>(),
            Self::Explanation => json_schema::<Explanation>(),
            Self::Calibration => json_schema::<Calibration>(),
            Self::Proposal => json_schema::<Proposal>(),
            Self::TestPlan => json_schema::<TestPlan>(),
            Self::Effects => json_schema::<EffectCatalogue>(),
            Self::Fleet => json_schema::<Fleet>(),
            Self::Unit => json_schema::<UnitSummary>(),
            Self::Setup => json_schema::<SetupSummary>(),
        }
    }
}

words! {
    Schema {
        Recording "recording", Diagnosis "diagnosis", Bundle "bundle", Evaluation "evaluation",
        Explanation "explanation", Calibration "calibration", Proposal "proposal",
        TestPlan "test-plan", Effects "effects", Fleet "fleet", Unit "unit", Setup "setup",
    }
}

fn json_schema<T: JsonSchema>() -> String {
    let text = serde_json::to_string_pretty(&schema_of::<T>());
    text.expect("a schema is plain JSON") + "\n"
}

/// The JSON Schema of a published type.
pub(crate) fn schema_of<T: JsonSchema>() -> schemars::Schema {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    settings.into_generator().into_root_schema_for::<T>()
}

fn recording_tables() -> String {
    let mut out = String::from(
        "| column | unit | group | what |\n| --- | --- | --- | --- |\n\
         | `time_s` | s | required | time, strictly increasing |\n",
    );
    for name in ChannelName::ALL {
        let (unit, kind, meaning) = (name.unit(), name.kind().label(), name.meaning());
        push(&mut out, format_args!("| `{name}` | {unit} | {kind} | {meaning} |\n"));
    }
    out.push_str("\n| metadata key | type | what |\n| --- | --- | --- |\n");
    for MetadataKey { name: key, kind, meaning } in METADATA_KEYS {
        push(&mut out, format_args!("| `{key}` | {kind} | {meaning} |\n"));
    }
    out
}

fn push(out: &mut String, line: std::fmt::Arguments<'_>) {
    out.write_fmt(line).expect("a String takes all text");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_name_every_column_and_key() {
        let text = Schema::Recording.text();
        assert_eq!(text.lines().count(), 3 + ChannelName::ALL.len() + 3 + METADATA_KEYS.len());
        assert!(text.contains("| `current_a` | A | electrical |"));
    }

    #[test]
    fn schemas_say_what_may_be_null_and_what_is_required() {
        let schema: serde_json::Value = serde_json::from_str(&Schema::Diagnosis.text()).unwrap();
        assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
        let fault = &schema["$defs"]["Fault"];
        assert_eq!(fault["properties"]["value"]["type"], serde_json::json!(["number", "null"]));
        let required = fault["required"].as_array().unwrap();
        assert!(required.contains(&"value".into()) && !required.contains(&"detected".into()));
    }
}
