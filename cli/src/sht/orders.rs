//! Tables of the orders m: made once and kept where they are small, made anew by each worker where they are large.

use dust3d_kernels::sht::{
    Step, WignerStep, epsilon_len, epsilon_table, spin_factor_len, spin_factor_table, start_norms,
    step_count, step_table, wigner_norms, wigner_step_count, wigner_step_table,
};

/// Tables up to this size are kept.
const KEPT_BYTES: usize = 80 << 20;

/// What the Legendre stage needs of one order.
#[derive(Clone, Copy)]
pub(super) struct Order<'a> {
    pub(super) epsilon: &'a [f64],
    pub(super) steps: &'a [Step],
    pub(super) wigner: &'a [WignerStep],
    pub(super) norm: f64,
    pub(super) wigner_norm: [f64; 2],
}

/// Room for the tables of one order, or of all.
#[derive(Default)]
pub(super) struct OrderTables {
    epsilon: Vec<f64>,
    steps: Vec<Step>,
    wigner: Vec<WignerStep>,
}

/// Tables of all orders up to lmax.
pub(super) struct Orders {
    lmax: usize,
    /// No order above needs the Wigner tables.
    wigner_limit: usize,
    norms: Vec<f64>,
    wigner_norms: Vec<[f64; 2]>,
    pub(super) spin_factors: Vec<f64>,
    kept: Option<(OrderTables, Vec<[usize; 3]>)>,
}

fn fill(m: usize, epsilon: &mut [f64], steps: &mut [Step], wigner: &mut [WignerStep]) {
    epsilon_table(m, epsilon);
    if step_table(epsilon, steps).is_err() {
        unreachable!("the table of epsilon is made long enough for the steps");
    }
    wigner_step_table(m, epsilon, wigner);
}

impl Orders {
    pub(super) fn new(lmax: usize, wigner_limit: usize) -> Self {
        let mut norms = vec![0.0; lmax + 1];
        start_norms(&mut norms);
        let mut spin_norms = vec![[0.0; 2]; lmax + 1];
        wigner_norms(&mut spin_norms);
        let mut spin_factors = vec![0.0; spin_factor_len(lmax)];
        spin_factor_table(&mut spin_factors);
        let mut orders = Self {
            lmax,
            wigner_limit,
            norms,
            wigner_norms: spin_norms,
            spin_factors,
            kept: None,
        };
        let mut offsets = vec![[0; 3]];
        let mut end = [0; 3];
        for m in 0..=lmax {
            let lengths = orders.lengths(m);
            end = [0, 1, 2].map(|k| end[k] + lengths[k]);
            offsets.push(end);
        }
        if end[0] * 8 + (end[1] + end[2]) * 32 <= KEPT_BYTES {
            let mut tables = OrderTables {
                epsilon: vec![0.0; end[0]],
                steps: vec![[0.0; 4]; end[1]],
                wigner: vec![[0.0; 4]; end[2]],
            };
            for (m, o) in offsets.windows(2).enumerate() {
                fill(
                    m,
                    &mut tables.epsilon[o[0][0]..o[1][0]],
                    &mut tables.steps[o[0][1]..o[1][1]],
                    &mut tables.wigner[o[0][2]..o[1][2]],
                );
            }
            orders.kept = Some((tables, offsets));
        }
        orders
    }

    fn lengths(&self, m: usize) -> [usize; 3] {
        [
            epsilon_len(self.lmax, m),
            step_count(self.lmax, m),
            if m <= self.wigner_limit {
                wigner_step_count(self.lmax, m)
            } else {
                0
            },
        ]
    }

    /// The tables of order m, from the store or made in `own`; those of Wigner's functions only for `pairs`.
    pub(super) fn get<'a>(&'a self, m: usize, pairs: bool, own: &'a mut OrderTables) -> Order<'a> {
        let (epsilon, steps, wigner) = match &self.kept {
            Some((tables, offsets)) => {
                let (from, to) = (offsets[m], offsets[m + 1]);
                (
                    &tables.epsilon[from[0]..to[0]],
                    &tables.steps[from[1]..to[1]],
                    &tables.wigner[from[2]..to[2]],
                )
            }
            None => {
                let [epsilon, steps, wigner] = self.lengths(m);
                let wigner = if pairs { wigner } else { 0 };
                own.epsilon.resize(epsilon, 0.0);
                own.steps.resize(steps, [0.0; 4]);
                own.wigner.resize(wigner, [0.0; 4]);
                fill(m, &mut own.epsilon, &mut own.steps, &mut own.wigner);
                (&own.epsilon[..], &own.steps[..], &own.wigner[..])
            }
        };
        let wigner_scale = wigner.first().map_or(1.0, |s| 1.0 / s[3]);
        Order {
            epsilon,
            steps,
            wigner,
            norm: self.norms[m] / steps.first().map_or(1.0, |s| s[3]),
            wigner_norm: self.wigner_norms[m].map(|n| n * wigner_scale),
        }
    }
}
