//! Vectors that lanes are compiled for.
//!
//! On processors of the x86 family they are those of AVX2 and no wider ones: sixteen lanes are two
//! vectors of AVX-512, whose operations wait for one another, so that nothing is gained, and a copy
//! of the loops has 0.3 MB (`docs/decisions/0163-vectors-of-avx-512.md`). Elsewhere they are the widest
//! that there are.

use pulp::NullaryFnOnce;

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
type Widest = pulp::x86::V3;
#[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
type Widest = pulp::Arch;

/// Vectors of a processor, wider than two numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vectors(Widest);

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
impl Vectors {
    /// Vectors of this processor; `None` where it has no wide ones.
    pub(crate) fn of_processor() -> Option<Self> {
        Widest::try_new().map(Self)
    }

    /// Runs a kernel that is compiled for them.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "compiled for each instruction set by being inlined")]
    pub(crate) fn run<K: NullaryFnOnce>(self, kernel: K) -> K::Output {
        self.0.vectorize(kernel)
    }
}

#[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
impl Vectors {
    /// Vectors of this processor; `None` where it has no wide ones.
    pub(crate) fn of_processor() -> Option<Self> {
        let widest = Widest::new();
        (!matches!(widest, Widest::Scalar)).then_some(Self(widest))
    }

    /// Runs a kernel that is compiled for them.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "compiled for each instruction set by being inlined")]
    pub(crate) fn run<K: NullaryFnOnce>(self, kernel: K) -> K::Output {
        self.0.dispatch(kernel)
    }
}
