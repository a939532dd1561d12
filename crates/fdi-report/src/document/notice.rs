//! Notices: facts that the reader of an answer should know.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Something the reader of the answer should know.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Notice {
    /// Kind of notice.
    pub code: NoticeCode,
    /// Text of the notice.
    pub message: String,
}

/// Subject of a notice.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum NoticeCode {
    /// The rotor's angle at the start is not known: k3 to k7 are null.
    StartAngleUnknown,
    /// The rotor's angle is read off the commutation, which repeats with each electrical turn: k7
    /// is null.
    ElectricalTurnUnknown,
    /// No eccentricity is detected, so that it has no direction: k7 is null.
    PhaseUndetermined,
    /// The recording does not say its command; that of the bundle is assumed.
    CommandAssumed,
    /// A level lies beyond the range that the bundle is learnt on; intervals are widened.
    OutsideTraining,
    /// The rotor starts at an angle that the bundle has no signals of; intervals may be too narrow.
    StartAngleNotLearnt,
    /// The emulator does not explain the recording; the answer is that of `gls`.
    EmulatorReplaced,
    /// The phases are sampled more slowly than the intervals and the test of fit know.
    PhasesSampledSlowly,
    /// The noise on the phases is far above what the bundle expects.
    NoiseAboveBundle,
    /// Noise on the phases could hide a level beyond the incipient ones where nothing is detected.
    NoiseHidesLevels,
    /// The recording begins before the command; what is before it is left out.
    BeginsBeforeCommand,
    /// The start of the test was estimated with the faults.
    StartEstimated,
    /// Another start of the test would explain the recording better.
    StartSuspected,
    /// Levels are against reference recordings of the machine as new.
    ReferenceUsed,
    /// The search ended before the model explained the recording: nothing is determined.
    SearchUnfinished,
    /// Few numbers were looked at in place of the whole signal.
    Encoded,
    /// The machine is taken to be exactly its model file, though tolerances were asked for.
    TolerancesUnused,
    /// The tolerances leave a level open up to where it should be watched.
    TolerancesHideLevels,
    /// The residual has the form of physics that the model file does not have.
    UnmodelledPhysics,
    /// The winding's temperature was read, and the model file has no law of temperature.
    TemperatureUnused,
    /// The winding's temperature as read contradicts what currents and voltage show.
    TemperatureContradicts,
    /// The recording is under another load than the test of the bundle.
    LoadDiffers,
    /// The motor's voltage was recorded and is not used.
    VoltageUnused,
    /// Samples were put in order, filled, or brought onto an even clock.
    SamplesMended,
    /// The current of a phase is not recorded and follows from the two others.
    PhaseComputed,
    /// The rotor's angle shows another order or sense of the phases than the columns state.
    PhasesRewired,
    /// Recordings that the answer to several together does not rest on.
    RecordingsLeftOut,
    /// Recordings given more than once, which the answer to several together counts once.
    RecordingsRepeated,
    /// No machine in one state of health explains the recordings together.
    RecordingsDisagree,
    /// The recordings of the machine as new contradict one another and are not used.
    ReferencesDisagree,
    /// The phase currents do not sum to zero within the tolerance of their sensors' gains.
    SensorsUneven,
}

impl NoticeCode {
    /// Every code.
    pub const ALL: [Self; 31] = [
        Self::StartAngleUnknown,
        Self::ElectricalTurnUnknown,
        Self::PhaseUndetermined,
        Self::CommandAssumed,
        Self::OutsideTraining,
        Self::StartAngleNotLearnt,
        Self::EmulatorReplaced,
        Self::PhasesSampledSlowly,
        Self::NoiseAboveBundle,
        Self::NoiseHidesLevels,
        Self::BeginsBeforeCommand,
        Self::StartEstimated,
        Self::StartSuspected,
        Self::ReferenceUsed,
        Self::SearchUnfinished,
        Self::Encoded,
        Self::TolerancesUnused,
        Self::TolerancesHideLevels,
        Self::UnmodelledPhysics,
        Self::TemperatureUnused,
        Self::TemperatureContradicts,
        Self::LoadDiffers,
        Self::VoltageUnused,
        Self::SamplesMended,
        Self::PhaseComputed,
        Self::PhasesRewired,
        Self::RecordingsLeftOut,
        Self::RecordingsRepeated,
        Self::RecordingsDisagree,
        Self::ReferencesDisagree,
        Self::SensorsUneven,
    ];

    /// The code as JSON has it.
    pub fn code(self) -> &'static str {
        match self {
            Self::StartAngleUnknown => "start-angle-unknown",
            Self::ElectricalTurnUnknown => "electrical-turn-unknown",
            Self::PhaseUndetermined => "phase-undetermined",
            Self::CommandAssumed => "command-assumed",
            Self::OutsideTraining => "outside-training",
            Self::StartAngleNotLearnt => "start-angle-not-learnt",
            Self::EmulatorReplaced => "emulator-replaced",
            Self::PhasesSampledSlowly => "phases-sampled-slowly",
            Self::NoiseAboveBundle => "noise-above-bundle",
            Self::NoiseHidesLevels => "noise-hides-levels",
            Self::BeginsBeforeCommand => "begins-before-command",
            Self::StartEstimated => "start-estimated",
            Self::StartSuspected => "start-suspected",
            Self::ReferenceUsed => "reference-used",
            Self::SearchUnfinished => "search-unfinished",
            Self::Encoded => "encoded",
            Self::TolerancesUnused => "tolerances-unused",
            Self::TolerancesHideLevels => "tolerances-hide-levels",
            Self::UnmodelledPhysics => "unmodelled-physics",
            Self::TemperatureUnused => "temperature-unused",
            Self::TemperatureContradicts => "temperature-contradicts",
            Self::LoadDiffers => "load-differs",
            Self::VoltageUnused => "voltage-unused",
            Self::SamplesMended => "samples-mended",
            Self::PhaseComputed => "phase-computed",
            Self::PhasesRewired => "phases-rewired",
            Self::RecordingsLeftOut => "recordings-left-out",
            Self::RecordingsRepeated => "recordings-repeated",
            Self::RecordingsDisagree => "recordings-disagree",
            Self::ReferencesDisagree => "references-disagree",
            Self::SensorsUneven => "sensors-uneven",
        }
    }
}
