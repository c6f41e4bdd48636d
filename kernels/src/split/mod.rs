//! Polarisation of the layers: residual sharing and the polarisation-fraction cap (\[MKD18\], section 4.2).
