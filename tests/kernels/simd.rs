//! The lanes of every level against plain scalar code, and each other.

use dust3d_kernels::dispatch;
use dust3d_kernels::simd::{Bits, Lanes, Level, Mask};
use dust3d_tests::random::Random;

const EDGES: [f64; 8] = [0.0, -0.0, 1.5, -2.5, f64::INFINITY, f64::NAN, 1e-300, -7.0];
const OTHER: [f64; 8] = [1.0, 0.0, 1.5, 2.0, -1.0, 3.0, f64::NAN, -8.0];

/// What every lane operation gives for the two arrays above, in one list.
#[inline(always)]
fn everything<L: Lanes>(token: L::Token, a: &[f64; 8], b: &[f64; 8]) -> [[f64; 8]; 16] {
    let (x, y) = (L::load(token, a), L::load(token, b));
    let half = L::splat(token, 0.5);
    let mask = |m: L::Mask| {
        let bits = m.bits();
        core::array::from_fn(|i| f64::from((bits >> i) & 1))
    };
    [
        (x + y).to_array(),
        (x - y).to_array(),
        (x * y).to_array(),
        (x / y).to_array(),
        (-x).to_array(),
        x.abs().sqrt().to_array(),
        x.abs().to_array(),
        x.round().to_array(),
        (x * half).floor().to_array(),
        x.min(y).to_array(),
        x.max(y).to_array(),
        L::select(x.lt(y), x, y).to_array(),
        mask(x.lt(y)),
        mask(x.le(y)),
        mask(x.eq(y)),
        mask(!(x.gt(y) | x.ge(y)) & x.lt(y)),
    ]
}

#[test]
fn naive_edges_every_operation() {
    let expected: [[f64; 8]; 16] = {
        let f = |g: fn(f64, f64) -> f64| core::array::from_fn(|i| g(EDGES[i], OTHER[i]));
        [
            f(|x, y| x + y),
            f(|x, y| x - y),
            f(|x, y| x * y),
            f(|x, y| x / y),
            f(|x, _| -x),
            f(|x, _| x.abs().sqrt()),
            f(|x, _| x.abs()),
            f(|x, _| x.round_ties_even()),
            f(|x, _| (x * 0.5).floor()),
            f(|x, y| if x < y { x } else { y }),
            f(|x, y| if x > y { x } else { y }),
            f(|x, y| if x < y { x } else { y }),
            f(|x, y| f64::from(u8::from(x < y))),
            f(|x, y| f64::from(u8::from(x <= y))),
            f(|x, y| f64::from(u8::from(x == y))),
            f(|x, y| f64::from(u8::from(!(x > y || x >= y) && x < y))),
        ]
    };
    for level in Level::available() {
        let got = dispatch!(level, |token: L| everything::<L>(token, &EDGES, &OTHER));
        for (operation, (g, e)) in got.iter().zip(&expected).enumerate() {
            for lane in 0..8 {
                assert!(
                    g[lane] == e[lane] || (g[lane].is_nan() && e[lane].is_nan()),
                    "{level} operation {operation} lane {lane}: {} for {}",
                    g[lane],
                    e[lane]
                );
            }
        }
    }
}

#[inline(always)]
fn inverse_roots<L: Lanes>(token: L::Token, a: &[f64; 8]) -> [f64; 8] {
    L::load(token, a).rough_inverse_sqrt().to_array()
}

#[test]
fn naive_random_rough_inverse_sqrt() {
    for level in Level::available() {
        for k in 0..20_000 {
            let x: [f64; 8] = core::array::from_fn(|i| {
                let e = f64::from((k * 8 + i as i32) % 200 - 100);
                (1.0 + 0.618_033_988_75 * f64::from(k) % 1.0) * e.exp2()
            });
            let got = dispatch!(level, |token: L| inverse_roots::<L>(token, &x));
            for i in 0..8 {
                let error = got[i] * x[i].sqrt() - 1.0;
                assert!(error.abs() < 2_f64.powf(-13.9), "{level} {} {error}", x[i]);
            }
        }
        let below = dispatch!(level, |token: L| inverse_roots::<L>(token, &[-1e-9; 8]));
        assert!(below.iter().all(|x| x.is_nan()), "{level}");
    }
}

#[inline(always)]
fn words<L: Lanes>(token: L::Token, a: &[u64; 8], b: &[u64; 8]) -> ([[u64; 8]; 4], u8) {
    let table = core::array::from_fn(|i| (i as u64) << 40);
    let (x, y) = (L::Bits::load(token, a), L::Bits::load(token, b));
    let found = [
        x.shr_by(y & L::Bits::splat(token, 63)).to_array(),
        x.mul_low(y).to_array(),
        x.interleave(y).to_array(),
        x.lookup(&table).to_array(),
    ];
    (found, L::words_lt(x, y).bits())
}

#[test]
fn naive_random_words() {
    let mut random = Random(5);
    for k in 0..2000 {
        let a: [u64; 8] = core::array::from_fn(|_| random.bits() >> (k % 50));
        let b: [u64; 8] = core::array::from_fn(|i| if i == 3 { a[3] } else { random.bits() });
        for level in Level::available() {
            let ([shifted, product, mixed, found], less) =
                dispatch!(level, |token: L| words::<L>(token, &a, &b));
            for i in 0..8 {
                let bit = |v: u64, k: u32| (v >> k) & 1;
                let expected = (0..32)
                    .map(|k| (bit(a[i], k) << (2 * k)) | (bit(b[i], k) << (2 * k + 1)))
                    .sum::<u64>();
                assert_eq!(mixed[i], expected, "{level}");
                assert_eq!(shifted[i], a[i] >> (b[i] & 63), "{level}");
                assert_eq!(product[i], (a[i] & 0xffff_ffff) * (b[i] & 0xffff_ffff));
                assert_eq!(found[i], (a[i] & 15) << 40, "{level}");
                assert_eq!((less >> i) & 1 == 1, a[i] < b[i], "{level}");
            }
        }
    }
}

#[inline(always)]
fn exponents<L: Lanes>(token: L::Token, k: &[f64; 8]) -> [[f64; 8]; 3] {
    let x = L::load(token, k).exp2_int() * L::splat(token, 1.25);
    let (m, e) = x.split_exponent();
    [x.to_array(), m.to_array(), e.to_array()]
}

#[test]
fn naive_all_exponents() {
    for level in Level::available() {
        for start in (-1022..=1016).step_by(8) {
            let k: [f64; 8] = core::array::from_fn(|i| f64::from(start) + i as f64);
            let [x, m, e] = dispatch!(level, |token: L| exponents::<L>(token, &k));
            for i in 0..8 {
                assert_eq!(x[i], 1.25 * f64::from_bits(((k[i] + 1023.0) as u64) << 52));
                assert_eq!((m[i], e[i]), (1.25, k[i]), "{level}");
            }
        }
    }
}

#[inline(always)]
fn fused<L: Lanes>(token: L::Token, a: &[f64; 8]) -> ([f64; 8], [f64; 8], [f64; 8], f64, f64) {
    let x = L::load(token, a);
    let c = L::splat(token, -1.0);
    (
        x.mul_add(x, c).to_array(),
        x.mul_sub(x, -c).to_array(),
        x.neg_mul_add(x, -c).to_array(),
        x.reduce_sum(),
        x.reduce_max(),
    )
}

#[test]
fn levels_agree_fused_and_sums() {
    let a: [f64; 8] = core::array::from_fn(|i| 1.0 + (i as f64 + 1.0) * 1e-9);
    let tree = ((a[0] + a[4]) + (a[2] + a[6])) + ((a[1] + a[5]) + (a[3] + a[7]));
    for level in Level::available() {
        let (p, q, r, sum, max) = dispatch!(level, |token: L| fused::<L>(token, &a));
        assert_eq!((sum, max), (tree, a[7]), "{level}");
        if level.name() != "portable" {
            let expected = a.map(|x| x.mul_add(x, -1.0));
            assert_eq!(p, expected);
            assert_eq!(q, expected);
            assert_eq!(r, expected.map(|x| -x));
        }
    }
}

/// Four sums at once, and eight, have the bits of each alone.
#[test]
fn levels_agree_several_sums() {
    #[inline(always)]
    fn sums<L: Lanes>(token: L::Token, a: &[[f64; 8]; 8]) -> ([f64; 4], [f64; 8], [f64; 8]) {
        let mut of = [L::splat(token, 0.0); 8];
        let mut single = [0.0; 8];
        for k in 0..8 {
            of[k] = L::load(token, &a[k]);
            single[k] = of[k].reduce_sum();
        }
        let [p, q, r, s, ..] = of;
        (L::reduce_sums([p, q, r, s]), L::reduce_eight(of), single)
    }
    let a: [[f64; 8]; 8] = core::array::from_fn(|k| {
        core::array::from_fn(|i| (1.0 + (3 * k + i) as f64).sqrt() * 3f64.powi(k as i32 - 2))
    });
    for level in Level::available() {
        let (four, eight, single) = dispatch!(level, |token: L| sums::<L>(token, &a));
        assert_eq!(four, single[..4], "{level}");
        assert_eq!(eight, single, "{level}");
    }
}

/// Each of four twice, and neighbours exchanged.
#[test]
fn levels_agree_pairs() {
    #[inline(always)]
    fn pairs<L: Lanes>(token: L::Token, four: &[f64; 4], eight: &[f64; 8]) -> [[f64; 8]; 2] {
        [
            L::load_twice(token, four).to_array(),
            L::load(token, eight).swap_pairs().to_array(),
        ]
    }
    let eight: [f64; 8] = core::array::from_fn(|i| i as f64);
    for level in Level::available() {
        let [twice, swapped] = dispatch!(level, |token: L| pairs::<L>(
            token,
            &[0.0, 1.0, 2.0, 3.0],
            &eight
        ));
        assert_eq!(twice, [0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0], "{level}");
        assert_eq!(swapped, [1.0, 0.0, 3.0, 2.0, 5.0, 4.0, 7.0, 6.0], "{level}");
    }
}

#[test]
fn short_slices_are_padded() {
    #[inline(always)]
    fn round_trip<L: Lanes>(token: L::Token, from: &[f64], to: &mut [f64]) -> [f64; 8] {
        let v = L::load_padded(token, from, 9.0);
        v.store_padded(to);
        v.to_array()
    }
    let from = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0];
    for level in Level::available() {
        for n in 0..=9 {
            let mut to = [0.0; 9];
            let v = dispatch!(level, |token: L| round_trip::<L>(
                token,
                &from[..n],
                &mut to[..n]
            ));
            let m = n.min(8);
            assert_eq!(v[..m], from[..m]);
            assert!(v[m..].iter().all(|&x| x == 9.0));
            assert_eq!(to[..m], from[..m]);
            assert!(to[m..].iter().all(|&x| x == 0.0));
        }
    }
}
