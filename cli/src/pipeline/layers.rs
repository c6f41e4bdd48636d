//! Intensity and polarisation layers that add up to the observations.

use super::Preparation;
use super::observed::Cube;
use crate::Error;
use crate::io::manifest::LayerAverages as LayerAveragesRecord;
use crate::io::output::MapWriter;
use crate::stages::builtin_sky::distance_kpc;
use crate::stages::fractions::{self, Fractions};
use crate::stages::intensity::{AverageSums, LayerAverages};
use crate::stages::observations::Observations;
use crate::stages::{field, intensity, pitch, polarisation, regrid};
use crate::store::{Pieces, Stored, slabs};
use dust3d_kernels::healpix::Nside;
use dust3d_kernels::split::Counts;
use rayon::prelude::*;
use std::fmt::Write as _;

/// I, Q, U of every layer.
pub(super) type Layers = Vec<[Stored; 3]>;

impl Preparation<'_> {
    /// The layers, with their average T and β.
    pub(super) fn layers(
        &mut self,
        observed: &Observations,
        cube: &Cube,
    ) -> Result<(Layers, LayerAverages), Error> {
        let config = self.config;
        let npix = observed.i.len();
        self.progress.stage("fractions", slabs(npix).count() as u64);
        let edges: Vec<&[f64]> = cube.edges.iter().map(Vec::as_slice).collect();
        let radius = config.layers.fill_radius_deg.to_radians();
        let fractions = fractions::fractions(&edges, cube.nside, radius, self.level)?;
        self.manifest.counts.missing_cube_pixels = fractions.missing_cube_pixels;
        let averages = self.averages(&fractions, observed)?;

        self.progress
            .stage("intensity layers", slabs(npix).count() as u64);
        let intensities = self.intensities(&fractions, observed, &averages)?;
        drop(fractions);

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
        self.manifest.pitch_deg = Some(pitch.to_degrees());

        self.progress
            .stage("polarisation layers", slabs(npix).count() as u64);
        let model = field::model(&config.field, pitch);
        let (q, u) = self.polarisation(&model, &distances, observed, &intensities)?;
        let layers = intensities.into_iter().zip(q).zip(u);
        Ok((layers.map(|((i, q), u)| [i, q, u]).collect(), averages))
    }

    fn averages(
        &mut self,
        fractions: &Fractions,
        observed: &Observations,
    ) -> Result<LayerAverages, Error> {
        let mut files =
            self.writer
                .layers("fractions/f", "fraction of the dust in the layer", "")?;
        let mut sums = AverageSums::new(self.config.layer_count());
        for slab in slabs(observed.i.len()) {
            let f = fractions.at(self.nside, slab.clone(), self.level)?;
            sums.add(&f, &observed.t[slab.clone()], &observed.beta[slab]);
            append(&mut files, &f)?;
            self.progress.advance(1);
        }
        finish(files)?;
        let averages = sums.averages(&observed.t, &observed.beta);
        self.manifest.layer_averages = Some(LayerAveragesRecord {
            t: averages.t.clone(),
            beta: averages.beta.clone(),
        });
        Ok(averages)
    }

    fn intensities(
        &mut self,
        fractions: &Fractions,
        observed: &Observations,
        averages: &LayerAverages,
    ) -> Result<Vec<Stored>, Error> {
        let npix = observed.i.len();
        let mut files =
            self.writer
                .layers("intensity/I", "intensity of the layer at 353 GHz", "MJy/sr")?;
        let mut kept = self.begin(npix)?;
        let mut negative = 0;
        for slab in slabs(npix) {
            let f = fractions.at(self.nside, slab.clone(), self.level)?;
            let (i, tau) = (&observed.i[slab.clone()], &observed.tau[slab]);
            let (layers, cut) = intensity::intensity(&f, i, tau, averages);
            negative += cut;
            append(&mut files, &layers)?;
            keep(&mut kept, &layers)?;
            self.progress.advance(1);
        }
        finish(files)?;
        self.manifest.counts.negative_intensity = negative;
        Ok(kept.into_iter().map(Pieces::finish).collect())
    }

    /// Fits the pitch angle and writes its scan.
    fn pitch(
        &self,
        distances: &[f64],
        observed: &Observations,
        intensities: &[Stored],
    ) -> Result<f64, Error> {
        let config = &self.config.field;
        self.progress.stage("pitch angle", 1);
        let nside = Nside::new(u64::from(config.fit_nside).min(self.nside.get()))?;
        let coarse = |map: &[f64]| regrid::scalar(map, self.nside, nside, self.level);
        let layers = intensities
            .iter()
            .map(|map| coarse(&map.whole()?))
            .collect::<Result<Vec<_>, Error>>()?;
        let fit = pitch::fit(
            &pitch::Scan {
                config,
                edges_kpc: distances,
                nside,
                level: self.level,
            },
            &layers,
            (&coarse(&observed.q)?, &coarse(&observed.u)?),
        )?;
        let mut csv = String::from("q_deg,G\n");
        for (q, g) in &fit.scan {
            let _ = writeln!(csv, "{q},{g:e}");
        }
        self.writer
            .out
            .file("pitch.csv", "pitch-angle objective, MJy/sr", csv.as_bytes())?;
        Ok(fit.pitch_rad)
    }

    /// Q and U of every layer: predicted by the field, then made to add up to the observations.
    fn polarisation(
        &mut self,
        model: &dust3d_kernels::field::Model,
        distances: &[f64],
        observed: &Observations,
        intensities: &[Stored],
    ) -> Result<(Vec<Stored>, Vec<Stored>), Error> {
        let npix = observed.i.len();
        let writer = self.writer;
        let stokes = |stem: &str, quantity: &str| writer.layers(stem, quantity, "MJy/sr");
        let mut field_q = writer.layers("field/q", "Q/I of the field model", "")?;
        let mut field_u = writer.layers("field/u", "U/I of the field model", "")?;
        let mut predicted_q = stokes("predicted/Q", "Stokes Q predicted by the field")?;
        let mut predicted_u = stokes("predicted/U", "Stokes U predicted by the field")?;
        let mut final_q = stokes("renormalised/Q", "Stokes Q, adding up to the observed")?;
        let mut final_u = stokes("renormalised/U", "Stokes U, adding up to the observed")?;
        let (mut kept_q, mut kept_u) = (self.begin(npix)?, self.begin(npix)?);
        let mut counts = Counts::default();
        let keep_north = self.store.keeps_in_memory(npix);
        let mut ratios = field::Ratios::new(model, distances, self.nside, self.level, keep_north);
        for slab in slabs(npix) {
            let (q, u) = ratios.next(slab.len())?;
            append(&mut field_q, &q)?;
            append(&mut field_u, &u)?;
            let intensity = intensities
                .iter()
                .map(|map| map.view(slab.clone()))
                .collect::<Result<Vec<_>, Error>>()?;
            let intensity: Vec<&[f64]> = intensity.iter().map(|map| &**map).collect();
            let mut q = polarisation::predicted(q, &intensity);
            let mut u = polarisation::predicted(u, &intensity);
            append(&mut predicted_q, &q)?;
            append(&mut predicted_u, &u)?;
            counts += polarisation::renormalise(
                &mut q,
                &mut u,
                &intensity,
                (&observed.q[slab.clone()], &observed.u[slab]),
                self.config.polarisation.p_max,
            )?;
            append(&mut final_q, &q)?;
            append(&mut final_u, &u)?;
            keep(&mut kept_q, &q)?;
            keep(&mut kept_u, &u)?;
            self.progress.advance(1);
        }
        for files in [field_q, field_u, predicted_q, predicted_u, final_q, final_u] {
            finish(files)?;
        }
        self.manifest.counts.capped_pixels = counts.capped;
        self.manifest.counts.infeasible_pixels = counts.infeasible;
        let done = |kept: Vec<Pieces>| kept.into_iter().map(Pieces::finish).collect();
        Ok((done(kept_q), done(kept_u)))
    }

    /// One map per layer that comes piece by piece.
    fn begin(&self, npix: usize) -> Result<Vec<Pieces>, Error> {
        (0..self.config.layer_count())
            .map(|_| self.store.begin(npix))
            .collect()
    }
}

/// The next values of every layer's file, files side by side.
fn append(files: &mut [MapWriter<'_>], layers: &[Vec<f64>]) -> Result<(), Error> {
    files
        .par_iter_mut()
        .zip(layers)
        .try_for_each(|(file, layer)| file.append(layer))
}

fn keep(kept: &mut [Pieces], layers: &[Vec<f64>]) -> Result<(), Error> {
    kept.par_iter_mut()
        .zip(layers)
        .try_for_each(|(map, layer)| map.append(layer))
}

fn finish(files: Vec<MapWriter<'_>>) -> Result<(), Error> {
    files.into_iter().try_for_each(MapWriter::finish)
}
