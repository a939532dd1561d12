//! `fdi effects`.

use std::fmt::Write;

use anyhow::{Context, Result, bail};
use csv::Writer;
use fdi_core::{
    ema_sim::{EffectClass, EffectId, EffectParameter, Geometry},
    report::{CatalogueEffect, CatalogueKey, CatalogueParameter, EffectCatalogue, SCHEMA_VERSION},
};

use crate::{ExitStatus, GlobalArgs, OutputFormat, Streams, args::EffectsArgs, output::table};

/// Lists the catalogue of effects.
pub(crate) fn effects(
    args: &EffectsArgs,
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let geometry = if args.linear { Geometry::Linear } else { Geometry::Rotary };
    let asked = asked(&args.effects)?;
    let all = args.effects.is_empty();
    let catalogue = EffectCatalogue {
        schema_version: SCHEMA_VERSION,
        tool: format!("fdi {}", env!("CARGO_PKG_VERSION")),
        effects: asked.into_iter().map(entry).collect(),
    };
    let text = match global.output_format {
        OutputFormat::Human if all => overview(&catalogue, geometry)?,
        OutputFormat::Human => details(&catalogue, geometry)?,
        OutputFormat::Json => serde_json::to_string_pretty(&catalogue)? + "\n",
        OutputFormat::Jsonl => serde_json::to_string(&catalogue)? + "\n",
        OutputFormat::Csv => rows(&catalogue)?,
        #[cfg(feature = "parquet")]
        OutputFormat::Parquet => {
            bail!("no such form: `--output-format human|json|jsonl|csv`");
        }
    };
    streams.product(global.output.as_deref(), |out| out.write_all(text.as_bytes()))?;
    Ok(ExitStatus::Done)
}

/// The effects of some symbols; all where there is none.
fn asked(symbols: &[String]) -> Result<Vec<EffectId>> {
    if symbols.is_empty() {
        return Ok(EffectId::ALL.to_vec());
    }
    let find = |symbol: &String| {
        EffectId::find(symbol).with_context(|| {
            let (causes, curve) = (causes(), EffectId::Tabulated.info().symbol);
            format!("`{symbol}`: no effect of the catalogue, expected one of {causes}, or {curve}")
        })
    };
    symbols.iter().map(find).collect()
}

/// Symbols of the effects that have a cause, the first to the last in the order of the catalogue.
pub(super) fn causes() -> String {
    let has_cause = |id: &EffectId| id.info().class != EffectClass::Unknown;
    let mut symbols = EffectId::ALL.into_iter().filter(has_cause).map(|id| id.info().symbol);
    let first = symbols.next().unwrap_or_default();
    symbols.next_back().map_or_else(|| first.to_owned(), |last| format!("{first} to {last}"))
}

fn entry(id: EffectId) -> CatalogueEffect {
    let info = id.info();
    CatalogueEffect {
        id: info.symbol.to_owned(),
        name: info.name.to_owned(),
        port: info.port.name().to_owned(),
        class: info.class.name().to_owned(),
        equation: info.equation.to_owned(),
        confounded_with: info.mimics.to_owned(),
        separated_by: info.separated_by.to_owned(),
        source: info.source.to_owned(),
        repetition: info.repetition.name().to_owned(),
        differs_by_recording: info.differs_by_recording,
        nonlinear_in_size: info.nonlinear_in_size,
        takes_curve: info.takes_curve,
        parameters: info.parameters.iter().map(number).collect(),
    }
}

fn number(parameter: &EffectParameter) -> CatalogueParameter {
    let key = |geometry| CatalogueKey {
        key: parameter.key(geometry).to_owned(),
        unit: parameter.unit(geometry).to_owned(),
        default: parameter.default_value(geometry),
    };
    let (least, most) = parameter.bounds();
    CatalogueParameter {
        meaning: parameter.meaning().to_owned(),
        role: parameter.role().name().to_owned(),
        least,
        most,
        rotary: key(Geometry::Rotary),
        linear: key(Geometry::Linear),
    }
}

/// Key and unit on machines of a geometry.
fn of(parameter: &CatalogueParameter, geometry: Geometry) -> &CatalogueKey {
    match geometry {
        Geometry::Rotary => &parameter.rotary,
        Geometry::Linear => &parameter.linear,
    }
}

/// A key as a model file writes it, with its unit.
fn told(key: &CatalogueKey) -> String {
    let written = key.key.replace('_', "-");
    if key.unit.is_empty() { written } else { format!("{written} ({})", key.unit) }
}

fn overview(catalogue: &EffectCatalogue, geometry: Geometry) -> Result<String> {
    let header = ["id", "effect", "confounded with", "numbers in a model file (unit)"];
    let row = |effect: &CatalogueEffect| {
        let keys: Vec<_> = effect.parameters.iter().map(|p| told(of(p, geometry))).collect();
        let cells = [&effect.id, &effect.name, &effect.confounded_with, &keys.join(", ")];
        cells.map(String::clone).to_vec()
    };
    let rows: Vec<_> = catalogue.effects.iter().map(row).collect();
    let mut text = String::new();
    table(&mut text, &header.map(str::to_owned), &rows)?;
    text.push_str("\n`fdi effects E11` shows equation, bounds and defaults.\n");
    Ok(text)
}

fn details(catalogue: &EffectCatalogue, geometry: Geometry) -> Result<String> {
    let mut text = String::new();
    for (place, effect) in catalogue.effects.iter().enumerate() {
        if place > 0 {
            text.push('\n');
        }
        writeln!(text, "{} {} ({})", effect.id, effect.name, effect.port)?;
        writeln!(text, "  {}", effect.equation)?;
        writeln!(text, "  confounded with: {}", effect.confounded_with)?;
        writeln!(text, "  told apart by:   {}", effect.separated_by)?;
        writeln!(text, "  source:          {}\n", effect.source)?;
        let row = |parameter: &CatalogueParameter| {
            let key = of(parameter, geometry);
            vec![
                key.key.replace('_', "-"),
                key.unit.clone(),
                parameter.role.clone(),
                key.default.to_string(),
                format!("{} to {}", parameter.least, parameter.most),
                parameter.meaning.clone(),
            ]
        };
        let header = ["number", "unit", "role", "default", "bounds", "in the equation"];
        let rows: Vec<_> = effect.parameters.iter().map(row).collect();
        table(&mut text, &header.map(str::to_owned), &rows)?;
    }
    Ok(text)
}

/// One row a number.
fn rows(catalogue: &EffectCatalogue) -> Result<String> {
    let mut writer = Writer::from_writer(Vec::new());
    writer.write_record([
        "effect",
        "name",
        "port",
        "class",
        "confounded_with",
        "separated_by",
        "key",
        "unit",
        "default",
        "linear_key",
        "linear_unit",
        "linear_default",
        "role",
        "least",
        "most",
        "meaning",
        "equation",
    ])?;
    for effect in &catalogue.effects {
        for parameter in &effect.parameters {
            let CatalogueParameter { rotary, linear, .. } = parameter;
            let numbers = [rotary.default, linear.default, parameter.least, parameter.most]
                .map(|x| x.to_string());
            let [default, linear_default, least, most] = &numbers;
            writer.write_record([
                &effect.id,
                &effect.name,
                &effect.port,
                &effect.class,
                &effect.confounded_with,
                &effect.separated_by,
                &rotary.key,
                &rotary.unit,
                default,
                &linear.key,
                &linear.unit,
                linear_default,
                &parameter.role,
                least,
                most,
                &parameter.meaning,
                &effect.equation,
            ])?;
        }
    }
    let bytes = writer.into_inner().context("rows in memory")?;
    Ok(String::from_utf8(bytes)?)
}
