//! Learnt units on disk.

use ema_sim::EffectId;
use nalgebra::DMatrix;

use crate::{
    offline::store::{self, ArtefactKind, Decode, Encode, StoreError},
    unit::{
        contradiction::Agreement,
        evidence::{EmbeddedShare, Evidence, InCommon, TemperatureReading},
        layout::Component,
        learnt_unit::{LearntUnit, UnitRecording, UnitState},
        voltage::{SHOWN, VoltageReading},
    },
};

#[derive(Encode, Decode)]
struct UnitData {
    actuator_id: Option<String>,
    model_name: String,
    command: String,
    basis: String,
    replaced: [u32; Component::COUNT],
    recordings: Vec<RecordingData>,
}

#[derive(Encode, Decode)]
struct RecordingData {
    name: String,
    session: Option<String>,
    as_new: bool,
    replaced: [u32; Component::COUNT],
    at: Vec<f64>,
    /// Lower triangle, row by row.
    information: Vec<f64>,
    descent: Vec<f64>,
    /// Lower triangle, row by row.
    error: Vec<f64>,
    /// Shares of the error in common: of a unit, of a state of health, of a session.
    in_common: [f64; 3],
    embedded: Option<EmbeddedData>,
    /// Temperature of the winding beyond that of the model file, K, and its standard deviation.
    temperature_k: Option<[f64; 2]>,
    voltage: Option<VoltageData>,
    /// Symbols of effects that the residual has the form of.
    unmodelled: Vec<String>,
}

/// Error of the model that looks like other quantities.
#[derive(Encode, Decode)]
struct EmbeddedData {
    /// Lower triangle, row by row.
    error: Vec<f64>,
    in_common: [f64; 3],
}

/// Numbers that a voltage shows.
#[derive(Encode, Decode)]
struct VoltageData {
    numbers: [f64; SHOWN],
    /// A column a quantity.
    by_quantities: Vec<f64>,
    /// Row by row.
    covariance: Vec<f64>,
    in_common: [f64; 3],
}

impl VoltageData {
    fn of(reading: &VoltageReading) -> Self {
        Self {
            numbers: reading.numbers,
            by_quantities: reading.by_quantities.iter().copied().collect(),
            covariance: reading.covariance.iter().copied().collect(),
            in_common: reading.in_common.shares(),
        }
    }

    /// `None` where it is no reading beside so many numbers that the current shows.
    fn into_reading(self, shown: usize) -> Option<VoltageReading> {
        let mut numbers = self.numbers.iter().chain(&self.covariance).chain(&self.by_quantities);
        let quantities = self.by_quantities.len() / SHOWN;
        let fits = self.covariance.len() == SHOWN * SHOWN
            && self.by_quantities.len() == quantities * SHOWN
            && quantities <= shown
            && numbers.all(|x| x.is_finite());
        fits.then_some(())?;
        Some(VoltageReading {
            numbers: self.numbers,
            by_quantities: DMatrix::from_column_slice(SHOWN, quantities, &self.by_quantities),
            covariance: DMatrix::from_column_slice(SHOWN, SHOWN, &self.covariance),
            in_common: InCommon::of_shares(self.in_common)?,
        })
    }
}

impl RecordingData {
    fn of(recording: &UnitRecording) -> Self {
        let evidence = &recording.evidence;
        let rows = evidence.at.len();
        let lower = |of: &DMatrix<f64>| {
            let places = (0..rows).flat_map(|row| (0..=row).map(move |column| (row, column)));
            places.map(|place| of[place]).collect()
        };
        let temperature_k = evidence.temperature.map(|read| [read.away_k, read.std_k]);
        Self {
            name: recording.name.clone(),
            session: recording.session.clone(),
            as_new: recording.state == UnitState::AsNew,
            replaced: recording.replaced,
            at: evidence.at.clone(),
            information: lower(&evidence.information),
            descent: evidence.descent.clone(),
            error: lower(&evidence.error),
            in_common: evidence.in_common.shares(),
            embedded: evidence.embedded.as_ref().map(|one| EmbeddedData {
                error: lower(&one.error),
                in_common: one.in_common.shares(),
            }),
            temperature_k,
            voltage: evidence.voltage.as_ref().map(VoltageData::of),
            unmodelled: evidence.unmodelled.iter().map(|id| id.info().symbol.to_owned()).collect(),
        }
    }

    /// `None` where the sizes contradict one another.
    fn into_recording(self) -> Option<UnitRecording> {
        let rows = self.at.len();
        let numbers = [&self.at, &self.information, &self.descent, &self.error];
        let embedded = self.embedded.iter().map(|one| &one.error);
        let read = self.temperature_k.map(|[away_k, std_k]| TemperatureReading { away_k, std_k });
        let lower = rows * (rows + 1) / 2;
        let is_sound = self.information.len() == lower
            && self.error.len() == lower
            && embedded.clone().all(|error| error.len() == lower)
            && self.descent.len() == rows
            && read.is_none_or(|read| read.away_k.is_finite() && read.std_k > 0.0)
            && numbers.into_iter().chain(embedded).flatten().all(|value| value.is_finite());
        if !is_sound {
            return None;
        }
        let unmodelled = self.unmodelled.iter().map(|symbol| EffectId::find(symbol));
        let unmodelled = unmodelled.collect::<Option<Vec<_>>>()?;
        let whole = |lower: &[f64]| {
            DMatrix::from_fn(rows, rows, |row, column| {
                let (low, high) = (row.min(column), row.max(column));
                lower[high * (high + 1) / 2 + low]
            })
        };
        let (information, error) = (whole(&self.information), whole(&self.error));
        let in_common = InCommon::of_shares(self.in_common)?;
        let embedded = match self.embedded {
            Some(data) => Some(EmbeddedShare {
                error: whole(&data.error),
                in_common: InCommon::of_shares(data.in_common)?,
            }),
            None => None,
        };
        let voltage = match self.voltage {
            Some(data) => Some(data.into_reading(rows)?),
            None => None,
        };
        let (at, descent, temperature) = (self.at, self.descent, read);
        Some(UnitRecording {
            evidence: Evidence {
                at,
                information,
                descent,
                error,
                in_common,
                embedded,
                temperature,
                voltage,
                unmodelled,
            },
            name: self.name,
            session: self.session,
            state: if self.as_new { UnitState::AsNew } else { UnitState::Since },
            replaced: self.replaced,
        })
    }
}

impl LearntUnit {
    /// The bytes of a unit's file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let data = UnitData {
            actuator_id: self.actuator_id.clone(),
            model_name: self.model_name.clone(),
            command: self.command.clone(),
            basis: self.basis.clone(),
            replaced: self.replaced,
            recordings: self.recordings.iter().map(RecordingData::of).collect(),
        };
        store::encode(ArtefactKind::Unit, &data)
    }

    /// Reads a unit's file.
    ///
    /// # Errors
    ///
    /// [`StoreError`] for bytes that are no unit, or a damaged one.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, StoreError> {
        let kind = ArtefactKind::Unit;
        let data: UnitData = store::decode(bytes, kind)?;
        let rows = data.recordings.first().map(|one| one.at.len());
        let is_alike = data.recordings.iter().all(|one| Some(one.at.len()) == rows);
        let recordings = data.recordings.into_iter().map(RecordingData::into_recording);
        let recordings = recordings.collect::<Option<Vec<_>>>().filter(|_| is_alike);
        let reason = || "a recording whose numbers contradict one another".to_owned();
        Ok(Self {
            recordings: recordings.ok_or_else(|| StoreError::Payload { kind, reason: reason() })?,
            actuator_id: data.actuator_id,
            model_name: data.model_name,
            command: data.command,
            basis: data.basis,
            replaced: data.replaced,
            agreement: Agreement::default(),
        })
    }
}
