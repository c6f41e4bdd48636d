//! Planck function, modified blackbodies and bandpasses.
