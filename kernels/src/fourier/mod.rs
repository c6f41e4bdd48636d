//! Fourier transforms of eight sequences at once, one in every lane.
//!
//! X_k = Σ_j x_j e^{∓2πi jk/n} for lengths with prime factors up to 7. Every operation is one on eight lanes: nothing is
//! shuffled within a vector, and eight transforms cost what one of the same operations would. Sequences of equal length
//! come in eights here: the rings of the belt, and the colatitudes of eight orders.
//!
//! The length is split in two, n = n₁ n₂ with n₁ ≈ n₂ \[B90\], and the data seen as n₁ rows of n₂: transforms down the
//! columns, a twist by e^{2πi k₁ j₂/n}, transforms along the rows. Each of these short transforms runs in the first-level
//! cache, between two buffers in Stockham's order, so the data pass through the second-level cache twice whatever n is.
//! The result of [`Fourier::forward`] lies where rows and columns leave it, at [`Fourier::position`]; the transform in
//! the other direction starts there, with the steps in the opposite order, so that nothing is ever sorted.
//!
//! Errors are those of any fast transform: a few 1e-16 of the root mean square, growing as √log n.
//!
//! | file | what |
//! | --- | --- |
//! | `butterfly` | transforms of 2 to 10 values |
//! | `short` | short transforms, pass by pass |
//! | `transform` | lengths, tables, rows and columns |
//!
//! \[B90\] D. H. Bailey, J. Supercomputing 4, 23 (1990).

mod butterfly;
mod short;
mod transform;

pub(crate) use butterfly::{Z, four};
pub use transform::{Eight, Fourier, Places};
