//! Pairs of rings, north and south, eight at a time.
//!
//! Everything is derived from u = sin²(θ/2) = (1 − cos θ)/2, which HEALPix rings have as a ratio of integers and which
//! keeps all its digits at the pole: sin²θ = 4u(1 − u), cos θ = 1 − 2u. The error of transforms near the poles is
//! commonly the rounding of cos θ; it does not occur here.

use super::double::Double;
use crate::error::Error;
use crate::scalar;

/// Functions below e^−41.5 = 1e−18 are left out.
const NEGLIGIBLE: f64 = 41.5;

/// Eight pairs of rings (θ, π − θ), θ ≤ π/2, ordered towards the equator, and what the inner loops need of them.
///
/// Where fewer are left, the last pair is repeated.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct RingBlock {
    /// Variable of the two-degree recurrence: cos²θ, or −sin²θ if [`polar`](Self::polar).
    pub y: [f64; 8],
    /// cos θ
    pub cos: [f64; 8],
    /// 1/sin²θ
    pub inv_sin2: [f64; 8],
    /// −(1 − cos θ)
    pub minus_versine: [f64; 8],
    /// log2 sin θ, a multiple of 2^−30 and the rest.
    pub log_sin: [[f64; 8]; 2],
    /// log2 sin θ/2, likewise.
    pub log_sin_half: [[f64; 8]; 2],
    /// log2 cos θ/2, likewise.
    pub log_cos_half: [[f64; 8]; 2],
    /// Orders above this contribute less than 1e−18 to any of the rings, for degrees up to the lmax given.
    pub m_limit: usize,
    /// Nearer to the pole than 45°: the recurrence runs in −sin²θ.
    pub polar: bool,
    /// The least sin²θ.
    pub sin2_min: f64,
}

impl Default for RingBlock {
    fn default() -> Self {
        Self {
            y: [0.0; 8],
            cos: [0.0; 8],
            inv_sin2: [1.0; 8],
            minus_versine: [-1.0; 8],
            log_sin: [[0.0; 8]; 2],
            log_sin_half: [[0.0; 8]; 2],
            log_cos_half: [[0.0; 8]; 2],
            m_limit: 0,
            polar: false,
            sin2_min: 1.0,
        }
    }
}

/// A logarithm as a multiple of 2^−30, exact when multiplied by an order, and the rest.
fn in_two(x: Double) -> (f64, f64) {
    let hi = scalar::rint(x.hi * 1_073_741_824.0) / 1_073_741_824.0;
    (hi, (x.hi - hi) + x.lo)
}

impl RingBlock {
    /// Eight colatitudes 0 < θ ≤ π/2 in radians, in ascending order, taken as exact.
    ///
    /// Accurate to the last digit of θ at any distance from the pole. `lmax` sets [`m_limit`](Self::m_limit).
    ///
    /// # Errors
    /// [`Error::Domain`] for any other colatitude.
    pub fn from_colatitudes(theta_rad: &[f64; 8], lmax: usize) -> Result<Self, Error> {
        let mut u = [Double::from(0.5); 8];
        for (u, &theta) in u.iter_mut().zip(theta_rad) {
            if !(theta > 1e-140 && theta <= core::f64::consts::FRAC_PI_2) {
                return Err(Error::Domain {
                    what: "colatitude, above 0 and at most π/2",
                    value: theta,
                });
            }
            let s = sine(0.5 * theta);
            *u = s.mul(s);
        }
        Ok(Self::from_half_angle(&u, lmax))
    }

    /// From u = sin²(θ/2), 0 < u ≤ 1/2.
    fn from_half_angle(u: &[Double; 8], lmax: usize) -> Self {
        let mut block = Self::default();
        let one = Double::from(1.0);
        let sin2_of = |u: Double| u.mul(one.add(u.neg())).mul(Double::from(4.0));
        block.polar = sin2_of(u[0]).value() <= 0.5;
        block.sin2_min = sin2_of(u[0]).value();
        for (lane, &u) in u.iter().enumerate() {
            let rest = one.add(u.neg());
            let sin2 = sin2_of(u);
            let cos = one.add(u.mul(Double::from(-2.0)));
            block.cos[lane] = cos.value();
            block.y[lane] = if block.polar {
                -sin2.value()
            } else {
                cos.mul(cos).value()
            };
            block.inv_sin2[lane] = one.div(sin2).value();
            block.minus_versine[lane] = -2.0 * u.value();
            let half = |x: Double| x.mul(Double::from(0.5));
            let (log_u, log_rest) = (half(u.log2()), half(rest.log2()));
            let log_sin = one.add(log_u.add(log_rest));
            for (to, x) in [
                (&mut block.log_sin, log_sin),
                (&mut block.log_sin_half, log_u),
                (&mut block.log_cos_half, log_rest),
            ] {
                (to[0][lane], to[1][lane]) = in_two(x);
            }
            block.m_limit =
                block
                    .m_limit
                    .max(m_limit(lmax, scalar::sqrt(sin2.value()), cos.value()));
            block.sin2_min = block.sin2_min.min(sin2.value());
        }
        block
    }
}

/// sin x for 0 ≤ x ≤ π/4 by its series in double-double.
fn sine(x: f64) -> Double {
    let x2 = Double::product(x, x);
    let mut sum = Double::from(1.0);
    let mut k = 31.0;
    while k > 1.0 {
        // 1 − x²/(k(k−1)) · (…)
        let term = x2.div(Double::from(-k * (k - 1.0)));
        sum = Double::from(1.0).add(term.mul(sum));
        k -= 2.0;
    }
    sum.mul(Double::from(x))
}

/// The greatest order m ≤ lmax with λ_lm(θ) > e^−41.5 for some l ≤ lmax.
///
/// Beyond the turning point m = l sin θ the functions fall as e^−S, S = ∫ √(m²/sin² − l²) dθ
/// = m artanh(w/(m cos θ)) − l artanh(w/(l cos θ)), w² = m² − l² sin²θ (WKB with l + 1/2 for l). The spin-2 functions
/// reach two orders further, hence l + 5/2.
fn m_limit(lmax: usize, sin: f64, cos: f64) -> usize {
    let ell = lmax as f64 + 2.5;
    let artanh = |x: f64| 0.5 * (scalar::ln_1p(x) - scalar::ln_1p(-x));
    let negligible = |m: f64| {
        let w2 = m * m - ell * ell * sin * sin;
        if w2 <= 0.0 || cos <= 0.0 {
            return false;
        }
        let w = scalar::sqrt(w2);
        m * artanh((w / (m * cos)).min(1.0)) - ell * artanh((w / (ell * cos)).min(1.0)) > NEGLIGIBLE
    };
    let (mut low, mut high) = (0, lmax + 1);
    // low is needed, high is not (or beyond lmax)
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if negligible(middle as f64) {
            high = middle;
        } else {
            low = middle;
        }
    }
    (low + 2).min(lmax)
}

/// Ring pair number `pair` (0 at the pole, 2 nside − 1 the equator) of a HEALPix map \[G05\].
///
/// (first northern pixel, first southern pixel, pixels per ring, φ of the first pixel in units of π/(4·`pixels/4`));
/// for the equator both are the same ring.
#[must_use]
pub const fn healpix_ring(nside: u64, pair: u64) -> (u64, u64, u64, bool) {
    let i = pair + 1;
    let npix = 12 * nside * nside;
    if i < nside {
        let first = 2 * i * (i - 1);
        (first, npix - first - 4 * i, 4 * i, true)
    } else {
        let first = 2 * nside * (nside - 1) + (i - nside) * 4 * nside;
        (
            first,
            npix - first - 4 * nside,
            4 * nside,
            (i - nside).is_multiple_of(2),
        )
    }
}

/// Number of [`RingBlock`]s of a HEALPix map.
#[must_use]
pub const fn ring_block_count(nside: u64) -> usize {
    (2 * nside).div_ceil(8) as usize
}

/// The rings of a HEALPix map \[G05\]: u = i²/(6 nside²) in the caps, (2i − nside)/(6 nside) in the belt.
///
/// # Errors
/// [`Error::Length`] unless `out` has [`ring_block_count`] entries; [`Error::Nside`] for 0 or more than 2^20.
pub fn ring_blocks(nside: u64, lmax: usize, out: &mut [RingBlock]) -> Result<(), Error> {
    if nside == 0 || nside > 1 << 20 {
        return Err(Error::Nside { nside });
    }
    Error::check_len("ring blocks", ring_block_count(nside), out.len())?;
    for (b, block) in (0u64..).zip(out.iter_mut()) {
        let mut u = [Double::from(0.5); 8];
        for (lane, u) in (0u64..).zip(u.iter_mut()) {
            *u = healpix_half_angle(nside, (8 * b + lane).min(2 * nside - 1));
        }
        *block = RingBlock::from_half_angle(&u, lmax);
    }
    Ok(())
}

/// sin²(θ/2) of a HEALPix ring pair.
pub(super) fn healpix_half_angle(nside: u64, pair: u64) -> Double {
    let (i, n) = (pair + 1, nside as f64);
    let (above, below) = if i < nside {
        ((i * i) as f64, 6.0 * n * n)
    } else {
        ((2 * i - nside) as f64, 6.0 * n)
    };
    Double::from(above).div(Double::from(below))
}

/// θ/2 from sin²(θ/2) ≤ 1/2, by a step of Newton's method.
pub(super) fn half_angle(u: Double) -> Double {
    let s = u.sqrt();
    let first = scalar::asin(s.value());
    let rest = s.add(sine(first).neg()).value() / scalar::cos(first);
    Double::from(first).add(Double::from(rest))
}

/// The rings θ_j = (j + ½)π/n, j = 0 … n/2 − 1, and their southern partners; n even.
///
/// # Errors
/// [`Error::Length`] unless `out` has n/16 entries, rounded up; [`Error::Domain`] for n odd or zero.
pub fn equidistant_ring_blocks(n: usize, lmax: usize, out: &mut [RingBlock]) -> Result<(), Error> {
    if n == 0 || !n.is_multiple_of(2) {
        return Err(Error::Domain {
            what: "number of equidistant rings, even",
            value: n as f64,
        });
    }
    Error::check_len("ring blocks", n.div_ceil(16), out.len())?;
    let pi = Double {
        hi: core::f64::consts::PI,
        lo: 1.224_646_799_147_353_2e-16,
    };
    for (b, block) in out.iter_mut().enumerate() {
        let mut u = [Double::from(0.5); 8];
        for (lane, u) in u.iter_mut().enumerate() {
            let j = (8 * b + lane).min(n / 2 - 1);
            let x = pi
                .mul(Double::from((2 * j + 1) as f64))
                .div(Double::from((4 * n) as f64));
            // sin(hi + lo) = sin hi + lo cos hi
            let s = sine(x.hi).add(Double::from(x.lo * scalar::cos(x.hi)));
            *u = s.mul(s);
        }
        *block = RingBlock::from_half_angle(&u, lmax);
    }
    Ok(())
}
