//! Maps in FITS and `.npy` files: what other programs write is read to the last bit, what is damaged is refused with a
//! sentence, what is written is what those programs expect.

use dust3d::config::Dtype;
use dust3d::io::fits::write::{self, MapColumn, MapTable, Provenance};
use dust3d::io::fits::{Selection, read_bytes};
use dust3d::io::{MapFile, MapFormat, MapSource, Role, write_map, write_map_file};
use dust3d::kernels::Complex;
use dust3d::kernels::healpix::missing::MISSING;
use dust3d::kernels::healpix::{Nside, nest2ring};
use dust3d::kernels::units::Unit;
use dust3d_tests::random::Random;
use std::path::{Path, PathBuf};

const NPIX: usize = 192;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/data/fits")
        .join(name)
}

fn spec(name: &str) -> String {
    data(name).to_string_lossy().into_owned()
}

/// The values that `make.py` gives to a column of `npix` pixels, RING order.
fn value(column: usize, npix: usize) -> Vec<f64> {
    (0..npix)
        .map(|pixel| ((37 * pixel % 1009) as f64 - 504.0) / 16.0 + 64.0 * column as f64)
        .collect()
}

fn read(spec: &str) -> MapFile {
    MapSource::parse(spec)
        .and_then(|source| source.read())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn read_as(spec: &str, key: &str) -> MapFile {
    let role = Role::of_key(key).expect("a key of the configuration");
    MapSource::parse(spec)
        .and_then(|source| source.read_as(role))
        .unwrap_or_else(|error| panic!("{error}"))
}

fn refusal(spec: &str, key: &str) -> String {
    let role = Role::of_key(key).expect("a key of the configuration");
    MapSource::parse(spec)
        .and_then(|source| source.read_as(role))
        .expect_err("must be refused")
        .to_string()
}

/// The same bits, so that −0 is not 0.
fn assert_same(got: &[f64], wanted: &[f64]) {
    assert_eq!(got.len(), wanted.len());
    for (pixel, (got, wanted)) in got.iter().zip(wanted).enumerate() {
        assert_eq!(
            got.to_bits(),
            wanted.to_bits(),
            "pixel {pixel}: {got} instead of {wanted}"
        );
    }
}

#[test]
fn healpy_columns_by_name_and_number() {
    for file in ["iqu_f32.fits", "iqu_f32.fits.gz"] {
        for (number, name) in [
            (1, "TEMPERATURE"),
            (2, "Q_POLARISATION"),
            (3, "u_polarisation"),
        ] {
            for selected in [
                format!("[{name}]"),
                format!("[{number}]"),
                format!("[HDU=1][{name}]"),
            ] {
                let map = read(&format!("{}{selected}", spec(file)));
                assert_same(&map.values, &value(number - 1, NPIX));
                assert_eq!((map.nside, map.dtype), (4, Dtype::F32));
                assert_eq!(map.unit.as_deref(), Some("uK_CMB"));
                assert!(map.notes.is_empty(), "{:?}", map.notes);
            }
        }
    }
    let rows = read(&format!("{}[3]", spec("iqu_rows_f32.fits")));
    assert_same(&rows.values, &value(2, 3072));
}

#[test]
fn healpy_order_and_lists() {
    let nested = read(&spec("nested_f64.fits"));
    assert_same(&nested.values, &value(0, NPIX));
    assert_eq!(nested.dtype, Dtype::F64);
    assert!(
        nested.notes.iter().any(|note| note.contains("COORDSYS")),
        "{:?}",
        nested.notes
    );
    let mut wanted = value(0, NPIX);
    wanted
        .iter_mut()
        .step_by(3)
        .for_each(|value| *value = MISSING);
    assert_same(&read(&spec("partial_nested_f32.fits")).values, &wanted);
}

#[test]
fn astropy_integers_scaled() {
    let scaled = |null: usize| {
        let mut wanted = value(0, NPIX);
        wanted.iter_mut().for_each(|value| *value += 64.0);
        wanted[null] = MISSING;
        wanted
    };
    for name in ["SHORT", "INT", "LONG"] {
        assert_same(
            &read(&format!("{}[{name}]", spec("integers.fits"))).values,
            &scaled(5),
        );
    }
    let bytes: Vec<f64> = (0..NPIX).map(|pixel| (pixel % 251) as f64).collect();
    assert_same(
        &read(&format!("{}[BYTE]", spec("integers.fits"))).values,
        &bytes,
    );
    let mask: Vec<f64> = (0..NPIX).map(|pixel| (pixel % 2) as f64).collect();
    assert_same(
        &read(&format!("{}[MASK]", spec("integers.fits"))).values,
        &mask,
    );
}

#[test]
fn astropy_iau_bad_data_units() {
    let file = spec("iau_bad_data.fits");
    let factor = Unit::MilliKCmb.to_mjysr(353.0).expect("a frequency");
    let q: Vec<f64> = value(1, NPIX).iter().map(|q| q * factor).collect();
    assert_same(&read_as(&file, "Q_353").values, &q);
    let turned = |factor: f64| {
        let mut u: Vec<f64> = value(2, NPIX).iter().map(|u| u * factor).collect();
        (u[7], u[11]) = (MISSING, MISSING);
        u
    };
    assert_same(&read_as(&file, "U_353").values, &turned(-factor));
    // Without a purpose the unit stays, but U is COSMO all the same.
    let plain = read(&format!("{file}[U-POLARISATION]"));
    assert_same(&plain.values, &turned(-1.0));
    assert_eq!(plain.unit.as_deref(), Some("mK_CMB"));
    let message = refusal(&format!("{file}[LABEL]"), "I_353");
    assert!(
        message.contains("TFORM2") && message.contains("iau_bad_data.fits"),
        "{message}"
    );
}

#[test]
fn astropy_model_by_role() {
    let file = spec("model.fits");
    for (key, column) in [("tau", 0), ("T", 1), ("beta", 2)] {
        let map = read_as(&file, key);
        assert_same(&map.values, &value(column, NPIX));
        assert!(map.notes.is_empty(), "{:?}", map.notes);
    }
    assert_same(
        &read(&format!("{file}[HDU=MODEL][BETA]")).values,
        &value(2, NPIX),
    );
    let message = refusal(&file, "I_353");
    assert!(message.contains("file.fits[NAME]"), "{message}");
    let message = refusal(&format!("{file}[HDU=1]"), "tau");
    assert!(message.contains("HDU 1 (NOTES), NSIDE"), "{message}");
    let message = refusal(&format!("{file}[HDU=7]"), "tau");
    assert!(
        message.contains("0 (empty), 1 (NOTES, table), 2 (MODEL, table)"),
        "{message}"
    );
}

#[test]
fn astropy_images() {
    assert_same(&read(&spec("image.fits")).values, &value(0, NPIX));
    let file = spec("image_iqu.fits");
    for (key, plane) in [("I_353", 0), ("Q_353", 1), ("U_353", 2)] {
        assert_same(&read_as(&file, key).values, &value(plane, NPIX));
        assert_same(
            &read(&format!("{file}[{}]", plane + 1)).values,
            &value(plane, NPIX),
        );
    }
}

#[test]
fn numpy_maps() {
    for (key, row) in [("I_353", 0), ("Q_353", 1), ("U_353", 2)] {
        let map = read_as(&spec("iqu.npy"), key);
        assert_same(&map.values, &value(row, NPIX));
        assert_eq!((map.nside, map.dtype), (4, Dtype::F32));
    }
    assert_same(
        &read(&format!("{}[3]", spec("iqu.npy"))).values,
        &value(2, NPIX),
    );
    let message = refusal(&spec("iqu.npy"), "tau");
    assert!(message.contains("3 maps"), "{message}");
}

#[test]
fn healpy_coordinates_are_rotated() {
    let galactic: Vec<MapFile> = (1..=3)
        .map(|column| read(&format!("{}[{column}]", spec("smooth_G.fits"))))
        .collect();
    for coord in ["C", "E"] {
        let file = spec(&format!("smooth_{coord}.fits"));
        for (number, (key, wanted)) in
            (1..).zip(["I_353", "Q_353", "U_353"].into_iter().zip(&galactic))
        {
            for map in [read_as(&file, key), read(&format!("{file}[{number}]"))] {
                assert!(
                    map.notes.iter().any(|note| note.contains("rotated")),
                    "{:?}",
                    map.notes
                );
                for (pixel, (got, wanted)) in map.values.iter().zip(&wanted.values).enumerate() {
                    // Values are of order 1 to 20.
                    assert!(
                        (got - wanted).abs() < 1e-7,
                        "{coord} {key} pixel {pixel}: {got}, {wanted}"
                    );
                }
            }
        }
    }
}

#[test]
fn coordinates_that_cannot_be_rotated() {
    let bytes = std::fs::read(data("equatorial.fits")).expect("the file");
    let read = |bytes: &[u8], role| {
        let error = read_bytes(bytes, "x.fits", &Selection::default(), Some(role));
        error.expect_err("must be refused").to_string()
    };
    let mut holed = bytes.clone();
    holed[5760..5764].copy_from_slice(&f32::NAN.to_be_bytes());
    let message = read(&holed, Role::Intensity(353.0));
    assert!(
        message.contains("COORDSYS") && message.contains("1 pixels are missing"),
        "{message}"
    );
    let alone = with_card(&bytes, "TTYPE3", "'HITS'");
    let message = read(&alone, Role::StokesQ(353.0));
    assert!(
        message.contains("COORDSYS") && message.contains("Stokes U"),
        "{message}"
    );
}

#[test]
fn units_are_converted_or_refused() {
    let file = spec("iqu_f32.fits");
    for (key, ghz) in [("I_353", 353.0), ("I_2998", 2_997.924_58), ("I_217", 217.0)] {
        let factor = Unit::MicroKCmb.to_mjysr(ghz).expect("a frequency");
        let wanted: Vec<f64> = value(0, NPIX).iter().map(|value| value * factor).collect();
        assert_same(&read_as(&file, key).values, &wanted);
    }
    assert_same(
        &read_as(&format!("{file}[1][unit=MJy/sr]"), "I_353").values,
        &value(0, NPIX),
    );
    assert_same(
        &read_as(&format!("{file}[1][unit=mag]"), "ebv_04.0").values,
        &value(0, NPIX),
    );
    for (selected, key) in [
        ("[unit=K]", "I_353"),
        ("[1]", "tau"),
        ("[1]", "T"),
        ("[2]", "ebv_04.0"),
    ] {
        let message = refusal(&format!("{file}{selected}"), key);
        assert!(
            message.contains("TUNIT") && message.contains("[unit="),
            "{message}"
        );
    }
    // No unit: what a raw map is taken to be, and a note.
    let assumed = read_as(&spec("nested_f64.fits"), "I_353");
    assert_same(&assumed.values, &value(0, NPIX));
    assert!(
        assumed
            .notes
            .iter()
            .any(|note| note.contains("MJy/sr is assumed"))
    );
}

/// Replaces the card of `key` in `bytes`, in the first HDU that has it.
fn with_card(bytes: &[u8], key: &str, value: &str) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let at = bytes
        .chunks(80)
        .position(|card| card.starts_with(format!("{key:<8}=").as_bytes()))
        .unwrap_or_else(|| panic!("no {key}"));
    let card = format!("{:<80}", format!("{key:<8}= {value}"));
    bytes[80 * at..80 * (at + 1)].copy_from_slice(card.as_bytes());
    bytes
}

fn refuse_bytes(bytes: &[u8]) -> String {
    let role = Some(Role::Intensity(353.0));
    let error =
        read_bytes(bytes, "x.fits", &Selection::default(), role).expect_err("must be refused");
    assert_eq!(error.exit_code(), 1);
    error.to_string()
}

#[test]
fn wrong_keywords_are_named() {
    let bytes = std::fs::read(data("iqu_f32.fits")).expect("the file");
    for (key, value, named) in [
        ("SIMPLE", "F", "SIMPLE"),
        ("XTENSION", "'IMAGE   '", "NSIDE"),
        ("XTENSION", "'TABLE   '", "holds no HEALPix map"),
        ("NAXIS1", "13", "NAXIS1"),
        ("NAXIS1", "-12", "NAXIS1"),
        ("NAXIS1", "'twelve'", "NAXIS1"),
        ("NAXIS2", "1000000000000000", "NAXIS2"),
        ("NAXIS2", "9223372036854775807", "NAXIS"),
        ("NAXIS2", "99999999999999999999", "NAXIS2"),
        ("NAXIS2", "191", "NSIDE"),
        ("NAXIS2", "12", "NSIDE"),
        ("TFIELDS", "4", "TFORM4"),
        ("TFIELDS", "2", "NAXIS1"),
        ("TFIELDS", "1000000", "TFIELDS"),
        ("TFORM1", "'Z'", "TFORM1"),
        ("TFORM1", "'2E'", "NAXIS1"),
        ("TFORM1", "'99999999999999999999E'", "TFORM1"),
        ("TUNIT1", "'parsec'", "TUNIT1"),
        ("ORDERING", "'NUNIQ'", "ORDERING"),
        ("ORDERING", "'RIMG'", "ORDERING"),
        ("COORDSYS", "'X'", "COORDSYS"),
        ("NSIDE", "5", "NSIDE"),
        ("NSIDE", "8", "NSIDE"),
        ("NSIDE", "16384", "NSIDE"),
        ("NSIDE", "-4", "NSIDE"),
        ("NSIDE", "'four'", "NSIDE"),
        ("INDXSCHM", "'IMPLICATE'", "INDXSCHM"),
        ("INDXSCHM", "'EXPLICIT'", "TFORM1"),
        ("GCOUNT", "7", "NAXIS2"),
        ("PCOUNT", "-1", "PCOUNT"),
        ("BITPIX", "7", "BITPIX"),
    ] {
        // The primary header has these two of its own; the table's are meant.
        let primary = if matches!(key, "BITPIX") { 2880 } else { 0 };
        let mut changed = bytes[..primary].to_vec();
        changed.extend(with_card(&bytes[primary..], key, value));
        let message = refuse_bytes(&changed);
        assert!(
            message.contains(named) && message.contains("x.fits"),
            "{key} = {value}: {message}"
        );
        assert!(!message.contains('\n') && message.len() > 40, "{message}");
    }
}

#[test]
fn images_without_planes_are_refused() {
    let bytes = std::fs::read(data("image_iqu.fits")).expect("the file");
    for count in ["0", "2", "1000000000"] {
        let mut changed = bytes[..2880].to_vec();
        changed.extend(with_card(&bytes[2880..], "NAXIS2", count));
        let read = read_bytes(&changed, "x.fits", &Selection::default(), None);
        // Two planes are there, none or a billion are not.
        assert_eq!(read.is_ok(), count == "2", "{count} planes");
    }
}

#[test]
fn lists_of_pixels_are_checked() {
    let bytes = std::fs::read(data("partial_nested_f32.fits")).expect("the file");
    // The first row begins at the third block: a 16-bit pixel and a float.
    let mut twice = bytes.clone();
    let second: [u8; 2] = [twice[5760 + 6], twice[5760 + 7]];
    twice[5760..5762].copy_from_slice(&second);
    assert!(refuse_bytes(&twice).contains("listed twice"));
    let mut outside = bytes.clone();
    outside[5760..5762].copy_from_slice(&192_i16.to_be_bytes());
    assert!(refuse_bytes(&outside).contains("pixel 192"));
    // A huge map of a few pixels would take gigabytes.
    let huge = with_card(&bytes, "NSIDE", "8192");
    assert!(refuse_bytes(&huge).contains("NSIDE: 8192 means 805306368 pixels"));
}

#[test]
fn short_files_are_refused() {
    for name in [
        "iqu_f32.fits",
        "image_iqu.fits",
        "model.fits",
        "iqu_f32.fits.gz",
    ] {
        let bytes = std::fs::read(data(name)).expect("the file");
        for len in (0..bytes.len() - 2880.min(bytes.len() / 2)).step_by(397) {
            let message = refuse_bytes(&bytes[..len]);
            assert!(message.contains("x.fits"), "{name} cut to {len}: {message}");
        }
    }
}

/// A generator of reproducible damage.
struct Damage(Random);

impl Damage {
    fn below(&mut self, bound: usize) -> usize {
        self.0.below(bound)
    }

    /// One of: bits flipped, bytes replaced by characters of headers, cards exchanged, the end or a middle missing.
    fn apply(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        let header = bytes.len().min(2 * 2880);
        match self.below(6) {
            0 => {
                for _ in 0..=self.below(8) {
                    let at = self.below(bytes.len());
                    bytes[at] ^= 1 << self.below(8);
                }
            }
            1 | 2 => {
                for _ in 0..=self.below(4) {
                    let at = self.below(header);
                    bytes[at] = b"0123456789 '-+.=/ENDTFXZ\xff\0"[self.below(26)];
                }
            }
            3 => {
                let (a, b) = (self.below(header / 80), self.below(header / 80));
                for i in 0..80 {
                    bytes.swap(80 * a + i, 80 * b + i);
                }
            }
            4 => bytes.truncate(self.below(bytes.len())),
            _ => {
                let start = self.below(bytes.len());
                let end = (start + 1 + self.below(4000)).min(bytes.len());
                bytes.drain(start..end);
            }
        }
        bytes
    }
}

#[test]
fn damaged_files_give_a_sentence() {
    let mut damage = Damage(Random(20_181_103));
    let mut refused = 0;
    for name in [
        "iqu_f32.fits",
        "iqu_f32.fits.gz",
        "partial_nested_f32.fits",
        "integers.fits",
        "iau_bad_data.fits",
        "model.fits",
        "image_iqu.fits",
    ] {
        let bytes = std::fs::read(data(name)).expect("the file");
        for _ in 0..300 {
            let changed = damage.apply(&bytes);
            for role in [None, Some(Role::StokesU(353.0))] {
                match read_bytes(&changed, "x.fits", &Selection::default(), role) {
                    Ok(map) => {
                        assert_eq!(map.values.len(), 12 * (map.nside as usize).pow(2));
                        assert!(map.values.iter().all(|value| value.is_finite()));
                    }
                    Err(error) => {
                        refused += 1;
                        let message = error.to_string();
                        assert!(
                            message.contains("x.fits") && !message.contains('\n'),
                            "{message}"
                        );
                    }
                }
            }
        }
    }
    assert!(
        refused > 1000,
        "{refused} refused: the damage does too little"
    );
}

/// What `dust_commander2015_d1_nside64.fits` and others hold, where they are at hand.
#[test]
fn planck_wmap_pysm_files() {
    let shared = std::env::var_os("SHARED")
        .map(PathBuf::from)
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"));
    let dir = shared.join("data/fits");
    if !dir.is_dir() {
        eprintln!(
            "SKIPPED planck_wmap_pysm_files: no `{}`; set SHARED to the directory of the shared data",
            dir.display()
        );
        return;
    }
    let file = |name: &str| dir.join(name).to_string_lossy().into_owned();
    // The same maps as FITS columns and raw.
    let commander = file("dust_commander2015_d1_nside64.fits");
    for key in ["I_353", "Q_353", "U_353", "tau", "T", "beta"] {
        let raw = shared.join("data/sky64").join(format!("{key}.f64"));
        let raw = read(&raw.to_string_lossy());
        assert_same(&read_as(&commander, key).values, &raw.values);
    }
    // By the only frequency it names, and no other.
    assert!(refusal(&commander, "I_857").contains("2 Q353"));
    let planck = read_as(&file("HFI_SkyMap_857_128_R2.00_NESTED.fits"), "I_857");
    assert_eq!((planck.nside, planck.values.len()), (128, 196_608));
    // This file is degraded to the raw map at hand, in single precision.
    let raw = read(&shared.join("data/sky64/I_857_hfi.f64").to_string_lossy());
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    assert!((mean(&planck.values) / mean(&raw.values) - 1.0).abs() < 1e-6);
    // NSIDE as a string, uK_RJ.
    let pysm = file("check1therm_353p0_64.fits");
    let factor = Unit::MicroKRj.to_mjysr(353.0).expect("a frequency");
    let plain = read(&format!("{pysm}[2]"));
    let wanted: Vec<f64> = plain.values.iter().map(|value| value * factor).collect();
    assert_same(&read_as(&pysm, "Q_353").values, &wanted);
    let wmap = file("wmap_band_iqumap_r9_7yr_W_v4_udgraded32.fits");
    assert_eq!(read(&format!("{wmap}[U_STOKES]")).nside, 32);
    assert!(
        !read_as(&format!("{wmap}[unit=mK_CMB]"), "I_217")
            .values
            .is_empty()
    );
}

fn table<'a>(
    columns: &'a [MapColumn<'a>],
    nested: bool,
    provenance: &'a Provenance,
) -> MapTable<'a> {
    MapTable {
        columns,
        nested,
        provenance,
    }
}

#[test]
fn written_maps_are_read_back() {
    let dir = tempfile::tempdir().expect("a directory");
    for nside in [1, 2, 8, 16, 32] {
        let npix = 12 * nside * nside;
        let mut maps = [value(0, npix), value(1, npix), value(2, npix)];
        maps[1][3] = f64::NAN;
        let columns: Vec<_> = ["I", "Q", "U"]
            .into_iter()
            .zip(&maps)
            .map(|(name, values)| MapColumn {
                name,
                unit: "uK_RJ",
                values,
            })
            .collect();
        let provenance = Provenance::default();
        for (name, format) in [
            ("a.fits", MapFormat::Fits(Dtype::F32)),
            ("b.fits", MapFormat::Fits(Dtype::F64)),
            ("a.npy", MapFormat::Npy(Dtype::F32)),
            ("b.npy", MapFormat::Npy(Dtype::F64)),
        ] {
            let path = dir.path().join(name);
            write_map(&path, format, &table(&columns, false, &provenance)).expect("written");
            let spec = path.to_string_lossy();
            for (number, values) in (1..).zip(&maps) {
                let back = read(&format!("{spec}[{number}]"));
                let mut wanted = values.clone();
                wanted
                    .iter_mut()
                    .filter(|value| value.is_nan())
                    .for_each(|value| *value = MISSING);
                assert_same(&back.values, &wanted);
                assert_eq!(back.dtype, format.dtype());
            }
            if matches!(format, MapFormat::Fits(_)) {
                assert_eq!(std::fs::metadata(&path).expect("the file").len() % 2880, 0);
            }
        }
        // NESTED as it says.
        let nested: Vec<f64> = (0..npix as u64)
            .map(|pixel| {
                let ring =
                    nest2ring(Nside::new(nside as u64).expect("valid"), pixel).expect("valid");
                maps[0][ring as usize]
            })
            .collect();
        let column = [MapColumn {
            name: "I",
            unit: "K_CMB",
            values: &nested,
        }];
        let path = dir.path().join("n.fits");
        write_map(
            &path,
            MapFormat::Fits(Dtype::F64),
            &table(&column, true, &provenance),
        )
        .expect("written");
        assert_same(&read(&path.to_string_lossy()).values, &maps[0]);
    }
    let path = dir.path().join("one.f64");
    write_map_file(&path, &value(0, NPIX)).expect("written");
    assert_same(&read(&path.to_string_lossy()).values, &value(0, NPIX));
    let error =
        write_map_file(&dir.path().join("one.txt"), &value(0, NPIX)).expect_err("no format");
    assert_eq!(error.exit_code(), 2);
}

/// The cards are part of the product: other programs look for these.
#[test]
fn headers_of_written_maps() {
    let values = value(0, 3072);
    let columns = ["I", "Q", "U"].map(|name| MapColumn {
        name,
        unit: "MJy/sr",
        values: &values,
    });
    let provenance = Provenance {
        seed: Some(u64::MAX),
        config_hash: Some("0123456789abcdef".repeat(4)),
        ..Provenance::default()
    }
    .at(95.5);
    let mut bytes = Vec::new();
    write::map(
        &table(&columns, false, &provenance),
        Dtype::F32,
        &mut |part| {
            bytes.extend_from_slice(part);
            Ok(())
        },
    )
    .expect("written");
    assert_eq!(bytes.len() % 2880, 0);
    let cards: Vec<String> = bytes[2880..]
        .chunks(80)
        .map(|card| {
            String::from_utf8_lossy(card)
                .split(" / ")
                .next()
                .unwrap_or_default()
                .trim_end()
                .to_owned()
        })
        .take_while(|card| card != "END")
        .collect();
    let version = format!("VERSION = '{:<8}'", env!("CARGO_PKG_VERSION"));
    let hash = format!("CONFHASH= '{}'", "0123456789abcdef".repeat(4));
    let wanted = [
        "XTENSION= 'BINTABLE'",
        "BITPIX  =                    8",
        "NAXIS   =                    2",
        "NAXIS1  =                12288",
        "NAXIS2  =                    3",
        "PCOUNT  =                    0",
        "GCOUNT  =                    1",
        "TFIELDS =                    3",
        "TTYPE1  = 'I_STOKES'",
        "TFORM1  = '1024E   '",
        "TUNIT1  = 'MJy/sr  '",
        "TTYPE2  = 'Q_STOKES'",
        "TFORM2  = '1024E   '",
        "TUNIT2  = 'MJy/sr  '",
        "TTYPE3  = 'U_STOKES'",
        "TFORM3  = '1024E   '",
        "TUNIT3  = 'MJy/sr  '",
        "EXTNAME = 'MAP     '",
        "PIXTYPE = 'HEALPIX '",
        "ORDERING= 'RING    '",
        "NSIDE   =                   16",
        "FIRSTPIX=                    0",
        "LASTPIX =                 3071",
        "INDXSCHM= 'IMPLICIT'",
        "OBJECT  = 'FULLSKY '",
        "COORDSYS= 'G       '",
        "POLAR   =                    T",
        "POLCCONV= 'COSMO   '",
        "BAD_DATA=           -1.6375E30",
        "FREQ    =                 95.5",
        "CREATOR = 'dust3d  '",
        version.as_str(),
        "RANDSEED= 18446744073709551615",
        hash.as_str(),
    ];
    assert_eq!(cards, wanted);
}

/// Columns INDEX = l² + l + m + 1, REAL, IMAG in 20-byte rows; spectra one l a row.
#[test]
fn written_coefficients_and_spectra() {
    let lmax = 3;
    let alm: Vec<Complex<f64>> = (0..10)
        .map(|i| Complex::new(f64::from(i), -f64::from(i)))
        .collect();
    let mut bytes = Vec::new();
    write::alm(
        &[("T", &alm)],
        lmax,
        "K_CMB",
        &Provenance::default(),
        &mut |part| {
            bytes.extend_from_slice(part);
            Ok(())
        },
    )
    .expect("written");
    let (rows, _) = bytes[2 * 2880..].as_chunks::<20>();
    let index: Vec<u32> = rows[..10]
        .iter()
        .map(|row| u32::from_be_bytes([row[0], row[1], row[2], row[3]]))
        .collect();
    // m-major: l = 0…3 of m = 0, then 1…3 of m = 1, …
    assert_eq!(index, [1, 3, 7, 13, 4, 8, 14, 9, 15, 16]);
    for (row, a) in rows.iter().zip(&alm) {
        assert_eq!(row[4..12], a.re.to_be_bytes());
        assert_eq!(row[12..20], a.im.to_be_bytes());
    }
    assert!(
        write::alm(&[("T", &alm)], 4, "", &Provenance::default(), &mut |_| Ok(
            ()
        ))
        .is_err()
    );

    let (tt, ee) = ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]);
    let mut bytes = Vec::new();
    write::spectra(
        &[("TEMPERATURE", "K^2", &tt), ("GRADIENT", "K^2", &ee)],
        &Provenance::default(),
        &mut |part| {
            bytes.extend_from_slice(part);
            Ok(())
        },
    )
    .expect("written");
    let (words, _) = bytes[2 * 2880..].as_chunks::<8>();
    let values: Vec<f64> = words[..6]
        .iter()
        .map(|word| f64::from_be_bytes(*word))
        .collect();
    assert_eq!(values, [1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
    assert!(write::spectra(&[], &Provenance::default(), &mut |_| Ok(())).is_err());
}

#[test]
fn names_of_maps_and_selections() {
    for wrong in [
        "map.fits[]",
        "map.fits[1][2]",
        "map.f64[1]",
        "map.txt",
        "map.fits.zip",
        "map.f64.gz",
    ] {
        let error = MapSource::parse(wrong).expect_err("must be refused");
        assert_eq!(error.exit_code(), 2, "{error}");
    }
    let source = MapSource::parse("a b/map.FITS.gz[HDU=2][Q-POLARISATION][unit=mK, thermodynamic]")
        .expect("valid");
    assert_eq!(source.path(), Path::new("a b/map.FITS.gz"));
    let MapSource::Fits { selection, .. } = source else {
        panic!("{source:?} is no FITS source");
    };
    assert_eq!(selection.hdu.as_deref(), Some("2"));
    assert_eq!(selection.column.as_deref(), Some("Q-POLARISATION"));
    assert_eq!(selection.unit.as_deref(), Some("mK, thermodynamic"));
    // A file whose name ends in brackets is itself.
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("map[1].fits");
    std::fs::copy(data("iqu_f32.fits"), &path).expect("copied");
    assert_eq!(read(&path.to_string_lossy()).nside, 4);
}

#[test]
fn damaged_npy_files_give_a_sentence() {
    let bytes = std::fs::read(data("iqu.npy")).expect("the file");
    let mut damage = Damage(Random(7));
    for _ in 0..1000 {
        let changed = damage.apply(&bytes);
        let len = changed.len() as u64;
        match dust3d::io::npy::read_from(changed.as_slice(), len, &Selection::default(), None) {
            Ok(map) => assert_eq!(map.values.len(), 12 * (map.nside as usize).pow(2)),
            Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
        }
    }
}
