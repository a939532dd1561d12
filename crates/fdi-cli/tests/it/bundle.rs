//! `fdi bundle show` on the embedded bundle.

use std::fs;

use fdi_core::{Encoding, MASK_POINTS, report::BundleSummary};

use crate::{binary::fdi, stand_in::folder};

/// Digits of a SHA-256 as they are written in words.
const SHORT_SHA: usize = 12;

/// Checksums give way to `[sha256]`, and what an encoding costs to `[x]`: maps and projections
/// are learnt afresh, and their last digits are the processor's.
fn filtered(text: &str, summary: &BundleSummary) -> String {
    let mut text = text.replace(&summary.sha256, "[sha256]");
    for dataset in &summary.datasets {
        text = text.replace(&dataset.sha256[..SHORT_SHA], "[sha256]");
    }
    text.lines().map(|line| without_costs(line) + "\n").collect()
}

/// The line with the costs of an encoding that is not the whole signal left out.
fn without_costs(line: &str) -> String {
    let Some((before, costs)) = line.split_once("wider by ") else { return line.to_owned() };
    if before.contains("(default)") {
        return line.to_owned();
    }
    let costs: Vec<String> = costs
        .split(", ")
        .map(|cost| {
            let (id, factor) = cost.split_once(' ').unwrap();
            assert!(factor.parse::<f64>().unwrap() >= 1.0, "{line}");
            format!("{id} [x]")
        })
        .collect();
    format!("{before}wider by {}", costs.join(", "))
}

fn summary() -> BundleSummary {
    let (code, out, err) = fdi(&["--output-format", "json", "bundle", "show"]);
    assert_eq!((code, err.as_str()), (0, ""));
    serde_json::from_str(&out).unwrap()
}

#[test]
fn show_says_what_the_embedded_bundle_holds() {
    let (code, out, err) = fdi(&["bundle", "show"]);
    let out = filtered(&out, &summary());
    insta::assert_snapshot!(format!("exit {code}\n--- stdout\n{out}--- stderr\n{err}"));
}

#[test]
fn the_document_has_every_encoding_and_the_default_costs_nothing() {
    let summary = summary();
    let names: Vec<_> = summary.encodings.iter().map(|one| one.name).collect();
    assert_eq!(names, Encoding::ALL);
    let default = summary.encodings.iter().find(|one| one.name == summary.default_encoding);
    assert!(default.unwrap().bound_inflation.values().all(|&factor| factor == 1.0));
}

#[test]
fn a_figure_goes_to_its_file_and_the_words_to_standard_output() {
    let folder = folder(&[]);
    let path = folder.path().join("figure.svg");
    let (code, out, err) = fdi(&["bundle", "show", "--figure", &path.display().to_string()]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert_eq!(out, fdi(&["bundle", "show"]).1);
    let drawing = fs::read_to_string(&path).unwrap();
    assert!(drawing.starts_with("<svg ") && drawing.ends_with("</svg>\n"));
    assert_eq!(drawing.matches("class=\"point\"").count(), MASK_POINTS);
}

#[test]
fn a_bundle_has_no_rows_and_a_missing_file_is_named() {
    let (code, out, err) = fdi(&["--output-format", "csv", "bundle", "show"]);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.starts_with("error: a bundle has no CSV form"), "{err}");
    let (code, out, err) = fdi(&["bundle", "show", "none.fdi-bundle"]);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.starts_with("error: none.fdi-bundle: "), "{err}");
}
