//! `dust3d map plot`.

use crate::error::{Error, Result};
use crate::io::map_file::MapSource;
use crate::io::output::write_atomically;
use crate::plot::{Colours, MapPlot, Scale, View};
use clap::ValueEnum;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d map plot Q_353.f64 --scale symlog --unit MJy/sr --out Q_353.png\n  dust3d map plot I_353.f64 --gnomonic 0,50 --side 20 --out detail.png"
)]
pub(in super::super) struct Args {
    /// The map
    #[arg(value_name = "MAP")]
    map: String,
    /// The picture (.png)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// A detail around this Galactic longitude and latitude, degrees
    #[arg(long, value_name = "LON,LAT", allow_hyphen_values = true, value_parser = lon_lat)]
    gnomonic: Option<(f64, f64)>,
    /// Side of the detail, degrees
    #[arg(long, value_name = "DEG", default_value_t = 20.0)]
    side: f64,
    /// How values are spread over the colours
    #[arg(long, value_enum, default_value_t = ScaleName::Linear)]
    scale: ScaleName,
    /// Value of the first colour [default: of the lowest percent; symlog: minus the last, or 0]
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    min: Option<f64>,
    /// Value of the last colour [default: of the highest percent]
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    max: Option<f64>,
    /// Where symlog becomes logarithmic [default: the median of the magnitudes]
    #[arg(long, value_name = "X")]
    threshold: Option<f64>,
    /// Colours
    #[arg(long, value_enum, default_value_t = ColourName::Planck)]
    colours: ColourName,
    /// Words above the picture [default: the name of the file]
    #[arg(long)]
    title: Option<String>,
    /// Unit below the colour bar [default: that in the manifest of the map's run]
    #[arg(long)]
    unit: Option<String>,
    /// Width of the picture in pixels
    #[arg(long, value_name = "N", default_value_t = 1200)]
    width: u32,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ScaleName {
    Linear,
    Symlog,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ColourName {
    Planck,
    Viridis,
    Inferno,
    Diverging,
}

pub(super) fn execute(args: &Args) -> Result<()> {
    if args
        .out
        .extension()
        .is_none_or(|extension| extension != "png")
    {
        return Err(Error::usage(format!(
            "--out {}: the name of a picture must end in .png",
            args.out.display()
        )));
    }
    let source = MapSource::parse(&args.map)?;
    let map = source.read()?;
    let view = match args.gnomonic {
        Some((lon_deg, lat_deg)) => View::Gnomonic {
            lon_deg,
            lat_deg,
            size_deg: args.side,
        },
        None => View::Mollweide,
    };
    let shown = view.visible(map.nside, &map.values)?;
    let scale = match args.scale {
        ScaleName::Linear => Scale::linear_of(&shown),
        ScaleName::Symlog => match (Scale::symlog_of(&shown), args.threshold) {
            (Scale::SymLog { min, max, .. }, Some(threshold)) => Scale::SymLog {
                min,
                max,
                threshold,
            },
            (scale, _) => scale,
        },
    };
    let known = source.record();
    let title = args.title.clone().unwrap_or_else(|| {
        let name = source
            .path()
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let quantity = known
            .as_ref()
            .map(|record| format!(": {}", record.quantity))
            .unwrap_or_default();
        let place = args
            .gnomonic
            .map(|(lon, lat)| format!(", around l = {lon}°, b = {lat}°"))
            .unwrap_or_default();
        format!("{name}{quantity}{place}")
    });
    let unit = args
        .unit
        .clone()
        .or_else(|| known.and_then(|record| record.unit))
        .or(map.unit);
    let plot = MapPlot {
        nside: map.nside,
        values: &map.values,
        title,
        unit: unit.filter(|unit| unit != "1").unwrap_or_default(),
        scale: scale.with_ends(args.min, args.max),
        colours: match args.colours {
            ColourName::Planck => Colours::Planck,
            ColourName::Viridis => Colours::Viridis,
            ColourName::Inferno => Colours::Inferno,
            ColourName::Diverging => Colours::Diverging,
        },
        view,
    };
    write_atomically(&args.out, &plot.png(args.width)?)
}

fn lon_lat(text: &str) -> std::result::Result<(f64, f64), String> {
    let parse = |part: &str| {
        part.trim()
            .parse::<f64>()
            .ok()
            .filter(|angle| angle.is_finite())
    };
    text.split_once(',')
        .and_then(|(lon, lat)| Some((parse(lon)?, parse(lat)?)))
        .ok_or_else(|| "two angles in degrees are needed, as in 0,50".to_owned())
}
