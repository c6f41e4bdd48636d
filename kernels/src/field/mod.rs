//! Dust density, bisymmetric spiral field and line-of-sight ratios (\[MKD18\], section 4.2).
