//! ASAM MDF 4 files, as loggers and test benches of vehicles write them.

use falcon_mdf::{Channel, Mf4File, OpenOptions, SignalValues};

use crate::{
    ColumnMap, FileFormat, RecordError, Recording,
    property::Property,
    reader::container::{Clock, Container, Head, Samples, assemble},
};

/// Most that one compressed block may expand to; a logger's have a few MB.
const LIMIT_BLOCK_BYTES: u64 = 64 << 20;
/// Largest allocation on the word of the file alone.
const LIMIT_CLAIM_BYTES: usize = 16 << 20;

/// Reads a recording.
pub(super) fn read(
    name: String,
    bytes: Vec<u8>,
    map: &ColumnMap,
) -> Result<Recording, RecordError> {
    assemble(name, &MdfFile::open(bytes)?, map)
}

/// A file, open for reading.
struct MdfFile {
    file: Mf4File,
    heads: Vec<Head>,
    /// Data group, channel group and channel of each column.
    places: Vec<[usize; 3]>,
}

impl MdfFile {
    fn open(bytes: Vec<u8>) -> Result<Self, RecordError> {
        if bytes.starts_with(b"MDF     3") || bytes.starts_with(b"MDF     2") {
            return Err(RecordError::Unsupported {
                format: FileFormat::Mf4,
                what: "MDF 2 or 3".to_owned(),
                advice: "save it as MDF 4 (asammdf: `MDF(FILE).convert(\"4.10\").save(NEW)`)",
            });
        }
        let options = OpenOptions {
            build_channels_db: false,
            parallel_parsing: false,
            max_alloc: LIMIT_CLAIM_BYTES,
            max_decompressed: LIMIT_BLOCK_BYTES,
            ..OpenOptions::default()
        };
        let file =
            Mf4File::from_bytes_with_options(bytes, options).map_err(|error| damaged(&error))?;
        let (mut heads, mut places) = (Vec::new(), Vec::new());
        for (d, data) in file.data_groups().iter().enumerate() {
            for (g, group) in data.channel_groups.iter().enumerate() {
                let first = heads.len();
                let master = group.channels.iter().position(Channel::is_time_channel);
                let title = match group.acquisition_name.as_str() {
                    "" => format!("{d}.{g}"),
                    named => named.to_owned(),
                };
                for (c, channel) in group.channels.iter().enumerate() {
                    places.push([d, g, c]);
                    let samples = usize::try_from(channel.sample_count).unwrap_or(usize::MAX);
                    heads.push(Head {
                        // names of groups may repeat, places do not
                        group: Some(format!("{d}.{g}")),
                        path: format!("{title}/{}", channel.name),
                        name: channel.name.clone(),
                        samples,
                        unit: Some(channel.unit.clone()),
                        clock: match master {
                            Some(master) if master != c => Clock::Column(first + master),
                            _ => Clock::Unstated,
                        },
                    });
                }
            }
        }
        Ok(Self { file, heads, places })
    }

    fn channel(&self, column: usize) -> &Channel {
        let [d, g, c] = self.places[column];
        &self.file.data_groups()[d].channel_groups[g].channels[c]
    }
}

fn damaged(error: &falcon_mdf::error::Mf4Error) -> RecordError {
    let reason = error.to_string().lines().next().unwrap_or_default().to_owned();
    RecordError::Damaged { format: FileFormat::Mf4, reason }
}

impl Container for MdfFile {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    /// The properties in the comment of the file.
    fn properties(&self) -> Vec<(String, Property)> {
        let all = self.file.metadata().properties();
        all.map(|(key, value)| (key.to_owned(), Property::Text(value.to_owned()))).collect()
    }

    fn read(&self, column: usize) -> Result<Samples, RecordError> {
        let signal = self.file.signal(self.channel(column)).map_err(|error| damaged(&error))?;
        let present = signal.validity().filter(|present| present.contains(&false));
        let values = signal.values().map_err(|error| damaged(&error))?;
        let found = match &values {
            SignalValues::Str(_) => Some("text"),
            SignalValues::Complex { .. } => Some("complex numbers"),
            SignalValues::Bytes { .. } | SignalValues::VarBytes { .. } => Some("bytes"),
            SignalValues::Array { .. } | SignalValues::ArrayVarLen { .. } => Some("arrays"),
            SignalValues::CanopenDate(_) | SignalValues::CanopenTime(_) => Some("dates"),
            _ => None,
        };
        if let Some(found) = found {
            return Err(RecordError::NotNumbers { column: self.heads[column].path.clone(), found });
        }
        let single = matches!(values, SignalValues::F32(_));
        let values = match values {
            SignalValues::F64(values) => values,
            other => other.to_f64(),
        };
        let present = present.filter(|present| present.len() == values.len());
        Ok(Samples { values, present, single })
    }
}
