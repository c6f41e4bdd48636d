//! What the CPU can do, as a value.

use super::portable::PortableToken;
#[cfg(target_arch = "x86_64")]
use super::{avx2::Avx2Token, avx512::Avx512Token};
use core::fmt;

/// The vector instructions a kernel is to use; made by detection, passed by value.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Level(Tokens);

/// One proof per level; for [`dispatch!`](crate::dispatch).
#[doc(hidden)]
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Tokens {
    Portable(PortableToken),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2Token),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512Token),
}

impl Level {
    /// The level that runs everywhere.
    #[must_use]
    pub const fn portable() -> Self {
        Self(Tokens::Portable(PortableToken::new()))
    }

    /// The best level of this CPU (feature `std`; without it, of the target compiled for).
    #[must_use]
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(token) = Avx512Token::detect() {
                return Self(Tokens::Avx512(token));
            }
            if let Some(token) = Avx2Token::detect() {
                return Self(Tokens::Avx2(token));
            }
        }
        Self::portable()
    }

    /// The level called `portable`, `avx2` or `avx512`, if this CPU has it.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        match name {
            "portable" => Some(Self::portable()),
            #[cfg(target_arch = "x86_64")]
            "avx2" => Avx2Token::detect().map(|t| Self(Tokens::Avx2(t))),
            #[cfg(target_arch = "x86_64")]
            "avx512" => Avx512Token::detect().map(|t| Self(Tokens::Avx512(t))),
            _ => None,
        }
    }

    /// Every level of this CPU, the portable one first.
    pub fn available() -> impl Iterator<Item = Self> {
        ["portable", "avx2", "avx512"]
            .into_iter()
            .filter_map(Self::by_name)
    }

    /// `portable`, `avx2` or `avx512`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self.0 {
            Tokens::Portable(_) => "portable",
            #[cfg(target_arch = "x86_64")]
            Tokens::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Tokens::Avx512(_) => "avx512",
        }
    }

    #[doc(hidden)]
    #[must_use]
    pub const fn tokens(self) -> Tokens {
        self.0
    }
}

impl Default for Level {
    fn default() -> Self {
        Self::detect()
    }
}

impl fmt::Debug for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
