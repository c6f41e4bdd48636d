//! Lengths, tables and stages of the transforms.
//!
//! ```text
//! forward: for j₂ in 0 .. n₂: column j₂ (stride n₂) → transform of n₁, times e^{−2πi k₁ j₂/n} → the same column
//!          for k₁ in 0 .. n₁: row k₁ (contiguous)   → transform of n₂                       → the same row
//! ```
//! * The twist is part of the last pass.
//! * The backward transform is the forward one with real and imaginary parts exchanged on loads and stores.

use super::short::{Run, Short, root, short_transform};
use crate::error::Error;
use crate::simd::{Aligned, Lanes, Level};

/// One value of eight sequences: real parts, imaginary parts.
pub type Eight = Aligned<2>;

/// Transforms of one length, eight sequences at once; the memory is the caller's.
///
/// ```
/// use dust3d_kernels::fourier::{Eight, Fourier};
/// use dust3d_kernels::simd::Level;
/// let fourier = Fourier::new(12).unwrap();
/// let mut table = [[0.0; 2]; 64];
/// fourier.fill_table(&mut table);
/// let mut x = [Eight::default(); 12];
/// let mut scratch = [Eight::default(); 16];
/// x[1].0[0] = [1.0; 8];
/// fourier.forward(Level::detect(), &table, &mut x, &mut scratch).unwrap();
/// // e^{−2πi 3/12} = −i
/// assert!((x[fourier.position(3)].0[1][5] + 1.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Fourier {
    columns: Short,
    rows: Short,
}

/// A walk through the places of consecutive harmonics.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    row: usize,
    column: usize,
    rows: usize,
    columns: usize,
}

impl Places {
    /// The place of the harmonic in hand; goes on to the next.
    #[inline(always)]
    pub const fn step(&mut self) -> usize {
        let place = self.row * self.columns + self.column;
        self.row += 1;
        if self.row == self.rows {
            self.row = 0;
            self.column += 1;
        }
        place
    }

    /// The place of the harmonic in hand; goes back to the one before.
    #[inline(always)]
    pub const fn step_back(&mut self) -> usize {
        let place = self.row * self.columns + self.column;
        if self.row == 0 {
            self.row = self.rows;
            self.column = self.column.wrapping_sub(1);
        }
        self.row -= 1;
        place
    }
}

impl Fourier {
    /// Transforms of length `n`; none unless 1 ≤ n < 2^32 has no prime factor above 7.
    #[must_use]
    pub fn new(n: usize) -> Option<Self> {
        if n == 0 || n >> 32 != 0 {
            return None;
        }
        // the greatest divisor up to √n
        let mut columns = 1;
        let mut d = 1;
        while d * d <= n {
            if n.is_multiple_of(d) {
                columns = d;
            }
            d += 1;
        }
        Some(Self {
            columns: Short::new(columns)?,
            rows: Short::new(n / columns)?,
        })
    }

    /// The least even length of at least `least` with prime factors up to 7.
    #[must_use]
    pub fn good_length(least: usize) -> usize {
        let mut n = least.max(2).next_multiple_of(2);
        loop {
            let mut rest = n;
            for p in [2, 3, 5, 7] {
                while rest.is_multiple_of(p) {
                    rest /= p;
                }
            }
            if rest == 1 {
                return n;
            }
            n += 2;
        }
    }

    /// An even length of at least `least`, at most a sixteenth more, that takes the least [`work`](Self::work).
    #[must_use]
    pub fn quick_length(least: usize) -> usize {
        let mut best = Self::good_length(least);
        let mut work = usize::MAX;
        let mut n = best;
        while n <= best.max(least + least / 16) {
            if let Some(fourier) = Self::new(n)
                && fourier.work() < work
            {
                (best, work) = (n, fourier.work());
            }
            n = Self::good_length(n + 2);
        }
        best
    }

    /// Vector operations of a transform, roughly.
    #[must_use]
    pub fn work(&self) -> usize {
        self.len() * (self.columns.work() + self.rows.work()) / 10
    }

    /// n.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.columns.len * self.rows.len
    }

    /// Never: lengths are positive.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        false
    }

    /// Entries of the table of roots.
    #[must_use]
    pub fn table_len(&self) -> usize {
        self.columns.table_len() + self.rows.table_len() + self.len()
    }

    /// Entries of the scratch.
    #[must_use]
    pub fn scratch_len(&self) -> usize {
        2 * self.columns.len.max(self.rows.len)
    }

    /// Fills the table of roots; one shorter than [`table_len`](Self::table_len) is refused by the transforms.
    pub fn fill_table(&self, table: &mut [[f64; 2]]) {
        let (c, r) = (self.columns.table_len(), self.rows.table_len());
        if table.len() < self.table_len() {
            return;
        }
        let (columns, rest) = table.split_at_mut(c);
        let (rows, twist) = rest.split_at_mut(r);
        self.columns.fill(columns);
        self.rows.fill(rows);
        for (k, row) in twist.chunks_exact_mut(self.rows.len).enumerate() {
            for (j, to) in row.iter_mut().enumerate().take(self.rows.len) {
                *to = root(k * j, self.len());
            }
        }
    }

    /// Place of harmonic k < n.
    #[must_use]
    #[inline]
    pub const fn position(&self, k: usize) -> usize {
        k % self.columns.len * self.rows.len + k / self.columns.len
    }

    /// Places of harmonics k, k + 1, …: without the divisions of [`position`](Self::position).
    #[must_use]
    #[inline(always)]
    pub const fn places(&self, k: usize) -> Places {
        Places {
            row: k % self.columns.len,
            column: k / self.columns.len,
            rows: self.columns.len,
            columns: self.rows.len,
        }
    }

    /// Rows and columns of the arrangement: harmonic k₁ + rows · k₂ at k₁ · columns + k₂.
    #[must_use]
    pub const fn shape(&self) -> (usize, usize) {
        (self.columns.len, self.rows.len)
    }

    /// Rows first or columns, real and imaginary parts exchanged or not.
    fn run(
        &self,
        level: Level,
        table: &[[f64; 2]],
        data: &mut [Eight],
        scratch: &mut [Eight],
        (rows_first, swap): (bool, usize),
    ) -> Result<(), Error> {
        Error::check_len("sequences", self.len(), data.len())?;
        Error::check_scratch("table of roots", self.table_len(), table.len())?;
        Error::check_scratch("scratch", self.scratch_len(), scratch.len())?;
        if swap == 0 {
            crate::dispatch!(level, |token: L| both::<L, 0>(
                token, self, table, data, scratch, rows_first
            ));
        } else {
            crate::dispatch!(level, |token: L| both::<L, 1>(
                token, self, table, data, scratch, rows_first
            ));
        }
        Ok(())
    }

    /// X_k = Σ_j x_j e^{−2πi jk/n}: `data` in order → harmonic k at [`position`](Self::position)(k).
    ///
    /// # Errors
    /// [`Error::Length`] unless `data` has n entries, `table` and `scratch` at least theirs.
    pub fn forward(
        &self,
        level: Level,
        table: &[[f64; 2]],
        data: &mut [Eight],
        scratch: &mut [Eight],
    ) -> Result<(), Error> {
        self.run(level, table, data, scratch, (false, 0))
    }

    /// x_j = Σ_k X_k e^{+2πi jk/n}: harmonic k at [`position`](Self::position)(k) → `data` in order; not divided by n.
    ///
    /// # Errors
    /// As [`forward`](Self::forward).
    pub fn backward(
        &self,
        level: Level,
        table: &[[f64; 2]],
        data: &mut [Eight],
        scratch: &mut [Eight],
    ) -> Result<(), Error> {
        self.run(level, table, data, scratch, (true, 1))
    }

    /// [`forward`](Self::forward) the other way round: position(j) holds x_j, and the harmonics come out in order.
    ///
    /// # Errors
    /// As [`forward`](Self::forward).
    pub fn forward_ordered(
        &self,
        level: Level,
        table: &[[f64; 2]],
        data: &mut [Eight],
        scratch: &mut [Eight],
    ) -> Result<(), Error> {
        self.run(level, table, data, scratch, (true, 0))
    }

    /// [`backward`](Self::backward) with harmonics in order, and x_j at position(j).
    ///
    /// # Errors
    /// As [`forward`](Self::forward).
    pub fn backward_ordered(
        &self,
        level: Level,
        table: &[[f64; 2]],
        data: &mut [Eight],
        scratch: &mut [Eight],
    ) -> Result<(), Error> {
        self.run(level, table, data, scratch, (false, 1))
    }
}

/// Columns and rows; rows first leave the result in order. SWAP 1 exchanges real and imaginary parts.
#[inline(always)]
fn both<L: Lanes, const SWAP: usize>(
    token: L::Token,
    fourier: &Fourier,
    table: &[[f64; 2]],
    data: &mut [Eight],
    scratch: &mut [Eight],
    rows_first: bool,
) {
    let (columns, rows) = (&fourier.columns, &fourier.rows);
    let (column_table, rest) = table.split_at(columns.table_len());
    let (row_table, twist) = rest.split_at(rows.table_len());
    // the two stages, the first with the twist
    for stage in 0..2 {
        let by_rows = (stage == 0) == rows_first;
        let (short, roots, outer) = if by_rows {
            (rows, row_table, columns.len)
        } else {
            (columns, column_table, rows.len)
        };
        for k in 0..outer {
            let run = if by_rows {
                Run {
                    first: k * rows.len,
                    step: 1,
                }
            } else {
                Run {
                    first: k,
                    step: rows.len,
                }
            };
            let twist = (stage == 0).then_some(twist);
            short_transform::<L, SWAP>(token, short, roots, twist, data, run, scratch);
        }
    }
}
