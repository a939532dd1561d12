//! Properties of reader and writer.

use proptest::prelude::*;
use recordings::{
    Channel, ChannelName, ColumnMap, CommandSource, CsvFormat, EnvelopeKind, Metadata, Recording,
    RecordingDate,
};

const FORMAT: CsvFormat = CsvFormat { time_decimals: 4, value_decimals: 5 };

/// Times on the grid of the format, strictly increasing.
fn times() -> impl Strategy<Value = Vec<f64>> {
    (-10_000i32..10_000, prop::collection::vec(1i32..500, 0..40)).prop_map(|(start, steps)| {
        let mut tick = start;
        let mut times_s = vec![f64::from(tick) / 1e4];
        for step in steps {
            tick += step;
            times_s.push(f64::from(tick) / 1e4);
        }
        times_s
    })
}

fn channel(name: ChannelName) -> impl Strategy<Value = Channel> {
    times().prop_flat_map(move |times_s| {
        let values = prop::collection::vec(-1e6..1e6, times_s.len());
        values.prop_map(move |values| Channel::new(name, &times_s, values).unwrap())
    })
}

fn metadata() -> impl Strategy<Value = Metadata> {
    (
        prop::option::of(".{1,12}"),
        prop::option::of(any::<bool>()),
        prop::option::of(".{1,12}"),
        prop::option::of(1e-3..1e9),
        prop::option::of(-10.0..10.0),
        prop::option::of(0usize..4),
    )
        .prop_map(|(actuator_id, dated, command, filter_hz, start_angle_rad, envelope)| {
            Metadata {
                actuator_id,
                date: dated.and_then(|_| RecordingDate::parse("2026-11-21T08:00:00Z")),
                command: command.map(|name| match name.as_str() {
                    "recorded" => CommandSource::Recorded,
                    _ => CommandSource::Named(name),
                }),
                filter_hz,
                start_angle_rad,
                envelope: envelope.map(|index| EnvelopeKind::ALL[index]),
                ..Metadata::default()
            }
        })
}

fn recording() -> impl Strategy<Value = Recording> {
    (metadata(), channel(ChannelName::Current), channel(ChannelName::Load)).prop_map(
        |(metadata, current, load)| Recording::new("r", metadata, vec![current, load]).unwrap(),
    )
}

proptest! {
    #[test]
    fn property_what_is_written_is_read_back_rounded(recording in recording()) {
        let text = recording.to_csv(FORMAT).unwrap();
        let read = Recording::parse("r", text.as_bytes(), &ColumnMap::default()).unwrap();
        prop_assert_eq!(&read.metadata, &recording.metadata);
        for channel in recording.channels() {
            let back = read.channel(channel.name()).unwrap();
            prop_assert_eq!(back.times_s(), channel.times_s());
            for (got, want) in back.values().iter().zip(channel.values()) {
                // half of the last decimal, and the rounding of numbers up to 1e6
                let tolerance = 0.5e-5 + 1e6 * f64::EPSILON;
                prop_assert!((got - want).abs() <= tolerance, "{got} {want}");
            }
        }
        prop_assert_eq!(read.to_csv(FORMAT).unwrap(), text);
    }

    #[test]
    fn property_any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = Recording::parse("r", &bytes, &ColumnMap::default()).map_err(|e| e.to_string());
    }

    /// Nearly right text reaches the deeper branches.
    #[test]
    fn property_any_table_is_read_or_refused(
        head in "(# [a-z-]{1,9} = [0-9\"a-z.]{1,6}\n){0,2}time_s(,(current_a|load_n_m|hall_state|é)){0,3}\n",
        body in "[-0-9.,eE\"\n\r #inf]{0,80}",
    ) {
        let text = head + &body;
        if let Ok(recording) = Recording::parse("r", text.as_bytes(), &ColumnMap::default()) {
            for channel in recording.channels() {
                prop_assert!(channel.values().iter().all(|value| value.is_finite()));
                prop_assert!(channel.times_s().windows(2).all(|pair| pair[0] < pair[1]));
            }
        }
    }
}
