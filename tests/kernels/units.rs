//! Units: factors against 50-digit arithmetic, names, errors.

use dust3d_kernels::Error;
use dust3d_kernels::units::{Unit, UnitKind};
use dust3d_tests::reference::{relative, rows};
use dust3d_tests::tolerance as tol;
use proptest::prelude::*;

#[test]
fn mp_table_factors() {
    let mut worst = 0.0_f64;
    for row in rows(include_str!("../data/planck/units.txt")) {
        worst = worst
            .max(relative(
                Unit::MicroKRj.from_mjysr(row[0]).unwrap(),
                row[1],
                0.0,
            ))
            .max(relative(
                Unit::MicroKCmb.from_mjysr(row[0]).unwrap(),
                row[2],
                0.0,
            ));
    }
    println!("units: {worst:.2e}");
    tol::UNIT.hold(worst);
}

#[test]
fn names_round_trip_and_fits_spellings() {
    for unit in Unit::ALL {
        assert_eq!(unit.to_string().parse(), Ok(unit));
        assert_eq!(unit.name(), format!("{unit}"));
    }
    assert_eq!(format!("{:>7}", Unit::KRj), "   K_RJ");
    for (text, unit) in [
        ("MJy/sr", Unit::MJySr),
        ("MJy sr-1", Unit::MJySr),
        ("MJy.sr-1", Unit::MJySr),
        ("MJy sr^-1", Unit::MJySr),
        ("MJy sr^{-1}", Unit::MJySr),
        ("MJy sr**-1", Unit::MJySr),
        (" MJy / sr ", Unit::MJySr),
        ("Mjy/sr", Unit::MJySr),
        ("Jy/sr", Unit::JySr),
        ("K_CMB", Unit::KCmb),
        ("Kcmb", Unit::KCmb),
        ("KCMB", Unit::KCmb),
        ("K_{CMB}", Unit::KCmb),
        ("K(CMB)", Unit::KCmb),
        ("mK,thermodynamic", Unit::MilliKCmb),
        ("mK, antenna", Unit::MilliKRj),
        ("mK_CMB", Unit::MilliKCmb),
        ("uK_RJ", Unit::MicroKRj),
        ("uKrj", Unit::MicroKRj),
        ("muK_RJ", Unit::MicroKRj),
        ("muKcmb", Unit::MicroKCmb),
        ("microK_CMB", Unit::MicroKCmb),
        ("\u{b5}K_CMB", Unit::MicroKCmb),
        ("\u{3bc}K_RJ", Unit::MicroKRj),
        ("K_RJ", Unit::KRj),
        ("mK_RJ", Unit::MilliKRj),
    ] {
        assert_eq!(text.parse(), Ok(unit), "{text}");
    }
    for text in [
        "",
        "K",
        "mK",
        "uK",
        "mJy/sr",
        "MK_CMB",
        "Jy",
        "MJy",
        "Jy*sr",
        "K_",
        "K_RJx",
        "K_CMB/Hz",
        "unknown",
        "\u{b5}",
        "\u{1f600}K_CMB",
        "MJy/sr MJy/sr MJy/sr MJy/sr MJy/sr",
    ] {
        assert!(text.parse::<Unit>().is_err(), "{text}");
    }
    let message = "K".parse::<Unit>().unwrap_err().to_string();
    assert!(message.contains("uK_CMB"), "{message}");
}

#[test]
fn bad_frequencies_are_errors() {
    for unit in Unit::ALL {
        for nu in [0.0, -353.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let brightness = unit.kind() == UnitKind::Brightness;
            assert_eq!(unit.from_mjysr(nu).is_ok(), brightness, "{unit} {nu}");
            assert_eq!(unit.to_mjysr(nu).is_ok(), brightness, "{unit} {nu}");
        }
    }
    // No CMB left to compare with: an error one way, nothing the other.
    assert!(matches!(
        Unit::KCmb.from_mjysr(1e5),
        Err(Error::Domain { .. })
    ));
    assert_eq!(Unit::KCmb.to_mjysr(1e5), Ok(0.0));
    assert!(Unit::KRj.from_mjysr(1e-200).is_err());
}

proptest! {
    #[test]
    fn prop_factors_invert(nu in 0.1..20000.0_f64) {
        for unit in Unit::ALL {
            let product = unit.from_mjysr(nu).unwrap() * unit.to_mjysr(nu).unwrap();
            prop_assert!((product - 1.0).abs() < 1e-15);
        }
        // Thermodynamic temperature is never below the Rayleigh–Jeans one.
        prop_assert!(Unit::KCmb.from_mjysr(nu).unwrap() >= Unit::KRj.from_mjysr(nu).unwrap());
    }

    #[test]
    fn prop_any_text_parses_or_not(text in ".{0,40}") {
        if let Ok(unit) = text.parse::<Unit>() {
            prop_assert!(Unit::ALL.contains(&unit));
        }
    }
}
