//! Properties: what files that are not text say of themselves.

/// Value that a file states under some name.
#[cfg_attr(
    not(any(feature = "mat", feature = "mf4", feature = "parquet", feature = "tdms")),
    expect(dead_code, reason = "without another format no file has properties")
)]
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Property {
    Number(f64),
    Text(String),
}
