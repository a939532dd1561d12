//! `fdi schema`.

use anyhow::Result;

use crate::{ExitStatus, GlobalArgs, Streams, args::SchemaArgs};

/// Writes the form asked for.
pub(crate) fn schema(
    args: &SchemaArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let text = args.form.text();
    streams.product(global.output.as_deref(), |out| out.write_all(text.as_bytes()))?;
    Ok(ExitStatus::Done)
}
