//! Fit of a modified blackbody to every pixel: τ, T, β from intensities at three frequencies or more.
//!
//! Minimised, over τ > 0, 5 K ≤ T ≤ 60 K and 0 ≤ β ≤ 4, is
//!
//! ```text
//! χ² = Σ_ν ((m_ν/I_ν − 1)/σ_ν)²,   m_ν = τ (ν/ν₀)^β B_ν(T)
//! ```
//!
//! with σ_ν the *relative* error of frequency ν. A minimum on a bound is a solution.
//!
//! # Method
//! * **τ is linear** and eliminated: with u_ν = m_ν/(τ I_ν σ_ν) and w_ν = 1/σ_ν, τ = u·w/u·u.
//! * **Start.** For small errors ln m replaces m, and the problem is linear in (ln τ, β) for given T. What is left of ln I
//!   after the projection on these two (n − 2 numbers per pixel) is compared with the same for B_ν(T) on a logarithmic
//!   grid of T, tabulated once; β is held to its bounds by the penalty it costs. The best grid point is the start: the
//!   global minimum of the logarithmic problem, at five operations a grid point.
//! * **Newton's method** on (y, β), y = 1/T, with τ eliminated: gradient and Hessian of χ²/2 are closed sums over the
//!   frequencies (with d = 1 − e^−x, D = x/d: ∂ln m/∂ln y = −D and y² ∂² ln m/∂y² = D²e^−x), so the second derivatives
//!   cost no exponential. In y the Wien side is exactly exponential, which is why y and not T. Where the Hessian is not
//!   positive definite, Gauss & Newton's is taken.
//! * **Bounds.** The step minimises the quadratic model in the box: inside by Cramer's rule, else the best of the four
//!   edges. So the active bounds are found and released exactly, and convergence is quadratic on a bound as well.
//! * **Step control.** A step that does not lower χ² is quartered.
//! * **Convergence.** |ΔT|/T and |Δβ|/max(β, 1) of a full step below 1e-8; the step is still taken, so the error is the
//!   square of it.
//!
//! ```text
//! for each eight pixels:
//!     start from the grid
//!     repeat: evaluate at the trial point; accept or quarter; new step; note lanes that have converged
//!     until all have, at most 60 times
//! ```
//!
//! Lanes that have converged idle until their seven neighbours have: on data with the errors of Planck all need three to
//! five evaluations, of two exponentials per frequency each.
//!
//! # Accuracy
//! Noise-free data return their parameters to 1e-8; on noisy data the minimum is that of a general bounded least-squares
//! program to 1e-6 (tolerance table, rows `mbb_fit…`). The optical depth is at ν₀ = 353 GHz.
//!
//! # Source
//! \[MKD18\] fit Planck's frequencies so; weights relative to the data and the elimination of τ (variable projection, Golub
//! & Pereyra, SIAM J. Numer. Anal. 10, 413, 1973) are ours.

use crate::planck::spectrum::{check_frequency, decay, x_kelvin};
use crate::simd::math::{exp2, ln, one_minus_exp2};
use crate::simd::{Lanes, Level, Mask};
use crate::units::{NU_100UM_GHZ, NU0_GHZ, TWO_H_OVER_C2};
use crate::{Error, dispatch, scalar};

/// The most frequencies a fit can take.
pub const MAX_FREQUENCIES: usize = 16;
/// Bounds of the temperature, K.
pub const T_BOUNDS: [f64; 2] = [5.0, 60.0];
/// Bounds of the spectral index.
pub const BETA_BOUNDS: [f64; 2] = [0.0, 4.0];
/// A pixel with a larger χ² is not a modified blackbody.
pub const MAX_CHI2: f64 = 50.0;
/// The frequencies of \[MKD18\]: Planck's 353, 545, 857 GHz and IRAS' 100 µm.
pub const DEFAULT_NU_GHZ: [f64; 4] = [353.0, 545.0, 857.0, NU_100UM_GHZ];
/// Relative errors of the four.
pub const DEFAULT_SIGMA: [f64; 4] = [0.0078, 0.061, 0.064, 0.135];

const Y_LO: f64 = 1.0 / T_BOUNDS[1];
const Y_HI: f64 = 1.0 / T_BOUNDS[0];
const GRID: usize = 64;
const MAX_ITERATIONS: usize = 60;
const STEP_TOLERANCE: f64 = 1e-8;

/// What became of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FitStatus {
    /// A minimum was found, inside or on a bound.
    Fitted,
    /// An intensity is missing (NaN, infinite) or not positive.
    Missing,
    /// No minimum to the required step within the iterations.
    Unconverged,
    /// The minimum has χ² > [`MAX_CHI2`].
    PoorFit,
}

/// The fit of one pixel. τ, T, β are NaN unless the status is [`FitStatus::Fitted`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelFit {
    /// Optical depth at ν₀.
    pub tau: f64,
    /// Temperature, K.
    pub t_kelvin: f64,
    /// Spectral index.
    pub beta: f64,
    /// χ² at the minimum; NaN where there is none.
    pub chi2: f64,
    /// What became of the pixel.
    pub status: FitStatus,
}

/// How many pixels ended how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FitCounts {
    /// [`FitStatus::Fitted`].
    pub fitted: u64,
    /// [`FitStatus::Missing`].
    pub missing: u64,
    /// [`FitStatus::Unconverged`].
    pub unconverged: u64,
    /// [`FitStatus::PoorFit`].
    pub poor: u64,
}

impl FitCounts {
    /// All pixels.
    #[must_use]
    pub const fn total(self) -> u64 {
        self.fitted + self.missing + self.unconverged + self.poor
    }
}

impl core::ops::AddAssign for FitCounts {
    fn add_assign(&mut self, other: Self) {
        self.fitted += other.fitted;
        self.missing += other.missing;
        self.unconverged += other.unconverged;
        self.poor += other.poor;
    }
}

/// A fit prepared for given frequencies and errors: some 10 kB of tables, no allocation.
///
/// ```
/// use dust3d_kernels::fit::mbb::{FitStatus, MbbFit};
/// use dust3d_kernels::planck::spectrum::planck_scalar;
///
/// let nu = [353.0, 545.0, 857.0, 2997.92458];
/// let intensity = nu.map(|n: f64| 1e-5 * (n / 353.0).powf(1.6) * planck_scalar(n, 19.4));
/// let fit = MbbFit::default().fit_pixel(&intensity)?;
/// assert_eq!(fit.status, FitStatus::Fitted);
/// assert!((fit.t_kelvin - 19.4).abs() < 1e-8 && (fit.beta - 1.6).abs() < 1e-8);
/// assert!((fit.tau / 1e-5 - 1.0).abs() < 1e-8);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct MbbFit {
    n: usize,
    nu_ghz: [f64; MAX_FREQUENCIES],
    sigma: [f64; MAX_FREQUENCIES],
    /// hν/k, K.
    x_kelvin: [f64; MAX_FREQUENCIES],
    /// −hν/k log₂ e, K.
    decay: [f64; MAX_FREQUENCIES],
    /// ln(ν/ν₀).
    ln_ratio: [f64; MAX_FREQUENCIES],
    /// log₂(ν/ν₀).
    log2_ratio: [f64; MAX_FREQUENCIES],
    /// 1/σ.
    weight: [f64; MAX_FREQUENCIES],
    /// (ν/ν_first)³/σ.
    front: [f64; MAX_FREQUENCIES],
    /// 1/(2hν³/c²) of the first frequency.
    tau_scale: f64,
    /// What χ² may rise by in a step: rounding of the residuals.
    rounding: f64,
    start: StartTable,
}

/// Tables of the logarithmic problem (module header, *Start*).
#[derive(Debug, Clone)]
struct StartTable {
    /// Row 0 gives β from ln I; rows 1 … n − 2 the coordinates that neither τ nor β can change.
    projection: [[f64; MAX_FREQUENCIES]; MAX_FREQUENCIES],
    /// The same coordinates of ln B_ν(T) on the grid.
    grid: [[f64; MAX_FREQUENCIES]; GRID],
    /// 1/T on the grid.
    y: [f64; GRID],
    /// What a unit of β beyond its bound costs in χ².
    stiffness: f64,
}

impl Default for MbbFit {
    /// The frequencies and errors of \[MKD18\].
    fn default() -> Self {
        let empty = Self::empty();
        Self::new(&DEFAULT_NU_GHZ, &DEFAULT_SIGMA).unwrap_or(empty)
    }
}

impl MbbFit {
    const fn empty() -> Self {
        Self {
            n: 0,
            nu_ghz: [0.0; MAX_FREQUENCIES],
            sigma: [0.0; MAX_FREQUENCIES],
            x_kelvin: [0.0; MAX_FREQUENCIES],
            decay: [0.0; MAX_FREQUENCIES],
            ln_ratio: [0.0; MAX_FREQUENCIES],
            log2_ratio: [0.0; MAX_FREQUENCIES],
            weight: [0.0; MAX_FREQUENCIES],
            front: [0.0; MAX_FREQUENCIES],
            tau_scale: 0.0,
            rounding: 0.0,
            start: StartTable {
                projection: [[0.0; MAX_FREQUENCIES]; MAX_FREQUENCIES],
                grid: [[0.0; MAX_FREQUENCIES]; GRID],
                y: [0.0; GRID],
                stiffness: 0.0,
            },
        }
    }

    /// Prepares the fit of intensities at `nu_ghz` (GHz, in any order) with relative errors `sigma`.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are 3 … 16 frequencies and as many errors; [`Error::Domain`] for a frequency outside
    /// 1 … 100000 GHz, fewer than three different ones, or an error outside 1e-9 … 1e9.
    pub fn new(nu_ghz: &[f64], sigma: &[f64]) -> Result<Self, Error> {
        let n = nu_ghz.len();
        Error::check_scratch("frequencies of the fit", 3, n)?;
        if n > MAX_FREQUENCIES {
            Error::check_len("frequencies of the fit", MAX_FREQUENCIES, n)?;
        }
        Error::check_len("relative errors of the fit", n, sigma.len())?;
        let mut fit = Self::empty();
        fit.n = n;
        let first = nu_ghz.first().copied().unwrap_or(f64::NAN);
        fit.tau_scale = 1.0 / (TWO_H_OVER_C2 * first * first * first);
        let mut different = 0;
        for (i, (&nu, &s)) in nu_ghz.iter().zip(sigma).enumerate() {
            check_frequency(nu)?;
            if !(1.0..=1e5).contains(&nu) {
                return Err(Error::Domain {
                    what: "frequency of the fit in GHz (1 to 100000)",
                    value: nu,
                });
            }
            if !(1e-9..=1e9).contains(&s) {
                return Err(Error::Domain {
                    what: "relative error of the fit (1e-9 to 1e9)",
                    value: s,
                });
            }
            different += usize::from(!nu_ghz.iter().take(i).any(|&other| other == nu));
            let r = nu / first;
            for (array, value) in [
                (&mut fit.nu_ghz, nu),
                (&mut fit.sigma, s),
                (&mut fit.x_kelvin, x_kelvin(nu).0),
                (&mut fit.decay, decay(nu)),
                (&mut fit.ln_ratio, scalar::ln(nu / NU0_GHZ)),
                (&mut fit.log2_ratio, scalar::log2(nu / NU0_GHZ)),
                (&mut fit.weight, 1.0 / s),
                (&mut fit.front, r * r * r / s),
            ] {
                if let Some(slot) = array.get_mut(i) {
                    *slot = value;
                }
            }
        }
        if different < 3 {
            return Err(Error::Domain {
                what: "different frequencies of the fit (at least 3)",
                value: f64::from(u8::try_from(different).unwrap_or(u8::MAX)),
            });
        }
        fit.rounding = 1e-28 * dot(&fit.weight, &fit.weight);
        fit.tabulate_start();
        Ok(fit)
    }

    /// The frequencies, GHz.
    #[must_use]
    pub fn frequencies(&self) -> &[f64] {
        self.nu_ghz.get(..self.n).unwrap_or(&[])
    }

    /// The relative errors.
    #[must_use]
    pub fn sigma(&self) -> &[f64] {
        self.sigma.get(..self.n).unwrap_or(&[])
    }

    /// Fills the tables of the start.
    fn tabulate_start(&mut self) {
        let n = self.n;
        let (w, l) = (self.weight, self.ln_ratio);
        // Orthonormal basis of the weighted data space: the constant, what ln ν adds to it, then the rest by Gram and
        // Schmidt from the unit vectors, each orthogonalised twice and the weakest left out.
        let mut basis = [[0.0; MAX_FREQUENCIES]; MAX_FREQUENCIES];
        basis[0] = normalised(w).0;
        let mut slope = [0.0; MAX_FREQUENCIES];
        for ((s, w), l) in slope.iter_mut().zip(w).zip(l) {
            *s = w * l;
        }
        let (unit, norm) = normalised(without(without(slope, &basis, 1), &basis, 1));
        basis[1] = unit;
        let mut used = [false; MAX_FREQUENCIES];
        for j in 2..n.min(MAX_FREQUENCIES) {
            let mut best = ([0.0; MAX_FREQUENCIES], 0.0, 0);
            for (i, &taken) in used.iter().enumerate().take(n) {
                let mut e = [0.0; MAX_FREQUENCIES];
                e[i] = 1.0;
                let (v, size) = normalised(without(without(e, &basis, j), &basis, j));
                if !taken && size > best.1 {
                    best = (v, size, i);
                }
            }
            basis[j] = best.0;
            used[best.2] = true;
        }
        let table = &mut self.start;
        table.stiffness = norm * norm;
        for (row, vector) in table.projection.iter_mut().zip(basis.iter().skip(1)) {
            for ((p, b), w) in row.iter_mut().zip(vector).zip(w) {
                *p = b * w;
            }
        }
        for p in &mut table.projection[0] {
            *p /= norm;
        }
        let ratio = scalar::ln(T_BOUNDS[1] / T_BOUNDS[0]) / (GRID - 1) as f64;
        for (g, (row, y)) in table.grid.iter_mut().zip(&mut table.y).enumerate() {
            *y = scalar::exp(g as f64 * ratio) / T_BOUNDS[1];
            let mut log_b = [0.0; MAX_FREQUENCIES];
            for (i, b) in log_b.iter_mut().enumerate().take(n) {
                let x = self.x_kelvin[i] * *y;
                let front = self.front[i] / w[i];
                *b = scalar::ln(front) - x - scalar::ln(-scalar::expm1(-x));
            }
            for (r, p) in row.iter_mut().zip(&table.projection).take(n - 1) {
                *r = dot(p, &log_b);
            }
        }
    }

    /// Fits one pixel: the same arithmetic on the portable level.
    ///
    /// # Errors
    /// [`Error::Length`] for another number of intensities than of frequencies.
    pub fn fit_pixel(&self, intensity: &[f64]) -> Result<PixelFit, Error> {
        Error::check_len("intensities of the fit", self.n, intensity.len())?;
        let mut maps: [&[f64]; MAX_FREQUENCIES] = [&[]; MAX_FREQUENCIES];
        for (map, i) in maps.iter_mut().zip(intensity) {
            *map = core::slice::from_ref(i);
        }
        let (mut tau, mut t, mut beta, mut chi2) = ([0.0], [0.0], [0.0], [0.0]);
        let counts = fit_into(
            Level::portable(),
            self,
            maps.get(..self.n).unwrap_or(&[]),
            &mut tau,
            &mut t,
            &mut beta,
            Some(&mut chi2),
        )?;
        Ok(PixelFit {
            tau: tau[0],
            t_kelvin: t[0],
            beta: beta[0],
            chi2: chi2[0],
            status: if counts.fitted > 0 {
                FitStatus::Fitted
            } else if counts.missing > 0 {
                FitStatus::Missing
            } else if counts.poor > 0 {
                FitStatus::PoorFit
            } else {
                FitStatus::Unconverged
            },
        })
    }
}

/// Fits every pixel.
///
/// | argument | shape | unit | domain |
/// | --- | --- | --- | --- |
/// | `maps` | n_freq × n_pix, in the order of [`MbbFit::new`] | MJy/sr | > 0; else the pixel is missing |
/// | `tau`, `t`, `beta` | n_pix | at 353 GHz, K, 1 | overwritten; NaN where there is no fit |
/// | `chi2` | n_pix, if wanted | | overwritten; NaN where there is no minimum |
///
/// # Errors
/// [`Error::Length`] for another number of maps than of frequencies, or unequal lengths.
pub fn fit_into(
    level: Level,
    fit: &MbbFit,
    maps: &[&[f64]],
    tau: &mut [f64],
    t: &mut [f64],
    beta: &mut [f64],
    chi2: Option<&mut [f64]>,
) -> Result<FitCounts, Error> {
    let n = tau.len();
    Error::check_len("maps of the fit", fit.n, maps.len())?;
    for map in maps {
        Error::check_len("map of the fit", n, map.len())?;
    }
    Error::check_len("t", n, t.len())?;
    Error::check_len("beta", n, beta.len())?;
    if let Some(chi2) = &chi2 {
        Error::check_len("chi2", n, chi2.len())?;
    }
    let mut out = Outputs { tau, t, beta, chi2 };
    Ok(dispatch!(level, |token: L| match fit.n {
        3 => fit_maps::<L, 3>(token, fit, maps, &mut out),
        4 => fit_maps::<L, 4>(token, fit, maps, &mut out),
        _ => fit_maps::<L, 0>(token, fit, maps, &mut out),
    }))
}

type Vector = [f64; MAX_FREQUENCIES];

fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// (v/|v|, |v|); zero stays zero.
fn normalised(v: Vector) -> (Vector, f64) {
    let norm = scalar::sqrt(dot(&v, &v));
    if norm > 0.0 {
        (v.map(|x| x / norm), norm)
    } else {
        (v, 0.0)
    }
}

/// v without its components along the first `count` basis vectors.
fn without(mut v: Vector, basis: &[Vector; MAX_FREQUENCIES], count: usize) -> Vector {
    for b in basis.iter().take(count) {
        let along = dot(&v, b);
        for (v, b) in v.iter_mut().zip(b) {
            *v -= along * b;
        }
    }
    v
}

/// The maps a fit fills.
struct Outputs<'a> {
    tau: &'a mut [f64],
    t: &'a mut [f64],
    beta: &'a mut [f64],
    chi2: Option<&'a mut [f64]>,
}

/// All pixels; `N` frequencies if `N > 0`, else those of the fit.
#[inline(always)]
fn fit_maps<L: Lanes, const N: usize>(
    token: L::Token,
    fit: &MbbFit,
    maps: &[&[f64]],
    out: &mut Outputs<'_>,
) -> FitCounts {
    let mut counts = FitCounts::default();
    for start in (0..out.tau.len()).step_by(8) {
        let mut intensity = [L::splat(token, 1.0); MAX_FREQUENCIES];
        for (i, map) in intensity.iter_mut().zip(maps) {
            *i = L::load_padded(token, map.get(start..).unwrap_or(&[]), 1.0);
        }
        let solved = fit_eight::<L, N>(token, fit, &intensity);
        let nan = L::splat(token, f64::NAN);
        let poor = solved.chi2.gt(L::splat(token, MAX_CHI2));
        let good = solved.converged & !poor;
        for (values, map) in [
            (solved.tau, &mut *out.tau),
            (
                L::select(
                    solved.y.le(L::splat(token, Y_LO)),
                    L::splat(token, T_BOUNDS[1]),
                    L::splat(token, 1.0) / solved.y,
                ),
                &mut *out.t,
            ),
            (solved.beta, &mut *out.beta),
        ] {
            let to = map.get_mut(start..).unwrap_or(&mut []);
            L::select(good, values, nan).store_padded(to);
        }
        if let Some(chi2) = &mut out.chi2 {
            let to = chi2.get_mut(start..).unwrap_or(&mut []);
            L::select(solved.converged, solved.chi2, nan).store_padded(to);
        }
        let lanes = (out.tau.len() - start).min(8);
        let lanes = (0xff_u8) >> (8 - lanes);
        let count = |bits: u8| u64::from((bits & lanes).count_ones());
        counts += FitCounts {
            fitted: count(good.bits()),
            missing: count(!solved.present.bits()),
            poor: count((solved.converged & poor).bits()),
            unconverged: count((solved.present & !solved.converged).bits()),
        };
    }
    counts
}

/// Eight fits.
struct Solved<L: Lanes> {
    tau: L,
    y: L,
    beta: L,
    chi2: L,
    present: L::Mask,
    converged: L::Mask,
}

/// χ²/2 with τ eliminated at (y, β): value, gradient and Hessian in (ln y, β) as steps of y(1 + t), β + b.
#[derive(Clone, Copy)]
struct Local<L> {
    chi2: L,
    tau: L,
    gradient: [L; 2],
    /// tt, tb, bb; positive definite.
    hessian: [L; 3],
    /// −∂ln τ/∂(t, b).
    tau_slope: [L; 2],
}

impl<L: Lanes> Local<L> {
    /// Evaluates at (y, β); `front` is (ν/ν_first)³ I_first/(I σ).
    #[inline(always)]
    fn new<const N: usize>(
        token: L::Token,
        fit: &MbbFit,
        front: &[L; MAX_FREQUENCIES],
        y: L,
        beta: L,
    ) -> Self {
        let n = if N > 0 { N } else { fit.n.min(MAX_FREQUENCIES) };
        let c = |v: f64| L::splat(token, v);
        let (zero, one) = (c(0.0), c(1.0));
        let mut u = [zero; MAX_FREQUENCIES];
        let mut a = [zero; MAX_FREQUENCIES];
        let mut curvature = [zero; MAX_FREQUENCIES];
        let (mut uu, mut uw) = (zero, zero);
        for i in 0..n {
            let x = c(fit.x_kelvin[i]) * y;
            let d = one_minus_exp2(token, c(fit.decay[i]), y);
            let inverse = one / d;
            let falling = c(fit.decay[i]) * y;
            let e = exp2(token, beta.mul_add(c(fit.log2_ratio[i]), falling));
            u[i] = front[i] * e * inverse;
            uu = u[i].mul_add(u[i], uu);
            uw = u[i].mul_add(c(fit.weight[i]), uw);
            a[i] = -(x * inverse);
            curvature[i] = a[i] * a[i] * (one - d);
        }
        let tau = uw / uu;
        // q = m/(Iσ), r = q − w. Centred on the q²-weighted means Σq²a vanishes, and with it most cancellation.
        let (mut qa, mut ql, mut qq) = (zero, zero, zero);
        for i in 0..n {
            let q = tau * u[i];
            u[i] = q;
            let q2 = q * q;
            qq += q2;
            qa = q2.mul_add(a[i], qa);
            ql = q2.mul_add(c(fit.ln_ratio[i]), ql);
        }
        let over = one / qq;
        let (mean_a, mean_l) = (qa * over, ql * over);
        let mut chi2 = zero;
        let mut g = [zero; 2];
        let mut gauss = [zero; 3];
        let mut second = [zero; 3];
        for i in 0..n {
            let q = u[i];
            let r = q - c(fit.weight[i]);
            chi2 = r.mul_add(r, chi2);
            let (q2, rq) = (q * q, r * q);
            let (da, dl) = (a[i] - mean_a, c(fit.ln_ratio[i]) - mean_l);
            let products = [da * da, da * dl, dl * dl];
            g[0] = rq.mul_add(da, g[0]);
            g[1] = rq.mul_add(dl, g[1]);
            for ((gauss, second), product) in gauss.iter_mut().zip(&mut second).zip(products) {
                *gauss = q2.mul_add(product, *gauss);
                *second = rq.mul_add(product, *second);
            }
            second[0] = rq.mul_add(curvature[i], second[0]);
        }
        let g_over = [g[0] * over, g[1] * over];
        let newton = [
            gauss[0] + (second[0] - g[0] * g_over[0]),
            gauss[1] + (second[1] - g[0] * g_over[1]),
            gauss[2] + (second[2] - g[1] * g_over[1]),
        ];
        // Newton's Hessian where it is safely positive definite, else Gauss & Newton's, kept regular.
        let determinant = |h: &[L; 3]| h[0].mul_sub(h[2], h[1] * h[1]);
        let share = c(0.01);
        let safe = newton[0].gt(share * gauss[0])
            & newton[2].gt(share * gauss[2])
            & determinant(&newton).gt(share * determinant(&gauss));
        let ridge = c(1.0 + 1e-9);
        let hessian = [
            L::select(safe, newton[0], gauss[0] * ridge),
            L::select(safe, newton[1], gauss[1]),
            L::select(safe, newton[2], gauss[2] * ridge),
        ];
        Self {
            chi2,
            tau,
            gradient: g,
            hessian,
            tau_slope: [mean_a + g_over[0], mean_l + g_over[1]],
        }
    }

    /// The step (t, b) that minimises the quadratic model in the box.
    #[inline(always)]
    fn step(&self, token: L::Token, y: L, beta: L) -> [L; 2] {
        let c = |v: f64| L::splat(token, v);
        let [g0, g1] = self.gradient;
        let [h00, h01, h11] = self.hessian;
        let over = c(1.0) / h00.mul_sub(h11, h01 * h01);
        let t = h01.mul_sub(g1, h11 * g0) * over;
        let b = h01.mul_sub(g0, h00 * g1) * over;
        let inverse_y = c(1.0) / y;
        let (t_lo, t_hi) = (
            c(Y_LO).mul_sub(inverse_y, c(1.0)),
            c(Y_HI).mul_sub(inverse_y, c(1.0)),
        );
        let (b_lo, b_hi) = (c(BETA_BOUNDS[0]) - beta, c(BETA_BOUNDS[1]) - beta);
        let inside = t.ge(t_lo) & t.le(t_hi) & b.ge(b_lo) & b.le(b_hi);
        if inside.all() {
            return [t, b];
        }
        // The minimum in a box is inside or the least of those on the four edges.
        let model = |t: L, b: L| {
            let quadratic = h00 * t * t + c(2.0) * h01 * t * b + h11 * b * b;
            quadratic.mul_add(c(0.5), g0 * t + g1 * b)
        };
        let on_t = |t: L| {
            let b = -(h01.mul_add(t, g1)) / h11;
            (t, b_lo.max(b_hi.min(b)))
        };
        let on_b = |b: L| {
            let t = -(h01.mul_add(b, g0)) / h00;
            (t_lo.max(t_hi.min(t)), b)
        };
        let mut best = on_t(t_lo);
        let mut least = model(best.0, best.1);
        for (t, b) in [on_t(t_hi), on_b(b_lo), on_b(b_hi)] {
            let value = model(t, b);
            let better = value.lt(least);
            least = L::select(better, value, least);
            best = (L::select(better, t, best.0), L::select(better, b, best.1));
        }
        [L::select(inside, t, best.0), L::select(inside, b, best.1)]
    }

    /// χ² after a step, by the quadratic model.
    #[inline(always)]
    fn chi2_after(&self, token: L::Token, [t, b]: &[L; 2]) -> L {
        let (t, b) = (*t, *b);
        let [h00, h01, h11] = self.hessian;
        let slope = self.gradient[0] * t + self.gradient[1] * b;
        let bend = h00 * t * t + h01 * t * (b + b) + h11 * b * b;
        L::splat(token, 0.0).max(self.chi2 + (slope + slope + bend))
    }

    /// `yes` where the mask is set.
    #[inline(always)]
    fn select(mask: L::Mask, yes: &Self, no: &Self) -> Self {
        let s = |a: L, b: L| L::select(mask, a, b);
        Self {
            chi2: s(yes.chi2, no.chi2),
            tau: s(yes.tau, no.tau),
            gradient: core::array::from_fn(
                #[inline(always)]
                |i| s(yes.gradient[i], no.gradient[i]),
            ),
            hessian: core::array::from_fn(
                #[inline(always)]
                |i| s(yes.hessian[i], no.hessian[i]),
            ),
            tau_slope: core::array::from_fn(
                #[inline(always)]
                |i| s(yes.tau_slope[i], no.tau_slope[i]),
            ),
        }
    }
}

/// Start (y, β) from the logarithmic problem.
#[inline(always)]
fn start<L: Lanes, const N: usize>(
    token: L::Token,
    fit: &MbbFit,
    log_i: &[L; MAX_FREQUENCIES],
) -> (L, L) {
    let n = if N > 0 { N } else { fit.n.min(MAX_FREQUENCIES) };
    let c = |v: f64| L::splat(token, v);
    let table = &fit.start;
    let mut coordinates = [c(0.0); MAX_FREQUENCIES];
    for j in 0..n - 1 {
        let mut sum = c(0.0);
        for i in 0..n {
            sum = log_i[i].mul_add(c(table.projection[j][i]), sum);
        }
        coordinates[j] = sum;
    }
    let (lo, hi) = (c(BETA_BOUNDS[0]), c(BETA_BOUNDS[1]));
    let stiffness = c(table.stiffness);
    let (mut least, mut y, mut beta) = (c(f64::INFINITY), c(Y_HI), c(0.0));
    for (row, &y_grid) in table.grid.iter().zip(&table.y) {
        let free = coordinates[0] - c(row[0]);
        let held = lo.max(hi.min(free));
        let beyond = free - held;
        let mut value = stiffness * beyond * beyond;
        for j in 1..n - 1 {
            let difference = coordinates[j] - c(row[j]);
            value = difference.mul_add(difference, value);
        }
        let better = value.lt(least);
        least = L::select(better, value, least);
        y = L::select(better, c(y_grid), y);
        beta = L::select(better, held, beta);
    }
    (y, beta)
}

#[inline(always)]
fn fit_eight<L: Lanes, const N: usize>(
    token: L::Token,
    fit: &MbbFit,
    intensity: &[L; MAX_FREQUENCIES],
) -> Solved<L> {
    let n = if N > 0 { N } else { fit.n.min(MAX_FREQUENCIES) };
    let c = |v: f64| L::splat(token, v);
    let (zero, one, inf) = (c(0.0), c(1.0), c(f64::INFINITY));
    // Pixels that cannot be fitted go along as I = 1 and are masked at the end.
    let mut present = one.eq(one);
    for i in intensity.iter().take(n) {
        present = present & i.gt(zero) & i.lt(inf);
    }
    let scale = L::select(present, intensity[0], one);
    let mut front = [zero; MAX_FREQUENCIES];
    let mut log_i = [zero; MAX_FREQUENCIES];
    for i in 0..n {
        let relative = L::select(present, intensity[i] / scale, one);
        front[i] = c(fit.front[i]) / relative;
        log_i[i] = ln(token, relative);
    }
    let (mut y, mut beta) = start::<L, N>(token, fit, &log_i);
    let mut at = Local::new::<N>(token, fit, &front, y, beta);
    let mut step = at.step(token, y, beta);
    let mut alpha = one;
    let mut converged = !present;
    let (mut tau_out, mut y_out, mut beta_out, mut chi2_out) = (at.tau, y, beta, at.chi2);
    for _ in 0..MAX_ITERATIONS {
        let tolerance = c(STEP_TOLERANCE);
        let small = step[0].abs().lt(tolerance) & step[1].abs().lt(tolerance * one.max(beta));
        let new = small & !converged;
        if new.any() {
            let d_ln_tau = at.tau_slope[0] * step[0] + at.tau_slope[1] * step[1];
            let s = |new_value: L, old: L| L::select(new, new_value, old);
            tau_out = s(at.tau - at.tau * d_ln_tau, tau_out);
            y_out = s(step[0].mul_add(y, y), y_out);
            beta_out = s(beta + step[1], beta_out);
            chi2_out = s(at.chi2_after(token, &step), chi2_out);
            converged = converged | new;
        }
        if converged.all() {
            break;
        }
        let trial_y = c(Y_LO).max(c(Y_HI).min((alpha * step[0]).mul_add(y, y)));
        let trial_beta = c(BETA_BOUNDS[0]).max(c(BETA_BOUNDS[1]).min(alpha.mul_add(step[1], beta)));
        let trial = Local::new::<N>(token, fit, &front, trial_y, trial_beta);
        // The allowance is for rounding, once the minimum is reached.
        let limit = at.chi2.mul_add(c(1.0 + 1e-9), c(fit.rounding));
        let accepted = trial.chi2.le(limit);
        at = Local::select(accepted, &trial, &at);
        y = L::select(accepted, trial_y, y);
        beta = L::select(accepted, trial_beta, beta);
        alpha = L::select(accepted, one, alpha * c(0.25));
        step = at.step(token, y, beta);
    }
    let finite = tau_out.gt(zero) & tau_out.lt(inf) & chi2_out.lt(inf);
    Solved {
        tau: tau_out * scale * c(fit.tau_scale),
        y: c(Y_LO).max(c(Y_HI).min(y_out)),
        beta: c(BETA_BOUNDS[0]).max(c(BETA_BOUNDS[1]).min(beta_out)),
        chi2: chi2_out,
        present,
        converged: converged & present & finite,
    }
}
