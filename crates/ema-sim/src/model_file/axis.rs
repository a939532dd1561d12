//! Model files of servo axes.

use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    EffectBlock, effect_block,
    error::ModelFileError,
    faults_line, name_line,
    reader::{Reader, entry, line_of, string},
    tolerance_block::{self, Line, Scatter},
};
use crate::{
    axis_parameter::AxisParameter,
    effect::Geometry,
    fault::FaultId,
    servo_axis::ServoAxis,
    servo_control::{AxisController, Drive, Feedback},
    tolerance::{Level, Spread},
};

/// Machine that a model file of a servo axis describes.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisModel {
    /// The owner's name for the machine.
    pub name: Option<String>,
    /// Parameters of the axis.
    pub axis: ServoAxis,
    /// The faults that it can have: of `k1` and `k2`.
    pub faults: Vec<FaultId>,
    /// Numbers with a tolerance.
    pub tolerance: Vec<AxisTolerance>,
    /// Effects besides the base model.
    pub effects: Vec<EffectBlock>,
}

/// How far a number of an axis scatters at one level. Several levels of one number are several
/// tolerances.
#[derive(Clone, Copy, Debug)]
pub struct AxisTolerance {
    /// Which number.
    pub parameter: &'static AxisParameter,
    /// Distribution about the nominal value, as a share of it.
    pub spread: Spread,
    /// Level at which it scatters.
    pub level: Level,
}

impl AxisTolerance {
    /// Standard deviation over value.
    pub fn std(&self) -> f64 {
        self.spread.std()
    }
}

impl PartialEq for AxisTolerance {
    fn eq(&self, other: &Self) -> bool {
        let key = |t: &Self| t.parameter.key(Geometry::Rotary, Drive::Current);
        key(self) == key(other) && self.spread == other.spread && self.level == other.level
    }
}

/// Names of the geometries, of what the output drives, and of where the position is measured.
const GEOMETRIES: [(&str, Geometry); 2] =
    [("rotary", Geometry::Rotary), ("linear", Geometry::Linear)];
const DRIVES: [(&str, Drive); 3] =
    [("current", Drive::Current), ("amplifier", Drive::Amplifier), ("winding", Drive::Winding)];
const FEEDBACKS: [(&str, Feedback); 2] = [("motor", Feedback::Motor), ("load", Feedback::Load)];

/// The axis that a file without a base fills in: each number is given, or its default.
const BLANK: ServoAxis = ServoAxis {
    geometry: Geometry::Rotary,
    inertia: 1.0,
    viscous: 0.0,
    kinetic_friction: 0.0,
    static_friction: 0.0,
    offset: 0.0,
    backlash: 0.0,
    drive: Drive::Current,
    force_constant: 1.0,
    resistance_ohm: 1.0,
    controller: AxisController {
        sample_hz: 1.0,
        position_gain_per_s: 0.0,
        position_integral_per_s2: 0.0,
        position_derivative_ratio: 0.0,
        speed_limit: f64::MAX,
        speed_gain: 0.0,
        speed_integral: 0.0,
        output_limit: 1.0,
        speed_samples: 0,
        encoder_step: 0.0,
        feedback: Feedback::Motor,
    },
};

impl Reader<'_> {
    pub(super) fn axis(
        &self,
        table: &DeTable<'_>,
        base: Option<AxisModel>,
    ) -> Result<AxisModel, ModelFileError> {
        let before = base.as_ref().map(|base| base.axis);
        let mut model = base.unwrap_or_else(|| AxisModel {
            name: None,
            axis: BLANK,
            faults: vec![FaultId::Friction, FaultId::Backlash],
            tolerance: Vec::new(),
            effects: Vec::new(),
        });
        // the units of all keys first
        if let Some(value) = entry(table, "geometry") {
            model.axis.geometry = self.choice("geometry", value, &GEOMETRIES)?;
        }
        let drive = entry(table, "drive").and_then(|drive| drive.get_ref().as_table());
        if let Some(value) = drive.and_then(|drive| entry(drive, "kind")) {
            model.axis.drive = self.choice("drive.kind", value, &DRIVES)?;
        }
        let mut given = Vec::new();
        for (key, value) in table {
            match key.get_ref().as_ref() {
                "base" | "kind" | "geometry" => {}
                "name" => model.name = Some(string(self.text, "name", value)?.to_owned()),
                "faults" => model.faults = self.faults(value)?,
                "effect" => {
                    model.effects.extend(self.effects(value, model.axis.geometry)?);
                }
                "tolerance" => {
                    for (block, inner) in self.table("tolerance", value)? {
                        self.axis_tolerances(block.get_ref(), inner, &mut model)?;
                    }
                }
                _ => self.axis_block(key, value, &mut model.axis, &mut given)?,
            }
        }
        complete(&mut model.axis, &given, before.as_ref())?;
        model.axis.check()?;
        self.keep_faults(&mut model, entry(table, "faults"))?;
        Ok(model)
    }

    /// Refuses faults that the file lists and that change nothing in its axis; of those that it
    /// does not list itself such are left out.
    fn keep_faults(
        &self,
        model: &mut AxisModel,
        listed: Option<&Spanned<DeValue<'_>>>,
    ) -> Result<(), ModelFileError> {
        let axis = model.axis;
        if let Some(at) = listed {
            for fault in &model.faults {
                axis.check_fault(*fault).map_err(|error| ModelFileError::Fault {
                    line: line_of(self.text, at),
                    error,
                })?;
            }
        }
        model.faults.retain(|fault| axis.check_fault(*fault).is_ok());
        Ok(())
    }

    fn axis_block(
        &self,
        at: &Spanned<toml::de::DeString<'_>>,
        value: &Spanned<DeValue<'_>>,
        axis: &mut ServoAxis,
        given: &mut Vec<String>,
    ) -> Result<(), ModelFileError> {
        let block = at.get_ref().as_ref();
        if !["axis", "drive", "controller"].contains(&block) {
            return Err(self.unknown(block, at));
        }
        for (key, value) in self.table(block, value)? {
            let path = format!("{block}.{}", key.get_ref());
            match path.as_str() {
                "drive.kind" => {}
                "controller.feedback" => {
                    axis.controller.feedback = self.choice(&path, value, &FEEDBACKS)?;
                }
                "controller.speed-samples" => {
                    let samples = self.number(&path, value)?;
                    if !(0.0..=1000.0).contains(&samples) || libm::floor(samples) != samples {
                        let expected = "a whole number from 0 to 1000";
                        return Err(self.wrong(&path, expected, value, samples.to_string()));
                    }
                    axis.controller.speed_samples = samples as u32;
                }
                _ => {
                    let parameter = AxisParameter::find(&path, axis.geometry, axis.drive)
                        .filter(|parameter| parameter.applies(axis.drive))
                        .ok_or_else(|| self.unknown(&path, key))?;
                    parameter.set(axis, self.number(&path, value)?);
                    given.push(path);
                }
            }
        }
        Ok(())
    }

    fn axis_tolerances(
        &self,
        block: &str,
        value: &Spanned<DeValue<'_>>,
        model: &mut AxisModel,
    ) -> Result<(), ModelFileError> {
        let (geometry, drive) = (model.axis.geometry, model.axis.drive);
        for (key, value) in self.table("tolerance", value)? {
            let path = format!("{block}.{}", key.get_ref());
            let parameter = AxisParameter::find(&path, geometry, drive)
                .ok_or_else(|| self.unknown(&path, key))?;
            let scatters = self.scatters(&path, value, true)?;
            let key = parameter.key(geometry, drive);
            model.tolerance.retain(|earlier| earlier.parameter.key(geometry, drive) != key);
            let read = scatters.into_iter();
            model.tolerance.extend(read.map(|Scatter { spread, level }| AxisTolerance {
                parameter,
                spread,
                level,
            }));
        }
        Ok(())
    }
}

/// Refuses a file that leaves out what has no default, and fills in what follows from the rest.
fn complete(
    axis: &mut ServoAxis,
    given: &[String],
    before: Option<&ServoAxis>,
) -> Result<(), ModelFileError> {
    const RESISTANCE: &str = "drive.resistance-ohm";
    let has = |key: &str| given.iter().any(|known| known == key);
    let winding_before = before.is_some_and(|before| before.drive == Drive::Winding);
    if axis.drive == Drive::Winding && !winding_before && !has(RESISTANCE) {
        return Err(ModelFileError::MissingOfAxis { key: RESISTANCE.to_owned() });
    }
    if before.is_some() {
        return Ok(());
    }
    let (geometry, drive) = (axis.geometry, axis.drive);
    let needed = AxisParameter::ALL.iter().filter(|p| p.default_value().is_none());
    for parameter in needed.filter(|p| p.applies(drive)) {
        let key = parameter.key(geometry, drive);
        match (has(&key), parameter.defaults_to_kinetic()) {
            (true, _) => {}
            (false, true) => axis.static_friction = axis.kinetic_friction,
            (false, false) => return Err(ModelFileError::MissingOfAxis { key }),
        }
    }
    Ok(())
}

impl AxisModel {
    pub(crate) fn write(&self) -> String {
        let (axis, mut lines) = (&self.axis, vec!["kind = \"servo-axis\"".to_owned()]);
        let (geometry, drive) = (axis.geometry, axis.drive);
        lines.push(format!("geometry = \"{}\"", named(&GEOMETRIES, geometry)));
        lines.extend(self.name.as_deref().map(name_line));
        let has = |fault: &&FaultId| axis.check_fault(**fault).is_ok();
        let faults: Vec<_> = self.faults.iter().filter(has).copied().collect();
        lines.push(faults_line(&faults));
        let mut open = String::new();
        for parameter in AxisParameter::ALL.iter().filter(|p| p.applies(drive)) {
            let path = parameter.key(geometry, drive);
            let (block, key) = path.split_once('.').unwrap_or(("", &path));
            if block != open {
                block.clone_into(&mut open);
                lines.push(format!("\n[{block}]"));
                if block == "drive" {
                    lines.push(format!("kind = \"{}\"", named(&DRIVES, drive)));
                }
            }
            lines.push(format!("{key} = {:?}", parameter.get(axis)));
        }
        let law = &axis.controller;
        lines.push(format!("speed-samples = {}", law.speed_samples));
        lines.push(format!("feedback = \"{}\"", named(&FEEDBACKS, law.feedback)));
        let path = |tolerance: &AxisTolerance| tolerance.parameter.key(geometry, drive);
        let paths: Vec<_> = self.tolerance.iter().map(path).collect();
        let written = self.tolerance.iter().zip(&paths).map(|(tolerance, path)| Line {
            path,
            scatter: Scatter { spread: tolerance.spread, level: tolerance.level },
        });
        tolerance_block::write(&written.collect::<Vec<_>>(), &mut lines);
        effect_block::write(&self.effects, &mut lines);
        lines.join("\n") + "\n"
    }
}

fn named<T: Copy + PartialEq>(names: &[(&'static str, T)], choice: T) -> &'static str {
    names.iter().find(|(_, known)| *known == choice).map_or("", |(name, _)| name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model_file::{parse_machine, parse_machine_onto};

    const EMPS: &str = include_str!("../../../../fixtures/models/emps.toml");

    #[test]
    fn what_is_not_a_number_is_not_missing() {
        let text = EMPS.replace("mass-kg = 95.1089", "mass-kg = nan");
        let error = parse_machine(&text).unwrap_err().to_string();
        assert_eq!(error, "line 12: `axis.mass-kg` is NaN, expected a number");
    }

    #[test]
    fn defaults_are_those_of_the_parameters() {
        for parameter in AxisParameter::ALL {
            if let Some(value) = parameter.default_value() {
                assert_eq!(parameter.get(&BLANK), value, "{parameter:?}");
            }
        }
    }

    #[test]
    fn a_fault_that_changes_nothing_is_refused() {
        let listed = |faults: &str| {
            let text = EMPS.replace("[\"k1\"]", faults);
            parse_machine(&text).map(|model| model.faults().to_vec()).map_err(|e| e.to_string())
        };
        assert_eq!(listed("[\"k1\"]"), Ok(vec![FaultId::Friction]));
        let told = |symbol, reason| {
            Err(format!("line 9: `faults`: {symbol} changes nothing in this axis: {reason}"))
        };
        assert_eq!(listed("[\"k1\", \"k2\"]"), told("k2", "it has no backlash"));
        assert_eq!(listed("[\"k3\"]"), told("k3", "it has no phases and no air gap"));
        // without a list, what the axis can have
        let text = EMPS.replace("faults = [\"k1\"]\n", "");
        assert_eq!(parse_machine(&text).unwrap().faults(), [FaultId::Friction]);
        let text = text.replace("[axis]\n", "[axis]\nbacklash-m = 1e-5\n");
        let loose = parse_machine(&text).unwrap();
        assert_eq!(loose.faults(), [FaultId::Friction, FaultId::Backlash]);
        let smooth = "[axis]\nkinetic-friction-n = 0.0\nstatic-friction-n = 0.0\n";
        let smooth = parse_machine_onto(smooth, &loose).unwrap();
        assert_eq!(smooth.faults(), [FaultId::Backlash]);
        assert_eq!(parse_machine(&smooth.write()).unwrap(), smooth);
    }

    #[test]
    fn what_is_missing_is_named() {
        let error = parse_machine("kind = \"servo-axis\"\n").unwrap_err();
        assert_eq!(error.to_string(), "`axis.inertia-kg-m2` is missing");
        let winding = EMPS.replace("\"amplifier\"", "\"winding\"").replace("-n-per-v", "-n-per-a");
        let error = parse_machine(&winding).unwrap_err();
        assert_eq!(error.to_string(), "`drive.resistance-ohm` is missing");
        let base = parse_machine(EMPS).unwrap();
        let error = parse_machine_onto("[drive]\nkind = \"winding\"\n", &base).unwrap_err();
        assert_eq!(error.to_string(), "`drive.resistance-ohm` is missing");
        let text = "kind = \"servo-axis\"\n[axis]\nmass-kg = 1.0\n";
        let error = parse_machine(text).unwrap_err();
        assert_eq!(error.to_string(), "line 3: unknown key `axis.mass-kg`");
    }
}
