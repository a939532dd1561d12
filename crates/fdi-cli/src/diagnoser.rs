//! The seam between the command line and the diagnosis.

use std::{fs, path::PathBuf, sync::OnceLock};

use anyhow::{Context, Result, anyhow};
use fdi_core::{
    Bundle, ColumnMap, DiagnoseOptions, EMBEDDED_BUNDLES, Encoding, FitSignals, Purpose, Recording,
    RootSeed, fitting_experiment, report::RecordDiagnosis,
};

use crate::DiagnoseArgs;

/// Diagnoses one recording after another, from several threads at once.
pub trait Diagnoser: Sync {
    /// SHA-256 of the bundle that stands at the head of the answer.
    fn bundle_sha256(&self) -> &str;

    /// SHA-256 of every bundle that answers may be made with.
    fn bundles(&self) -> Vec<&str> {
        vec![self.bundle_sha256()]
    }

    /// Rates that recordings may have, Hz: named when one cannot even be read and
    /// its rate is another.
    fn rates_hz(&self) -> &[f64];

    /// The answer to one recording, without the time it took.
    ///
    /// # Errors
    /// Why this recording cannot be diagnosed, in one line.
    fn diagnose(&self, recording: &Recording) -> Result<RecordDiagnosis>;

    /// The signals behind the answer to a recording, where it has any to show.
    ///
    /// # Errors
    /// As [`diagnose`](Self::diagnose).
    fn signals(&self, recording: &Recording) -> Result<Option<FitSignals>> {
        let _ = recording;
        Ok(None)
    }

    /// Name of the command that the recording is taken to be of, where that is known.
    fn command_name(&self, recording: &Recording) -> Option<&str> {
        let _ = recording;
        None
    }

    /// Name of the model whose recordings it diagnoses, where that is known.
    fn model_name(&self) -> Option<&str> {
        None
    }
}

/// The diagnosis that the options ask for.
pub(crate) fn diagnoser(args: &DiagnoseArgs, seed: RootSeed) -> Result<Box<dyn Diagnoser>> {
    let options = DiagnoseOptions {
        method: args.method,
        fidelity: args.fidelity,
        max_evaluations: args.max_evaluations.map(usize::from),
        noise_a: args.noise_a,
        max_delay_s: args.max_delay_s.unwrap_or(0.0),
        free_start: args.free_start,
        tolerance: args.tolerance,
        seed: seed.derive(Purpose::Diagnosis, 0),
    };
    let bundles = match &args.bundle {
        Some(path) => {
            let named = path.display().to_string();
            let bytes = fs::read(path).with_context(|| named.clone())?;
            vec![Prepared::read(&bytes).context(named)?]
        }
        None => EMBEDDED_BUNDLES
            .iter()
            .map(|embedded| Prepared::read(embedded.bytes).context("the embedded bundle"))
            .collect::<Result<_>>()?,
    };
    let map = ColumnMap::new(&args.map.map)?;
    let read =
        |path: &PathBuf| Recording::read(path, &map).with_context(|| path.display().to_string());
    let references = args.reference.iter().map(read).collect::<Result<Vec<_>>>()?;
    let rates_hz = bundles.iter().map(|one| one.bundle.experiment.filter.output_hz).collect();
    let encoding = args.encoding;
    Ok(Box::new(BundleDiagnoser { bundles, options, encoding, references, rates_hz }))
}

/// A bundle that is prepared when the first recording needs it.
struct Prepared {
    sha256: String,
    bundle: Bundle,
    ready: OnceLock<Result<fdi_core::Diagnoser, String>>,
}

impl Prepared {
    fn read(bytes: &[u8]) -> Result<Self> {
        let bundle = Bundle::from_bytes(bytes)?;
        Ok(Self { sha256: recordings::sha256_hex(bytes), bundle, ready: OnceLock::new() })
    }

    fn ready(&self, encoding: Encoding, references: &[Recording]) -> Result<&fdi_core::Diagnoser> {
        let prepare = || {
            let bundle = self.bundle.clone();
            if references.is_empty() {
                let ready = fdi_core::Diagnoser::with_encoding(bundle, encoding);
                return ready.map_err(|error| error.to_string());
            }
            fdi_core::Diagnoser::with_references(bundle, encoding, references)
                .map_err(|error| format!("the references: {error}"))
        };
        self.ready.get_or_init(prepare).as_ref().map_err(|error| anyhow!("{error}"))
    }
}

/// Diagnoses each recording with the bundle that fits it.
struct BundleDiagnoser {
    bundles: Vec<Prepared>,
    options: DiagnoseOptions,
    encoding: Encoding,
    references: Vec<Recording>,
    rates_hz: Vec<f64>,
}

impl BundleDiagnoser {
    /// The bundle that a recording is diagnosed with.
    fn fitting(&self, recording: &Recording) -> &Prepared {
        let experiments: Vec<_> = self.bundles.iter().map(|one| &one.bundle.experiment).collect();
        &self.bundles[fitting_experiment(&experiments, recording)]
    }
}

impl Diagnoser for BundleDiagnoser {
    fn bundle_sha256(&self) -> &str {
        &self.bundles[0].sha256
    }

    fn bundles(&self) -> Vec<&str> {
        self.bundles.iter().map(|one| one.sha256.as_str()).collect()
    }

    fn rates_hz(&self) -> &[f64] {
        &self.rates_hz
    }

    fn diagnose(&self, recording: &Recording) -> Result<RecordDiagnosis> {
        let prepared = self.fitting(recording);
        let mut answer =
            prepared.ready(self.encoding, &self.references)?.diagnose(recording, &self.options)?;
        if prepared.sha256 != self.bundle_sha256() {
            answer.bundle = Some(prepared.sha256.clone());
        }
        Ok(answer)
    }

    fn signals(&self, recording: &Recording) -> Result<Option<FitSignals>> {
        let ready = self.fitting(recording).ready(self.encoding, &self.references)?;
        let (_, signals) = ready.diagnose_with_signals(recording, &self.options)?;
        Ok(Some(signals))
    }

    fn command_name(&self, recording: &Recording) -> Option<&str> {
        Some(&self.fitting(recording).bundle.experiment.name)
    }

    fn model_name(&self) -> Option<&str> {
        Some(&self.bundles[0].bundle.experiment.model_name)
    }
}
