//! The envelope of an experiment: filter, rate and name.

use ema_sim::Envelope;
use recordings::EnvelopeKind;

use crate::simulation::experiment::Experiment;

/// Filters an envelope at its own rate and takes it at the experiment's.
///
/// A rate that is no whole multiple of the output's is first brought to the next one, straight
/// between samples: the filter is exact for such a signal.
pub(crate) fn filtered(envelope_a: &[f64], rate_hz: f64, experiment: &Experiment) -> Vec<f64> {
    let filter = experiment.filter;
    let multiple = rate_hz / filter.output_hz;
    let mut signal = if (multiple - multiple.round()).abs() < 1e-6 {
        filter.apply(envelope_a, rate_hz)
    } else {
        let fine_hz = multiple.ceil() * filter.output_hz;
        let count = ((envelope_a.len() - 1) as f64 * fine_hz / rate_hz).floor() as usize + 1;
        let fine: Vec<f64> = (0..count)
            .map(|n| {
                let place = n as f64 * rate_hz / fine_hz;
                let before = (place.floor() as usize).min(envelope_a.len() - 2);
                let share = place - before as f64;
                envelope_a[before] + share * (envelope_a[before + 1] - envelope_a[before])
            })
            .collect();
        filter.apply(&fine, fine_hz)
    };
    signal.truncate(experiment.samples());
    signal
}

/// The name in metadata of an envelope of the simulation.
pub(crate) fn envelope_kind(envelope: Envelope) -> EnvelopeKind {
    match envelope {
        Envelope::HalfAbsSum => EnvelopeKind::HalfAbsSum,
        Envelope::SignedProjection => EnvelopeKind::SignedProjection,
        Envelope::QAxis => EnvelopeKind::QAxis,
        _ => EnvelopeKind::ConductingPhase,
    }
}

/// The envelope of the simulation by its name in metadata.
pub(crate) fn envelope_of(kind: EnvelopeKind) -> Envelope {
    match kind {
        EnvelopeKind::HalfAbsSum => Envelope::HalfAbsSum,
        EnvelopeKind::SignedProjection => Envelope::SignedProjection,
        EnvelopeKind::QAxis => Envelope::QAxis,
        EnvelopeKind::ConductingPhase => Envelope::ConductingPhase,
    }
}
