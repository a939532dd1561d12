//! The rotor's electrical angle from what a recording shows of the commutation.
//!
//! Test and machine tell how the rotor turns; what is left is where it stood at the start, and
//! that decides which phase is idle when. Read in three steps:
//!
//! 1. The start angle at which the six-step pattern of the expected current is most alike the
//!    recorded currents, `Σ i_j·s_j(θ + θ_0)·I / √(Σ i² · Σ (s·I)²)`: good to a part of a sector,
//!    since faults change how the rotor turns.
//! 2. The sectors from the currents themselves: of all paths through neighbouring sectors within
//!    60° of the expected angle the one with the least current in the idle phase. Hall sensors show
//!    them without that.
//! 3. The start angle with which the expected motion keeps to these sectors best. The motion is
//!    that of the faults found so far, so that this step is repeated as they become known.
//!
//! Which of the electrical turns it is stays open: a rotor turned by a whole one behaves alike, its
//! eccentricity turned against it.

use core::f64::consts::{FRAC_PI_3, TAU};

use ema_sim::{FAULT_COUNT, FaultCoordinates, PhysicalFaults, Sector, SimulationError};

use crate::simulation::{experiment::Experiment, resampling::resampled};

/// The commutation that a recording shows.
#[derive(Clone, Debug)]
pub(crate) struct Commutation {
    /// Sector at each sample of the phases.
    sectors: Vec<Sector>,
    rate_hz: f64,
    /// Mean electrical angle by which what is seen is off that of the machine, rad.
    pub(crate) deviation_rad: f64,
}

/// Mean deviation above which the commutation is not the machine's: half a sector means nothing,
/// with a quarter three of four samples are in the right one.
pub(crate) const MOST_DEVIATION_RAD: f64 = FRAC_PI_3 / 4.0;
/// Angles tried over an electrical turn.
const STEPS: usize = 180;
/// A search ends within this electrical angle, rad: a tenth of what counts as one angle.
const RESOLUTION_RAD: f64 = 4e-4;
/// Current in the idle phase, squared, that a change of sector must save, over the variance of the
/// noise: what noise alone saves by chance within a few samples.
const CHANGE_OVER_NOISE: f64 = 30.0;
/// Least variance of the noise, as a share of the mean square of the currents.
const LEAST_NOISE_SHARE: f64 = 1e-6;
impl Commutation {
    /// Reads it off three currents with noise of a level; `None` when they carry nothing.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] when the experiment cannot be simulated.
    pub(crate) fn of_currents(
        phases_a: [&[f64]; 3],
        noise_a: f64,
        rate_hz: f64,
        experiment: &Experiment,
    ) -> Result<Option<Self>, SimulationError> {
        let motion = Motion::of(experiment, &[0.0; FAULT_COUNT], rate_hz)?;
        let power = phases_a.iter().flat_map(|phase| phase.iter()).map(|i| i * i).sum::<f64>();
        let samples = phases_a[0].len();
        let mean_power = power / samples.max(1) as f64;
        let signal_power = power - 3.0 * samples as f64 * noise_a * noise_a;
        if signal_power <= 0.0 {
            return Ok(None);
        }
        let start_rad = motion.most_alike(phases_a);
        let variance_a2 = (noise_a * noise_a).max(LEAST_NOISE_SHARE * mean_power);
        let change_a2 = CHANGE_OVER_NOISE * variance_a2;
        let (sectors, idle_power) =
            decoded(phases_a, &motion.angles(start_rad, samples), change_a2);
        // a wrong sector has a conducting phase for the idle one: half of the power
        let share = (idle_power - samples as f64 * noise_a * noise_a).max(0.0) / signal_power;
        let off_motion_rad = motion.deviation_rad(&sectors, motion.keeping_to(&sectors));
        let deviation_rad = (2.0 * share * FRAC_PI_3).max(off_motion_rad);
        Ok(Some(Self { sectors, rate_hz, deviation_rad }))
    }

    /// Takes it from the sectors that Hall sensors show at each sample of the phases.
    ///
    /// # Errors
    ///
    /// As [`of_currents`](Self::of_currents).
    pub(crate) fn of_sectors(
        sectors: Vec<Sector>,
        rate_hz: f64,
        experiment: &Experiment,
    ) -> Result<Self, SimulationError> {
        let motion = Motion::of(experiment, &[0.0; FAULT_COUNT], rate_hz)?;
        let mut seen = Self { sectors, rate_hz, deviation_rad: 0.0 };
        let start_rad = motion.keeping_to(&seen.sectors);
        seen.deviation_rad = motion.deviation_rad(&seen.sectors, start_rad);
        Ok(seen)
    }

    /// Electrical angle at each sample of the phases, exact as far as its sector goes, rad.
    pub(crate) fn electrical_rad(&self) -> Vec<f64> {
        self.sectors.iter().copied().map(middle_rad).collect()
    }

    /// Moves every change of sector a tick of the drive's controller earlier: it is then
    /// that the drive commutates, and the phase that stops conducting shows it.
    pub(crate) fn before_the_tick(mut self, experiment: &Experiment) -> Self {
        let tick = (self.rate_hz / experiment.actuator.controller.sample_hz).round() as usize;
        let last = self.sectors.len().saturating_sub(1);
        self.sectors = (0..=last).map(|n| self.sectors[(n + tick).min(last)]).collect();
        self
    }

    /// Mechanical angle of the rotor at the first sample for a machine with some damage: of all
    /// that look alike the one nearest to where the experiment starts, rad.
    ///
    /// # Errors
    ///
    /// [`SimulationError`] when the experiment cannot be simulated.
    pub(crate) fn start_angle_rad(
        &self,
        experiment: &Experiment,
        coordinates: &[f64; FAULT_COUNT],
    ) -> Result<f64, SimulationError> {
        let motion = Motion::of(experiment, coordinates, self.rate_hz)?;
        Ok(nearest_turn(motion.keeping_to(&self.sectors), experiment))
    }
}

/// How the low-fidelity model expects a machine to turn, and with what current.
struct Motion {
    /// Electrical angle from the start.
    electrical_rad: Vec<f64>,
    current_a: Vec<f64>,
}

impl Motion {
    fn of(
        experiment: &Experiment,
        coordinates: &[f64; FAULT_COUNT],
        rate_hz: f64,
    ) -> Result<Self, SimulationError> {
        let scenario = experiment.scenario.clone().turned_to(0.0);
        let faults = PhysicalFaults::from(&FaultCoordinates(*coordinates));
        let trace = experiment.low_fidelity(&scenario)?.simulate(&faults);
        let pole_pairs = f64::from(experiment.actuator.motor.pole_pairs);
        let electrical: Vec<f64> =
            trace.motor_angle_rad.iter().map(|angle| angle * pole_pairs).collect();
        Ok(Self {
            electrical_rad: resampled(&electrical, trace.rate_hz, rate_hz),
            current_a: resampled(&trace.current_a, trace.rate_hz, rate_hz),
        })
    }

    /// Electrical angles from a start, for a number of samples; the last one goes on.
    fn angles(&self, start_rad: f64, samples: usize) -> Vec<f64> {
        let last = self.electrical_rad.last().copied().unwrap_or(0.0);
        let angles = self.electrical_rad.iter().copied().chain(std::iter::repeat(last));
        angles.take(samples).map(|angle| angle + start_rad).collect()
    }

    /// The start from which the six-step pattern is most alike some currents.
    fn most_alike(&self, phases_a: [&[f64]; 3]) -> f64 {
        let likeness = |start_rad: f64| {
            let places = self.electrical_rad.iter().zip(&self.current_a).enumerate();
            places
                .take(phases_a[0].len())
                .map(|(n, (angle, current))| {
                    let sector = Sector::of_electrical_angle(angle + start_rad);
                    let [up, down] = [sector.positive_phase(), sector.negative_phase()];
                    current * (phases_a[up][n] - phases_a[down][n])
                })
                .sum::<f64>()
        };
        let least = least_of_steps(|start_rad| -likeness(start_rad));
        refined(least, |start_rad| -likeness(start_rad))
    }

    /// Mean angle by which the motion from a start leaves some sectors.
    fn deviation_rad(&self, sectors: &[Sector], start_rad: f64) -> f64 {
        let off = self.electrical_rad.iter().zip(sectors).map(|(angle, sector)| {
            let away = (angle + start_rad - middle_rad(*sector)).rem_euclid(TAU);
            (away.min(TAU - away) - 0.5 * FRAC_PI_3).max(0.0)
        });
        off.sum::<f64>() / sectors.len().max(1) as f64
    }

    /// The start from which the motion keeps best to some sectors.
    fn keeping_to(&self, sectors: &[Sector]) -> f64 {
        let least = least_of_steps(|start_rad| self.deviation_rad(sectors, start_rad));
        let refined = refined(least, |start_rad| self.deviation_rad(sectors, start_rad));
        // where the sectors leave a range of angles its middle is taken
        let most = self.deviation_rad(sectors, refined) + f64::EPSILON;
        let reach = |sign: f64| {
            let inside = |step: &usize| {
                let away_rad = sign * *step as f64 * RESOLUTION_RAD;
                self.deviation_rad(sectors, refined + away_rad) <= most
            };
            let steps = (1..(FRAC_PI_3 / RESOLUTION_RAD) as usize).take_while(inside).count();
            sign * steps as f64 * RESOLUTION_RAD
        };
        refined + 0.5 * (reach(1.0) + reach(-1.0))
    }
}

/// The angle of an even grid over the turn at which a function is least.
fn least_of_steps(function: impl Fn(f64) -> f64) -> f64 {
    let values = (0..STEPS).map(|step| {
        let angle_rad = step as f64 * TAU / STEPS as f64;
        (angle_rad, function(angle_rad))
    });
    values.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |(angle_rad, _)| angle_rad)
}

/// The least point of a function within a step of the grid, by golden section.
fn refined(near_rad: f64, function: impl Fn(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    let step_rad = TAU / STEPS as f64;
    let (mut low, mut high) = (near_rad - step_rad, near_rad + step_rad);
    while high - low > RESOLUTION_RAD {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if function(a) < function(b) {
            high = b;
        } else {
            low = a;
        }
    }
    0.5 * (low + high)
}

/// Electrical angle in the middle of a sector.
fn middle_rad(sector: Sector) -> f64 {
    FRAC_PI_3 * (sector.number() + 1) as f64
}

/// Sectors next to the expected one that a path may go through: one to either side.
const NEIGHBOURS: usize = 3;

/// The path through neighbouring sectors, none further than one from the expected, with the least
/// square of the idle phase's current, a change of sector costing `change_a2`; and that square.
fn decoded(phases_a: [&[f64]; 3], expected_rad: &[f64], change_a2: f64) -> (Vec<Sector>, f64) {
    let expected: Vec<i64> =
        expected_rad.iter().map(|&angle| Sector::of_electrical_angle(angle).number()).collect();
    let numbered = |number: i64| Sector::of_electrical_angle(FRAC_PI_3 * (number + 1) as f64);
    let idle_a2 = |number: i64, n: usize| phases_a[numbered(number).idle_phase()][n].powi(2);
    let candidate = |n: usize, place: usize| expected[n] + place as i64 - 1;
    let mut costs = [0.0; NEIGHBOURS];
    let mut came_from: Vec<[usize; NEIGHBOURS]> = Vec::with_capacity(expected.len());
    for n in 0..expected.len() {
        let mut next = [f64::INFINITY; NEIGHBOURS];
        let mut from = [0; NEIGHBOURS];
        for place in 0..NEIGHBOURS {
            let own = idle_a2(candidate(n, place), n);
            for before in 0..NEIGHBOURS {
                let steps = if n == 0 {
                    i64::from(before != place)
                } else {
                    (candidate(n, place) - candidate(n - 1, before)).abs()
                };
                if steps > 1 {
                    continue;
                }
                let cost = costs[before] + own + steps as f64 * change_a2;
                if cost < next[place] {
                    (next[place], from[place]) = (cost, before);
                }
            }
        }
        costs = next;
        came_from.push(from);
    }
    let best = (0..NEIGHBOURS).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
    let mut place = best;
    let mut numbers = vec![0; expected.len()];
    for n in (0..expected.len()).rev() {
        numbers[n] = candidate(n, place);
        place = came_from[n][place];
    }
    let idle_power = numbers.iter().enumerate().map(|(n, &number)| idle_a2(number, n)).sum();
    (numbers.into_iter().map(numbered).collect(), idle_power)
}

/// The mechanical angle of an electrical one that is nearest to where the experiment starts.
fn nearest_turn(electrical_rad: f64, experiment: &Experiment) -> f64 {
    let pole_pairs = f64::from(experiment.actuator.motor.pole_pairs);
    let turn_rad = TAU / pole_pairs;
    let own_rad = experiment.scenario.start_angle_rad;
    let away_rad = electrical_rad / pole_pairs - own_rad;
    own_rad + away_rad - turn_rad * (away_rad / turn_rad).round()
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use ema_sim::{HealthState, Imperfections, PhaseSensors};

    use super::*;
    use crate::{ChannelName, RecordedContent, SimulatedRecording};

    /// The chirp's greatest speed, 75 rad/s, times the tick of 0.1 ms by which a commutation may be
    /// seen late.
    const LATE_RAD: f64 = 7.5e-3;

    #[test]
    fn the_start_is_found_to_a_tick_of_the_controller() {
        let experiment = Experiment::chirp();
        for (index, start_angle_rad) in [0.0, 0.31, 0.7, 1.2, 4.0].into_iter().enumerate() {
            let recording = SimulatedRecording {
                faults: HealthState::HEALTHY.coordinates(),
                start_angle_rad,
                imperfections: Imperfections::REAL,
                controller_seed: index as u64,
                sensors: PhaseSensors { noise_a: 0.02, converter: None },
                phase_rate_hz: None,
                sensor_seed: index as u64,
                content: RecordedContent::Phases,
                has_voltage: false,
            }
            .record(&experiment, "r")
            .unwrap();
            let names = [
                ChannelName::PhaseACurrent,
                ChannelName::PhaseBCurrent,
                ChannelName::PhaseCCurrent,
            ];
            let phases = names.map(|name| recording.channel(name).unwrap().values());
            let seen = Commutation::of_currents(phases, 0.02, 10e3, &experiment).unwrap().unwrap();
            let found_rad = seen.start_angle_rad(&experiment, &[0.0; FAULT_COUNT]).unwrap();
            // whole electrical turns apart
            let turn_rad = TAU / 4.0;
            let off = (found_rad - start_angle_rad).rem_euclid(turn_rad);
            assert!(off.min(turn_rad - off) < LATE_RAD, "{found_rad} {start_angle_rad}");
            assert!(seen.deviation_rad < 0.1 * MOST_DEVIATION_RAD, "{}", seen.deviation_rad);
        }
    }

    #[test]
    fn a_path_follows_the_idle_phase_and_not_the_noise() {
        // A+B− conducts for twenty samples, then A+C−; the expectation changes five samples early
        let a = [1.0; 40];
        let [mut b, mut c] = [[0.0; 40]; 2];
        for n in 0..40 {
            let (on, off) = if n < 20 { (&mut b, &mut c) } else { (&mut c, &mut b) };
            (on[n], off[n]) = (-1.0, if n % 2 == 0 { 0.01 } else { -0.01 });
        }
        let expected: Vec<f64> =
            (0..40).map(|n| if n < 15 { FRAC_PI_3 } else { 2.0 * FRAC_PI_3 }).collect();
        let (sectors, idle_power) = decoded([&a, &b, &c], &expected, 0.003);
        for (n, sector) in sectors.iter().enumerate() {
            assert_eq!(sector.number(), i64::from(n >= 20), "{n}");
        }
        assert_abs_diff_eq!(idle_power, 40.0 * 1e-4, epsilon = 1e-12);
    }
}
