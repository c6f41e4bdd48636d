//! Properties of the modified-blackbody fit that must hold for any input.
