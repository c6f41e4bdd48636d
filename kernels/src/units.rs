//! SI constants, intensity units and their conversion.
