//! `fdi diagnose` on recordings from anywhere.

use std::sync::Arc;

use fdi_cli::{Answer, Answers as InnerAnswers, Deciding, Head, Session as Inner, Source, Stopped};
use fdi_core::report::{Failure, Fleet, RecordDiagnosis};
use fdi_report::{DiagnosisPage, fault_figure_svg, fit_figure_svg};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyCapsule, PyDict},
};

use crate::{
    arrow_out,
    error::{OrRaise, plain, raised},
    python_in,
    recording::{Recording, metadata_of},
    table::{self, Reading},
    waiting::{guarded, waited},
};

/// Settings of a diagnosis, ready for recordings.
#[pyclass(frozen, module = "fdi._fdi")]
pub(crate) struct Session {
    inner: Arc<Inner>,
}

#[pymethods]
impl Session {
    #[new]
    fn new(py: Python<'_>, words: Vec<String>) -> PyResult<Self> {
        let made = waited::<(), _>(py, move |_| Inner::new(&words), |_, ()| Ok(()))?;
        Ok(Self { inner: Arc::new(made.or_raise(py)?) })
    }

    /// Answers to files and the recordings of folders.
    fn paths(
        &self,
        py: Python<'_>,
        paths: Vec<String>,
        told: Option<Py<PyAny>>,
    ) -> PyResult<Answers> {
        self.answers(py, Inner::sources(paths.iter().map(std::path::Path::new)), told)
    }

    /// Answers to the recordings of a table.
    #[expect(
        clippy::too_many_arguments,
        reason = "what a table is read with, from one Python call"
    )]
    fn table(
        &self,
        py: Python<'_>,
        table: &Bound<'_, PyAny>,
        group: Option<&str>,
        metadata: Option<&Bound<'_, PyDict>>,
        name: &str,
        nan_is_gap: bool,
        told: Option<Py<PyAny>>,
    ) -> PyResult<Answers> {
        let metadata = metadata_of(metadata)?;
        let sources = guarded(py, || {
            let columns = python_in::columns(table, nan_is_gap)?;
            let reading = Reading { map: self.inner.map(), group, metadata: &metadata, name };
            table::sources(&columns, &reading)
                .map_err(|error| raised(py, &error.message, Some(name), error.column.as_deref()))
        })?;
        self.answers(py, sources, told)
    }

    /// Answers to recordings in memory.
    fn recordings(
        &self,
        py: Python<'_>,
        recordings: Vec<Py<Recording>>,
        told: Option<Py<PyAny>>,
    ) -> PyResult<Answers> {
        let source = |one: &Py<Recording>| Source::Recording(Box::new(one.get().inner.clone()));
        self.answers(py, recordings.iter().map(source).collect(), told)
    }

    /// Drawing of a recording beside the model that explains it, as SVG.
    fn fit_figure(&self, py: Python<'_>, recording: &Recording) -> PyResult<Option<String>> {
        let (session, recording) = (self.inner.clone(), recording.inner.clone());
        let draw = move |_: &_| {
            let signals = session.signals(&recording)?;
            let mut record = None;
            let source = [Source::Recording(Box::new(recording))];
            let _ = session.answers(&source, |answer| {
                record = Some(answer);
                Ok(())
            });
            Ok::<_, anyhow::Error>(match (record, signals) {
                (Some(Answer::Diagnosed(record)), Some(signals)) => {
                    Some(fit_figure_svg(&record, &signals))
                }
                _ => None,
            })
        };
        waited::<(), _>(py, draw, |_, ()| Ok(()))?.or_raise(py)
    }
}

impl Session {
    /// Diagnoses recordings; `told` hears of each answer: its name, how many are done, of how many.
    fn answers(
        &self,
        py: Python<'_>,
        sources: Vec<Source>,
        told: Option<Py<PyAny>>,
    ) -> PyResult<Answers> {
        let total = sources.len();
        let mut answers: Vec<Answer> = Vec::with_capacity(total);
        let session = self.inner.clone();
        waited(
            py,
            move |teller| {
                let emit = |answer| if teller.tell(answer) { Ok(()) } else { Err(Stopped) };
                // that nobody waits is known to who has gone
                let _ = session.answers(&sources, emit);
            },
            |py, answer: Answer| {
                if let Some(told) = &told {
                    told.call1(py, (answer.recording(), answers.len() + 1, total))?;
                }
                answers.push(answer);
                Ok(())
            },
        )?;
        Ok(Answers { inner: InnerAnswers { head: self.inner.head(), answers } })
    }
}

/// Answers, in the order of the recordings.
#[pyclass(frozen, module = "fdi._fdi")]
pub(crate) struct Answers {
    inner: InnerAnswers,
}

#[pymethods]
impl Answers {
    fn __len__(&self) -> usize {
        self.inner.answers.len()
    }

    /// SHA-256 of the bundle at the head of the answers.
    #[getter]
    fn bundle(&self) -> &str {
        &self.inner.head.bundle
    }

    /// Seed of what is random.
    #[getter]
    fn seed(&self) -> u64 {
        self.inner.head.seed
    }

    /// The product of `fdi diagnose --output-format FORM`.
    fn written<'py>(&self, py: Python<'py>, form: &str) -> PyResult<Bound<'py, PyBytes>> {
        guarded(py, || Ok(PyBytes::new(py, &self.inner.written(form).or_raise(py)?)))
    }

    /// Each answer as JSON; a failure has `error`.
    fn lines(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let line = |answer: &Answer| match answer {
            Answer::Diagnosed(record) => serde_json::to_string(record),
            Answer::Failed(failure) => serde_json::to_string(failure),
        };
        self.inner.answers.iter().map(line).collect::<Result<_, _>>().or_raise(py)
    }

    /// Answers of such lines.
    #[staticmethod]
    fn of_lines(py: Python<'_>, bundle: String, seed: u64, lines: Vec<String>) -> PyResult<Self> {
        let answer = |line: &String| {
            let record = serde_json::from_str::<RecordDiagnosis>(line);
            match record {
                Ok(record) => Ok(Answer::Diagnosed(Box::new(record))),
                Err(error) => serde_json::from_str::<Failure>(line)
                    .map(Answer::Failed)
                    .map_err(|_| plain(py, &format!("no answer: {error}"))),
            }
        };
        let answers = lines.iter().map(answer).collect::<PyResult<_>>()?;
        let head = Head { bundle, seed, stamp: None, part: None };
        Ok(Self { inner: InnerAnswers { head, answers } })
    }

    /// The table as a stream of Arrow.
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // a schema that is asked for is a wish, which this need not grant
        let _ = requested_schema;
        guarded(py, || arrow_out::stream(py, &self.inner))
    }

    /// The table: names of the columns, and the cells of each.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        guarded(py, || arrow_out::lists(py, &self.inner))
    }

    /// Drawing of the levels of an answer, as SVG; `None` where the recording failed.
    fn fault_figure(&self, py: Python<'_>, place: usize) -> PyResult<Option<String>> {
        let draw = || match self.inner.answers.get(place) {
            Some(Answer::Diagnosed(record)) => Some(fault_figure_svg(record)),
            _ => None,
        };
        guarded(py, || Ok(draw()))
    }

    /// The report: one page in HTML.
    fn page(&self, py: Python<'_>, warning_change: f64) -> PyResult<String> {
        let tool = concat!("fdi ", env!("CARGO_PKG_VERSION"));
        let records = Deciding::default().decided(self.inner.records().cloned());
        let failures: Vec<Failure> = self.inner.failures().cloned().collect();
        let page = DiagnosisPage {
            records: &records,
            tests: &[],
            failures: &failures,
            fleet: &Fleet::of(&records, tool, warning_change),
            tool,
            bundle: &self.inner.head.bundle,
            seed: self.inner.head.seed,
            stamp: None,
            next: None,
            settings: Vec::new(),
        };
        let html = || page.page(|_| Ok::<_, anyhow::Error>(None)).map(|page| page.html());
        guarded(py, || html().or_raise(py))
    }
}
