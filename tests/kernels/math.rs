//! The vector mathematics against 200-bit arithmetic, at the edges, and level against level.

use dust3d_kernels::dispatch;
use dust3d_kernels::simd::{Lanes, Level, math};
use dust3d_tests::reference::{rows, ulps};
use dust3d_tests::tolerance as tol;
use proptest::prelude::*;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Function {
    Exp,
    Expm1,
    Ln,
    Sin,
    Cos,
    Pow,
}
use Function::*;

const ALL: [Function; 6] = [Exp, Expm1, Ln, Sin, Cos, Pow];

#[inline(always)]
fn eight<L: Lanes>(token: L::Token, f: Function, x: &[f64; 8], y: &[f64; 8]) -> [f64; 8] {
    let v = L::load(token, x);
    match f {
        Exp => math::exp(token, v),
        Expm1 => math::expm1(token, v),
        Ln => math::ln(token, v),
        Sin => math::sin_cos(token, v).0,
        Cos => math::sin_cos(token, v).1,
        Pow => math::pow(token, v, L::load(token, y)),
    }
    .to_array()
}

fn apply(level: Level, f: Function, x: &[f64; 8], y: &[f64; 8]) -> [f64; 8] {
    dispatch!(level, |token: L| eight::<L>(token, f, x, y))
}

fn one(level: Level, f: Function, x: f64, y: f64) -> f64 {
    apply(level, f, &[x; 8], &[y; 8])[3]
}

fn worst(level: Level, f: Function, table: &str) -> f64 {
    let rows = rows(table);
    let arguments = rows[0].len() - 2;
    let mut worst = (0.0, vec![]);
    for chunk in rows.chunks(8) {
        let at = |column: usize| -> [f64; 8] {
            core::array::from_fn(|i| chunk.get(i).map_or(1.0, |row| row[column]))
        };
        let got = apply(level, f, &at(0), &at(arguments - 1));
        for (row, got) in chunk.iter().zip(got) {
            let e = ulps(got, row[arguments], row[arguments + 1]);
            if e > worst.0 {
                worst = (e, row.clone());
            }
        }
    }
    println!("{level} {f:?}: {:.3} ulp at {:?}", worst.0, worst.1);
    worst.0
}

#[test]
fn mp_vectors_every_function() {
    let tables = [
        (
            Exp,
            include_str!("../data/math/exp.txt"),
            tol::EXP,
            tol::EXP_PORTABLE,
        ),
        (
            Expm1,
            include_str!("../data/math/expm1.txt"),
            tol::EXPM1,
            tol::EXPM1_PORTABLE,
        ),
        (
            Ln,
            include_str!("../data/math/ln.txt"),
            tol::LN,
            tol::LN_PORTABLE,
        ),
        (
            Sin,
            include_str!("../data/math/sin.txt"),
            tol::SIN,
            tol::SIN_PORTABLE,
        ),
        (
            Cos,
            include_str!("../data/math/cos.txt"),
            tol::COS,
            tol::COS_PORTABLE,
        ),
        (
            Pow,
            include_str!("../data/math/pow.txt"),
            tol::POW,
            tol::POW_PORTABLE,
        ),
    ];
    for (f, table, fused, portable) in tables {
        for level in Level::available() {
            let bound = if level.name() == "portable" {
                portable
            } else {
                fused
            };
            bound.hold(worst(level, f, table));
        }
    }
}

#[test]
fn edges_every_function() {
    const INF: f64 = f64::INFINITY;
    let expected = [
        (Exp, 0.0, 0.0, 1.0),
        (Exp, -0.0, 0.0, 1.0),
        (Exp, INF, 0.0, INF),
        (Exp, -INF, 0.0, 0.0),
        (Exp, 710.0, 0.0, INF),
        (Exp, 1e300, 0.0, INF),
        (Exp, -746.0, 0.0, 0.0),
        (Exp, -745.0, 0.0, 5e-324),
        (Exp, f64::NAN, 0.0, f64::NAN),
        (Expm1, 0.0, 0.0, 0.0),
        (Expm1, 5e-324, 0.0, 5e-324),
        (Expm1, INF, 0.0, INF),
        (Expm1, 710.0, 0.0, INF),
        (Expm1, -INF, 0.0, -1.0),
        (Expm1, -50.0, 0.0, -1.0),
        (Expm1, f64::NAN, 0.0, f64::NAN),
        (Ln, 1.0, 0.0, 0.0),
        (Ln, 0.0, 0.0, -INF),
        (Ln, -0.0, 0.0, -INF),
        (Ln, INF, 0.0, INF),
        (Ln, -1.0, 0.0, f64::NAN),
        (Ln, -INF, 0.0, f64::NAN),
        (Ln, f64::NAN, 0.0, f64::NAN),
        (Sin, 0.0, 0.0, 0.0),
        (Sin, INF, 0.0, f64::NAN),
        (Sin, f64::NAN, 0.0, f64::NAN),
        (Cos, 0.0, 0.0, 1.0),
        (Cos, -INF, 0.0, f64::NAN),
        (Cos, f64::NAN, 0.0, f64::NAN),
        (Pow, 2.0, 10.0, 1024.0),
        (Pow, 2.0, -1074.0, 5e-324),
        (Pow, 2.0, 1024.0, INF),
        (Pow, 10.0, 3.0, 1000.0),
        (Pow, -2.0, 3.0, -8.0),
        (Pow, -2.0, 2.0, 4.0),
        (Pow, -2.0, 0.5, f64::NAN),
        (Pow, f64::NAN, 0.0, 1.0),
        (Pow, 1.0, f64::NAN, 1.0),
        (Pow, f64::NAN, 1.0, f64::NAN),
        (Pow, 2.0, f64::NAN, f64::NAN),
        (Pow, 0.0, 2.0, 0.0),
        (Pow, 0.0, -2.0, INF),
        (Pow, INF, 0.5, INF),
        (Pow, INF, -0.5, 0.0),
        (Pow, 2.0, INF, INF),
        (Pow, 2.0, -INF, 0.0),
        (Pow, 0.5, INF, 0.0),
        (Pow, 1e300, 2.0, INF),
        (Pow, 1e-300, 2.0, 0.0),
        (Pow, 5e-324, 1.0, 5e-324),
    ];
    for level in Level::available() {
        for (f, x, y, value) in expected {
            let got = one(level, f, x, y);
            assert!(
                got == value || (got.is_nan() && value.is_nan()),
                "{level} {f:?}({x}, {y}) = {got}, not {value}"
            );
        }
    }
}

/// e^x where it is subnormal: half a unit of the last place there, and half a unit more of the rounding before.
#[test]
fn libm_subnormal_exp() {
    for level in Level::available() {
        for k in 0..3000 {
            let x = -708.0 - f64::from(k) * 0.0125;
            let (got, expected) = (one(level, Exp, x, 0.0), x.exp());
            assert!(
                (got - expected).abs() <= 5e-324 + 4e-16 * expected,
                "{x}: {got} {expected}"
            );
        }
    }
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Any bit pattern: the fused levels give the same bits, the portable one the same to two units.
    #[test]
    fn levels_agree_any_bits(x in prop::array::uniform8(any::<u64>()), y in prop::array::uniform8(any::<u64>())) {
        let (x, y) = (x.map(f64::from_bits), y.map(f64::from_bits));
        for f in ALL {
            let results: Vec<_> = Level::available().map(|l| (l, apply(l, f, &x, &y))).collect();
            if let (Some(a), Some(b)) = (results.get(1), results.get(2)) {
                for i in 0..8 {
                    prop_assert!(same(a.1[i], b.1[i]), "{f:?}({:e}, {:e}): {:e} {:e}", x[i], y[i], a.1[i], b.1[i]);
                }
            }
            for (level, other) in &results[1..] {
                for i in 0..8 {
                    let (p, q) = (results[0].1[i], other[i]);
                    prop_assert!(
                        same(p, q) || (p - q).abs() <= 4.0 * f64::EPSILON * p.abs() + 1e-323 || p == q,
                        "{level} {f:?}({:e}, {:e}): {p:e} {q:e}", x[i], y[i]
                    );
                }
            }
        }
    }

    /// Ordinary arguments against the platform's functions.
    #[test]
    fn std_random_every_function(x in -700.0..700.0_f64, m in 1e-3..1e3_f64, y in -50.0..50.0_f64, a in -1e7..1e7_f64) {
        for level in Level::available() {
            for (f, x, y, expected) in [
                (Exp, x, 0.0, x.exp()),
                (Expm1, x, 0.0, x.exp_m1()),
                (Expm1, x * 1e-3, 0.0, (x * 1e-3).exp_m1()),
                (Ln, m, 0.0, m.ln()),
                (Sin, a, 0.0, a.sin()),
                (Cos, a, 0.0, a.cos()),
                (Pow, m, y, m.powf(y)),
            ] {
                let got = one(level, f, x, y);
                prop_assert!((got - expected).abs() <= 3.0 * f64::EPSILON * expected.abs(), "{level} {f:?}({x}, {y}): {got} {expected}");
            }
        }
    }
}
