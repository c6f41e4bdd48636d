//! Evaluates the magnetic field along one line of sight, and what the dust on it makes of it layer by layer.
//!
//! `cargo run --release -p dust3d-kernels --example line_of_sight -- 120 -5` looks to l = 120°, b = −5°.

use dust3d_kernels::Error;
use dust3d_kernels::field::Model;
use dust3d_kernels::field::line_of_sight::{ratios_into, ratios_scratch_len};
use dust3d_kernels::scalar::sin_cos;
use dust3d_kernels::simd::Level;

fn main() -> Result<(), Error> {
    let degrees: Vec<f64> = std::env::args()
        .skip(1)
        .filter_map(|text| text.parse().ok())
        .collect();
    let (l_deg, b_deg) = match degrees.as_slice() {
        [l, b] => (*l, *b),
        _ => (120.0, -5.0),
    };
    let (sin_l, cos_l) = sin_cos(l_deg.to_radians());
    let (sin_b, cos_b) = sin_cos(b_deg.to_radians());
    let sight = [cos_b * cos_l, cos_b * sin_l, sin_b];

    // The Sun is at x = −8.5 kpc; the field points to l = 90° + q there.
    let mut model = Model::default();
    model.spiral.pitch_rad = f64::to_radians(-33.0);
    println!(
        "l = {l_deg}°, b = {b_deg}°, pitch angle −33°\n\nd (kpc)   density   Bx      By      Bz (µG)"
    );
    for d in [0.0, 0.1, 0.3, 1.0, 3.0, 10.0] {
        let [x, y, z] = [0, 1, 2].map(|i| d * sight[i]);
        let place = [x - model.spiral.r_sun_kpc, y, z];
        let radius = place[0].hypot(place[1]);
        let [bx, by, bz] = model.spiral.field_ug(place);
        let density = model.density.value(radius, z);
        println!("{d:7.2} {density:9.2e} {bx:7.3} {by:7.3} {bz:7.3}");
        assert_eq!(bz, 0.0, "the field of the model lies in the plane");
    }

    // Q/I and U/I of the six layers of the paper: the arrays are the caller's, nothing is allocated by the kernel.
    let edges_kpc = [0.0, 0.063, 0.251, 1.0, 3.981, 15.849, 63.096];
    let mut q = [[0.0; 1]; 6];
    let mut u = [[0.0; 1]; 6];
    let mut scratch = vec![0.0; ratios_scratch_len()];
    ratios_into(
        Level::detect(),
        &model,
        &edges_kpc,
        &[sight],
        &mut q.each_mut().map(|map| map.as_mut_slice()),
        &mut u.each_mut().map(|map| map.as_mut_slice()),
        &mut scratch,
    )?;
    println!("\nlayer   from       to (kpc)     Q/I       U/I");
    for (layer, (q, u)) in q.iter().zip(&u).enumerate() {
        let (near, far) = (edges_kpc[layer], edges_kpc[layer + 1]);
        println!(
            "{:5} {near:8.3} {far:8.3} {:13.5} {:9.5}",
            layer + 1,
            q[0],
            u[0]
        );
        assert!(q[0].hypot(u[0]) <= model.grains.p0, "no more than p0");
    }
    Ok(())
}
