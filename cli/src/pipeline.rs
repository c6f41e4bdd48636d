//! The whole pipeline: stages in order, their maps written as they are made and dropped when no longer needed.

use crate::Error;
use crate::config::{Config, Dtype, Keep};
use crate::io::manifest::{
    FitStatistics, LawsRecord, LayerAverages as LayerAveragesRecord, SmallScaleRecord,
};
use crate::io::{Inputs, Manifest, RunDir};
use crate::plot::overview::{self, Overview};
use crate::progress::{Progress, Stopwatch};
use crate::sht::ShtPlan;
use crate::stages::builtin_sky::{self, distance_kpc};
use crate::stages::emission::{self, Law, Layer, Model};
use crate::stages::intensity::LayerAverages;
use crate::stages::laws::sky::{BETA_FLOOR, T_FLOOR, TotalFit, mean_std};
use crate::stages::laws::{
    self, Calibration, CalibrationStatus, Factors, LawStats, ObservedLaws, Sky,
};
use crate::stages::observations::{self, Observations};
use crate::stages::small_scales::{self, KappaStatus, LayerReport, StokesMaps};
use crate::stages::{field, fractions, intensity, pitch, polarisation};
use dust3d_kernels::healpix::Nside;
use dust3d_kernels::healpix::missing::is_missing;
use dust3d_kernels::simd::Level;
use std::fmt::Write as _;

/// Pixels that the calibration looks at first.
const SAMPLE_PIXELS: usize = 65_536;

/// Where a run writes, what it computes with, and who listens.
struct Run<'a> {
    config: &'a Config,
    out: &'a RunDir,
    nside: Nside,
    level: Level,
    progress: &'a dyn Progress,
    plan: ShtPlan,
}

/// Runs the pipeline on the current thread pool: from `inputs` (checked; none: the built-in sky) to every file of a
/// run's directory but the manifest, which is returned for [`RunDir::finish`].
///
/// # Errors
/// An input that cannot be used, or a file that cannot be written; `out` is then to be dropped.
pub fn run(
    config: &Config,
    inputs: Option<Inputs>,
    out: &RunDir,
    level: Level,
    progress: &dyn Progress,
) -> Result<Manifest, Error> {
    let watch = Stopwatch::new(progress);
    let nside = Nside::new(config.nside.into())?;
    let mut run = Run {
        config,
        out,
        nside,
        level,
        progress: &watch,
        plan: ShtPlan::new(nside, config.lmax(), level)?,
    };
    let mut manifest = Manifest::of_run(config);
    manifest.simd = level.name().to_owned();

    let (observed, edges) = run.observations(inputs, &mut manifest)?;
    let (layers, averages) = run.layers(&observed, &edges, &mut manifest)?;
    drop(edges);
    let templates = run.templates(layers, &observed, &mut manifest)?;
    run.laws_and_emission(templates, &averages, &observed, &mut manifest)?;

    manifest.stages = watch.stages();
    watch.finish();
    manifest.peak_memory_bytes = peak_memory_bytes();
    Ok(manifest)
}

impl Run<'_> {
    fn keeps_all(&self) -> bool {
        self.config.output.keep == Keep::All
    }

    /// Writes a map of the working grid.
    fn write(
        &self,
        stem: &str,
        quantity: &str,
        unit: &str,
        map: &[f64],
        dtype: Dtype,
    ) -> Result<(), Error> {
        self.out
            .map(stem, quantity, unit, self.config.nside, map, dtype)
    }

    /// Writes one intermediate map per layer, `stem`_1 … N, if intermediates are kept.
    fn write_layers(
        &self,
        stem: &str,
        quantity: &str,
        unit: &str,
        maps: &[Vec<f64>],
    ) -> Result<(), Error> {
        if self.keeps_all() {
            for (i, map) in maps.iter().enumerate() {
                self.write(
                    &format!("{stem}_{}", i + 1),
                    quantity,
                    unit,
                    map,
                    Dtype::F64,
                )?;
            }
        }
        Ok(())
    }

    /// The observations on the working grid, and the cube at the layers' edges.
    fn observations(
        &mut self,
        inputs: Option<Inputs>,
        manifest: &mut Manifest,
    ) -> Result<(Observations, Cube), Error> {
        self.progress.stage("observations", 1);
        let mut inputs = match inputs {
            Some(inputs) => inputs,
            None => builtin_sky::observe(&mut self.plan, self.config.seed, self.level)?,
        };
        manifest.inputs = inputs.records();
        let observed = observations::observe(&inputs, self.config, self.nside, self.level)?;

        let mut maps: Vec<(&str, &str, &str, &[f64])> = vec![
            ("I_353", "intensity at 353 GHz", "MJy/sr", &observed.i),
            ("Q_353", "Stokes Q at 353 GHz", "MJy/sr", &observed.q),
            ("U_353", "Stokes U at 353 GHz", "MJy/sr", &observed.u),
            ("tau", "optical depth at 353 GHz", "", &observed.tau),
            ("T", "dust temperature", "K", &observed.t),
            ("beta", "dust spectral index", "", &observed.beta),
        ];
        for (name, map) in &observed.others {
            maps.push((name, "observation, for validation", "MJy/sr", map));
        }
        for (name, quantity, unit, map) in maps {
            self.write(
                &format!("observations/{name}"),
                quantity,
                unit,
                map,
                Dtype::F64,
            )?;
        }
        if self.keeps_all() {
            for (_, map) in &inputs.cube {
                self.out.map(
                    &format!("cube/{}", map.name),
                    "cumulative reddening",
                    "mag",
                    map.nside,
                    &map.values,
                    Dtype::F64,
                )?;
            }
        }

        let mut edges = Vec::new();
        for &edge in &self.config.layers.edges {
            let found = inputs.cube.iter_mut().find(|(mu, _)| *mu == edge);
            let (_, map) = found.ok_or_else(|| {
                Error::usage(format!(
                    "layers.edges has the distance modulus {edge}, which the cube does not; choose from 4, 4.5 … 19"
                ))
            })?;
            edges.push(std::mem::take(&mut map.values));
        }
        let cube_nside = inputs.cube.first().map_or(1, |(_, map)| map.nside);
        let cube = Cube {
            nside: Nside::new(cube_nside.into())?,
            edges,
        };
        Ok((observed, cube))
    }

    /// Intensity and polarisation layers that add up to the observations, with the layers' average T and β.
    fn layers(
        &mut self,
        observed: &Observations,
        cube: &Cube,
        manifest: &mut Manifest,
    ) -> Result<(Vec<StokesMaps>, LayerAverages), Error> {
        let config = self.config;
        self.progress.stage("fractions", 1);
        let edges: Vec<&[f64]> = cube.edges.iter().map(Vec::as_slice).collect();
        let fractions = fractions::fractions(
            &edges,
            cube.nside,
            self.nside,
            config.layers.fill_radius_deg.to_radians(),
            self.level,
        )?;
        manifest.counts.missing_cube_pixels = fractions.missing_cube_pixels;
        self.write_layers(
            "fractions/f",
            "fraction of the dust in the layer",
            "",
            &fractions.maps,
        )?;

        self.progress.stage("intensity layers", 1);
        let averages = intensity::layer_averages(&fractions.maps, &observed.t, &observed.beta);
        manifest.layer_averages = Some(LayerAveragesRecord {
            t: averages.t.clone(),
            beta: averages.beta.clone(),
        });
        let (intensities, negative) =
            intensity::intensity(&fractions.maps, &observed.i, &observed.tau, &averages);
        drop(fractions);
        manifest.counts.negative_intensity = negative;
        self.write_layers(
            "intensity/I",
            "intensity of the layer at 353 GHz",
            "MJy/sr",
            &intensities,
        )?;

        let distances: Vec<f64> = config
            .layers
            .edges
            .iter()
            .map(|&mu| distance_kpc(mu))
            .collect();
        let pitch = match config.field.pitch_deg {
            Some(deg) => deg.to_radians(),
            None => self.pitch(&distances, observed, &intensities)?,
        };
        manifest.pitch_deg = Some(pitch.to_degrees());

        self.progress.stage("field", 1);
        let model = field::model(&config.field, pitch);
        let (q, u) = field::ratios(&model, &distances, self.nside, self.level)?;
        self.write_layers("field/q", "Q/I of the field model", "", &q)?;
        self.write_layers("field/u", "U/I of the field model", "", &u)?;

        self.progress.stage("polarisation layers", 1);
        let mut q = polarisation::predicted(q, &intensities);
        let mut u = polarisation::predicted(u, &intensities);
        self.write_layers(
            "predicted/Q",
            "Stokes Q predicted by the field",
            "MJy/sr",
            &q,
        )?;
        self.write_layers(
            "predicted/U",
            "Stokes U predicted by the field",
            "MJy/sr",
            &u,
        )?;
        let counts = polarisation::renormalise(
            &mut q,
            &mut u,
            &intensities,
            (&observed.q, &observed.u),
            config.polarisation.p_max,
        )?;
        manifest.counts.capped_pixels = counts.capped;
        manifest.counts.infeasible_pixels = counts.infeasible;
        self.write_layers(
            "renormalised/Q",
            "Stokes Q, adding up to the observed",
            "MJy/sr",
            &q,
        )?;
        self.write_layers(
            "renormalised/U",
            "Stokes U, adding up to the observed",
            "MJy/sr",
            &u,
        )?;

        let layers = intensities
            .into_iter()
            .zip(q)
            .zip(u)
            .map(|((i, q), u)| StokesMaps { i, q, u })
            .collect();
        Ok((layers, averages))
    }

    /// Fits the pitch angle and writes its scan.
    fn pitch(
        &self,
        distances: &[f64],
        observed: &Observations,
        intensities: &[Vec<f64>],
    ) -> Result<f64, Error> {
        let config = &self.config.field;
        self.progress.stage("pitch angle", 1);
        let fit = pitch::fit(
            &pitch::Scan {
                config,
                edges_kpc: distances,
                nside: Nside::new(u64::from(config.fit_nside).min(self.nside.get()))?,
                level: self.level,
            },
            self.nside,
            intensities,
            (&observed.q, &observed.u),
        )?;
        let mut csv = String::from("q_deg,G\n");
        for (q, g) in &fit.scan {
            let _ = writeln!(csv, "{q},{g:e}");
        }
        self.out
            .file("pitch.csv", "pitch-angle objective, MJy/sr", csv.as_bytes())?;
        Ok(fit.pitch_rad)
    }

    /// Adds small scales to the layers and writes the templates.
    fn templates(
        &mut self,
        layers: Vec<StokesMaps>,
        observed: &Observations,
        manifest: &mut Manifest,
    ) -> Result<Vec<StokesMaps>, Error> {
        let config = &self.config.small_scales;
        self.progress.stage("small scales", layers.len() as u64);
        let reach = observed.stokes_nside.min(self.nside.get()) as usize * 3 / 2;
        let mut templates = Vec::with_capacity(layers.len());
        for (index, layer) in layers.into_iter().enumerate() {
            let number = index + 1;
            let maps = if config.enabled {
                let (maps, report) = small_scales::add_small_scales(
                    &mut self.plan,
                    config,
                    self.config.seed,
                    number,
                    reach,
                    &layer,
                )?;
                manifest.counts.limited_pixels += report.limited_pixels;
                manifest.small_scales.push(record(&report));
                if self.keeps_all() {
                    let csv = spectra_csv(&report);
                    self.out.file(
                        &format!("spectra/layer_{number}.csv"),
                        "spectra of the layer before and after small scales, (MJy/sr)^2",
                        csv.as_bytes(),
                    )?;
                }
                maps
            } else {
                layer
            };
            let dtype = self.config.output.dtype;
            for (stokes, map) in [("I", &maps.i), ("Q", &maps.q), ("U", &maps.u)] {
                let stem = format!("templates/{stokes}_{number}");
                self.write(
                    &stem,
                    "template of the layer at 353 GHz",
                    "MJy/sr",
                    map,
                    dtype,
                )?;
            }
            templates.push(maps);
            self.progress.advance(1);
        }
        Ok(templates)
    }

    /// Emission laws, their calibration, emission at the wanted frequencies and the overview.
    fn laws_and_emission(
        &mut self,
        templates: Vec<StokesMaps>,
        averages: &LayerAverages,
        observed: &Observations,
        manifest: &mut Manifest,
    ) -> Result<(), Error> {
        let config = self.config;
        self.progress.stage("emission laws", templates.len() as u64);
        let law = ObservedLaws::measure(
            &mut self.plan,
            &observed.t,
            &observed.beta,
            observed.laws_nside as usize,
        )?;
        let (mut t, mut beta) = (Vec::new(), Vec::new());
        for number in 1..=templates.len() {
            let (dt, db) = laws::draw(
                &mut self.plan,
                &law,
                config.seed,
                number,
                config.laws.refilter_iterations,
            )?;
            t.push(dt);
            beta.push(db);
            self.progress.advance(1);
        }
        drop(law);

        self.progress.stage("calibration", 4);
        let statistics = statistics(&observed.t, &observed.beta);
        manifest.mbb_fit_observed = Some(fit_record(&statistics));
        let intensities: Vec<&[f64]> = templates.iter().map(|l| l.i.as_slice()).collect();
        let fit = TotalFit::new(&config.fit)?;
        let calibration = self.calibrate(&intensities, &t, &beta, averages, &fit, &statistics)?;
        let factors = calibration.factors;

        for (i, (t, beta)) in t.iter_mut().zip(&mut beta).enumerate() {
            manifest.counts.floored_laws +=
                laws::apply(t, factors.avg * averages.t[i], factors.t, T_FLOOR);
            manifest.counts.floored_laws +=
                laws::apply(beta, averages.beta[i], factors.beta, BETA_FLOOR);
            let dtype = config.output.dtype;
            self.write(
                &format!("laws/T_{}", i + 1),
                "dust temperature of the layer",
                "K",
                t,
                dtype,
            )?;
            self.write(
                &format!("laws/beta_{}", i + 1),
                "spectral index of the layer",
                "",
                beta,
                dtype,
            )?;
        }
        manifest.laws = Some(laws_record(&calibration, &t, &beta));
        manifest.mbb_fit_total = Some(fit_record(&calibration.fit.laws));
        manifest.counts.unconverged_fits = calibration.fit.unconverged;

        self.emission(&templates, &t, &beta, averages, &factors, observed)?;
        self.overview(&templates, &t, &beta, &fit)
    }

    /// Finds the factors of the laws, or takes those given.
    fn calibrate(
        &self,
        intensities: &[&[f64]],
        t: &[Vec<f64>],
        beta: &[Vec<f64>],
        averages: &LayerAverages,
        fit: &TotalFit,
        statistics: &LawStats,
    ) -> Result<Calibration, Error> {
        let config = &self.config.laws;
        let whole = Sky {
            intensity: intensities.to_vec(),
            t: t.iter().map(Vec::as_slice).collect(),
            beta: beta.iter().map(Vec::as_slice).collect(),
            averages,
            level: self.level,
        };
        if !config.calibrate {
            let factors = Factors {
                avg: config.s_avg,
                t: config.s_t,
                beta: config.s_beta,
            };
            return Ok(Calibration {
                factors,
                status: CalibrationStatus::Given,
                fit: whole.fit(fit, &factors)?,
            });
        }
        // A stride that shares no factor with the length of a ring meets every longitude.
        let npix = self.nside.npix() as usize;
        let stride = (npix / SAMPLE_PIXELS).max(1) | 1;
        let pick = |map: &[f64]| -> Vec<f64> { map.iter().copied().step_by(stride).collect() };
        let (i, dt, db): (Vec<_>, Vec<_>, Vec<_>) = (
            intensities.iter().map(|m| pick(m)).collect(),
            t.iter().map(|m| pick(m)).collect(),
            beta.iter().map(|m| pick(m)).collect(),
        );
        let sample = Sky {
            intensity: i.iter().map(Vec::as_slice).collect(),
            t: dt.iter().map(Vec::as_slice).collect(),
            beta: db.iter().map(Vec::as_slice).collect(),
            averages,
            level: self.level,
        };
        laws::calibrate(&sample, &whole, fit, statistics, self.progress)
    }

    /// Maps at the frequencies of the configuration, for all three models.
    fn emission(
        &self,
        templates: &[StokesMaps],
        t: &[Vec<f64>],
        beta: &[Vec<f64>],
        averages: &LayerAverages,
        factors: &Factors,
        observed: &Observations,
    ) -> Result<(), Error> {
        let frequencies = &self.config.frequencies;
        if frequencies.is_empty() {
            return Ok(());
        }
        self.progress
            .stage("emission", (Model::ALL.len() * frequencies.len()) as u64);
        let maps = layers_with(templates, |i| Law::Maps {
            t: &t[i],
            beta: &beta[i],
        });
        self.emit(Model::ThreeD, &maps)?;
        let uniform = layers_with(templates, |i| Law::Uniform {
            t: factors.avg * averages.t[i],
            beta: averages.beta[i],
        });
        self.emit(Model::Uniform, &uniform)?;
        let sum = total(templates);
        let (t, beta) = (fill_with_mean(&observed.t), fill_with_mean(&observed.beta));
        self.emit(
            Model::TwoD,
            &[layer(&sum, Law::Maps { t: &t, beta: &beta })],
        )
    }

    /// Maps of one model; one frequency at a time, as those of all would not fit beside the layers on a large grid.
    fn emit(&self, model: Model, layers: &[Layer<'_>]) -> Result<(), Error> {
        let npix = self.nside.npix() as usize;
        for &nu in &self.config.frequencies {
            let bands = [emission::monochromatic(nu)?];
            let mut out = [std::array::from_fn(|_| vec![0.0; npix])];
            for layer in layers {
                emission::add_layer(self.level, &bands, layer, &mut out)?;
            }
            for (stokes, map) in ["I", "Q", "U"].into_iter().zip(&out[0]) {
                let stem = format!("emission/{}_{nu}GHz_{stokes}", model.name());
                let quantity = format!("{stokes} at {nu} GHz, model {}", model.name());
                self.write(&stem, &quantity, "MJy/sr", map, self.config.output.dtype)?;
            }
            self.progress.advance(1);
        }
        Ok(())
    }

    /// The picture of the total at ν₀: I, Q, U and the T and β fitted to it.
    fn overview(
        &self,
        templates: &[StokesMaps],
        t: &[Vec<f64>],
        beta: &[Vec<f64>],
        fit: &TotalFit,
    ) -> Result<(), Error> {
        self.progress.stage("overview", 1);
        let sum = total(templates);
        let (fit_t, fit_beta) = laws::sky::fit_maps(
            &templates.iter().map(|l| l.i.as_slice()).collect::<Vec<_>>(),
            t,
            beta,
            fit,
            self.level,
        )?;
        let png = overview::render(&Overview {
            nside: self.config.nside,
            i: &sum.i,
            q: &sum.q,
            u: &sum.u,
            t: &fit_t,
            beta: &fit_beta,
        })?;
        self.out
            .file("overview.png", "I, Q, U, T and beta of the total", &png)
    }
}

/// The reddening cube at the layers' edges.
struct Cube {
    nside: Nside,
    edges: Vec<Vec<f64>>,
}

fn layer<'a>(maps: &'a StokesMaps, law: Law<'a>) -> Layer<'a> {
    Layer {
        stokes: [&maps.i, &maps.q, &maps.u],
        law,
    }
}

/// The templates, each with its law.
fn layers_with<'a>(templates: &'a [StokesMaps], law: impl Fn(usize) -> Law<'a>) -> Vec<Layer<'a>> {
    let layers = templates.iter().enumerate();
    layers.map(|(i, maps)| layer(maps, law(i))).collect()
}

/// Sum over the layers.
fn total(layers: &[StokesMaps]) -> StokesMaps {
    let sum = |get: fn(&StokesMaps) -> &Vec<f64>| {
        let npix = layers.first().map_or(0, |l| get(l).len());
        crate::parallel::map(npix, |range, out| {
            for layer in layers {
                for (out, x) in out.iter_mut().zip(&get(layer)[range.clone()]) {
                    *out += x;
                }
            }
        })
    };
    StokesMaps {
        i: sum(|l| &l.i),
        q: sum(|l| &l.q),
        u: sum(|l| &l.u),
    }
}

/// The map with its mean where it is missing.
fn fill_with_mean(map: &[f64]) -> Vec<f64> {
    let (mean, _) = mean_std(map);
    map.iter()
        .map(|&x| if is_missing(x) { mean } else { x })
        .collect()
}

fn statistics(t: &[f64], beta: &[f64]) -> LawStats {
    let ((t_mean, t_std), (beta_mean, beta_std)) = (mean_std(t), mean_std(beta));
    LawStats {
        t_mean,
        t_std,
        beta_mean,
        beta_std,
    }
}

fn fit_record(laws: &LawStats) -> FitStatistics {
    FitStatistics {
        t_mean: laws.t_mean,
        t_std: laws.t_std,
        beta_mean: laws.beta_mean,
        beta_std: laws.beta_std,
    }
}

fn laws_record(calibration: &Calibration, t: &[Vec<f64>], beta: &[Vec<f64>]) -> LawsRecord {
    let (t_mean, t_std) = t.iter().map(|m| mean_std(m)).unzip();
    let (beta_mean, beta_std) = beta.iter().map(|m| mean_std(m)).unzip();
    LawsRecord {
        s_avg: calibration.factors.avg,
        s_t: calibration.factors.t,
        s_beta: calibration.factors.beta,
        calibration_status: match calibration.status {
            CalibrationStatus::Solved => "solved",
            CalibrationStatus::Limit => "limit",
            CalibrationStatus::Given => "given",
        }
        .to_owned(),
        t_mean,
        t_std,
        beta_mean,
        beta_std,
    }
}

fn record(report: &LayerReport) -> SmallScaleRecord {
    SmallScaleRecord {
        alpha_t: report.tt.slope,
        a_t: report.tt.amplitude,
        a_ee: report.a_ee,
        a_bb: report.a_bb,
        kappa: report.kappa,
        kappa_status: match report.kappa_status {
            KappaStatus::Root => "root",
            KappaStatus::Enough => "enough",
            KappaStatus::Limit => "limit",
        }
        .to_owned(),
    }
}

fn spectra_csv(report: &LayerReport) -> String {
    let mut csv = String::from("l,TT_observed,EE_observed,BB_observed,TE_observed,TT,EE,BB,TE\n");
    for l in 0..report.before.tt.len() {
        let _ = write!(csv, "{l}");
        for spectra in [&report.before, &report.after] {
            for c in [&spectra.tt, &spectra.ee, &spectra.bb, &spectra.te] {
                let _ = write!(csv, ",{:e}", c[l]);
            }
        }
        csv.push('\n');
    }
    csv
}

/// Most memory the process has had resident, where the system tells.
fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}
