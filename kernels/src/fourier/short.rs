//! Short transforms, which run in the first-level cache: rows and columns of the long ones.
//!
//! ```text
//! short transform of N = R₁ R₂ …, from memory through two buffers:
//!          for each radix R, m = what is left of N after it, s = product of those before:
//!            for p in 0 .. m, q in 0 .. s:
//!              y[q + s (R p + k)] ← e^{−2πi p k/(m R)} (transform of x[q + s (p + m j)], j = 0 … R−1)_k
//! ```
//! * The first pass reads from the data, the last writes to them: one load and one store of each value per short
//!   transform outside the first-level cache.
//! * Twiddles are scalars, broadcast: all lanes are at the same harmonic.
//! * *Few passes:* radices 6, 9 and 10 besides the small ones, for every pass takes all values through the cache once more.
//! * *Direction and twist are constants* of the loops: looked up for every value they took a tenth of the time.

use super::butterfly::{Z, butterfly};
use super::transform::Eight;
use crate::scalar;
use crate::simd::Lanes;

/// Most radices a short transform can have: its length is below 2^32.
const MOST: usize = 32;
/// Radices there are.
const RADICES: &[u8] = &[10, 9, 8, 7, 6, 5, 4, 3, 2];

/// A short transform: rows or columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Short {
    pub(super) len: usize,
    radices: [u8; MOST],
    count: usize,
}

impl Short {
    pub(super) fn new(len: usize) -> Option<Self> {
        let short = Self {
            len,
            radices: [0; MOST],
            count: 0,
        };
        let mut best = None;
        short.search(len, RADICES, 0, &mut best);
        Some(best?.1)
    }

    /// Goes through the products of radices, in falling order, that give what is left of the length; keeps the one of fewest
    /// passes, each of which takes all values through the cache, and among these the one of the least sum of radices.
    fn search(
        self,
        rest: usize,
        radices: &[u8],
        sum: usize,
        best: &mut Option<((usize, usize), Self)>,
    ) {
        if rest == 1 {
            let cost = (self.count, sum);
            if best.is_none_or(|(least, _)| cost < least) {
                *best = Some((cost, self));
            }
            return;
        }
        if best.is_some_and(|((passes, _), _)| self.count >= passes) {
            return;
        }
        for (k, &radix) in radices.iter().enumerate() {
            let mut next = self;
            if rest.is_multiple_of(radix.into())
                && let Some(to) = next.radices.get_mut(self.count)
            {
                *to = radix;
                next.count += 1;
                let (rest, radices) = (rest / usize::from(radix), &radices[k..]);
                next.search(rest, radices, sum + usize::from(radix), best);
            }
        }
    }

    /// Tenths of vector operations per value: those of its butterflies, and seven a pass of loads, stores and twiddles.
    pub(super) fn work(&self) -> usize {
        let of = |&radix: &u8| match radix {
            2 => 90,
            3 => 117,
            4 => 110,
            5 => 142,
            6 => 137,
            7 => 164,
            8 => 150,
            9 => 190,
            _ => 162,
        };
        self.radices().iter().map(of).sum()
    }

    fn radices(&self) -> &[u8] {
        self.radices.get(..self.count).unwrap_or(&[])
    }

    /// Twiddles of all passes but the last, whose are one.
    pub(super) fn table_len(&self) -> usize {
        let mut left = self.len;
        let mut sum = 0;
        for &radix in self.radices() {
            left /= usize::from(radix);
            if left > 1 {
                sum += left * (usize::from(radix) - 1);
            }
        }
        sum
    }

    pub(super) fn fill(&self, table: &mut [[f64; 2]]) {
        let mut left = self.len;
        let mut table = table.iter_mut();
        for &radix in self.radices() {
            let whole = left;
            left /= usize::from(radix);
            for p in (0..left).filter(|_| left > 1) {
                for k in 1..usize::from(radix) {
                    if let Some(to) = table.next() {
                        *to = root(p * k, whole);
                    }
                }
            }
        }
    }
}

/// e^{−2πi k/n}, by an angle of at most π/4.
pub(super) fn root(k: usize, n: usize) -> [f64; 2] {
    let k = k % n;
    // eighths of the circle, rounded, and what is left
    let turn = (8 * k + n) / (2 * n);
    let rest = (4 * k) as f64 - (turn * n) as f64;
    let (s, c) = scalar::sin_cos(core::f64::consts::FRAC_PI_2 * (rest / n as f64));
    match turn % 4 {
        0 => [c, -s],
        1 => [-s, -c],
        2 => [-c, s],
        _ => [s, c],
    }
}

/// Where the values of a short transform lie: first, step.
#[derive(Clone, Copy)]
pub(super) struct Run {
    pub(super) first: usize,
    pub(super) step: usize,
}

/// Calls a pass with its radix, and further constants, as constants.
macro_rules! by_radix {
    ($radix:expr, $pass:ident $([$constant:literal])?, $($argument:expr),*) => {
        match $radix {
            2 => $pass::<L, 2, SWAP $(, $constant)?>($($argument),*),
            3 => $pass::<L, 3, SWAP $(, $constant)?>($($argument),*),
            4 => $pass::<L, 4, SWAP $(, $constant)?>($($argument),*),
            5 => $pass::<L, 5, SWAP $(, $constant)?>($($argument),*),
            6 => $pass::<L, 6, SWAP $(, $constant)?>($($argument),*),
            7 => $pass::<L, 7, SWAP $(, $constant)?>($($argument),*),
            8 => $pass::<L, 8, SWAP $(, $constant)?>($($argument),*),
            9 => $pass::<L, 9, SWAP $(, $constant)?>($($argument),*),
            10 => $pass::<L, 10, SWAP $(, $constant)?>($($argument),*),
            _ => {}
        }
    };
}

#[inline(always)]
pub(super) fn short_transform<L: Lanes, const SWAP: usize>(
    token: L::Token,
    short: &Short,
    mut roots: &[[f64; 2]],
    twist: Option<&[[f64; 2]]>,
    data: &mut [Eight],
    run: Run,
    scratch: &mut [Eight],
) {
    if let &[radix] = short.radices() {
        by_radix!(usize::from(radix), alone, token, twist, data, run);
        return;
    }
    let n = short.len;
    let (a, b) = scratch.split_at_mut(n);
    let b = &mut b[..n];
    let (mut from, mut to) = (a, b);
    let (mut left, mut done) = (n, 1);
    let packed = Run { first: 0, step: 1 };
    for (number, &radix) in short.radices().iter().enumerate() {
        let radix = usize::from(radix);
        left /= radix;
        if left > 1 {
            let (own, rest) = roots.split_at(left * (radix - 1));
            roots = rest;
            if number == 0 {
                by_radix!(radix, pass, token, (left, done), own, &*data, run, to);
            } else {
                by_radix!(radix, pass, token, (left, done), own, &*from, packed, to);
            }
        } else if let Some(twist) = twist {
            by_radix!(
                radix,
                last_pass[true],
                token,
                done,
                twist,
                &*from,
                data,
                run
            );
        } else {
            by_radix!(radix, last_pass[false], token, done, &[], &*from, data, run);
        }
        done *= radix;
        core::mem::swap(&mut from, &mut to);
    }
}

#[inline(always)]
fn load<L: Lanes, const SWAP: usize>(token: L::Token, from: &Eight) -> Z<L> {
    Z {
        re: L::load(token, &from[SWAP & 1]),
        im: L::load(token, &from[SWAP & 1 ^ 1]),
    }
}

#[inline(always)]
fn store<L: Lanes, const SWAP: usize>(z: Z<L>, to: &mut Eight) {
    z.re.store(&mut to[SWAP & 1]);
    z.im.store(&mut to[SWAP & 1 ^ 1]);
}

#[inline(always)]
fn splat<L: Lanes>(token: L::Token, w: [f64; 2]) -> Z<L> {
    Z {
        re: L::splat(token, w[0]),
        im: L::splat(token, w[1]),
    }
}

/// A single pass, in place.
#[inline(always)]
fn alone<L: Lanes, const R: usize, const SWAP: usize>(
    token: L::Token,
    twist: Option<&[[f64; 2]]>,
    data: &mut [Eight],
    run: Run,
) {
    let mut x = [Z::zero(token); R];
    for j in 0..R {
        x[j] = load::<L, SWAP>(token, &data[run.first + j * run.step]);
    }
    let y = butterfly::<L, R>(token, x);
    for k in 0..R {
        let at = run.first + k * run.step;
        let z = match twist {
            Some(twist) => y[k].times(splat(token, twist[at])),
            None => y[k],
        };
        store::<L, SWAP>(z, &mut data[at]);
    }
}

/// A pass that is not the last, from a run to a packed buffer.
#[inline(always)]
fn pass<L: Lanes, const R: usize, const SWAP: usize>(
    token: L::Token,
    (left, done): (usize, usize),
    roots: &[[f64; 2]],
    from: &[Eight],
    run: Run,
    to: &mut [Eight],
) {
    let stride = left * done * run.step;
    for p in 0..left {
        let own = &roots[p * (R - 1)..(p + 1) * (R - 1)];
        let out = &mut to[p * done * R..(p + 1) * done * R];
        for q in 0..done {
            let first = run.first + (q + p * done) * run.step;
            let mut x = [Z::zero(token); R];
            for j in 0..R {
                x[j] = load::<L, SWAP>(token, &from[first + j * stride]);
            }
            let y = butterfly::<L, R>(token, x);
            store::<L, SWAP>(y[0], &mut out[q]);
            for k in 1..R {
                let z = y[k].times(splat(token, own[k - 1]));
                store::<L, SWAP>(z, &mut out[q + done * k]);
            }
        }
    }
}

/// The last pass, from a packed buffer to a run; TWISTED: with the twist of that run.
#[inline(always)]
fn last_pass<L: Lanes, const R: usize, const SWAP: usize, const TWISTED: bool>(
    token: L::Token,
    done: usize,
    twist: &[[f64; 2]],
    from: &[Eight],
    to: &mut [Eight],
    run: Run,
) {
    let step = done * run.step;
    for q in 0..done {
        let mut x = [Z::zero(token); R];
        for j in 0..R {
            x[j] = load::<L, SWAP>(token, &from[q + j * done]);
        }
        let y = butterfly::<L, R>(token, x);
        let mut at = run.first + q * run.step;
        for k in 0..R {
            let mut z = y[k];
            if TWISTED {
                z = z.times(splat(token, twist[at]));
            }
            store::<L, SWAP>(z, &mut to[at]);
            at += step;
        }
    }
}
