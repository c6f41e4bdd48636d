//! A configuration in the making: a file, overrides and flags, gathered as a tree before it is typed and checked.

use super::keys::Config;
use crate::error::{Error, Result};
use serde_json::{Map, Value};
use std::path::Path;

/// A configuration in the making; later additions win.
#[derive(Debug, Clone, Default)]
pub struct Draft {
    tree: Map<String, Value>,
}

impl Draft {
    /// Nothing set: all defaults.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a configuration file; the paths in its `[inputs]` are taken relative to it.
    ///
    /// # Errors
    /// A file that cannot be read, is not TOML, or holds an unknown key.
    pub fn file(self, path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .map_err(|cause| Error::io("read the configuration", path, &cause).as_usage())?;
        let base = path.parent().unwrap_or_else(|| Path::new(""));
        self.toml(&text, base)
            .map_err(|error| error.within(path.display()))
    }

    /// Adds the text of a configuration; relative paths in its `[inputs]` are taken relative to `base`.
    ///
    /// # Errors
    /// Text that is not TOML, or an unknown key.
    pub fn toml(mut self, text: &str, base: &Path) -> Result<Self> {
        let mut tree: Map<String, Value> = toml::from_str(text).map_err(|cause| {
            let line = cause
                .span()
                .and_then(|span| text.get(..span.start))
                .map_or(1, |before| before.matches('\n').count() + 1);
            Error::usage(format!(
                "line {line} is not valid TOML: {}",
                cause.message().replace('\n', ", ")
            ))
        })?;
        check_keys(&tree, &known(), "")?;
        if let Some(Value::Object(inputs)) = tree.get_mut("inputs") {
            for value in inputs.values_mut() {
                if let Value::String(path) = value {
                    *path = base.join(&*path).to_string_lossy().into_owned();
                }
            }
        }
        merge(&mut self.tree, tree);
        Ok(self)
    }

    /// Adds one override `key=value`: a dotted key, and a value in TOML (quotes may be left out of a string).
    ///
    /// # Errors
    /// No `=`, or an unknown key.
    pub fn set(self, assignment: &str) -> Result<Self> {
        let Some((key, value)) = assignment.split_once('=') else {
            return Err(Error::usage(format!(
                "`--set {assignment}` has no `=`; write --set key=value, for example --set layers.fill_radius_deg=3"
            )));
        };
        let value = value.trim();
        let value = toml::from_str::<Map<String, Value>>(&format!("value = {value}"))
            .ok()
            .and_then(|mut table| table.remove("value"))
            .unwrap_or_else(|| Value::from(value));
        self.put(key.trim(), value)
            .map_err(|error| error.within(format!("--set {assignment}")))
    }

    /// Sets a dotted key to a value.
    ///
    /// # Errors
    /// An unknown key.
    pub fn put(mut self, key: &str, value: impl Into<Value>) -> Result<Self> {
        let mut addition = value.into();
        for part in key.rsplit('.') {
            addition = Value::Object(Map::from_iter([(part.to_owned(), addition)]));
        }
        if let Value::Object(tree) = addition {
            check_keys(&tree, &known(), "")?;
            merge(&mut self.tree, tree);
        }
        Ok(self)
    }

    /// The configuration: typed, checked, every value resolved.
    ///
    /// # Errors
    /// A value of the wrong type or out of its range, named by its key.
    pub fn finish(self) -> Result<Config> {
        serde_path_to_error::deserialize::<_, Config>(Value::Object(self.tree))
            .map_err(|error| {
                Error::usage(format!(
                    "configuration key `{}`: {}",
                    error.path(),
                    error.inner()
                ))
            })?
            .resolve()
    }
}

impl Config {
    /// The configuration in a TOML text; paths stay as they are written.
    ///
    /// # Errors
    /// Text that is not TOML, an unknown key, a value of the wrong type or out of its range.
    pub fn from_toml(text: &str) -> Result<Self> {
        Draft::new().toml(text, Path::new(""))?.finish()
    }
}

/// The tree of known keys; optional ones are there as null.
fn known() -> Map<String, Value> {
    match serde_json::to_value(Config::default()) {
        Ok(Value::Object(tree)) => tree,
        _ => Map::new(),
    }
}

fn merge(into: &mut Map<String, Value>, from: Map<String, Value>) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(Value::Object(old)), Value::Object(new)) => merge(old, new),
            (_, value) => {
                into.insert(key, value);
            }
        }
    }
}

/// Refuses unknown keys, sections that are not tables, and non-finite numbers (which arrive here as null).
fn check_keys(tree: &Map<String, Value>, known: &Map<String, Value>, section: &str) -> Result<()> {
    for (key, value) in tree {
        let path = format!("{section}{key}");
        match (value, known.get(key)) {
            (_, None) => return Err(unknown(key, known, section)),
            (Value::Object(tree), Some(Value::Object(known))) => {
                check_keys(tree, known, &format!("{path}."))?;
            }
            (_, Some(Value::Object(_))) => {
                return Err(Error::usage(format!(
                    "configuration key `{path}` is a section; write [{path}] and its keys below it"
                )));
            }
            (value, Some(_)) if holds_null(value) => {
                return Err(Error::usage(format!(
                    "configuration key `{path}` is not a finite number"
                )));
            }
            _ => {}
        }
    }
    Ok(())
}

fn holds_null(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(list) => list.iter().any(holds_null),
        _ => false,
    }
}

/// The error for an unknown key, naming the nearest known one, of the same section or of another.
fn unknown(key: &str, here: &Map<String, Value>, section: &str) -> Error {
    let local = here
        .keys()
        .map(|known| (distance(key, known), format!("{section}{known}")));
    let anywhere = paths(&known(), "").into_iter().map(|path| {
        let last = path.rsplit('.').next().unwrap_or_default();
        // The same name in another section is likelier than a far misspelling in this one.
        (distance(key, last) + 1, path)
    });
    let nearest = local
        .chain(anywhere)
        .min()
        .map_or_else(String::new, |(_, path)| path);
    Error::usage(format!(
        "unknown configuration key `{section}{key}`; the nearest known key is `{nearest}` (`dust3d config` prints all)"
    ))
}

fn paths(tree: &Map<String, Value>, section: &str) -> Vec<String> {
    tree.iter()
        .flat_map(|(key, value)| match value {
            Value::Object(tree) => paths(tree, &format!("{section}{key}.")),
            _ => vec![format!("{section}{key}")],
        })
        .collect()
}

/// Levenshtein distance, letters compared without case.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.to_lowercase().chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.to_lowercase().chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.iter().enumerate() {
            let above = row[j + 1];
            row[j + 1] = (diagonal + usize::from(x != *y))
                .min(above + 1)
                .min(row[j] + 1);
            diagonal = above;
        }
    }
    row[b.len()]
}
