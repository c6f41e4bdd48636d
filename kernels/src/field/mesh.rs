//! Where the quadrature panels of a line of sight lie: geometry only, the same for every pitch angle.
//!
//! A segment a ≤ r ≤ b of a line of sight is cut until a 16-point Gauss–Legendre rule integrates every piece to about
//! 1e-8 of the segment. With s the distance from the point closest to the Galactic axis (projected on the plane), p
//! the impact parameter and χ the angle between e_R and the line of sight,
//!
//! ```text
//! s = r cos b − R⊙ cos l     p = R⊙ sin l     R² = s² + p²     cos χ = s/R     sin χ = p/R     x = r |sin b| / h_z
//! ln n = −R/h_R − 2 ln cosh x
//! ```
//!
//! What limits the rule, and the cut that answers it:
//!
//! 1. *R = hole*: the polarised integrand jumps. Cut there, exactly.
//! 2. *ln n falls by hundreds over the segment* (it is concave along r, so it has one peak). The segment is truncated
//!    where it is [`DROP`] below the peak; an interior peak of a steep segment is a cut. A concave stand-in with
//!    ln cosh x replaced by √(1 + x²) − 1, less than 0.31 off, is enough to place panels and needs no exponential.
//! 3. *Branch points of R at s = ±i|p|.* With s = |p| sinh t they are at ±iπ/2 for every t: cut equally in t, into
//!    pieces shorter than [`STEP`].
//! 4. *Poles of sech² at x = ±iπ/2.* The same with x = (π/2) sinh t.
//! 5. *The line of sight runs along the field* (sin α = |cos(q + χ)| at b = 0): |cos|³ has a kink, smoothed over a
//!    width |b| in χ. It may be anywhere, so the pieces are short in χ ([`Turn::Every`]).
//! 6. *The same with sin^k α, k < 3*, near the plane: too sharp for rule 5. The panels then follow the pitch angle, and
//!    are graded towards the tangent point χ_t ([`Turn::Graded`]): equal pieces of asinh((χ − χ_t)/η), η = tan |b|.
//! 7. *exp(−R/h_R) over many h_R* grows off the real axis, towards its branch points: a panel holds at most [`FALL`] of
//!    it. A fall with height does no such harm: e^−2x is entire, and 16 nodes integrate 25 of it.

use crate::scalar::{abs, asinh, atan2, exp, floor, ln, sin_cos, sinh, sqrt};
use core::f64::consts::{FRAC_PI_2, PI};

/// Density below e^−DROP of the largest on the segment is left out.
const DROP: f64 = 25.0;
/// Longest panel in units of asinh(distance/distance of the branch point).
const STEP: f64 = 1.75;
/// More panels than a segment can have: four between its cuts, and each rule adds no more than its whole range over
/// its step, 25 for rule 3 (where |p| counts as at least 1e-9 of the segment), 14 for rule 4 (scale heights down to
/// 1e-9 kpc), 26 for rules 5 or 6, 8 for rule 7.
pub(crate) const MAX_PANELS: usize = 88;
/// e^STEP.
const STEP_RATIO: f64 = 5.754_602_676_005_731;

/// The most by which exp(−R/h_R) falls over a panel, in its logarithm.
const FALL: f64 = 8.0;
/// Longest panel of rule 6.
const GRADE_STEP: f64 = 1.5;
/// Rule 6 resolves nothing finer in χ.
const FINEST: f64 = 1e-7;

/// How panels answer the orientation turning along the line of sight.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Turn {
    /// Rule 5, serving every pitch angle: χ turns by no more than this over a panel.
    Every(f64),
    /// Rule 6, for this pitch angle alone.
    Graded(f64),
}

/// The number of pieces for a ratio of lengths, never beyond what any line of sight needs.
fn pieces(ratio: f64) -> f64 {
    (-floor(-ratio)).min(64.0)
}

/// One line of sight through the Galaxy.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    /// cos b.
    pub(crate) cos_b: f64,
    /// |sin b|: density does not know north from south.
    pub(crate) sin_b: f64,
    /// sin b with its sign.
    pub(crate) signed_sin_b: f64,
    /// R⊙ cos l: s = r cos b − ahead.
    pub(crate) ahead: f64,
    /// R⊙ sin l = p.
    pub(crate) impact: f64,
    /// 1/h_R.
    pub(crate) inv_h_r: f64,
    /// |sin b|/h_z: x = r · rise.
    pub(crate) rise: f64,
    /// Radius without field.
    pub(crate) hole: f64,
}

/// One panel: the nodes r = centre + half · x_j.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Panel {
    pub(crate) centre: f64,
    pub(crate) half: f64,
    /// Inside the hole: counts in I alone.
    pub(crate) dark: bool,
}

/// The panels of a segment, in order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Panels {
    list: [Panel; MAX_PANELS],
    count: usize,
    /// The pitch angle replaced by where in χ (0 … π) the line of sight runs along the field.
    turn: Turn,
}

impl Panels {
    /// No panels.
    pub(crate) const fn new() -> Self {
        let none = Panel {
            centre: 0.0,
            half: 0.0,
            dark: true,
        };
        Self {
            list: [none; MAX_PANELS],
            count: 0,
            turn: Turn::Every(PI),
        }
    }

    /// The panels found.
    pub(crate) fn as_slice(&self) -> &[Panel] {
        self.list.get(..self.count).unwrap_or(&[])
    }

    /// Adds the panel a … b.
    #[inline]
    fn push(&mut self, a: f64, b: f64, dark: bool) {
        if let Some(panel) = self.list.get_mut(self.count) {
            *panel = Panel {
                centre: 0.5 * (a + b),
                half: 0.5 * (b - a),
                dark,
            };
            self.count += 1;
        }
    }
}

impl Sight {
    /// The sight towards a vector (any length) from the Sun; at the poles l = 0. A zero vector looks to l = b = 0;
    /// one that is not finite gives a sight that is not.
    pub(crate) fn new([x, y, z]: [f64; 3], r_sun: f64, h_r: f64, h_z: f64, hole: f64) -> Self {
        let across = crate::scalar::hypot(x, y);
        let length = crate::scalar::hypot(across, z);
        let (cos_l, sin_l) = if across > 0.0 {
            (x / across, y / across)
        } else {
            (1.0, 0.0)
        };
        let (cos_b, signed_sin_b) = if length > 0.0 && length < f64::INFINITY {
            (across / length, z / length)
        } else if [x, y, z] == [0.0; 3] {
            (1.0, 0.0)
        } else {
            (f64::NAN, f64::NAN)
        };
        let sin_b = abs(signed_sin_b);
        Self {
            cos_b,
            sin_b,
            signed_sin_b,
            ahead: r_sun * cos_l,
            impact: r_sun * sin_l,
            inv_h_r: 1.0 / h_r,
            rise: sin_b / h_z,
            hole,
        }
    }

    /// Was the direction finite?
    pub(crate) fn is_finite(&self) -> bool {
        (self.cos_b + self.signed_sin_b + self.ahead + self.impact).is_finite()
    }

    #[inline]
    fn s(&self, r: f64) -> f64 {
        r * self.cos_b - self.ahead
    }

    /// The stand-in of ln n and its slope in r.
    #[inline]
    fn ln_density(&self, r: f64) -> (f64, f64) {
        let s = self.s(r);
        let radius = sqrt(s * s + self.impact * self.impact);
        let x = r * self.rise;
        let root = sqrt(1.0 + x * x);
        let value = -radius * self.inv_h_r - 2.0 * (root - 1.0);
        let inward = if radius > 0.0 { s / radius } else { 0.0 };
        let slope = -self.cos_b * inward * self.inv_h_r - 2.0 * self.rise * x / root;
        (value, slope)
    }

    /// Steps from `from`, where the density is too low, towards the peak until it is not, staying outside.
    ///
    /// Newton's method on a concave function from below its level never crosses it.
    fn truncate(&self, from: f64, level: f64) -> f64 {
        let mut r = from;
        for _ in 0..40 {
            let (value, slope) = self.ln_density(r);
            if value >= level - 2.0 || slope == 0.0 {
                break;
            }
            r -= (value - level) / slope;
        }
        r
    }

    /// Where the density matters on the segment: (start, interior peak or NaN, end, largest ln n).
    fn support(&self, a: f64, b: f64) -> (f64, f64, f64, f64) {
        let (value_a, slope_a) = self.ln_density(a);
        let (value_b, slope_b) = self.ln_density(b);
        let length = b - a;
        // A concave function lies below its tangents: nothing on the segment is DROP above either end.
        if abs(slope_a) * length <= DROP && abs(slope_b) * length <= DROP {
            return (a, f64::NAN, b, value_a.max(value_b));
        }
        let (peak, top) = if slope_a <= 0.0 {
            (f64::NAN, value_a)
        } else if slope_b >= 0.0 {
            (f64::NAN, value_b)
        } else {
            let (mut low, mut high) = (a, b);
            let (mut rise, mut fall) = (slope_a, slope_b);
            let mut middle = a;
            let mut top = value_a;
            for _ in 0..100 {
                middle = 0.5 * (low + high);
                let (value, slope) = self.ln_density(middle);
                top = value;
                if slope > 0.0 {
                    (low, rise) = (middle, slope);
                } else {
                    (high, fall) = (middle, slope);
                }
                if (high - low) * rise.max(-fall) < 0.5 {
                    break;
                }
            }
            (middle, top)
        };
        let start = if value_a < top - DROP {
            self.truncate(a, top - DROP)
        } else {
            a
        };
        let end = if value_b < top - DROP {
            self.truncate(b, top - DROP)
        } else {
            b
        };
        (start.max(a).min(b), peak, end.max(a).min(b), top)
    }

    /// Lists the panels of the segment a < r < b.
    ///
    /// Returns the stand-in's largest ln n on the segment, the reference of the weights.
    pub(crate) fn panels(&self, a: f64, b: f64, turn: Turn, out: &mut Panels) -> f64 {
        out.count = 0;
        out.turn = match turn {
            Turn::Every(_) => turn,
            Turn::Graded(pitch) => {
                // φ = q + χ = π/2 mod π, with χ counted from the line of sight towards e_R for either sign of p.
                let turned = if self.impact < 0.0 {
                    pitch - FRAC_PI_2
                } else {
                    FRAC_PI_2 - pitch
                };
                Turn::Graded(turned - PI * floor(turned / PI))
            }
        };
        let (start, peak, end, top) = self.support(a, b);
        // Cuts in increasing order: the hole's edges and the peak.
        let mut cuts = [end; 4];
        let reach = self.hole * self.hole - self.impact * self.impact;
        if reach > 0.0 && self.cos_b > 0.0 {
            let half = sqrt(reach);
            cuts[0] = (self.ahead - half) / self.cos_b;
            cuts[1] = (self.ahead + half) / self.cos_b;
            if peak > start {
                cuts[2] = peak;
                if cuts[2] < cuts[1] {
                    cuts.swap(1, 2);
                }
                if cuts[1] < cuts[0] {
                    cuts.swap(0, 1);
                }
            }
        } else if peak > start {
            cuts[0] = peak;
        }
        let mut from = start;
        for cut in cuts {
            let to = cut.min(end);
            if to > from {
                let s = self.s(0.5 * (from + to));
                let dark = s * s + self.impact * self.impact <= self.hole * self.hole;
                self.cut_radius(from, to, dark, out);
                from = to;
            }
        }
        top
    }

    /// Rule 3: equal pieces of asinh(s/|p|).
    #[inline]
    fn cut_radius(&self, a: f64, b: f64, dark: bool, out: &mut Panels) {
        let (s_a, s_b) = (self.s(a), self.s(b));
        // Towards the centre itself |p| = 0: 1e-9 of the segment then bounds the number of panels.
        let p = abs(self.impact).max(1e-9 * (s_b - s_a));
        let p2 = (p * p).max(1e-280);
        // |p| e^t for s = |p| sinh t, without cancellation.
        let grown = |s: f64| {
            let radius = sqrt(s * s + p2);
            if s >= 0.0 {
                s + radius
            } else {
                p2 / (radius - s)
            }
        };
        let (first, last) = (grown(s_a), grown(s_b));
        let mut from = a;
        if last > STEP_RATIO * first {
            let range = ln(last / first);
            let mut left = pieces(range / STEP);
            let ratio = exp(range / left);
            let mut g = first;
            while left > 1.0 {
                g *= ratio;
                let to = (0.5 * (g - p2 / g) + self.ahead) / self.cos_b;
                let to = to.max(from).min(b);
                self.cut_height(from, to, dark, out);
                from = to;
                left -= 1.0;
            }
        }
        self.cut_height(from, b, dark, out);
    }

    /// Rule 4: equal pieces of asinh(2x/π).
    fn cut_height(&self, a: f64, b: f64, dark: bool, out: &mut Panels) {
        let grown = |r: f64| {
            let x = r * self.rise;
            x + sqrt(x * x + FRAC_PI_2 * FRAC_PI_2)
        };
        let (first, last) = (grown(a), grown(b));
        let mut from = a;
        if last > STEP_RATIO * first {
            let range = ln(last / first);
            let mut left = pieces(range / STEP);
            let ratio = exp(range / left);
            let mut g = first;
            while left > 1.0 {
                g *= ratio;
                let to = (0.5 * (g - FRAC_PI_2 * FRAC_PI_2 / g) / self.rise)
                    .max(from)
                    .min(b);
                self.cut_turn(from, to, dark, out);
                from = to;
                left -= 1.0;
            }
        }
        self.cut_turn(from, b, dark, out);
    }

    /// Rule 5: equal pieces of χ.
    fn cut_turn(&self, a: f64, b: f64, dark: bool, out: &mut Panels) {
        let (s_a, s_b) = (self.s(a), self.s(b));
        let p = abs(self.impact);
        let (cross, dot) = (p * (s_b - s_a), s_a * s_b + p * p);
        let mut from = a;
        match out.turn {
            Turn::Graded(tangent) if !dark && cross > 0.0 => from = self.grade(a, b, tangent, out),
            // The turn is below its tangent, and mostly far below the limit: no arc tangent then.
            Turn::Every(limit) if !dark && !(cross <= 0.5 * limit * dot) => {
                let turn = atan2(cross, dot);
                let mut left = pieces(turn / limit);
                let (sin, cos) = sin_cos(turn / left);
                let (mut ex, mut ey) = (s_a, p);
                while left > 1.0 {
                    (ex, ey) = (ex * cos + ey * sin, ey * cos - ex * sin);
                    let to = (p * (ex / ey) + self.ahead) / self.cos_b;
                    let to = to.max(from).min(b);
                    self.cut_fall(from, to, dark, out);
                    from = to;
                    left -= 1.0;
                }
            }
            Turn::Every(_) | Turn::Graded(_) => {}
        }
        self.cut_fall(from, b, dark, out);
    }

    /// Rule 7: equal pieces, exp(−R/h_R) falling by no more than [`FALL`] in each.
    #[inline]
    fn cut_fall(&self, a: f64, b: f64, dark: bool, out: &mut Panels) {
        let p2 = self.impact * self.impact;
        let radius = |r: f64| {
            let s = self.s(r);
            sqrt(s * s + p2)
        };
        let fall = abs(radius(b) - radius(a)) * self.inv_h_r;
        let mut from = a;
        if fall > FALL {
            let mut left = pieces(fall / FALL);
            let step = (b - a) / left;
            while left > 1.0 {
                out.push(from, from + step, dark);
                from += step;
                left -= 1.0;
            }
        }
        out.push(from, b, dark);
    }

    /// Rule 6: equal pieces of asinh((χ − χ_t)/η) on both sides of a tangent point; where the last one begins.
    #[cold]
    fn grade(&self, a: f64, b: f64, tangent: f64, out: &mut Panels) -> f64 {
        let p = abs(self.impact);
        let eta = (self.sin_b / self.cos_b).max(FINEST);
        // χ falls along the line of sight.
        let (first, last) = (atan2(p, self.s(a)), atan2(p, self.s(b)));
        let at = |chi: f64| {
            let (sin, cos) = sin_cos(chi);
            ((p * (cos / sin) + self.ahead) / self.cos_b).max(a).min(b)
        };
        let grown = |x: f64| asinh(x / eta);
        let mut from = a;
        // The integrand has period π in χ: each point belongs to the nearest tangent.
        for centre in [tangent + PI, tangent, tangent - PI] {
            let high = first.min(centre + FRAC_PI_2);
            let low = last.max(centre - FRAC_PI_2);
            if !(high > low) {
                continue;
            }
            let (start, end) = (grown(high - centre), grown(low - centre));
            let mut left = pieces((start - end) / GRADE_STEP);
            let step = (start - end) / left;
            let mut t = start;
            while left > 0.0 {
                t -= step;
                left -= 1.0;
                if left == 0.0 && low == last {
                    return from;
                }
                let to = at(centre + eta * sinh(t)).max(from);
                self.cut_fall(from, to, false, out);
                from = to;
            }
        }
        from
    }
}
