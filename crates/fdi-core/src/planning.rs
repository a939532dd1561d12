//! Planning a test: of motions within the limits of a machine those whose recording is expected to
//! leave the damage asked for least open.
//!
//! ```text
//! I = Σ_m J_mᵀ·Σ_m⁻¹·J_m      information of motions m on what a current shows
//! C = (I of the recording and of references, with tolerances and thermometer)⁻¹, the damage
//! min Σ_f ln s_f              s_f² = C_ff of each fault f asked for
//! ```
//!
//! `J_m` are slopes of the low-fidelity model at the machine of the model file, `Σ_m` is the noise
//! of the sensors with the error of that model, guessed from a few machines in high fidelity. Motions go
//! from rest to rest, so that a test's information is the sum of theirs. The inference is the one that
//! later answers the recording, so that what it is expected to state is what the plan says.
//!
//! # Source
//!
//! Bayesian D-optimal design with the numbers beside those of interest marginal: Chaloner and
//! Verdinelli, Statistical Science 10, 1995, 273; exchange of points: Fedorov, *Theory of Optimal
//! Experiments*, 1972; `docs/models/units.md`.

mod choice;
mod expectation;
mod motion;
mod request;

use ema_sim::{Actuator, FAULT_COUNT, FaultId, HealthState, PhysicalFaults, model_file::Model};

use crate::{
    report::{self, ExpectedStd, MotionLimits, PlannedFault, PlannedMotion},
    simulation::experiment::Experiment,
    unit::quantities::Quantities,
};

use choice::{Candidate, Choice};
use expectation::{Beside, Least, Stds, Worth, spreads};
use motion::{Motion, RATE_HZ};

pub use request::{PlanError, PlanRequest, motion_limits};

/// Standard deviation from which a fault is not told: that of nothing known.
const TELLS_NOTHING: f64 = 1.0;

/// Share of a motion's amplitude that the surface has to reach: a machine that does not follow shows
/// nothing.
const LEAST_FOLLOWED: f64 = 0.2;

/// A planned test.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PlannedTest {
    /// Motions in their order.
    pub motions: Vec<PlannedMotion>,
    /// Command of the surface, rad.
    pub command_rad: Vec<f64>,
    /// Rate of the command, Hz.
    pub rate_hz: f64,
    /// Expectations of each fault that a test of this model tells.
    pub faults: Vec<PlannedFault>,
    /// Motions that it was chosen from.
    pub candidates: usize,
}

/// Plans a test of an actuator, and compares it with another test of it.
///
/// # Errors
///
/// [`PlanError`] for faults that the model does not list, and limits that no motion keeps.
pub fn plan_test(
    name: &str,
    model: &Model,
    before: Option<&Experiment>,
    request: &PlanRequest,
    tell: &dyn Fn(&str),
) -> Result<PlannedTest, PlanError> {
    check_limits(&request.limits, &model.actuator)?;
    let planner = Planner { name, model, request };
    let menu = planner.safe_motions()?;
    let whole = planner.test(menu.iter().flat_map(Motion::command_rad).collect())?;
    let faults = told_faults(&whole);
    check_faults(&request.faults, &faults)?;
    tell(&format!("weigh {} motions", menu.len()));
    let chosen = planner.choose(&menu, &whole)?;
    tell("compare the test with others");
    let command_rad: Vec<f64> = chosen.iter().flat_map(|motion| motion.command_rad()).collect();
    let planned = expected_stds(&planner.test(command_rad.clone())?, request)?;
    let before = before.map(|test| expected_stds(test, request)).transpose()?;
    let least = Least::of(&whole, model, &beside(request), request.seed);
    let of_fault = |&fault: &FaultId| {
        let place = fault.index();
        PlannedFault {
            id: report::FaultId::ALL[place],
            is_asked: request.faults.contains(&fault),
            before: before.and_then(|stds| stds[place]),
            planned: planned[place],
            least: least.as_ref().and_then(|least| told(least.stds(), place)),
            shared_with: least.as_ref().and_then(|least| least.shared_with(place)),
        }
    };
    Ok(PlannedTest {
        motions: timed(&chosen),
        command_rad,
        rate_hz: RATE_HZ,
        faults: faults.iter().map(of_fault).collect(),
        candidates: menu.len(),
    })
}

/// Standard deviations that a recording of a test is expected to leave of each fault, by the fault's
/// index; `None` of a fault that it does not tell. Of the eccentricity it is the root mean square over
/// the two coordinates `k6·cos φ`, `k6·sin φ`.
///
/// # Errors
///
/// [`PlanError`] when the machine cannot be simulated.
pub fn expected_stds(
    experiment: &Experiment,
    request: &PlanRequest,
) -> Result<[Option<ExpectedStd>; FAULT_COUNT], PlanError> {
    let quantities = Quantities::new(experiment);
    let nothing = Worth::of_nothing(&spreads(experiment, &quantities, request.seed));
    let worth = Worth::of_test(experiment, &quantities, request.seed, request.jobs)?;
    let worth = nothing.and(&worth);
    let [alone, read, voltage] = beside(request).map(|beside| worth.stds(&quantities, &beside));
    Ok(std::array::from_fn(|place| {
        told([alone.as_ref()?, read.as_ref()?, voltage.as_ref()?], place)
    }))
}

/// Standard deviations of a fault alone, with a thermometer and with the motor's voltage; `None` where
/// it is not told.
fn told(stds: [&Stds; 3], place: usize) -> Option<ExpectedStd> {
    let [alone, with_reading, with_voltage] = stds.map(|stds| stds[place]);
    (alone < TELLS_NOTHING).then_some(ExpectedStd { alone, with_reading, with_voltage })
}

/// Recordings beside the planned one: alone, with a thermometer, with the motor's voltage.
fn beside(request: &PlanRequest) -> [Beside; 3] {
    let references = request.references;
    [(None, false), (Some(request.reading_std_k), false), (None, true)]
        .map(|(reading_std_k, has_voltage)| Beside { references, reading_std_k, has_voltage })
}

/// A machine with what is asked of its test.
struct Planner<'a> {
    name: &'a str,
    model: &'a Model,
    request: &'a PlanRequest,
}

impl Planner<'_> {
    fn test(&self, command_rad: Vec<f64>) -> Result<Experiment, PlanError> {
        let mut experiment = Experiment::recorded(command_rad, RATE_HZ);
        experiment.scenario.load_n_m = self.request.load_n_m;
        Ok(experiment.of_model(self.name, self.model)?)
    }

    /// Motions of the menu that the machine follows within the limits, by the low-fidelity model.
    fn safe_motions(&self) -> Result<Vec<Motion>, PlanError> {
        let PlanRequest { limits, within_s, .. } = *self.request;
        let mut safe = Vec::new();
        for motion in Motion::menu(&self.model.actuator, &limits, within_s) {
            let experiment = match self.test(motion.command_rad()) {
                Err(PlanError::Experiment(error)) if error.is_of_the_command() => continue,
                tested => tested?,
            };
            let model = experiment.low_fidelity(&experiment.scenario)?;
            let trace = model.simulate(&PhysicalFaults::from(&HealthState::HEALTHY));
            let keeps = |channel: &[f64], most: f64| channel.iter().all(|x| x.abs() <= most);
            let surface = trace.surface_angle_rad.iter();
            let reached_rad = surface.fold(0.0_f64, |most, x| most.max(x.abs()));
            if reached_rad >= LEAST_FOLLOWED * motion.amplitude_rad
                && keeps(&trace.current_a, limits.current_a)
                && keeps(&trace.motor_speed_rad_per_s, limits.speed_rad_per_s)
                && keeps(&trace.surface_angle_rad, limits.travel_rad)
            {
                safe.push(motion);
            }
        }
        if safe.is_empty() {
            let load_n_m = self.request.load_n_m;
            return Err(PlanError::NoMotion { within_s, limits, load_n_m });
        }
        Ok(safe)
    }

    /// The motions that leave the faults asked for least open; their quantities are those of a test of
    /// all.
    fn choose<'m>(
        &self,
        menu: &'m [Motion],
        whole: &Experiment,
    ) -> Result<Vec<&'m Motion>, PlanError> {
        let PlanRequest { seed, jobs, within_s, is_read, has_voltage, .. } = *self.request;
        let quantities = Quantities::new(whole);
        let candidate = |motion: &Motion| {
            let experiment = self.test(motion.command_rad())?;
            let worth = Worth::of_test(&experiment, &quantities, seed, jobs)?;
            Ok(Candidate { duration_s: motion.duration_s(), worth })
        };
        let candidates = menu.iter().map(candidate).collect::<Result<Vec<_>, PlanError>>()?;
        let choice = Choice {
            candidates: &candidates,
            nothing: &Worth::of_nothing(&spreads(whole, &quantities, seed)),
            quantities: &quantities,
            beside: Beside {
                references: self.request.references,
                reading_std_k: is_read.then_some(self.request.reading_std_k),
                has_voltage,
            },
            faults: &self.request.faults,
            within_s,
        };
        Ok(choice.motions().into_iter().map(|place| &menu[place]).collect())
    }
}

/// Faults whose size a test tells.
fn told_faults(experiment: &Experiment) -> Vec<FaultId> {
    let sizes = FaultId::ALL.into_iter().filter(|fault| *fault != FaultId::EccentricityPhase);
    sizes.filter(|fault| experiment.sought[fault.index()]).collect()
}

fn check_faults(asked: &[FaultId], there: &[FaultId]) -> Result<(), PlanError> {
    match asked.iter().find(|fault| !there.contains(fault)) {
        Some(&fault) => Err(PlanError::NoSuchFault { fault, expected: there.to_vec() }),
        None => Ok(()),
    }
}

fn check_limits(asked: &MotionLimits, actuator: &Actuator) -> Result<(), PlanError> {
    let drive = &actuator.controller;
    let limits = [
        (asked.current_a, drive.current_limit_a, "A"),
        (asked.speed_rad_per_s, drive.speed_limit_rad_per_s, "rad/s"),
        (asked.travel_rad, actuator.transmission.stop_rad, "rad"),
    ];
    match limits.into_iter().find(|(asked, most, _)| asked > most) {
        Some((asked, most, unit)) => Err(PlanError::BeyondMachine { asked, most, unit }),
        None => Ok(()),
    }
}

/// Motions with their times.
fn timed(motions: &[&Motion]) -> Vec<PlannedMotion> {
    let mut begins_s = 0.0;
    let mut timed = Vec::new();
    for motion in motions {
        let duration_s = motion.duration_s();
        timed.push(PlannedMotion {
            begins_s,
            duration_s,
            description: motion.in_words(),
            rotor_rad_per_s: motion.rotor_rad_per_s,
        });
        begins_s += duration_s;
    }
    timed
}

#[cfg(test)]
mod tests {
    use super::*;
    use ema_sim::presets;

    use crate::seed::RootSeed;

    fn request(within_s: f64) -> PlanRequest {
        PlanRequest {
            faults: vec![FaultId::Backlash, FaultId::Eccentricity],
            within_s,
            references: 1,
            reading_std_k: 3.0,
            is_read: false,
            has_voltage: false,
            load_n_m: 0.0,
            limits: motion_limits(&presets::EMA_48),
            seed: RootSeed(1),
            jobs: 2,
        }
    }

    fn model() -> Model {
        let tolerance = presets::ema_48_tolerance();
        let temperature = Some(presets::ema_48_temperature());
        Experiment { tolerance, temperature, ..Experiment::chirp() }.model()
    }

    #[test]
    fn a_longer_test_leaves_what_it_is_for_less_open_and_nothing_beyond_the_least() {
        let plan =
            |request: &PlanRequest| plan_test("ema-48", &model(), None, request, &|_| ()).unwrap();
        let (short, long) = (plan(&request(0.3)), plan(&request(0.6)));
        assert!(long.command_rad.len() as f64 <= 0.6 * long.rate_hz);
        for (short, long) in short.faults.iter().zip(&long.faults) {
            let [short_std, long_std] =
                [short, long].map(|fault| fault.planned.map_or(1.0, |std| std.alone));
            assert!(!long.is_asked || long_std < short_std, "{long:?} {short:?}");
            assert!(long_std >= 0.999 * long.least.unwrap().alone, "{long:?}");
        }
        let again = PlanRequest { jobs: 1, ..request(0.3) };
        assert_eq!(plan(&again), short);
        let other = PlanRequest { seed: RootSeed(2), ..request(0.3) };
        assert_ne!(plan(&other).faults, short.faults);
    }

    #[test]
    fn a_thermometer_tells_shorts_and_the_temperature_is_what_they_share() {
        let asked = PlanRequest { faults: vec![FaultId::ShortA], references: 4, ..request(0.3) };
        let plan = plan_test("ema-48", &model(), None, &asked, &|_| ()).unwrap();
        let short = plan.faults.iter().find(|fault| fault.id == report::FaultId::K3).unwrap();
        let least = short.least.unwrap();
        assert!(least.with_reading < 0.9 * least.alone, "{least:?}");
        let shared = short.shared_with.as_ref().unwrap();
        assert_eq!(shared.key, "test.winding-temperature-k");
        assert!(shared.std < 0.1 * least.alone, "{shared:?}");
    }

    #[test]
    fn what_cannot_be_planned_is_refused() {
        let refused = |request: &PlanRequest, model: &Model| {
            plan_test("ema-48", model, None, request, &|_| ()).unwrap_err().to_string()
        };
        let error = refused(&request(0.05), &model());
        assert!(error.starts_with("no motion of at most 0.05 s stays within"), "{error}");
        let two = Model { faults: vec![FaultId::Friction, FaultId::Backlash], ..model() };
        let error = refused(&request(0.3), &two);
        assert!(error.contains("`k6` is no fault") && error.contains("k1, k2"), "{error}");
    }
}
