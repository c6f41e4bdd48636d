//! References, generators and the tolerance table shared by the tests and the fuzz targets.
