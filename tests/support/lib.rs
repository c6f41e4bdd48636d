//! References, generators and the tolerance table shared by the tests and the fuzz targets.

pub mod cap;
pub mod healpix;
pub mod mbb_fit;
pub mod random;
pub mod reference;
pub mod sightline;
pub mod tolerance;
