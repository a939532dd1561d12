use super::*;

struct Fixed {
    heads: Vec<Head>,
    numbers: Vec<Samples>,
    properties: Vec<(String, Property)>,
}

impl Container for Fixed {
    fn heads(&self) -> &[Head] {
        &self.heads
    }

    fn properties(&self) -> Vec<(String, Property)> {
        self.properties.clone()
    }

    fn read(&self, column: usize) -> Result<Samples, RecordError> {
        Ok(self.numbers[column].clone())
    }
}

fn file(columns: &[(&str, &str, Clock, &[f64])]) -> Fixed {
    let heads = columns.iter().map(|&(group, name, clock, values)| Head {
        unit: None,
        group: (!group.is_empty()).then(|| group.to_owned()),
        name: name.to_owned(),
        path: if group.is_empty() { name.to_owned() } else { format!("{group}/{name}") },
        samples: values.len(),
        clock,
    });
    let numbers = columns.iter().map(|(.., values)| Samples::of(values.to_vec()));
    Fixed { heads: heads.collect(), numbers: numbers.collect(), properties: Vec::new() }
}

fn read(file: &Fixed, map: &[&str]) -> Result<Recording, RecordError> {
    assemble("r".to_owned(), file, &ColumnMap::new(map).unwrap())
}

const FREE: Clock = Clock::Unstated;

#[test]
fn groups_have_their_own_time_axes() {
    let file = file(&[
        ("fast", "time_s", FREE, &[0.0, 0.1, 0.2]),
        ("fast", "current_a", FREE, &[1.0, 2.0, 3.0]),
        ("slow", "time_s", FREE, &[0.0, 0.2]),
        ("slow", "load_n_m", FREE, &[4.0, 5.0]),
    ]);
    let recording = read(&file, &[]).unwrap();
    let times = |name| recording.channel(name).unwrap().times_s();
    assert_eq!(times(ChannelName::Current), [0.0, 0.1, 0.2]);
    assert_eq!(times(ChannelName::Load), [0.0, 0.2]);
    assert!(recording.other_columns().is_empty());
}

#[test]
fn axes_come_from_formats_periods_and_rates() {
    let stated = Clock::Uniform { start_s: 0.5, step_s: 1e-4 };
    let uniform = file(&[("", "current_a", stated, &[1.0, 2.0, 3.0])]);
    let recording = read(&uniform, &[]).unwrap();
    let channel = recording.channel(ChannelName::Current).unwrap();
    assert_eq!(channel.times_s(), [0.5, 0.5001, 0.5002]);
    let period = file(&[("", "Ts", FREE, &[0.5]), ("", "current_a", FREE, &[1.0, 2.0])]);
    let recording = read(&period, &["time_s=Ts*0.001"]).unwrap();
    assert_eq!(recording.channel(ChannelName::Current).unwrap().times_s(), [0.0, 0.0005]);
    let mut rated = file(&[("", "current_a", FREE, &[1.0, 2.0])]);
    assert!(matches!(read(&rated, &[]), Err(RecordError::NoTime { line: None, .. })));
    rated.properties.push(("rate_hz".to_owned(), Property::Number(4800.0)));
    let recording = read(&rated, &[]).unwrap();
    assert_eq!(recording.channel(ChannelName::Current).unwrap().times_s(), [0.0, 1.0 / 4800.0]);
    assert_eq!(recording.metadata.rate_hz, Some(4800.0));
}

#[test]
fn maps_name_a_column_or_its_path() {
    let file = file(&[
        ("a", "t", FREE, &[0.0, 1.0]),
        ("a", "i", FREE, &[1.0, 2.0]),
        ("b", "t", FREE, &[0.0, 2.0]),
        ("b", "i", FREE, &[3.0, 4.0]),
    ]);
    let recording = read(&file, &["time_s=t", "current_a=b/i*2"]).unwrap();
    let current = recording.channel(ChannelName::Current).unwrap();
    assert_eq!((current.times_s(), current.values()), (&[0.0, 2.0][..], &[6.0, 8.0][..]));
    assert_eq!(recording.other_columns()[0].name(), "a/i");
    let error = |map: &[&str]| read(&file, map).unwrap_err().to_string();
    assert_eq!(
        error(&["time_s=t", "current_a=i"]),
        "column `i` is in the file more than once: say which of `a/i`, `b/i` is meant \
         (`--map NAME=COLUMN`)"
    );
    assert_eq!(
        error(&["current_a=j"]),
        "no column `j` to read `current_a` from; the columns are `a/t`, `a/i`, `b/t`, `b/i`"
    );
}

#[test]
fn rows_are_chosen_in_their_own_table() {
    let file = file(&[
        ("fast", "run", FREE, &[1.0, 1.0, 2.0, 2.0]),
        ("fast", "current_a", Clock::Uniform { start_s: 0.0, step_s: 0.1 }, &[1.0, 2.0, 3.0, 4.0]),
        ("slow", "time_s", FREE, &[0.0, 0.2]),
        ("slow", "load_n_m", FREE, &[4.0, 5.0]),
    ]);
    let chosen = |choices: &[&str]| {
        let map = ColumnMap::default().with_rows(choices).unwrap();
        assemble("r".to_owned(), &file, &map)
    };
    let recording = chosen(&["fast/run=2"]).unwrap();
    let values = |name| recording.channel(name).unwrap().values();
    assert_eq!(values(ChannelName::Current), [3.0, 4.0]);
    assert_eq!(values(ChannelName::Load), [4.0, 5.0]);
    // the clocks of both tables go on together
    let times = |name| recording.channel(name).unwrap().times_s();
    assert_eq!(times(ChannelName::Current), [0.2, 0.3]);
    assert_eq!(times(ChannelName::Load), [0.0, 0.2]);
    let told = |choices: &[&str]| chosen(choices).unwrap_err().to_string();
    assert_eq!(
        told(&["run=2", "load_n_m=4"]),
        "no column `load_n_m` to choose rows by (`--where`); the columns are `fast/run`, \
         `fast/current_a`"
    );
    assert_eq!(told(&["run=3"]), "no row has `run=3` (`--where`); values of `run`: `1`, `2`");
}

#[test]
fn rows_apart_need_times_of_their_own() {
    let stated = Clock::Uniform { start_s: 0.0, step_s: 0.1 };
    let columns = |clock| {
        file(&[
            ("", "time_s", FREE, &[0.0, 0.1, 0.3, 0.5][..]),
            ("", "run", FREE, &[1.0, 2.0, 1.0, 2.0]),
            ("", "current_a", clock, &[1.0, 2.0, 3.0, 4.0]),
        ])
    };
    let map = ColumnMap::default().with_rows(["run=2"]).unwrap();
    let read = |file: &Fixed| assemble("r".to_owned(), file, &map);
    let timed = read(&columns(FREE)).unwrap();
    assert_eq!(timed.channel(ChannelName::Current).unwrap().times_s(), [0.1, 0.5]);
    let mut counted = columns(stated);
    counted.heads[0].name = "t".to_owned();
    assert!(matches!(read(&counted).unwrap_err(), RecordError::RowsApart));
}

#[test]
fn missing_samples_are_left_out_and_other_gaps_are_refused() {
    let mut file =
        file(&[("", "time_s", FREE, &[0.0, 1.0, 2.0]), ("", "current_a", FREE, &[1.0, 9.0, 3.0])]);
    file.numbers[1].present = Some(vec![true, false, true]);
    let recording = read(&file, &[]).unwrap();
    let current = recording.channel(ChannelName::Current).unwrap();
    assert_eq!((current.times_s(), current.values()), (&[0.0, 2.0][..], &[1.0, 3.0][..]));
    file.numbers[1].values[2] = f64::NAN;
    let error = read(&file, &[]).unwrap_err().to_string();
    assert_eq!(
        error,
        "`current_a` is not finite at sample 1 (`--gaps bridge` takes it for a missing sample)"
    );
    file.numbers[0].present = Some(vec![false, true, true]);
    let error = read(&file, &[]).unwrap_err().to_string();
    assert_eq!(error, "`current_a` has a sample without a time: sample 0");
}

#[test]
fn too_much_is_refused_before_it_is_read() {
    let mut file = file(&[("", "current_a", FREE, &[1.0])]);
    file.heads[0].samples = LIMIT_NUMBERS + 1;
    assert!(matches!(read(&file, &[]), Err(RecordError::TooManyNumbers { .. })));
}

#[test]
fn clocks_are_as_fine_as_their_numbers_show() {
    let cases = [(0.0, 0), (0.0005, 4), (12.5, 1), (1e-4, 4), (300.0, 0), (0.1 + 0.2, 9)];
    for (value, want) in cases {
        assert_eq!(decimals(value), want, "{value}");
    }
}

fn in_unit(unit: &str, map: &[&str]) -> Result<Recording, RecordError> {
    let mut file = file(&[
        ("g", "time_s", Clock::Unstated, &[0.0, 1.0]),
        ("g", "i", Clock::Unstated, &[1000.0, 2000.0]),
    ]);
    file.heads[1].unit = Some(unit.to_owned());
    assemble("r".to_owned(), &file, &ColumnMap::new(map).unwrap())
}

#[test]
fn units_that_the_file_states_are_looked_at() {
    let read = |unit: &str, map: &str| {
        let recording = in_unit(unit, &[map]).unwrap();
        let value = recording.channel(ChannelName::Current).unwrap().values()[0];
        let told: Vec<_> = recording
            .stated_units()
            .iter()
            .map(|one| (one.unit.clone(), one.factor, one.is_mapped))
            .collect();
        (value, told)
    };
    assert_eq!(read("A", "current_a=i"), (1000.0, vec![]));
    assert_eq!(read("  ", "current_a=i"), (1000.0, vec![]));
    assert_eq!(read("mA", "current_a=i"), (1.0, vec![("mA".to_owned(), 1e-3, false)]));
    // a factor that is given goes before the unit, and that is told too
    assert_eq!(read("mA", "current_a=i*2"), (2000.0, vec![("mA".to_owned(), 2.0, true)]));
    assert_eq!(read("counts", "current_a=i*2"), (2000.0, vec![("counts".to_owned(), 2.0, true)]));
    assert_eq!(
        in_unit("Nm", &["current_a=i"]).unwrap_err().to_string(),
        "column `g/i` is in `Nm` as the file says, `current_a` in A: say by what it is to be \
         multiplied (`--map current_a=g/i*FACTOR`)"
    );
    // what is no channel may be in anything
    assert!(in_unit("furlong", &[]).is_ok());
}

#[test]
fn the_unit_of_a_time_axis_is_looked_at() {
    let mut file = file(&[
        ("g", "t", Clock::Unstated, &[0.0, 500.0]),
        ("g", "current_a", Clock::Column(0), &[1.0, 2.0]),
    ]);
    file.heads[0].unit = Some("ms".to_owned());
    let recording = assemble("r".to_owned(), &file, &ColumnMap::default()).unwrap();
    assert_eq!(recording.channel(ChannelName::Current).unwrap().times_s(), [0.0, 0.5]);
    assert_eq!(recording.stated_units().len(), 1);
    file.heads[0].unit = Some("lap".to_owned());
    let error = assemble("r".to_owned(), &file, &ColumnMap::default()).unwrap_err();
    assert!(error.to_string().starts_with("column `g/t` is in `lap`"), "{error}");
}

#[test]
fn files_without_rows_are_told_apart_from_files_without_channels() {
    let error = |columns: &[(&str, &str, Clock, &[f64])]| {
        let read = assemble("r".to_owned(), &file(columns), &ColumnMap::default());
        read.unwrap_err().to_string()
    };
    let none: &[f64] = &[];
    assert_eq!(
        error(&[("", "time_s", Clock::Unstated, none), ("", "current_a", Clock::Unstated, none)]),
        "no samples: the file has `current_a` and no rows of it"
    );
    assert_eq!(
        error(&[("", "x", Clock::Unstated, none)]),
        "no samples: the file has columns and no rows"
    );
}

/// Angles of a motor that turns to and fro, so far on.
fn angle_rad(at: f64) -> f64 {
    3.0 * (at / 40.0).sin()
}

#[test]
fn recordings_beside_one_another_are_refused_with_the_choice_of_one() {
    let times_s: Vec<f64> = (0..1000).map(|row| f64::from(row / 2) / 1e3).collect();
    let rows = |value: &dyn Fn(i32) -> f64| (0..1000).map(value).collect::<Vec<f64>>();
    let two = rows(&|row| angle_rad(f64::from(row / 2 - 4 * (row % 2))));
    let (runs, one) =
        (rows(&|row| f64::from(row % 2 + 3)), rows(&|row| angle_rad(f64::from(row) / 2.0)));
    let table = |angles: &[f64]| {
        let columns: [(&str, &str, Clock, &[f64]); 3] = [
            ("", "time_s", Clock::Unstated, &times_s),
            ("", "motor_angle_rad", Clock::Unstated, angles),
            ("", "run", Clock::Unstated, &runs),
        ];
        read(&file(&columns), &[])
    };
    assert_eq!(
        table(&two).unwrap_err().to_string(),
        "time 0 s is that of 2 rows, as is each, and `motor_angle_rad` does not go on from one to the \
         next; of several recordings beside one another `--where run=3` reads one; in Python \
         `fdi.diagnose(table, group=COLUMN)` reads all"
    );
    let one = table(&one).unwrap();
    assert_eq!(one.channels()[0].sampling().unwrap().rate_hz, 2000.0);
}

#[test]
fn rows_that_all_stand_twice_are_told() {
    let times_s: Vec<f64> = (0..1000).map(|row| f64::from(row / 2) / 1e3).collect();
    let twice: Vec<f64> = (0..1000).map(|row| angle_rad(f64::from(row / 2))).collect();
    let columns: [(&str, &str, Clock, &[f64]); 2] = [
        ("", "time_s", Clock::Unstated, &times_s),
        ("", "motor_angle_rad", Clock::Unstated, &twice),
    ];
    let file = file(&columns);
    let error = read(&file, &[]).unwrap_err().to_string();
    assert!(error.ends_with("`--gaps bridge` puts the samples in order"), "{error}");
    let map = ColumnMap::default().with_gaps(crate::Gaps::Bridge);
    let mended = assemble("r".to_owned(), &file, &map).unwrap();
    assert_eq!(mended.clock_notes()[0].doubled, 500);
    assert_eq!(mended.channels()[0].sampling().unwrap().rate_hz, 1000.0);
}

#[test]
fn held_samples_are_missing_ones() {
    let times_s: Vec<f64> = (0..2000).map(|row| f64::from(row) / 1e4).collect();
    let held = |row: usize| if (1000..1008).contains(&row) { 999 } else { row };
    let noise = |row: usize| (row as f64 * 12.9898).sin() * 43_758.545_3;
    let current_a = |row: usize| angle_rad(row as f64) + 0.05 * (noise(row) - noise(row).floor());
    let currents: Vec<f64> = (0..2000).map(|row| current_a(held(row))).collect();
    let angles: Vec<f64> = (0..2000).map(|row| angle_rad(f64::from(row))).collect();
    let columns: [(&str, &str, Clock, &[f64]); 3] = [
        ("", "time_s", Clock::Unstated, &times_s),
        ("", "current_a", Clock::Unstated, &currents),
        ("", "motor_angle_rad", Clock::Unstated, &angles),
    ];
    let file = file(&columns);
    let error = read(&file, &[]).unwrap_err().to_string();
    assert!(error.starts_with("the currents are the same to the digit in the 8 rows"), "{error}");
    let map = ColumnMap::default().with_gaps(crate::Gaps::Bridge);
    let mended = assemble("r".to_owned(), &file, &map).unwrap();
    let [note] = mended.clock_notes() else { panic!("one axis") };
    assert_eq!((note.lost, note.channels.as_slice()), (8, &[ChannelName::Current][..]));
}
