//! Rotation of harmonic coefficients: what holds of every rotation. (Against healpy: see `fits`.)

use dust3d::kernels::Complex;
use dust3d::kernels::sht::alm;
use dust3d::sht::rotate_alms;
use dust3d_tests::random::Random;

fn coefficients(lmax: usize, seed: u64) -> Vec<Complex<f64>> {
    let mut random = Random(seed);
    let mut next = || 0.5 * random.next();
    (0..alm::len(lmax))
        // m = 0 is real: the first lmax + 1.
        .map(|index| Complex::new(next(), if index <= lmax { 0.0 } else { next() }))
        .collect()
}

fn largest_difference(a: &[Complex<f64>], b: &[Complex<f64>]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max)
}

#[test]
fn prop_there_and_back_rotate_alms() {
    for (lmax, bound) in [(0, 0.0), (1, 1e-15), (2, 1e-15), (33, 1e-13), (300, 1e-12)] {
        let before = coefficients(lmax, 3);
        let mut after = before.clone();
        let [a, b, c] = [0.3, 1.1, -2.2];
        rotate_alms(&mut [&mut after], lmax, [a, b, c]).expect("lengths");
        if lmax > 0 {
            assert!(largest_difference(&before, &after) > 0.1);
        }
        // Σ_m |a_lm|² of every degree stays.
        for l in 0..=lmax {
            let power = |alm: &[Complex<f64>]| {
                let at = |m| alm[alm::index(lmax, l, m)].norm_sqr();
                at(0) + 2.0 * (1..=l).map(at).sum::<f64>()
            };
            assert!(
                (power(&after) / power(&before) - 1.0).abs() < 1e-12,
                "l = {l}"
            );
        }
        rotate_alms(&mut [&mut after], lmax, [-c, -b, -a]).expect("lengths");
        let difference = largest_difference(&before, &after);
        assert!(difference <= bound, "lmax = {lmax}: {difference:e}");
    }
}

/// Y_1m transforms as a vector does: R_z(α) R_y(β) of the z axis is (sin β cos α, sin β sin α, cos β).
#[test]
fn exact_dipole_rotate_alms() {
    let mut dipole = vec![Complex::new(0.0, 0.0); 3];
    dipole[1] = Complex::new(1.0, 0.0);
    let (alpha, beta) = (0.7_f64, 2.1_f64);
    rotate_alms(&mut [&mut dipole], 1, [alpha, beta, 0.4]).expect("lengths");
    // a_10 ∝ z, a_11 ∝ −(x − iy)/√2.
    let wanted = Complex::from_polar(-beta.sin() / 2.0_f64.sqrt(), -alpha);
    assert!((dipole[1].re - beta.cos()).abs() < 1e-15 && dipole[1].im.abs() < 1e-15);
    assert!(
        (dipole[2] - wanted).norm() < 1e-15,
        "{} {wanted}",
        dipole[2]
    );
}

#[test]
fn prop_one_by_one_rotate_alms() {
    let lmax = 150;
    let (mut a, mut b) = (coefficients(lmax, 1), coefficients(lmax, 2));
    let (mut c, mut d) = (a.clone(), b.clone());
    let euler = [2.0, 0.5, 1.0];
    rotate_alms(&mut [&mut a, &mut b], lmax, euler).expect("lengths");
    rotate_alms(&mut [&mut c], lmax, euler).expect("lengths");
    rotate_alms(&mut [&mut d], lmax, euler).expect("lengths");
    assert!(a == c && b == d);
    assert!(rotate_alms(&mut [&mut a], lmax + 1, euler).is_err());
}
