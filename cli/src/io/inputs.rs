//! The observations as they come from the user's files, and everything that must hold of them before work starts.
//!
//! Maps stay at their own Nside and in their own values; regridding and the colour correction belong to a stage.

use super::manifest::InputRecord;
use super::map_file::{MapFile, MapSource};
use super::raw::encode_raw;
use super::role::Role;
use crate::config::{Config, Dtype, Monotone};
use crate::error::{Error, Result};
use crate::kernels::healpix::missing::is_missing;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One observed map at its own Nside.
#[derive(Debug, Clone, PartialEq)]
pub struct InputMap {
    /// `I_353`, `tau`, … or `ebv_<modulus>`.
    pub name: String,
    /// The file; `None` if the program made the map.
    pub path: Option<PathBuf>,
    /// Unit of the values.
    pub unit: String,
    /// Resolution, a power of two.
    pub nside: u32,
    /// 12 Nside² values in RING order, finite or [`MISSING`](crate::kernels::healpix::missing::MISSING).
    pub values: Vec<f64>,
    /// BLAKE3 hash of the file, or of the values as `.f64` if there is none.
    pub blake3: String,
    /// What the file leaves open and had to be assumed, a sentence each.
    pub notes: Vec<String>,
}

/// The observations.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Inputs {
    /// By the name of their key: `I_353`, `Q_353`, `U_353`, `tau`, `T`, `beta`, `I_545`, …
    pub maps: BTreeMap<String, InputMap>,
    /// Cumulative reddening with its distance modulus, near to far, all of one Nside.
    pub cube: Vec<(f64, InputMap)>,
}

impl InputMap {
    /// A map that the program made.
    #[must_use]
    pub fn generated(
        name: impl Into<String>,
        unit: impl Into<String>,
        nside: u32,
        values: Vec<f64>,
    ) -> Self {
        let blake3 = blake3::hash(&encode_raw(&values, Dtype::F64))
            .to_hex()
            .to_string();
        Self {
            name: name.into(),
            path: None,
            unit: unit.into(),
            nside,
            values,
            blake3,
            notes: Vec::new(),
        }
    }

    /// What the manifest says of it.
    #[must_use]
    pub fn record(&self) -> InputRecord {
        InputRecord {
            name: self.name.clone(),
            path: self.path.as_ref().map(|path| path.display().to_string()),
            nside: self.nside,
            unit: self.unit.clone(),
            blake3: self.blake3.clone(),
        }
    }

    /// What a message calls it: name and file.
    fn title(&self) -> String {
        match &self.path {
            Some(path) => format!("{} (`{}`)", self.name, path.display()),
            None => self.name.clone(),
        }
    }

    fn refuse_missing(&self) -> Result<()> {
        match self.values.iter().position(|&value| is_missing(value)) {
            None => Ok(()),
            Some(pixel) => Err(Error::input(format!(
                "{}: pixel {pixel} is missing (NaN or UNSEEN); every pixel of {} is needed, fill it first",
                self.title(),
                self.name
            ))),
        }
    }

    /// Every value that is there satisfies `holds`.
    fn require(&self, holds: impl Fn(f64) -> bool, wanted: &str) -> Result<()> {
        match self
            .values
            .iter()
            .position(|&value| !is_missing(value) && !holds(value))
        {
            None => Ok(()),
            Some(pixel) => Err(Error::input(format!(
                "{}: pixel {pixel} is {}; {} must be {wanted}",
                self.title(),
                self.values[pixel],
                self.name
            ))),
        }
    }
}

impl Inputs {
    /// Reads and checks every map that `config` names.
    ///
    /// Missing pixels of T, β, the cube and the maps for validation are allowed; with `cube.monotone = "clip"` a
    /// decreasing cube is replaced by its running maximum.
    ///
    /// # Errors
    /// Keys that are missing, all of them; files that do not exist, all of them; the first map, and in it the first
    /// pixel, that may not be as it is.
    pub fn read(config: &Config) -> Result<Self> {
        let sources = Sources::of(config)?;
        let mut inputs = Self::default();
        for (name, source) in &sources.maps {
            let map = read_one(name, unit_of(name), source)?;
            check_map(&map, sources.fitted)?;
            inputs.maps.insert((*name).to_owned(), map);
        }
        for (modulus, source) in &sources.cube {
            let map = read_one(&format!("ebv_{}", modulus_label(*modulus)), "mag", source)?;
            if let Some((_, first)) = inputs.cube.first()
                && first.nside != map.nside
            {
                return Err(Error::input(format!(
                    "{} has Nside {}, but {} has {}; all maps of the cube must have one Nside",
                    map.title(),
                    map.nside,
                    first.title(),
                    first.nside
                )));
            }
            inputs.cube.push((*modulus, map));
        }
        check_cube(&mut inputs.cube, config.cube.monotone)?;
        Ok(inputs)
    }

    /// The map of that name, if it is there.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&InputMap> {
        self.maps.get(name)
    }

    /// What had to be assumed about the files, a sentence each; of the cube only about its first map.
    pub fn notes(&self) -> impl Iterator<Item = &str> {
        let cube = self.cube.iter().map(|(_, map)| map).take(1);
        let maps = self.maps.values().chain(cube);
        maps.flat_map(|map| map.notes.iter().map(String::as_str))
    }

    /// What the manifest says of all of them.
    #[must_use]
    pub fn records(&self) -> Vec<InputRecord> {
        self.maps
            .values()
            .chain(self.cube.iter().map(|(_, map)| map))
            .map(InputMap::record)
            .collect()
    }
}

/// The distance moduli of the cube: 4, 4.5 … 19.
pub fn moduli() -> impl Iterator<Item = f64> {
    (8..=38).map(|half| f64::from(half) / 2.0)
}

/// A distance modulus as it stands in the names of files: `04.0`, `10.5`.
#[must_use]
pub fn modulus_label(modulus: f64) -> String {
    format!("{modulus:04.1}")
}

/// The files to be read, known to exist.
struct Sources {
    maps: Vec<(&'static str, MapSource)>,
    cube: Vec<(f64, MapSource)>,
    /// Whether τ, T, β are to be fitted rather than given.
    fitted: bool,
}

impl Sources {
    fn of(config: &Config) -> Result<Self> {
        let given: Vec<_> = config.inputs.maps().collect();
        let lacking = |names: &[&'static str]| -> Vec<&'static str> {
            names
                .iter()
                .copied()
                .filter(|name| !given.iter().any(|(key, _)| key == name))
                .collect()
        };
        let mut missing = lacking(&["I_353", "Q_353", "U_353"]);
        let parameters = lacking(&["tau", "T", "beta"]);
        let bands = lacking(&["I_545", "I_857", "I_2998"]);
        let mut remedy = String::new();
        // Some of tau, T, beta without the others would be used by nothing: an oversight, whatever else is given.
        if !parameters.is_empty() && (parameters.len() < 3 || bands.len() < 3 && !bands.is_empty())
        {
            let lacks = if parameters.len() < 3 {
                &parameters
            } else {
                &bands
            };
            missing.extend(lacks);
            if parameters.len() < 3 && bands.is_empty() {
                remedy =
                    "; or leave out the others of tau, T, beta to have all three fitted".to_owned();
            }
        } else if parameters.len() == 3 && bands.len() == 3 {
            missing.extend(&parameters);
            remedy = "; in place of tau, T, beta you may give I_545, I_857, I_2998, from which they are fitted".to_owned();
        }
        if config.inputs.cube.is_none() {
            missing.push("cube");
        }
        if !missing.is_empty() {
            return Err(Error::usage(format!(
                "[inputs] lacks {}{remedy}; give none at all for the built-in sky",
                missing.join(", ")
            )));
        }
        let mut maps = Vec::new();
        for (name, path) in given {
            let source = MapSource::parse(path)
                .map_err(|error| error.within(format_args!("inputs.{name}")))?;
            maps.push((name, source));
        }
        let pattern = config.inputs.cube.as_deref().unwrap_or_default();
        if !pattern.contains("{modulus}") {
            return Err(Error::usage(format!(
                "inputs.cube: `{pattern}` does not contain {{modulus}}, which stands for 04.0, 04.5 … 19.0"
            )));
        }
        let mut cube = Vec::new();
        for modulus in moduli() {
            let path = pattern.replace("{modulus}", &modulus_label(modulus));
            let source = MapSource::parse(&path).map_err(|error| error.within("inputs.cube"))?;
            cube.push((modulus, source));
        }
        let sources = Self {
            maps,
            cube,
            fitted: !parameters.is_empty(),
        };
        sources.check_exist()?;
        Ok(sources)
    }

    /// Names every file that is not there, so that one attempt shows them all.
    fn check_exist(&self) -> Result<()> {
        let absent = |source: &MapSource| !source.path().exists();
        let mut files: Vec<(&Path, Vec<&str>)> = Vec::new();
        for (name, source) in self.maps.iter().filter(|(_, source)| absent(source)) {
            match files.iter_mut().find(|(path, _)| *path == source.path()) {
                Some((_, names)) => names.push(name),
                None => files.push((source.path(), vec![name])),
            }
        }
        let mut lines: Vec<String> = files
            .iter()
            .map(|(path, names)| format!("{} (`{}`)", names.join(", "), path.display()))
            .collect();
        let moduli: Vec<String> = self
            .cube
            .iter()
            .filter(|(_, source)| absent(source))
            .map(|(modulus, _)| modulus_label(*modulus))
            .collect();
        if let Some((_, first)) = self.cube.iter().find(|(_, source)| absent(source)) {
            let which = if moduli.len() == self.cube.len() {
                "every distance modulus".to_owned()
            } else {
                format!("distance modulus {}", moduli.join(", "))
            };
            lines.push(format!("cube at {which} (`{}`)", first.path().display()));
        }
        if lines.is_empty() {
            return Ok(());
        }
        Err(Error::input(format!(
            "input files do not exist: {}; check the paths",
            lines.join(", ")
        )))
    }
}

fn read_one(name: &str, unit: &str, source: &MapSource) -> Result<InputMap> {
    let MapFile {
        nside,
        values,
        blake3,
        notes,
        ..
    } = match Role::of_key(name) {
        Some(role) => source.read_as(role),
        None => source.read(),
    }
    .map_err(|error| error.within(name))?;
    Ok(InputMap {
        name: name.to_owned(),
        path: Some(source.path().to_owned()),
        unit: unit.to_owned(),
        nside,
        values,
        blake3,
        notes: notes
            .into_iter()
            .map(|note| format!("{name}: {note}"))
            .collect(),
    })
}

fn unit_of(name: &str) -> &'static str {
    match name {
        "tau" | "beta" => "1",
        "T" => "K",
        _ => "MJy/sr",
    }
}

fn check_map(map: &InputMap, fitted: bool) -> Result<()> {
    match map.name.as_str() {
        "I_353" | "tau" => {
            map.refuse_missing()?;
            map.require(|value| value >= 0.0, "0 or more")
        }
        "Q_353" | "U_353" => map.refuse_missing(),
        "T" => map.require(|value| value > 0.0, "above 0 K"),
        // Where these are fitted, a missing pixel becomes one of tau, which is needed everywhere.
        "I_545" | "I_857" | "I_2998" if fitted => {
            map.refuse_missing()?;
            map.require(|value| value >= 0.0, "0 or more")
        }
        _ => Ok(()),
    }
}

/// What counts as rounding in sums of a few bins: relative (f32), and absolute in mag.
const ROUNDING: (f64, f64) = (1e-6, 1e-9);

/// The cumulative reddening may not decrease with distance, nor begin below zero.
fn check_cube(cube: &mut [(f64, InputMap)], monotone: Monotone) -> Result<()> {
    let npix = cube.first().map_or(0, |(_, map)| map.values.len());
    let nearest = match monotone {
        Monotone::Error => 0.0,
        Monotone::Clip => f64::NEG_INFINITY,
    };
    let mut highest = vec![nearest; npix];
    for (modulus, map) in cube {
        for (pixel, (value, highest)) in map.values.iter_mut().zip(&mut highest).enumerate() {
            if is_missing(*value) {
                continue;
            }
            match monotone {
                Monotone::Clip => *value = value.max(*highest),
                Monotone::Error if *value < *highest * (1.0 - ROUNDING.0) - ROUNDING.1 => {
                    let path = map
                        .path
                        .as_deref()
                        .map(|path| format!(" (`{}`)", path.display()));
                    return Err(Error::input(format!(
                        "{}{}: pixel {pixel} is {value} at distance modulus {modulus} but {highest} nearer; cumulative \
                         reddening cannot decrease (cube.monotone = \"clip\" takes the running maximum)",
                        map.name,
                        path.unwrap_or_default(),
                    )));
                }
                Monotone::Error => {}
            }
            *highest = highest.max(*value);
        }
    }
    Ok(())
}
