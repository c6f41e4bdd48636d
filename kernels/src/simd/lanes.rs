//! The lane trait that kernels are written against.

use super::aligned::Aligned;
use core::ops::{
    Add, AddAssign, BitAnd, BitOr, BitXor, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

pub(super) mod sealed {
    /// Only this crate implements the lane traits.
    pub trait Sealed {}
}

/// The outcome of eight comparisons.
pub trait Mask:
    sealed::Sealed + Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// Is any lane set?
    fn any(self) -> bool;
    /// Are all lanes set?
    fn all(self) -> bool;
    /// Lane i as bit i.
    fn bits(self) -> u8;
}

/// Eight f64 values, one operation on each.
///
/// Operators are IEEE 754 operations lane by lane. A value can only be made with the `Token` that proves that the CPU
/// has the instructions.
pub trait Lanes:
    sealed::Sealed
    + Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// Proof that the CPU can run these lanes.
    type Token: Copy;
    /// Result of a comparison.
    type Mask: Mask;
    /// The same eight lanes as 64-bit words.
    type Bits: Bits<Token = Self::Token>;

    /// Does [`mul_add`](Self::mul_add) round once?
    const FUSED: bool;

    /// The same value in all lanes.
    fn splat(token: Self::Token, value: f64) -> Self;
    /// Eight values from memory, lane i from index i.
    fn load(token: Self::Token, from: &[f64; 8]) -> Self;
    /// Eight values from memory, in f32 there.
    fn load_f32(token: Self::Token, from: &[f32; 8]) -> Self;
    /// Eight values to memory.
    fn store(self, to: &mut [f64; 8]);
    /// Vectors to memory, past the caches where the CPU can.
    ///
    /// # Safety
    /// Nothing may look at the memory before this thread has called [`fence`](Self::fence).
    #[allow(
        unsafe_code,
        reason = "the memory is in an unusual state until the fence"
    )]
    #[inline(always)]
    unsafe fn stream<const N: usize>(values: [Self; N], to: &mut Aligned<N>) {
        for k in 0..N {
            values[k].store(&mut to[k]);
        }
    }
    /// Makes all that was [streamed](Self::stream) visible.
    #[inline(always)]
    fn fence(_token: Self::Token) {}
    /// Asks for the cache line where a value begins that will be loaded soon.
    #[inline(always)]
    fn prefetch<T>(_token: Self::Token, _from: &T) {}
    /// All lanes as an array.
    #[inline(always)]
    fn to_array(self) -> [f64; 8] {
        let mut out = [0.0; 8];
        self.store(&mut out);
        out
    }
    /// Four values from memory, each in two lanes: 0 0 1 1 2 2 3 3.
    #[inline(always)]
    fn load_twice(token: Self::Token, from: &[f64; 4]) -> Self {
        let [a, b, c, d] = *from;
        Self::load(token, &[a, a, b, b, c, c, d, d])
    }
    /// Neighbours exchanged: lanes 1 0 3 2 5 4 7 6.
    fn swap_pairs(self) -> Self;
    /// Up to eight values from a slice; the lanes beyond its end repeat `pad`.
    #[inline(always)]
    fn load_padded(token: Self::Token, from: &[f64], pad: f64) -> Self {
        match from.first_chunk::<8>() {
            Some(chunk) => Self::load(token, chunk),
            None => {
                let mut a = [pad; 8];
                for (a, &x) in a.iter_mut().zip(from) {
                    *a = x;
                }
                Self::load(token, &a)
            }
        }
    }
    /// Stores the first `to.len()` lanes, eight at most.
    #[inline(always)]
    fn store_padded(self, to: &mut [f64]) {
        match to.first_chunk_mut::<8>() {
            Some(chunk) => self.store(chunk),
            None => {
                for (t, x) in to.iter_mut().zip(self.to_array()) {
                    *t = x;
                }
            }
        }
    }

    /// `self · a + b`, rounded once where [`FUSED`](Self::FUSED).
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `self · a − b`, rounded once where [`FUSED`](Self::FUSED).
    fn mul_sub(self, a: Self, b: Self) -> Self;
    /// `b − self · a`, rounded once where [`FUSED`](Self::FUSED).
    fn neg_mul_add(self, a: Self, b: Self) -> Self;
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// 1/√self to within 2^-13.9 of itself, for 2^-100 … 2^100; NaN below zero, anything elsewhere. Levels differ.
    fn rough_inverse_sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The lesser; `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// The greater; `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    /// The nearest integer, ties to even.
    fn round(self) -> Self;
    /// The greatest integer not above.
    fn floor(self) -> Self;

    /// `self < other`; false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self ≤ other`; false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `self == other`; false for NaN.
    fn eq(self, other: Self) -> Self::Mask;
    /// `self > other`; false for NaN.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// `self ≥ other`; false for NaN.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// Where the mask is set `yes`, elsewhere `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// The bits of every lane.
    fn to_bits(self) -> Self::Bits;
    /// Lanes of given bits.
    fn from_bits(bits: Self::Bits) -> Self;
    /// Which words are zero.
    fn is_zero(bits: Self::Bits) -> Self::Mask;
    /// Words below 2^63: `a < b`.
    fn words_lt(a: Self::Bits, b: Self::Bits) -> Self::Mask;
    /// Where the mask is set `yes`, elsewhere `no`.
    #[inline(always)]
    fn select_words(mask: Self::Mask, yes: Self::Bits, no: Self::Bits) -> Self::Bits {
        Self::select(mask, Self::from_bits(yes), Self::from_bits(no)).to_bits()
    }
    /// Whole numbers below 2^52 as f64.
    #[inline(always)]
    fn from_whole(token: Self::Token, whole: Self::Bits) -> Self {
        // 2^52 + k holds k in its low mantissa bits: AVX2 has no conversion of 64-bit integers.
        let magic = Self::Bits::splat(token, TWO_52.to_bits());
        Self::from_bits(whole | magic) - Self::splat(token, TWO_52)
    }
    /// Whole numbers 0 … 2^52 − 1 as 64-bit words; anything else gives an unspecified value.
    #[inline(always)]
    fn to_whole(self, token: Self::Token) -> Self::Bits {
        let magic = Self::Bits::splat(token, TWO_52.to_bits());
        (self + Self::splat(token, TWO_52)).to_bits() ^ magic
    }

    /// 2^self for integers −1022 … 1023; below, something in 0 … 2^−1022; above and for anything else unspecified.
    fn exp2_int(self) -> Self;
    /// self · 2^k for any integer k, overflowing to infinity and underflowing gradually, rounded once for `self` of
    /// ordinary size (2^±500).
    fn scale_exp2(self, k: Self) -> Self;
    /// For positive normal values: (m, e) with self = m·2^e, 1 ≤ m < 2, both as f64.
    fn split_exponent(self) -> (Self, Self);

    /// Rows to columns: lane j of row i to lane i of row j.
    #[inline(always)]
    fn transpose(token: Self::Token, rows: [Self; 8]) -> [Self; 8] {
        let mut from = [[0.0; 8]; 8];
        for i in 0..8 {
            rows[i].store(&mut from[i]);
        }
        let mut out = rows;
        for j in 0..8 {
            let mut column = [0.0; 8];
            for i in 0..8 {
                column[i] = from[i][j];
            }
            out[j] = Self::load(token, &column);
        }
        out
    }

    /// The sum of all lanes, always as ((0+4)+(2+6)) + ((1+5)+(3+7)).
    #[inline(always)]
    fn reduce_sum(self) -> f64 {
        let a = self.to_array();
        ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]))
    }
    /// [`reduce_sum`](Self::reduce_sum) of four vectors, with the same bits.
    #[inline(always)]
    fn reduce_sums(of: [Self; 4]) -> [f64; 4] {
        let [a, b, c, d] = of;
        [
            a.reduce_sum(),
            b.reduce_sum(),
            c.reduce_sum(),
            d.reduce_sum(),
        ]
    }
    /// [`reduce_sum`](Self::reduce_sum) of eight vectors, with the same bits.
    #[inline(always)]
    fn reduce_eight(of: [Self; 8]) -> [f64; 8] {
        let [a, b, c, d, e, f, g, h] = of;
        let [a, b, c, d] = Self::reduce_sums([a, b, c, d]);
        let [e, f, g, h] = Self::reduce_sums([e, f, g, h]);
        [a, b, c, d, e, f, g, h]
    }
    /// The greatest lane; NaN lanes are passed over unless all are.
    #[inline(always)]
    fn reduce_max(self) -> f64 {
        self.to_array().into_iter().fold(f64::NAN, f64::max)
    }
}

/// 2^52.
const TWO_52: f64 = 4_503_599_627_370_496.0;

/// Eight 64-bit words; sums wrap.
pub trait Bits:
    sealed::Sealed
    + Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
{
    /// Proof that the CPU can run these lanes.
    type Token: Copy;

    /// The same word in all lanes.
    fn splat(token: Self::Token, value: u64) -> Self;
    /// Eight words from memory, lane i from index i.
    fn load(token: Self::Token, from: &[u64; 8]) -> Self;
    /// Eight words to memory.
    fn store(self, to: &mut [u64; 8]);
    /// All lanes as an array.
    #[inline(always)]
    fn to_array(self) -> [u64; 8] {
        let mut out = [0; 8];
        self.store(&mut out);
        out
    }
    /// Shifted towards the high bits by N < 64.
    fn shl<const N: u32>(self) -> Self;
    /// Shifted towards the low bits by N < 64, zeros coming in.
    fn shr<const N: u32>(self) -> Self;
    /// Shifted towards the low bits by a count below 64, lane by lane, zeros coming in.
    fn shr_by(self, count: Self) -> Self;
    /// The product of the low halves.
    fn mul_low(self, other: Self) -> Self;
    /// The entry of a table that every lane's four low bits name.
    fn lookup(self, table: &[u64; 16]) -> Self;
    /// self ^ a ^ b.
    #[inline(always)]
    fn xor3(self, a: Self, b: Self) -> Self {
        self ^ a ^ b
    }
    /// Bytes 0, 2, 4, 6, 1, 3, 5, 7 of every lane to places 0 … 7.
    fn unspread_bytes(self) -> Self;
    /// The low half of every lane to its even bits, that of `odd` to its odd bits; the high halves are zero.
    fn interleave(self, odd: Self) -> Self;

    /// The even bits of every lane to its low half, the odd bits to its high half.
    #[inline(always)]
    fn deinterleave(self, token: Self::Token) -> Self {
        let v = swap_bits::<Self, 1>(token, self, 0x2222_2222_2222_2222);
        let v = swap_bits::<Self, 2>(token, v, 0x0c0c_0c0c_0c0c_0c0c);
        swap_bits::<Self, 4>(token, v, 0x00f0_00f0_00f0_00f0).unspread_bytes()
    }
}

/// Exchanges the bits under the mask with those N places above them.
#[inline(always)]
fn swap_bits<B: Bits, const N: u32>(token: B::Token, v: B, mask: u64) -> B {
    let t = (v ^ v.shr::<N>()) & B::splat(token, mask);
    v.xor3(t, t.shl::<N>())
}
