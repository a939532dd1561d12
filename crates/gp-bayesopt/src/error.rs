//! Errors, one enum per family of operations.

/// Why a matrix could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MatrixError {
    /// The number of values does not fit the shape.
    #[error("{found} values where the shape needs {expected}")]
    Shape {
        /// Values needed.
        expected: usize,
        /// Values given.
        found: usize,
    },
}

/// Why a box could not be made or a point not used in it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BoundsError {
    /// No input at all.
    #[error("a box needs at least one input")]
    Empty,
    /// Lower and upper limits differ in number.
    #[error("{lower} lower limits but {upper} upper limits")]
    LengthMismatch {
        /// Lower limits given.
        lower: usize,
        /// Upper limits given.
        upper: usize,
    },
    /// A limit is not finite, or the interval is empty.
    #[error("input {input}: [{lower}, {upper}] is not an interval")]
    NotAnInterval {
        /// Which input.
        input: usize,
        /// The lower limit given.
        lower: f64,
        /// The upper limit given.
        upper: f64,
    },
    /// An input index beyond the box.
    #[error("input {input} of a box with {dimension}")]
    NoSuchInput {
        /// The index asked for.
        input: usize,
        /// Inputs of the box.
        dimension: usize,
    },
    /// A polar pair needs two different inputs that are not yet periodic or paired.
    #[error("inputs {radius} and {angle} cannot be joined to a polar pair")]
    PairTaken {
        /// The input asked to be the radius.
        radius: usize,
        /// The input asked to be the angle.
        angle: usize,
    },
    /// A point has the wrong number of coordinates.
    #[error("a point with {found} coordinates in a box with {expected}")]
    Dimension {
        /// Inputs of the box.
        expected: usize,
        /// Coordinates given.
        found: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("coordinate {input} is {value}")]
    NotFinite {
        /// Which coordinate.
        input: usize,
        /// The value given.
        value: f64,
    },
}

/// Why a design could not be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// The sequence has no direction numbers for that many inputs.
    #[error("Sobol' directions reach {supported} inputs, {found} asked for")]
    TooManyInputs {
        /// Inputs supported.
        supported: usize,
        /// Inputs of the box.
        found: usize,
    },
    /// A scaling exponent must be positive and finite, one for each input.
    #[error("{found} exponents for {expected} inputs, all must be positive and finite")]
    Exponents {
        /// Inputs of the box.
        expected: usize,
        /// Exponents given.
        found: usize,
    },
    /// More points asked for than the sequence holds.
    #[error("{found} points asked for, the sequence holds {supported}")]
    TooManyPoints {
        /// Points supported.
        supported: usize,
        /// Points asked for.
        found: usize,
    },
}

/// Why a solver for residual vectors could not go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError<E: std::error::Error + 'static> {
    /// The start is not a point of the box.
    #[error("start is not a point of the box")]
    Start(#[from] BoundsError),
    /// A setting is not usable.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The residual function failed; the best point so far is kept.
    #[error("residual function failed at evaluation {evaluation}")]
    Evaluation {
        /// Which evaluation, counted from one.
        evaluation: usize,
        /// The best point before it, with its residual, if there was one.
        best: Option<(Vec<f64>, Vec<f64>)>,
        /// The error of the function.
        #[source]
        source: E,
    },
    /// The residual at the start is empty, NaN or infinite.
    #[error("residual at the start is empty or not finite")]
    UnusableStart,
    /// The residual changed its length.
    #[error("residual of length {found} at evaluation {evaluation}, {expected} before")]
    LengthChanged {
        /// Which evaluation, counted from one.
        evaluation: usize,
        /// Length at the start.
        expected: usize,
        /// Length now.
        found: usize,
    },
}

/// Why a setting is not usable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingError {
    /// A list must hold one number for each input.
    #[error("{name}: {found} numbers for {expected} inputs")]
    Length {
        /// Name of the setting.
        name: &'static str,
        /// Inputs of the box.
        expected: usize,
        /// Numbers given.
        found: usize,
    },
    /// A number is outside what the setting allows.
    #[error("{name} is {value}, {needs}")]
    OutOfRange {
        /// Name of the setting.
        name: &'static str,
        /// The number given.
        value: f64,
        /// Condition that it must meet.
        needs: &'static str,
    },
    /// A start Jacobian of the wrong shape.
    #[error("start Jacobian is {rows} x {columns}, needed {needed_rows} x {needed_columns}")]
    JacobianShape {
        /// Rows given.
        rows: usize,
        /// Columns given.
        columns: usize,
        /// Rows needed.
        needed_rows: usize,
        /// Columns needed.
        needed_columns: usize,
    },
}

/// Why a covariance could not be had from a Jacobian.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CovarianceError {
    /// The Jacobian does not determine every input.
    #[error("information matrix is singular, smallest pivot {pivot:e} of largest {largest:e}")]
    Singular {
        /// Smallest pivot.
        pivot: f64,
        /// Largest diagonal entry.
        largest: f64,
    },
    /// The noise level is not positive and finite.
    #[error("noise standard deviation is {value}")]
    Noise {
        /// The level given.
        value: f64,
    },
}

/// Why a surrogate could not be fitted or extended.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// No observation at all.
    #[error("no observations")]
    NoObservations,
    /// Points and observations differ in number.
    #[error("{points} points but {observations} observations")]
    CountMismatch {
        /// Points given.
        points: usize,
        /// Observations given.
        observations: usize,
    },
    /// Observations differ in length.
    #[error("observation {observation} has {found} outputs, {expected} before")]
    OutputMismatch {
        /// Which observation.
        observation: usize,
        /// Outputs before.
        expected: usize,
        /// Outputs of this one.
        found: usize,
    },
    /// An observation is NaN or infinite.
    #[error("observation {observation} is {value}")]
    NotFinite {
        /// Which observation.
        observation: usize,
        /// The value given.
        value: f64,
    },
    /// A point is unusable.
    #[error("point {point} is unusable")]
    Point {
        /// Which point.
        point: usize,
        /// Why.
        #[source]
        source: BoundsError,
    },
    /// A setting is unusable.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The covariance stayed indefinite at the largest jitter tried.
    #[error("covariance not positive definite with jitter {jitter:e}")]
    NotPositiveDefinite {
        /// Largest jitter tried, relative to the signal variance.
        jitter: f64,
    },
}

/// Why an acquisition has no value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AcquisitionError {
    /// The point is unusable.
    #[error("point is unusable")]
    Point(#[from] BoundsError),
    /// The prediction is not finite.
    #[error("prediction with mean {mean} and standard deviation {std}")]
    Prediction {
        /// Predicted mean.
        mean: f64,
        /// Predicted standard deviation.
        std: f64,
    },
    /// The acquisition needs one output, the surrogate has several, or the reverse.
    #[error("surrogate has {found} outputs, the acquisition needs {expected}")]
    Outputs {
        /// Outputs needed.
        expected: usize,
        /// Outputs of the surrogate.
        found: usize,
    },
    /// The incumbent is NaN or infinite.
    #[error("incumbent value is {value}")]
    Incumbent {
        /// The value given.
        value: f64,
    },
    /// A setting is unusable.
    #[error(transparent)]
    Setting(#[from] SettingError),
}

/// Why a study could not go on; its data stay readable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A setting is unusable.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The design could not be drawn.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// A point is unusable.
    #[error(transparent)]
    Point(#[from] BoundsError),
    /// The surrogate could not be fitted.
    #[error("surrogate of {observations} observations could not be fitted")]
    Fit {
        /// Observations at hand.
        observations: usize,
        /// Why.
        #[source]
        source: FitError,
    },
    /// The acquisition has no value.
    #[error(transparent)]
    Acquisition(#[from] AcquisitionError),
    /// The outcome told is not of the kind that the study models.
    #[error("an outcome with {found} numbers was told, the study models {expected}")]
    OutcomeLength {
        /// Numbers modelled.
        expected: usize,
        /// Numbers told.
        found: usize,
    },
    /// A checkpoint does not fit the settings.
    #[error("checkpoint holds {found} where the settings have {expected} for {what}")]
    Checkpoint {
        /// Name of that which differs.
        what: &'static str,
        /// The settings' number.
        expected: usize,
        /// The checkpoint's number.
        found: usize,
    },
}
