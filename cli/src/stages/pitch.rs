//! The pitch angle of the field (\[MKD18\], section 4.2).
//!
//! G(q) = Σ_p |Σ_i Q̃_i(q) − Q| + |Σ_i Ũ_i(q) − U| over the pixels at high latitude, on a coarse grid. A scan in steps of one
//! degree finds the valley, golden section the minimum in it. The scan shares the geometry of a pixel among all angles.

use super::field;
use crate::Error;
use crate::config::FieldConfig;
use dust3d_kernels::fit::l1::{scan_add, scan_scratch_len};
use dust3d_kernels::fit::search::{bracket, golden_section};
use dust3d_kernels::healpix::{Nside, ring};
use dust3d_kernels::simd::Level;
use rayon::prelude::*;

/// Pixels whose sums are made together; fixed, so that G does not depend on the number of threads.
const PIXELS: usize = 512;
/// The minimum is refined to this, degrees.
const TOLERANCE_DEG: f64 = 0.002;

/// Where and how to look for the pitch angle.
pub struct Scan<'a> {
    /// Range, least latitude and the parameters of the model.
    pub config: &'a FieldConfig,
    /// Far edges of the layers, kpc.
    pub edges_kpc: &'a [f64],
    /// Grid on which G is evaluated, not finer than the maps'.
    pub nside: Nside,
    /// Instructions to use.
    pub level: Level,
}

/// The pitch angle found.
#[derive(Debug, Clone, PartialEq)]
pub struct Pitch {
    /// The minimum of G, radians.
    pub pitch_rad: f64,
    /// The scan: (q in degrees, G in MJy/sr).
    pub scan: Vec<(f64, f64)>,
}

/// Finds the pitch angle from the intensity layers and the observed Q and U on the grid of the scan.
///
/// # Errors
/// If a map has another length, or the model is out of its domain.
pub fn fit(
    scan: &Scan<'_>,
    intensities: &[Vec<f64>],
    (q, u): (&[f64], &[f64]),
) -> Result<Pitch, Error> {
    let objective = Objective::new(scan, intensities, (q, u))?;
    let [low, high] = scan.config.pitch_range_deg;
    let steps = (high - low).round().max(1.0) as usize;
    let degrees: Vec<f64> = (0..=steps)
        .map(|k| low + (high - low) * k as f64 / steps as f64)
        .collect();
    let values = objective.at(&degrees)?;
    let [low, high] = bracket(&degrees, &values).ok_or_else(|| {
        Error::input("the pitch angle cannot be fitted: Q and U have no pixel at high latitude; give field.pitch_deg")
    })?;
    let mut failure = None;
    let minimum = golden_section(
        |deg| match objective.at(&[deg]) {
            Ok(values) => values.first().copied().unwrap_or(f64::NAN),
            Err(error) => {
                failure = Some(error);
                f64::NAN
            }
        },
        low,
        high,
        TOLERANCE_DEG,
    );
    match failure {
        Some(error) => Err(error),
        None => Ok(Pitch {
            pitch_rad: minimum.x.to_radians(),
            scan: degrees.into_iter().zip(values).collect(),
        }),
    }
}

/// G on the pixels at high latitude.
struct Objective<'a> {
    scan: &'a Scan<'a>,
    /// Edges of the layers from the Sun on.
    edges: Vec<f64>,
    directions: Vec<[f64; 3]>,
    intensities: Vec<Vec<f64>>,
    q: Vec<f64>,
    u: Vec<f64>,
}

impl<'a> Objective<'a> {
    fn new(
        scan: &'a Scan<'a>,
        intensities: &[Vec<f64>],
        (q, u): (&[f64], &[f64]),
    ) -> Result<Self, Error> {
        let mut pixels = Vec::new();
        let mut directions = Vec::new();
        let least = scan.config.min_latitude_deg.to_radians();
        for p in 0..scan.nside.npix() {
            let (theta, _) = ring::pix2ang(scan.nside, p)?;
            if (std::f64::consts::FRAC_PI_2 - theta).abs() >= least {
                pixels.push(p as usize);
                directions.push(ring::pix2vec(scan.nside, p)?);
            }
        }
        let pick = |map: &[f64]| -> Result<Vec<f64>, Error> {
            dust3d_kernels::Error::check_len("map", scan.nside.npix() as usize, map.len())?;
            Ok(pixels.iter().map(|&p| map[p]).collect())
        };
        Ok(Self {
            edges: std::iter::once(0.0)
                .chain(scan.edges_kpc.iter().copied())
                .collect(),
            intensities: intensities
                .iter()
                .map(|i| pick(i))
                .collect::<Result<_, _>>()?,
            q: pick(q)?,
            u: pick(u)?,
            directions,
            scan,
        })
    }

    /// G at some pitch angles, MJy/sr.
    fn at(&self, degrees: &[f64]) -> Result<Vec<f64>, Error> {
        let pitches: Vec<f64> = degrees.iter().map(|d| d.to_radians()).collect();
        let model = field::model(self.scan.config, pitches[0]);
        let n = self.directions.len();
        let partial: Vec<Vec<f64>> = (0..n.div_ceil(PIXELS))
            .into_par_iter()
            .map(|k| {
                let range = k * PIXELS..((k + 1) * PIXELS).min(n);
                let intensities: Vec<&[f64]> =
                    self.intensities.iter().map(|i| &i[range.clone()]).collect();
                let mut sums = vec![0.0; pitches.len()];
                let mut scratch = vec![0.0; scan_scratch_len(pitches.len())];
                scan_add(
                    self.scan.level,
                    &model,
                    &self.edges,
                    &self.directions[range.clone()],
                    &intensities,
                    &self.q[range.clone()],
                    &self.u[range],
                    &pitches,
                    &mut sums,
                    &mut scratch,
                )?;
                Ok(sums)
            })
            .collect::<Result<_, Error>>()?;
        Ok(partial
            .into_iter()
            .fold(vec![0.0; degrees.len()], |mut total, part| {
                for (t, p) in total.iter_mut().zip(part) {
                    *t += p;
                }
                total
            }))
    }
}
