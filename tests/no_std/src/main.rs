//! Links the kernels without std and without an allocator, and calls one of each kind.
//!
//! Exit status 0 if the numbers are right.

#![no_std]
#![no_main]

use core::panic::PanicInfo;
use dust3d_kernels::field::line_of_sight::{ratios_into, ratios_scratch_len};
use dust3d_kernels::healpix::{Nside, ring};
use dust3d_kernels::planck::spectrum::planck_scalar;
use dust3d_kernels::simd::Level;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {}
}

// The C library starts the program and has memset and memcpy; nothing else of it is used.
#[link(name = "c")]
unsafe extern "C" {}

fn right() -> Result<bool, dust3d_kernels::Error> {
    let nside = Nside::new(1024)?;
    let (theta, phi) = ring::pix2ang(nside, 12_345)?;
    let there_and_back = ring::ang2pix(nside, theta, phi)? == 12_345;
    let brightness = planck_scalar(353.0, 19.4);
    let (mut q, mut u) = ([0.0], [0.0]);
    let mut scratch = [0.0; ratios_scratch_len()];
    ratios_into(
        Level::detect(),
        &Default::default(),
        &[0.0, 1.0],
        &[[-1.0, 0.0, 0.0]],
        &mut [&mut q],
        &mut [&mut u],
        &mut scratch,
    )?;
    Ok(there_and_back && brightness > 0.0 && q[0] > 0.0 && u[0] == 0.0)
}

#[unsafe(no_mangle)]
pub extern "C" fn main() -> i32 {
    i32::from(right() != Ok(true))
}
