//! Inputs shared by the fuzz targets.
