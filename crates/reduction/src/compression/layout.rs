//! A compression map as serialised data.

use serde::{Deserialize, Serialize};

use super::{CompressionMap, CompressionParts, PartsError};

/// Version of the layout; another one is refused.
const VERSION: u32 = 1;

/// The parts with the version of their layout.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Layout {
    version: u32,
    parts: CompressionParts,
}

/// Reasons to refuse serialised data.
#[derive(Debug, thiserror::Error)]
pub(super) enum LayoutError {
    #[error("layout of version {found}, {VERSION} is read")]
    Version { found: u32 },
    #[error(transparent)]
    Parts(#[from] PartsError),
}

impl From<CompressionMap> for Layout {
    fn from(map: CompressionMap) -> Self {
        Self { version: VERSION, parts: map.into_parts() }
    }
}

impl TryFrom<Layout> for CompressionMap {
    type Error = LayoutError;

    fn try_from(Layout { version, parts }: Layout) -> Result<Self, LayoutError> {
        if version != VERSION {
            return Err(LayoutError::Version { found: version });
        }
        Ok(Self::from_parts(parts)?)
    }
}
