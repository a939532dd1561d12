//! `fdi merge`.

mod part;

use std::{collections::BTreeMap, io};

use anyhow::{Result, bail};

use crate::{
    ExitStatus, GlobalArgs, OutputFormat, Streams,
    args::MergeArgs,
    command::list_sha256,
    output::{Answer, Head, Tally, writer},
    stamp,
};
use part::Part;

/// Writes the answers of all parts of a batch as one run would have written them.
pub(crate) fn merge(
    args: &MergeArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let parts = args.parts.iter().map(|path| Part::read(path)).collect::<Result<Vec<_>>>()?;
    let parts = whole(parts)?;
    let head = Head { stamp: global.stamp.then(stamp::now), ..parts[0].head.clone() };
    let mut tally = Tally::default();
    streams.product(global.output.as_deref(), |out| {
        let mut writer = writer(global.output_format, global.output.is_none(), out);
        writer.begin(&head)?;
        for place in 0..recordings(&parts) {
            let part = &parts[place % parts.len()];
            let mut answer = part.answer(place / parts.len()).map_err(io::Error::other)?;
            if let Answer::Diagnosed(record) = &mut answer {
                if global.output_format == OutputFormat::Jsonl {
                    // there is no head to name it
                    record.bundle.get_or_insert_with(|| head.bundle.clone());
                }
                record.elapsed_s = record.elapsed_s.filter(|_| !global.stable);
            }
            tally.count(&answer);
            writer.answer(&answer)?;
        }
        writer.end()
    })?;
    if !global.quiet {
        let noun = if parts.len() == 1 { "part" } else { "parts" };
        streams.say(format_args!("{} {noun} merged: {}", parts.len(), tally.sentence()));
    }
    Ok(ExitStatus::Done)
}

fn recordings(parts: &[Part]) -> usize {
    parts.iter().map(|part| part.names.len()).sum()
}

/// The parts in their order, once it is sure that they are one batch, with every recording once.
fn whole(parts: Vec<Part>) -> Result<Vec<Part>> {
    let mut in_order: BTreeMap<u64, Part> = BTreeMap::new();
    for part in parts {
        if let Some(first) = in_order.values().next() {
            part.check_against(first)?;
        }
        let (index, of, path) = (part.shard.index, part.shard.of, part.path.clone());
        if let Some(other) = in_order.insert(index, part) {
            bail!(
                "part {index} of {of} is there twice: `{}` and `{}`",
                other.path.display(),
                path.display()
            );
        }
    }
    let of = in_order.values().next().map_or(0, |part| part.shard.of);
    let missing: Vec<_> = (1..=of).filter(|index| !in_order.contains_key(index)).collect();
    if !missing.is_empty() {
        let noun = if missing.len() == 1 { "part" } else { "parts" };
        let are = if missing.len() == 1 { "is" } else { "are" };
        let missing: Vec<_> = missing.iter().map(u64::to_string).collect();
        bail!(
            "{noun} {} of {of} {are} missing: `fdi diagnose --shard {}/{of}` makes the first of them",
            missing.join(", "),
            missing[0]
        );
    }
    let parts: Vec<Part> = in_order.into_values().collect();
    parts.iter().try_for_each(Part::check_whole)?;
    let names =
        (0..recordings(&parts)).map(|place| &parts[place % parts.len()].names[place / parts.len()]);
    if list_sha256(names) != parts[0].shard.list_sha256 {
        bail!("the recordings of the parts are not those of the batch: one was changed by hand");
    }
    Ok(parts)
}
