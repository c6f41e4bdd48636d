//! Reproducible numbers that depend on nothing else.

use dust3d_kernels::Complex;
use dust3d_kernels::sht::alm;

/// A linear congruential generator (Knuth's constants): the seed, then the state.
pub struct Random(pub u64);

impl Random {
    /// 53 random bits.
    pub const fn bits(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 11
    }

    /// A number from −1 to 1.
    pub const fn next(&mut self) -> f64 {
        self.bits() as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A whole number below `bound`.
    pub const fn below(&mut self, bound: usize) -> usize {
        (self.bits() >> 22) as usize % bound
    }

    /// A map of numbers from −1 to 1.
    pub fn map(&mut self, npix: usize) -> Vec<f64> {
        (0..npix).map(|_| self.next()).collect()
    }

    /// Coefficients of a real map, zero below l = `first`.
    pub fn alm(&mut self, lmax: usize, first: usize) -> Vec<Complex<f64>> {
        let mut a = vec![Complex::default(); alm::len(lmax)];
        for m in 0..=lmax {
            for l in m.max(first)..=lmax {
                let im = if m > 0 { self.next() } else { 0.0 };
                a[alm::index(lmax, l, m)] = Complex::new(self.next(), im);
            }
        }
        a
    }
}
