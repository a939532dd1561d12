//! Levels of the seven faults.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A fault of the actuator.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum FaultId {
    /// Friction.
    K1,
    /// Backlash.
    K2,
    /// Short circuit of phase A.
    K3,
    /// Short circuit of phase B.
    K4,
    /// Short circuit of phase C.
    K5,
    /// Eccentricity that turns with the rotor (dynamic eccentricity), amplitude as a share of the
    /// air gap.
    K6,
    /// Eccentricity that turns with the rotor (dynamic eccentricity), direction in the rotor.
    K7,
}

impl FaultId {
    /// All seven, in order.
    pub const ALL: [Self; 7] =
        [Self::K1, Self::K2, Self::K3, Self::K4, Self::K5, Self::K6, Self::K7];

    /// `k1` to `k7`.
    pub fn id(self) -> &'static str {
        ["k1", "k2", "k3", "k4", "k5", "k6", "k7"][self as usize]
    }

    /// Name in words.
    pub fn name(self) -> &'static str {
        [
            "friction",
            "backlash",
            "short circuit of phase A",
            "short circuit of phase B",
            "short circuit of phase C",
            "eccentricity",
            "direction of eccentricity",
        ][self as usize]
    }
}

impl FaultId {
    /// The fault as the head of a column.
    pub fn short_name(self) -> String {
        let short =
            ["friction", "backlash", "short A", "short B", "short C", "eccentr.", "direction"];
        format!("{self} {}", short[self as usize])
    }
}

impl fmt::Display for FaultId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

/// The level of one fault.
///
/// `value`, `std` and `interval_95` are `null` together, where the level is not
/// determined. k6 and k7 are decided jointly: while k6 is not detected, k7 is null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fault {
    /// Which fault.
    pub id: FaultId,
    /// Name of the fault, in words.
    pub name: String,
    /// The level, 0 to 1.
    pub value: Option<f64>,
    /// Standard deviation of the level.
    pub std: Option<f64>,
    /// 95 % interval of the level; for k7 read upward on the circle, where 1 is 0.
    pub interval_95: Option<[f64; 2]>,
    /// True where the fault is there; left out for k7 and for what is not determined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detected: Option<bool>,
}

impl Fault {
    /// A level that the recording determines; `detected` is `None` for k7.
    pub fn determined(
        id: FaultId,
        value: f64,
        std: f64,
        interval_95: [f64; 2],
        detected: Option<bool>,
    ) -> Self {
        let (value, std, interval_95) = (Some(value), Some(std), Some(interval_95));
        Self { id, name: id.name().to_owned(), value, std, interval_95, detected }
    }

    /// A level that it does not.
    pub fn undetermined(id: FaultId) -> Self {
        let name = id.name().to_owned();
        Self { id, name, value: None, std: None, interval_95: None, detected: None }
    }
}

/// Joint uncertainty of what is determined, in the coordinates of the search.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Covariance {
    /// The coordinates of rows and columns: of `k1` to `k5`, `k6_cos` and `k6_sin`
    /// those that are determined.
    pub parameters: Vec<String>,
    /// The estimate of these coordinates, free of bounds: it may lie below zero, where the levels
    /// are cut. With the matrix it gives the region of (k6, k7) also while k7 is null.
    pub estimate: Vec<f64>,
    /// The covariance, row by row.
    pub matrix: Vec<Vec<f64>>,
}
