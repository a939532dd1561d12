//! Guesses at the columns of a foreign file, from their names.

use std::fmt;

use super::{
    ChannelName::{self, Current, MotorAngle, PhaseACurrent, PhaseBCurrent, PhaseCCurrent},
    column_map::Target,
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
    (Target::Time, &["time", "t", "timestamp", "zeit"]),
    (
        of(PhaseACurrent),
        &["phase a current", "current a phase", "i a", "ia", "i u", "iu", "i 1", "i1"],
    ),
    (
        of(PhaseBCurrent),
        &["phase b current", "current b phase", "i b", "ib", "i v", "iv", "i 2", "i2"],
    ),
    (
        of(PhaseCCurrent),
        &["phase c current", "current c phase", "i c", "ic", "i w", "iw", "i 3", "i3"],
    ),
    (of(MotorAngle), &["motor angle", "rotor angle", "theta m", "theta motor", "motor position"]),
    (of(Current), &["current", "i", "motor current", "i motor", "envelope", "strom", "courant"]),
];

const fn of(name: ChannelName) -> Target {
    Target::Channel(name)
}

/// Units that a name may end in, and what makes SI of them.
const UNITS: &[(&str, f64)] = &[
    ("s", 1.0),
    ("sec", 1.0),
    ("ms", 1e-3),
    ("us", 1e-6),
    ("ma", 1e-3),
    ("amp", 1.0),
    ("amps", 1.0),
    ("rad", 1.0),
    ("deg", std::f64::consts::PI / 180.0),
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

/// The words of a name without its unit, and the factor of the unit. An `A` in
/// brackets is ampere; bare, it may be the phase.
fn read(column: &str, target: Target) -> (String, f64) {
    let bare = column.replace("[A]", " ").replace("(A)", " ").to_lowercase();
    let mut words: Vec<&str> = bare
        .split(|letter: char| !letter.is_alphanumeric())
        .filter(|word| !word.is_empty())
        .collect();
    let unit = words.last().and_then(|last| UNITS.iter().find(|(unit, _)| unit == last));
    let factor = unit.map_or(1.0, |(_, factor)| *factor);
    let ampere = target == of(Current) && words.last() == Some(&"a");
    if words.len() > 1 && (unit.is_some() || ampere) {
        words.pop();
    }
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
            ["time_s=time", "current_a=current"]
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
