//! Reproducible random streams and normal deviates.
//!
//! | module | what |
//! | --- | --- |
//! | [`stream`] | one seed, an independent stream for every (stage, layer, field) |
//! | [`normal`] | normal deviates, one word each, and white a_lm in an order that does not know lmax |

pub mod normal;
pub mod stream;

pub use stream::Stream;
