//! Column densities of shells against a fine trapezoid rule.

use dust3d_kernels::field::Density;
use dust3d_kernels::field::column::columns_into;
use dust3d_kernels::simd::Level;

const R_SUN: f64 = 8.5;

fn unit(l_deg: f64, b_deg: f64) -> [f64; 3] {
    let (l, b) = (l_deg.to_radians(), b_deg.to_radians());
    [b.cos() * l.cos(), b.cos() * l.sin(), b.sin()]
}

/// ∫ n dr by 4000 trapezoids.
fn brute(density: &Density, near: f64, far: f64, [x, y, z]: [f64; 3]) -> f64 {
    let n = 4000;
    let value = |k: usize| {
        let r = near + (far - near) * k as f64 / n as f64;
        density.value((r * x - R_SUN).hypot(r * y), r * z)
    };
    let inner: f64 = (1..n).map(value).sum();
    (inner + 0.5 * (value(0) + value(n))) * (far - near) / n as f64
}

fn half_magnitude_edges() -> Vec<f64> {
    let moduli = (0..=30).map(|k| 4.0 + 0.5 * f64::from(k));
    std::iter::once(0.0)
        .chain(moduli.map(|mu| 10_f64.powf(mu / 5.0 - 2.0)))
        .collect()
}

#[test]
fn naive_directions_columns() {
    let density = Density::default();
    let edges = half_magnitude_edges();
    let mut directions = Vec::new();
    for l in [0.0, 3.0, 40.0, 90.0, 180.0, 271.0] {
        for b in [0.0, 0.5, -3.0, 15.0, -60.0, 90.0] {
            directions.push(unit(l, b));
        }
    }
    for level in Level::available() {
        let mut maps = vec![vec![f64::NAN; directions.len()]; edges.len() - 1];
        let mut out: Vec<&mut [f64]> = maps.iter_mut().map(Vec::as_mut_slice).collect();
        columns_into(level, &density, R_SUN, &edges, &directions, &mut out).expect("valid input");
        for (k, map) in maps.iter().enumerate() {
            let (near, far) = (edges[k], edges[k + 1]);
            for (&direction, &column) in directions.iter().zip(map) {
                // Twenty scale heights up, where the claim of the kernel ends, and next to the cusp at the centre.
                let height = (far * direction[2]).abs();
                let cusp = direction[1].abs() < 0.06 && near < R_SUN + 1.0 && far > R_SUN - 1.0;
                let expected = brute(&density, near, far, direction);
                let bound = if cusp { 1e-2 } else { 1e-6 };
                if height < 2.0 {
                    assert!(
                        (column / expected - 1.0).abs() < bound,
                        "{level} shell {k} towards {direction:?}: {column} for {expected}"
                    );
                } else {
                    assert!((0.0..1e-12).contains(&column), "{column}");
                }
            }
        }
    }
}

#[test]
fn bad_lengths_are_refused() {
    let density = Density::default();
    let mut map = [0.0; 2];
    let mut shell = |edges: &[f64]| {
        let directions = [[1.0, 0.0, 0.0]];
        columns_into(
            Level::detect(),
            &density,
            R_SUN,
            edges,
            &directions,
            &mut [&mut map],
        )
    };
    assert!(shell(&[0.0, 1.0]).is_err());
    assert!(shell(&[0.0, 1.0, 2.0]).is_err());
    assert!(shell(&[]).is_err());
}
