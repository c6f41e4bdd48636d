//! HEALPix pixelisation (\[G05\]).
