//! A compression map comes back bit for bit, and bad data are refused.

use reduction::{CompressionConfig, CompressionMap, Encoding, Placement, Snapshots};
use serde_json::{Value, from_value, json, to_value};

fn snapshots() -> Snapshots {
    Snapshots::from_fn(120, 20, |row, column| {
        let (x, t) = (row as f64 / 120.0, column as f64 / 20.0);
        (9.0 * x + t).sin() + t * (7.0 * x * x).cos()
    })
    .unwrap()
}

fn map(encoding: Encoding) -> CompressionMap {
    let config = CompressionConfig { encoding, count: 5, ..CompressionConfig::default() };
    CompressionMap::fit(&(&snapshots()).into(), &config).unwrap()
}

#[test]
fn a_map_encodes_and_decodes_the_same_bits() {
    for encoding in [Encoding::Points(Placement::Qdeim), Encoding::Modes] {
        let map = map(encoding);
        let copy: CompressionMap = from_value(to_value(&map).unwrap()).unwrap();
        assert_eq!(copy, map);
        let encoded = map.encode(snapshots().snapshot(3)).unwrap();
        assert_eq!(copy.encode(snapshots().snapshot(3)).unwrap(), encoded);
        assert_eq!(copy.decode(&encoded).unwrap(), map.decode(&encoded).unwrap());
    }
}

#[test]
fn a_map_of_bad_data_is_refused() {
    let good = to_value(map(Encoding::Points(Placement::Qdeim))).unwrap();
    let refused = |pointer: &str, with: Value, why: &str| {
        let mut bad = good.clone();
        *bad.pointer_mut(pointer).unwrap() = with;
        let error = from_value::<CompressionMap>(bad).unwrap_err().to_string();
        assert!(error.contains(why), "{pointer}: {error}");
    };
    refused("/version", json!(7), "layout of version 7, 1 is read");
    refused("/parts/encoder/select/0", json!(500), "location 500 lies outside");
    refused("/parts/encoder/select", json!([]), "keeps no number");
    refused(
        "/parts/encoder",
        json!({ "average": [[], [], [], [], []] }),
        "group 0 has no location",
    );
    refused("/parts/decoder/rows", json!(7), "values given for 7 rows");
    refused("/parts/first_mode", json!([1.0]), "first mode of 1 values");
    refused("/parts/mean/0", json!(null), "invalid type");
    refused("/parts/encoding", json!("words"), "unknown variant");
}
