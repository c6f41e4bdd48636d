//! The level that runs everywhere: `wide::f64x8`, in whatever registers the target was compiled for.

use super::lanes::{Bits, Lanes, Mask, sealed::Sealed};
use crate::bits::spread_bits;
use core::ops::{
    Add, AddAssign, BitAnd, BitOr, BitXor, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};
use wide::f64x8;

/// Token of the portable level; anyone can have one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PortableToken(());

impl PortableToken {
    pub(super) const fn new() -> Self {
        Self(())
    }
}

/// Eight lanes of `wide::f64x8`.
#[derive(Clone, Copy)]
pub struct PortableLanes(f64x8);

/// Mask of [`PortableLanes`]: all bits of a lane set or none.
#[derive(Clone, Copy)]
pub struct PortableMask(f64x8);

/// Eight words as they are.
#[derive(Clone, Copy)]
pub struct PortableBits([u64; 8]);

impl Sealed for PortableLanes {}
impl Sealed for PortableBits {}
impl Sealed for PortableMask {}

macro_rules! operator {
    ($($trait:ident $method:ident $assign_trait:ident $assign:ident;)*) => {$(
        impl $trait for PortableLanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }
        impl $assign_trait for PortableLanes {
            #[inline(always)]
            fn $assign(&mut self, other: Self) {
                self.0 = self.0.$method(other.0);
            }
        }
    )*};
}
operator! {
    Add add AddAssign add_assign;
    Sub sub SubAssign sub_assign;
    Mul mul MulAssign mul_assign;
}

impl Div for PortableLanes {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(self.0 / other.0)
    }
}

impl Neg for PortableLanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Lanes for PortableLanes {
    type Token = PortableToken;
    type Mask = PortableMask;
    type Bits = PortableBits;
    const FUSED: bool = cfg!(target_feature = "fma");

    #[inline(always)]
    fn splat(_: PortableToken, value: f64) -> Self {
        Self(f64x8::splat(value))
    }
    #[inline(always)]
    fn load(_: PortableToken, from: &[f64; 8]) -> Self {
        Self(f64x8::new(*from))
    }
    #[inline(always)]
    fn load_f32(_: PortableToken, from: &[f32; 8]) -> Self {
        Self(f64x8::new(from.map(f64::from)))
    }
    #[inline(always)]
    fn swap_pairs(self) -> Self {
        let [a, b, c, d, e, f, g, h] = self.0.to_array();
        Self(f64x8::new([b, a, d, c, f, e, h, g]))
    }
    #[inline(always)]
    fn store(self, to: &mut [f64; 8]) {
        *to = self.0.to_array();
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(self.0.mul_add(a.0, b.0))
    }
    #[inline(always)]
    fn mul_sub(self, a: Self, b: Self) -> Self {
        Self(self.0.mul_sub(a.0, b.0))
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self(self.0.mul_neg_add(a.0, b.0))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    #[inline(always)]
    fn rough_inverse_sqrt(self) -> Self {
        Self(f64x8::splat(1.0) / self.0.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
    #[inline(always)]
    fn round(self) -> Self {
        // `wide` rounds ties away from zero on some targets; adding 2^52 rounds them to even on all.
        let magnitude = self.0.abs();
        let magic = f64x8::splat(4_503_599_627_370_496.0);
        let rounded = ((magnitude + magic) - magic).copysign(self.0);
        Self(magnitude.simd_lt(magic).select(rounded, self.0))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        let rounded = self.round();
        let above = self.lt(rounded);
        Self::select(above, Self(rounded.0 - f64x8::ONE), rounded)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> PortableMask {
        PortableMask(self.0.simd_lt(other.0))
    }
    #[inline(always)]
    fn le(self, other: Self) -> PortableMask {
        PortableMask(self.0.simd_le(other.0))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> PortableMask {
        PortableMask(self.0.simd_eq(other.0))
    }
    #[inline(always)]
    fn select(mask: PortableMask, yes: Self, no: Self) -> Self {
        Self(mask.0.select(yes.0, no.0))
    }
    #[inline(always)]
    fn to_bits(self) -> PortableBits {
        PortableBits(self.0.to_array().map(f64::to_bits))
    }
    #[inline(always)]
    fn from_bits(bits: PortableBits) -> Self {
        Self(f64x8::new(bits.0.map(f64::from_bits)))
    }
    #[inline(always)]
    fn is_zero(bits: PortableBits) -> PortableMask {
        PortableMask(f64x8::new(
            bits.0
                .map(|v| f64::from_bits(if v == 0 { u64::MAX } else { 0 })),
        ))
    }
    #[inline(always)]
    fn words_lt(a: PortableBits, b: PortableBits) -> PortableMask {
        let mut mask = [0.0; 8];
        for ((m, a), b) in mask.iter_mut().zip(a.0).zip(b.0) {
            *m = f64::from_bits(if a.cast_signed() < b.cast_signed() {
                u64::MAX
            } else {
                0
            });
        }
        PortableMask(f64x8::new(mask))
    }
    #[inline(always)]
    fn exp2_int(self) -> Self {
        let bits = self.to_array().map(|k| {
            let k = (k as i64).clamp(-1022, 1023);
            f64::from_bits(((k + 1023).cast_unsigned()) << 52)
        });
        Self(f64x8::new(bits))
    }
    #[inline(always)]
    fn scale_exp2(self, k: Self) -> Self {
        // Both halves are in the range of `exp2_int` once k is within ±2044 (beyond, the result is 0 or ∞ anyway), and the
        // first product is exact: one rounding.
        let k = k
            .max(Self(f64x8::splat(-2044.0)))
            .min(Self(f64x8::splat(2044.0)));
        let first = Self(k.0 * f64x8::HALF).floor();
        self * first.exp2_int() * (k - first).exp2_int()
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        let a = self.to_array();
        let mantissa = a.map(|x| f64::from_bits((x.to_bits() & MANTISSA) | ONE));
        let exponent = a.map(|x| (x.to_bits() >> 52) as f64 - 1023.0);
        (Self(f64x8::new(mantissa)), Self(f64x8::new(exponent)))
    }
}

const MANTISSA: u64 = (1 << 52) - 1;
const ONE: u64 = 1023 << 52;

impl BitAnd for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for PortableMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for PortableMask {
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
    #[inline(always)]
    fn all(self) -> bool {
        self.bits() == 0xff
    }
    #[inline(always)]
    fn bits(self) -> u8 {
        self.0.to_bitmask() as u8
    }
}

macro_rules! bits_operator {
    ($($trait:ident $method:ident $scalar:path;)*) => {$(
        impl $trait for PortableBits {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for (a, b) in self.0.iter_mut().zip(other.0) {
                    *a = $scalar(*a, b);
                }
                self
            }
        }
    )*};
}
bits_operator! {
    Add add u64::wrapping_add;
    Sub sub u64::wrapping_sub;
    BitAnd bitand BitAnd::bitand;
    BitOr bitor BitOr::bitor;
    BitXor bitxor BitXor::bitxor;
}

impl Bits for PortableBits {
    type Token = PortableToken;

    #[inline(always)]
    fn splat(_: PortableToken, value: u64) -> Self {
        Self([value; 8])
    }
    #[inline(always)]
    fn load(_: PortableToken, from: &[u64; 8]) -> Self {
        Self(*from)
    }
    #[inline(always)]
    fn store(self, to: &mut [u64; 8]) {
        *to = self.0;
    }
    #[inline(always)]
    fn shl<const N: u32>(self) -> Self {
        Self(self.0.map(|v| v << N))
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        Self(self.0.map(|v| v >> N))
    }
    #[inline(always)]
    fn shr_by(self, count: Self) -> Self {
        let mut out = self.0;
        for (v, count) in out.iter_mut().zip(count.0) {
            *v >>= count & 63;
        }
        Self(out)
    }
    #[inline(always)]
    fn mul_low(self, other: Self) -> Self {
        let mut out = self.0;
        for (a, b) in out.iter_mut().zip(other.0) {
            *a = (*a & 0xffff_ffff) * (b & 0xffff_ffff);
        }
        Self(out)
    }
    #[inline(always)]
    fn lookup(self, table: &[u64; 16]) -> Self {
        Self(self.0.map(|v| table[(v & 15) as usize]))
    }
    #[inline(always)]
    fn interleave(self, odd: Self) -> Self {
        let mut out = self.0;
        for (a, b) in out.iter_mut().zip(odd.0) {
            *a = spread_bits(*a) | (spread_bits(b) << 1);
        }
        Self(out)
    }
    #[inline(always)]
    fn unspread_bytes(self) -> Self {
        Self(self.0.map(|v| {
            let [a, b, c, d, e, f, g, h] = v.to_le_bytes();
            u64::from_le_bytes([a, c, e, g, b, d, f, h])
        }))
    }
}
