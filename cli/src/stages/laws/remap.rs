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
    let mut order: Vec<(f64, u32)> = map.iter().zip(0..).map(|(&x, p)| (x, p)).collect();
    // By radix, in total order, and stable: the time grows with the number of pixels alone.
    radsort::sort_by_key(&mut order, |&(x, _)| x);
    for (rank, (_, p)) in order.into_iter().enumerate() {
        map[p as usize] = if n == sorted.len() {
            sorted[rank]
        } else {
            quantile(sorted, (rank as f64 + 0.5) / n as f64)
        };
    }
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
