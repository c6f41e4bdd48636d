//! Where a file comes from, and which sky it shows.

use super::cards::Cards;
use crate::config::Config;
use crate::io::fits::Frame;
use crate::io::manifest::Manifest;

/// Where a file comes from. Nothing of it depends on when or where the program ran.
#[derive(Debug, Clone, PartialEq)]
pub struct Provenance {
    /// VERSION: of the program.
    pub version: String,
    /// RANDSEED: of all random draws.
    pub seed: Option<u64>,
    /// CONFHASH: BLAKE3 hash of the resolved configuration, hexadecimal.
    pub config_hash: Option<String>,
    /// FREQ, in GHz.
    pub frequency_ghz: Option<f64>,
    /// COORDSYS: the coordinates of what is written.
    pub frame: Frame,
}

impl Default for Provenance {
    /// This version of the program, and nothing else.
    fn default() -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: None,
            config_hash: None,
            frequency_ghz: None,
            frame: Frame::Galactic,
        }
    }
}

impl Provenance {
    /// That of files made from a run: the version that made the run, its seed and the hash of its configuration.
    #[must_use]
    pub fn of_run(manifest: &Manifest) -> Self {
        Self {
            version: manifest.version.clone(),
            seed: manifest.seed,
            config_hash: manifest.config.as_ref().map(hash),
            frequency_ghz: None,
            frame: Frame::Galactic,
        }
    }

    /// The same with a frequency.
    #[must_use]
    pub const fn at(mut self, frequency_ghz: f64) -> Self {
        self.frequency_ghz = Some(frequency_ghz);
        self
    }

    pub(super) fn put(&self, cards: &mut Cards) {
        if let Some(ghz) = self.frequency_ghz {
            cards.real("FREQ", ghz, "frequency, GHz");
        }
        cards.text("CREATOR", "dust3d", "program");
        cards.text("VERSION", &self.version, "of the program");
        if let Some(seed) = self.seed {
            cards.integer("RANDSEED", seed, "seed of all random draws");
        }
        if let Some(hash) = &self.config_hash {
            cards.text("CONFHASH", hash, "");
        }
    }
}

/// BLAKE3 hash of a configuration as JSON.
fn hash(config: &Config) -> String {
    // The structs hold nothing that could fail to serialise.
    let text = serde_json::to_vec(config).unwrap_or_default();
    blake3::hash(&text).to_hex().to_string()
}
