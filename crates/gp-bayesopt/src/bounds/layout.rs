//! A box as serialised data.

use serde::{Deserialize, Serialize};

use super::{Bounds, InputKind};
use crate::error::BoundsError;

/// Limits and kinds of the inputs.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Layout {
    lower: Vec<f64>,
    upper: Vec<f64>,
    kinds: Vec<InputKind>,
}

impl From<Bounds> for Layout {
    fn from(Bounds { lower, upper, kinds }: Bounds) -> Self {
        Self { lower, upper, kinds }
    }
}

impl TryFrom<Layout> for Bounds {
    type Error = BoundsError;

    fn try_from(Layout { lower, upper, kinds }: Layout) -> Result<Self, BoundsError> {
        let mut bounds = Self::new(&lower, &upper)?;
        if kinds.len() != lower.len() {
            return Err(BoundsError::Dimension { expected: lower.len(), found: kinds.len() });
        }
        for (input, kind) in kinds.iter().enumerate() {
            bounds = match *kind {
                InputKind::Linear => bounds,
                InputKind::Periodic => bounds.with_periodic(input)?,
                InputKind::PolarRadius { angle } => bounds.with_polar(input, angle)?,
                // joined by its radius
                InputKind::PolarAngle { radius } if radius < kinds.len() => bounds,
                InputKind::PolarAngle { radius } => {
                    return Err(BoundsError::NoSuchInput { input: radius, dimension: kinds.len() });
                }
            };
        }
        match (0..kinds.len()).find(|&input| bounds.kinds[input] != kinds[input]) {
            Some(input) => Err(BoundsError::PairTaken { radius: input, angle: input }),
            None => Ok(bounds),
        }
    }
}
