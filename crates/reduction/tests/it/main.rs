//! Tests of the crate through its public interface.

#![expect(clippy::unwrap_used, reason = "a case that cannot be built fails its test")]

mod compression;
mod conversions;
mod dmd;
mod information;
mod leading;
mod noise;
mod property;
mod references;
mod serialised;
mod som;
mod streaming;
mod svd;
