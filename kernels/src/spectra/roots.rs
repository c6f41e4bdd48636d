//! Square roots of the 2×2 covariance of two fields at one multipole.
//!
//! The lower-triangular (Cholesky) root leaves the first field a multiple of itself, so whitening with one covariance
//! and recolouring with another that has the same first variance does not touch it. \[MKD18\], eq. for a^final, which
//! leaves the kind of root open.

use crate::scalar::sqrt;

/// Covariance of two fields (x, y).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cov2 {
    /// ⟨x x⟩ ≥ 0.
    pub xx: f64,
    /// ⟨x y⟩.
    pub xy: f64,
    /// ⟨y y⟩ ≥ 0.
    pub yy: f64,
}

/// A lower-triangular matrix: (x, y) → (`a` x, `b` x + `c` y).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lower2 {
    /// Row 1, column 1.
    pub a: f64,
    /// Row 2, column 1.
    pub b: f64,
    /// Row 2, column 2.
    pub c: f64,
}

impl Cov2 {
    /// Correlation coefficient, within ±1; zero where a variance is not positive.
    #[must_use]
    pub fn correlation(&self) -> f64 {
        if self.xx > 0.0 && self.yy > 0.0 {
            (self.xy / (sqrt(self.xx) * sqrt(self.yy))).clamp(-1.0, 1.0)
        } else {
            0.0
        }
    }

    /// The lower-triangular L with L Lᵀ = this covariance; zero rows for variances that are not positive.
    #[must_use]
    pub fn root(&self) -> Lower2 {
        let (sx, sy) = (sqrt(self.xx.max(0.0)), sqrt(self.yy.max(0.0)));
        let rho = self.correlation();
        Lower2 {
            a: sx,
            b: rho * sy,
            c: sqrt((1.0 - rho) * (1.0 + rho)) * sy,
        }
    }

    /// M = L_target · L_self⁻¹: takes fields of this covariance to fields of covariance `target`.
    ///
    /// Where this covariance is singular nothing can be made of the missing direction: its column is zero.
    #[must_use]
    pub fn recolour(&self, target: &Self) -> Lower2 {
        let (from, to) = (self.root(), target.root());
        let over = |x: f64, y: f64| if y > 0.0 { x / y } else { 0.0 };
        let c = over(to.c, from.c);
        Lower2 {
            a: over(to.a, from.a),
            b: over(to.b - c * from.b, from.a),
            c,
        }
    }
}

impl Lower2 {
    /// The transformed pair.
    #[must_use]
    pub fn apply(&self, x: f64, y: f64) -> (f64, f64) {
        (self.a * x, self.b * x + self.c * y)
    }
}
