//! The observations on the working grid, and the cube at the layers' edges.

use super::Preparation;
use crate::Error;
use crate::config::Dtype;
use crate::io::Inputs;
use crate::stages::builtin_sky;
use crate::stages::observations::{self, Observations};
use dust3d_kernels::healpix::Nside;
use rayon::prelude::*;

/// The reddening cube at the layers' edges.
pub(super) struct Cube {
    pub(super) nside: Nside,
    pub(super) edges: Vec<Vec<f64>>,
}

impl Preparation<'_> {
    /// Reads or makes the observations and writes them.
    pub(super) fn observations(
        &mut self,
        inputs: Option<Inputs>,
    ) -> Result<(Observations, Cube), Error> {
        self.progress.stage("observations", 1);
        let writer = self.writer;
        let mut show = |maps: &[(&str, &[f64])]| {
            maps.par_iter().try_for_each(|(name, map)| {
                let (quantity, unit) = description(name);
                let stem = format!("observations/{name}");
                writer.map(&stem, quantity, unit, map, Dtype::F64)
            })
        };
        let mut inputs = match inputs {
            Some(inputs) => inputs,
            None => {
                let seed = self.config.sky_seed.unwrap_or(self.config.seed);
                let sky = builtin_sky::observe(&mut self.plan, seed, self.level)?;
                builtin_sky::others(&sky, self.level, &mut show)?;
                sky
            }
        };
        self.manifest.inputs = inputs.records();
        let observed =
            observations::observe(&mut inputs, self.config, self.nside, self.level, &mut show)?;
        let cube = self.cube(inputs)?;
        Ok((observed, cube))
    }

    fn cube(&self, mut inputs: Inputs) -> Result<Cube, Error> {
        if self.writer.keeps_all() {
            for (_, map) in &inputs.cube {
                self.writer.out.map(
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
        let nside = inputs.cube.first().map_or(1, |(_, map)| map.nside);
        Ok(Cube {
            nside: Nside::new(nside.into())?,
            edges,
        })
    }
}

/// What an observed map is, and its unit.
fn description(name: &str) -> (&'static str, &'static str) {
    match name {
        "I_353" => ("intensity at 353 GHz", "MJy/sr"),
        "Q_353" => ("Stokes Q at 353 GHz", "MJy/sr"),
        "U_353" => ("Stokes U at 353 GHz", "MJy/sr"),
        "tau" => ("optical depth at 353 GHz", ""),
        "T" => ("dust temperature", "K"),
        "beta" => ("dust spectral index", ""),
        _ => ("observation, for validation", "MJy/sr"),
    }
}
