//! Files: maps in, the observations and their checks, run directories and their manifest out.

pub mod bandpass;
pub mod c128;
pub mod inputs;
pub mod manifest;
pub mod map_file;
pub mod output;
pub mod partial;
pub mod raw;
pub mod run;

pub use bandpass::Bandpass;
pub use c128::{Alm, read_alm, write_alm};
pub use inputs::{InputMap, Inputs};
pub use manifest::Manifest;
pub use map_file::{MapFile, MapSource};
pub use output::{RunDir, write_map_file};
pub use run::Run;
