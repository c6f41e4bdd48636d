//! Root finding.

use dust3d_kernels::fit::find_root;
use proptest::prelude::*;
use std::convert::Infallible;

fn root(f: impl Fn(f64) -> f64, a: f64, b: f64) -> (f64, usize) {
    let mut count = 0;
    let result: Result<f64, Infallible> = find_root(
        |x| {
            count += 1;
            Ok(f(x))
        },
        (a, f(a)),
        (b, f(b)),
        1e-12,
    );
    match result {
        Ok(x) => (x, count),
        Err(never) => match never {},
    }
}

#[test]
fn known_roots() {
    for (f, a, b, expected) in [
        ((|x| x * x - 2.0) as fn(f64) -> f64, 0.0, 2.0, 2_f64.sqrt()),
        (|x: f64| x.cos() - x, 0.0, 1.0, 0.739_085_133_215_160_6),
        (|x: f64| 1.0 - x.exp(), -1.0, 3.0, 0.0),
        (|x| x, 0.0, 1.0, 0.0),
        (|x| x - 1.0, 0.0, 1.0, 1.0),
        // Flat on one side: false position alone would crawl.
        (|x: f64| x.powi(9), -0.5, 1.0, 0.0),
    ] {
        let (x, count) = root(f, a, b);
        assert!((x - expected).abs() < 1e-10, "{x} for {expected}");
        assert!(count < 120, "{count} evaluations");
    }
}

#[test]
fn an_error_of_the_function_comes_through() {
    assert_eq!(
        find_root(|_| Err("no"), (0.0, -1.0), (1.0, 1.0), 1e-9),
        Err("no")
    );
}

proptest! {
    #[test]
    fn prop_root_of_a_line(zero in 0.01..0.99_f64, slope in 1e-6..1e6_f64) {
        let (x, count) = root(|x| slope * (x - zero), 0.0, 1.0);
        prop_assert!((x - zero).abs() < 1e-12);
        prop_assert!(count <= 6);
    }
}
