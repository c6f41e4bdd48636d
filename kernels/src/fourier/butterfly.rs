//! Transforms of a few values, X_k = Σ_j x_j e^{−2πi jk/R}, eight at once.
//!
//! \[G58\] I. J. Good, J. R. Stat. Soc. B 20, 361 (1958).

use crate::simd::Lanes;

/// A complex number in every lane.
#[derive(Clone, Copy)]
pub(crate) struct Z<L> {
    pub(crate) re: L,
    pub(crate) im: L,
}

impl<L: Lanes> Z<L> {
    #[inline(always)]
    pub(super) fn zero(token: L::Token) -> Self {
        let zero = L::splat(token, 0.0);
        Self { re: zero, im: zero }
    }
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self {
            re: self.re + o.re,
            im: self.im + o.im,
        }
    }
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self {
            re: self.re - o.re,
            im: self.im - o.im,
        }
    }
    /// −i z
    #[inline(always)]
    fn back(self) -> Self {
        Self {
            re: self.im,
            im: -self.re,
        }
    }
    /// z w
    #[inline(always)]
    pub(crate) fn times(self, w: Self) -> Self {
        Self {
            re: self.re.mul_sub(w.re, self.im * w.im),
            im: self.re.mul_add(w.im, self.im * w.re),
        }
    }
}

/// The transform of four values.
#[inline(always)]
pub(crate) fn four<L: Lanes>(x: [Z<L>; 4]) -> [Z<L>; 4] {
    let (a, b) = (x[0].add(x[2]), x[1].add(x[3]));
    let (c, d) = (x[0].sub(x[2]), x[1].sub(x[3]));
    // c − i d and c + i d without the multiplication
    [
        a.add(b),
        Z {
            re: c.re + d.im,
            im: c.im - d.re,
        },
        a.sub(b),
        Z {
            re: c.re - d.im,
            im: c.im + d.re,
        },
    ]
}

/// Even harmonics are four of sums, odd ones four of differences turned by eighths.
#[inline(always)]
fn eight<L: Lanes>(token: L::Token, x: [Z<L>; 8]) -> [Z<L>; 8] {
    let h = L::splat(token, core::f64::consts::FRAC_1_SQRT_2);
    let even = four([
        x[0].add(x[4]),
        x[1].add(x[5]),
        x[2].add(x[6]),
        x[3].add(x[7]),
    ]);
    let (d1, d3) = (x[1].sub(x[5]), x[3].sub(x[7]));
    let odd = four([
        x[0].sub(x[4]),
        Z {
            re: (d1.re + d1.im) * h,
            im: (d1.im - d1.re) * h,
        },
        x[2].sub(x[6]).back(),
        Z {
            re: (d3.im - d3.re) * h,
            im: (d3.re + d3.im) * -h,
        },
    ]);
    [
        even[0], odd[0], even[1], odd[1], even[2], odd[2], even[3], odd[3],
    ]
}

/// cos and sin of 2πj/R, j = 1 … (R − 1)/2.
const fn roots(radix: usize) -> [[f64; 2]; 3] {
    let mut out = [[0.0; 2]; 3];
    let from: &[[f64; 2]] = match radix {
        3 => &[[-0.5, 0.8660254037844386]],
        5 => &[
            [0.30901699437494745, 0.9510565162951535],
            [-0.8090169943749475, 0.5877852522924731],
        ],
        7 => &[
            [0.6234898018587335, 0.7818314824680298],
            [-0.2225209339563144, 0.9749279121818236],
            [-0.9009688679024191, 0.4338837391175581],
        ],
        _ => &[],
    };
    let mut k = 0;
    while k < from.len() {
        out[k] = from[k];
        k += 1;
    }
    out
}

/// Odd R: harmonics ±k from the sums and differences of x_j and x_{R−j}.
#[inline(always)]
fn odd<L: Lanes, const R: usize>(token: L::Token, x: [Z<L>; R]) -> [Z<L>; R] {
    let roots = const { roots(R) };
    let half = R / 2;
    let (mut sums, mut differences) = (x, x);
    let mut out = x;
    for j in 1..=half {
        sums[j] = x[j].add(x[R - j]);
        differences[j] = x[j].sub(x[R - j]);
        out[0] = out[0].add(sums[j]);
    }
    for k in 1..=half {
        let mut even = x[0];
        let mut odd = Z::zero(token);
        for j in 1..=half {
            let turn = j * k % R;
            let (at, sign) = if turn <= half {
                (turn, 1.0)
            } else {
                (R - turn, -1.0)
            };
            let c = L::splat(token, roots[at - 1][0]);
            let s = L::splat(token, sign * roots[at - 1][1]);
            even.re = sums[j].re.mul_add(c, even.re);
            even.im = sums[j].im.mul_add(c, even.im);
            odd.re = differences[j].re.mul_add(s, odd.re);
            odd.im = differences[j].im.mul_add(s, odd.im);
        }
        out[k] = even.add(odd.back());
        out[R - k] = even.sub(odd.back());
    }
    out
}

/// R = 2P, P odd \[G58\]: sums and differences of x_j and x_{j+P} in an order that needs no twiddles between.
#[inline(always)]
fn twice<L: Lanes, const R: usize, const P: usize>(token: L::Token, x: [Z<L>; R]) -> [Z<L>; R] {
    let zero = Z::zero(token);
    let (mut sums, mut differences) = ([zero; P], [zero; P]);
    for j in 0..P {
        let (a, b) = (x[2 * j % R], x[(2 * j + P) % R]);
        (sums[j], differences[j]) = (a.add(b), a.sub(b));
    }
    let (sums, differences) = (odd(token, sums), odd(token, differences));
    let mut out = x;
    for k in 0..P {
        // the even and the odd harmonic that is k modulo P
        let (even, uneven) = if k % 2 == 0 { (k, k + P) } else { (k + P, k) };
        (out[even], out[uneven]) = (sums[k], differences[k]);
    }
    out
}

/// cos and sin of 2πj/9, j = 1, 2, 4.
const NINTHS: [[f64; 2]; 3] = [
    [0.766044443118978, 0.6427876096865393],
    [0.17364817766693041, 0.984807753012208],
    [-0.9396926207859084, 0.3420201433256687],
];

/// Three of three.
#[inline(always)]
fn nine<L: Lanes>(token: L::Token, x: [Z<L>; 9]) -> [Z<L>; 9] {
    let mut rows = [[Z::zero(token); 3]; 3];
    for j in 0..3 {
        rows[j] = odd(token, [x[j], x[j + 3], x[j + 6]]);
    }
    let mut w = [Z::zero(token); 3];
    for k in 0..3 {
        w[k] = Z {
            re: L::splat(token, NINTHS[k][0]),
            im: L::splat(token, -NINTHS[k][1]),
        };
    }
    rows[1][1] = rows[1][1].times(w[0]);
    rows[1][2] = rows[1][2].times(w[1]);
    rows[2][1] = rows[2][1].times(w[1]);
    rows[2][2] = rows[2][2].times(w[2]);
    let mut out = x;
    for k in 0..3 {
        let y = odd(token, [rows[0][k], rows[1][k], rows[2][k]]);
        for j in 0..3 {
            out[k + 3 * j] = y[j];
        }
    }
    out
}

/// The transform of R values; R one of those in the list of [`super::transform`], anything else comes back as it is.
#[inline(always)]
pub(super) fn butterfly<L: Lanes, const R: usize>(token: L::Token, mut x: [Z<L>; R]) -> [Z<L>; R] {
    if R == 2 {
        let (a, b) = (x[0], x[1]);
        (x[0], x[1]) = (a.add(b), a.sub(b));
        x
    } else if R == 4 {
        if let Some(first) = x.first_chunk_mut::<4>() {
            *first = four(*first);
        }
        x
    } else if R == 8 {
        if let Some(first) = x.first_chunk_mut::<8>() {
            *first = eight(token, *first);
        }
        x
    } else if R == 6 {
        if let Some(first) = x.first_chunk_mut::<6>() {
            *first = twice::<L, 6, 3>(token, *first);
        }
        x
    } else if R == 9 {
        if let Some(first) = x.first_chunk_mut::<9>() {
            *first = nine(token, *first);
        }
        x
    } else if R == 10 {
        if let Some(first) = x.first_chunk_mut::<10>() {
            *first = twice::<L, 10, 5>(token, *first);
        }
        x
    } else {
        odd(token, x)
    }
}
