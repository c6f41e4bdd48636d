//! Properties of the polarisation-fraction cap that must hold for any input.
