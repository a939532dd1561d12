//! Guesses at the columns of a foreign file, from their names.

use std::fmt;

use super::{
    ChannelName::{
        self, BusVoltage, Command, Current, Force, HallState, LinearCommand, Load, MotorAngle,
        MotorSpeed, PhaseACurrent, PhaseAVoltage, PhaseBCurrent, PhaseBVoltage, PhaseCCurrent,
        PhaseCVoltage, Position, QAxisCurrent, QAxisVoltage, SurfaceAngle, WindingTemperature,
    },
    column_map::Target,
    unit::si_unit,
};

/// A column that may be a channel: to be shown and confirmed, never taken.
///
/// Written, it is an entry of a [`ColumnMap`](super::ColumnMap).
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnGuess {
    target: Target,
    column: String,
    factor: f64,
}

impl fmt::Display for ColumnGuess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.target.column(), self.column)?;
        if self.factor != 1.0 {
            write!(f, "*{}", self.factor)?;
        }
        Ok(())
    }
}

/// Names of each target in other programs, words in their order joined by spaces.
const NAMES: &[(Target, &[&str])] = &[
    (Target::Time, &["time", "t", "timestamp", "datetime", "zeit", "temps", "elapsed", "seconds"]),
    (
        of(PhaseACurrent),
        &["phase a current", "current a phase", "i a", "ia", "i u", "iu", "i 1", "i1", "current u"],
    ),
    (
        of(PhaseBCurrent),
        &["phase b current", "current b phase", "i b", "ib", "i v", "iv", "i 2", "i2", "current v"],
    ),
    (
        of(PhaseCCurrent),
        &["phase c current", "current c phase", "i c", "ic", "i w", "iw", "i 3", "i3", "current w"],
    ),
    (
        of(MotorAngle),
        &[
            "motor angle",
            "rotor angle",
            "theta m",
            "theta motor",
            "motor position",
            "encoder angle",
        ],
    ),
    (of(Current), &["current", "i", "motor current", "i motor", "envelope", "strom", "courant"]),
    (of(QAxisCurrent), &["iq", "i q", "q current", "q axis current", "torque current"]),
    (
        of(Command),
        &["command", "command angle", "setpoint", "set point", "reference", "sollwert", "demand"],
    ),
    (of(LinearCommand), &["command position", "position command", "position setpoint"]),
    (of(SurfaceAngle), &["surface angle", "output angle", "angle", "istwert"]),
    (of(Position), &["position", "stroke", "displacement", "weg"]),
    (of(MotorSpeed), &["motor speed", "rotor speed", "speed", "omega", "omega m", "drehzahl"]),
    (of(Load), &["load", "load torque", "torque", "moment", "drehmoment"]),
    (of(Force), &["force", "load force", "kraft"]),
    (of(PhaseAVoltage), &["phase a voltage", "v a", "va", "u a", "ua", "u u"]),
    (of(PhaseBVoltage), &["phase b voltage", "v b", "vb", "u b", "ub", "u v"]),
    (of(PhaseCVoltage), &["phase c voltage", "v c", "vc", "u c", "uc", "u w"]),
    (of(QAxisVoltage), &["vq", "uq", "v q", "u q", "q axis voltage"]),
    (
        of(BusVoltage),
        &["bus voltage", "dc bus", "dc link", "dc link voltage", "vdc", "udc", "v dc"],
    ),
    (of(HallState), &["hall", "hall state", "hall sensors", "sector"]),
    (of(WindingTemperature), &["winding temperature", "motor temperature", "temp winding"]),
];

const fn of(name: ChannelName) -> Target {
    Target::Channel(name)
}

/// Units that a name may end in as separate words, as they are lower-case, and what makes SI of
/// them. Longer ones first.
const UNITS: &[(&[&str], &str, f64)] = &[
    (&["rad", "per", "s"], "rad/s", 1.0),
    (&["rad", "s"], "rad/s", 1.0),
    (&["deg", "s"], "rad/s", std::f64::consts::PI / 180.0),
    (&["m", "s"], "m/s", 1.0),
    (&["1", "min"], "rad/s", std::f64::consts::TAU / 60.0),
    (&["n", "m"], "N·m", 1.0),
    (&["rpm"], "rad/s", std::f64::consts::TAU / 60.0),
    (&["nm"], "N·m", 1.0),
    (&["s"], "s", 1.0),
    (&["sec"], "s", 1.0),
    (&["ms"], "s", 1e-3),
    (&["us"], "s", 1e-6),
    (&["ns"], "s", 1e-9),
    (&["ma"], "A", 1e-3),
    (&["amp"], "A", 1.0),
    (&["amps"], "A", 1.0),
    (&["rad"], "rad", 1.0),
    (&["deg"], "rad", std::f64::consts::PI / 180.0),
    (&["mm"], "m", 1e-3),
    (&["m"], "m", 1.0),
    (&["n"], "N", 1.0),
    (&["kn"], "N", 1e3),
    (&["v"], "V", 1.0),
    (&["mv"], "V", 1e-3),
    (&["k"], "K", 1.0),
];

/// Which of the columns may be time, a current or the motor's angle; each target at
/// most once, in the order time, phases, angle, envelope.
pub fn guess_columns<S: AsRef<str>>(columns: &[S]) -> Vec<ColumnGuess> {
    let mut guesses: Vec<ColumnGuess> = Vec::new();
    for &(target, names) in NAMES {
        let fits = |column: &&str| {
            let taken = guesses.iter().any(|guess| guess.column == **column);
            !taken && Target::from_column(column).is_none()
        };
        let scored = columns.iter().map(AsRef::as_ref).filter(fits).filter_map(|column| {
            let ranked = |column: &str| {
                let (words, factor) = read(column, target);
                Some((names.iter().position(|name| *name == words)?, factor))
            };
            // a channel of a group, a field of a struct
            let own = || column.rsplit(['/', '.']).next().filter(|own| *own != column);
            let (rank, factor) = ranked(column).or_else(|| ranked(own()?))?;
            Some((rank, column, factor))
        });
        if let Some((_, column, factor)) = scored.min_by_key(|(rank, ..)| *rank) {
            guesses.push(ColumnGuess { target, column: column.to_owned(), factor });
        }
    }
    guesses
}

/// The words of a name without its unit, and the factor of the unit, which is one of the target. An
/// `A` in brackets is ampere; bare, it may be the phase.
fn read(column: &str, target: Target) -> (String, f64) {
    let bare = column.replace("[A]", " ").replace("(A)", " ").to_lowercase();
    let mut words: Vec<&str> = bare
        .split(|letter: char| !letter.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .collect();
    let ends = |(unit, of, _): &&(&[&str], &str, f64)| {
        *of == si_unit(target) && words.len() > unit.len() && words.ends_with(unit)
    };
    let unit = UNITS.iter().find(ends).map(|(unit, _, factor)| (unit.len(), *factor));
    let ampere = target == of(Current) && words.len() > 1 && words.last() == Some(&"a");
    let (length, factor) = unit.unwrap_or((usize::from(ampere), 1.0));
    words.truncate(words.len() - length);
    (words.join(" "), factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guesses(columns: &[&str]) -> Vec<String> {
        guess_columns(columns).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn usual_names_are_understood() {
        assert_eq!(
            guesses(&["Time [ms]", "I_A", "I_B", "I_C", "Rotor angle (deg)"]),
            [
                "time_s=Time [ms]*0.001",
                "phase_a_current_a=I_A",
                "phase_b_current_a=I_B",
                "phase_c_current_a=I_C",
                "motor_angle_rad=Rotor angle (deg)*0.017453292519943295",
            ]
        );
        assert_eq!(
            guesses(&["t_s", "motor_current_mA"]),
            ["time_s=t_s", "current_a=motor_current_mA*0.001"]
        );
        assert_eq!(guesses(&["time", "Strom [A]"]), ["time_s=time", "current_a=Strom [A]"]);
        assert_eq!(
            guesses(&["set_point", "time", "current"]),
            ["time_s=time", "current_a=current", "command_rad=set_point"]
        );
    }

    #[test]
    fn every_channel_has_its_guess() {
        assert_eq!(
            guesses(&["Motor speed [rpm]", "Torque (Nm)", "Setpoint [deg]", "DC link [V]", "iq"]),
            [
                "q_axis_current_a=iq",
                "command_rad=Setpoint [deg]*0.017453292519943295",
                "motor_speed_rad_per_s=Motor speed [rpm]*0.10471975511965977",
                "load_n_m=Torque (Nm)",
                "bus_voltage_v=DC link [V]",
            ]
        );
    }

    #[test]
    fn groups_and_structs_are_looked_into() {
        assert_eq!(
            guesses(&["bench/Time [ms]", "bench/I_A", "rec.ib"]),
            [
                "time_s=bench/Time [ms]*0.001",
                "phase_a_current_a=bench/I_A",
                "phase_b_current_a=rec.ib"
            ]
        );
    }

    #[test]
    fn known_and_unknown_columns_are_left_alone() {
        assert!(guesses(&["time_s", "current_a", "voltage", "remark", "time of day"]).is_empty());
    }

    #[test]
    fn a_guess_can_be_given_as_a_map() {
        let entries = guesses(&["Time [ms]", "I_A"]);
        assert!(crate::ColumnMap::new(entries).is_ok());
    }
}
