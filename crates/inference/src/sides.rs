//! Right-hand sides side by side: what is read of a matrix serves each of them.
//!
//! Nothing is fused, so that results are the same at every vector width.

#![expect(
    clippy::inline_always,
    reason = "kernels are compiled once for each instruction set, which inlining makes possible"
)]

/// Right-hand sides that go together.
pub(crate) const SIDES: usize = 8;

/// Values of [`SIDES`] right-hand sides at one row.
pub(crate) type Side = [f64; SIDES];

/// Takes `Σ_k rows[r][k]·z[k]` off each of four values.
#[inline(always)]
pub(crate) fn take_products_off(values: &mut [Side; 4], rows: [&[f64]; 4], z: &[Side]) {
    let count = z.len();
    let rows = rows.map(|row| &row[..count]);
    let mut left = *values;
    for k in 0..count {
        let z = z[k];
        for r in 0..4 {
            let l = rows[r][k];
            for lane in 0..SIDES {
                left[r][lane] -= l * z[lane];
            }
        }
    }
    *values = left;
}
