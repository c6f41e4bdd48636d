//! Independent random streams from one 64-bit seed.
//!
//! xoshiro256++ (Blackman & Vigna, ACM Trans. Math. Softw. 47, 36 (2021)), its state filled from the seed by
//! SplitMix64. Stream (stage, layer, field) starts
//!
//! * `stage` long jumps of 2^192 words, then
//! * `layer` · [`FIELDS`] + `field` jumps of 2^128 words
//!
//! after the start of the seed: streams overlap only after 2^128 words, and a stream depends on its own three numbers
//! alone, not on which others are used nor on how many layers there are. **The numbering is part of the format of
//! results**: a caller's stages and fields keep their numbers for good, new ones take new numbers.
//!
//! A jump costs 256 steps of the generator, about half a microsecond.

use crate::Error;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Fields per layer of a stage, for good.
pub const FIELDS: u32 = 16;
/// Layers per stage, for good.
pub const LAYERS: u32 = 65_536;
/// Stages, for good.
pub const STAGES: u32 = 256;

/// A stream of random words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stream(Xoshiro256PlusPlus);

impl Stream {
    /// The stream of a field of a layer of a stage.
    ///
    /// # Errors
    /// [`Error::Domain`] unless `stage` < [`STAGES`], `layer` < [`LAYERS`] and `field` < [`FIELDS`].
    ///
    /// ```
    /// use dust3d_kernels::random::Stream;
    /// let (mut a, mut b) = (Stream::new(1, 0, 3, 0)?, Stream::new(1, 0, 3, 0)?);
    /// assert_eq!(a.word(), b.word());
    /// # Ok::<(), dust3d_kernels::Error>(())
    /// ```
    pub fn new(seed: u64, stage: u32, layer: u32, field: u32) -> Result<Self, Error> {
        Error::check_domain("stage (0 to 255)", f64::from(stage), stage < STAGES)?;
        Error::check_domain("layer (0 to 65535)", f64::from(layer), layer < LAYERS)?;
        Error::check_domain("field (0 to 15)", f64::from(field), field < FIELDS)?;
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
        for _ in 0..stage {
            generator.long_jump();
        }
        for _ in 0..layer * FIELDS + field {
            generator.jump();
        }
        Ok(Self(generator))
    }

    /// The stream from a state of the generator itself; a state of zeros, which it cannot have, is replaced.
    #[must_use]
    pub fn from_state(state: [u64; 4]) -> Self {
        let mut seed = [0; 32];
        for (bytes, word) in seed.as_chunks_mut::<8>().0.iter_mut().zip(state) {
            *bytes = word.to_le_bytes();
        }
        Self(Xoshiro256PlusPlus::from_seed(seed))
    }

    /// The next 64 random bits.
    #[inline]
    pub fn word(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// The next word as a number in the open interval (0, 1): (w₅₂ + ½) 2^−52 with w₅₂ the upper 52 bits, exact.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        const SCALE: f64 = 1.0 / 4_503_599_627_370_496.0;
        ((self.word() >> 12) as f64 + 0.5) * SCALE
    }
}
