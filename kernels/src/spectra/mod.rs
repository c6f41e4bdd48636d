//! Angular power spectra: windows, power-law fits, 2×2 square roots per multipole.
