//! The identity of a file: SHA-256 of its bytes.

use std::fmt::Write;

use sha2::{Digest, Sha256};

/// SHA-256 of some bytes as 64 hexadecimal digits: the identity of a file.
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("a String takes all text");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_checksum_of_abc() {
        // FIPS 180-4 example, "abc"
        let want = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256_hex(b"abc"), want);
    }
}
