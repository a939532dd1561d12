//! The motor's voltage and the winding's thermometer in the evidence of a recording.

use std::convert::Infallible;

use ema_sim::{MotorMotion, SimulationError};
use inference::chi_squared_log_tail;

use crate::{
    online::{error::DiagnoseError, motor_voltage::MotorVoltage, run::Run},
    report::{Notice, NoticeCode},
    unit::{
        answer::is_severe,
        error::UnitError,
        evidence::Evidence,
        monitor::{UnitMonitor, slopes_of},
        quantities::{Quantities, UnitMachine},
        search::{UnitFit, UnitSearchError},
        voltage::{FOUND, SHOWN, VoltageError, VoltageReading, VoltageRun},
    },
};

/// Chance, by the normal distribution, with which a voltage or a temperature of the machine is said to
/// contradict the rest.
const CONTRADICTION_RATE: f64 = 1e-6;
/// Quantities in which the voltage's slopes are simulated at once, either side of each.
const PLACES_AT_ONCE: usize = 8;

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
            Err(reason) => notices.push(self.unused(&reason)),
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
            notices.push(self.contradicting());
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
            MotorVoltage::Filtered { voltage_v, .. } => voltage_v,
        };
        let because = |reason: &str| Ok(Err(reason.to_owned()));
        if self.observation.start_std_s() > 0.0 {
            return because("where the command begins is not known well enough");
        }
        let Some(learnt) = &error.voltage else {
            return because("the bundle has not learnt the voltage of its machine");
        };
        // a load changes the current, which the signal is rid of, and with it the voltage, which is not
        let loaded = self.observation.other_load.as_ref().map(|load| load.test(self.experiment()));
        let experiment = loaded.as_ref().unwrap_or(self.experiment());
        let under_load = loaded.as_ref().map(Quantities::new);
        let under_load = under_load.as_ref().unwrap_or(quantities);
        let monitor = UnitMonitor::new(experiment, under_load, start_angle_rad);
        let (at, at_load) = (quantities.at(&fit.point), under_load.at(&fit.point));
        let (motion, machine) = monitor.run(&at_load).map_err(UnitSearchError::from)?;
        let run = VoltageRun { motion: &motion, machine: &machine, experiment };
        let parts = run.filtered(|channels| monitor.filtered_each(channels));
        let shown = parts.fit(voltage_v).filter(|shown| shown.left_v <= learnt.most_left_v());
        let Some(shown) = shown else { return Ok(Err(unexplained(learnt, fit))) };
        let voltages = |moved: &[Vec<f64>]| {
            let voltage_v = |(motion, machine): &(MotorMotion, UnitMachine)| {
                VoltageRun { motion, machine, experiment }.voltage_v(&shown.numbers)
            };
            let voltages: Vec<Vec<f64>> = monitor.runs(moved)?.iter().map(voltage_v).collect();
            Ok::<_, SimulationError>(monitor.filtered_each(&voltages))
        };
        let means = |moved: &[Vec<f64>]| {
            let beside = moved.iter().map(|moved| {
                let mut beside_mean = vec![0.0; FOUND];
                learnt.take_mean(&error.terms(moved), &shown, &mut beside_mean);
                beside_mean
            });
            Ok::<_, Infallible>(beside.collect())
        };
        let Ok(changes_of_mean) = slopes_of(&at, 0..at.len(), &error.spread, means);
        let places: Vec<usize> = (0..at.len()).collect();
        let mut changes_v = Vec::new();
        // more at once would need more room than their lanes
        for places in places.chunks(PLACES_AT_ONCE) {
            let changes = slopes_of(&at_load, places.iter().copied(), &error.spread, voltages);
            changes_v.extend(changes.map_err(UnitSearchError::from)?);
        }
        let mut slopes = parts.found_by(&shown, &changes_v);
        for (slope, of_mean) in slopes.iter_mut().zip(&changes_of_mean) {
            slope.iter_mut().zip(of_mean).for_each(|(value, of_mean)| *value += of_mean);
        }
        let (terms, wideness) = (error.terms(&at), error.wideness(&at));
        let Some(mut reading) = learnt.reading(&terms, wideness, &shown, &slopes) else {
            return Ok(Err(unexplained(learnt, fit)));
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

impl Run<'_> {
    /// The notice of a voltage beside a current that the model does not explain; `None` where it was not
    /// recorded.
    pub(crate) fn voltage_of_unexplained(&self) -> Option<Notice> {
        self.unused_where_recorded("the model does not explain the current beside it")
    }

    /// The notice of a voltage of a machine that is taken to be exactly its model file; `None` where it was
    /// not recorded.
    pub(crate) fn voltage_of_exact(&self) -> Option<Notice> {
        self.unused_where_recorded(
            "it is read where the machine is known to its tolerances, and here it is taken to be exactly \
             its model file",
        )
    }

    fn unused_where_recorded(&self, reason: &str) -> Option<Notice> {
        let is_recorded = self.observation.motor_voltage != MotorVoltage::NotRecorded;
        is_recorded.then(|| self.unused(reason))
    }

    /// The notice of a voltage that no machine shows beside the current.
    fn contradicting(&self) -> Notice {
        let (beside, asks) = match self.plan.unit {
            Some(_) => (" and the recordings as new", ", its supply measured as theirs was"),
            None => ("", ""),
        };
        self.unused(&format!(
            "no machine within the tolerances shows it beside the current{beside}: is it in V and of this \
             motor{asks}, and the machine under the load of the test?"
        ))
    }

    fn unused(&self, reason: &str) -> Notice {
        let columns = match &self.observation.motor_voltage {
            MotorVoltage::Filtered { columns, .. } => format!(" (`{columns}`)"),
            _ => String::new(),
        };
        let message = format!("the motor's voltage{columns} is not used: {reason}");
        Notice { code: NoticeCode::VoltageUnused, message }
    }
}

fn unexplained(learnt: &VoltageError, fit: &UnitFit) -> String {
    if is_severe(fit) {
        return "the damage is beyond that of the machines whose voltage was learnt".to_owned();
    }
    format!(
        "no machine like the bundle's shows it to {:.2} V: is it of this motor, in V, and positive where \
         it drives the shaft forwards?",
        learnt.most_left_v()
    )
}
