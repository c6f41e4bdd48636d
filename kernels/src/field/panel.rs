//! One quadrature panel: density weights and field geometry at sixteen nodes, and their sum for one pitch angle.
//!
//! The nodes lie across the lanes, in two blocks of eight. A block keeps what no pitch angle changes: the weight
//! w n(r), cos χ and sin χ. For a pitch angle q, with φ = q + χ, the unit field has the components −cos φ towards e_φ,
//! sin φ away from the Sun along the plane, hence sin b sin φ towards e_θ, and
//!
//! ```text
//! B_⊥² = cos² φ + sin² b sin² φ                           (of B² = 1)
//! Q: (B_φ² − B_θ²)/B_⊥² · B_⊥^k = (cos² φ − sin² b sin² φ) B_⊥^(k−2)
//! U: −2 B_θ B_φ/B_⊥² · B_⊥^k    =  2 sin b sin φ cos φ B_⊥^(k−2)
//! ```
//!
//! Emission is polarised perpendicular to B_⊥. The angle printed in \[MKD18\] is that of B_⊥ itself, both signs
//! reversed: an erratum, which would make Q negative along the Galactic plane.

use super::mesh::{Panel, Sight, Turn};
use crate::simd::{Lanes, math};

/// Nodes of the 16-point Gauss–Legendre rule on [−1, 1]; 25 digits from mpmath.
const NODES: [[f64; 8]; 2] = [
    [
        -0.9894009349916499325961542,
        -0.9445750230732325760779884,
        -0.8656312023878317438804679,
        -0.7554044083550030338951012,
        -0.6178762444026437484466718,
        -0.4580167776572273863424194,
        -0.2816035507792589132304605,
        -0.09501250983763744018531934,
    ],
    [
        0.9894009349916499325961542,
        0.9445750230732325760779884,
        0.8656312023878317438804679,
        0.7554044083550030338951012,
        0.6178762444026437484466718,
        0.4580167776572273863424194,
        0.2816035507792589132304605,
        0.09501250983763744018531934,
    ],
];

/// Weights of the same rule, equal in both halves.
const WEIGHTS: [f64; 8] = [
    0.02715245941175409485178057,
    0.06225352393864789286284384,
    0.09515851168249278480992511,
    0.1246289712555338720524763,
    0.1495959888165767320815017,
    0.1691565193950025381893121,
    0.1826034150449235888667637,
    0.1894506104550684962853967,
];

/// Eight nodes: weight, cos χ, sin χ.
pub(crate) type Block = [[f64; 8]; 3];
/// The two blocks of a panel.
pub(crate) type Nodes = [Block; 2];

/// The exponent k of sin α, sorted by what B_⊥^(k−2) costs.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Depolarisation {
    /// k = 3: a square root.
    Cubic,
    /// k = 2: nothing.
    Square,
    /// Any other k ≥ 0; holds (k − 2)/2, the power of B_⊥².
    Power(f64),
}

impl Depolarisation {
    pub(crate) fn new(k: f64) -> Self {
        if k == 3.0 {
            Self::Cubic
        } else if k == 2.0 {
            Self::Square
        } else {
            Self::Power(0.5 * (k - 2.0))
        }
    }

    /// How finely panels must follow the turning orientation, for every pitch angle at once if possible.
    ///
    /// Over a panel of turn Δ at b = 0 the error of |cos|³ is 2e-6 Δ³; it falls as |b| smooths the kink. Below k = 3 the
    /// kink is sharper, and near the plane too sharp for fixed panels.
    pub(crate) fn turn(self, sight: &Sight, pitch_rad: f64) -> Turn {
        let longest = 0.25 + 3.0 * sight.sin_b;
        match self {
            Self::Power(half) if half < 0.5 && sight.sin_b < 0.25 => Turn::Graded(pitch_rad),
            Self::Power(half) if half < 0.5 => Turn::Every(0.6 * longest),
            Self::Cubic | Self::Square | Self::Power(_) => Turn::Every(longest),
        }
    }
}

/// e^x for −700 ≤ x ≤ 1 (less is taken as −700); relative error below 2e-14.
///
/// x = k ln 2 + t, |t| ≤ ½ ln 2, Taylor polynomial of degree 11.
#[inline(always)]
fn exp_decay<L: Lanes>(token: L::Token, x: L) -> L {
    let c = |value| L::splat(token, value);
    let x = x.max(c(-700.0));
    let k = (x * c(core::f64::consts::LOG2_E)).round();
    let t = k.neg_mul_add(c(6.93147180369123816490e-01), x);
    let t = k.neg_mul_add(c(1.90821492927058770002e-10), t);
    // Estrin's scheme: half the latency of Horner's.
    let t2 = t * t;
    let t4 = t2 * t2;
    let p01 = c(1.0) + t;
    let p23 = t.mul_add(c(1.0 / 6.0), c(0.5));
    let p45 = t.mul_add(c(1.0 / 120.0), c(1.0 / 24.0));
    let p67 = t.mul_add(c(1.0 / 5040.0), c(1.0 / 720.0));
    let p89 = t.mul_add(c(1.0 / 362_880.0), c(1.0 / 40_320.0));
    let pab = t.mul_add(c(1.0 / 39_916_800.0), c(1.0 / 3_628_800.0));
    let low = t2.mul_add(p23, p01);
    let mid = t2.mul_add(p67, p45);
    let high = t2.mul_add(pab, p89);
    t4.mul_add(t4.mul_add(high, mid), low) * k.exp2_int()
}

/// Fills the blocks of a panel and adds its ∫ n dr, weights relative to e^top, to `intensity`.
#[inline(always)]
pub(crate) fn fill<L: Lanes>(
    token: L::Token,
    sight: &Sight,
    panel: Panel,
    top: f64,
    blocks: &mut Nodes,
    intensity: &mut L,
) {
    let c = |value| L::splat(token, value);
    let weights = L::load(token, &WEIGHTS) * c(panel.half);
    let (centre, half) = (c(panel.centre), c(panel.half));
    let (cos_b, ahead) = (c(sight.cos_b), c(sight.ahead));
    let impact = c(sight.impact);
    let p2 = c((sight.impact * sight.impact).max(1e-280));
    let (inv_h_r, twice_rise) = (c(sight.inv_h_r), c(2.0 * sight.rise));
    // Far above the plane 1 + e^(−2x) is one.
    let high = 2.0 * sight.rise * (panel.centre - panel.half) > 40.0;
    for (block, nodes) in blocks.iter_mut().zip(&NODES) {
        let r = L::load(token, nodes).mul_add(half, centre);
        let s = r.mul_sub(cos_b, ahead);
        let radius = s.mul_add(s, p2).sqrt();
        let twice_x = r * twice_rise;
        // ln n without its constant 2 ln 2, which cancels in the ratios.
        let ln_n = -(radius.mul_add(inv_h_r, twice_x) + c(top));
        let decay = exp_decay::<L>(token, ln_n);
        // One division for both 1/R and the square of 1/(1 + e^(−2x)).
        let (density, inv_radius) = if high {
            (decay, c(1.0) / radius)
        } else {
            let near = c(1.0) + exp_decay::<L>(token, -twice_x);
            let near2 = near * near;
            let inv = c(1.0) / (radius * near2);
            (decay * (inv * radius), inv * near2)
        };
        let weight = weights * density;
        *intensity += weight;
        let [w, cos, sin] = block;
        weight.store(w);
        (s * inv_radius).store(cos);
        (impact * inv_radius).store(sin);
    }
}

/// The polarised sums over filled nodes for the pitch angle with the given sine and cosine, across lanes.
///
/// The second lacks the factor 2 sin b, which is the same for all nodes.
#[inline(always)]
pub(crate) fn polarise<L: Lanes>(
    token: L::Token,
    nodes: &[Nodes],
    [sin_q, cos_q]: [f64; 2],
    sight: &Sight,
    law: Depolarisation,
) -> (L, L) {
    let (sin_q, cos_q) = (L::splat(token, sin_q), L::splat(token, cos_q));
    let sin2_b = L::splat(token, sight.sin_b * sight.sin_b);
    let (mut q, mut u) = (L::splat(token, 0.0), L::splat(token, 0.0));
    for [weight, cos, sin] in nodes.iter().flatten() {
        let weight = L::load(token, weight);
        let (cos, sin) = (L::load(token, cos), L::load(token, sin));
        let c = (cos * cos_q) - (sin * sin_q);
        let s = (cos * sin_q) + (sin * cos_q);
        let (c2, tilted) = (c * c, s * s * sin2_b);
        let weight = match law {
            Depolarisation::Cubic => weight * (c2 + tilted).sqrt(),
            Depolarisation::Square => weight,
            Depolarisation::Power(half_k) => {
                // sin α = 0 exactly: the orientation is not defined, and no power may make it infinite.
                let across = (c2 + tilted).max(L::splat(token, 1e-300));
                weight
                    * math::exp::<L>(
                        token,
                        math::ln::<L>(token, across) * L::splat(token, half_k),
                    )
            }
        };
        q = (c2 - tilted).mul_add(weight, q);
        u = (c * s).mul_add(weight, u);
    }
    (q, u)
}
