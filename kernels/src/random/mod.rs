//! Reproducible random streams and normal deviates.
