//! Reasons for which a recording is not diagnosed.

use inference::NotPositiveDefinite;

use crate::{
    offline::bundle::BundleError,
    online::observation_error::ObservationError,
    report::Method,
    unit::{learnt_unit::OtherBundle, search::UnitSearchError},
};

/// Why a recording could not be diagnosed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DiagnoseError {
    /// The recording does not fit the bundle.
    #[error(transparent)]
    Observation(#[from] ObservationError),
    /// The bundle's content cannot be used.
    #[error(transparent)]
    Bundle(#[from] BundleError),
    /// The covariance of noise and model error has no factor.
    #[error(transparent)]
    Covariance(#[from] NotPositiveDefinite),
    /// The search could not be run.
    #[error("the search failed: {reason}")]
    Search {
        /// Message of the solver.
        reason: String,
    },
    /// The emulator is of one start of the rotor.
    #[error(
        "method `emulator` is for recordings that are known to start at angle 0, and this one \
         {}; use `gls`",
        .found_rad.map_or("does not say".to_owned(), |rad| format!("starts at {rad:.4} rad"))
    )]
    EmulatorStart {
        /// Start angle of the recording.
        found_rad: Option<f64>,
    },
    /// The emulator looks at the whole signal.
    #[error("method `emulator` looks at the whole signal, not at an encoded one")]
    EmulatorEncoded,
    /// A scalar search with the high-fidelity model.
    #[error(
        "the high-fidelity model goes with the methods `gls`, `composite` and `emulator`, found `{method}`"
    )]
    HighFidelityMethod {
        /// The method asked for.
        method: Method,
    },
    /// A method that takes the start of the test as the bundle has it.
    #[error(
        "a start that is not the bundle's is estimated by the method `gls` with \
         `--fidelity low`"
    )]
    StartMethod,
    /// A reference recording from another start angle than the others, or that says none; or a
    /// recording from another one than the references.
    #[error(
        "recording and references start at one angle, known for each: found {}, expected {}",
        .found_rad.map_or("none".to_owned(), |rad| format!("{rad:.4} rad")),
        .expected_rad.map_or("one".to_owned(), |rad| format!("{rad:.4} rad"))
    )]
    ReferenceStart {
        /// Start angle found.
        found_rad: Option<f64>,
        /// Start angle of the references.
        expected_rad: Option<f64>,
    },
    /// A method that does not take references.
    #[error("references go with `--fidelity low` and any method but `emulator`")]
    ReferenceMethod,
    /// A largest delay that is no time.
    #[error("a largest delay of {found_s} s, expected 0 to {most_s} s")]
    MostDelay {
        /// Found.
        found_s: f64,
        /// Largest that is looked for.
        most_s: f64,
    },
    /// The recording cannot be explained by a machine within its tolerances.
    #[error(transparent)]
    Unit(#[from] UnitSearchError),
    /// The unit was learnt with another bundle.
    #[error(transparent)]
    OtherBundle(#[from] OtherBundle),
    /// A unit was given, and no machine within its tolerances is looked for.
    #[error("the unit cannot be used: {reason}")]
    UnitUnused {
        /// Why not.
        reason: String,
    },
    /// The recording is one that the unit was learnt from.
    #[error("the unit was learnt from this recording, as `{learnt_as}`")]
    OwnReference {
        /// Name under which the unit has it.
        learnt_as: String,
    },
    /// The recording leaves a fault without any effect on the signal.
    #[error(
        "the recording does not determine all faults looked for; \
         are its currents in A, and is it of this actuator?"
    )]
    Undetermined,
}
