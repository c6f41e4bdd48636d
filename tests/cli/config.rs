//! The configuration: round trips, overrides, and every refusal with its sentence.

use crate::properties::assert_configuration;
use dust3d::config::{Config, DEFAULT_TOML, Draft, parse_frequency};
use proptest::prelude::*;
use std::path::Path;

fn refusal(result: dust3d::Result<Config>) -> String {
    let error = result.expect_err("must be refused");
    assert_eq!(error.exit_code(), 2, "{error}");
    error.to_string()
}

#[test]
fn default_toml_is_the_default() {
    let printed = Config::from_toml(DEFAULT_TOML).expect("valid");
    assert_eq!(printed, Config::default().resolve().expect("valid"));
    assert_eq!(printed, Config::from_toml("").expect("valid"));
}

/// Every commented-out key of the printed default, switched on, is a known key too.
#[test]
fn default_toml_names_every_key() {
    let text: String = DEFAULT_TOML
        .lines()
        .map(|line| match line.strip_prefix("# ") {
            Some(rest) if rest.split_whitespace().nth(1) == Some("=") => format!("{rest}\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    let config = Config::from_toml(&text).expect("valid");
    assert_eq!(config.lmax, Some(128));
    assert_eq!(config.field.pitch_deg, Some(-33.0));
    let all = serde_json::to_value(&config).expect("serialises");
    assert!(
        !all.to_string().contains("null"),
        "a key is missing from the default: {all}"
    );
}

#[test]
fn overrides_win_in_order() {
    let config = Draft::new()
        .toml("nside = 32\n[small_scales]\nte = 0.1", Path::new(""))
        .and_then(|draft| draft.set("small_scales.enabled=false"))
        .and_then(|draft| draft.set("small_scales.te_filter = none"))
        .and_then(|draft| draft.set("layers.edges=[10, 19]"))
        .and_then(|draft| draft.set("frequencies=[95, \"100um\"]"))
        .and_then(|draft| draft.put("nside", 16))
        .and_then(Draft::finish)
        .expect("valid");
    assert_eq!(
        (config.nside, config.lmax, config.small_scales.te),
        (16, Some(32), 0.1)
    );
    assert!(!config.small_scales.enabled);
    assert_eq!(config.frequencies, [95.0, 2997.92458]);
    assert_eq!(config.small_scales.polarisation_beam_deg, [2.5, 2.5]);
}

#[test]
fn beams_follow_the_layers() {
    let edges = "layers.edges=[4,5,6,7,8,9,10,11]";
    let config = Draft::new()
        .set(edges)
        .and_then(Draft::finish)
        .expect("valid");
    assert_eq!(
        config.small_scales.polarisation_beam_deg,
        [2.5, 2.5, 2.5, 2.0, 2.0, 2.0, 2.0, 2.0]
    );
}

#[test]
fn seeds_span_64_bits() {
    for text in [
        "seed = 18446744073709551615",
        "seed = \"18446744073709551615\"",
    ] {
        assert_eq!(Config::from_toml(text).expect(text).seed, u64::MAX);
    }
    let set = Draft::new()
        .set("seed=18446744073709551615")
        .and_then(Draft::finish);
    assert_eq!(set.expect("valid").seed, u64::MAX);
    assert!(refusal(Config::from_toml("seed = -1")).contains("`seed`"));
    assert!(refusal(Config::from_toml("\nseed = 18446744073709551616")).contains("line 2"));
}

#[test]
fn paths_are_relative_to_the_file() {
    let text = "[inputs]\nI_353 = \"a.f64\"\ncube = \"/abs/{modulus}.f32\"";
    let config = Draft::new()
        .toml(text, Path::new("some/where"))
        .and_then(|draft| draft.set("inputs.tau=here.f64"))
        .and_then(Draft::finish)
        .expect("valid");
    assert_eq!(config.inputs.i_353.as_deref(), Some("some/where/a.f64"));
    assert_eq!(config.inputs.cube.as_deref(), Some("/abs/{modulus}.f32"));
    assert_eq!(config.inputs.tau.as_deref(), Some("here.f64"));
}

#[test]
fn unknown_keys_name_the_nearest() {
    for (text, key, nearest) in [
        ("nsid = 64", "`nsid`", "`nside`"),
        (
            "[small_scales]\nenable = true",
            "`small_scales.enable`",
            "`small_scales.enabled`",
        ),
        ("[small_scale]\nte = 0.3", "`small_scale`", "`small_scales`"),
        ("p_max = 0.2", "`p_max`", "`polarisation.p_max`"),
        (
            "[inputs]\ni_353 = \"x\"",
            "`inputs.i_353`",
            "`inputs.I_353`",
        ),
    ] {
        let message = refusal(Config::from_toml(text));
        assert!(
            message.contains(key) && message.contains(nearest),
            "{message}"
        );
    }
    let message = refusal(Draft::new().set("laws.s_T=1").and_then(Draft::finish));
    assert!(
        message.contains("`laws.s_T`") && message.contains("`laws.s_t`"),
        "{message}"
    );
}

#[test]
fn bad_values_name_their_key() {
    for (text, expected) in [
        ("nside = 48", "`nside` is 48; it must be a power of two"),
        ("nside = 0", "`nside`"),
        ("nside = -1", "`nside`"),
        ("nside = 64.5", "`nside`"),
        ("lmax = 257", "`lmax` is 257; it must be from 3 to 4 nside"),
        ("frequencies = [0.0]", "`frequencies`"),
        ("frequencies = [\"12 parsec\"]", "12 parsec"),
        ("inputs = 3", "[inputs]"),
        ("nside = [64]", "`nside`"),
        (
            "[inputs]\ncolor_correction = 0",
            "`inputs.color_correction`",
        ),
        ("[cube]\nmonotone = \"never\"", "`cube.monotone`"),
        ("[layers]\nedges = []", "`layers.edges`"),
        ("[layers]\nedges = [7, 4]", "`layers.edges`"),
        ("[layers]\nedges = [4.2, 7]", "`layers.edges` is 4.2"),
        ("[layers]\nedges = [4, 20]", "`layers.edges` is 20"),
        ("[layers]\nfill_radius_deg = 0", "`layers.fill_radius_deg`"),
        ("[field]\npitch_deg = 90", "`field.pitch_deg`"),
        (
            "[field]\npitch_deg = nan",
            "`field.pitch_deg` is not a finite number",
        ),
        (
            "[field]\npitch_range_deg = [-5, -60]",
            "`field.pitch_range_deg`",
        ),
        (
            "[field]\npitch_range_deg = [-5, inf]",
            "`field.pitch_range_deg`",
        ),
        ("[field]\npitch_range_deg = [-5]", "`field.pitch_range_deg`"),
        ("[field]\nmin_latitude_deg = 90", "`field.min_latitude_deg`"),
        ("[field]\nfit_nside = 3", "`field.fit_nside`"),
        ("[field]\np0 = 1.2", "`field.p0`"),
        ("[field]\nk = -1", "`field.k`"),
        ("[field]\nh_z_kpc = 0", "`field.h_z_kpc`"),
        ("[polarisation]\np_max = 0", "`polarisation.p_max`"),
        ("[small_scales]\nte = 1", "`small_scales.te`"),
        (
            "[small_scales]\npolarisation_beam_deg = []",
            "`small_scales.polarisation_beam_deg`",
        ),
        ("[small_scales]\nenabled = 1", "`small_scales.enabled`"),
        (
            "[small_scales]\nrestore_fwhm_deg = -1",
            "`small_scales.restore_fwhm_deg`",
        ),
        ("[laws]\ns_avg = 0", "`laws.s_avg`"),
        ("[fit]\nsigma = [0.1]", "`fit.sigma`"),
        ("[fit]\nnu_ghz = [353, 545]", "`fit.nu_ghz`"),
        ("[output]\ndtype = \"f16\"", "`output.dtype`"),
        ("a = 1\nb = [", "line 2"),
    ] {
        let message = refusal(Config::from_toml(text));
        assert!(message.contains(expected), "{text:?} gave: {message}");
        assert!(!message.contains('\n'), "more than one line: {message}");
    }
}

#[test]
fn frequencies_are_numbers_or_wavelengths() {
    assert_eq!(parse_frequency("100um"), Some(2997.92458));
    assert_eq!(parse_frequency("100 µm"), Some(2997.92458));
    assert_eq!(parse_frequency("2998"), Some(2998.0));
    assert_eq!(parse_frequency("353 GHz"), Some(353.0));
    for bad in ["", "um", "0", "-5", "nan", "inf", "0um", "five"] {
        assert_eq!(parse_frequency(bad), None, "{bad}");
    }
}

#[test]
fn prop_edges_configuration() {
    for text in [
        DEFAULT_TOML,
        "",
        "=",
        "a.b.c=1",
        "nside=\"64\"",
        "layers=[]",
        "seed=1979-05-27",
        "field.k={}",
        "frequencies=[[]]",
    ] {
        assert_configuration(text);
    }
}

proptest! {
    /// The default with one of its lines replaced by one with another value.
    #[test]
    fn prop_random_configuration(line in 0_usize..90, value in "[-+0-9.eE]{1,6}|[\\[\\]{}\"a-z=., ]{0,12}|inf|nan|true") {
        let mut section = String::new();
        let mut lines: Vec<String> = DEFAULT_TOML.lines().map(str::to_owned).collect();
        let index = line % lines.len();
        if let Some((key, _)) = lines[index].trim_start_matches("# ").to_owned().split_once(" = ") {
            lines[index] = format!("{key} = {value}");
            section = lines[..index].iter().rev().find(|line| line.starts_with('[')).map_or_else(String::new, |line| {
                let name = line.trim_start_matches('[').split(']').next().unwrap_or_default();
                format!("{name}.")
            });
            assert_configuration(&format!("{section}{key}={value}"));
        }
        assert_configuration(&lines.join("\n"));
        prop_assert!(section.is_empty() || section.ends_with('.'));
    }
}
