//! Double-double numbers: sums of two f64, some 32 digits, for tables made once.
//!
//! Error-free sums and products of Knuth and Dekker (T. J. Dekker, Numer. Math. 18, 224, 1971); no FMA, so that every
//! machine makes the same tables.

/// hi + lo, |lo| ≤ ulp(hi)/2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Double {
    pub(super) hi: f64,
    pub(super) lo: f64,
}

/// a + b exactly.
fn two_sum(a: f64, b: f64) -> Double {
    let hi = a + b;
    let bb = hi - a;
    Double {
        hi,
        lo: (a - (hi - bb)) + (b - bb),
    }
}

/// a + b exactly, |a| ≥ |b|.
fn quick_sum(a: f64, b: f64) -> Double {
    let hi = a + b;
    Double {
        hi,
        lo: b - (hi - a),
    }
}

/// a in two halves of 26 bits.
fn split(a: f64) -> (f64, f64) {
    let t = a * 134_217_729.0;
    let hi = t - (t - a);
    (hi, a - hi)
}

/// a b exactly.
fn two_product(a: f64, b: f64) -> Double {
    let hi = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    Double {
        hi,
        lo: ((ah * bh - hi) + ah * bl + al * bh) + al * bl,
    }
}

impl Double {
    pub(super) const fn from(x: f64) -> Self {
        Self { hi: x, lo: 0.0 }
    }
    /// a b exactly.
    pub(super) fn product(a: f64, b: f64) -> Self {
        two_product(a, b)
    }
    pub(super) fn add(self, other: Self) -> Self {
        let s = two_sum(self.hi, other.hi);
        let t = two_sum(self.lo, other.lo);
        let s = quick_sum(s.hi, s.lo + t.hi);
        quick_sum(s.hi, s.lo + t.lo)
    }
    pub(super) fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
    pub(super) fn mul(self, other: Self) -> Self {
        let p = two_product(self.hi, other.hi);
        quick_sum(p.hi, p.lo + (self.hi * other.lo + self.lo * other.hi))
    }
    pub(super) fn div(self, other: Self) -> Self {
        let q = self.hi / other.hi;
        let r = self.add(other.mul(Self::from(q)).neg());
        let q2 = r.hi / other.hi;
        let r = r.add(other.mul(Self::from(q2)).neg());
        quick_sum(q, q2).add(Self::from(r.hi / other.hi))
    }
    pub(super) fn sqrt(self) -> Self {
        if self.hi <= 0.0 {
            return Self::from(0.0);
        }
        let r = crate::scalar::sqrt(self.hi);
        let rest = self.add(two_product(r, r).neg());
        let first = quick_sum(r, rest.hi / (2.0 * r));
        let rest = self.add(first.mul(first).neg());
        first.add(Self::from(rest.hi / (2.0 * r)))
    }
    pub(super) fn value(self) -> f64 {
        self.hi + self.lo
    }

    /// log2 of a positive normal number, to 1e-30 or so.
    ///
    /// x = 2^e f with f in √½ … √2, ln f = 2 artanh((f−1)/(f+1)): the series gains 1.5 digits a term.
    pub(super) fn log2(self) -> Self {
        let bits = self.hi.to_bits();
        let mut e = ((bits >> 52) & 0x7ff) as i32 - 1023;
        let mut scale = f64::from_bits(((1023 - i64::from(e)) as u64) << 52);
        if self.hi * scale > core::f64::consts::SQRT_2 {
            e += 1;
            scale *= 0.5;
        }
        let f = Self {
            hi: self.hi * scale,
            lo: self.lo * scale,
        };
        let one = Self::from(1.0);
        let w = f.add(one.neg()).div(f.add(one));
        let w2 = w.mul(w);
        let mut sum = Self::from(0.0);
        let mut k = 45.0;
        while k > 0.0 {
            sum = sum.mul(w2).add(one.div(Self::from(k)));
            k -= 2.0;
        }
        // 2/ln 2 in two parts
        let two_over_ln2 = Self {
            hi: 2.885_390_081_777_926_8,
            lo: 4.071_054_748_186_206_6e-17,
        };
        Self::from(f64::from(e)).add(w.mul(sum).mul(two_over_ln2))
    }
}

#[cfg(test)]
mod tests {
    use super::Double;

    /// ln 2 log2 e = 1 and log2 of exact powers and products.
    #[test]
    fn closed_form_log2() {
        let l3 = Double::from(3.0).log2();
        let l9 = Double::from(9.0).log2();
        let d = l9.add(l3.mul(Double::from(2.0)).neg());
        assert!(d.value().abs() < 1e-29, "{d:?}");
        // log2 3 = 1.58496250072115618145373894394781650875981440769248…
        assert_eq!(l3.hi, 1.584_962_500_721_156);
        assert!((l3.lo - 1.057_978_124_011_255_4e-16).abs() < 1e-31);
        assert_eq!(Double::from(0.125).log2().value(), -3.0);
        let r = Double::from(2.0).sqrt();
        assert!(r.mul(r).add(Double::from(-2.0)).value().abs() < 1e-30);
    }
}
