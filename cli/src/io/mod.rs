//! Files: maps in, the observations and their checks, run directories and their manifest out.

mod c128;
mod inputs;
mod manifest;
mod map_file;
mod missing;
mod output;
mod partial;
mod raw;

pub use c128::{Alm, read_alm, write_alm};
pub use inputs::{InputMap, Inputs, moduli, modulus_label};
pub use manifest::{
    Counts, FileRecord, FitStatistics, InputRecord, LawsRecord, LayerAverages, MANIFEST, Manifest,
    SmallScaleRecord,
};
pub use map_file::{MapFile, MapSource};
pub use missing::{MISSING, is_missing};
pub use output::{RunDir, write_map_file};
pub use partial::on_interrupt;
pub use raw::{LARGEST_NSIDE, decode_raw, encode_raw, nside_of_len};
