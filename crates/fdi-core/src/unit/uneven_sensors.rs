//! Current sensors whose gains differ by more than their tolerance.

use crate::{
    online::run::Run,
    report::{Notice, NoticeCode},
    unit::layout::{Acts, Layout},
};

/// Standard deviations of the tolerance by which the gain of a sensor may differ from the mean of all.
const MOST_UNEVEN: f64 = 6.0;

impl Run<'_> {
    /// The notice that the sum of the phases shows a sensor whose gain is beyond its tolerance.
    pub(crate) fn uneven_sensors(&self, layout: &Layout) -> Option<Notice> {
        let gains = self.observation.phase_sum?.gains;
        let away = layout.numbers.iter().filter_map(|number| match number.acts {
            // two thirds of its own variance and that of the mean
            Acts::PhaseGain(phase) => {
                let std = number.scatter.together() * (2.0_f64 / 3.0).sqrt();
                Some((phase, gains[phase].abs() / std))
            }
            _ => None,
        });
        let (phase, away) = away.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (away > MOST_UNEVEN).then(|| Notice {
            code: NoticeCode::SensorsUneven,
            message: format!(
                "the three phase currents do not sum to zero: the sensor of phase {} reads {:+.1} % beside \
                 the mean of the three, {away:.0} standard deviations of its tolerance; look at the \
                 sensor, its wiring and the unit of its column",
                ["A", "B", "C"][phase],
                100.0 * gains[phase]
            ),
        })
    }
}
