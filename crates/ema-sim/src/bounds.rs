//! Bounds on numbers, without a branch: loops over lanes take them in vectors.
//!
//! Unlike the methods of `f64` they say what becomes of a zero's sign and of NaN, so that every
//! path through the simulators gives the same bits.
#![expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]

/// The smaller of two numbers, the first where they are equal or one is NaN.
#[inline(always)]
pub(crate) fn smaller(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The larger of two numbers, the second where they are equal or one is NaN.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// A number within a limit, none below zero, on its size.
#[inline(always)]
pub(crate) fn within(value: f64, limit: f64) -> f64 {
    let raised = if value < -limit { -limit } else { value };
    if raised > limit { limit } else { raised }
}
