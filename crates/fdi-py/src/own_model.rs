//! Models written in Python: what they are asked, and the ports that they ask.

use std::sync::{Arc, Mutex, PoisonError};

use own_model::{
    Geometry, ModelError, Number, OwnModel, Ports, PortsInUse, Record, Recordings, Test,
};
use pyo3::{
    exceptions::PyIndexError,
    prelude::*,
    types::{PyDict, PyList},
};

use crate::{
    error::plain,
    own_document,
    waiting::{Teller, waited},
};

/// A number: key, value, tolerance, scale, least, most.
type GivenNumber = (String, f64, Option<f64>, Option<f64>, f64, f64);
/// A test: name, command, load.
type GivenTest = (String, Vec<f64>, Vec<f64>);

/// A model as Python gives it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct GivenModel {
    run: Py<PyAny>,
    name: String,
    numbers: Vec<GivenNumber>,
    signals: Vec<String>,
    ports: Vec<String>,
    linear: bool,
    rate_hz: f64,
}

/// Recordings: tests with the signals measured in them.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct GivenRecords {
    train: Vec<(GivenTest, Vec<Vec<f64>>)>,
    holdout: Vec<(GivenTest, Vec<Vec<f64>>)>,
    tests: Vec<GivenTest>,
}

/// Explains, calibrates or proposes with a model of Python: a JSON document.
#[pyfunction]
pub(crate) fn of_own_model(
    py: Python<'_>,
    task: String,
    model: GivenModel,
    records: GivenRecords,
) -> PyResult<String> {
    let raised = Arc::new(Mutex::new(None));
    let (kept, name) = (Arc::clone(&raised), model.name.clone());
    let work = move |teller: &Teller<(), Result<String, ModelError>>| {
        let geometry = if model.linear { Geometry::Linear } else { Geometry::Rotary };
        let rate_hz = model.rate_hz;
        let test = |(_, command, load): GivenTest| Test { rate_hz, command, load };
        let record = |(given, signals): (GivenTest, Vec<Vec<f64>>)| {
            let name = given.0.clone();
            Record { name, test: test(given), signals }
        };
        let model = PythonModel::new(model, kept, teller);
        let train: Vec<Record> = records.train.into_iter().map(record).collect();
        let holdout: Vec<Record> = records.holdout.into_iter().map(record).collect();
        let recordings = Recordings { train: &train, holdout: &holdout };
        match task.as_str() {
            "calibrate" => own_model::calibrate(&model, recordings)
                .map(|told| own_document::calibration(&name, &told)),
            "propose" => {
                let named = |given: GivenTest| (given.0.clone(), test(given));
                let tests: Vec<(String, Test)> = records.tests.into_iter().map(named).collect();
                own_model::propose(&model, geometry, recordings, &tests)
                    .map(|told| own_document::proposal(&name, &told))
            }
            _ => own_model::explain(&model, geometry, recordings)
                .map(|told| own_document::explanation(&name, &told)),
        }
    };
    waited(py, work, |_, ()| Ok(()))?.map_err(|error| {
        let told = plain(py, &error.to_string());
        let cause = raised.lock().unwrap_or_else(PoisonError::into_inner).take();
        told.set_cause(py, cause);
        told
    })
}

/// A model that is a callable of Python.
struct PythonModel<'a> {
    run: Py<PyAny>,
    numbers: Vec<Number>,
    signals: Vec<String>,
    ports: Ports,
    /// Exception that the callable raised.
    raised: Arc<Mutex<Option<PyErr>>>,
    teller: &'a Teller<(), Result<String, ModelError>>,
}

impl<'a> PythonModel<'a> {
    fn new(
        given: GivenModel,
        raised: Arc<Mutex<Option<PyErr>>>,
        teller: &'a Teller<(), Result<String, ModelError>>,
    ) -> Self {
        let number = |(key, value, tolerance, scale, least, most)| Number {
            key,
            value,
            tolerance,
            scale,
            least,
            most,
        };
        let GivenModel { run, numbers, signals, .. } = given;
        let numbers = numbers.into_iter().map(number).collect();
        let has = |port: &str| given.ports.iter().any(|given| given == port);
        let ports = Ports { load: has("load"), drive: has("drive"), sensor: has("sensor") };
        Self { run, numbers, signals, ports, raised, teller }
    }

    /// Calls the callable.
    fn call(
        &self,
        py: Python<'_>,
        numbers: &[f64],
        test: &Test,
        ports: &SharedPorts,
    ) -> PyResult<Vec<Vec<f64>>> {
        let by_key = PyDict::new(py);
        for (number, value) in self.numbers.iter().zip(numbers) {
            by_key.set_item(&number.key, value)?;
        }
        let at = PyDict::new(py);
        if self.ports.load {
            at.set_item("load", Bound::new(py, LoadPort(ports.clone()))?)?;
        }
        if self.ports.drive {
            at.set_item("drive", Bound::new(py, DrivePort(ports.clone()))?)?;
        }
        if self.ports.sensor {
            at.set_item("sensor", Bound::new(py, SensorPort(ports.clone()))?)?;
        }
        let command = PyList::new(py, &test.command)?;
        let made = self.run.bind(py).call((by_key, command), Some(&at))?;
        self.signals.iter().map(|name| signal(&made, name)).collect()
    }
}

/// One signal of what a model gave.
fn signal(made: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let py = made.py();
    let found = made.get_item(name).map_err(|_| {
        plain(py, &format!("the model gave no signal `{name}`: expected it among what it returns"))
    })?;
    let list = if found.hasattr("tolist")? { found.call_method0("tolist")? } else { found };
    list.extract().map_err(|_| {
        plain(py, &format!("the model gave a signal `{name}` that is no sequence of numbers"))
    })
}

impl OwnModel for PythonModel<'_> {
    fn numbers(&self) -> &[Number] {
        &self.numbers
    }

    fn signals(&self) -> &[String] {
        &self.signals
    }

    fn ports(&self) -> Ports {
        self.ports
    }

    fn run(
        &self,
        numbers: &[f64],
        test: &Test,
        ports: &mut PortsInUse,
    ) -> Result<Vec<Vec<f64>>, ModelError> {
        if self.teller.is_stopped() {
            return Err(ModelError::Stopped);
        }
        let shared =
            SharedPorts { ports: Arc::new(Mutex::new(ports.clone())), samples: test.command.len() };
        let made = Python::attach(|py| self.call(py, numbers, test, &shared));
        *ports = shared.with(|used| used.clone());
        made.map_err(|error| {
            let told = error.to_string();
            *self.raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            ModelError::Run(told)
        })
    }
}

/// The ports of one run, as the callable holds them.
#[derive(Clone)]
struct SharedPorts {
    ports: Arc<Mutex<PortsInUse>>,
    samples: usize,
}

impl SharedPorts {
    fn with<T>(&self, ask: impl FnOnce(&mut PortsInUse) -> T) -> T {
        ask(&mut self.ports.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn check(&self, sample: usize) -> PyResult<()> {
        if sample < self.samples {
            return Ok(());
        }
        let samples = self.samples;
        let told = format!("a port was asked for sample {sample} of a command of {samples}");
        Err(PyIndexError::new_err(told))
    }
}

/// Torque, or force, against the motion.
#[pyclass(frozen, module = "fdi._fdi")]
struct LoadPort(SharedPorts);

#[pymethods]
impl LoadPort {
    fn __call__(&self, sample: usize, position: f64, speed: f64) -> PyResult<f64> {
        self.0.check(sample)?;
        Ok(self.0.with(|ports| ports.load(sample, position, speed)))
    }
}

/// Port between controller and drive.
#[pyclass(frozen, module = "fdi._fdi")]
struct DrivePort(SharedPorts);

#[pymethods]
impl DrivePort {
    fn __call__(&self, sample: usize, asked: f64) -> PyResult<f64> {
        self.0.check(sample)?;
        Ok(self.0.with(|ports| ports.drive(sample, asked)))
    }
}

/// The position that a sensor shows.
#[pyclass(frozen, module = "fdi._fdi")]
struct SensorPort(SharedPorts);

#[pymethods]
impl SensorPort {
    fn __call__(&self, sample: usize, position: f64) -> PyResult<f64> {
        self.0.check(sample)?;
        Ok(self.0.with(|ports| ports.sensor(sample, position)))
    }
}
