//! Channels that a map reads as the sum of several columns.

use crate::{Channel, ColumnMap, RecordError, Recording, column_map::Target};

impl Recording {
    /// Adds up the columns of each channel that is a sum of them.
    ///
    /// A part that was brought onto an even clock is refused: each was interpolated by itself, and
    /// turns of a rotor that one of them counts would count twice.
    ///
    /// # Errors
    /// [`RecordError::SumTimes`] where they do not have all their samples at the same times of an even
    /// clock.
    pub(crate) fn add_parts(&mut self, map: &ColumnMap) -> Result<(), RecordError> {
        let mut sums: Vec<(Channel, usize)> = Vec::with_capacity(self.channels.len());
        for part in self.channels.drain(..) {
            let earlier = sums.iter_mut().find(|(sum, _)| sum.name() == part.name());
            let Some((sum, parts)) = earlier else {
                sums.push((part, 1));
                continue;
            };
            let is_evened = [&*sum, &part].iter().any(|one| one.resampling_error() > 0.0);
            if is_evened || sum.times_s() != part.times_s() {
                return Err(RecordError::SumTimes { channel: sum.name() });
            }
            *sum = sum.plus(&part);
            *parts += 1;
        }
        // a column without a sample has made no part
        let lacks =
            |(sum, parts): &&(Channel, usize)| *parts < map.columns_of(Target::Channel(sum.name()));
        if let Some((sum, _)) = sums.iter().find(lacks) {
            return Err(RecordError::SumTimes { channel: sum.name() });
        }
        self.channels = sums.into_iter().map(|(sum, _)| sum).collect();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ChannelName;

    fn read(text: &str, map: &[&str]) -> Result<Recording, RecordError> {
        Recording::parse("r.csv", text.as_bytes(), &ColumnMap::new(map).unwrap())
    }

    const TEXT: &str = "time_s,a,b,c\n0,1,2,\n1,3,5,4\n";

    #[test]
    fn columns_are_added_with_their_factors() {
        for (map, values) in [
            ("motor_angle_rad=(a - b)*0.5+10", [9.5, 9.0]),
            ("motor_angle_rad=(a*4 + b)*0.5", [3.0, 8.5]),
            ("motor_angle_rad=(b - a)", [1.0, 2.0]),
        ] {
            let recording = read(TEXT, &[map]).unwrap();
            let angle = recording.channel(ChannelName::MotorAngle).unwrap();
            assert_eq!((angle.values(), angle.times_s()), (&values[..], &[0.0, 1.0][..]), "{map}");
            assert_eq!(recording.channels().len(), 1);
        }
    }

    #[test]
    fn units_of_the_parts_are_their_own() {
        let text = "time_s;coarse;fine\ns;rad;mrad\n0;1;20\n1;2;30\n";
        let recording = read(text, &["motor_angle_rad=(coarse - fine)"]).unwrap();
        let angle = recording.channel(ChannelName::MotorAngle).unwrap();
        assert_eq!(angle.values(), [0.98, 1.97]);
        assert_eq!(recording.stated_units()[0].factor, 1e-3);
    }

    #[test]
    fn parts_without_a_sample_of_each_time_are_refused() {
        for (text, map) in [
            (TEXT, "motor_angle_rad=(a - c)"),
            ("time_s,a,b\n0,1,\n1,2,\n", "motor_angle_rad=(a - b)"),
        ] {
            assert_eq!(
                read(text, &[map]).unwrap_err().to_string(),
                "the columns that `motor_angle_rad` is the sum of do not all have their samples \
                 at the same times of an even clock without gaps"
            );
        }
    }

    #[test]
    fn parts_that_were_interpolated_are_refused() {
        let row = |n: usize| {
            let angle = 0.5 * n as f64;
            let turns = (angle / std::f64::consts::TAU).floor();
            format!("{:.4},{turns},{}\n", n as f64 * 1e-4, angle - turns * std::f64::consts::TAU)
        };
        let rows: Vec<String> = (0..400).filter(|n| *n != 200).map(row).collect();
        let text = format!("time_s,turns,angle\n{}", rows.concat());
        let map = ColumnMap::new(["motor_angle_rad=(turns*6.283185307179586 + angle)"]).unwrap();
        let bridged = map.clone().with_gaps(crate::Gaps::Bridge);
        let read = |map| Recording::parse("r.csv", text.as_bytes(), map);
        assert!(matches!(read(&bridged), Err(RecordError::SumTimes { .. })));
        let whole = format!("time_s,turns,angle\n{}", (0..400).map(row).collect::<String>());
        let whole = Recording::parse("r.csv", whole.as_bytes(), &map).unwrap();
        let angle = whole.channel(ChannelName::MotorAngle).unwrap();
        assert!((angle.values()[399] - 199.5).abs() < 1e-9);
    }
}
