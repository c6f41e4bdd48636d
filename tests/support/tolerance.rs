//! The one table of tolerances: kernel, measure, bound, why.
