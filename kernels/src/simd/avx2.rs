//! Eight lanes in two 256-bit registers, with fused multiply-add.
//!
//! An [`Avx2Lanes`] exists only through an [`Avx2Token`], and the token only where the CPU has AVX2 and FMA, so every
//! intrinsic here may run. All but loads and stores work on registers alone.

use super::aligned::Aligned;
use super::lanes::{Bits, Lanes, Mask, sealed::Sealed};
use core::arch::x86_64::*;
use core::ops::{
    Add, AddAssign, BitAnd, BitOr, BitXor, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

/// Proof that the CPU has AVX2 and FMA.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Avx2Token(());

impl Avx2Token {
    /// A token if the CPU can run the level.
    #[must_use]
    pub fn detect() -> Option<Self> {
        #[cfg(feature = "std")]
        let there = std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma");
        #[cfg(not(feature = "std"))]
        let there = cfg!(all(target_feature = "avx2", target_feature = "fma"));
        there.then_some(Self(()))
    }

    /// Runs `f` compiled for this level.
    #[inline(always)]
    pub fn vectorize<R>(self, f: impl FnOnce() -> R) -> R {
        #[target_feature(enable = "avx2,fma")]
        fn inner<R>(f: impl FnOnce() -> R) -> R {
            f()
        }
        // SAFETY: the token proves the features.
        unsafe { inner(f) }
    }
}

/// Lanes 0–3 and 4–7 in two `__m256d`.
#[derive(Clone, Copy)]
pub struct Avx2Lanes(__m256d, __m256d);

/// Mask of [`Avx2Lanes`]: all bits of a lane set or none.
#[derive(Clone, Copy)]
pub struct Avx2Mask(__m256d, __m256d);

/// Eight words in two `__m256i`.
#[derive(Clone, Copy)]
pub struct Avx2Bits(__m256i, __m256i);

impl Sealed for Avx2Lanes {}
impl Sealed for Avx2Bits {}
impl Sealed for Avx2Mask {}

/// (0+2) + (1+3).
///
/// # Safety
/// The CPU must have AVX.
#[inline(always)]
pub(super) unsafe fn sum4(v: __m256d) -> f64 {
    // SAFETY: the caller has AVX; registers only.
    unsafe {
        let pair = _mm_add_pd(_mm256_castpd256_pd128(v), _mm256_extractf128_pd::<1>(v));
        _mm_cvtsd_f64(_mm_add_sd(pair, _mm_unpackhi_pd(pair, pair)))
    }
}

/// Rows to columns.
///
/// # Safety
/// The CPU must have AVX.
#[inline(always)]
unsafe fn transpose4(r: [__m256d; 4]) -> [__m256d; 4] {
    // SAFETY: the caller has AVX; registers only.
    unsafe {
        let l0 = _mm256_unpacklo_pd(r[0], r[1]);
        let h0 = _mm256_unpackhi_pd(r[0], r[1]);
        let l1 = _mm256_unpacklo_pd(r[2], r[3]);
        let h1 = _mm256_unpackhi_pd(r[2], r[3]);
        [
            _mm256_permute2f128_pd::<0x20>(l0, l1),
            _mm256_permute2f128_pd::<0x20>(h0, h1),
            _mm256_permute2f128_pd::<0x31>(l0, l1),
            _mm256_permute2f128_pd::<0x31>(h0, h1),
        ]
    }
}

/// Applies an intrinsic to both halves.
macro_rules! both {
    ($intrinsic:ident, $($x:expr),+) => {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe { Self($intrinsic($($x.0),+), $intrinsic($($x.1),+)) }
    };
}

/// Compares both halves.
macro_rules! compare {
    ($predicate:ident, $a:expr, $b:expr) => {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe {
            Avx2Mask(
                _mm256_cmp_pd::<$predicate>($a.0, $b.0),
                _mm256_cmp_pd::<$predicate>($a.1, $b.1),
            )
        }
    };
}

macro_rules! operator {
    ($($trait:ident $method:ident $assign_trait:ident $assign:ident $intrinsic:ident;)*) => {$(
        impl $trait for Avx2Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                both!($intrinsic, self, other)
            }
        }
        impl $assign_trait for Avx2Lanes {
            #[inline(always)]
            fn $assign(&mut self, other: Self) {
                *self = $trait::$method(*self, other);
            }
        }
    )*};
}
operator! {
    Add add AddAssign add_assign _mm256_add_pd;
    Sub sub SubAssign sub_assign _mm256_sub_pd;
    Mul mul MulAssign mul_assign _mm256_mul_pd;
}

impl Div for Avx2Lanes {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        both!(_mm256_div_pd, self, other)
    }
}

impl Neg for Avx2Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        let sign = unsafe { _mm256_set1_pd(-0.0) };
        let sign = Self(sign, sign);
        both!(_mm256_xor_pd, self, sign)
    }
}

impl Lanes for Avx2Lanes {
    type Token = Avx2Token;
    type Mask = Avx2Mask;
    type Bits = Avx2Bits;
    const FUSED: bool = true;

    #[inline(always)]
    fn splat(_: Avx2Token, value: f64) -> Self {
        // SAFETY: the token proves the features; registers only.
        let v = unsafe { _mm256_set1_pd(value) };
        Self(v, v)
    }
    #[inline(always)]
    fn load(_: Avx2Token, from: &[f64; 8]) -> Self {
        // SAFETY: the token proves the features; the array is 64 readable bytes, and the loads are unaligned.
        unsafe {
            Self(
                _mm256_loadu_pd(from.as_ptr()),
                _mm256_loadu_pd(from.as_ptr().add(4)),
            )
        }
    }
    #[inline(always)]
    fn load_f32(_: Avx2Token, from: &[f32; 8]) -> Self {
        // SAFETY: the token proves the features; the array is 32 readable bytes, and the loads are unaligned.
        unsafe {
            Self(
                _mm256_cvtps_pd(_mm_loadu_ps(from.as_ptr())),
                _mm256_cvtps_pd(_mm_loadu_ps(from.as_ptr().add(4))),
            )
        }
    }
    #[inline(always)]
    fn store(self, to: &mut [f64; 8]) {
        // SAFETY: lanes exist only with a token; the array is 64 writable bytes, and the stores are unaligned.
        unsafe {
            _mm256_storeu_pd(to.as_mut_ptr(), self.0);
            _mm256_storeu_pd(to.as_mut_ptr().add(4), self.1);
        }
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        both!(_mm256_fmadd_pd, self, a, b)
    }
    #[inline(always)]
    fn mul_sub(self, a: Self, b: Self) -> Self {
        both!(_mm256_fmsub_pd, self, a, b)
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        both!(_mm256_fnmadd_pd, self, a, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        both!(_mm256_sqrt_pd, self)
    }
    #[inline(always)]
    fn rough_inverse_sqrt(self) -> Self {
        // Twelve bits in f32, squared by a step of Newton's: y + y (1 - x y²)/2.
        // SAFETY: lanes exist only with a token; registers only.
        #[inline(always)]
        unsafe fn half(x: __m256d) -> __m256d {
            // SAFETY: as above.
            unsafe {
                let y = _mm256_cvtps_pd(_mm_rsqrt_ps(_mm256_cvtpd_ps(x)));
                let rest = _mm256_fnmadd_pd(_mm256_mul_pd(x, y), y, _mm256_set1_pd(1.0));
                _mm256_fmadd_pd(_mm256_mul_pd(y, _mm256_set1_pd(0.5)), rest, y)
            }
        }
        // SAFETY: as above.
        unsafe { Self(half(self.0), half(self.1)) }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        let sign = unsafe { _mm256_set1_pd(-0.0) };
        let sign = Self(sign, sign);
        both!(_mm256_andnot_pd, sign, self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        both!(_mm256_min_pd, self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        both!(_mm256_max_pd, self, other)
    }
    #[inline(always)]
    fn round(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe {
            Self(
                _mm256_round_pd::<0x08>(self.0),
                _mm256_round_pd::<0x08>(self.1),
            )
        }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        both!(_mm256_floor_pd, self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Avx2Mask {
        compare!(_CMP_LT_OQ, self, other)
    }
    #[inline(always)]
    fn le(self, other: Self) -> Avx2Mask {
        compare!(_CMP_LE_OQ, self, other)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Avx2Mask {
        compare!(_CMP_EQ_OQ, self, other)
    }
    #[inline(always)]
    fn select(mask: Avx2Mask, yes: Self, no: Self) -> Self {
        both!(_mm256_blendv_pd, no, yes, mask)
    }
    #[inline(always)]
    fn to_bits(self) -> Avx2Bits {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe { Avx2Bits(_mm256_castpd_si256(self.0), _mm256_castpd_si256(self.1)) }
    }
    #[inline(always)]
    fn from_bits(bits: Avx2Bits) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe { Self(_mm256_castsi256_pd(bits.0), _mm256_castsi256_pd(bits.1)) }
    }
    #[inline(always)]
    fn is_zero(bits: Avx2Bits) -> Avx2Mask {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe {
            let zero = _mm256_setzero_si256();
            Avx2Mask(
                _mm256_castsi256_pd(_mm256_cmpeq_epi64(bits.0, zero)),
                _mm256_castsi256_pd(_mm256_cmpeq_epi64(bits.1, zero)),
            )
        }
    }
    #[inline(always)]
    fn words_lt(a: Avx2Bits, b: Avx2Bits) -> Avx2Mask {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe {
            Avx2Mask(
                _mm256_castsi256_pd(_mm256_cmpgt_epi64(b.0, a.0)),
                _mm256_castsi256_pd(_mm256_cmpgt_epi64(b.1, a.1)),
            )
        }
    }
    #[inline(always)]
    fn exp2_int(self) -> Self {
        // 2^52 + 2^51 + k holds k + 2^51 in its low mantissa bits: AVX2 has no f64 → i64 conversion.
        // SAFETY: lanes exist only with a token; registers only.
        #[inline(always)]
        unsafe fn half(k: __m256d) -> __m256d {
            // SAFETY: as above.
            unsafe {
                let k = _mm256_max_pd(k, _mm256_set1_pd(-1022.0));
                let shifted = _mm256_add_pd(k, _mm256_set1_pd(6_755_399_441_055_744.0 + 1023.0));
                _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(shifted)))
            }
        }
        // SAFETY: as above.
        unsafe { Self(half(self.0), half(self.1)) }
    }
    #[inline(always)]
    fn scale_exp2(self, k: Self) -> Self {
        // Both halves are in the range of `exp2_int` once k is within ±2044 (beyond, the result is 0 or ∞ anyway), and the
        // first product is exact: one rounding, as AVX-512 has it.
        // SAFETY: lanes exist only with a token; registers only.
        let [lo, hi, half] = unsafe { [-2044.0, 2044.0, 0.5].map(|x| _mm256_set1_pd(x)) };
        let k = k.max(Self(lo, lo)).min(Self(hi, hi));
        let first = (k * Self(half, half)).floor();
        self * first.exp2_int() * (k - first).exp2_int()
    }
    #[inline(always)]
    fn split_exponent(self) -> (Self, Self) {
        // SAFETY: lanes exist only with a token; registers only.
        #[inline(always)]
        unsafe fn half(x: __m256d) -> (__m256d, __m256d) {
            // SAFETY: as above. 2^52 with the exponent in its low mantissa bits, minus 2^52, is the exponent as f64.
            unsafe {
                let bits = _mm256_castpd_si256(x);
                let mantissa = _mm256_or_si256(
                    _mm256_and_si256(bits, _mm256_set1_epi64x((1 << 52) - 1)),
                    _mm256_set1_epi64x(1023 << 52),
                );
                let magic = _mm256_set1_pd(4_503_599_627_370_496.0);
                let e = _mm256_or_si256(_mm256_srli_epi64::<52>(bits), _mm256_castpd_si256(magic));
                let e = _mm256_sub_pd(_mm256_castsi256_pd(e), magic);
                (
                    _mm256_castsi256_pd(mantissa),
                    _mm256_sub_pd(e, _mm256_set1_pd(1023.0)),
                )
            }
        }
        // SAFETY: as above.
        let ((m0, e0), (m1, e1)) = unsafe { (half(self.0), half(self.1)) };
        (Self(m0, m1), Self(e0, e1))
    }
    #[inline(always)]
    unsafe fn stream<const N: usize>(values: [Self; N], to: &mut Aligned<N>) {
        for k in 0..N {
            // SAFETY: lanes exist only with a token; the array is 64 writable bytes at a multiple of 64; the caller fences.
            unsafe {
                _mm256_stream_pd(to[k].as_mut_ptr(), values[k].0);
                _mm256_stream_pd(to[k].as_mut_ptr().add(4), values[k].1);
            }
        }
    }
    #[inline(always)]
    fn fence(_: Avx2Token) {
        // SAFETY: the token proves more than SSE; a fence touches no memory.
        unsafe { _mm_sfence() }
    }
    #[inline(always)]
    fn prefetch<T>(_: Avx2Token, from: &T) {
        // SAFETY: a prefetch reads nothing, and the address is that of a reference.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(core::ptr::from_ref(from).cast()) }
    }
    #[inline(always)]
    fn load_twice(_: Avx2Token, from: &[f64; 4]) -> Self {
        // SAFETY: the token proves the features; the array is 32 readable bytes, and the load is unaligned.
        unsafe {
            let four = _mm256_loadu_pd(from.as_ptr());
            Self(
                _mm256_permute4x64_pd::<0b01_01_00_00>(four),
                _mm256_permute4x64_pd::<0b11_11_10_10>(four),
            )
        }
    }
    #[inline(always)]
    fn swap_pairs(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe {
            Self(
                _mm256_permute_pd::<0b0101>(self.0),
                _mm256_permute_pd::<0b0101>(self.1),
            )
        }
    }
    #[inline(always)]
    fn transpose(_: Avx2Token, r: [Self; 8]) -> [Self; 8] {
        // SAFETY: the token proves the features; registers only.
        unsafe {
            let a = transpose4([r[0].0, r[1].0, r[2].0, r[3].0]);
            let b = transpose4([r[4].0, r[5].0, r[6].0, r[7].0]);
            let c = transpose4([r[0].1, r[1].1, r[2].1, r[3].1]);
            let d = transpose4([r[4].1, r[5].1, r[6].1, r[7].1]);
            [
                Self(a[0], b[0]),
                Self(a[1], b[1]),
                Self(a[2], b[2]),
                Self(a[3], b[3]),
                Self(c[0], d[0]),
                Self(c[1], d[1]),
                Self(c[2], d[2]),
                Self(c[3], d[3]),
            ]
        }
    }
    #[inline(always)]
    fn reduce_sum(self) -> f64 {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe { sum4(_mm256_add_pd(self.0, self.1)) }
    }
    #[inline(always)]
    fn reduce_sums(of: [Self; 4]) -> [f64; 4] {
        let mut out = [0.0; 4];
        // SAFETY: lanes exist only with a token; the array is 32 writable bytes, and the store is unaligned.
        unsafe {
            let [a, b, c, d] = [
                _mm256_add_pd(of[0].0, of[0].1),
                _mm256_add_pd(of[1].0, of[1].1),
                _mm256_add_pd(of[2].0, of[2].1),
                _mm256_add_pd(of[3].0, of[3].1),
            ];
            // (0+2, 1+3) of a and c, of b and d
            let ac = _mm256_add_pd(
                _mm256_permute2f128_pd::<0x20>(a, c),
                _mm256_permute2f128_pd::<0x31>(a, c),
            );
            let bd = _mm256_add_pd(
                _mm256_permute2f128_pd::<0x20>(b, d),
                _mm256_permute2f128_pd::<0x31>(b, d),
            );
            let sums = _mm256_add_pd(_mm256_unpacklo_pd(ac, bd), _mm256_unpackhi_pd(ac, bd));
            _mm256_storeu_pd(out.as_mut_ptr(), sums);
        }
        out
    }
}

impl BitAnd for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        both!(_mm256_and_pd, self, other)
    }
}

impl BitOr for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        both!(_mm256_or_pd, self, other)
    }
}

impl Not for Avx2Mask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        let ones = unsafe { _mm256_castsi256_pd(_mm256_set1_epi64x(-1)) };
        let ones = Self(ones, ones);
        both!(_mm256_xor_pd, self, ones)
    }
}

impl Mask for Avx2Mask {
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
        // SAFETY: lanes exist only with a token; registers only.
        let (low, high) = unsafe { (_mm256_movemask_pd(self.0), _mm256_movemask_pd(self.1)) };
        (low | (high << 4)) as u8
    }
}

macro_rules! bits_operator {
    ($($trait:ident $method:ident $intrinsic:ident;)*) => {$(
        impl $trait for Avx2Bits {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                both!($intrinsic, self, other)
            }
        }
    )*};
}
bits_operator! {
    Add add _mm256_add_epi64;
    Sub sub _mm256_sub_epi64;
    BitAnd bitand _mm256_and_si256;
    BitOr bitor _mm256_or_si256;
    BitXor bitxor _mm256_xor_si256;
}

impl Bits for Avx2Bits {
    type Token = Avx2Token;

    #[inline(always)]
    fn splat(_: Avx2Token, value: u64) -> Self {
        // SAFETY: the token proves the features; registers only.
        let v = unsafe { _mm256_set1_epi64x(value.cast_signed()) };
        Self(v, v)
    }
    #[inline(always)]
    fn load(_: Avx2Token, from: &[u64; 8]) -> Self {
        // SAFETY: the token proves the features; the array is 64 readable bytes, and the loads are unaligned.
        unsafe {
            Self(
                _mm256_loadu_si256(from.as_ptr().cast()),
                _mm256_loadu_si256(from.as_ptr().add(4).cast()),
            )
        }
    }
    #[inline(always)]
    fn store(self, to: &mut [u64; 8]) {
        // SAFETY: lanes exist only with a token; the array is 64 writable bytes, and the stores are unaligned.
        unsafe {
            _mm256_storeu_si256(to.as_mut_ptr().cast(), self.0);
            _mm256_storeu_si256(to.as_mut_ptr().add(4).cast(), self.1);
        }
    }
    #[inline(always)]
    fn shl<const N: u32>(self) -> Self {
        // A constant count becomes an immediate; the intrinsic that takes one wants another type than AVX-512's.
        // SAFETY: lanes exist only with a token; registers only.
        unsafe {
            let count = _mm_cvtsi32_si128(N.cast_signed());
            Self(
                _mm256_sll_epi64(self.0, count),
                _mm256_sll_epi64(self.1, count),
            )
        }
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        unsafe {
            let count = _mm_cvtsi32_si128(N.cast_signed());
            Self(
                _mm256_srl_epi64(self.0, count),
                _mm256_srl_epi64(self.1, count),
            )
        }
    }
    #[inline(always)]
    fn shr_by(self, count: Self) -> Self {
        both!(_mm256_srlv_epi64, self, count)
    }
    #[inline(always)]
    fn mul_low(self, other: Self) -> Self {
        both!(_mm256_mul_epu32, self, other)
    }
    #[inline(always)]
    fn lookup(self, table: &[u64; 16]) -> Self {
        // SAFETY: lanes exist only with a token; places are below 16, within the table.
        unsafe {
            let low = _mm256_set1_epi64x(15);
            let table = table.as_ptr().cast();
            Self(
                _mm256_i64gather_epi64::<8>(table, _mm256_and_si256(self.0, low)),
                _mm256_i64gather_epi64::<8>(table, _mm256_and_si256(self.1, low)),
            )
        }
    }
    #[inline(always)]
    fn interleave(self, odd: Self) -> Self {
        // Bytes apart, nibbles to bytes of their own, and these from a table of spread bits.
        // SAFETY: lanes exist only with a token; registers only.
        #[inline(always)]
        unsafe fn half(even: __m256i, odd: __m256i) -> __m256i {
            // SAFETY: as above.
            unsafe {
                let apart = _mm256_broadcastsi128_si256(_mm_setr_epi8(
                    0, -1, 1, -1, 2, -1, 3, -1, 8, -1, 9, -1, 10, -1, 11, -1,
                ));
                let table = _mm256_broadcastsi128_si256(_mm_setr_epi8(
                    0, 1, 4, 5, 16, 17, 20, 21, 64, 65, 68, 69, 80, 81, 84, 85,
                ));
                let double = _mm256_add_epi8(table, table);
                let low = _mm256_set1_epi8(15);
                let (even, odd) = (
                    _mm256_shuffle_epi8(even, apart),
                    _mm256_shuffle_epi8(odd, apart),
                );
                let even = _mm256_or_si256(even, _mm256_slli_epi64::<4>(even));
                let odd = _mm256_or_si256(odd, _mm256_slli_epi64::<4>(odd));
                let even = _mm256_shuffle_epi8(table, _mm256_and_si256(even, low));
                let odd = _mm256_shuffle_epi8(double, _mm256_and_si256(odd, low));
                _mm256_or_si256(even, odd)
            }
        }
        // SAFETY: as above.
        unsafe { Self(half(self.0, odd.0), half(self.1, odd.1)) }
    }
    #[inline(always)]
    fn unspread_bytes(self) -> Self {
        // SAFETY: lanes exist only with a token; registers only.
        let places = unsafe {
            _mm256_broadcastsi128_si256(_mm_setr_epi8(
                0, 2, 4, 6, 1, 3, 5, 7, 8, 10, 12, 14, 9, 11, 13, 15,
            ))
        };
        let places = Self(places, places);
        both!(_mm256_shuffle_epi8, self, places)
    }
}
