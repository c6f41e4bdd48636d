//! Emission of layers: whatever the numbers and lengths, all layers at once give the bits of one after the other, or the
//! same refusal.
#![no_main]

use arbitrary::Arbitrary;
use dust3d_kernels::planck::mbb::{MbbLayer, MbbNode, mbb_add_iqu, mbb_layers_into};
use dust3d_kernels::simd::Level;
use libfuzzer_sys::fuzz_target;

#[derive(Debug, Arbitrary)]
struct Input {
    /// Frequencies and weights, a list for each band.
    bands: Vec<Vec<(f64, f64)>>,
    nu0: Option<f64>,
    /// I, Q, U, T, β of a pixel; a layer takes as many as the first, in turn.
    pixels: Vec<[f64; 5]>,
    layers: u8,
    /// Pixels of the output more than of the layers.
    excess: u8,
}

fuzz_target!(|input: Input| {
    let nu0 = input.nu0.unwrap_or(353.0);
    let bands: Vec<Vec<MbbNode>> = input
        .bands
        .iter()
        .map(|band| {
            let nodes = band.iter().map(|&(nu, weight)| {
                MbbNode::new(nu, nu0, weight).or_else(|_| MbbNode::new(217.0, 353.0, weight))
            });
            nodes.flatten().collect()
        })
        .collect();
    let bands: Vec<&[MbbNode]> = bands.iter().map(Vec::as_slice).collect();
    let count = usize::from(input.layers) % 20;
    let n = input.pixels.len() / count.max(1);
    let columns: Vec<[Vec<f64>; 5]> = (0..count)
        .map(|layer| {
            let pixels = &input.pixels[layer * n..(layer + 1) * n];
            std::array::from_fn(|k| pixels.iter().map(|p| p[k]).collect())
        })
        .collect();
    let layers: Vec<MbbLayer<'_, f64, 3>> = columns
        .iter()
        .map(|[i, q, u, t, beta]| MbbLayer {
            templates: [i, q, u],
            t,
            beta,
        })
        .collect();
    let npix = n + usize::from(input.excess == 255);
    for level in Level::available() {
        let mut sums = vec![vec![0.0; npix]; 3 * bands.len()];
        let mut maps = vec![vec![1.0; npix]; 3 * bands.len()];
        let mut one_by_one = Ok(());
        for layer in &layers {
            let mut views: Vec<&mut [f64]> = sums.iter_mut().map(Vec::as_mut_slice).collect();
            let MbbLayer { templates, t, beta } = *layer;
            one_by_one = one_by_one
                .and_then(|()| mbb_add_iqu(level, &bands, templates, t, beta, &mut views));
        }
        let mut views: Vec<&mut [f64]> = maps.iter_mut().map(Vec::as_mut_slice).collect();
        let at_once = mbb_layers_into(level, &bands, &layers, &mut views);
        if layers.is_empty() {
            continue;
        }
        assert_eq!(one_by_one.is_ok(), at_once.is_ok());
        if at_once.is_ok() {
            for (a, b) in sums.iter().flatten().zip(maps.iter().flatten()) {
                assert!(a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan());
            }
        }
    }
});
