//! From a recording to its answer, with what all recordings of a batch share.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Result, bail};
use fdi_core::{
    ColumnMap, DiagnosedAlone, FileFormat, Metadata, RecordError, Recording,
    report::{Failure, RecordDiagnosis},
};

use crate::{Diagnoser, args::NameArgs, deciding::Deciding, identity::Identity, output::Answer};

/// Path and name of a recording that comes through standard input.
pub(crate) const STANDARD_INPUT: &str = "-";

/// A recording that is to be diagnosed.
#[derive(Clone, Debug)]
pub enum Source {
    /// A file.
    File(PathBuf),
    /// The bytes of a file that was read elsewhere.
    Bytes {
        /// Name that the answer has; its ending tells the format.
        name: String,
        /// Content of the file.
        bytes: Vec<u8>,
    },
    /// A recording in memory.
    Recording(Box<Recording>),
    /// A recording that could not be had.
    Broken(Failure),
}

impl Source {
    /// Name in answers.
    pub fn name(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::Bytes { name, .. } => name.clone(),
            Self::Recording(recording) => recording.name.clone(),
            Self::Broken(failure) => failure.recording.clone(),
        }
    }

    /// The path that its name is.
    pub(crate) fn path(&self) -> PathBuf {
        match self {
            Self::File(path) => path.clone(),
            other => other.name().into(),
        }
    }

    /// The file that it is.
    pub(crate) fn file(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            _ => None,
        }
    }

    fn metadata(&self) -> Metadata {
        match self {
            Self::Recording(recording) => recording.metadata.clone(),
            _ => Metadata::default(),
        }
    }
}

/// A failure of what has that name.
pub(crate) fn failure(path: &Path, error: String) -> Failure {
    Failure { recording: path.display().to_string(), actuator_id: None, date: None, error }
}

/// Values that all recordings of a batch share.
pub(crate) struct Batch<'a> {
    pub(crate) diagnoser: &'a dyn Diagnoser,
    pub(crate) map: ColumnMap,
    pub(crate) names: &'a NameArgs,
    pub(crate) stable: bool,
    pub(crate) one_a_line: bool,
    /// True where the answers are gone on with later.
    pub(crate) is_kept: bool,
    pub(crate) deciding: &'a Deciding,
}

impl Batch<'_> {
    /// Answer to a recording; what goes wrong with it, a panic included, is in the answer.
    pub(crate) fn answer(&self, source: &Source) -> Answer {
        match self.caught(source, |name, identity| self.diagnose(source, name, identity)) {
            Ok(record) => Answer::Diagnosed(Box::new(record)),
            Err(failure) => Answer::Failed(failure),
        }
    }

    /// A recording by itself, for an answer to several; what goes wrong with it as its failure.
    pub(crate) fn alone(&self, source: &Source) -> Result<DiagnosedAlone, Failure> {
        self.caught(source, |name, identity| self.diagnose_alone(source, name, identity))
    }

    /// Result of the work on a recording, else its failure: a defect that one recording brings to light must
    /// not take the others with it.
    fn caught<T>(
        &self,
        source: &Source,
        work: impl FnOnce(&Path, &mut Identity) -> Result<T>,
    ) -> Result<T, Failure> {
        if let Source::Broken(failure) = source {
            return Err(failure.clone());
        }
        let name = source.path();
        let mut identity = Identity::of(self.names, &name, &source.metadata());
        let outcome = catch_unwind(AssertUnwindSafe(|| work(&name, &mut identity)))
            .unwrap_or_else(|_| bail!("internal error, please report it"));
        let Identity { actuator_id, date, .. } = identity;
        let failed = |error| Failure { actuator_id, date, ..failure(&name, format!("{error:#}")) };
        outcome.map_err(failed)
    }

    fn diagnose(
        &self,
        source: &Source,
        name: &Path,
        identity: &mut Identity,
    ) -> Result<RecordDiagnosis> {
        let start = clock();
        let (recording, sha256) = self.read_named(source, name, identity)?;
        let mut record = self.diagnoser.diagnose(&recording)?;
        identity.put_into_answer(&mut record);
        record.recording_sha256 = sha256;
        record.elapsed_s = (!self.stable).then(|| start.elapsed().as_secs_f64());
        self.finish(&mut record, &[])?;
        Ok(record)
    }

    fn diagnose_alone(
        &self,
        source: &Source,
        name: &Path,
        identity: &mut Identity,
    ) -> Result<DiagnosedAlone> {
        let start = clock();
        let (recording, _) = self.read_named(source, name, identity)?;
        let mut alone = self.diagnoser.diagnose_alone(&recording)?;
        identity.put_into_answer(alone.answer_mut());
        alone.answer_mut().elapsed_s = (!self.stable).then(|| start.elapsed().as_secs_f64());
        Ok(alone)
    }

    /// Adds what the settings ask for to an answer, of several recordings by those to each of them.
    pub(crate) fn finish(
        &self,
        record: &mut RecordDiagnosis,
        alone: &[DiagnosedAlone],
    ) -> Result<()> {
        if self.one_a_line {
            // there is no head to name it
            record.bundle.get_or_insert_with(|| self.diagnoser.bundle_sha256().to_owned());
        }
        if self.deciding.is_asked() {
            self.deciding.decide(record, alone);
        }
        match record.not_finite() {
            Some(name) => bail!("internal error, please report it: `{name}` is not finite"),
            None => Ok(()),
        }
    }

    /// The recording with the identity that its name says, and the SHA-256 of its file where that is
    /// to be kept.
    fn read_named(
        &self,
        source: &Source,
        name: &Path,
        identity: &mut Identity,
    ) -> Result<(Recording, Option<String>)> {
        let (mut recording, sha256) = self.read(source, name)?;
        *identity = Identity::of(self.names, name, &recording.metadata);
        identity.put_into(&mut recording)?;
        Ok((recording, sha256))
    }

    /// The recording, and the SHA-256 of its file where that is to be kept.
    fn read(&self, source: &Source, name: &Path) -> Result<(Recording, Option<String>)> {
        let of_rate = |error| self.explain(error);
        match source {
            Source::File(path) => {
                let read = Recording::read_with_sha256(path, &self.map).map_err(of_rate)?;
                Ok((read.0, self.is_kept.then_some(read.1)))
            }
            Source::Bytes { name: named, bytes } => {
                let told = FileFormat::of(name);
                let shown = (named == STANDARD_INPUT).then(|| FileFormat::of_bytes(bytes));
                let format = told.or(shown).ok_or(RecordError::UnknownFormat { advice: "" })?;
                let read = Recording::from_bytes(named, format, bytes.clone(), &self.map);
                Ok((read.map_err(of_rate)?, None))
            }
            Source::Recording(recording) => Ok((Recording::clone(recording), None)),
            Source::Broken(failure) => bail!("{}", failure.error),
        }
    }

    /// Adds what the recording's rate says about it where its text breaks off.
    fn explain(&self, error: RecordError) -> anyhow::Error {
        let rates_hz = self.diagnoser.rates_hz();
        if !error.is_of_another_rate(rates_hz) {
            return error.into();
        }
        let mut known: Vec<_> = rates_hz.iter().map(|rate_hz| format!("{rate_hz} Hz")).collect();
        known.dedup();
        anyhow::anyhow!("{error}; the bundle is for {}", known.join(" or "))
    }
}

#[expect(clippy::disallowed_methods, reason = "the command line is where the clock is read")]
fn clock() -> Instant {
    Instant::now()
}
