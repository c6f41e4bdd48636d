//! The transforms of the rings of the caps, every one of another length.

use super::equidistant::Ready;
use dust3d_kernels::sht::{CapRing, CapWindow, RingShapes, cap_factors, cap_length};
use std::collections::BTreeMap;

/// A length: its transform, and one over the transform of the window on a grid of that length.
struct Length {
    ready: Ready,
    factors: Vec<f64>,
}

/// Of one ring: pixels of a quarter, which of the lengths, and whether a window leads from there to the pixels.
#[derive(Clone, Copy)]
struct Ring {
    quarter: usize,
    length: usize,
    windowed: bool,
}

/// The rings of the caps; few lengths serve all of them.
pub(super) struct Caps {
    pub(super) window: CapWindow,
    lengths: Vec<Length>,
    blocks: Vec<[Option<Ring>; 8]>,
}

impl Caps {
    /// For all blocks: the number of orders that reach them, and their rings if they are not of the belt.
    pub(super) fn new<'a>(blocks: impl Iterator<Item = (usize, Option<&'a RingShapes>)>) -> Self {
        let mut known = BTreeMap::new();
        let mut lengths = Vec::new();
        let mut place = |n: usize| {
            *known.entry(n).or_insert_with(|| {
                let mut factors = vec![0.0; n / 2 + 1];
                cap_factors(n, &mut factors);
                let ready = Ready::new(n)
                    .unwrap_or_else(|| unreachable!("length {n} was chosen for its factors"));
                lengths.push(Length { ready, factors });
                lengths.len() - 1
            })
        };
        let blocks = blocks
            .map(|(orders, shapes)| {
                shapes.map_or([0; 8], |s| s.pixels).map(|n| {
                    let quarter = n / 4;
                    if quarter == 0 {
                        return None;
                    }
                    let length = cap_length(quarter, orders);
                    Some(Ring {
                        quarter,
                        length: place(length),
                        windowed: length != quarter,
                    })
                })
            })
            .collect();
        Self {
            window: CapWindow::new(),
            lengths,
            blocks,
        }
    }

    /// The rings of a block, and their transforms.
    pub(super) fn rings(&self, block: usize) -> [Option<(CapRing<'_>, &Ready)>; 8] {
        self.blocks[block].map(|ring| {
            let Ring {
                quarter,
                length,
                windowed,
            } = ring?;
            let Length { ready, factors } = &self.lengths[length];
            let ring = CapRing {
                quarter,
                fourier: &ready.fourier,
                factors: if windowed { factors } else { &[] },
            };
            Some((ring, ready))
        })
    }
}
