//! What must hold of any file and any configuration; shared with the fuzz targets.

use dust3d::config::{Config, Draft, Dtype};
use dust3d::io::raw::{decode_raw, encode_raw, nside_of_len};
use dust3d::kernels::healpix::missing::{MISSING, is_missing};

/// Any bytes are a raw map, which then survives being written and read, or are refused by one sentence.
pub(crate) fn assert_raw_map(bytes: &[u8], dtype: Dtype) {
    match decode_raw(bytes, dtype) {
        Err(error) => assert_sentence(&error),
        Ok(values) => {
            let nside = nside_of_len(bytes.len() as u64, dtype).expect("a map has an Nside");
            assert_eq!(values.len(), 12 * nside as usize * nside as usize);
            assert!(
                values
                    .iter()
                    .all(|&value| value == MISSING || value.is_finite() && !is_missing(value))
            );
            let written = encode_raw(&values, dtype);
            let again = decode_raw(&written, dtype).expect("what was written can be read");
            assert!(
                values
                    .iter()
                    .zip(&again)
                    .all(|(a, b)| a.to_bits() == b.to_bits())
            );
            // Values that are there keep their bytes.
            let size = dtype.size();
            for (index, value) in values
                .iter()
                .enumerate()
                .filter(|(_, value)| **value != MISSING)
            {
                let place = index * size..(index + 1) * size;
                assert_eq!(written[place.clone()], bytes[place], "{value}");
            }
        }
    }
}

/// Any text is a configuration, resolved once and for all, or is refused by one sentence.
pub(crate) fn assert_configuration(text: &str) {
    check(Config::from_toml(text));
    check(Draft::new().set(text).and_then(Draft::finish));
}

fn check(result: dust3d::Result<Config>) {
    match result {
        Err(error) => {
            assert_sentence(&error);
            assert_eq!(error.exit_code(), 2);
        }
        Ok(config) => {
            assert_eq!(config.clone().resolve(), Ok(config.clone()));
            let manifest = serde_json::to_string(&config).expect("serialises");
            assert_eq!(
                serde_json::from_str::<Config>(&manifest).expect("is read back"),
                config
            );
        }
    }
}

fn assert_sentence(error: &dust3d::Error) {
    let message = error.to_string();
    assert!(message.len() > 10 && !message.contains('\n'), "{message:?}");
}
