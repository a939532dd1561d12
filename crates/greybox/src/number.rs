//! Numbers of the model file that recordings have beyond their tolerance.

use inference::{Whitener, chi_squared_log_tail};

use crate::{
    error::GreyboxError, explain::Session, explained::WrongNumber, interval::Z_95, machine::Rough,
    rival::Judged, structure::Target,
};

impl Session<'_> {
    /// Numbers that a fit has beyond their tolerance, which fitted worse within it: by more than
    /// chance, and what was held out does not speak against it.
    ///
    /// A tolerance that the file states holds; what it states without one has the usual tolerance and
    /// may be anything.
    pub(crate) fn wrong_numbers(
        &self,
        judged: &Judged,
        whitener: &Whitener,
    ) -> Result<Vec<WrongNumber>, GreyboxError> {
        let covariance = judged.covariance(&self.train, whitener);
        let fitted = &judged.fitted;
        let scales =
            self.machine.scales_of(&fitted.structure.state(self.machine, &fitted.values).rough);
        let suspects = self.machine.rough().iter().filter(|rough| !rough.is_stated).count();
        let mut wrong = Vec::new();
        for (place, free) in fitted.structure.free.iter().enumerate() {
            let Target::Rough(number) = free.target else { continue };
            let rough = &self.machine.rough()[number];
            let half = Z_95 * libm::sqrt(covariance[(place, place)].max(0.0));
            let value = scales[number] * fitted.values[place];
            let interval_95 = [-half, half].map(|off| value + scales[number] * off);
            if rough.is_stated || !is_outside(rough, interval_95) {
                continue;
            }
            let mut within = fitted.structure.clone().started_at(&fitted.values);
            let held = &mut within.free[place];
            (held.least, held.most) = rough.tolerance();
            let Some(within) = self.judged(within, whitener)? else { continue };
            let gain = judged.gain_over(&within);
            let fall = within.fitted.objective - fitted.objective;
            let log_p = chi_squared_log_tail(2.0 * fall.max(0.0), 1) + libm::log(suspects as f64);
            let is_chance = gain.log_chance_with(log_p) > libm::log(self.options.false_alarm_rate);
            let is_refuted = gain.nats < -self.options.gain_std_errors * gain.std_error;
            if is_chance || is_refuted {
                continue;
            }
            wrong.push(WrongNumber {
                key: rough.key.clone(),
                nominal: rough.value,
                tolerance: rough.half_width,
                value,
                interval_95,
                p_familywise: libm::exp(log_p.min(0.0)),
                holdout_gain_nats: gain.nats,
                holdout_gain_se: gain.std_error,
            });
        }
        Ok(wrong)
    }
}

/// Tells whether an interval holds nothing of the tolerance of a number.
fn is_outside(rough: &Rough, [low, high]: [f64; 2]) -> bool {
    let (least, most) = rough.tolerance();
    low > most || high < least
}
