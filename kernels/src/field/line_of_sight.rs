//! Line-of-sight ratios Q_m/I_m and U_m/I_m of distance layers (\[MKD18\], section 4.2).
//!
//! For the layer between distances d_{i−1} and d_i along a direction (l, b),
//!
//! ```text
//! I_m = ∫ n dr    Q_m = p0 ∫ n (B_φ² − B_θ²)/B_⊥² sin^k α dr    U_m = −p0 ∫ n 2 B_θ B_φ/B_⊥² sin^k α dr
//! ```
//!
//! in the COSMO convention (θ to the south, φ to the east), with n of [`super::density`] and the direction of B of
//! [`super::spiral`]; points with R ≤ 1 kpc count in I_m alone. Only the direction of B enters, so neither r_0, b_0,
//! z_0 nor the sign of B matters. Only the ratios are returned: at high latitude n underflows by thousands of powers
//! of ten, and weights relative to the largest density of the layer leave the ratios defined.
//!
//! **Method.** 16-point Gauss–Legendre panels whose places depend on the geometry alone (see the module `mesh`), so the
//! same nodes serve every pitch angle and G(q) is as smooth as the integrand. Nodes across lanes, sums in one fixed
//! order. **Cost.** About one panel per layer above 15° of latitude; at most ten or so in the plane. **Accuracy.**
//! See [`ratios_into`].

use super::density::Density;
use super::mesh::{MAX_PANELS, Panels, Sight, Turn};
use super::panel::{Depolarisation, Nodes, fill, polarise};
use super::spiral::Spiral;
use crate::Error;
use crate::dispatch;
use crate::scalar::sin_cos;
use crate::simd::{Lanes, Level};

/// How grains polarise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grains {
    /// Intrinsic polarisation fraction p0.
    pub p0: f64,
    /// Exponent k of sin α, zero or above; 3 is the fast path.
    pub k: f64,
}

impl Default for Grains {
    /// p0 = 0.20, k = 3 (\[MKD18\]).
    fn default() -> Self {
        Self { p0: 0.20, k: 3.0 }
    }
}

/// The large-scale model: dust disc, field and grains.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Model {
    /// The dust disc.
    pub density: Density,
    /// The field, with its pitch angle and the Sun's distance from the centre.
    pub spiral: Spiral,
    /// The grains.
    pub grains: Grains,
}

impl Model {
    /// # Errors
    /// [`Error::Domain`] if a parameter is out of its domain.
    pub fn check(&self) -> Result<(), Error> {
        self.density.check()?;
        self.spiral.check()?;
        let Grains { p0, k } = self.grains;
        Error::check_domain("p0 (finite)", p0, p0.is_finite())?;
        Error::check_domain("k (0 or above)", k, k >= 0.0 && k.is_finite())
    }

    pub(crate) fn sight(&self, direction: [f64; 3]) -> Sight {
        let Density { h_r_kpc, h_z_kpc } = self.density;
        let Spiral {
            r_sun_kpc,
            hole_kpc,
            ..
        } = self.spiral;
        Sight::new(direction, r_sun_kpc, h_r_kpc, h_z_kpc, hole_kpc)
    }
}

/// Length of the scratch of [`ratios_into`].
#[must_use]
pub const fn ratios_scratch_len() -> usize {
    MAX_PANELS * 48
}

/// The nodes in a scratch of [`ratios_scratch_len`].
#[inline(always)]
pub(crate) fn nodes_in(scratch: &mut [f64]) -> &mut [Nodes] {
    let (lanes, _) = scratch.as_chunks_mut::<8>();
    let (blocks, _) = lanes.as_chunks_mut::<3>();
    let (nodes, _) = blocks.as_chunks_mut::<2>();
    nodes
}

/// Fills the nodes of one layer, for every pitch angle or graded for one (see [`Turn`]); returns those filled and ∫ n dr in their weights.
#[inline(always)]
pub(crate) fn layer_nodes<'a, L: Lanes>(
    token: L::Token,
    sight: &Sight,
    [near, far]: [f64; 2],
    turn: Turn,
    panels: &mut Panels,
    nodes: &'a mut [Nodes],
) -> (&'a [Nodes], f64) {
    let top = sight.panels(near, far, turn, panels);
    let mut intensity = L::splat(token, 0.0);
    let mut used = 0;
    for &panel in panels.as_slice() {
        if panel.dark {
            let mut dark = [[[0.0; 8]; 3]; 2];
            fill::<L>(token, sight, panel, top, &mut dark, &mut intensity);
        } else if let Some(nodes) = nodes.get_mut(used) {
            fill::<L>(token, sight, panel, top, nodes, &mut intensity);
            used += 1;
        }
    }
    (nodes.get(..used).unwrap_or(&[]), intensity.reduce_sum())
}

/// Checks the edges of layers.
///
/// # Errors
/// [`Error::Length`] with fewer than two edges; [`Error::Domain`] unless 0 ≤ d_0 < d_1 < … ≤ 1e6 kpc.
pub fn check_edges(edges_kpc: &[f64]) -> Result<(), Error> {
    Error::check_scratch("edges_kpc", 2, edges_kpc.len())?;
    let mut before = -1.0;
    for &edge in edges_kpc {
        let good = edge > before && (0.0..=1e6).contains(&edge);
        Error::check_domain("edges_kpc (increasing from 0 or above)", edge, good)?;
        before = edge;
    }
    Ok(())
}

/// The ratios Q_m/I_m and U_m/I_m of every layer towards every direction.
///
/// | argument | shape | unit | domain |
/// | --- | --- | --- | --- |
/// | `edges_kpc` | N + 1 | kpc | 0 ≤ d_0 < d_1 < … ≤ 1e6; layer i lies between d_i and d_{i+1} |
/// | `directions` | n_pix | any | vectors, x to l = 0, y to l = 90°, z to the north Galactic pole; any length |
/// | `q`, `u` | N slices of n_pix | 1 | written |
/// | `scratch` | ≥ [`ratios_scratch_len`] | | contents ignored, left dirty |
///
/// At b = ±90° exactly, where θ and φ are not defined, l = 0 is taken; a vector of length zero looks to l = b = 0. A
/// direction that is not finite gives NaN.
///
/// # Accuracy
/// 1e-6 absolute in every direction; see `tests/support/tolerance.rs`.
/// # Errors
/// [`Error::Length`] or [`Error::Domain`] of a parameter; nothing has been written then.
/// # Source
/// \[MKD18\], sections 2 and 4.2, with the erratum on the orientation: polarisation is perpendicular to B_⊥.
/// # Example
/// ```
/// use dust3d_kernels::{field::{Model, line_of_sight::*}, simd::Level};
/// let model = Model::default();
/// let (mut q, mut u) = ([0.0], [0.0]);
/// let mut scratch = [0.0; ratios_scratch_len()];
/// // Away from the centre in the plane, Q/I = p0 cos³ q.
/// ratios_into(Level::detect(), &model, &[0.0, 1.0], &[[-1.0, 0.0, 0.0]], &mut [&mut q], &mut [&mut u], &mut scratch)?;
/// let cos_q = model.spiral.pitch_rad.cos();
/// assert!((q[0] - 0.2 * cos_q * cos_q * cos_q).abs() < 1e-9);
/// assert_eq!(u[0], 0.0);
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
pub fn ratios_into(
    level: Level,
    model: &Model,
    edges_kpc: &[f64],
    directions: &[[f64; 3]],
    q: &mut [&mut [f64]],
    u: &mut [&mut [f64]],
    scratch: &mut [f64],
) -> Result<(), Error> {
    model.check()?;
    check_edges(edges_kpc)?;
    Error::check_len("q", edges_kpc.len() - 1, q.len())?;
    Error::check_len("u", edges_kpc.len() - 1, u.len())?;
    for map in q.iter().chain(u.iter()) {
        Error::check_len("a layer of q or u", directions.len(), map.len())?;
    }
    Error::check_scratch("scratch", ratios_scratch_len(), scratch.len())?;
    dispatch!(level, |token: L| ratios::<L>(
        token, model, edges_kpc, directions, q, u, scratch
    ));
    Ok(())
}

#[inline(always)]
fn ratios<L: Lanes>(
    token: L::Token,
    model: &Model,
    edges_kpc: &[f64],
    directions: &[[f64; 3]],
    q: &mut [&mut [f64]],
    u: &mut [&mut [f64]],
    scratch: &mut [f64],
) {
    let (sin_q, cos_q) = sin_cos(model.spiral.pitch_rad);
    let nodes = nodes_in(scratch);
    let law = Depolarisation::new(model.grains.k);
    let p0 = model.grains.p0;
    let mut panels = Panels::new();
    for (pixel, &direction) in directions.iter().enumerate() {
        let sight = model.sight(direction);
        let turn = law.turn(&sight, model.spiral.pitch_rad);
        for ((edges, q), u) in edges_kpc.windows(2).zip(&mut *q).zip(&mut *u) {
            let (Some(q), Some(u), &[near, far]) = (q.get_mut(pixel), u.get_mut(pixel), edges)
            else {
                continue;
            };
            if !sight.is_finite() {
                (*q, *u) = (f64::NAN, f64::NAN);
                continue;
            }
            let (nodes, i) = layer_nodes::<L>(token, &sight, [near, far], turn, &mut panels, nodes);
            let (q_sum, u_sum) = polarise::<L>(token, nodes, [sin_q, cos_q], &sight, law);
            *q = p0 * (q_sum.reduce_sum() / i);
            *u = p0 * (2.0 * sight.signed_sin_b * u_sum.reduce_sum() / i);
        }
    }
}
