//! The monitoring model on many states of health at once.

use pulp::NullaryFnOnce;

use crate::{
    controller::{Cascade, Law},
    extension::rescaling,
    fault::PhysicalFaults,
    plant::{Additions, GATHERED, Group, Kept, Lanes, Member, NARROW, Run, WIDTH},
    trace::MotorMotion,
    vectors::Vectors,
};

use super::LowFidelity;

impl LowFidelity {
    /// Runs the test for its current alone on many actuators, into buffers of the caller's, in the
    /// order of the faults.
    ///
    /// What [`simulate_current`](Self::simulate_current) gives, bit for bit, several times as
    /// fast: sixteen states of health, or four, go side by side through the ticks in which nothing
    /// happens, with wide vectors where the machine has them, and one by one through the others. Effects, a
    /// load that changes, a field-oriented drive with a measured back-EMF, a derivative part,
    /// controller noise and digitisation are simulated one by one altogether.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{FaultCoordinates, LowFidelity, Scenario, presets::EMA_48};
    ///
    /// let model = LowFidelity::new(&EMA_48, &Scenario::chirp())?;
    /// let faults: Vec<_> =
    ///     (0..20).map(|n| (&FaultCoordinates([1e-3 * f64::from(n); 7])).into()).collect();
    /// let mut currents_a = Vec::new();
    /// model.simulate_currents(&faults, &mut currents_a);
    /// assert_eq!(currents_a[7], model.simulate(&faults[7]).current_a);
    /// # Ok::<_, ema_sim::SimulationError>(())
    /// ```
    pub fn simulate_currents(&self, faults: &[PhysicalFaults], currents_a: &mut Vec<Vec<f64>>) {
        currents_a.resize_with(faults.len(), Vec::new);
        for (faults, currents_a) in faults.chunks(WIDTH).zip(currents_a.chunks_mut(WIDTH)) {
            let together = if faults.len() <= NARROW {
                self.side_by_side::<NARROW>(faults, currents_a)
            } else {
                self.side_by_side::<WIDTH>(faults, currents_a)
            };
            if !together {
                for (faults, current_a) in faults.iter().zip(currents_a) {
                    self.simulate_current(faults, current_a);
                }
            }
        }
    }

    /// Runs many tests, of machines, effects and lengths of their own, each for its current alone,
    /// into buffers of the caller's in the order of the tests.
    ///
    /// What [`simulate_current`](Self::simulate_current) gives, bit for bit, several times as fast:
    /// up to sixteen go side by side (`docs/decisions/0128-effects-side-by-side.md`). A
    /// field-oriented drive, a derivative part, controller noise, digitisation, a load that depends
    /// on the surface, and effects on winding, back-EMF or magnetic saturation are simulated one
    /// by one.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{
    ///     Effect, EffectId, Geometry, HealthState, LowFidelity, PhysicalFaults, Scenario,
    ///     presets::EMA_48,
    /// };
    ///
    /// let healthy = PhysicalFaults::from(&HealthState::HEALTHY);
    /// let plain = LowFidelity::new(&EMA_48, &Scenario::chirp())?;
    /// let cogging = Effect::new(EffectId::Cogging, Geometry::Rotary)
    ///     .with("cogging_sin_n_m", 0.004)?;
    /// let with = plain.clone().with_effects(&[cogging])?;
    /// let mut currents_a = Vec::new();
    /// LowFidelity::simulate_tests(&[(&plain, &healthy), (&with, &healthy)], &mut currents_a);
    /// assert_eq!(currents_a[1], with.simulate(&healthy).current_a);
    /// # Ok::<_, Box<dyn std::error::Error>>(())
    /// ```
    pub fn simulate_tests(tests: &[(&Self, &PhysicalFaults)], currents_a: &mut Vec<Vec<f64>>) {
        *currents_a = Self::currents_every(1, tests);
    }

    /// Every `step`-th value of the currents of tests.
    pub(crate) fn currents_every(step: usize, tests: &[(&Self, &PhysicalFaults)]) -> Vec<Vec<f64>> {
        let alone = |place: usize| {
            let ((test, faults), mut current_a) = (tests[place], Vec::new());
            test.simulate_current(faults, &mut current_a);
            vec![current_a.into_iter().step_by(step).collect()]
        };
        let kept = Self::kept_of(tests, &[Kept::Current], step, alone);
        kept.into_iter().flatten().collect()
    }

    /// Runs many tests for motion and current of the motor in each, in the order of the tests.
    ///
    /// They are those of [`simulate`](Self::simulate), bit for bit; tests go side by side where those of
    /// [`simulate_tests`](Self::simulate_tests) do.
    pub fn simulate_motions(tests: &[(&Self, &PhysicalFaults)]) -> Vec<MotorMotion> {
        let alone = |place: usize| {
            let (test, faults) = tests[place];
            let trace = test.simulate(faults);
            vec![trace.current_a, trace.motor_angle_rad, trace.motor_speed_rad_per_s]
        };
        let kept = [Kept::Current, Kept::MotorAngle, Kept::MotorSpeed];
        let motion = |mut signals: Vec<Vec<f64>>| {
            let mut next = || signals.pop().unwrap_or_default();
            let (motor_speed_rad_per_s, motor_angle_rad, current_a) = (next(), next(), next());
            MotorMotion { current_a, motor_angle_rad, motor_speed_rad_per_s }
        };
        Self::kept_of(tests, &kept, 1, alone).into_iter().map(motion).collect()
    }

    /// Every `step`-th value of some signals of tests; `alone` gives those of one that has no other beside
    /// it.
    fn kept_of(
        tests: &[(&Self, &PhysicalFaults)],
        kept: &[Kept],
        step: usize,
        alone: impl Fn(usize) -> Vec<Vec<f64>>,
    ) -> Vec<Vec<Vec<f64>>> {
        let mut signals = vec![Vec::new(); tests.len()];
        let mut members = Vec::new();
        for (place, (test, faults)) in tests.iter().enumerate() {
            if let Some(member) = test.member(faults, place) {
                members.push(member);
            } else {
                signals[place] = alone(place);
            }
        }
        Group { members, kept, step }.run(alone, |place, of| signals[place] = of);
        signals
    }

    /// The run of a test at its start; `None` where it has to go alone.
    fn member(&self, faults: &PhysicalFaults, place: usize) -> Option<Member<'_, (Law, f64)>> {
        let actuator = self.actuator.rescaled(&rescaling(&self.effects));
        let law = Cascade::new(&actuator, &self.scenario).plain()?;
        let additions = Additions { effects: &self.effects, load: &self.load, finer: self.finer };
        let run = Run::new(&actuator, &self.scenario, faults, &additions);
        let tick_s = 1.0 / actuator.controller.sample_hz;
        let commands = &self.command_rad;
        let is_plain = self.finer >= 1.0 && run.joins_lanes();
        is_plain.then_some(Member { place, run, law, commands, tick_s })
    }

    /// Runs at most `N` states of health in lanes, and whether that can be.
    fn side_by_side<const N: usize>(
        &self,
        faults: &[PhysicalFaults],
        currents_a: &mut [Vec<f64>],
    ) -> bool {
        let Some(lanes) = self.lanes::<N>(faults) else { return false };
        for current_a in &mut *currents_a {
            current_a.clear();
            current_a.reserve(self.command_rad.len());
        }
        let command_rad = &self.command_rad;
        let side = Side { lanes, command_rad, currents_a };
        match Vectors::of_processor() {
            Some(vectors) => vectors.run(side),
            None => side.call(),
        }
        true
    }

    /// The runs of at most `N` states of health, the last of them in what is left of the
    /// lanes; `None` where they have to go one by one.
    fn lanes<const N: usize>(&self, faults: &[PhysicalFaults]) -> Option<Lanes<N>> {
        let last = faults.len().checked_sub(1)?;
        if self.finer < 1.0 {
            return None;
        }
        let actuator = self.actuator.rescaled(&rescaling(&self.effects));
        let additions = Additions { effects: &self.effects, load: &self.load, finer: self.finer };
        let (law, integral_a) = Cascade::new(&actuator, &self.scenario).plain()?;
        let runs = core::array::from_fn(|lane| {
            Run::new(&actuator, &self.scenario, &faults[lane.min(last)], &additions)
        });
        Lanes::of(runs, law, integral_a, 1.0 / actuator.controller.sample_hz)
    }
}

/// A run of all lanes.
struct Side<'a, const N: usize> {
    lanes: Lanes<N>,
    command_rad: &'a [f64],
    currents_a: &'a mut [Vec<f64>],
}

impl<const N: usize> NullaryFnOnce for Side<'_, N> {
    type Output = ();

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "compiled for each instruction set by being inlined")]
    fn call(self) {
        let Self { mut lanes, command_rad, currents_a } = self;
        let mut gathered = [[0.0; GATHERED]; N];
        let mut tick = 0;
        for commands in command_rad.chunks(GATHERED) {
            for (place, &command) in commands.iter().enumerate() {
                for (row, &current_a) in gathered.iter_mut().zip(lanes.current_a()) {
                    row[place] = current_a;
                }
                lanes.tick(tick, command);
                tick += 1;
            }
            for (current_a, row) in currents_a.iter_mut().zip(&gathered) {
                current_a.extend_from_slice(&row[..commands.len()]);
            }
        }
    }
}
