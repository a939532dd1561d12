//! One recording against its equations.

use super::{
    balance::Balance,
    correction::Correction,
    find::{SignalChannel, SignalCode, SignalEquation, SignalFind, SignalSize},
    inputs::Inputs,
    law::{Law, Shift},
    regression::Estimate,
    samples::{Jump, Steps, most_drive},
    view::View,
};
use crate::{error::GreyboxError, machine::Machine, record::Record};

/// Factor up to which a gain is left to the effects of the catalogue: the reading of a current
/// sensor (E19) is at most a half off, and so are the gains of a controller (E21) that is tried.
pub(super) const EFFECTS_UP_TO: f64 = 1.5;
/// Samples of the recording by which a channel may be late: a sample may stand for the beginning
/// or the end of its interval.
const LATE_SAMPLES: f64 = 1.0;
/// Share of the logarithm of the inertia's ratio from which friction is off to the same side: wear
/// adds to friction, and half of the inertia's leaves room for it.
const SAME_SIDE: f64 = 0.5;
/// Share of the drive's energy up to which an equation holds.
const HOLDS: f64 = 0.05;
/// Share of the drive's energy from which on a controller explains less than it leaves.
const FAILS: f64 = 0.5;

/// A recording with its equations.
pub(super) struct Judged<'a> {
    machine: &'a Machine,
    record: &'a Record,
    law: Option<Law<'a>>,
    balance: Option<Balance>,
    blocks: f64,
    /// Chance at which each question may be answered wrongly.
    chance: f64,
}

/// A find with the share of the drive's energy that its correction leaves.
type Explained = (f64, SignalFind);

impl<'a> Judged<'a> {
    pub(super) fn new(
        machine: &'a Machine,
        record: &'a Record,
        chance: f64,
    ) -> Result<Self, GreyboxError> {
        let view = View::of(machine, record).filter(|_| machine.is_axis());
        let law = match view {
            Some(view) if machine.shows_its_controller() => Law::of(machine, view)?,
            _ => None,
        };
        let balance = view.and_then(|view| Balance::of(machine, &view));
        let blocks = view.map_or(1.0, |view| view.blocks());
        Ok(Self { machine, record, law, balance, blocks, chance })
    }

    pub(super) fn record(&self) -> &Record {
        self.record
    }

    /// All that it shows, but for cut signals: samples first, then the equations.
    pub(super) fn finds(&self) -> Result<Vec<SignalFind>, GreyboxError> {
        let samples: Vec<SignalFind> =
            if self.machine.is_axis() { [self.gap(), self.coarse()] } else { [None, None] }
                .into_iter()
                .flatten()
                .collect();
        // a signal that is no longer what it was fails the equations too
        if !samples.is_empty() {
            return Ok(samples);
        }
        Ok(match &self.law {
            Some(law) => self.by_law(law)?.into_iter().collect(),
            None => self.by_balance().into_iter().collect(),
        })
    }

    /// Name and unit of the drive signal, as sentences have them.
    fn drive(&self) -> (&'static str, &'static str) {
        if self.machine.drive_unit() == "v" { ("voltage", "V") } else { ("current", "A") }
    }

    fn name(&self, channel: SignalChannel) -> &'static str {
        match channel {
            SignalChannel::Drive => self.drive().0,
            other => other.word(),
        }
    }

    fn find(
        &self,
        code: SignalCode,
        (equation, channel): (SignalEquation, Option<SignalChannel>),
        size: SignalSize,
        [told, remedy]: [String; 2],
    ) -> SignalFind {
        SignalFind {
            code,
            equation,
            record: self.record.name.clone(),
            channel,
            size,
            told: format!("{}: {told}", self.record.name),
            remedy,
            corrected: false,
            correction: None,
        }
    }

    fn gap(&self) -> Option<SignalFind> {
        let position = self.record.position.as_deref()?;
        let most = most_drive(&self.record.drive, self.machine.drive_limit());
        let acceleration = self.machine.constant() * most / self.machine.inertia();
        let rate_hz = self.record.rate_hz;
        let Jump { sample, size } = Jump::of(position, rate_hz, acceleration)?;
        let unit = if self.machine.is_linear() { "m" } else { "rad" };
        let told = format!(
            "the position jumps by {} {unit} after {:.3} s, further than the drive can move it: \
             samples are missing",
            digits(size),
            sample as f64 / rate_hz
        );
        let remedy = "record it again, or cut it there and give one part".to_owned();
        let place = (SignalEquation::Samples, Some(SignalChannel::Position));
        let size = SignalSize { value: size, std: None, unit };
        Some(self.find(SignalCode::Gap, place, size, [told, remedy]))
    }

    fn coarse(&self) -> Option<SignalFind> {
        let steps = Steps::of(&self.record.drive).filter(Steps::are_coarse)?;
        let (name, unit) = self.drive();
        let told = format!(
            "the {name} has steps of {} {unit}, {:.0} in its whole range, and no noise smooths them",
            digits(steps.size),
            steps.levels
        );
        let remedy = "record it with a finer converter or a narrower range".to_owned();
        let place = (SignalEquation::Samples, Some(SignalChannel::Drive));
        let size = SignalSize { value: steps.size, std: None, unit: self.machine.drive_unit() };
        Some(self.find(SignalCode::Quantised, place, size, [told, remedy]))
    }

    /// Find of the controller's equation, by the balance where it needs to say more.
    fn by_law(&self, law: &Law<'_>) -> Result<Option<SignalFind>, GreyboxError> {
        if let Some(find) = self.turned_drive(law) {
            return Ok(Some(find));
        }
        let before = law.likeness.left;
        let mut told: Vec<Explained> = Vec::new();
        told.extend(self.turned(law)?);
        told.extend(self.shifts(law)?);
        told.extend(self.scaled_position(law)?);
        told.extend(self.own_gains(law));
        told.retain(|(left, _)| *left < HOLDS && self.is_better(before, *left));
        told.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, find)) = told.into_iter().next() {
            return Ok(Some(find));
        }
        if let Some(find) = self.scaled_drive(law) {
            return Ok(Some(find));
        }
        if let Some(inputs) = self.inputs(law) {
            return Ok(Some(inputs));
        }
        if before > FAILS && law.left_of_whole() > HOLDS {
            return Ok(Some(self.another_controller(before)));
        }
        Ok(self.constant())
    }

    /// Tells whether less is left than chance makes it: the likelihood ratio of blocks that count
    /// as one sample each, against chi-squared of one degree.
    fn is_better(&self, before: f64, after: f64) -> bool {
        let ratio = self.blocks * libm::log(before / after.max(f64::MIN_POSITIVE));
        inference::chi_squared_log_tail(ratio, 1) < libm::log(self.chance)
    }

    /// A drive that is minus what the controller makes.
    fn turned_drive(&self, law: &Law<'_>) -> Option<SignalFind> {
        let gain = law.likeness.gain;
        let is_turned = law.likeness.left < HOLDS
            && gain.is_negative(self.chance)
            && is_near_one(gain.scaled(-1.0));
        is_turned.then(|| self.sign(SignalChannel::Drive, gain))
    }

    /// Position or command with the wrong sign.
    fn turned(&self, law: &Law<'_>) -> Result<Vec<Explained>, GreyboxError> {
        let (command, position) = (self.record.command.as_slice(), law.position());
        let minus = |signal: &[f64]| signal.iter().map(|x| -x).collect::<Vec<f64>>();
        let turned = [
            (SignalChannel::Position, law.with(command, &minus(position))?),
            (SignalChannel::Command, law.with(&minus(command), position)?),
        ];
        let mut found = Vec::new();
        for (channel, likeness) in turned {
            let Some(likeness) = likeness.filter(|one| is_near_one(one.gain)) else { continue };
            let gain = likeness.gain.scaled(-1.0);
            found.push((likeness.left, self.sign(channel, gain)));
        }
        Ok(found)
    }

    fn sign(&self, channel: SignalChannel, gain: Estimate) -> SignalFind {
        let name = self.name(channel);
        let told = format!("the {name} channel has the wrong sign");
        let remedy = "`--correct` turns it".to_owned();
        let place = (SignalEquation::Controller, Some(channel));
        let mut find = self.find(SignalCode::Sign, place, size(gain, "1"), [told, remedy]);
        find.correction = Some(Correction::Divided(-1.0));
        find
    }

    /// A channel that is late or early.
    fn shifts(&self, law: &Law<'_>) -> Result<Vec<Explained>, GreyboxError> {
        let mut found = Vec::new();
        let shifts = [
            (SignalChannel::Drive, law.drive_late()),
            (SignalChannel::Position, law.position_late()?),
            (SignalChannel::Command, law.command_late()?),
        ];
        for (channel, shift) in shifts {
            let Some(Shift { number: late_s, gain, left }) = shift else { continue };
            let is_late = late_s.is_beyond(LATE_SAMPLES / self.record.rate_hz, self.chance);
            if !is_late || !is_near_one(gain) {
                continue;
            }
            // the slow reading of a sensor is an effect (E19), and so is a controller that is late
            // itself (E21): then the motion follows the drive as recorded
            let is_effect = channel == SignalChannel::Drive
                && late_s.value > 0.0
                && (law.left_by_lag() < left || !self.is_logged_late(late_s.value));
            if !is_effect {
                let equation = SignalEquation::Controller;
                found.push((left, self.late(channel, late_s, equation)));
            }
        }
        Ok(found)
    }

    /// Tells whether the drive is late against the motion as well.
    fn is_logged_late(&self, late_s: f64) -> bool {
        self.balance.as_ref().is_none_or(|balance| balance.left_if_late(late_s) < balance.left())
    }

    fn late(
        &self,
        channel: SignalChannel,
        late_s: Estimate,
        equation: SignalEquation,
    ) -> SignalFind {
        let way = if late_s.value > 0.0 { "late" } else { "early" };
        let (ms, std_ms) = (1e3 * late_s.value.abs(), digits(1e3 * late_s.std));
        let told = format!(
            "the {} channel is {ms:.1} ms {way} (standard deviation {std_ms} ms)",
            self.name(channel)
        );
        let remedy = "`--correct` shifts it".to_owned();
        let place = (equation, Some(channel));
        let mut find = self.find(SignalCode::Late, place, size(late_s, "s"), [told, remedy]);
        find.correction = Some(Correction::Earlier(late_s.value));
        find
    }

    /// A position on another scale than the command.
    fn scaled_position(&self, law: &Law<'_>) -> Result<Option<Explained>, GreyboxError> {
        let (command, position) = (&self.record.command, law.position());
        if self.record.kind != ema_sim::CommandKind::Position || law.likeness.left < HOLDS {
            return Ok(None);
        }
        let columns = [command.clone(), vec![1.0; command.len()]];
        let block = libm::round(super::view::BLOCK_S * self.record.rate_hz) as usize;
        let fit = super::regression::Regression::of(position, &columns, block);
        let Some(near) = fit.map(|fit| fit.coefficients[0]).filter(|near| *near > 0.0) else {
            return Ok(None);
        };
        let found = law.position_scaled(near)?;
        let Some(Shift { number: ratio, gain, left }) = found else { return Ok(None) };
        if !ratio.is_factor_beyond(EFFECTS_UP_TO, self.chance) || !is_near_one(gain) {
            return Ok(None);
        }
        let told = format!(
            "the position is {} times what the command asks for (standard deviation {})",
            digits(ratio.value),
            digits(ratio.std)
        );
        let remedy = "`--correct` divides it".to_owned();
        let place = (SignalEquation::Controller, Some(SignalChannel::Position));
        let mut find = self.find(SignalCode::Gain, place, size(ratio, "1"), [told, remedy]);
        find.correction = Some(Correction::Divided(ratio.value));
        Ok(Some((left, find)))
    }

    /// A drive that is a multiple of its replay: the channel where the motion says so too, else the
    /// controller.
    fn scaled_drive(&self, law: &Law<'_>) -> Option<SignalFind> {
        let gain = law.likeness.gain;
        if law.likeness.left > HOLDS || !gain.is_factor_beyond(EFFECTS_UP_TO, self.chance) {
            return None;
        }
        let inertia = self.balance.as_ref().filter(|b| b.says_something()).map(|b| b.inertia.value);
        // of a scaled channel the inertia is scaled alike, of another controller it is right
        let is_channel = inertia.is_some_and(|ratio| {
            ratio > 0.0 && libm::log(ratio / gain.value).abs() < libm::log(ratio).abs()
        });
        let (name, _) = self.drive();
        let (value, std) = (digits(gain.value), digits(gain.std));
        Some(if is_channel {
            let told = format!(
                "the {name} is {value} times what controller and motion ask for (standard deviation \
                 {std})"
            );
            let remedy = "`--correct` divides it".to_owned();
            let place = (SignalEquation::Controller, Some(SignalChannel::Drive));
            let mut find = self.find(SignalCode::Gain, place, size(gain, "1"), [told, remedy]);
            find.correction = Some(Correction::Divided(gain.value));
            find
        } else {
            let told = format!(
                "the {name} is {value} times what the controller of the model file makes of command and \
                 position (standard deviation {std}), and its torque fits the motion"
            );
            self.of_controller(gain, told)
        })
    }

    /// A find of gains that are not those of the model file.
    fn of_controller(&self, ratio: Estimate, told: String) -> SignalFind {
        let remedy = "give the model file the gains of the controller that was run".to_owned();
        let place = (SignalEquation::Controller, None);
        self.find(SignalCode::Controller, place, size(ratio, "1"), [told, remedy])
    }

    /// A controller with other gains than the model file's.
    fn own_gains(&self, law: &Law<'_>) -> Option<Explained> {
        let ([of_position, of_speed], left) = law.own_gains()?;
        let is_far = |ratio: &Estimate| ratio.is_factor_beyond(EFFECTS_UP_TO, self.chance);
        // both loops scaled alike are a scaled drive
        let of_loops =
            [(of_position, "position"), (of_speed.filter(|_| of_position.is_some()), "speed")];
        let far =
            of_loops.into_iter().filter_map(|(ratio, name)| Some((ratio.filter(is_far)?, name)));
        let (ratio, name) = far.max_by(|(a, _), (b, _)| {
            libm::log(a.value).abs().total_cmp(&libm::log(b.value).abs())
        })?;
        let told = format!(
            "the gain of the {name} loop is {} times that of the model file (standard deviation {})",
            digits(ratio.value),
            digits(ratio.std)
        );
        Some((left, self.of_controller(ratio, told)))
    }

    /// A drive signal that the controller does not make, whatever is changed.
    fn another_controller(&self, left: f64) -> SignalFind {
        let told = format!(
            "the controller of the model file leaves {:.0} % of the {}'s energy, and no shift, sign \
             or gain explains it",
            100.0 * left,
            self.drive().0
        );
        let remedy = "give the model file the controller that was run, or, of a servo axis, use \
                      `--inverse-dynamics`"
            .to_owned();
        let place = (SignalEquation::Controller, None);
        let size = SignalSize { value: left, std: None, unit: "1" };
        self.find(SignalCode::Controller, place, size, [told, remedy])
    }

    /// Inputs behind the controller.
    fn inputs(&self, law: &Law<'_>) -> Option<SignalFind> {
        let record = self.record;
        let Inputs { values, lasting_s, largest } =
            Inputs::of(&law.residual(), &record.drive, record.rate_hz, law.kept())?;
        let (name, unit) = self.drive();
        let told = format!(
            "for {lasting_s:.2} s the {name} is up to {} {unit} off what the controller makes of \
             command and position: inputs come in behind it",
            digits(largest.abs())
        );
        let remedy = "`--correct` takes them for a load".to_owned();
        let size = SignalSize { value: largest, std: None, unit: self.machine.drive_unit() };
        let place = (SignalEquation::Controller, Some(SignalChannel::Drive));
        let mut find = self.find(SignalCode::Disturbed, place, size, [told, remedy]);
        let torque_per_drive = self.machine.constant();
        find.correction = Some(Correction::Inputs { values, torque_per_drive });
        Some(find)
    }

    /// Inertia by the balance over that of the model file, where it is farther off than effects and
    /// tolerances go, friction is off to the same side, and the balance holds: that of a motor that
    /// saturates (E13) does not.
    fn all_off(&self) -> Option<Estimate> {
        let balance = self.balance.as_ref().filter(|balance| balance.left() < HOLDS)?;
        let limit = EFFECTS_UP_TO * self.machine.motion_room();
        let is_off = balance.inertia.is_factor_beyond(limit, self.chance);
        let is_same_side = balance.friction_ratio.is_none_or(|friction| {
            let inertia = libm::log(balance.inertia.value);
            friction > 0.0 && libm::log(friction) / inertia > SAME_SIDE
        });
        (is_off && is_same_side).then_some(balance.inertia)
    }

    /// Inertia over that of the model file, where the balance says something.
    pub(super) fn inertia(&self) -> Option<Estimate> {
        let balance = self.balance.as_ref().filter(|balance| balance.says_something())?;
        Some(balance.inertia).filter(|inertia| inertia.value > 0.0)
    }

    /// A constant of the motor, or an inertia, that is far off where the controller's law holds.
    fn constant(&self) -> Option<SignalFind> {
        let (name, _) = self.drive();
        let place = (SignalEquation::Balance, None);
        let balance = self.balance.as_ref()?;
        if balance.is_turned(self.chance) {
            let told = "the motor pushes against its motion".to_owned();
            let remedy = "turn the sign of its constant in the model file".to_owned();
            let size = size(balance.inertia, "1");
            return Some(self.find(SignalCode::Constant, place, size, [told, remedy]));
        }
        let ratio = self.all_off()?;
        let told = format!(
            "motion and {name} ask for {} times the inertia over the motor's constant (standard \
             deviation {})",
            digits(ratio.value),
            digits(ratio.std)
        );
        let remedy = "mend the constant of the motor or the inertia in the model file".to_owned();
        Some(self.find(SignalCode::Constant, place, size(ratio, "1"), [told, remedy]))
    }

    /// Find of the balance of torques, where the controller is not known.
    fn by_balance(&self) -> Option<SignalFind> {
        let balance = self.balance.as_ref()?;
        let place = (SignalEquation::Balance, Some(SignalChannel::Drive));
        let (name, _) = self.drive();
        if balance.is_turned(self.chance) {
            let told = format!("the {name} channel has the wrong sign");
            let remedy = "`--correct` turns it".to_owned();
            let size = size(balance.inertia, "1");
            let mut find = self.find(SignalCode::Sign, place, size, [told, remedy]);
            find.correction = Some(Correction::Divided(-1.0));
            return Some(find);
        }
        let (late_s, left) = balance.late_s();
        let is_late = late_s.is_beyond(LATE_SAMPLES / self.record.rate_hz, self.chance);
        if is_late && balance.says_something() && self.is_better(balance.left(), left) {
            return Some(self.late(SignalChannel::Drive, late_s, SignalEquation::Balance));
        }
        let ratio = self.all_off()?;
        let told = format!(
            "motion and {name} ask for {} times the inertia over the motor's constant (standard \
             deviation {}): the unit of a channel, that inertia or that constant is wrong",
            digits(ratio.value),
            digits(ratio.std)
        );
        let remedy = "mend the unit of the channel, or the model file".to_owned();
        Some(self.find(SignalCode::Gain, place, size(ratio, "1"), [told, remedy]))
    }
}

/// Tells whether a gain is one as far as effects go.
fn is_near_one(gain: Estimate) -> bool {
    gain.value > 0.0 && libm::log(gain.value).abs() < libm::log(EFFECTS_UP_TO)
}

fn size(estimate: Estimate, unit: &'static str) -> SignalSize {
    SignalSize { value: estimate.value, std: Some(estimate.std), unit }
}

/// Three significant digits.
pub(super) fn digits(value: f64) -> String {
    let text = format!("{value:.2e}");
    text.parse::<f64>().map_or(text, |value| value.to_string())
}
