//! dust3d: std layer.
