//! Bits of two numbers interleaved, as on a quadtree: one at a time.

/// Spreads the 32 low bits to the even places.
#[inline]
pub(crate) const fn spread_bits(v: u64) -> u64 {
    let v = v & 0xffff_ffff;
    let v = (v | (v << 16)) & 0x0000_ffff_0000_ffff;
    let v = (v | (v << 8)) & 0x00ff_00ff_00ff_00ff;
    let v = (v | (v << 4)) & 0x0f0f_0f0f_0f0f_0f0f;
    let v = (v | (v << 2)) & 0x3333_3333_3333_3333;
    (v | (v << 1)) & 0x5555_5555_5555_5555
}

/// Gathers the bits at even places; the inverse of [`spread_bits`].
#[inline]
pub(crate) const fn gather_bits(v: u64) -> u64 {
    let v = v & 0x5555_5555_5555_5555;
    let v = (v | (v >> 1)) & 0x3333_3333_3333_3333;
    let v = (v | (v >> 2)) & 0x0f0f_0f0f_0f0f_0f0f;
    let v = (v | (v >> 4)) & 0x00ff_00ff_00ff_00ff;
    let v = (v | (v >> 8)) & 0x0000_ffff_0000_ffff;
    (v | (v >> 16)) & 0xffff_ffff
}
