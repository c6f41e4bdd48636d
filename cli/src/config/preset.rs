//! Configurations with a name.

/// A configuration with a name, as TOML with comments; what it leaves open has its default.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// The built-in sky at low resolution.
    Demo,
    /// The choices of the paper.
    Paper,
    /// The public maps of Planck's GNILC, which must be there.
    PlanckGnilc,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 3] = [Self::Demo, Self::Paper, Self::PlanckGnilc];

    /// `demo`, `paper` or `planck-gnilc`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Demo => "demo",
            Self::Paper => "paper",
            Self::PlanckGnilc => "planck-gnilc",
        }
    }

    /// The preset of that name.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// Its text; paths are relative to the current directory.
    #[must_use]
    pub const fn toml(self) -> &'static str {
        match self {
            Self::Demo => include_str!("presets/demo.toml"),
            Self::Paper => include_str!("presets/paper.toml"),
            Self::PlanckGnilc => include_str!("presets/planck-gnilc.toml"),
        }
    }
}
