//! `fdi bundle`.

use std::fmt::Write;

use anyhow::{Context, Result, bail};
use fdi_core::report::BundleSummary;

use crate::{
    ExitStatus, GlobalArgs, OutputFormat, Streams,
    args::{BuildArgs, ShowArgs},
    bundle,
    progress::Steps,
};

/// Learns a bundle and writes its file.
pub(crate) fn build(
    args: &BuildArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let path = global.output.as_deref().context("`--output FILE` says where the bundle goes")?;
    let steps = Steps::new(streams, global.quiet);
    let tell = |what: &str, done: f64| steps.tell(what, done);
    let bytes = bundle::build(args, global.root_seed(), &tell)?;
    streams.product(Some(path), |out| out.write_all(&bytes))?;
    Ok(ExitStatus::Done)
}

/// Says what a bundle holds.
pub(crate) fn show(
    args: &ShowArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let render: fn(&BundleSummary) -> Result<String> = match global.output_format {
        OutputFormat::Human => |summary| Ok(describe(summary)),
        OutputFormat::Json => |summary| Ok(serde_json::to_string_pretty(summary)? + "\n"),
        OutputFormat::Jsonl => |summary| Ok(serde_json::to_string(summary)? + "\n"),
        _ => bail!("a bundle has no CSV form or other table: `--output-format human|json|jsonl`"),
    };
    let summary = bundle::summarise(args.file.as_deref())?;
    let text = render(&summary)?;
    if let Some(path) = &args.figure {
        let svg = bundle::mode_figure(args.file.as_deref())?;
        streams.product(Some(path), |out| out.write_all(svg.as_bytes()))?;
    }
    streams.product(global.output.as_deref(), |out| out.write_all(text.as_bytes()))?;
    Ok(ExitStatus::Done)
}

/// The summary in words.
fn describe(summary: &BundleSummary) -> String {
    let mut text = String::new();
    let mut line = |label: &str, content: &str| {
        writeln!(text, "{label:<10} {content}").expect("a String takes all text");
    };
    line("bundle", &summary.sha256);
    line("model", &summary.model);
    line("command", &summary.command);
    let (rate_hz, filter_hz) = (summary.rate_hz, summary.filter_hz);
    let envelope = format!("{} at {rate_hz} Hz, filtered at {filter_hz} Hz", summary.envelope);
    line("envelope", &envelope);
    for dataset in &summary.datasets {
        let (name, conditions, seed) = (&dataset.name, dataset.conditions, dataset.seed);
        let start = dataset.sha256.get(..12).unwrap_or(&dataset.sha256);
        line("dataset", &format!("{name}, {conditions} conditions, seed {seed}, sha256 {start}…"));
    }
    for encoding in &summary.encodings {
        let inflation = encoding.bound_inflation.iter().map(|(id, x)| format!("{id} {x:.2}"));
        let inflation: Vec<_> = inflation.collect();
        let used = if encoding.name == summary.default_encoding { " (default)" } else { "" };
        let (name, size) = (encoding.name, encoding.size);
        let bounds = inflation.join(", ");
        line("encoding", &format!("{name}{used}, {size} numbers; bounds wider by {bounds}"));
    }
    text
}

#[cfg(test)]
mod tests {
    use fdi_core::report::{DatasetSummary, Encoding, EncodingSummary, SCHEMA_VERSION};

    use super::*;

    #[test]
    fn a_bundle_in_words() {
        let summary = BundleSummary {
            schema_version: SCHEMA_VERSION,
            sha256: "ab".repeat(32),
            model: "ema-48".to_owned(),
            command: "chirp".to_owned(),
            envelope: "conducting-phase".to_owned(),
            rate_hz: 2000.0,
            filter_hz: 200.0,
            datasets: vec![DatasetSummary {
                name: "incipient".to_owned(),
                conditions: 100,
                seed: 1,
                sha256: "cd".repeat(32),
            }],
            default_encoding: Encoding::Full,
            encodings: vec![EncodingSummary {
                name: Encoding::Full,
                size: 1000,
                bound_inflation: [("k1".to_owned(), 1.0)].into(),
            }],
        };
        let text = describe(&summary);
        let lines: Vec<_> = text.lines().skip(1).collect();
        assert_eq!(
            lines,
            [
                "model      ema-48",
                "command    chirp",
                "envelope   conducting-phase at 2000 Hz, filtered at 200 Hz",
                "dataset    incipient, 100 conditions, seed 1, sha256 cdcdcdcdcdcd…",
                "encoding   full (default), 1000 numbers; bounds wider by k1 1.00",
            ]
        );
    }
}
