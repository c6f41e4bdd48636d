//! Files: maps in, the observations and their checks, run directories and their manifest out.

pub mod bandpass;
pub mod c128;
pub mod fits;
pub mod format;
pub mod inputs;
pub mod manifest;
pub mod map_file;
pub mod npy;
pub mod output;
pub mod partial;
pub mod raw;
pub mod role;
pub mod run;

pub use bandpass::Bandpass;
pub use c128::{Alm, read_alm, write_alm};
pub use format::{MapFormat, write_map, write_map_file};
pub use inputs::{InputMap, Inputs};
pub use manifest::Manifest;
pub use map_file::{MapFile, MapSource};
pub use output::RunDir;
pub use role::Role;
pub use run::Run;
