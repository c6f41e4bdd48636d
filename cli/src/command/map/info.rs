//! `dust3d map info`.

use super::super::print;
use super::statistics::Statistics;
use crate::error::Result;
use crate::io::MapSource;
use std::fmt::Write;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  dust3d map info demo/templates/*.f64")]
pub(in super::super) struct Args {
    /// Maps
    #[arg(required = true, value_name = "MAP")]
    maps: Vec<String>,
}

pub(super) fn execute(args: &Args) -> Result<()> {
    let mut text = String::new();
    for spec in &args.maps {
        let map = MapSource::parse(spec)?.read()?;
        let statistics = Statistics::of(&map.values);
        let side = (std::f64::consts::PI / 3.0).sqrt() / f64::from(map.nside);
        let _ = write!(
            text,
            "{spec}\n  type     {}, RING order\n  nside    {} ({} pixels of {:.4}°)\n  missing  {}\n  min      {:e}\n  max      {:e}\n  mean     {:e}\n  std      {:e}\n  blake3   {}\n",
            map.dtype.name(),
            map.nside,
            map.values.len(),
            side.to_degrees(),
            statistics.missing,
            statistics.min,
            statistics.max,
            statistics.mean,
            statistics.std,
            map.blake3,
        );
        if let Some(unit) = &map.unit {
            let _ = writeln!(text, "  unit     {unit}");
        }
        for note in &map.notes {
            let _ = writeln!(text, "  note     {note}");
        }
    }
    print(&text)
}
