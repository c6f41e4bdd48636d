//! Line-of-sight ratios, density and spiral field.

use dust3d_kernels::field::Model;
use dust3d_kernels::field::line_of_sight::{ratios_into, ratios_scratch_len};
use dust3d_kernels::simd::Level;
use dust3d_tests::sightline;

const EDGES: [f64; 7] = [
    0.0,
    0.063_095_734_448_019_33,
    0.251_188_643_150_958,
    1.0,
    3.981_071_705_534_973,
    15.848_931_924_611_14,
    63.095_734_448_019_33,
];

fn kernel(
    level: Level,
    model: &Model,
    edges: &[f64],
    dirs: &[[f64; 3]],
) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let n = edges.len() - 1;
    let mut q = vec![vec![0.0; dirs.len()]; n];
    let mut u = q.clone();
    let mut scratch = vec![f64::NAN; ratios_scratch_len()];
    let mut qs: Vec<&mut [f64]> = q.iter_mut().map(|x| &mut x[..]).collect();
    let mut us: Vec<&mut [f64]> = u.iter_mut().map(|x| &mut x[..]).collect();
    ratios_into(level, model, edges, dirs, &mut qs, &mut us, &mut scratch).unwrap();
    (q, u)
}

fn dir(lon: f64, lat: f64) -> [f64; 3] {
    [lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin()]
}

#[test]
fn scout() {
    let mut seed = 1u64;
    let mut rnd = || {
        seed = seed
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / 9007199254740992.0
    };
    for case in 0..9 {
        let mut worst: Vec<(f64, f64, f64, usize, Model, Vec<f64>)> = vec![];
        for i in 0..1500 {
            let mut model = Model::default();
            let mut edges = EDGES.to_vec();
            match case {
                1 => model.grains.k = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 4.0, 3.7][i % 8],
                2 => edges = vec![0.0, 63.0],
                3 => {
                    edges = (0..8).map(|_| 25.0 * rnd()).collect();
                    edges.sort_by(f64::total_cmp);
                }
                4 => {
                    model.density.h_z_kpc = 10f64.powf(2.0 - 4.0 * rnd());
                    model.density.h_r_kpc = 10f64.powf(2.0 - 4.0 * rnd());
                }
                5 => {
                    model.spiral.hole_kpc = [0.0, 0.01, 3.0, 9.0][i % 4];
                }
                6 => {
                    model.spiral.r_sun_kpc = 20.0 * rnd() + 0.01;
                }
                7 => {
                    edges = vec![8.4, 8.49, 8.5, 8.51, 8.6];
                }
                8 => {
                    model.grains.k = 3.0 * rnd();
                    edges = vec![0.0, 5.0, 30.0];
                }
                _ => {}
            }
            model.spiral.pitch_rad = if i % 3 == 0 {
                7.0 * (rnd() - 0.5)
            } else {
                -33f64.to_radians()
            };
            let lon = rnd() * 2.0 * std::f64::consts::PI;
            let lat = match i % 4 {
                0 => (2.0 * rnd() - 1.0).asin(),
                1 => 0.0,
                2 => 0.3 * (rnd() - 0.5),
                _ => (10f64).powf(-6.0 * rnd()),
            };
            let lon = match i % 5 {
                0 => 0.3 * (rnd() - 0.5),
                1 => std::f64::consts::PI + 1e-3 * (rnd() - 0.5),
                2 => 10f64.powf(-6.0 * rnd()),
                _ => lon,
            };
            let (q, u) = kernel(Level::detect(), &model, &edges, &[dir(lon, lat)]);
            for j in 0..edges.len() - 1 {
                let [a, b] = sightline::ratios(&model, lon, lat, edges[j], edges[j + 1]);
                let e = (a - q[j][0]).abs().max((b - u[j][0]).abs());
                worst.push((e, lon, lat, j, model, edges.clone()));
            }
        }
        worst.sort_by(|a, b| b.0.total_cmp(&a.0));
        println!("case {case}");
        for w in &worst[..4] {
            println!("{w:?}");
        }
    }
}
