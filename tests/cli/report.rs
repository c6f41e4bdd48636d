//! The report of a run: what it holds, its numbers recomputed from the run's files, its verdict.

use crate::shell::Shell;
use dust3d::cut_sky::{Mask, Master};
use dust3d::kernels::healpix::{Nside, ring};
use dust3d::kernels::simd::Level;
use dust3d::sht::{Harmonics, ShtPlan};
use serde_json::Value;
use std::collections::BTreeMap;

/// A run on the built-in sky, small.
fn run(shell: &Shell, name: &str, more: &[&str]) {
    let mut args = vec![
        "run", "--quiet", "--nside", "16", "--freq", "353", "--seed", "3", "--out", name,
    ];
    args.extend(more);
    shell.succeed(&args);
}

/// The columns of a CSV file by name; text is NaN.
fn csv(shell: &Shell, name: &str) -> BTreeMap<String, Vec<f64>> {
    let text = String::from_utf8(shell.read(name)).expect("UTF-8");
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let mut columns: BTreeMap<String, Vec<f64>> = head
        .iter()
        .map(|name| (name.to_string(), Vec::new()))
        .collect();
    for line in lines {
        // Names in quotes may hold commas.
        let (name, rest) = match line.strip_prefix('"') {
            Some(line) => line.split_once("\",").expect("a name"),
            None => line.split_once(',').expect("two columns"),
        };
        let cells: Vec<&str> = std::iter::once(name).chain(rest.split(',')).collect();
        assert_eq!(cells.len(), head.len(), "{line}");
        for (name, cell) in head.iter().zip(cells) {
            columns
                .get_mut(*name)
                .expect("a column")
                .push(cell.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

fn check<'a>(summary: &'a Value, id: &str) -> &'a Value {
    let checks = summary["checks"].as_array().expect("a list");
    checks
        .iter()
        .find(|check| check["id"] == id)
        .unwrap_or_else(|| panic!("no check {id}"))
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

fn close(got: f64, wanted: f64, relative: f64, what: &str) {
    assert!(
        (got - wanted).abs() <= relative * wanted.abs(),
        "{what}: {got} instead of {wanted}"
    );
}

fn mean_std(map: &[f64]) -> (f64, f64) {
    let n = map.len() as f64;
    let mean = map.iter().sum::<f64>() / n;
    let square = map.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    (mean, square.sqrt())
}

#[test]
fn report_of_a_run() {
    let shell = Shell::new();
    run(&shell, "r", &[]);
    let said = shell.succeed(&["report", "r", "--master", "6", "--against", "r"]);
    assert!(said.contains("requirement_iii") && said.contains("r/report/index.html"));

    page_needs_nothing_else(&shell);
    numbers_are_those_of_the_files(&shell);

    // An earlier report is not replaced unless asked for.
    let refusal = shell.fail(2, &["report", "r"]);
    assert!(refusal.contains("--force"), "{refusal}");
    shell.succeed(&["report", "r", "--force", "--sky", "50"]);
    assert!(csv(&shell, "r/report/spectra-layer-1.csv").contains_key("TT_50"));
    // The same run gives the same numbers again.
    let first = shell.json("r/report/summary.json");
    shell.succeed(&["report", "r", "--quiet", "--out", "again"]);
    assert_eq!(first["checks"], shell.json("again/summary.json")["checks"]);
}

/// Every figure has its files and its place, every picture is one, and nothing is fetched from anywhere.
fn page_needs_nothing_else(shell: &Shell) {
    let page = String::from_utf8(shell.read("r/report/index.html")).expect("UTF-8");
    let summary = shell.json("r/report/summary.json");
    for forbidden in [
        "<script",
        "http://",
        "https://",
        "<link rel=\"stylesheet",
        "@import",
        ">NaN",
    ] {
        assert!(!page.contains(forbidden), "the page has {forbidden}");
    }
    for source in page
        .split("href=\"")
        .skip(1)
        .chain(page.split("url(").skip(1))
    {
        let target = &source[..source.find(['"', ')']).expect("an end")];
        if let Some(id) = target.strip_prefix('#') {
            assert!(page.contains(&format!("id=\"{id}\"")), "no place {id}");
        } else if !target.starts_with("data:") {
            assert!(!shell.read(&format!("r/report/{target}")).is_empty());
        }
    }
    let figures = summary["figures"].as_array().expect("a list");
    let papers: Vec<&str> = figures
        .iter()
        .filter_map(|figure| figure["paper"].as_str())
        .collect();
    for number in 1..=21 {
        assert!(
            papers.contains(&format!("Figure {number}").as_str()),
            "no figure {number}"
        );
    }
    assert!(papers.contains(&"Table 1"));
    for figure in figures {
        for file in figure["files"].as_array().expect("a list") {
            let name = format!("r/report/{}", file.as_str().expect("a name"));
            let bytes = shell.read(&name);
            if name.ends_with(".png") {
                let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info();
                assert!(reader.expect("a PNG").info().width >= 640, "{name}");
            } else {
                assert!(
                    csv(shell, &name).values().all(|column| !column.is_empty()),
                    "{name}"
                );
            }
        }
    }
    // What is drawn as text is in the font that the page carries.
    assert!(page.contains("@font-face") && page.matches("<svg").count() > 100);
}

fn numbers_are_those_of_the_files(shell: &Shell) {
    let summary = shell.json("r/report/summary.json");
    let map = |name: &str| shell.read_f64(&format!("r/{name}.f64"));
    let layers =
        |stem: &str| -> Vec<Vec<f64>> { (1..=6).map(|i| map(&format!("{stem}_{i}"))).collect() };
    let (i, q, u) = (
        layers("templates/I"),
        layers("templates/Q"),
        layers("templates/U"),
    );

    // Averages and standard deviations.
    let table = csv(shell, "r/report/averages.csv");
    for (layer, (t, beta)) in layers("laws/T")
        .iter()
        .zip(&layers("laws/beta"))
        .enumerate()
    {
        let ((t, dt), (b, db)) = (mean_std(t), mean_std(beta));
        close(table["T_mean"][layer], t, 1e-10, "T");
        close(table["T_std"][layer], dt, 1e-8, "σ_T");
        close(table["beta_mean"][layer], b, 1e-10, "β");
        close(table["beta_std"][layer], db, 1e-8, "σ_β");
    }

    // The mean emission law is that of the reference at 353 GHz, and of the emission map there.
    let law = csv(shell, "r/report/emission-law.csv");
    let at = law["GHz"]
        .iter()
        .position(|nu| *nu == 353.0)
        .expect("353 GHz");
    let (mean, _) = mean_std(&map("emission/3d_353GHz_I"));
    close(law["I_3d"][at], mean, 1e-12, "mean I");
    close(law["I_2d"][at], mean, 1e-12, "mean I of the 2-D model");
    let total = |maps: &[Vec<f64>], p: usize| -> f64 { maps.iter().map(|map| map[p]).sum() };
    let p: Vec<f64> = (0..i[0].len())
        .map(|p| total(&q, p).hypot(total(&u, p)))
        .collect();
    close(law["P_3d"][at], mean_std(&p).0, 1e-12, "mean P");
    // 2-D at 857 GHz by hand in every pixel.
    let at = law["GHz"]
        .iter()
        .position(|nu| *nu == 857.0)
        .expect("857 GHz");
    let (t, beta) = (map("observations/T"), map("observations/beta"));
    let planck = |nu: f64, t: f64| nu.powi(3) / (0.047_992_430_733_662_21 * nu / t).exp_m1();
    let by_hand: Vec<f64> = (0..i[0].len())
        .map(|p| {
            let scaling =
                (857.0_f64 / 353.0).powf(beta[p]) * planck(857.0, t[p]) / planck(353.0, t[p]);
            total(&i, p) * scaling
        })
        .collect();
    close(
        law["I_2d"][at],
        mean_std(&by_hand).0,
        1e-6,
        "mean I at 857 GHz",
    );

    // Polarisation fractions before small scales, and the cap.
    let histogram = csv(shell, "r/report/polarisation-fraction.csv");
    let (before, rq, ru) = (
        layers("intensity/I"),
        layers("renormalised/Q"),
        layers("renormalised/U"),
    );
    let share = |layer: usize, low: f64| {
        let counted: Vec<f64> = (0..before[0].len())
            .filter(|&p| before[layer][p] > 0.1 * total(&before, p))
            .map(|p| rq[layer][p].hypot(ru[layer][p]) / before[layer][p])
            .collect();
        let within = counted
            .iter()
            .filter(|p| (low..low + 0.01).contains(*p))
            .count();
        within as f64 / counted.len() as f64
    };
    for (layer, bin) in [(0, 5), (1, 12), (2, 20)] {
        let got = histogram[&format!("renormalised_{}", layer + 1)][bin];
        let wanted = share(layer, histogram["p_low"][bin]);
        assert!((got - wanted).abs() < 2e-3, "{layer} {bin}: {got} {wanted}");
    }
    let cap = check(&summary, "polarisation_cap");
    assert_eq!(cap["status"], "pass");
    assert!(number(&cap["values"]["largest_over_p_max"]) <= 1.0 + 1e-12);
    assert_eq!(check(&summary, "polarisation_sum")["status"], "pass");
    assert_eq!(check(&summary, "intensity_sum")["status"], "pass");
    let least = i
        .iter()
        .flatten()
        .fold(f64::INFINITY, |least, x| least.min(*x));
    let positivity = check(&summary, "positivity");
    assert_eq!(number(&positivity["values"]["least"]), least);
    assert_eq!(positivity["status"] == "pass", least >= 0.0);

    // Spectra of a template, by the other command.
    let text = shell.succeed(&[
        "map",
        "spectrum",
        "r/templates/I_2.f64",
        "r/templates/Q_2.f64",
        "r/templates/U_2.f64",
        "--lmax",
        "32",
    ]);
    shell.write("cl.csv", text.as_bytes());
    let (report, tool) = (
        csv(shell, "r/report/spectra-layer-2.csv"),
        csv(shell, "cl.csv"),
    );
    for kind in ["TT", "EE", "BB", "TE"] {
        let size = |l: usize| match kind {
            "TE" => (tool["TT"][l] * tool["EE"][l]).sqrt(),
            kind => tool[kind][l],
        };
        for l in 2..=30 {
            let (got, wanted) = (report[&format!("{kind}_100")][l], tool[kind][l]);
            assert!(
                (got - wanted).abs() < 2e-3 * size(l),
                "{kind} {l}: {got} {wanted}"
            );
        }
    }

    // On a part of the sky, with the weights that the report wrote.
    let weight = map("report/masks/sky_25_nside16");
    let square = weight.iter().map(|w| w * w).sum::<f64>() / weight.len() as f64;
    let weighted = |map: &[f64], mean: f64| -> Vec<f64> {
        map.iter()
            .zip(&weight)
            .map(|(x, w)| (x - mean) * w)
            .collect()
    };
    let mean = weighted(&i[0], 0.0).iter().sum::<f64>() / weight.iter().sum::<f64>();
    shell.write_f64("w/I.f64", &weighted(&i[0], mean));
    shell.write_f64("w/Q.f64", &weighted(&q[0], 0.0));
    shell.write_f64("w/U.f64", &weighted(&u[0], 0.0));
    let text = shell.succeed(&[
        "map", "spectrum", "w/I.f64", "w/Q.f64", "w/U.f64", "--lmax", "32",
    ]);
    shell.write("cl.csv", text.as_bytes());
    let (report, tool) = (
        csv(shell, "r/report/spectra-layer-1.csv"),
        csv(shell, "cl.csv"),
    );
    // The tool has other quadrature weights, which shows on so coarse a grid.
    for kind in ["TT", "EE", "BB"] {
        for l in 2..=28 {
            let (got, wanted) = (report[&format!("{kind}_25")][l], tool[kind][l] / square);
            assert!(
                (got - wanted).abs() < 2e-2 * wanted,
                "{kind} {l}: {got} {wanted}"
            );
        }
    }

    // Against itself a run has no differences.
    let differences = csv(shell, "r/report/against.csv");
    for row in 6..9 {
        assert_eq!(
            (differences["min"][row], differences["max"][row]),
            (0.0, 0.0)
        );
    }
    let r = csv(shell, "r/report/against-spectra.csv");
    for l in 2..=32 {
        assert!((r["E_correlation"][l] - 1.0).abs() < 1e-12);
    }

    // The verdict is that of its checks.
    let failed = summary["checks"]
        .as_array()
        .expect("a list")
        .iter()
        .any(|check| check["status"] == "fail");
    assert_eq!(summary["verdict"], if failed { "fail" } else { "pass" });
}

#[test]
fn final_runs_have_a_report_that_says_what_is_lacking() {
    let shell = Shell::new();
    run(&shell, "r", &["--keep", "final"]);
    shell.succeed(&["report", "r", "--quiet"]);
    let summary = shell.json("r/report/summary.json");
    for id in ["intensity_sum", "polarisation_sum", "polarisation_cap"] {
        let check = check(&summary, id);
        assert_eq!(check["status"], "not_available", "{id}");
        assert!(
            check["found"]
                .as_str()
                .expect("a sentence")
                .contains("--keep all")
        );
    }
    assert_eq!(check(&summary, "positivity")["status"], "pass");
    for figure in summary["figures"].as_array().expect("a list") {
        let id = figure["id"].as_str().expect("a name");
        if ["shells", "optical-depth", "predicted", "renormalised"].contains(&id) {
            assert!(
                figure["lacking"]
                    .as_str()
                    .expect("a sentence")
                    .contains("--keep all"),
                "{id}"
            );
            assert!(figure["files"].as_array().expect("a list").is_empty());
        }
    }
}

#[test]
fn check_fails_with_status_three() {
    let shell = Shell::new();
    // Layers too cold: the fit of the total cannot have the observed temperature.
    run(
        &shell,
        "r",
        &["--set", "laws.calibrate=false", "--set", "laws.s_avg=0.8"],
    );
    let output = shell.run(&["report", "r", "--check", "--quiet"]);
    assert_eq!(output.status.code(), Some(3));
    let stderr = String::from_utf8(output.stderr).expect("UTF-8");
    assert!(
        stderr.contains("requirement_iii") && stderr.contains("index.html"),
        "{stderr}"
    );
    let summary = shell.json("r/report/summary.json");
    assert_eq!(summary["verdict"], "fail");
    assert_eq!(check(&summary, "requirement_iii")["status"], "fail");
    // Without --check the same report is a success.
    shell.succeed(&["report", "r", "--force", "--quiet"]);
}

#[test]
fn refusals_of_a_report() {
    let shell = Shell::new();
    shell.write_f64("m.f64", &[0.5; 12]);
    assert!(
        shell
            .fail(2, &["report", "nothing"])
            .contains("not a finished run")
    );
    assert!(
        shell
            .fail(2, &["report", "nothing", "--sky", "0"])
            .contains("percentage")
    );
    run(&shell, "r", &["--keep", "final"]);
    assert!(
        shell
            .fail(2, &["report", "r", "--mask", "m.f64"])
            .contains("Nside")
    );
    shell.write_f64("z.f64", &vec![0.0; 12 * 256]);
    assert!(
        shell
            .fail(2, &["report", "r", "--mask", "z.f64"])
            .contains("no sky")
    );
    shell.write_f64("big.f64", &vec![2.0; 12 * 256]);
    assert!(
        shell
            .fail(2, &["report", "r", "--mask", "big.f64"])
            .contains("from 0 to 1")
    );
}

#[test]
fn namaster_table_band_powers() {
    let (nside, lmax, width) = (Nside::new(32).expect("an Nside"), 42, 8);
    let centres: Vec<[f64; 3]> = (0..nside.npix())
        .map(|p| ring::pix2vec(nside, p).expect("a pixel"))
        .collect();
    let of = |f: fn(f64, f64, f64) -> f64| -> Vec<f64> {
        centres.iter().map(|[x, y, z]| f(*x, *y, *z)).collect()
    };
    let mask = Mask {
        weight: of(|_, _, z| ((z.abs() - 0.2) / 0.3).clamp(0.0, 1.0).powi(2)),
    };
    let i = of(|x, y, z| {
        (5.0 * x).sin() * (4.0 * y).cos() + (11.0 * z * x).sin() + 0.3 * (17.0 * y).cos()
    });
    let q = of(|x, y, z| (6.0 * x * y).cos() + (9.0 * z).sin() * x + 0.2 * (19.0 * x).cos());
    let u = of(|x, y, z| (7.0 * y * z).sin() - (8.0 * x).cos() * y + 0.2 * (18.0 * y).sin());
    // NaMaster has the map as it is: the mean that this program subtracts is put back by weights that hold it.
    let mean = dust3d::cut_sky::pseudo::mean(&i, &mask);
    let mut plan = ShtPlan::new(nside, lmax, Level::detect()).expect("a plan");
    let mut alm = Harmonics::of(&mut plan, [&i, &q, &u], Some(&mask)).expect("coefficients");
    let mut constant = vec![dust3d::kernels::Complex::new(0.0, 0.0); plan.alm_len()];
    plan.analysis(
        &mask.weight,
        &mut constant,
        &dust3d::sht::Analysis::default(),
    )
    .expect("coefficients");
    for (t, w) in alm.t.iter_mut().zip(&constant) {
        *t += mean * w;
    }
    let master = Master::new(&plan, &mask, width).expect("bands");
    let got = master
        .band_powers(&alm.spectra(lmax).expect("spectra"))
        .expect("powers");
    let table = dust3d_tests::reference::rows(include_str!("../data/mode_coupling/master.txt"));
    assert_eq!(got.bands.len(), table.len());
    let largest = |column: usize| {
        table
            .iter()
            .map(|row| row[column].abs())
            .fold(0.0, f64::max)
    };
    for (b, row) in table.iter().enumerate() {
        let ours = [
            got.powers.tt[b],
            got.powers.ee[b],
            got.powers.bb[b],
            got.powers.te[b],
        ];
        for (k, ours) in ours.into_iter().enumerate() {
            let wanted = row[k + 1];
            // Both analyse by quadrature with three iterations, with other weights, which shows beside lmax.
            assert!(
                (ours - wanted).abs() <= 5e-4 * largest(k + 1),
                "band {b}, {k}: {ours} {wanted}"
            );
        }
    }
}

#[test]
fn namaster_table_map_spectrum() {
    let shell = Shell::new();
    let nside = Nside::new(32).expect("an Nside");
    let of = |f: fn(f64, f64, f64) -> f64| -> Vec<f64> {
        let centres = (0..nside.npix()).map(|p| ring::pix2vec(nside, p).expect("a pixel"));
        centres.map(|[x, y, z]| f(x, y, z)).collect()
    };
    shell.write_f64("I.f64", &of(|x, _, z| x + z));
    shell.write_f64(
        "Q.f64",
        &of(|x, y, z| (6.0 * x * y).cos() + (9.0 * z).sin() * x + 0.2 * (19.0 * x).cos()),
    );
    shell.write_f64(
        "U.f64",
        &of(|x, y, z| (7.0 * y * z).sin() - (8.0 * x).cos() * y + 0.2 * (18.0 * y).sin()),
    );
    shell.write_f64(
        "w.f64",
        &of(|_, _, z| ((z.abs() - 0.2) / 0.3).clamp(0.0, 1.0).powi(2)),
    );
    let maps = ["map", "spectrum", "I.f64", "Q.f64", "U.f64", "--lmax", "42"];
    let with = |more: &[&str]| shell.succeed(&[&maps, more].concat());
    with(&["--mask", "w.f64", "--master", "8", "--out", "cb.csv"]);
    let got = csv(&shell, "cb.csv");
    let table = dust3d_tests::reference::rows(include_str!("../data/mode_coupling/master.txt"));
    for (b, row) in table.iter().enumerate() {
        assert_eq!(got["l_first"][b], (2 + 8 * b) as f64);
        assert!((got["EE"][b] - row[2]).abs() < 1e-5 * table[0][2]);
        assert!((got["BB"][b] - row[3]).abs() < 1e-5 * table[1][3]);
    }
    // A mask of ones is no mask but for the mean of I.
    shell.write_f64("one.f64", &[1.0; 12288]);
    with(&["--mask", "one.f64", "--out", "one.csv"]);
    with(&["--out", "none.csv"]);
    let (one, none) = (csv(&shell, "one.csv"), csv(&shell, "none.csv"));
    assert_eq!(one["EE"], none["EE"]);
    // Masks of a map: the share that is asked for, with soft edges.
    shell.succeed(&[
        "map",
        "mask",
        "w.f64",
        "--sky",
        "40",
        "--apodise",
        "0",
        "--out",
        "m.f64",
    ]);
    let weight = shell.read_f64("m.f64");
    assert_eq!(weight.iter().sum::<f64>(), (0.4_f64 * 12288.0).round());
    assert!(
        shell
            .fail(
                2,
                &["map", "mask", "w.f64", "--sky", "140", "--out", "x.f64"]
            )
            .contains("--sky 140")
    );
}

#[test]
fn prop_masks() {
    let nside = Nside::new(32).expect("an Nside");
    let level = Level::detect();
    let z: Vec<f64> = (0..nside.npix())
        .map(|p| ring::pix2vec(nside, p).expect("a pixel")[2])
        .collect();
    // The faintest quarter of a map that rises with |z| is a belt of a quarter of the sphere.
    let map: Vec<f64> = z.iter().map(|z| z.abs()).collect();
    let mask = Mask::faintest(&map, 0.25);
    assert!((mask.mean() - 0.25).abs() < 1e-4);
    assert!(
        z.iter().zip(&mask.weight).all(
            |(z, w)| *w == f64::from(u8::from(z.abs() < 0.25)) || (z.abs() - 0.25).abs() < 0.02
        )
    );
    let width = 5.0_f64.to_radians();
    let soft = mask.apodised(nside, width, level).expect("a mask");
    for (pixel, (soft, hard)) in soft.weight.iter().zip(&mask.weight).enumerate() {
        assert!((0.0..=*hard).contains(soft));
        // Distance to the edge in latitude, to within a pixel.
        let inside = 0.25_f64.asin() - z[pixel].abs().asin();
        if inside > width + 0.06 {
            assert_eq!(*soft, 1.0);
        }
        if *hard == 1.0 && inside < 0.5 * width - 0.06 {
            assert!(*soft < 0.55, "{soft}");
        }
    }
    assert!(soft.mean_square() < soft.mean() && soft.mean() < mask.mean());
    assert_eq!(mask.apodised(nside, 0.0, level).expect("a mask"), mask);
    let whole = Mask::whole(12);
    assert_eq!(
        whole
            .apodised(Nside::new(1).expect("an Nside"), 0.5, level)
            .expect("a mask"),
        whole
    );
}
