//! Line-of-sight ratios by an adaptive Gauss–Kronrod rule, straight from the definitions.
//!
//! Nothing is shared with the kernel: positions, the field and the sky basis are vectors, the orientation comes from
//! dot products, the density from its logarithm. Checked itself against closed forms (`tests/kernels/field.rs`).

use dust3d_kernels::field::Model;

/// Kronrod nodes ≥ 0 of the 15-point rule, its weights, and the 7-point Gauss weights at every second node.
const KRONROD: [[f64; 2]; 8] = [
    [
        0.991_455_371_120_812_639_206_85,
        0.022_935_322_010_529_224_963_73,
    ],
    [
        0.949_107_912_342_758_524_526_19,
        0.063_092_092_629_978_553_290_70,
    ],
    [
        0.864_864_423_359_769_072_789_71,
        0.104_790_010_322_250_183_839_88,
    ],
    [
        0.741_531_185_599_394_439_863_86,
        0.140_653_259_715_525_918_745_19,
    ],
    [
        0.586_087_235_467_691_130_294_14,
        0.169_004_726_639_267_902_826_58,
    ],
    [
        0.405_845_151_377_397_166_906_61,
        0.190_350_578_064_785_409_913_26,
    ],
    [
        0.207_784_955_007_898_467_600_69,
        0.204_432_940_075_298_892_414_16,
    ],
    [0.0, 0.209_482_141_084_727_828_012_99],
];
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_693_270_61,
    0.279_705_391_489_276_667_901_47,
    0.381_830_050_505_118_944_950_37,
    0.417_959_183_673_469_387_755_10,
];

type Three = [f64; 3];

fn dot(a: Three, b: Three) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// (Q_m/I_m, U_m/I_m) of the layer `near`–`far` (kpc) towards Galactic longitude and latitude (radians).
///
/// Absolute accuracy 1e-10 or better.
pub fn ratios(model: &Model, lon: f64, lat: f64, near: f64, far: f64) -> [f64; 2] {
    let (sl, cl) = lon.sin_cos();
    let (sb, cb) = lat.sin_cos();
    let sight = [cb * cl, cb * sl, sb];
    let south = [sb * cl, sb * sl, -cb];
    let east = [-sl, cl, 0.0];
    let spiral = &model.spiral;
    let at = |r: f64| [r * sight[0] - spiral.r_sun_kpc, r * sight[1], r * sight[2]];
    let ln_n = |r: f64| {
        let [x, y, z] = at(r);
        let height = z.abs() / model.density.h_z_kpc;
        let ln_cosh = height + (-2.0 * height).exp().ln_1p() - std::f64::consts::LN_2;
        -x.hypot(y) / model.density.h_r_kpc - 2.0 * ln_cosh
    };
    // The density's logarithm is concave: golden section finds its peak.
    let peak = {
        let (mut a, mut b) = (near, far);
        for _ in 0..200 {
            let (c, d) = (b - 0.618_034 * (b - a), a + 0.618_034 * (b - a));
            if ln_n(c) > ln_n(d) { b = d } else { a = c }
        }
        let inner = 0.5 * (a + b);
        [near, far, inner].into_iter().fold(
            inner,
            |best, r| {
                if ln_n(r) > ln_n(best) { r } else { best }
            },
        )
    };
    let top = ln_n(peak);
    let (sin_q, cos_q) = spiral.pitch_rad.sin_cos();
    let integrand = |r: f64| -> Three {
        let n = (ln_n(r) - top).exp();
        let [x, y, _] = at(r);
        let radius = x.hypot(y);
        if radius <= spiral.hole_kpc {
            return [n, 0.0, 0.0];
        }
        let theta = y.atan2(x);
        // sin q e_R − cos q e_θ
        let field = [
            sin_q * theta.cos() + cos_q * theta.sin(),
            sin_q * theta.sin() - cos_q * theta.cos(),
            0.0,
        ];
        let (b_south, b_east) = (dot(field, south), dot(field, east));
        let across2 = b_south * b_south + b_east * b_east;
        if across2 == 0.0 {
            return [n, 0.0, 0.0];
        }
        let fraction = model.grains.p0 * across2.sqrt().powf(model.grains.k) / across2;
        [
            n,
            n * fraction * (b_east * b_east - b_south * b_south),
            -n * fraction * 2.0 * b_south * b_east,
        ]
    };
    // Cuts: the hole, the peak, ever closer points on both sides of it, and of the point nearest to the axis.
    let mut cuts = vec![near, far, peak];
    let nearest = spiral.r_sun_kpc * cl / cb;
    let reach = spiral.hole_kpc.powi(2) - (spiral.r_sun_kpc * sl).powi(2);
    if reach > 0.0 {
        cuts.extend([nearest - reach.sqrt() / cb, nearest + reach.sqrt() / cb]);
    }
    // Where the line of sight runs along the field.
    for turn in [0.0, std::f64::consts::PI] {
        let chi = std::f64::consts::FRAC_PI_2 - spiral.pitch_rad + turn;
        cuts.push((spiral.r_sun_kpc * sl / chi.tan() + spiral.r_sun_kpc * cl) / cb);
    }
    let mut step = far - near;
    for _ in 0..36 {
        step *= 0.5;
        cuts.extend([peak - step, peak + step, nearest - step, nearest + step]);
    }
    cuts.retain(|r| (near..=far).contains(r));
    cuts.sort_by(f64::total_cmp);
    let mut total = [0.0; 3];
    // The scale for the tolerance: a first pass without refinement.
    let rough: f64 = cuts
        .windows(2)
        .map(|c| kronrod(&integrand, c[0], c[1]).0[0])
        .sum();
    for c in cuts.windows(2) {
        let part = adaptive(&integrand, c[0], c[1], 1e-11 * rough, 40);
        for (t, p) in total.iter_mut().zip(part) {
            *t += p;
        }
    }
    [total[1] / total[0], total[2] / total[0]]
}

fn kronrod(f: &impl Fn(f64) -> Three, a: f64, b: f64) -> (Three, f64) {
    let (centre, half) = (0.5 * (a + b), 0.5 * (b - a));
    let mut fine = [0.0; 3];
    let mut coarse = [0.0; 3];
    for (i, &[x, w]) in KRONROD.iter().enumerate() {
        let gauss = if i % 2 == 1 { GAUSS[i / 2] } else { 0.0 };
        let mut add = |value: Three| {
            for j in 0..3 {
                fine[j] += half * w * value[j];
                coarse[j] += half * gauss * value[j];
            }
        };
        add(f(centre + half * x));
        if x > 0.0 {
            add(f(centre - half * x));
        }
    }
    let error = (0..3)
        .map(|j| (fine[j] - coarse[j]).abs())
        .fold(0.0, f64::max);
    (fine, error)
}

fn adaptive(f: &impl Fn(f64) -> Three, a: f64, b: f64, tolerance: f64, depth: u32) -> Three {
    let (value, error) = kronrod(f, a, b);
    // The difference from the 7-point rule overstates the error by far.
    if depth == 0
        || error <= tolerance.max(1e-9 * tolerance)
        || (200.0 * error).powf(1.5) <= tolerance
    {
        return value;
    }
    let middle = 0.5 * (a + b);
    let left = adaptive(f, a, middle, 0.5 * tolerance, depth - 1);
    let right = adaptive(f, middle, b, 0.5 * tolerance, depth - 1);
    [left[0] + right[0], left[1] + right[1], left[2] + right[2]]
}
