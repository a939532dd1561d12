//! Contents of a bundle, for people and scripts.

use crate::{
    offline::{
        bundle::{Bundle, BundleError},
        encoding_bounds::encoding_summaries,
    },
    report::{BundleSummary, DatasetSummary, Encoding, SCHEMA_VERSION},
    simulation::envelope::envelope_kind,
};

impl Bundle {
    /// Summary for people and scripts, with the cost of each encoding against the
    /// whole envelope: the median over the incipient conditions of the Cramér-Rao bounds' ratio.
    ///
    /// # Errors
    ///
    /// [`BundleError`] without an incipient dataset, or when nothing can be learnt from it.
    pub fn summary(&self, sha256: String) -> Result<BundleSummary, BundleError> {
        let experiment = &self.experiment;
        Ok(BundleSummary {
            schema_version: SCHEMA_VERSION,
            sha256,
            model: experiment.model_name.clone(),
            command: experiment.name.clone(),
            envelope: envelope_kind(experiment.envelope).name().to_owned(),
            rate_hz: experiment.filter.output_hz,
            filter_hz: experiment.filter.corner_hz,
            datasets: self
                .datasets
                .iter()
                .zip(&self.dataset_sha256)
                .map(|(dataset, sha256)| DatasetSummary {
                    name: dataset.design.name().to_owned(),
                    conditions: dataset.conditions.len() as u64,
                    seed: dataset.seed,
                    sha256: sha256.clone(),
                })
                .collect(),
            default_encoding: Encoding::Full,
            encodings: encoding_summaries(self)?,
        })
    }
}
