//! Residual sharing and cap: the invariants hold for any finite input, nothing panics on any.
#![no_main]

use arbitrary::Arbitrary;
use dust3d_tests::cap::{Pixel, check};
use libfuzzer_sys::fuzz_target;

/// A number of the usual size, of any magnitude, or any bits at all.
#[derive(Debug, Arbitrary)]
enum Number {
    Usual(i16),
    Scaled(i16, i16),
    Bits(f64),
}

impl Number {
    fn value(&self) -> f64 {
        match *self {
            Self::Usual(x) => f64::from(x) / 4096.0,
            Self::Scaled(x, exponent) => f64::from(x) * 10_f64.powi(i32::from(exponent % 300)),
            Self::Bits(x) => x,
        }
    }
}

#[derive(Debug, Arbitrary)]
struct Input {
    p_max: Number,
    layers: Vec<[Number; 3]>,
    observed: [Number; 2],
}

fuzz_target!(|input: Input| {
    let layers = input.layers.iter().take(40);
    check(&Pixel {
        p_max: input.p_max.value(),
        intensity: layers.clone().map(|[i, ..]| i.value().abs()).collect(),
        predicted: layers.map(|[_, q, u]| [q.value(), u.value()]).collect(),
        observed: [input.observed[0].value(), input.observed[1].value()],
    });
});
