//! The nominal machine with free numbers, damage and effects, run on the command of a recording.

use ema_sim::{
    CommandKind, DriveRun, Effect, EffectId, Electronics, FaultCoordinates, FaultId, Geometry,
    LoopGains, MachineKind, MachineNumber, MachineRun, MachineSignals, MachineTest,
    MachineTestError, ModelFidelity, MotionTerm, NumberTolerance, NumberValue, PhysicalFaults,
    PreparedTest, bandwidth_hz, model_file::MachineModel, resolved_hz, shown_while_followed,
};

use crate::{error::GreyboxError, prior::Prior, record::Record};

/// A number of the machine that a data sheet knows only roughly.
#[derive(Clone, Debug)]
pub(crate) struct Rough {
    pub(crate) key: String,
    /// Term of the equation of motion that it sets, if any.
    pub(crate) motion_term: Option<MotionTerm>,
    pub(crate) value: f64,
    pub(crate) half_width: f64,
    /// True where the model file states the tolerance; else it is the usual one.
    pub(crate) is_stated: bool,
    /// Least and largest value that any machine has.
    pub(crate) least: f64,
    pub(crate) most: f64,
    /// Place among the numbers of the machine.
    place: usize,
}

impl Rough {
    fn new(
        number: &MachineNumber,
        place: usize,
        machine: &dyn MachineKind,
        half_width_frac: f64,
        is_stated: bool,
    ) -> Self {
        let value = machine.number(place);
        Self {
            key: number.key.clone(),
            motion_term: number.motion_term,
            value,
            half_width: half_width_frac * value.abs(),
            is_stated,
            least: number.least,
            most: number.most,
            place,
        }
    }

    /// Tells whether it is a torque or force, or one over a speed or an acceleration, by the unit of its
    /// key.
    fn is_torque(&self) -> bool {
        const UNITS: [&str; 6] = ["-n-m", "-n", "-n-m-s-per-rad", "-n-s-per-m", "-kg-m2", "-kg"];
        UNITS.iter().any(|unit| self.key.ends_with(unit))
    }

    /// Law of the number beforehand, by the standard deviation of a uniform distribution over its
    /// tolerance: one that no file states may be wrong by far.
    pub(crate) fn prior(&self) -> Prior {
        let std = self.half_width / libm::sqrt(3.0);
        Prior { mean: self.value, std, has_tail: !self.is_stated }
    }

    /// Least and largest value within its tolerance.
    pub(crate) fn tolerance(&self) -> (f64, f64) {
        (self.value - self.half_width, self.value + self.half_width)
    }

    /// Values that a fit may give it: what its file states as a tolerance holds.
    pub(crate) fn reach(&self) -> (f64, f64) {
        if self.is_stated || self.half_width == 0.0 {
            self.tolerance()
        } else if self.value == 0.0 {
            (-MOST_HALF_WIDTHS * self.half_width, MOST_HALF_WIDTHS * self.half_width)
        } else {
            let (near, far) = (self.value / MOST_FACTOR, self.value * MOST_FACTOR);
            (near.min(far), near.max(far))
        }
    }
}

/// Factor by which a number without a stated tolerance may be off, and half-widths by which one may
/// that the file has as zero.
const MOST_FACTOR: f64 = 5.0;
const MOST_HALF_WIDTHS: f64 = 10.0;

/// Half-width of a dry friction that the file has none of, over the motor's torque at the limit of its
/// drive: 30 % of a tenth.
const MISSING_FRICTION_FRAC: f64 = 0.03;

/// Departure of a machine from the nominal one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct State {
    /// Values of [`Machine::rough`].
    pub(crate) rough: Vec<f64>,
    pub(crate) faults: FaultCoordinates,
    pub(crate) effects: Vec<Effect>,
    /// The effects of each recording, where they differ between recordings.
    pub(crate) in_record: Vec<Vec<Effect>>,
}

impl State {
    /// Lets one more effect act.
    pub(crate) fn add(&mut self, effect: &Effect) {
        self.effects.push(effect.clone());
        for effects in &mut self.in_record {
            effects.push(effect.clone());
        }
    }
}

/// A run of which the drive signal alone is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AskedDrive<'a> {
    pub(crate) state: &'a State,
    pub(crate) record: &'a Record,
    /// Work that runs of the recording's command share.
    pub(crate) ready: &'a PreparedTest,
    /// Place of the recording among those compared.
    pub(crate) place: usize,
}

impl AskedDrive<'_> {
    /// Effects and length, by which runs go side by side.
    pub(crate) fn likeness(&self) -> (Vec<EffectId>, usize) {
        let State { effects, in_record, .. } = self.state;
        let acting = in_record.get(self.place).unwrap_or(effects);
        (acting.iter().map(Effect::id).collect(), self.record.command.len())
    }
}

/// A model that recordings are compared with.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    model: MachineModel,
    pub(crate) built_in: Vec<Effect>,
    rough: Vec<Rough>,
}

impl Machine {
    pub(crate) fn new(model: &MachineModel) -> Self {
        let kind = model.kind();
        let numbers = kind.numbers();
        let rough = kind.rough().into_iter();
        let rough =
            rough.map(|r| Rough::new(&numbers[r.place], r.place, kind, r.half_width_frac, true));
        Self { built_in: model.switched_on(), rough: rough.collect(), model: model.clone() }
    }

    fn kind(&self) -> &dyn MachineKind {
        self.model.kind()
    }

    pub(crate) fn geometry(&self) -> Geometry {
        self.kind().geometry()
    }

    /// Coordinates of damage that it can have.
    pub(crate) fn fault_coordinates(&self) -> Vec<usize> {
        let mut places = Vec::new();
        for fault in self.kind().faults() {
            match fault {
                FaultId::Eccentricity => places.extend([5, 6]),
                FaultId::EccentricityPhase => {}
                other => places.push(other.index()),
            }
        }
        places
    }

    /// Numbers known only roughly, in the order of the file.
    pub(crate) fn rough(&self) -> &[Rough] {
        &self.rough
    }

    /// Tells whether numbers that the file states no tolerance for may be off.
    pub(crate) fn has_suspects(&self) -> bool {
        self.rough.iter().any(|rough| !rough.is_stated)
    }

    /// Value that the model file gives a number that is known roughly.
    pub(crate) fn nominal(&self, key: &str) -> Option<f64> {
        self.rough.iter().find(|rough| rough.key == key).map(|rough| rough.value)
    }

    /// Machine whose inertia, drag, dry friction and constant of the motor are known only roughly
    /// as well: what a calibration asks for.
    pub(crate) fn to_calibrate(&self) -> Self {
        let mut machine = self.clone();
        for (place, number) in self.kind().numbers().iter().enumerate() {
            let is_known = self.rough.iter().any(|known| known.key == number.key);
            if number.motion_term.is_some() && !is_known {
                machine.rough.push(Rough::new(number, place, self.kind(), 0.0, false));
            }
        }
        machine
    }

    /// Machine of which no number is exact that the file does not call so: those without a stated
    /// tolerance have the [usual one](MachineKind::usual_tolerances), but for those named.
    ///
    /// Recordings without a load show torques over the constant of the motor, which is exact then; the
    /// tolerances of inertias and frictions are those over it.
    ///
    /// # Errors
    ///
    /// [`GreyboxError::Number`] for a name that is none of its numbers.
    pub(crate) fn with_suspects(
        &self,
        exact: &[String],
        is_loaded: bool,
    ) -> Result<Self, GreyboxError> {
        let numbers = self.kind().numbers();
        if let Some(key) = exact.iter().find(|key| numbers.iter().all(|n| n.key != **key)) {
            return Err(GreyboxError::Number { key: key.clone() });
        }
        let mut machine = self.clone();
        let of = |t: NumberTolerance| {
            Rough::new(&numbers[t.place], t.place, self.kind(), t.half_width_frac, false)
        };
        machine.rough.extend(self.kind().usual_tolerances().into_iter().map(of));
        machine.rough.extend(self.missing_friction());
        machine.rough.retain(|rough| !exact.contains(&rough.key));
        machine.rough.sort_by_key(|rough| rough.place);
        let is_constant = |rough: &Rough| {
            rough.motion_term == Some(MotionTerm::TorqueConstant) && !rough.is_stated
        };
        if let Some(place) = machine.rough.iter().position(is_constant).filter(|_| !is_loaded) {
            let constant = machine.rough.remove(place);
            let share = constant.half_width / constant.value;
            let may_be_off = |rough: &&mut Rough| rough.is_torque() && rough.half_width > 0.0;
            for rough in machine.rough.iter_mut().filter(may_be_off) {
                rough.half_width = libm::hypot(rough.half_width, share * rough.value);
            }
        }
        Ok(machine)
    }

    /// Dry friction that the file has none of, and no tolerance for.
    fn missing_friction(&self) -> Option<Rough> {
        let numbers = self.kind().numbers();
        let is_friction = |n: &MachineNumber| n.motion_term == Some(MotionTerm::KineticFriction);
        let place = numbers.iter().position(is_friction)?;
        let mut friction = Rough::new(&numbers[place], place, self.kind(), 0.0, false);
        let is_missing = friction.value == 0.0 && self.nominal(&friction.key).is_none();
        friction.half_width = MISSING_FRICTION_FRAC * self.constant() * self.drive_limit();
        is_missing.then_some(friction)
    }

    /// Machine of which some of the rough numbers alone are not exact.
    pub(crate) fn with_rough_ones(&self, is_kept: impl Fn(&Rough) -> bool) -> Self {
        let mut machine = self.clone();
        machine.rough.retain(is_kept);
        machine
    }

    /// The model with its rough numbers replaced.
    pub(crate) fn with_rough(&self, values: &[f64]) -> MachineModel {
        self.with_values(&self.number_values(values))
    }

    fn with_values(&self, values: &[NumberValue]) -> MachineModel {
        let mut model = self.model.clone();
        model.kind_mut().set_numbers(values);
        model
    }

    /// The model with numbers replaced by their keys; what has no such key is left out.
    pub(crate) fn with_numbers<'k>(
        &self,
        values: impl Iterator<Item = (&'k str, f64)>,
    ) -> MachineModel {
        let numbers = self.kind().numbers();
        let of = |(key, value): (&str, f64)| {
            let place = numbers.iter().position(|number| number.key == key)?;
            Some(NumberValue { place, value })
        };
        let values: Vec<NumberValue> = values.filter_map(of).collect();
        let mut model = self.with_values(&values);
        // static friction followed the kinetic one, and is as given beside the one that it has now
        model.kind_mut().set_numbers(&values);
        model
    }

    /// Number of the machine over the rough number of a fit, for each in their order: one, but of a
    /// static friction, which a fit has beside the kinetic friction of the file.
    pub(crate) fn scales_of(&self, rough: &[f64]) -> Vec<f64> {
        let model = self.with_rough(rough);
        let of = |(one, value): (&Rough, &f64)| match *value {
            0.0 => 1.0,
            value => model.kind().number(one.place) / value,
        };
        self.rough.iter().zip(rough).map(of).collect()
    }

    /// Values of the rough numbers by their places.
    fn number_values(&self, values: &[f64]) -> Vec<NumberValue> {
        let of = |(rough, value): (&Rough, &f64)| NumberValue { place: rough.place, value: *value };
        self.rough.iter().zip(values).map(of).collect()
    }

    /// Torque, or force, over the drive signal; for scales.
    pub(crate) fn constant(&self) -> f64 {
        self.kind().torque_per_drive()
    }

    /// Inertia or mass that the motor moves.
    pub(crate) fn inertia(&self) -> f64 {
        self.kind().moved_inertia()
    }

    /// The drive signal of a recording as it is compared with predictions.
    pub(crate) fn measured_drive(record: &Record) -> Vec<f64> {
        match record.kind {
            CommandKind::Motion => shown_while_followed(&record.drive, record.rate_hz),
            CommandKind::Position | CommandKind::Speed => record.drive.clone(),
        }
    }

    /// Rate down to which the drive signal of a recording is averaged, Hz: what acts on the machine
    /// shows within a few bandwidths of its control. Far above it the likelihood would be one of
    /// single samples, and a delay of a part of a sample outweigh half of the friction.
    pub(crate) fn compared_hz(&self, record: &Record) -> f64 {
        if record.kind == CommandKind::Motion {
            return resolved_hz(record.rate_hz);
        }
        let [least, most] = COMPARED_HZ;
        (COMPARED_OVER_BANDWIDTH * self.bandwidth_hz()).clamp(least, most)
    }

    /// Bandwidth of the faster of the speed and the position loop, Hz.
    pub(crate) fn bandwidth_hz(&self) -> f64 {
        bandwidth_hz(self.kind())
    }

    /// Largest speed of the surface or axis that the controller allows, rad/s or m/s; `None` where
    /// no limit is known.
    pub(crate) fn speed_limit(&self) -> Option<f64> {
        self.kind().speed_limit()
    }

    /// Largest drive signal that a proposed command may need: half of the controller's limit.
    pub(crate) fn safe_drive(&self) -> f64 {
        0.5 * self.drive_limit()
    }

    /// Angle of the motor in which the current has one period; a turn where it has no
    /// commutation.
    pub(crate) fn current_period_rad(&self) -> f64 {
        core::f64::consts::TAU / self.kind().pole_pairs().map_or(1.0, f64::from)
    }

    /// Largest drive signal that the controller allows.
    pub(crate) fn drive_limit(&self) -> f64 {
        self.kind().drive_limit()
    }

    /// Tells whether it is a machine with one shaft and no commutation.
    pub(crate) fn is_axis(&self) -> bool {
        self.kind().pole_pairs().is_none()
    }

    /// Unit of its drive signal as keys are spelt: `a` or `v`.
    pub(crate) fn drive_unit(&self) -> &'static str {
        self.kind().drive_unit().key()
    }

    /// Runs the command of a recording, by its place among those compared.
    pub(crate) fn simulate(
        &self,
        state: &State,
        record: &Record,
        place: usize,
    ) -> Result<MachineSignals, GreyboxError> {
        let mut signals = self.run(state, record, place)?.signals();
        signals.drive = finite(signals.drive, record)?;
        Ok(signals)
    }

    /// Part of the drive signal that came about through the plant: the controller's answer to the
    /// measured position less that to the position predicted, at the recording's rate. What is
    /// left of a residual beside it entered after the controller, or in it. Where the prediction is
    /// anchored to a finer model, its position is `moved` by so much.
    ///
    /// `None` for a recording without a position, or whose drive signal was filtered.
    pub(crate) fn through_plant(
        &self,
        state: &State,
        record: &Record,
        place: usize,
        moved: Option<&[f64]>,
    ) -> Result<Option<Vec<f64>>, GreyboxError> {
        let (Some(position), None) = (&record.position, record.filter_hz) else {
            return Ok(None);
        };
        if record.kind == CommandKind::Motion {
            return Ok(None);
        }
        let run = self.run(state, record, place)?;
        let less = |moved: &[f64]| position.iter().zip(moved).map(|(x, by)| x - by).collect();
        let position: Vec<f64> = moved.map_or_else(|| position.clone(), less);
        Ok(Some(run.replayed_drive_change(&position)))
    }

    /// Drive signal that its controller makes of a command and a position in the place of those of a
    /// recording; `None` where no controller that is known makes it.
    pub(crate) fn replayed(
        &self,
        record: &Record,
        command: &[f64],
        position: &[f64],
    ) -> Result<Option<Vec<f64>>, GreyboxError> {
        let test = MachineTest { command, ..record.test() };
        let replay = self.kind().replayed(&test, position, &self.built_in);
        replay.map_err(|reason| refused(record, reason))
    }

    /// Tells whether the drive signal is shown as the controller asks for it: not where the model
    /// file has a sensor's error in it, or a controller that acts late.
    pub(crate) fn shows_its_controller(&self) -> bool {
        let hides = |effect: &Effect| match effect.id() {
            EffectId::CurrentSensor => true,
            EffectId::ControllerMismatch => effect.get("delay_s").is_some_and(|delay| delay > 0.0),
            _ => false,
        };
        !self.built_in.iter().any(hides)
    }

    /// Gains of its loops.
    pub(crate) fn loop_gains(&self) -> LoopGains {
        self.kind().loop_gains()
    }

    /// Value of the number that sets a term of the equation of motion.
    pub(crate) fn motion_number(&self, term: MotionTerm) -> Option<f64> {
        let numbers = self.kind().numbers();
        let place = numbers.iter().position(|number| number.motion_term == Some(term))?;
        Some(self.kind().number(place))
    }

    /// Factor by which inertia over motor constant may be off within the tolerances of the file.
    pub(crate) fn motion_room(&self) -> f64 {
        let sets = |term| matches!(term, Some(MotionTerm::Inertia | MotionTerm::TorqueConstant));
        let rough = self.rough.iter().filter(|rough| sets(rough.motion_term));
        rough
            .map(|rough| 1.0 + rough.half_width / rough.value.abs().max(f64::MIN_POSITIVE))
            .product()
    }

    /// Tells whether it moves along a line.
    pub(crate) fn is_linear(&self) -> bool {
        self.geometry() == Geometry::Linear
    }

    /// Models in which its electronics can be run, the finest last.
    pub(crate) fn electronics(&self) -> &'static [ModelFidelity] {
        self.kind().electronics()
    }

    /// Runs the command of a recording with noise and steps of the electronics.
    pub(crate) fn run_with_electronics(
        &self,
        electronics: Electronics,
        state: &State,
        record: &Record,
        place: usize,
    ) -> Result<MachineSignals, GreyboxError> {
        let (model, faults) = (self.with_rough(&state.rough), PhysicalFaults::from(&state.faults));
        let effects = self.acting(state, place);
        let run = model.kind().run_with_electronics(electronics, &record.test(), &faults, &effects);
        let mut signals = run.map_err(|reason| refused(record, reason))?;
        signals.drive = finite(signals.drive, record)?;
        Ok(signals)
    }

    /// The machine as its file says, without effects, made ready for the command of a recording.
    pub(crate) fn prepared(&self, record: &Record) -> PreparedTest {
        self.kind().prepare(&record.test())
    }

    /// The drive signals alone of runs, each in a state and on the command of a recording.
    pub(crate) fn drives(&self, asked: &[AskedDrive<'_>]) -> Vec<Result<Vec<f64>, GreyboxError>> {
        let prepared: Vec<_> = asked.iter().map(|asked| self.prepared_drive(*asked)).collect();
        let run = |n: usize| {
            let (test, numbers, faults, effects) = &prepared[n];
            DriveRun { numbers, test, prepared: asked[n].ready, faults, effects }
        };
        let runs: Vec<DriveRun<'_>> = (0..asked.len()).map(run).collect();
        let drives = self.kind().drives(&runs).into_iter().zip(asked);
        drives
            .map(|(drive, AskedDrive { record, .. })| {
                finite(drive.map_err(|reason| refused(record, reason))?, record)
            })
            .collect()
    }

    /// Test, numbers, damage and effects of a run.
    fn prepared_drive<'a>(
        &self,
        AskedDrive { state, record, place, .. }: AskedDrive<'a>,
    ) -> (MachineTest<'a>, Vec<NumberValue>, PhysicalFaults, Vec<Effect>) {
        let numbers = self.number_values(&state.rough);
        let faults = PhysicalFaults::from(&state.faults);
        (record.test(), numbers, faults, self.acting(state, place))
    }

    fn run(
        &self,
        state: &State,
        record: &Record,
        place: usize,
    ) -> Result<Box<dyn MachineRun>, GreyboxError> {
        let (model, faults) = (self.with_rough(&state.rough), PhysicalFaults::from(&state.faults));
        let effects = self.acting(state, place);
        let run = model.kind().run(&record.test(), &faults, &effects);
        run.map_err(|reason| refused(record, reason))
    }

    /// Effects that are built in and those that act in a recording.
    fn acting(&self, state: &State, place: usize) -> Vec<Effect> {
        let mut effects = self.built_in.clone();
        effects.extend(state.in_record.get(place).unwrap_or(&state.effects).iter().cloned());
        effects
    }
}

/// Rate of comparison over the bandwidth of the control, and its bounds, Hz.
const COMPARED_OVER_BANDWIDTH: f64 = 8.0;
const COMPARED_HZ: [f64; 2] = [50.0, 500.0];

/// A drive signal that is a number throughout.
fn finite(drive: Vec<f64>, record: &Record) -> Result<Vec<f64>, GreyboxError> {
    if drive.iter().all(|x| x.is_finite()) {
        Ok(drive)
    } else {
        Err(GreyboxError::NotFinite { record: record.name.clone() })
    }
}

/// The reason why a machine cannot be run, with the recording.
fn refused(record: &Record, reason: MachineTestError) -> GreyboxError {
    let record = record.name.clone();
    match reason {
        MachineTestError::Simulation(reason) => GreyboxError::Simulation { record, reason },
        MachineTestError::Rate { rate_hz, sample_hz } => {
            GreyboxError::Rate { record, rate_hz, sample_hz }
        }
        other => GreyboxError::Record { record, reason: other.to_string() },
    }
}

#[cfg(test)]
impl Machine {
    /// The axis of the tests.
    pub(crate) fn bench_top() -> Self {
        let text = include_str!("../tests/it/bench_top.toml");
        Self::new(&ema_sim::model_file::parse_machine(text).expect("the axis of the tests"))
    }
}

#[cfg(test)]
mod tests {
    use ema_sim::EffectId;

    use super::*;
    use crate::structure::Structure;

    #[test]
    fn a_wave_of_what_is_shown_holds_no_axis_off_a_command_that_has_not_begun() {
        let machine = Machine::bench_top();
        let nominal = Structure::nominal(&machine);
        let healthy = nominal.starts();
        let mut state = nominal.state(&machine, &healthy);
        let wave = Effect::new(EffectId::TransmissionError, Geometry::Rotary)
            .with("order", 24.0)
            .and_then(|wave| wave.with("error_cos_rad", 1e-3));
        state.add(&wave.expect("numbers of the effect"));
        let at_rest = Record {
            name: "proposed".to_owned(),
            rate_hz: 1000.0,
            command: vec![0.7; 1000],
            kind: CommandKind::Position,
            drive: vec![0.0; 1000],
            position: None,
            load: None,
            filter_hz: None,
            start_rad: None,
        };
        let drive = machine.simulate(&state, &at_rest, 0).expect("a machine at rest").drive;
        assert!(drive.iter().all(|ampere| ampere.abs() < 1e-6), "{:?}", drive.last());
    }
}
