//! Histogram remapping: a map given another distribution, its order kept.

/// Gives `map` the distribution of the samples `sorted` (ascending): the pixel of rank k (ties by pixel number) takes
/// the k-th sample; with another number of samples, their quantile (k + ½)/n by linear interpolation.
///
/// No samples: the map stays as it is.
pub fn remap(map: &mut [f64], sorted: &[f64]) {
    if sorted.is_empty() {
        return;
    }
    let n = map.len();
    for (rank, p) in ranked(map).enumerate() {
        map[p] = if n == sorted.len() {
            sorted[rank]
        } else {
            quantile(sorted, (rank as f64 + 0.5) / n as f64)
        };
    }
}

/// The pixels in the order of their values (total order), ties by pixel number.
///
/// ```text
/// key ← value on a scale of 2^32 steps from the least to the greatest
/// sort the pairs (key, pixel) by key                       radix, stable: four passes over 8 bytes each
/// sort by value where keys are equal                       rare: few values share a step
/// ```
///
/// A radix sort by all 64 bits takes twice the passes over twice the bytes.
fn ranked(map: &[f64]) -> impl Iterator<Item = usize> + use<> {
    let (low, high) = map
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| {
            (low.min(x), high.max(x))
        });
    let scale = f64::from(u32::MAX) / (high - low);
    // Whatever is not finite puts everything on one step.
    let finite = scale.is_finite() && map.iter().all(|x| x.is_finite());
    let scale = if finite { scale } else { 0.0 };
    let low = if finite { low } else { 0.0 };
    let mut order: Vec<[u32; 2]> = map
        .iter()
        .zip(0..)
        .map(|(&x, p)| [((x - low) * scale) as u32, p])
        .collect();
    radsort::sort_by_key(&mut order, |&[key, _]| key);
    for same in order.chunk_by_mut(|a, b| a[0] == b[0]) {
        if same.len() > 1 {
            same.sort_by(|a, b| map[a[1] as usize].total_cmp(&map[b[1] as usize]));
        }
    }
    order.into_iter().map(|[_, p]| p as usize)
}

/// The quantile `q` of sorted samples, sample j standing for (j + ½)/len.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let last = sorted.len() - 1;
    let x = (q * sorted.len() as f64 - 0.5).clamp(0.0, last as f64);
    let j = (x as usize).min(last);
    let next = sorted[(j + 1).min(last)];
    sorted[j] + (x - j as f64) * (next - sorted[j])
}

#[cfg(test)]
mod tests {
    use super::remap;

    #[test]
    fn ranks_take_the_sorted_samples() {
        let mut map = [3.0, -1.0, 3.0, 0.5];
        remap(&mut map, &[10.0, 20.0, 30.0, 40.0]);
        assert_eq!(map, [30.0, 10.0, 40.0, 20.0]);
    }

    #[test]
    fn close_and_odd_values_keep_their_order() {
        let tiny = f64::MIN_POSITIVE;
        let mut map = [1.0, 3.0 * tiny, -0.0, 0.0, tiny, -1.0, 2.0 * tiny, 0.0];
        remap(&mut map, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        assert_eq!(map, [7.0, 6.0, 1.0, 2.0, 4.0, 0.0, 5.0, 3.0]);
        let mut map = [f64::INFINITY, f64::NAN, -3.0, f64::NEG_INFINITY];
        remap(&mut map, &[0.0, 1.0, 2.0, 3.0]);
        assert_eq!(map, [2.0, 3.0, 1.0, 0.0]);
        let mut map = [5.0; 3];
        remap(&mut map, &[0.0, 1.0, 2.0]);
        assert_eq!(map, [0.0, 1.0, 2.0]);
    }

    #[test]
    fn other_sizes_take_quantiles() {
        let mut map = [1.0, 2.0, 3.0, 4.0];
        remap(&mut map, &[0.0, 1.0]);
        assert_eq!(map, [0.0, 0.25, 0.75, 1.0]);
        let mut map = [5.0, 4.0];
        remap(&mut map, &[7.0]);
        assert_eq!(map, [7.0, 7.0]);
        remap(&mut map, &[]);
        assert_eq!(map, [7.0, 7.0]);
    }
}
