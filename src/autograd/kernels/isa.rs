//! The choice of an instruction set, made once at run time.

use std::sync::OnceLock;

use thiserror::Error;

use super::blocked::Kernels;
#[cfg(target_arch = "x86_64")]
use super::{avx2, avx512};

/// Environment variable that names the set to use: `avx512`, `avx2` or `portable`.
const CHOICE: &str = "KEYDANCE_ISA";

/// The environment asks for an instruction set that there is not.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{CHOICE}={asked}: expected an instruction set that this CPU has: {available}")]
pub struct IsaError {
    pub asked: String,
    pub available: String,
}

/// An instruction set that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isa {
    /// AVX-512 (F, BW, DQ, VL) with FMA.
    Avx512,
    /// AVX2 with FMA.
    Avx2,
    /// Whatever the crate was compiled for.
    Portable,
}

impl Isa {
    /// Every set, best first.
    pub const ALL: [Self; 3] = [Self::Avx512, Self::Avx2, Self::Portable];

    /// The set that `KEYDANCE_ISA` asks for (to get the numbers of another machine), else the best
    /// set this CPU has.
    #[inline]
    pub fn detected() -> Self {
        static DETECTED: OnceLock<Isa> = OnceLock::new();
        *DETECTED.get_or_init(|| {
            let best = || Self::ALL.into_iter().find(|isa| isa.is_available());
            let asked = Self::asked_for().ok().flatten();
            asked.or_else(best).unwrap_or(Self::Portable)
        })
    }

    /// The set that the environment asks for, if it does.
    ///
    /// # Errors
    /// It asks for one that this CPU lacks, or that is none.
    pub fn asked_for() -> Result<Option<Self>, IsaError> {
        let Some(asked) = std::env::var_os(CHOICE) else {
            return Ok(None);
        };
        let available = || Self::ALL.into_iter().filter(|isa| isa.is_available());
        match available().find(|isa| *isa.name() == asked) {
            Some(isa) => Ok(Some(isa)),
            None => Err(IsaError {
                asked: asked.to_string_lossy().into_owned(),
                available: available().map(Self::name).collect::<Vec<_>>().join(", "),
            }),
        }
    }

    /// What `KEYDANCE_ISA` calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "avx512",
            Self::Avx2 => "avx2",
            Self::Portable => "portable",
        }
    }

    /// Whether this CPU has the set.
    #[inline]
    pub fn is_available(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            match self {
                Self::Avx512 => {
                    avx2 && is_x86_feature_detected!("avx512f")
                        && is_x86_feature_detected!("avx512bw")
                        && is_x86_feature_detected!("avx512dq")
                        && is_x86_feature_detected!("avx512vl")
                }
                Self::Avx2 => avx2,
                Self::Portable => true,
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            self == Self::Portable
        }
    }

    /// The f32 kernels of the set, for sets that have some.
    ///
    /// # Panics
    /// When this CPU lacks the set: the kernels' callers rely on it.
    #[inline]
    #[track_caller]
    pub(super) fn kernels(self) -> Option<&'static Kernels> {
        #[cfg(target_arch = "x86_64")]
        {
            assert!(self.is_available(), "this CPU lacks {self:?}");
            match self {
                Self::Avx512 => return Some(&avx512::KERNELS),
                Self::Avx2 => return Some(&avx2::KERNELS),
                Self::Portable => {}
            }
        }
        None
    }
}

/// Runs `f` compiled for the best instruction set of the CPU, so that plain loops in it vectorise.
///
/// `f` is compiled once for each [`Isa`]. What it calls must be inlined into it to profit: write
/// `vectorised(#[inline(always)] || ...)` and mark the functions it calls `#[inline(always)]`.
/// Results do not depend on the set: the compiler neither reorders nor fuses float operations.
#[inline]
pub fn vectorised<R>(f: impl FnOnce() -> R) -> R {
    match Isa::detected() {
        // SAFETY: `detected` returned a set this CPU has.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => unsafe { with_avx512(f) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => unsafe { with_avx2(f) },
        _ => f(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma")]
fn with_avx512<R>(f: impl FnOnce() -> R) -> R {
    f()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2<R>(f: impl FnOnce() -> R) -> R {
    f()
}
