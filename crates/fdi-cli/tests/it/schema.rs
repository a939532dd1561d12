//! Answers against the schema that is published for them.

use std::fs;

use fdi_core::{Schema, report::NoticeCode};
use serde_json::Value;

use crate::{
    batch::mixed,
    stand_in::{GOOD, diagnose},
};

/// Where a value is not what the schema says: the keywords that the published
/// schemas use, and an error for any other.
pub(crate) fn violations(value: &Value, schema: &Value, root: &Value, at: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (keyword, rule) in schema.as_object().unwrap() {
        let holds = match keyword.as_str() {
            "$schema" | "$defs" | "title" | "description" | "format" => true,
            "$ref" => {
                let target = rule.as_str().unwrap().strip_prefix('#').unwrap();
                found.extend(violations(value, root.pointer(target).unwrap(), root, at));
                true
            }
            "type" => match rule {
                Value::Array(types) => types.iter().any(|kind| is(value, kind)),
                kind => is(value, kind),
            },
            "const" => value == rule,
            "enum" => rule.as_array().unwrap().contains(value),
            "anyOf" => {
                let fits = |option: &Value| violations(value, option, root, at).is_empty();
                rule.as_array().unwrap().iter().any(fits)
            }
            "oneOf" => {
                let fits = |option: &&Value| violations(value, option, root, at).is_empty();
                rule.as_array().unwrap().iter().filter(fits).count() == 1
            }
            "minimum" => value.as_f64() >= rule.as_f64(),
            "minItems" => {
                value.as_array().is_none_or(|all| all.len() as u64 >= rule.as_u64().unwrap())
            }
            "maxItems" => {
                value.as_array().is_none_or(|all| all.len() as u64 <= rule.as_u64().unwrap())
            }
            "items" => {
                for (index, item) in value.as_array().into_iter().flatten().enumerate() {
                    found.extend(violations(item, rule, root, &format!("{at}/{index}")));
                }
                true
            }
            "required" => {
                let missing = |name: &&Value| value.get(name.as_str().unwrap()).is_none();
                !rule.as_array().unwrap().iter().any(|name| missing(&name))
            }
            // stricter than the schema, which lets readers meet fields of a later version
            "properties" => value.as_object().into_iter().flatten().all(|(name, inner)| {
                let Some(of) = rule.get(name) else { return false };
                found.extend(violations(inner, of, root, &format!("{at}/{name}")));
                true
            }),
            // of the values of a map
            "additionalProperties" if rule.is_object() => {
                for (name, inner) in value.as_object().into_iter().flatten() {
                    found.extend(violations(inner, rule, root, &format!("{at}/{name}")));
                }
                true
            }
            other => panic!("keyword `{other}` at `{at}`"),
        };
        if !holds {
            found.push(format!("{at}: {keyword} {rule}, found {value}"));
        }
    }
    found
}

fn is(value: &Value, kind: &Value) -> bool {
    match kind.as_str().unwrap() {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("type `{other}`"),
    }
}

#[test]
fn answers_are_of_the_published_form() {
    let schema: Value = serde_json::from_str(&Schema::Diagnosis.text()).unwrap();
    let folder = mixed();
    fs::write(folder.path().join("unit-1.csv"), GOOD).unwrap();
    let path = folder.path().display().to_string();
    for extra in [&["--stable"][..], &["--stamp"]] {
        let arguments = [&["--output-format", "json", &path], extra].concat();
        let answer: Value = serde_json::from_str(&diagnose(&arguments).out).unwrap();
        assert_eq!(violations(&answer, &schema, &schema, ""), Vec::<String>::new());
        assert_eq!(answer.pointer("/records/6/findings/1/kind"), Some(&"ambiguous".into()));
    }
}

/// Anti-test: what is not of the form is found.
#[test]
fn other_answers_are_not() {
    let schema: Value = serde_json::from_str(&Schema::Diagnosis.text()).unwrap();
    let folder = mixed();
    let path = folder.path().display().to_string();
    let answer: Value =
        serde_json::from_str(&diagnose(&["--output-format", "json", &path]).out).unwrap();
    for (pointer, wrong) in [
        ("/records/0/verdict", "fine".into()),
        ("/records/0/faults/0/value", "0.1".into()),
        ("/records/0/faults/0/interval_95", vec![0.1].into()),
        ("/records/0/evaluations", (-1).into()),
        ("/failed", Value::Null),
        ("/records/0/fit", serde_json::json!({})),
    ] {
        let mut changed = answer.clone();
        *changed.pointer_mut(pointer).unwrap() = wrong;
        assert!(!violations(&changed, &schema, &schema, "").is_empty(), "{pointer}");
    }
}

/// Every code of a notice has a row in the guide, and the guide has no row of another code.
#[test]
fn the_guide_has_a_row_for_each_code_of_a_notice() {
    let guide = include_str!("../../../../docs/guide/first-diagnosis.md");
    let notices = guide.split("## Notices").nth(1).unwrap().split("\n## ").next().unwrap();
    let code = |line: &str| Some(line.strip_prefix("| `")?.split_once('`')?.0.to_owned());
    let mut rows: Vec<String> = notices.lines().filter_map(code).collect();
    rows.sort();
    let mut codes = NoticeCode::ALL.map(NoticeCode::code);
    codes.sort_unstable();
    assert_eq!(rows, codes);
}

/// Values of an option that a published enumeration gives, against those of the schema.
#[test]
fn law_help_and_schema_agree_on_values_and_words() {
    use clap::CommandFactory;

    for (command, option, form, definition) in [
        ("diagnose", "method", Schema::Diagnosis, "Method"),
        ("diagnose", "fidelity", Schema::Diagnosis, "Fidelity"),
        ("diagnose", "encoding", Schema::Bundle, "Encoding"),
        ("simulate", "fidelity", Schema::Diagnosis, "Fidelity"),
    ] {
        let schema: serde_json::Value = serde_json::from_str(&form.text()).unwrap();
        let root = fdi_cli::Cli::command();
        let inner = root.find_subcommand(command).unwrap();
        let arg = inner.get_arguments().find(|arg| arg.get_id() == option).unwrap();
        let told: Vec<_> = arg
            .get_possible_values()
            .iter()
            .map(|one| (one.get_name().to_owned(), one.get_help().unwrap().to_string()))
            .collect();
        let published: Vec<_> = schema["$defs"][definition]["oneOf"]
            .as_array()
            .unwrap()
            .iter()
            .map(|one| {
                let meaning = one["description"].as_str().unwrap().replace('\n', " ");
                (
                    one["const"].as_str().unwrap().to_owned(),
                    meaning.trim_end_matches('.').to_owned(),
                )
            })
            .collect();
        assert_eq!(told, published, "fdi {command} --{option}");
    }
}
