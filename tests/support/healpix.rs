//! Properties of pixel indexing that must hold for any input.
