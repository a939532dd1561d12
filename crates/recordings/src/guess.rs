//! Guesses at the columns of a foreign file, from their names.

use std::fmt;

use super::{
    ChannelName::{
        self, BusVoltage, Command, Current, Duty, Force, HallState, LinearCommand, Load,
        MotorAngle, MotorSpeed, MotorVoltage, PhaseACurrent, PhaseAVoltage, PhaseBCurrent,
        PhaseBVoltage, PhaseCCurrent, PhaseCVoltage, Position, QAxisCurrent, QAxisVoltage,
        SurfaceAngle, WindingTemperature,
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
    (Target::Time, &["timestamps", "times", "date time", "time stamp", "laufzeit", "uhrzeit"]),
    (Target::Time, &["tempo", "tiempo", "x value", "x axis", "index level 0", "sample time"]),
    (Target::Time, &["ts", "dt", "tinterval", "t interval", "abtastzeit", "date"]),
    (
        of(PhaseACurrent),
        &["phase a current", "current a phase", "i a", "ia", "i u", "iu", "i 1", "i1", "current u"],
    ),
    (
        of(PhaseACurrent),
        &["phase current a", "current a", "current phase a", "i phase a", "phase a", "phase u"],
    ),
    (
        of(PhaseACurrent),
        &[
            "strom a",
            "strom u",
            "strom l1",
            "phasenstrom a",
            "phasenstrom u",
            "courant a",
            "courant u",
        ],
    ),
    (of(PhaseACurrent), &["corrente a", "corrente u", "corriente a", "corriente u", "i l1", "il1"]),
    (
        of(PhaseBCurrent),
        &["phase b current", "current b phase", "i b", "ib", "i v", "iv", "i 2", "i2", "current v"],
    ),
    (
        of(PhaseBCurrent),
        &["phase current b", "current b", "current phase b", "i phase b", "phase b", "phase v"],
    ),
    (
        of(PhaseBCurrent),
        &[
            "strom b",
            "strom v",
            "strom l2",
            "phasenstrom b",
            "phasenstrom v",
            "courant b",
            "courant v",
        ],
    ),
    (of(PhaseBCurrent), &["corrente b", "corrente v", "corriente b", "corriente v", "i l2", "il2"]),
    (
        of(PhaseCCurrent),
        &["phase c current", "current c phase", "i c", "ic", "i w", "iw", "i 3", "i3", "current w"],
    ),
    (
        of(PhaseCCurrent),
        &["phase current c", "current c", "current phase c", "i phase c", "phase c", "phase w"],
    ),
    (
        of(PhaseCCurrent),
        &[
            "strom c",
            "strom w",
            "strom l3",
            "phasenstrom c",
            "phasenstrom w",
            "courant c",
            "courant w",
        ],
    ),
    (of(PhaseCCurrent), &["corrente c", "corrente w", "corriente c", "corriente w", "i l3", "il3"]),
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
    (of(MotorAngle), &["rotor position", "angle rotor", "angle motor", "position motor", "theta"]),
    (of(MotorAngle), &["theta rotor", "phi rotor", "phi motor", "rotorwinkel", "winkel rotor"]),
    (of(MotorAngle), &["rotorlage", "lage rotor", "motorwinkel", "angolo rotore", "angle rad"]),
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
    (of(MotorVoltage), &["motor voltage", "v motor", "u motor", "motorspannung"]),
    (of(Duty), &["duty", "duty cycle", "duty ratio", "pwm duty", "tastgrad"]),
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
    (&["grad"], "rad", std::f64::consts::PI / 180.0),
    (&["mm"], "m", 1e-3),
    (&["m"], "m", 1.0),
    (&["n"], "N", 1.0),
    (&["kn"], "N", 1e3),
    (&["v"], "V", 1.0),
    (&["mv"], "V", 1e-3),
    (&["k"], "K", 1.0),
];

/// Three names that may be the phases in their order, where no other name is.
const IN_ORDER: &[[&str; 3]] = &[
    ["ch1", "ch2", "ch3"],
    ["ch 1", "ch 2", "ch 3"],
    ["channel a", "channel b", "channel c"],
    ["channel 1", "channel 2", "channel 3"],
    ["a", "b", "c"],
    ["u", "v", "w"],
    ["1", "2", "3"],
];

/// Which of the columns may be time, a current or the motor's angle; each target at
/// most once, in the order time, phases, angle, envelope. Columns without a name that tells, of a
/// matrix or an oscilloscope, may be the phases in their order.
pub fn guess_columns<S: AsRef<str>>(columns: &[S]) -> Vec<ColumnGuess> {
    let columns: Vec<&str> = columns.iter().map(AsRef::as_ref).collect();
    let mut guesses: Vec<ColumnGuess> = Vec::new();
    for &(target, names) in NAMES {
        if guesses.iter().any(|guess| guess.target == target) {
            continue;
        }
        let fits = |column: &&str| {
            let taken = guesses.iter().any(|guess| guess.column == **column);
            !taken && Target::from_column(column).is_none()
        };
        let scored = columns.iter().copied().filter(fits).filter_map(|column| {
            let (rank, factor) = ranked(column, target, names)?;
            Some((rank, column, factor))
        });
        if let Some((_, column, factor)) = scored.min_by_key(|(rank, ..)| *rank) {
            guesses.push(ColumnGuess { target, column: column.to_owned(), factor });
        }
    }
    add_in_order(&columns, &mut guesses);
    guesses
}

/// How far down a list of names a column stands, and its factor.
fn ranked(column: &str, target: Target, names: &[&str]) -> Option<(usize, f64)> {
    let of = |column: &str| {
        let (words, factor) = read(column, target);
        Some((names.iter().position(|name| *name == words)?, factor))
    };
    // a channel of a group, a field of a struct, a name before its device; without quotes
    let own = column.rsplit(['/', '.']).next().unwrap_or(column);
    let own = own.split('\\').next().unwrap_or(own).trim_matches(['\'', '"']);
    let is_own = own != column && Target::from_column(own) == Some(target);
    let apart = words_apart(own);
    is_own.then_some((0, 1.0)).or_else(|| of(column)).or_else(|| of(own)).or_else(|| of(&apart))
}

/// A name such as `phaseCurrentA` with its words apart.
fn words_apart(name: &str) -> String {
    let mut apart = String::with_capacity(name.len() + 4);
    let mut was_small = false;
    for letter in name.chars() {
        if was_small && letter.is_uppercase() {
            apart.push(' ');
        }
        was_small = letter.is_lowercase();
        apart.push(letter);
    }
    apart
}

/// Adds time and phases of columns that have places for names.
fn add_in_order(columns: &[&str], guesses: &mut Vec<ColumnGuess>) {
    let has = |guesses: &[ColumnGuess], target: Target| {
        let is_own = |column: &&str| Target::from_column(column) == Some(target);
        guesses.iter().any(|guess| guess.target == target) || columns.iter().any(is_own)
    };
    let unnamed = |place: usize| columns.iter().find(|name| **name == format!("column {place}"));
    let phases = [PhaseACurrent, PhaseBCurrent, PhaseCCurrent].map(of);
    let is_open = ![of(Current), phases[0], phases[1], phases[2]]
        .into_iter()
        .any(|target| has(guesses, target));
    let has_time = columns.iter().any(|column| Target::from_column(column) == Some(Target::Time));
    let is_timed = has_time || guesses_time(columns);
    if is_open {
        // columns of a matrix, and vectors in cells
        let matrix = columns.iter().find_map(|column| {
            let of = |(before, after): (&'static str, &'static str)| {
                let name = column.strip_suffix(after)?.strip_suffix('1')?.strip_suffix(before)?;
                Some((name, before, after))
            };
            of(("(:,", ")")).or_else(|| of(("{", "}")))
        });
        let in_place = |place: usize| {
            matrix.map(|(name, before, after)| format!("{name}{before}{place}{after}"))
        };
        let in_matrix = |first: usize| -> Option<[&str; 3]> {
            let place = |place: usize| {
                let name = in_place(place)?;
                columns.iter().copied().find(|column| *column == name)
            };
            Some([place(first)?, place(first + 1)?, place(first + 2)?])
        };
        let in_text = || Some([*unnamed(2)?, *unnamed(3)?, *unnamed(4)?]);
        let named = || {
            IN_ORDER.iter().find_map(|names| {
                let find = |name: &str| {
                    columns.iter().copied().find(|column| read(column, phases[0]).0 == name)
                };
                Some([find(names[0])?, find(names[1])?, find(names[2])?])
            })
        };
        let in_matrix = in_matrix(if is_timed { 1 } else { 2 });
        if let Some(three) = in_matrix.or_else(in_text).or_else(named) {
            if !is_timed && in_matrix.is_some() {
                let column = in_place(1).unwrap_or_default();
                guesses.push(ColumnGuess { target: Target::Time, column, factor: 1.0 });
            }
            for (target, column) in phases.into_iter().zip(three) {
                let (_, factor) = read(column, target);
                guesses.push(ColumnGuess { target, column: column.to_owned(), factor });
            }
        }
    }
    if !has(guesses, Target::Time)
        && let Some(first) = unnamed(1)
    {
        guesses.push(ColumnGuess {
            target: Target::Time,
            column: (*first).to_owned(),
            factor: 1.0,
        });
    }
}

/// Tells whether one of the columns has a name of times.
fn guesses_time(columns: &[&str]) -> bool {
    let of_time = NAMES.iter().filter(|(target, _)| *target == Target::Time);
    let mut names = of_time.flat_map(|(_, names)| names.iter());
    names.any(|name| columns.iter().any(|column| ranked(column, Target::Time, &[*name]).is_some()))
}

/// The words of a name without its unit, and the factor of the unit, which is one of the target. An
/// `A` in brackets is ampere; bare, it may be the phase.
fn read(column: &str, target: Target) -> (String, f64) {
    let bare = column.replace("[A]", " ").replace("(A)", " ").to_lowercase();
    // the micro sign, and the Greek letter that stands for it
    let bare = bare.replace('°', " deg ").replace(['µ', '\u{3bc}'], "u");
    let mut words: Vec<&str> = bare
        .split(|letter: char| !letter.is_alphanumeric())
        .filter(|word| !word.is_empty() && *word != "in")
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
    fn names_of_other_languages_and_styles_are_understood() {
        assert_eq!(
            guesses(&[
                "Zeit in ms",
                "Strom U in mA",
                "Strom V [A]",
                "Courant W (A)",
                "Rotorlage [°]"
            ]),
            [
                "time_s=Zeit in ms*0.001",
                "phase_a_current_a=Strom U in mA*0.001",
                "phase_b_current_a=Strom V [A]",
                "phase_c_current_a=Courant W (A)",
                "motor_angle_rad=Rotorlage [°]*0.017453292519943295",
            ]
        );
        assert_eq!(
            guesses(&["timeSec", "phaseCurrentA", "iV", "drive/ic\\XCP:1", "Motor.RotorAngle"]),
            [
                "time_s=timeSec",
                "phase_a_current_a=phaseCurrentA",
                "phase_b_current_a=iV",
                "phase_c_current_a=drive/ic\\XCP:1",
                "motor_angle_rad=Motor.RotorAngle",
            ]
        );
        assert_eq!(
            guesses(&["/'drive'/'phase_a_current_a'", "drive.motor_angle_rad"]),
            [
                "phase_a_current_a=/'drive'/'phase_a_current_a'",
                "motor_angle_rad=drive.motor_angle_rad",
            ]
        );
    }

    #[test]
    fn places_may_be_the_phases_in_their_order() {
        let phases = |names: [&str; 3]| {
            let [a, b, c] = names;
            [
                format!("phase_a_current_a={a}"),
                format!("phase_b_current_a={b}"),
                format!("phase_c_current_a={c}"),
            ]
        };
        let [a, b, c] = phases(["column 2", "column 3", "column 4"]);
        assert_eq!(
            guesses(&["column 1", "column 2", "column 3", "column 4"]),
            [a, b, c, "time_s=column 1".to_owned()]
        );
        let [a, b, c] = phases(["CH1", "CH2", "CH3"]);
        assert_eq!(guesses(&["TIME", "CH1", "CH2", "CH3"]), ["time_s=TIME".to_owned(), a, b, c]);
        let [a, b, c] = phases(["i(:,1)", "i(:,2)", "i(:,3)"]);
        assert_eq!(guesses(&["t", "i(:,1)", "i(:,2)", "i(:,3)"]), ["time_s=t".to_owned(), a, b, c]);
        let [a, b, c] = phases(["d(:,2)", "d(:,3)", "d(:,4)"]);
        assert_eq!(
            guesses(&["d(:,1)", "d(:,2)", "d(:,3)", "d(:,4)", "d(:,5)"]),
            ["time_s=d(:,1)".to_owned(), a, b, c]
        );
        let [a, b, c] = phases(["d{2}", "d{3}", "d{4}"]);
        assert_eq!(guesses(&["d{1}", "d{2}", "d{3}", "d{4}"]), ["time_s=d{1}".to_owned(), a, b, c]);
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
