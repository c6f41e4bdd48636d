//! Eight lanes in one 512-bit register.
//!
//! An [`Avx512Lanes`] exists only through an [`Avx512Token`], and the token only where the CPU has AVX-512 F, DQ, BW,
//! VL and FMA, so every intrinsic here may run. All but loads and stores work on registers alone.

use super::aligned::Aligned;
use super::lanes::{Bits, Lanes, Mask, sealed::Sealed};
use core::arch::x86_64::*;
use core::ops::{
    Add, AddAssign, BitAnd, BitOr, BitXor, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

/// Proof that the CPU has AVX-512 F, DQ, BW, VL and FMA.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Avx512Token(());

impl Avx512Token {
    /// A token if the CPU can run the level.
    #[must_use]
    pub fn detect() -> Option<Self> {
        #[cfg(feature = "std")]
        let there = std::is_x86_feature_detected!("avx512f")
            && std::is_x86_feature_detected!("avx512dq")
            && std::is_x86_feature_detected!("avx512bw")
            && std::is_x86_feature_detected!("avx512vl")
            && std::is_x86_feature_detected!("avx2")
            && std::is_x86_feature_detected!("fma");
        #[cfg(not(feature = "std"))]
        let there = cfg!(all(
            target_feature = "avx512f",
            target_feature = "avx512dq",
            target_feature = "avx512bw",
            target_feature = "avx512vl",
            target_feature = "fma"
        ));
        there.then_some(Self(()))
    }

    /// Runs `f` compiled for this level.
    #[inline(always)]
    pub fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        #[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma")]
        fn inner<R>(f: impl FnOnce() -> R) -> R {
            f()
        }
        // SAFETY: the token proves the features.
        unsafe { inner(f) }
    }
}

/// Eight lanes in a `__m512d`.
#[derive(Clone, Copy)]
pub struct Avx512Lanes(__m512d);

/// Mask of [`Avx512Lanes`].
#[derive(Clone, Copy)]
pub struct Avx512Mask(__mmask8);

/// Eight words in a `__m512i`.
#[derive(Clone, Copy)]
pub struct Avx512Bits(__m512i);

impl Sealed for Avx512Lanes {}
impl Sealed for Avx512Bits {}
impl Sealed for Avx512Mask {}

macro_rules! operator {
    ($($trait:ident $method:ident $assign_trait:ident $assign:ident $intrinsic:ident;)*) => {$(
        impl $trait for Avx512Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: lanes exist only with a token; registers only.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
        impl $assign_trait for Avx512Lanes {
            #[inline(always)]
            fn $assign(&mut self, other: Self) {
                *self = $trait::$method(*self, other);
            }
        }
    )*};
}
operator! {
    Add add AddAssign add_assign _mm512_add_pd;
    Sub sub SubAssign sub_assign _mm512_sub_pd;
    Mul mul MulAssign mul_assign _mm512_mul_pd;
}

impl Div for Avx512Lanes {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_div_pd(self.0, other.0) })
    }
}

impl Neg for Avx512Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_xor_pd(self.0, _mm512_set1_pd(-0.0)) })
    }
}

impl Lanes for Avx512Lanes {
    type Token = Avx512Token;
    type Mask = Avx512Mask;
    type Bits = Avx512Bits;
    const FUSED: bool = true;

    #[inline(always)]
    fn splat(_: Avx512Token, value: f64) -> Self {
        // SAFETY: the token proves the features; registers only.
        Self(unsafe { _mm512_set1_pd(value) })
    }
    #[inline(always)]
    fn load(_: Avx512Token, from: &[f64; 8]) -> Self {
        // SAFETY: the token proves the features; the array is 64 readable bytes, and the load is unaligned.
        Self(unsafe { _mm512_loadu_pd(from.as_ptr()) })
    }
    #[inline(always)]
    fn load_f32(_: Avx512Token, from: &[f32; 8]) -> Self {
        // SAFETY: the token proves the features; the array is 32 readable bytes, and the load is unaligned.
        Self(unsafe { _mm512_cvtps_pd(_mm256_loadu_ps(from.as_ptr())) })
    }
    #[inline(always)]
    fn store(self, to: &mut [f64; 8]) {
        // SAFETY: lanes exist only with a token; the array is 64 writable bytes, and the store is unaligned.
        unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_fmadd_pd(self.0, a.0, b.0) })
    }
    #[inline(always)]
    fn mul_sub(self, a: Self, b: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_fmsub_pd(self.0, a.0, b.0) })
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_fnmadd_pd(self.0, a.0, b.0) })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_sqrt_pd(self.0) })
    }
    #[inline(always)]
    fn rough_inverse_sqrt(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_rsqrt14_pd(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_abs_pd(self.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_min_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_max_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn round(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_roundscale_pd::<0x08>(self.0) })
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_roundscale_pd::<0x09>(self.0) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Avx512Mask {
        // SAFETY: lanes exist only with a token; registers only.
        Avx512Mask(unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> Avx512Mask {
        // SAFETY: lanes exist only with a token; registers only.
        Avx512Mask(unsafe { _mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Avx512Mask {
        // SAFETY: lanes exist only with a token; registers only.
        Avx512Mask(unsafe { _mm512_cmp_pd_mask::<_CMP_EQ_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: Avx512Mask, yes: Self, no: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_mask_blend_pd(mask.0, no.0, yes.0) })
    }
    #[inline(always)]
    fn to_bits(self) -> Avx512Bits {
        // SAFETY: lanes exist only with a token; registers only.
        Avx512Bits(unsafe { _mm512_castpd_si512(self.0) })
    }
    #[inline(always)]
    fn from_bits(bits: Avx512Bits) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_castsi512_pd(bits.0) })
    }
    #[inline(always)]
    fn from_whole(_: Avx512Token, whole: Avx512Bits) -> Self {
        // SAFETY: the token proves the features; registers only.
        Self(unsafe { _mm512_cvtepu64_pd(whole.0) })
    }
    #[inline(always)]
    fn to_whole(self, _: Avx512Token) -> Avx512Bits {
        // SAFETY: the token proves the features; registers only.
        Avx512Bits(unsafe { _mm512_cvtpd_epu64(self.0) })
    }
    #[inline(always)]
    fn is_zero(bits: Avx512Bits) -> Avx512Mask {
        // SAFETY: lanes exist only with a token; registers only.
        Avx512Mask(unsafe { _mm512_testn_epi64_mask(bits.0, bits.0) })
    }
    #[inline(always)]
    fn words_lt(a: Avx512Bits, b: Avx512Bits) -> Avx512Mask {
        // SAFETY: lanes exist only with a token; registers only.
        Avx512Mask(unsafe { _mm512_cmplt_epi64_mask(a.0, b.0) })
    }
    #[inline(always)]
    fn exp2_int(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_scalef_pd(_mm512_set1_pd(1.0), self.0) })
    }
    #[inline(always)]
    fn scale_exp2(self, k: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_scalef_pd(self.0, k.0) })
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe {
            (
                Self(_mm512_getmant_pd::<_MM_MANT_NORM_1_2, _MM_MANT_SIGN_ZERO>(
                    self.0,
                )),
                Self(_mm512_getexp_pd(self.0)),
            )
        }
    }
    #[inline(always)]
    unsafe fn stream<const N: usize>(values: [Self; N], to: &mut Aligned<N>) {
        for k in 0..N {
            // SAFETY: lanes exist only with a token; the array is 64 writable bytes at a multiple of 64; the caller fences.
            unsafe { _mm512_stream_pd(to[k].as_mut_ptr(), values[k].0) }
        }
    }
    #[inline(always)]
    fn fence(_: Avx512Token) {
        // SAFETY: the token proves more than SSE; a fence touches no memory.
        unsafe { _mm_sfence() }
    }
    #[inline(always)]
    fn prefetch<T>(_: Avx512Token, from: &T) {
        // SAFETY: a prefetch reads nothing, and the address is that of a reference.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(core::ptr::from_ref(from).cast()) }
    }
    #[inline(always)]
    fn load_twice(_: Avx512Token, from: &[f64; 4]) -> Self {
        // SAFETY: the token proves the features; the array is 32 readable bytes, and the load is unaligned.
        unsafe {
            let four = _mm512_castpd256_pd512(_mm256_loadu_pd(from.as_ptr()));
            let places = _mm512_setr_epi64(0, 0, 1, 1, 2, 2, 3, 3);
            Self(_mm512_permutexvar_pd(places, four))
        }
    }
    #[inline(always)]
    fn swap_pairs(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe { Self(_mm512_permute_pd::<0b0101_0101>(self.0)) }
    }
    #[inline(always)]
    fn transpose(_: Avx512Token, r: [Self; 8]) -> [Self; 8] {
        // SAFETY: the token proves the features; registers only.
        unsafe {
            // pairs of rows: lanes 0 2 4 6 (low) and 1 3 5 7 (high) of both
            let l0 = _mm512_unpacklo_pd(r[0].0, r[1].0);
            let h0 = _mm512_unpackhi_pd(r[0].0, r[1].0);
            let l1 = _mm512_unpacklo_pd(r[2].0, r[3].0);
            let h1 = _mm512_unpackhi_pd(r[2].0, r[3].0);
            let l2 = _mm512_unpacklo_pd(r[4].0, r[5].0);
            let h2 = _mm512_unpackhi_pd(r[4].0, r[5].0);
            let l3 = _mm512_unpacklo_pd(r[6].0, r[7].0);
            let h3 = _mm512_unpackhi_pd(r[6].0, r[7].0);
            // four rows: lanes 0 4, 2 6, 1 5, 3 7
            let a0 = _mm512_shuffle_f64x2::<0x88>(l0, l1);
            let a2 = _mm512_shuffle_f64x2::<0xdd>(l0, l1);
            let a1 = _mm512_shuffle_f64x2::<0x88>(h0, h1);
            let a3 = _mm512_shuffle_f64x2::<0xdd>(h0, h1);
            let b0 = _mm512_shuffle_f64x2::<0x88>(l2, l3);
            let b2 = _mm512_shuffle_f64x2::<0xdd>(l2, l3);
            let b1 = _mm512_shuffle_f64x2::<0x88>(h2, h3);
            let b3 = _mm512_shuffle_f64x2::<0xdd>(h2, h3);
            [
                Self(_mm512_shuffle_f64x2::<0x88>(a0, b0)),
                Self(_mm512_shuffle_f64x2::<0x88>(a1, b1)),
                Self(_mm512_shuffle_f64x2::<0x88>(a2, b2)),
                Self(_mm512_shuffle_f64x2::<0x88>(a3, b3)),
                Self(_mm512_shuffle_f64x2::<0xdd>(a0, b0)),
                Self(_mm512_shuffle_f64x2::<0xdd>(a1, b1)),
                Self(_mm512_shuffle_f64x2::<0xdd>(a2, b2)),
                Self(_mm512_shuffle_f64x2::<0xdd>(a3, b3)),
            ]
        }
    }
    #[inline(always)]
    fn reduce_sum(self) -> f64 {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe {
            let half = _mm256_add_pd(
                _mm512_castpd512_pd256(self.0),
                _mm512_extractf64x4_pd::<1>(self.0),
            );
            super::avx2::sum4(half)
        }
    }
    #[inline(always)]
    fn reduce_sums(of: [Self; 4]) -> [f64; 4] {
        let mut out = [0.0; 4];
        // SAFETY: lanes exist only with a token; the array is 32 writable bytes, and the store is unaligned.
        unsafe {
            let [a, b, c, d] = [of[0].0, of[1].0, of[2].0, of[3].0];
            // lower and upper halves: 0+4 … 3+7 of a and b, of c and d
            let ab = _mm512_add_pd(
                _mm512_shuffle_f64x2::<0b01_00_01_00>(a, b),
                _mm512_shuffle_f64x2::<0b11_10_11_10>(a, b),
            );
            let cd = _mm512_add_pd(
                _mm512_shuffle_f64x2::<0b01_00_01_00>(c, d),
                _mm512_shuffle_f64x2::<0b11_10_11_10>(c, d),
            );
            // two partial sums of each
            let pairs = _mm512_add_pd(
                _mm512_shuffle_f64x2::<0b10_00_10_00>(ab, cd),
                _mm512_shuffle_f64x2::<0b11_01_11_01>(ab, cd),
            );
            let sums = _mm512_add_pd(pairs, _mm512_permute_pd::<0b0101_0101>(pairs));
            let first = _mm512_maskz_compress_pd(0b0101_0101, sums);
            _mm256_storeu_pd(out.as_mut_ptr(), _mm512_castpd512_pd256(first));
        }
        out
    }
    #[inline(always)]
    fn reduce_eight(of: [Self; 8]) -> [f64; 8] {
        let mut out = [0.0; 8];
        // SAFETY: lanes exist only with a token; the array is 64 writable bytes, and the store is unaligned.
        unsafe {
            // Each step adds halves of two vectors, one of them to lanes where a bit of the lane's number is 0, the other to
            // those where it is 1. One operand is a blend, which need not wait for the port that shuffles.
            let halves = |a, b| {
                _mm512_add_pd(
                    _mm512_mask_blend_pd(0b1111_0000, a, b),
                    _mm512_shuffle_f64x2::<0b01_00_11_10>(a, b),
                )
            };
            let others = _mm512_setr_epi64(2, 3, 8, 9, 6, 7, 12, 13);
            let pairs = |a, b| {
                _mm512_add_pd(
                    _mm512_mask_blend_pd(0b1100_1100, a, b),
                    _mm512_permutex2var_pd(a, others, b),
                )
            };
            let lanes = |a, b| {
                _mm512_add_pd(
                    _mm512_mask_blend_pd(0b1010_1010, a, b),
                    _mm512_shuffle_pd::<0b0101_0101>(a, b),
                )
            };
            let [a, b, c, d, e, f, g, h] = of;
            let even = pairs(halves(a.0, e.0), halves(c.0, g.0));
            let odd = pairs(halves(b.0, f.0), halves(d.0, h.0));
            _mm512_storeu_pd(out.as_mut_ptr(), lanes(even, odd));
        }
        out
    }
}

impl BitAnd for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for Avx512Mask {
    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }
    #[inline(always)]
    fn all(self) -> bool {
        self.0 == 0xff
    }
    #[inline(always)]
    fn bits(self) -> u8 {
        self.0
    }
}

macro_rules! bits_operator {
    ($($trait:ident $method:ident $intrinsic:ident;)*) => {$(
        impl $trait for Avx512Bits {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: lanes exist only with a token; registers only.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )*};
}
bits_operator! {
    Add add _mm512_add_epi64;
    Sub sub _mm512_sub_epi64;
    BitAnd bitand _mm512_and_si512;
    BitOr bitor _mm512_or_si512;
    BitXor bitxor _mm512_xor_si512;
}

impl Bits for Avx512Bits {
    type Token = Avx512Token;

    #[inline(always)]
    fn splat(_: Avx512Token, value: u64) -> Self {
        // SAFETY: the token proves the features; registers only.
        Self(unsafe { _mm512_set1_epi64(value.cast_signed()) })
    }
    #[inline(always)]
    fn load(_: Avx512Token, from: &[u64; 8]) -> Self {
        // SAFETY: the token proves the features; the array is 64 readable bytes, and the load is unaligned.
        Self(unsafe { _mm512_loadu_si512(from.as_ptr().cast()) })
    }
    #[inline(always)]
    fn store(self, to: &mut [u64; 8]) {
        // SAFETY: lanes exist only with a token; the array is 64 writable bytes, and the store is unaligned.
        unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn shl<const N: u32>(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_slli_epi64::<N>(self.0) })
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_srli_epi64::<N>(self.0) })
    }
    #[inline(always)]
    fn xor3(self, a: Self, b: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_ternarylogic_epi64::<0x96>(self.0, a.0, b.0) })
    }
    #[inline(always)]
    fn shr_by(self, count: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_srlv_epi64(self.0, count.0) })
    }
    #[inline(always)]
    fn mul_low(self, other: Self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe { _mm512_mul_epu32(self.0, other.0) })
    }
    #[inline(always)]
    fn lookup(self, table: &[u64; 16]) -> Self {
        // SAFETY: lanes exist only with a token; both halves of the table are 64 readable bytes; other bits do not count.
        Self(unsafe {
            let low = _mm512_loadu_si512(table.as_ptr().cast());
            let high = _mm512_loadu_si512(table.as_ptr().add(8).cast());
            _mm512_permutex2var_epi64(low, self.0, high)
        })
    }
    #[inline(always)]
    fn interleave(self, odd: Self) -> Self {
        // Bytes apart, nibbles to bytes of their own, and these from a table of spread bits.
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe {
            let apart = _mm512_broadcast_i32x4(_mm_setr_epi8(
                0, -1, 1, -1, 2, -1, 3, -1, 8, -1, 9, -1, 10, -1, 11, -1,
            ));
            let table = _mm512_broadcast_i32x4(_mm_setr_epi8(
                0, 1, 4, 5, 16, 17, 20, 21, 64, 65, 68, 69, 80, 81, 84, 85,
            ));
            let double = _mm512_add_epi8(table, table);
            let low = _mm512_set1_epi8(15);
            let (even, odd) = (
                _mm512_shuffle_epi8(self.0, apart),
                _mm512_shuffle_epi8(odd.0, apart),
            );
            // (a | b) & c
            let even = _mm512_ternarylogic_epi64::<0xa8>(even, _mm512_slli_epi64::<4>(even), low);
            let odd = _mm512_ternarylogic_epi64::<0xa8>(odd, _mm512_slli_epi64::<4>(odd), low);
            let (even, odd) = (
                _mm512_shuffle_epi8(table, even),
                _mm512_shuffle_epi8(double, odd),
            );
            _mm512_or_si512(even, odd)
        })
    }
    #[inline(always)]
    fn unspread_bytes(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        Self(unsafe {
            let places = _mm_setr_epi8(0, 2, 4, 6, 1, 3, 5, 7, 8, 10, 12, 14, 9, 11, 13, 15);
            _mm512_shuffle_epi8(self.0, _mm512_broadcast_i32x4(places))
        })
    }
}
