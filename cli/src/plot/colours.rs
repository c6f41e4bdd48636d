//! Colour maps.

/// A colour map: a path through sRGB, linear between equidistant stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Colours {
    /// Blue, cream, red, after the maps of the Planck collaboration.
    #[default]
    Planck,
    /// Perceptually uniform, dark blue to yellow (matplotlib, CC0).
    Viridis,
    /// Perceptually uniform, black to pale yellow (matplotlib, CC0).
    Inferno,
    /// Blue, white, red; for signed quantities.
    Diverging,
}

/// sRGB, 0 to 255.
pub(super) type Rgb = [f64; 3];

/// Colour of missing pixels.
pub(super) const MISSING_COLOUR: Rgb = [178.0, 178.0, 178.0];

const PLANCK: [Rgb; 7] = [
    [0.0, 0.0, 214.0],
    [0.0, 102.0, 255.0],
    [0.0, 204.0, 255.0],
    [255.0, 237.0, 217.0],
    [255.0, 178.0, 0.0],
    [255.0, 72.0, 0.0],
    [110.0, 0.0, 0.0],
];

const DIVERGING: [Rgb; 9] = [
    [13.0, 38.0, 105.0],
    [33.0, 84.0, 168.0],
    [72.0, 145.0, 205.0],
    [158.0, 202.0, 228.0],
    [247.0, 245.0, 242.0],
    [248.0, 190.0, 150.0],
    [226.0, 116.0, 79.0],
    [178.0, 41.0, 43.0],
    [103.0, 0.0, 31.0],
];

const VIRIDIS: [Rgb; 17] = [
    [68.0, 1.0, 84.0],
    [72.0, 24.0, 106.0],
    [71.0, 45.0, 123.0],
    [66.0, 64.0, 134.0],
    [59.0, 82.0, 139.0],
    [51.0, 99.0, 141.0],
    [44.0, 114.0, 142.0],
    [38.0, 130.0, 142.0],
    [33.0, 145.0, 140.0],
    [31.0, 160.0, 136.0],
    [40.0, 174.0, 128.0],
    [63.0, 188.0, 115.0],
    [94.0, 201.0, 98.0],
    [132.0, 212.0, 75.0],
    [173.0, 220.0, 48.0],
    [216.0, 226.0, 25.0],
    [253.0, 231.0, 37.0],
];

const INFERNO: [Rgb; 17] = [
    [0.0, 0.0, 4.0],
    [11.0, 7.0, 36.0],
    [33.0, 12.0, 74.0],
    [61.0, 9.0, 101.0],
    [87.0, 16.0, 110.0],
    [113.0, 25.0, 110.0],
    [138.0, 34.0, 106.0],
    [163.0, 44.0, 97.0],
    [188.0, 55.0, 84.0],
    [210.0, 70.0, 68.0],
    [228.0, 90.0, 49.0],
    [241.0, 115.0, 29.0],
    [249.0, 142.0, 9.0],
    [252.0, 172.0, 17.0],
    [249.0, 203.0, 53.0],
    [242.0, 234.0, 105.0],
    [252.0, 255.0, 164.0],
];

impl Colours {
    /// The colour at `t` in 0 … 1, sRGB from 0 to 255; outside, that of the nearer end.
    pub(super) fn at(self, t: f64) -> Rgb {
        let stops: &[Rgb] = match self {
            Self::Planck => &PLANCK,
            Self::Viridis => &VIRIDIS,
            Self::Inferno => &INFERNO,
            Self::Diverging => &DIVERGING,
        };
        let last = stops.len() - 1;
        let place = t.clamp(0.0, 1.0) * last as f64;
        let below = (place as usize).min(last - 1);
        let share = place - below as f64;
        std::array::from_fn(|channel| {
            stops[below][channel] * (1.0 - share) + stops[below + 1][channel] * share
        })
    }
}
