//! Fits: the modified blackbody of a pixel, the pitch angle of the field.
