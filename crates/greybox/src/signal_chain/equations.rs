//! Channels that are late, turned or scaled, and numbers that are far off, by the equations of
//! controller and motion together: the first says that something is wrong, both together which
//! channel it is.

use super::{
    SignalChannel, SignalCode, SignalEquation, SignalFault,
    correction::Correction,
    law::{Likeness, Shift},
    recorded::{Judged, Recorded},
};
use crate::error::GreyboxError;

/// Share of the drive's energy up to which the controller's law explains it.
pub(super) const FITS: f64 = 0.05;
/// Part of what is left without a correction that may be left with it.
const SETTLES: f64 = 0.3;
/// Part of what the balance leaves without a shift that may be left with it, where it alone judges.
const BALANCE_SETTLES: f64 = 0.5;
/// Least shift that is told, s, and over the length of a sample.
const LEAST_SHIFT_S: f64 = 1.5e-3;
const LEAST_SHIFT_SAMPLES: f64 = 0.5;
/// Factor from which on a gain is far off: gains of sensors and controllers within it are effects of
/// the catalogue (E19, E21).
const FAR: f64 = 1.6;
/// Departure of a gain from one, or minus one, that a shift or a turned channel may leave.
const NEAR_ONE: f64 = 0.35;
/// Share of the drive's energy that a law has to leave for a position to be tried on another scale.
const GROSS: f64 = 0.1;

/// What is wrong with a recording by its equations.
pub(super) fn fault(judged: &Judged<'_>) -> Result<Option<SignalFault>, GreyboxError> {
    if judged.law.is_none() {
        return Ok(by_balance(judged));
    }
    for rule in [turned, late, scaled] {
        if let Some(fault) = rule(judged)? {
            return Ok(Some(fault));
        }
    }
    Ok(another_controller(judged).or_else(|| constant(judged)))
}

fn is_far(ratio: f64) -> bool {
    !(ratio > 1.0 / FAR && ratio < FAR)
}

/// A channel with the wrong sign.
fn turned(judged: &Judged<'_>) -> Result<Option<SignalFault>, GreyboxError> {
    let Some(law) = &judged.law else { return Ok(None) };
    let is_minus_one = |l: &Likeness| l.left < FITS && (l.gain + 1.0).abs() < NEAR_ONE;
    if is_minus_one(&law.likeness) {
        return Ok(Some(sign(judged, SignalChannel::Drive, SignalEquation::Controller)));
    }
    if law.likeness.left < GROSS {
        return Ok(None);
    }
    let (command, position) = (&judged.record.command, law.position());
    let minus = |signal: &[f64]| signal.iter().map(|x| -x).collect::<Vec<f64>>();
    let of_position = law.with(command, &minus(position))?;
    let is_one = |l: &Likeness| l.left < FITS && (l.gain - 1.0).abs() < NEAR_ONE;
    if of_position.as_ref().is_some_and(is_one) {
        return Ok(Some(sign(judged, SignalChannel::Position, SignalEquation::Controller)));
    }
    if of_position.as_ref().is_some_and(is_minus_one) {
        return Ok(Some(sign(judged, SignalChannel::Command, SignalEquation::Controller)));
    }
    Ok(None)
}

fn sign(judged: &Judged<'_>, channel: SignalChannel, equation: SignalEquation) -> SignalFault {
    let name = name(judged, channel);
    let told = format!("the sign of the {name} is wrong");
    let mut fault = judged.fault(SignalCode::Sign, equation, Some(channel), (-1.0, "1"), &told);
    fault.correction = Some(Correction::Divided(-1.0));
    fault
}

fn name(judged: &Judged<'_>, channel: SignalChannel) -> &'static str {
    match channel {
        SignalChannel::Drive => judged.drive().0,
        other => other.name(),
    }
}

/// A channel that is late.
fn late(judged: &Judged<'_>) -> Result<Option<SignalFault>, GreyboxError> {
    let Some(law) = &judged.law else { return Ok(None) };
    let before = law.likeness.left;
    let mut shifts = vec![(SignalChannel::Drive, law.drive_late())];
    // of an actuator the replay does not know where the surface is in its play
    if before > FITS && judged.machine.is_axis() {
        shifts.push((SignalChannel::Position, law.position_late()?));
        shifts.push((SignalChannel::Command, law.command_late()?));
    }
    shifts.sort_by(|a, b| a.1.likeness.left.total_cmp(&b.1.likeness.left));
    let Some((channel, shift)) = shifts.first() else { return Ok(None) };
    let Shift { late_s, likeness } = shift;
    let settles = likeness.left < FITS
        && likeness.left < SETTLES * before
        && (likeness.gain - 1.0).abs() < NEAR_ONE;
    if !settles || !is_shift(judged, *late_s) || !is_logged(judged, *channel, *late_s) {
        return Ok(None);
    }
    Ok(Some(lateness(judged, *channel, *late_s, SignalEquation::Controller)))
}

/// Tells whether a shift is long enough to be told.
fn is_shift(judged: &Judged<'_>, late_s: f64) -> bool {
    late_s.abs() > LEAST_SHIFT_S.max(LEAST_SHIFT_SAMPLES / judged.record.rate_hz)
}

/// Tells whether a channel is late in the log and not in the loop: in the log it is late against the
/// motion too. No motion says so of the command.
fn is_logged(judged: &Judged<'_>, channel: SignalChannel, late_s: f64) -> bool {
    let drive_late_s = match channel {
        SignalChannel::Command => return true,
        SignalChannel::Drive => late_s,
        SignalChannel::Position => -late_s,
    };
    let Some(balance) = &judged.balance else { return false };
    let with = balance.left_if_late(drive_late_s);
    with < balance.left() && (balance.says_something() || with < FITS)
}

fn lateness(
    judged: &Judged<'_>,
    channel: SignalChannel,
    late_s: f64,
    equation: SignalEquation,
) -> SignalFault {
    let (way, ms) = (if late_s > 0.0 { "late" } else { "early" }, 1e3 * late_s.abs());
    let told = format!("the {} channel is {ms:.1} ms {way}", name(judged, channel));
    let mut fault = judged.fault(SignalCode::Late, equation, Some(channel), (late_s, "s"), &told);
    fault.correction = Some(Correction::Earlier(late_s));
    fault
}

/// A channel that is a multiple of what it should be, or a controller whose output is.
fn scaled(judged: &Judged<'_>) -> Result<Option<SignalFault>, GreyboxError> {
    let Some(law) = &judged.law else { return Ok(None) };
    let Likeness { gain, left, .. } = law.likeness;
    if left < FITS && gain > 0.0 && is_far(gain) {
        // of a scaled channel the inertia is scaled alike, of another controller it is right
        let ratio = judged.balance.as_ref().and_then(|balance| balance.inertia_ratio);
        let is_channel =
            ratio.is_some_and(|ratio| ratio > 0.0 && (ratio / gain).ln().abs() < ratio.ln().abs());
        return Ok(Some(if is_channel { gained(judged, gain) } else { regained(judged, gain) }));
    }
    if left < GROSS {
        return Ok(None);
    }
    let (command, position) = (&judged.record.command, law.position());
    let Some(ratio) = slope(command, position).filter(|ratio| *ratio > 0.0 && is_far(*ratio))
    else {
        return Ok(None);
    };
    let on_scale: Vec<f64> = position.iter().map(|p| p / ratio).collect();
    let fits = law.with(command, &on_scale)?;
    let fits = fits.is_some_and(|l| l.left < FITS && (l.gain - 1.0).abs() < NEAR_ONE);
    Ok(fits.then(|| {
        let told = format!("the position is {ratio:.3} times what the command asks for");
        let (code, equation) = (SignalCode::Gain, SignalEquation::Controller);
        let channel = Some(SignalChannel::Position);
        let mut fault = judged.fault(code, equation, channel, (ratio, "1"), &told);
        fault.correction = Some(Correction::Divided(ratio));
        fault
    }))
}

/// Slope of a signal over another, both about their means.
fn slope(x: &[f64], y: &[f64]) -> Option<f64> {
    let mean = |signal: &[f64]| signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    let (mean_x, mean_y) = (mean(x), mean(y));
    let along: f64 = x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let square: f64 = x.iter().map(|x| (x - mean_x) * (x - mean_x)).sum();
    (square > 0.0).then(|| along / square)
}

fn gained(judged: &Judged<'_>, gain: f64) -> SignalFault {
    let name = judged.drive().0;
    let told = format!("the {name} channel is {gain:.3} times what controller and motion ask for");
    let (code, equation) = (SignalCode::Gain, SignalEquation::Controller);
    let mut fault = judged.fault(code, equation, Some(SignalChannel::Drive), (gain, "1"), &told);
    fault.correction = Some(Correction::Divided(gain));
    fault
}

fn regained(judged: &Judged<'_>, gain: f64) -> SignalFault {
    let name = judged.drive().0;
    let told = format!(
        "the {name} is {gain:.3} times what the model's controller makes of command and position: \
         its gains are others"
    );
    let (code, equation) = (SignalCode::Controller, SignalEquation::Controller);
    judged.fault(code, equation, None, (gain, "1"), &told)
}

/// A controller with other gains than the model file's.
fn another_controller(judged: &Judged<'_>) -> Option<SignalFault> {
    let law = judged.law.as_ref().filter(|_| judged.machine.is_axis())?;
    if law.likeness.left < GROSS {
        return None;
    }
    let (ratios, left) = law.own_gains()?;
    if left >= FITS || left >= SETTLES * law.likeness.left {
        return None;
    }
    let names = ["position", "speed"];
    let mut of_loops = ratios.into_iter().zip(names);
    let (ratio, loop_name) = of_loops.find(|(ratio, _)| *ratio > 0.0 && is_far(*ratio))?;
    let told = format!(
        "the gain of the {loop_name} loop is {ratio:.3} times that of the model file, by command, \
         position and drive"
    );
    let (code, equation) = (SignalCode::Controller, SignalEquation::Controller);
    Some(judged.fault(code, equation, None, (ratio, "1"), &told))
}

/// A constant of the motor, or an inertia, that is far off where the controller's law holds.
fn constant(judged: &Judged<'_>) -> Option<SignalFault> {
    let law = judged.law.as_ref()?;
    let ratio = judged.balance.as_ref()?.inertia_ratio?;
    if law.likeness.left > FITS || !is_far(ratio) {
        return None;
    }
    let told = if ratio > 0.0 {
        format!(
            "motion and {} ask for {ratio:.3} times the inertia of the model file: that inertia, the \
             motor's constant or the unit of the motion is wrong",
            judged.drive().0
        )
    } else {
        "the motor pushes against its motion: the sign of its constant is wrong".to_owned()
    };
    let (code, equation) = (SignalCode::Constant, SignalEquation::Balance);
    Some(judged.fault(code, equation, None, (ratio, "1"), &told))
}

/// What the balance of torques alone tells, where the controller is not known.
fn by_balance(judged: &Judged<'_>) -> Option<SignalFault> {
    let balance = judged.balance.as_ref()?;
    if balance.is_turned() {
        return Some(sign(judged, SignalChannel::Drive, SignalEquation::Balance));
    }
    let (late_s, left) = balance.late_s();
    let settles = left < BALANCE_SETTLES * balance.left() && left < FITS;
    if settles && is_shift(judged, late_s) {
        return Some(lateness(judged, SignalChannel::Drive, late_s, SignalEquation::Balance));
    }
    let ratio = balance.inertia_ratio.filter(|ratio| is_far(*ratio))?;
    let told = format!(
        "motion and {} ask for {ratio:.3} times the inertia of the model file: the unit of a channel, \
         that inertia or the motor's constant is wrong",
        judged.drive().0
    );
    let (code, equation) = (SignalCode::Gain, SignalEquation::Balance);
    Some(judged.fault(code, equation, None, (ratio, "1"), &told))
}

/// What is held out by its inertia of another machine than what is fitted.
pub(super) fn other_machine(fitted: &[Recorded], held_out: &[Recorded]) -> Option<SignalFault> {
    let inertia = |one: &&Recorded| one.check.inertia_ratio.filter(|ratio| *ratio > 0.0);
    let mut known: Vec<f64> = fitted.iter().filter_map(|one| inertia(&one)).collect();
    known.sort_by(f64::total_cmp);
    let middle = known.get(known.len() / 2)?;
    let ratio_of = |one: &&Recorded| inertia(one).map(|ratio| ratio / middle);
    let (other, ratio) = held_out
        .iter()
        .find_map(|one| ratio_of(&one).filter(|ratio| is_far(*ratio)).map(|ratio| (one, ratio)))?;
    let name = &other.name;
    Some(SignalFault {
        code: SignalCode::OtherMachine,
        equation: SignalEquation::Balance,
        record: name.clone(),
        channel: None,
        value: ratio,
        unit: "1",
        told: format!(
            "{name}: motion and drive ask for {ratio:.3} times the inertia of the recordings fitted: \
             it is of another machine"
        ),
        corrected: false,
        correction: None,
    })
}
