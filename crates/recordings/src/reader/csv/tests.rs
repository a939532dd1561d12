//! Texts, and what is said of those that are refused.

use super::*;

fn read(text: &[u8]) -> Result<Recording, RecordError> {
    parse("r.csv".to_owned(), text, &ColumnMap::default())
}

fn error(text: &str) -> String {
    read(text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn channels_have_their_own_time_axes() {
    let text = "time_s,current_a,load_n_m,note\n0,1,,a\n1,2,,\n2,,5,\n3,4,6,d\n";
    let recording = read(text.as_bytes()).unwrap();
    let current = recording.channel(ChannelName::Current).unwrap();
    assert_eq!((current.times_s(), current.values()), (&[0., 1., 3.][..], &[1., 2., 4.][..]));
    let load = recording.channel(ChannelName::Load).unwrap();
    assert_eq!((load.times_s(), load.values()), (&[2., 3.][..], &[5., 6.][..]));
    let note = &recording.other_columns()[0];
    assert_eq!(note.times_s(), [0.0, 3.0]);
    assert_eq!(note.cells().collect::<Vec<_>>(), ["a", "d"]);
}

#[test]
fn a_column_without_samples_is_not_a_channel() {
    let recording = read(b"time_s,current_a,load_n_m\n0,,1\n1,,1\n").unwrap();
    assert!(recording.channel(ChannelName::Current).is_none());
}

#[test]
fn spreadsheets_are_understood() {
    let text = b"\xef\xbb\xbf# noise-a = 0.02\r\n\r\ntime_s, current_a ,\"a, b\"\r\n0, 1.5,x\r\n\
                 \r\n1,2.5,\"y \"\"z\"\"\"\r\n";
    let recording = read(text).unwrap();
    assert_eq!(recording.metadata.noise_a, Some(0.02));
    assert_eq!(recording.channel(ChannelName::Current).unwrap().values(), [1.5, 2.5]);
    assert_eq!(recording.other_columns()[0].name(), "a, b");
    assert_eq!(recording.other_columns()[0].cells().nth(1), Some("y \"z\""));
}

#[test]
fn messages_name_line_and_column() {
    assert_eq!(error(""), "empty file: expected a header row with `time_s` and channels");
    assert_eq!(error(" \n\n"), error(""));
    assert_eq!(
        error("# rate-hz = 1\n"),
        "no header row: expected one with `time_s` and channels after the metadata"
    );
    assert_eq!(error("\n\ntime_s,current_a\n"), "no samples after the header on line 3");
    assert_eq!(
        error("time,current_a\n0,1\n"),
        "line 1: no column `time_s`; the columns are `time`, `current_a` \
         (`--map time_s=COLUMN` names one)"
    );
    assert_eq!(error("time_s,x,x\n"), "line 1: column `x` appears twice");
    assert_eq!(error("time_s;current_a\n"), "line 1: cells are separated by ';', expected commas");
    assert_eq!(error("time_s,x\n0,1\n1\n"), "line 3 has 1 cells, the header has 2");
    assert_eq!(
        error("time_s,current_a\r\n0,1\r\n\r\n1,off\r\n"),
        "line 4, column `current_a`: expected a number, found `off`"
    );
    for bad in ["inf", "-Infinity", "1e999"] {
        assert_eq!(
            error(&format!("time_s,current_a\n0,{bad}\n")),
            format!(
                "line 2, column `current_a`: expected a finite number, found `{bad}` \
                 (an empty cell means no sample)"
            )
        );
    }
    assert_eq!(
        error("time_s,current_a\n,1\n"),
        "line 2, column `time_s`: expected a time, found an empty cell"
    );
    assert_eq!(
        error("time_s,current_a\n0.0,1\n0.04,1\n0.08,1\n0.00,1\n"),
        "line 5: time 0 s is not after 0.08 s (the rows before are at 25 Hz)"
    );
    assert_eq!(error("time_s,x\n1,1\n1,1\n"), "line 3: time 1 s is not after 1 s");
    assert_eq!(
        error("time_s,hall_state\n1,7\n"),
        "line 2, column `hall_state`: expected a sector from 1 to 6, found `7`"
    );
    assert_eq!(
        error("time_s,x\n0,1\nend,2\n"),
        "line 3, column `time_s`: expected a number, found `end`"
    );
}

#[test]
fn bytes_that_are_not_text_are_refused_with_their_line() {
    for text in [
        &b"# a\n# actuator-id = \"\x81\"\ntime_s\n"[..],
        &b"# noise-a = 1\nload \x81,time_s\n"[..],
        &b"time_s,unit\n1,\x81\n"[..],
    ] {
        let message = read(text).unwrap_err().to_string();
        assert_eq!(message, "line 2 is not UTF-8 text");
    }
}

#[test]
fn times_of_single_precision_are_even() {
    let rows = |start_s: f64| -> String {
        let time_s = |row: u16| f64::from((start_s + f64::from(row) / 1e4) as f32);
        (0..500).map(|row| format!("{},1\n", time_s(row))).collect::<Vec<_>>().concat()
    };
    for start_s in [0.0, 100.0] {
        let recording = read(format!("time_s,current_a\n{}", rows(start_s)).as_bytes()).unwrap();
        let channel = &recording.channels()[0];
        assert_eq!(channel.sampling().unwrap().rate_hz, 10_000.0, "{start_s}");
        assert!(recording.require_no_gap(channel).is_ok());
        assert_eq!(recording.clock_notes(), [], "{start_s}");
    }
}

#[test]
fn other_dialects_give_what_their_plain_twin_gives() {
    let twin = read(b"time_s,current_a\n0,1.5\n0.001,2.5\n0.002,-1e-3\n").unwrap();
    let map = ColumnMap::new(["time_s=t", "current_a=Strom"]).unwrap();
    for text in [
        "t;Strom\n0,000;1,5\n0,001;2,5\n0,002;-1E-3\n",
        "Bench 3\r\nrun;7\r\n\r\nt\tStrom\r\ns\tA\r\n0\t1.5\r\n0.001\t2.5\r\n0.002\t-1e-3\r\n",
        "\"t\";\"Strom\"\n\"ms\";\"mA\"\n0;1500\n1;2500\n2;-1\n",
        "# t Strom\n0.000 1.5\n  0.001   2.5\n0.002 -1e-3\n",
        "t,Strom\n[ms],[mA]\n0,1500\n1,2500\n2,-1\n",
        "t,Strom\n2026-11-21 09:30:00.000,1.5\n2026-11-21 09:30:00.001,2.5\n\
         2026-11-21 09:30:00.002,-0.001\n",
        "t|Strom|\n0|1.5|\n0.001|2.5|\n0.002|-1D-3|\n",
        "t;Strom\n0,000;1,5;;\n0,001;2,5;;\n0,002;-0,001;;\n;;;\nt;Strom\n;;\n",
        "\"t\" \"Strom\"\n\"1\" 0 1.5\n\"2\" 0.001 2.5\n\"3\" 0.002 -0.001\n",
        "t,state,Strom,x\nPT0S,ON,1.5,1\nPT0.001S,ON,2.5,1\nPT0.002S,OFF,-0.001,1\n",
        "'t','Strom'\n'0','1.5'\n'0.001','2.5'\n'0.002','-0.001'\n",
        "t;Strom\n23:59:59,999;1,5\n00:00:00,000;2,5\n00:00:00,001;-0,001\n",
    ] {
        for bytes in [text.as_bytes().to_vec(), utf16(text)] {
            let read = parse("r".to_owned(), &bytes, &map).unwrap();
            let [own, twin] = [&read, &twin].map(|one| &one.channels()[0]);
            assert_eq!(own.values().len(), 3, "{text}");
            for (own, twin) in own.times_s().iter().zip(twin.times_s()) {
                approx::assert_abs_diff_eq!(own, twin, epsilon = 1e-15);
            }
            for (own, twin) in own.values().iter().zip(twin.values()) {
                approx::assert_abs_diff_eq!(own, twin, epsilon = 1e-15);
            }
        }
    }
}

#[test]
fn what_follows_the_samples_is_left_out_and_told() {
    let rows = (0..120).map(|i| format!("{},{}\n", f64::from(i) / 1000.0, i % 7));
    let rows = rows.collect::<Vec<_>>().concat();
    let text = format!("time_s,current_a\n{rows}");
    let samples = |text: &str| {
        let read = read(text.as_bytes()).unwrap();
        (read.channels()[0].values().len(), read.dialect().map_or(0, |one| one.left_after))
    };
    assert_eq!(samples(&text), (120, 0));
    assert_eq!(samples(&format!("{text}End of file\n")), (120, 1));
    assert_eq!(samples(&format!("{text}Samples,120\n\nmean,3,0\n")), (120, 2));
    assert_eq!(samples(&format!("{text}0.12")), (120, 1));
    assert_eq!(samples(&format!("{text}\u{0}\u{0}\u{1a}")), (120, 0));
    assert_eq!(samples(&text.replacen("0.05,", "# marker\n0.05,", 1)), (120, 0));
    let told = error(&text.replacen("0.05,", "marker\n0.05,", 1));
    assert_eq!(told, "line 52 has 1 cells, the header has 2");
}

#[test]
fn units_may_stand_behind_numbers() {
    let text = "time_s,current_a\n0 s,1500 mA\n0.1 s,-0.5 A\n0.2 s,2 A\n";
    let read = read(text.as_bytes()).unwrap();
    assert_eq!(read.channels()[0].values(), [1.5, -0.5, 2.0]);
    let told = error("time_s,current_a\n0,1 V\n");
    assert_eq!(told, "line 2, column `current_a`: expected a number, found `1 V`");
    let told = error("time_s,current_a\n0,0,1,5\n0,1,1,5\n");
    assert!(told.ends_with("another separator between cells, such as `;`)"), "{told}");
}

#[test]
fn times_may_be_those_of_rows() {
    let text = "phase_a_current_a,x\n1,2\n3,4\n5,6\n";
    let told = error(text);
    assert!(
        told.ends_with("`--map time_s=row*FACTOR` gives the time between rows in s)"),
        "{told}"
    );
    let map = ColumnMap::new(["time_s=row*0.0001"]).unwrap();
    let mapped = parse("r".to_owned(), text.as_bytes(), &map).unwrap();
    assert_eq!(mapped.channels()[0].times_s(), [0.0, 0.0001, 0.0002]);
    let stated = read(format!("# rate-hz = 10000\n{text}").as_bytes()).unwrap();
    assert_eq!(stated.channels(), mapped.channels());
    let of_preamble = read(format!("Sampling rate;10000 Hz\n{text}").as_bytes()).unwrap_err();
    assert!(matches!(of_preamble, RecordError::NoTime { step_s: Some(1e-4), .. }));
    let own = "row,current_a\n0,1\n2,3\n4,5\n";
    let map = ColumnMap::new(["time_s=row*0.5"]).unwrap();
    let own = parse("r".to_owned(), own.as_bytes(), &map).unwrap();
    assert_eq!(own.channels()[0].times_s(), [0.0, 1.0, 2.0]);
}

#[test]
fn words_for_missing_samples_need_an_option() {
    let text = "time_s,current_a,load_n_m\n0,1,NaN\n1,2,3\n2,3,n/a\n3,4,4\n";
    let told = error(text);
    assert_eq!(
        told,
        "line 2, column `load_n_m`: expected a finite number, found `NaN` (an empty cell means \
         no sample; `--gaps bridge` takes it for a missing sample)"
    );
    let bridged = ColumnMap::default().with_gaps(Gaps::Bridge);
    let read = parse("r".to_owned(), text.as_bytes(), &bridged).unwrap();
    assert_eq!(read.channel(ChannelName::Load).unwrap().times_s(), [1.0, 3.0]);
    assert_eq!(read.channel(ChannelName::Current).unwrap().values().len(), 4);
}

#[test]
fn tables_of_other_shapes_are_told_by_what_they_are() {
    let told = error("time_s,variable,value\n0,a,1\n1,a,1\n2,a,1\n");
    assert!(told.contains("pivot the table to a column a channel"), "{told}");
    assert_eq!(
        error("#datatype,string,long\n,result,_time,_value,_field\n,,0,1,a\n")[..20],
        told[..20]
    );
    let rows = (0..300).map(|i| format!("{},1\n", f64::from(i % 150)));
    let rows = rows.collect::<Vec<_>>().concat();
    let told = error(&format!("time_s,current_a\n{rows}"));
    assert!(told.contains("fdi.diagnose(table, group=COLUMN)"), "{told}");
}

fn utf16(text: &str) -> Vec<u8> {
    [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
}

#[test]
fn dialects_are_refused_with_their_line_and_column() {
    let map = ColumnMap::new(["time_s=t", "current_a=Strom"]).unwrap();
    let told = |text: &str| parse("r".to_owned(), text.as_bytes(), &map).unwrap_err().to_string();
    let rows = "Bench 3\nt;Strom\n0,0;1,5\n0,1;1,5\n0,2;1,5\n";
    assert_eq!(
        told(&format!("{rows}0,3;off\n")),
        "line 6, column `Strom`: expected a number, found `off`"
    );
    assert_eq!(
        told(&format!("{rows}0,3;1.000\n")),
        "line 6, column `Strom`: expected a number, found `1.000`"
    );
    let unit = told("t;Strom\ns;bar\n0;1\n1;1\n2;1\n");
    assert!(unit.starts_with("column `Strom` is in `bar` as the file says"), "{unit}");
    assert_eq!(
        told("t;Strom\n09:30:00;1\n09:30:01;1\n09:30:02;1\nnoon;1\n"),
        "line 5, column `t`: expected a number, found `noon`"
    );
}

#[test]
fn lines_are_skipped_where_that_is_asked_for() {
    let map = ColumnMap::default().with_skipped_lines(2);
    let text = "# exported by hand\n# on bench 3\n# noise-a = 0.5\ntime_s,current_a\n0,1\n1,off\n";
    let read = |text: &str, map| parse("r".to_owned(), text.as_bytes(), map);
    let recording = read(&text.replace("off", "2"), &map).unwrap();
    assert_eq!(recording.metadata.noise_a, Some(0.5));
    let told = read(text, &map).unwrap_err().to_string();
    assert_eq!(told, "line 6, column `current_a`: expected a number, found `off`");
    let told = read(text, &ColumnMap::default()).unwrap_err().to_string();
    assert!(told.starts_with("line 1: metadata"), "{told}");
    assert!(told.ends_with("`--skip-lines N` leaves out the first N lines)"), "{told}");
}

/// Two recordings under one another, with the number and the state of each.
fn two_runs() -> String {
    let row = |run: usize, row: usize| {
        let state = if row < 50 { "START" } else { "RUN" };
        format!("{run}.0;{state};{:.4};{}\n", row as f64 * 1e-4, run * 1000 + row)
    };
    let rows = (1..=2).flat_map(|run| (0..150).map(move |at| row(run, at)));
    format!("run;state;time_s;current_a\n{}", rows.collect::<String>())
}

fn read_rows(text: &str, choices: &[&str]) -> Result<Recording, RecordError> {
    let map = ColumnMap::default().with_rows(choices).unwrap();
    parse("r".to_owned(), text.as_bytes(), &map)
}

#[test]
fn rows_are_chosen_by_their_values() {
    let text = two_runs();
    for (choices, samples, first, start_s) in [
        (&["run=1"][..], 150, 1000.0, 0.0),
        (&["run=2"], 150, 2000.0, 0.0),
        (&["state=RUN", "run=2.0"], 100, 2050.0, 0.005),
    ] {
        let recording = read_rows(&text, choices).unwrap();
        let current = recording.channel(ChannelName::Current).unwrap();
        let start = (current.values()[0], current.times_s()[0]);
        assert_eq!((current.values().len(), start), (samples, (first, start_s)), "{choices:?}");
    }
    let broken = text.replace("0.0149;2149", "0.0149;off");
    let error = read_rows(&broken, &["run=2"]).unwrap_err();
    assert!(matches!(error, RecordError::NotANumber { line: 301, .. }), "{error}");
    assert!(read_rows(&broken, &["run=1"]).is_ok());
}

#[test]
fn a_choice_of_rows_that_cannot_be_is_told() {
    let text = two_runs();
    let told = |choices: &[&str]| read_rows(&text, choices).unwrap_err().to_string();
    assert_eq!(
        told(&["test=1"]),
        "line 1: no column `test` to choose rows by (`--where`); the columns are `run`, `state`, \
         `time_s`, `current_a`"
    );
    assert_eq!(told(&["run=7"]), "no row has `run=7` (`--where`); values of `run`: `1.0`, `2.0`");
    assert!(told(&[]).contains("`--where run=1.0` reads one"), "{}", told(&[]));
    let rated = format!("# rate-hz = 10000\n{}", text.replace("time_s", "t"));
    let whole = read_rows(&rated, &["run=2"]).unwrap();
    assert_eq!(whole.channel(ChannelName::Current).unwrap().times_s()[1], 1e-4);
    let error = read_rows(&rated, &["state=RUN"]).unwrap_err();
    assert!(matches!(error, RecordError::RowsApart), "{error}");
}

#[test]
fn mapped_columns_must_exist_and_hide_their_namesake() {
    let map = ColumnMap::new(["current_a=i*2"]).unwrap();
    let read = |text: &str| parse("r".to_owned(), text.as_bytes(), &map);
    let both = read("time_s,current_a,i\n0,1,10\n").unwrap();
    assert_eq!(both.channel(ChannelName::Current).unwrap().values(), [20.0]);
    assert_eq!(both.other_columns()[0].name(), "current_a");
    assert_eq!(
        read("time_s,j\n0,1\n").unwrap_err().to_string(),
        "line 1: no column `i` to read `current_a` from; the columns are `time_s`, `j`"
    );
    assert_eq!(
        error("time_s,current_a\n0,1\n1,1e300\n"),
        "line 3, column `current_a`: 1e300 is beyond any actuator, expected at most 1e12 in size"
    );
    let overflow = ColumnMap::new(["current_a=i*1e300"]).unwrap();
    let error = parse("r".to_owned(), b"time_s,i\n0,1e300\n", &overflow).unwrap_err();
    assert!(matches!(error, RecordError::NotFinite { line: 2, .. }));
}

/// Times at 10 kHz in milliseconds, padded with noughts by whoever wrote them.
#[test]
fn padded_times_are_as_coarse_as_their_values() {
    let text = |lost: std::ops::Range<usize>| {
        let rows = (0..2000).filter(|row| !lost.contains(row));
        let time = |row: usize| (row as f64 / 10.0).round_ties_even() / 1e3;
        let row = |row: usize| format!("{:.6},{}\n", time(row), row % 7);
        format!("time_s,current_a\n{}", rows.map(row).collect::<String>())
    };
    let whole = read(text(0..0).as_bytes()).unwrap();
    let sampling = whole.channels()[0].sampling().unwrap();
    assert_eq!((sampling.rate_hz, sampling.samples), (10_000.0, 2000));
    assert!(sampling.is_uniform());
    let message = error(&text(1000..1001));
    assert!(message.contains("`--gaps bridge`"), "{message}");
}

/// Rows in another order than that of their times, each row apart or all from the end.
#[test]
fn rows_are_put_in_order_where_gaps_are_bridged() {
    let map = ColumnMap::default().with_gaps(Gaps::Bridge);
    let rows: Vec<String> =
        (0..500).map(|row| format!("{:.4},{}\n", f64::from(row) / 1e4, row % 97)).collect();
    let table = |order: &[usize]| -> String {
        let rows: String = order.iter().map(|&row| rows[row].as_str()).collect();
        format!("time_s,current_a\n{rows}")
    };
    let in_order: Vec<usize> = (0..500).collect();
    let sound = read(table(&in_order).as_bytes()).unwrap();
    let reversed: Vec<usize> = (0..500).rev().collect();
    let twice: Vec<usize> = (0..1000).map(|row| row / 2).collect();
    let scattered: Vec<usize> = (0..500).map(|row| row * 211 % 500).collect();
    for order in [reversed, twice, scattered] {
        let text = table(&order);
        assert!(error(&text).contains("; `--gaps bridge` puts the samples in order"));
        let mended = parse("r.csv".to_owned(), text.as_bytes(), &map).unwrap();
        let [mended, sound] = [&mended, &sound].map(|recording| &recording.channels()[0]);
        assert_eq!(mended.values(), sound.values());
        assert_eq!(mended.sampling().unwrap().rate_hz, 10_000.0);
    }
}

/// Two recordings sorted by time, and one whose times are rounded to as many samples, of packets.
#[test]
fn recordings_beside_one_another_are_refused_with_the_choice_of_one() {
    let text = |angle_rad: &dyn Fn(u32) -> f64| {
        let row = |row: u32| {
            let run = ["A", "B"][row as usize % 2];
            format!("{:.3},{run},{:.6}\n", f64::from(row / 2) / 1e3, angle_rad(row))
        };
        let rows: String = (0..1000).map(row).collect();
        format!("# date = \"2026-11-21\"\ntime_s,run,motor_angle_rad\n{rows}")
    };
    let turned = |at: f64| 3.0 * (at / 40.0).sin();
    let two = text(&|row| turned(f64::from(row / 2) - 4.0 * f64::from(row % 2)));
    assert_eq!(
        error(&two),
        "line 4: time 0 s is that of 2 rows, as is each, and `motor_angle_rad` does not go on from one \
         to the next; of several recordings beside one another `--where run=A` reads one; in Python \
         `fdi.diagnose(table, group=COLUMN)` reads all"
    );
    assert_eq!(read_rows(&two, &["run=A"]).unwrap().channels()[0].values().len(), 500);
    let one = read(text(&|row| turned(f64::from(row) / 2.0)).as_bytes()).unwrap();
    assert_eq!(one.channels()[0].sampling().unwrap().rate_hz, 2000.0);
}

/// Rows in which an acquisition has written its last currents again.
#[test]
fn held_samples_are_missing_ones() {
    let map = ColumnMap::default().with_gaps(Gaps::Bridge);
    let current_a = |row: u32| {
        let noise = (f64::from(row) * 12.9898).sin() * 43_758.545_3;
        2.0 * (f64::from(row) / 20.0).sin() + 0.05 * (noise - noise.floor())
    };
    let text = |held: std::ops::Range<u32>| {
        let row = |row: u32| {
            let shown = if held.contains(&row) { held.start - 1 } else { row };
            format!("{:.4},{:.5}\n", f64::from(row) / 1e4, current_a(shown))
        };
        format!("time_s,current_a\n{}", (0..2000).map(row).collect::<String>())
    };
    assert!(read(text(0..0).as_bytes()).unwrap().clock_notes().is_empty());
    let short = text(1000..1008);
    assert_eq!(
        error(&short),
        "line 1002: the currents are the same to the digit in the 8 rows after 0.0999 s and jump then: \
         held samples, not measured ones (`--gaps bridge` fills what is held)"
    );
    let mended = parse("r.csv".to_owned(), short.as_bytes(), &map).unwrap();
    assert_eq!((mended.clock_notes()[0].lost, mended.channels()[0].values().len()), (8, 2000));
    let off_a = mended.channels()[0].values()[1004] - current_a(1004);
    assert!(off_a.abs() < 0.1, "{off_a}");
    let long =
        parse("r.csv".to_owned(), text(1000..1009).as_bytes(), &map).unwrap_err().to_string();
    assert!(long.ends_with("; more than 8 in a row are not filled"), "{long}");
}

fn read_mapped(text: &str, map: &[&str]) -> Result<Recording, RecordError> {
    Recording::parse("r.csv", text.as_bytes(), &ColumnMap::new(map).unwrap())
}

const SUMMANDS: &str = "time_s,a,b,c\n0,1,2,\n1,3,5,4\n";

#[test]
fn columns_are_added_with_their_factors() {
    for (map, values) in [
        ("motor_angle_rad=(a - b)*0.5+10", [9.5, 9.0]),
        ("motor_angle_rad=(a*4 + b)*0.5", [3.0, 8.5]),
        ("motor_angle_rad=(b - a)", [1.0, 2.0]),
    ] {
        let recording = read_mapped(SUMMANDS, &[map]).unwrap();
        let angle = recording.channel(ChannelName::MotorAngle).unwrap();
        assert_eq!((angle.values(), angle.times_s()), (&values[..], &[0.0, 1.0][..]), "{map}");
        assert_eq!(recording.channels().len(), 1);
    }
}

#[test]
fn units_of_the_parts_are_their_own() {
    let text = "time_s;coarse;fine\ns;rad;mrad\n0;1;20\n1;2;30\n";
    let recording = read_mapped(text, &["motor_angle_rad=(coarse - fine)"]).unwrap();
    let angle = recording.channel(ChannelName::MotorAngle).unwrap();
    assert_eq!(angle.values(), [0.98, 1.97]);
    assert_eq!(recording.stated_units()[0].factor, 1e-3);
}

#[test]
fn parts_without_a_sample_of_each_time_are_refused() {
    for (text, map) in [
        (SUMMANDS, "motor_angle_rad=(a - c)"),
        ("time_s,a,b\n0,1,\n1,2,\n", "motor_angle_rad=(a - b)"),
    ] {
        assert_eq!(
            read_mapped(text, &[map]).unwrap_err().to_string(),
            "the columns that `motor_angle_rad` is the sum of do not all have their samples at the \
             same times"
        );
    }
}

#[test]
fn sums_are_made_before_samples_are_put_on_a_clock() {
    let row = |n: usize| {
        let angle = 0.5 * n as f64;
        let turns = (angle / std::f64::consts::TAU).floor();
        format!("{:.4},{turns},{}\n", n as f64 * 1e-4, angle - turns * std::f64::consts::TAU)
    };
    let of_rows = |rows: &[String]| format!("time_s,turns,angle\n{}", rows.concat());
    let mut rows: Vec<String> = (0..400).map(row).collect();
    let map = ColumnMap::new(["motor_angle_rad=(turns*6.283185307179586 + angle)"]).unwrap();
    let bridged = map.clone().with_gaps(Gaps::Bridge);
    let read = |text: &str, map| parse("r".to_owned(), text.as_bytes(), map);
    let assert_angle = |text: &str, map| {
        let recording = read(text, map).unwrap();
        let angle = recording.channel(ChannelName::MotorAngle).unwrap();
        assert!(angle.values().len() > 397);
        for (time_s, value) in angle.times_s().iter().zip(angle.values()) {
            assert!((value - 5000.0 * time_s).abs() < 1e-3, "{time_s} s: {value}");
        }
    };
    assert_angle(&of_rows(&rows), &map);
    let lacking = format!("{},nan\n", rows[300].rsplit_once(',').unwrap().0);
    rows[300] = lacking;
    rows.remove(200);
    let text = of_rows(&rows);
    assert_angle(&text, &bridged);
    assert!(read(&text, &map).is_err());
}

#[test]
fn channels_in_pairs_with_their_times_have_names() {
    let head = "Name\tScope\nStart\t24.11.2026\n\nName\tia\tName\tib\nSampleTime[ms]\t0.1\tSampleTime[ms]\t0.1\n\n";
    let rows: Vec<String> = (0..9).map(|n| format!("0.{n}\t{n}\t0.{n}\t-{n}\n")).collect();
    let rows = rows.concat();
    let map = ["time_s=Time [ms]*0.001", "phase_a_current_a=ia", "phase_b_current_a=ib"];
    let map = ColumnMap::new(map).unwrap();
    let read = parse("r".to_owned(), format!("{head}{rows}").as_bytes(), &map).unwrap();
    assert_eq!(read.channels()[0].values()[..3], [0.0, 1.0, 2.0]);
    assert_eq!(read.channels()[1].values()[..3], [0.0, -1.0, -2.0]);
    approx::assert_abs_diff_eq!(read.channels()[1].times_s()[2], 2e-4, epsilon = 1e-12);
    // without the time between samples the pairs are none of these
    let bare = format!("{head}{rows}").replace("SampleTime[ms]", "Factor");
    assert!(parse("r".to_owned(), bare.as_bytes(), &map).is_err());
}
