//! The whole pipeline on small skies: what must hold of every run.

use dust3d::config::Draft;
use dust3d::io::{Inputs, Manifest, RunDir};
use dust3d::kernels::simd::Level;
use dust3d::progress::Silent;
use dust3d::{Config, pipeline};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Every file of a run but the manifest, by name.
type Files = BTreeMap<String, Vec<u8>>;

struct Run {
    manifest: Manifest,
    files: Files,
}

impl Run {
    fn map(&self, stem: &str) -> Vec<f64> {
        let bytes = self
            .files
            .get(&format!("{stem}.f64"))
            .unwrap_or_else(|| panic!("no {stem}.f64 among {:?}", self.files.keys()));
        let (values, rest) = bytes.as_chunks::<8>();
        assert!(rest.is_empty());
        values.iter().map(|b| f64::from_le_bytes(*b)).collect()
    }

    fn layers(&self, stem: &str) -> Vec<Vec<f64>> {
        let layers = self.manifest.layers.expect("a run has layers");
        (1..=layers)
            .map(|i| self.map(&format!("{stem}_{i}")))
            .collect()
    }
}

fn config(settings: &[&str]) -> Config {
    settings
        .iter()
        .fold(Draft::new(), |draft, s| draft.set(s).expect("a known key"))
        .finish()
        .expect("a valid configuration")
}

fn run_config(config: &Config, threads: usize) -> Run {
    let parent = tempfile::tempdir().expect("a temporary directory");
    let target = parent.path().join("run");
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads");
    let manifest = pool.install(|| {
        let inputs =
            (!config.inputs.is_built_in()).then(|| Inputs::read(config).expect("good inputs"));
        let out = RunDir::create(&target, false).expect("a new directory");
        let manifest =
            pipeline::run(config, inputs, &out, Level::detect(), &Silent).expect("a run");
        out.finish(manifest).expect("a finished directory")
    });
    let mut files = Files::new();
    collect(&target, &target, &mut files);
    assert!(files.remove("manifest.json").is_some());
    Run { manifest, files }
}

fn run(settings: &[&str]) -> Run {
    run_config(&config(settings), 2)
}

fn collect(root: &Path, dir: &Path, files: &mut Files) {
    for entry in std::fs::read_dir(dir).expect("a directory") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(root, &path, files);
        } else {
            let name = path.strip_prefix(root).expect("below the root");
            let name = name.to_string_lossy().replace('\\', "/");
            files.insert(name, std::fs::read(&path).expect("a file"));
        }
    }
}

fn mean_std(map: &[f64]) -> (f64, f64) {
    let n = map.len() as f64;
    let mean = map.iter().sum::<f64>() / n;
    let variance = map.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    (mean, variance.sqrt())
}

/// The invariants of every stage that is kept.
fn check_invariants(run: &Run) {
    let (i, q, u) = (
        run.map("observations/I_353"),
        run.map("observations/Q_353"),
        run.map("observations/U_353"),
    );
    let fractions = run.layers("fractions/f");
    let intensity = run.layers("intensity/I");
    let (rq, ru) = (run.layers("renormalised/Q"), run.layers("renormalised/U"));
    let (mut capped_over, p_max) = (0, 0.25);
    for p in 0..i.len() {
        let sum: f64 = fractions.iter().map(|f| f[p]).sum();
        assert!((sum - 1.0).abs() < 1e-12);
        assert!(fractions.iter().all(|f| f[p] >= 0.0));
        let sum: f64 = intensity.iter().map(|l| l[p]).sum();
        assert!((sum - i[p]).abs() <= 1e-12 * i[p]);
        assert!(intensity.iter().all(|l| l[p] >= 0.0));

        let (mut sq, mut su, mut moduli) = (0.0, 0.0, 0.0);
        let total = q[p].hypot(u[p]);
        for k in 0..rq.len() {
            sq += rq[k][p];
            su += ru[k][p];
            let v = rq[k][p].hypot(ru[k][p]);
            moduli += v;
            if total <= p_max * i[p] && v > p_max * intensity[k][p] * (1.0 + 1e-12) {
                capped_over += 1;
            }
        }
        assert!((sq - q[p]).hypot(su - u[p]) <= 1e-12 * moduli.max(total));
    }
    assert_eq!(capped_over, 0);
    for (stokes_q, (stokes_u, stokes_i)) in run.layers("templates/Q").iter().zip(
        run.layers("templates/U")
            .iter()
            .zip(&run.layers("templates/I")),
    ) {
        for p in 0..stokes_i.len() {
            assert!(stokes_i[p] >= 0.0);
            assert!(stokes_q[p].hypot(stokes_u[p]) <= stokes_i[p] * (1.0 + 1e-12));
        }
    }
    for t in run.layers("laws/T") {
        assert!(t.iter().all(|&t| t >= 5.0));
    }
    for beta in run.layers("laws/beta") {
        assert!(beta.iter().all(|&b| b >= 0.0));
    }
}

#[test]
fn builtin_sky_run_keeps_every_invariant() {
    let run = run(&["nside=32", "seed=7"]);
    check_invariants(&run);

    // At ν₀ the emission is the sum of the templates.
    let emitted = run.map("emission/3d_353GHz_I");
    let templates = run.layers("templates/I");
    for (p, x) in emitted.iter().enumerate() {
        let sum: f64 = templates.iter().map(|t| t[p]).sum();
        assert!((x - sum).abs() <= 1e-14 * sum);
    }
    for model in ["3d", "3d-uniform", "2d"] {
        for nu in ["143", "217", "353"] {
            for stokes in ["I", "Q", "U"] {
                assert!(
                    run.files
                        .contains_key(&format!("emission/{model}_{nu}GHz_{stokes}.f64"))
                );
            }
        }
    }

    // Calibration: the fit of the total has the observed mean and spread.
    let total = run.manifest.mbb_fit_total.expect("a fit of the total");
    let observed = run
        .manifest
        .mbb_fit_observed
        .expect("a fit of the observed");
    let laws = run.manifest.laws.as_ref().expect("laws");
    let (mean, std) = mean_std(&run.map("observations/T"));
    assert!(
        (observed.t_mean / mean - 1.0).abs() < 1e-12 && (observed.t_std / std - 1.0).abs() < 1e-9
    );
    assert!((total.t_mean / observed.t_mean - 1.0).abs() < 1e-3);
    assert!((total.t_std / observed.t_std - 1.0).abs() < 1e-3);
    assert_eq!(laws.calibration_status, "solved");
    assert!((total.beta_std / observed.beta_std - 1.0).abs() < 1e-3);
    assert!((0.94..1.02).contains(&laws.s_avg) && (1.0..2.2).contains(&laws.s_t));

    assert_eq!(run.manifest.small_scales.len(), 6);
    assert!(run.files["pitch.csv"].starts_with(b"q_deg,G\n-60,"));
    assert_eq!(
        run.files["pitch.csv"]
            .iter()
            .filter(|&&c| c == b'\n')
            .count(),
        57
    );
    assert!(run.files["overview.png"].starts_with(b"\x89PNG"));
    assert_eq!(run.files.len(), run.manifest.files.len());
}

#[test]
fn threads_do_not_change_a_byte() {
    let config = config(&["nside=16", "seed=3"]);
    let (one, two) = (run_config(&config, 1), run_config(&config, 2));
    assert_eq!(
        one.files.keys().collect::<Vec<_>>(),
        two.files.keys().collect::<Vec<_>>()
    );
    for (name, bytes) in &one.files {
        assert_eq!(Some(bytes), two.files.get(name), "{name}");
    }
}

#[test]
fn seeds_make_different_skies_of_the_same_observations() {
    let (a, b) = (
        run(&["nside=16", "seed=1"]),
        run(&["nside=16", "seed=1", "laws.refilter_iterations=2"]),
    );
    assert_eq!(a.files["templates/I_1.f64"], b.files["templates/I_1.f64"]);
    assert_ne!(a.files["laws/T_1.f64"], b.files["laws/T_1.f64"]);
    let c = run(&["nside=16", "seed=2"]);
    assert_ne!(a.files["templates/I_1.f64"], c.files["templates/I_1.f64"]);
}

#[test]
fn other_numbers_of_layers_work() {
    for edges in [
        "[19.0]",
        "[8.0, 19.0]",
        "[4.0, 5.5, 7.0, 9.0, 11.0, 13.0, 16.0, 19.0]",
    ] {
        let run = run(&[
            "nside=16",
            &format!("layers.edges={edges}"),
            "frequencies=[353]",
        ]);
        check_invariants(&run);
    }
}

#[test]
fn keep_final_leaves_the_products_only() {
    let run = run(&[
        "nside=8",
        "output.keep=\"final\"",
        "output.dtype=\"f32\"",
        "frequencies=[95.5]",
    ]);
    let mut folders: Vec<&str> = run
        .files
        .keys()
        .filter_map(|f| f.split_once('/'))
        .map(|f| f.0)
        .collect();
    folders.dedup();
    assert_eq!(folders, ["emission", "laws", "observations", "templates"]);
    assert!(run.files.contains_key("emission/3d_95.5GHz_I.f32"));
    assert!(run.files.contains_key("laws/T_1.f32"));
}

#[test]
fn stages_can_be_left_out() {
    let run = run(&[
        "nside=16",
        "small_scales.enabled=false",
        "field.pitch_deg=-20.0",
        "laws.calibrate=false",
        "frequencies=[]",
    ]);
    assert!(run.manifest.small_scales.is_empty());
    assert_eq!(
        run.files["templates/Q_2.f64"],
        run.files["renormalised/Q_2.f64"]
    );
    assert_eq!(
        run.files["templates/I_2.f64"],
        run.files["intensity/I_2.f64"]
    );
    assert!(!run.files.contains_key("pitch.csv"));
    assert_eq!(run.manifest.pitch_deg, Some(-20.0));
    let laws = run.manifest.laws.as_ref().expect("laws");
    assert_eq!((laws.s_avg, laws.s_t, laws.s_beta), (0.982, 1.84, 1.94));
    assert_eq!(laws.calibration_status, "given");
}

/// The folder of real observations, if it is there.
fn real_data() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let shared = std::env::var_os("SHARED").map_or_else(|| root.join("shared"), PathBuf::from);
    let data = shared.join("data");
    data.join("sky64/I_353.f64").is_file().then_some(data)
}

#[test]
fn real_observations_run_at_nside_64() {
    let Some(data) = real_data() else {
        eprintln!(
            "SKIPPED: no real observations found ($SHARED/data or ../shared/data): this run was NOT tested"
        );
        return;
    };
    let mut settings = vec!["nside=64".to_owned(), "seed=5".to_owned()];
    for (key, file) in [
        ("I_353", "I_353"),
        ("Q_353", "Q_353"),
        ("U_353", "U_353"),
        ("tau", "tau"),
        ("T", "T"),
        ("beta", "beta"),
    ] {
        settings.push(format!(
            "inputs.{key}=\"{}/sky64/{file}.f64\"",
            data.display()
        ));
    }
    settings.push(format!(
        "inputs.cube=\"{}/cube32/ebv_{{modulus}}.f32\"",
        data.display()
    ));
    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
    let run = run(&settings);
    check_invariants(&run);
    let laws = run.manifest.laws.as_ref().expect("laws");
    assert_eq!(laws.calibration_status, "limit");
    assert_eq!(laws.s_beta, 0.5);
    let (total, observed) = (
        run.manifest.mbb_fit_total.expect("a fit"),
        run.manifest.mbb_fit_observed.expect("a fit"),
    );
    assert!((total.t_mean / observed.t_mean - 1.0).abs() < 1e-3);
    assert!((total.t_std / observed.t_std - 1.0).abs() < 1e-3);
    let pitch = run.manifest.pitch_deg.expect("a pitch angle");
    assert!((-60.0..-5.0).contains(&pitch), "{pitch}");
}
