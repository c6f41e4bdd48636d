//! Raw maps: any bytes are a map that survives being written and read, or are refused.
#![no_main]

#[expect(dead_code, reason = "shared with the tests, which use all of it")]
#[path = "../../tests/cli/properties.rs"]
mod properties;

use dust3d::config::Dtype;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for dtype in [Dtype::F32, Dtype::F64] {
        properties::assert_raw_map(bytes, dtype);
        // Whole maps are rare among random lengths: cut to the largest that fits.
        let size = dtype.size();
        if let Some(nside) = [4, 2, 1]
            .into_iter()
            .find(|nside| 12 * nside * nside * size <= bytes.len())
        {
            properties::assert_raw_map(&bytes[..12 * nside * nside * size], dtype);
        }
    }
});
