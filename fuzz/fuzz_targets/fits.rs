//! The FITS and `.npy` readers on any bytes: an error or a whole map, never a panic, and no more memory than the bytes earn.
//!
//! The first byte chooses what is asked for; the rest is the file. Seeds: tests/data/fits.

#![no_main]

use dust3d::io::fits::{Selection, read_bytes};
use dust3d::io::{MapFile, Role, npy};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((&choice, bytes)) = data.split_first() else {
        return;
    };
    let role = match choice & 7 {
        0 => None,
        1 => Some(Role::Intensity(353.0)),
        2 => Some(Role::StokesQ(353.0)),
        3 => Some(Role::StokesU(217.0)),
        4 => Some(Role::OpticalDepth),
        5 => Some(Role::Temperature),
        6 => Some(Role::SpectralIndex),
        _ => Some(Role::Reddening),
    };
    let selection = Selection {
        hdu: (choice & 8 != 0).then(|| "1".to_owned()),
        column: (choice & 16 != 0).then(|| "2".to_owned()),
        unit: (choice & 32 != 0).then(|| "K_CMB".to_owned()),
    };
    let whole = |map: MapFile| {
        assert_eq!(map.values.len(), 12 * (map.nside as usize).pow(2));
        assert!(map.values.iter().all(|value| !value.is_nan()));
    };
    let read = if choice & 64 == 0 {
        read_bytes(bytes, "fuzz", &selection, role)
    } else {
        npy::read_from(bytes, bytes.len() as u64, &selection, role)
    };
    match read {
        Ok(map) => whole(map),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
