//! Whole maps: means, interpolation, order.

use dust3d_kernels::healpix::missing::{MISSING, is_missing};
use dust3d_kernels::healpix::{Nside, interp, nest2ring, resample, ring, ring2nest};
use dust3d_kernels::simd::Level;
use dust3d_tests::random::Random;

/// Values in (−1, 1), the same on every run.
fn noise(nside: Nside) -> Vec<f64> {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    (0..nside.npix()).map(|_| random.next()).collect()
}

fn with_holes(nside: Nside) -> Vec<f64> {
    let mut map = noise(nside);
    for (pixel, value) in map.iter_mut().enumerate() {
        match pixel % 7 {
            0 | 1 => *value = MISSING,
            2 => *value = f64::NAN,
            _ => {}
        }
    }
    // One whole quarter of the northern cap.
    let n = nside.get() as usize;
    map[..2 * n].fill(MISSING);
    map
}

/// The mean over NESTED children, found by number.
#[test]
fn naive_random_degrade() {
    for (fine, coarse) in [(2, 1), (8, 4), (16, 2), (32, 32), (64, 1), (64, 16)] {
        let (fine, coarse) = (Nside::new(fine).unwrap(), Nside::new(coarse).unwrap());
        let children = fine.npix() / coarse.npix();
        for map in [noise(fine), with_holes(fine)] {
            let mut out = vec![0.0; coarse.npix() as usize];
            for level in Level::available() {
                resample::degrade_ring(level, fine, coarse, &map, &mut out).unwrap();
                for (pixel, &got) in (0..).zip(&out) {
                    let parent = ring2nest(coarse, pixel).unwrap();
                    let values: Vec<f64> = (parent * children..(parent + 1) * children)
                        .map(|child| map[nest2ring(fine, child).unwrap() as usize])
                        .filter(|v| !is_missing(*v))
                        .collect();
                    if values.is_empty() {
                        assert!(is_missing(got));
                    } else {
                        let mean = values.iter().sum::<f64>() / values.len() as f64;
                        assert!((got - mean).abs() < 1e-15 * children as f64, "{got} {mean}");
                    }
                }
            }
        }
    }
}

/// Where Nside is no power of two the parent of a pixel is the one that holds its centre.
#[test]
fn naive_random_degrade_any_ratio() {
    for (fine, coarse) in [(3, 1), (6, 2), (15, 5), (21, 7), (12, 4)] {
        let (fine, coarse) = (Nside::new(fine).unwrap(), Nside::new(coarse).unwrap());
        let map = noise(fine);
        let mut sums = vec![0.0; coarse.npix() as usize];
        for (pixel, value) in (0..).zip(&map) {
            let (theta, phi) = ring::pix2ang(fine, pixel).unwrap();
            // Centres on a coarse edge do not occur: the ratio is odd, or the test below would fail.
            let parent = ring::ang2pix(coarse, theta, phi + 1e-9).unwrap();
            sums[parent as usize] += value;
        }
        let ratio = (fine.get() / coarse.get()).pow(2) as f64;
        if fine.get() / coarse.get() % 2 == 1 {
            let mut out = vec![0.0; coarse.npix() as usize];
            resample::degrade_ring(Level::detect(), fine, coarse, &map, &mut out).unwrap();
            for (got, sum) in out.iter().zip(&sums) {
                assert!((got - sum / ratio).abs() < 1e-14);
            }
        }
    }
}

/// The weighted sum over the stencil of each centre.
#[test]
fn naive_random_upgrade() {
    for (from, to) in [(1, 4), (2, 3), (8, 16), (8, 64), (5, 7), (16, 8)] {
        let (from, to) = (Nside::new(from).unwrap(), Nside::new(to).unwrap());
        for map in [noise(from), with_holes(from)] {
            let mut out = vec![0.0; to.npix() as usize];
            for level in Level::available() {
                resample::upgrade_bilinear_ring(level, from, to, &map, &mut out).unwrap();
                for (pixel, &got) in (0..).zip(&out) {
                    let (theta, phi) = ring::pix2ang(to, pixel).unwrap();
                    let stencil = interp::ring(from, theta, phi).unwrap();
                    let (mut sum, mut weight) = (0.0, 0.0);
                    for (q, w) in stencil.pixels.into_iter().zip(stencil.weights) {
                        let value = map[q as usize];
                        if !is_missing(value) {
                            sum += w * value;
                            weight += w;
                        }
                    }
                    if weight < 1e-12 {
                        assert!(is_missing(got) || weight > 0.0);
                    } else {
                        let tolerance = 1e-13 * from.get() as f64 / weight;
                        assert!((got - sum / weight).abs() < tolerance, "{level} {pixel}");
                    }
                }
            }
        }
    }
}

/// Runs between the same source pixels agree with the stencils pixel by pixel, and have the same bits wherever a range is
/// cut.
#[test]
fn upgrade_by_runs_agrees_with_stencils() {
    for (from, to) in [(4, 64), (8, 16), (3, 48), (16, 17)] {
        let (from, to) = (Nside::new(from).unwrap(), Nside::new(to).unwrap());
        let map = noise(from);
        // One missing pixel far away makes its rings go pixel by pixel, and no other.
        let mut holed = map.clone();
        let equator = map.len() / 2;
        holed[equator] = f64::NAN;
        let npix = to.npix() as usize;
        let (mut runs, mut mixed) = (vec![0.0; npix], vec![0.0; npix]);
        for level in Level::available() {
            resample::upgrade_bilinear_ring(level, from, to, &map, &mut runs).unwrap();
            resample::upgrade_bilinear_ring(level, from, to, &holed, &mut mixed).unwrap();
            let same = runs
                .iter()
                .zip(&mixed)
                .filter(|(a, b)| (*a - *b).abs() < 1e-13);
            let (same, touched) = (same.count(), 2 * npix / (map.len() / 16));
            assert!(same >= npix - touched, "{level}: {same} of {npix}");
            for cut in [1, 97, npix / 3] {
                let mut parts = vec![0.0; npix];
                let (a, b) = parts.split_at_mut(cut);
                resample::upgrade_bilinear_ring_range(level, from, to, &map, 0, a).unwrap();
                resample::upgrade_bilinear_ring_range(level, from, to, &map, cut as u64, b)
                    .unwrap();
                assert!(
                    parts
                        .iter()
                        .zip(&runs)
                        .all(|(a, b)| a.to_bits() == b.to_bits())
                );
            }
        }
    }
}

#[test]
fn equal_nsides_copy_every_bit() {
    let nside = Nside::new(8).unwrap();
    let mut map = with_holes(nside);
    map[5] = f64::from_bits(0x7ff8_0000_0000_1234);
    map[6] = -0.0;
    let mut out = vec![1.0; map.len()];
    resample::degrade_ring(Level::detect(), nside, nside, &map, &mut out).unwrap();
    assert!(
        map.iter()
            .zip(&out)
            .all(|(a, b)| a.to_bits() == b.to_bits())
    );
    out.fill(1.0);
    resample::upgrade_bilinear_ring(Level::detect(), nside, nside, &map, &mut out).unwrap();
    assert!(
        map.iter()
            .zip(&out)
            .all(|(a, b)| a.to_bits() == b.to_bits())
    );
}

#[test]
fn naive_random_reorder() {
    for n in [1, 2, 4, 16, 64, 256] {
        let nside = Nside::new(n).unwrap();
        let map = with_holes(nside);
        for level in Level::available() {
            let (mut nest, mut back) = (vec![0.0; map.len()], vec![0.0; map.len()]);
            resample::to_nested(level, nside, &map, &mut nest).unwrap();
            for (pixel, value) in (0..).zip(&nest) {
                let from = nest2ring(nside, pixel).unwrap() as usize;
                assert_eq!(value.to_bits(), map[from].to_bits());
            }
            resample::to_ring(level, nside, &nest, &mut back).unwrap();
            assert!(
                map.iter()
                    .zip(&back)
                    .all(|(a, b)| a.to_bits() == b.to_bits())
            );
        }
    }
}

/// However a map is cut into ranges, the bits are those of the whole.
#[test]
fn ranges_agree_with_whole_maps() {
    let (fine, coarse) = (Nside::new(16).unwrap(), Nside::new(4).unwrap());
    let (map, level) = (with_holes(fine), Level::detect());
    let small = with_holes(coarse);
    let mut means = vec![0.0; small.len()];
    let mut raised = vec![0.0; map.len()];
    let mut nested = vec![0.0; map.len()];
    resample::degrade_ring(level, fine, coarse, &map, &mut means).unwrap();
    resample::upgrade_bilinear_ring(level, coarse, fine, &small, &mut raised).unwrap();
    resample::to_nested(level, fine, &map, &mut nested).unwrap();
    let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
    for size in [1, 7, 8, 9, 100, 1000] {
        let cut = |whole: &[f64], f: &dyn Fn(u64, &mut [f64])| {
            let mut out = vec![9.0; whole.len()];
            for (k, chunk) in out.chunks_mut(size).enumerate() {
                f((k * size) as u64, chunk);
            }
            assert!(same(&out, whole), "size {size}");
        };
        cut(&means, &|first, out| {
            resample::degrade_ring_range(level, fine, coarse, &map, first, out).unwrap();
        });
        cut(&raised, &|first, out| {
            resample::upgrade_bilinear_ring_range(level, coarse, fine, &small, first, out).unwrap();
        });
        cut(&nested, &|first, out| {
            resample::to_nested_range(level, fine, &map, first, out).unwrap();
        });
        cut(&map, &|first, out| {
            resample::to_ring_range(level, fine, &nested, first, out).unwrap();
        });
    }
}

#[test]
fn closed_form_constants_and_missing() {
    let (fine, coarse) = (Nside::new(32).unwrap(), Nside::new(8).unwrap());
    let level = Level::detect();
    let mut out = vec![0.0; coarse.npix() as usize];
    resample::degrade_ring(
        level,
        fine,
        coarse,
        &vec![3.25; fine.npix() as usize],
        &mut out,
    )
    .unwrap();
    assert!(out.iter().all(|&v| v == 3.25));
    resample::degrade_ring(
        level,
        fine,
        coarse,
        &vec![f64::NAN; fine.npix() as usize],
        &mut out,
    )
    .unwrap();
    assert!(out.iter().all(|&v| v == MISSING));
    let mut up = vec![0.0; fine.npix() as usize];
    resample::upgrade_bilinear_ring(level, coarse, fine, &out, &mut up).unwrap();
    assert!(up.iter().all(|&v| v == MISSING));
    out.fill(2.5);
    resample::upgrade_bilinear_ring(level, coarse, fine, &out, &mut up).unwrap();
    assert!(up.iter().all(|&v| (v - 2.5).abs() < 2e-15));
}
