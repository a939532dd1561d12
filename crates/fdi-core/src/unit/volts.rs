//! The motor's voltage and the winding's thermometer in the evidence of a recording.

use inference::chi_squared_log_tail;

use crate::{
    online::{error::DiagnoseError, motor_voltage::MotorVoltage, run::Run},
    report::{Notice, NoticeCode},
    unit::{
        error::UnitError,
        evidence::Evidence,
        monitor::{STEP_OF_SPREAD, UnitMonitor},
        quantities::Quantities,
        search::{UnitFit, UnitSearchError},
        voltage::{FOUND, SHOWN, VoltageError, VoltageReading, VoltageRun},
    },
};

/// Chance, by the normal distribution, with which a voltage or a temperature of the machine is said to
/// contradict the rest.
const CONTRADICTION_RATE: f64 = 1e-6;

impl Run<'_> {
    /// Adds to the evidence of a recording what the motor's voltage shows, and says where it cannot be
    /// used, or where a thermometer contradicts the rest.
    pub(crate) fn read_voltage(
        &self,
        error: &UnitError,
        quantities: &Quantities,
        start_angle_rad: f64,
        fit: &mut UnitFit,
    ) -> Result<Vec<Notice>, DiagnoseError> {
        let mut notices = Vec::new();
        match self.voltage_reading(error, quantities, start_angle_rad, fit)? {
            Ok(reading) => fit.evidence.voltage = reading,
            Err(reason) => notices.push(unused(&reason)),
        }
        let sum = |fit: &UnitFit, has_voltage: bool, has_temperature: bool| {
            let mut evidence = fit.evidence.clone();
            evidence.voltage.take_if(|_| !has_voltage);
            evidence.temperature.take_if(|_| !has_temperature);
            self.least_sum(quantities, &evidence, &fit.point)
        };
        let contradicts = |with: Option<f64>, without: Option<f64>, numbers: usize| {
            let more = with.zip(without).map(|(with, without)| with - without);
            let log_chance = more.map(|more| chi_squared_log_tail(more, numbers));
            log_chance.is_some_and(|log_chance| log_chance < CONTRADICTION_RATE.ln())
        };
        // a thermometer is not to speak against the voltage, nor a wrong voltage against the thermometer
        if fit.evidence.voltage.is_some()
            && contradicts(sum(fit, true, false), sum(fit, false, false), SHOWN)
        {
            fit.evidence.voltage = None;
            notices.push(unused(
                "no machine within the tolerances shows it beside the current and the recordings as new: \
                 is it in V, of this motor, and its supply measured as theirs was?",
            ));
        }
        if fit.evidence.voltage.is_some()
            && fit.evidence.temperature.is_some()
            && contradicts(sum(fit, true, true), sum(fit, true, false), 1)
        {
            fit.evidence.temperature = None;
            notices.push(Notice {
                code: NoticeCode::TemperatureContradicts,
                message:
                    "the winding's temperature as read is not the one that current and voltage \
                          show, and is left out: look at the thermometer, and at \
                          `winding-temperature-sd-k`"
                        .to_owned(),
            });
        }
        Ok(notices)
    }

    /// Numbers that the motor's voltage shows; `None` where it was not recorded, and a reason where it is
    /// not used.
    fn voltage_reading(
        &self,
        error: &UnitError,
        quantities: &Quantities,
        start_angle_rad: f64,
        fit: &UnitFit,
    ) -> Result<Result<Option<VoltageReading>, String>, DiagnoseError> {
        let voltage_v = match &self.observation.motor_voltage {
            MotorVoltage::NotRecorded => return Ok(Ok(None)),
            MotorVoltage::Unusable(reason) => return Ok(Err(reason.clone())),
            MotorVoltage::Filtered(voltage_v) => voltage_v,
        };
        let because = |reason: &str| Ok(Err(reason.to_owned()));
        if self.observation.start_std_s() > 0.0 {
            return because("where the command begins is not known well enough");
        }
        let Some(learnt) = &error.voltage else {
            return because("the bundle has not learnt the voltage of its machine");
        };
        let experiment = self.experiment();
        let monitor = UnitMonitor::new(experiment, quantities, start_angle_rad);
        let run = |at: &[f64]| monitor.run(at).map_err(UnitSearchError::from);
        let filtered = |channel: &[f64]| monitor.filtered(channel);
        let at = quantities.at(&fit.point);
        let (trace, machine) = run(&at)?;
        let parts = VoltageRun { trace: &trace, machine: &machine, experiment }.filtered(filtered);
        let shown = parts.fit(voltage_v).filter(|shown| shown.left_v <= learnt.most_left_v());
        let Some(shown) = shown else { return Ok(Err(unexplained(learnt))) };
        let (mut changes_v, mut changes_of_mean) = (Vec::new(), Vec::new());
        for place in 0..at.len() {
            let step = STEP_OF_SPREAD * error.spread[place];
            let side = |by: f64| -> Result<[Vec<f64>; 2], UnitSearchError> {
                let mut moved = at.clone();
                moved[place] += by;
                let (trace, machine) = run(&moved)?;
                let moved_run = VoltageRun { trace: &trace, machine: &machine, experiment };
                let mut beside_mean = vec![0.0; FOUND];
                learnt.take_mean(&error.terms(&moved), &shown, &mut beside_mean);
                Ok([filtered(&moved_run.voltage_v(&shown.numbers)), beside_mean])
            };
            let [above, below] = [side(step)?, side(-step)?];
            let slope = |of: usize| {
                let pairs = above[of].iter().zip(&below[of]);
                pairs.map(|(above, below)| (above - below) / (2.0 * step)).collect::<Vec<f64>>()
            };
            changes_v.push(slope(0));
            changes_of_mean.push(slope(1));
        }
        let mut slopes = parts.found_by(&shown, &changes_v);
        for (slope, of_mean) in slopes.iter_mut().zip(&changes_of_mean) {
            slope.iter_mut().zip(of_mean).for_each(|(value, of_mean)| *value += of_mean);
        }
        let (terms, wideness) = (error.terms(&at), error.wideness(&at));
        let Some(mut reading) = learnt.reading(&terms, wideness, &shown, &slopes) else {
            return Ok(Err(unexplained(learnt)));
        };
        // the model's current is the measured one over the gain that the fit has found
        reading.numbers[1] -= quantities.mean_phase_gain(&fit.point);
        for (number, value) in reading.numbers.iter_mut().enumerate() {
            for (place, at) in at.iter().enumerate() {
                *value -= reading.by_quantities[(number, place)] * at;
            }
        }
        Ok(Ok(Some(reading)))
    }

    /// Least sum of squares of a recording's evidence with that of the others of its unit.
    fn least_sum(
        &self,
        quantities: &Quantities,
        evidence: &Evidence,
        point: &[f64],
    ) -> Option<f64> {
        let unit = self.plan.unit.as_deref();
        self.placed(unit, quantities, evidence).joint(point)?.least_sum(&[])
    }
}

fn unused(reason: &str) -> Notice {
    let message = format!("the motor's voltage is not used: {reason}");
    Notice { code: NoticeCode::VoltageUnused, message }
}

fn unexplained(learnt: &VoltageError) -> String {
    format!(
        "no machine like the bundle's shows it to {:.2} V: is it of this motor, in V, and positive where \
         it drives the shaft forwards?",
        learnt.most_left_v()
    )
}
