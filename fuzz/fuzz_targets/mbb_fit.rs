//! Modified-blackbody fit: for any frequencies, errors and intensities whatever the result is a minimum, on bounds too,
//! or honestly missing.
#![no_main]

use arbitrary::Arbitrary;
use dust3d_kernels::fit::mbb::MbbFit;
use dust3d_tests::mbb_fit::{check, check_far, intensity};
use libfuzzer_sys::fuzz_target;

#[derive(Debug, Arbitrary)]
struct Input {
    /// Raw numbers for everything: frequency, error, intensity.
    rows: Vec<(f64, f64, f64)>,
    /// Or a law with errors, in steps small enough to be searched.
    law: Option<(u16, u16, [i8; 4])>,
}

fuzz_target!(|input: Input| {
    if let Some((t, beta, noise)) = input.law {
        let fit = MbbFit::default();
        let (t, beta) = (3.0 + f64::from(t) / 600.0, -0.5 + f64::from(beta) / 13000.0);
        let mut data = [0.0; 4];
        for (((i, &nu), s), n) in data
            .iter_mut()
            .zip(fit.frequencies())
            .zip(fit.sigma())
            .zip(noise)
        {
            *i = intensity(nu, 1e-5, t, beta) * (1.0 + s * f64::from(n) / 32.0);
        }
        check(&fit, &data);
    }
    let column = |f: fn(&(f64, f64, f64)) -> f64| input.rows.iter().map(f).collect::<Vec<_>>();
    if let Ok(fit) = MbbFit::new(&column(|r| r.0), &column(|r| r.1)) {
        check_far(&fit, &column(|r| r.2));
    }
    // Frequencies and errors brought into range, so that random bytes reach the fit.
    let fold = |x: f64, lo: f64, hi: f64| {
        if x.is_finite() {
            lo + x.abs() % (hi - lo)
        } else {
            hi
        }
    };
    let nu: Vec<f64> = input.rows.iter().map(|r| fold(r.0, 10.0, 5000.0)).collect();
    let sigma: Vec<f64> = input.rows.iter().map(|r| fold(r.1, 1e-3, 2.0)).collect();
    if let Ok(fit) = MbbFit::new(&nu, &sigma) {
        check_far(&fit, &column(|r| r.2));
        let folded: Vec<f64> = input.rows.iter().map(|r| fold(r.2, 1e-3, 1e3)).collect();
        check_far(&fit, &folded);
    }
});
