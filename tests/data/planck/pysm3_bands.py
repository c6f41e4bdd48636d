#!/usr/bin/env python3
"""Bands of a modified blackbody as PySM3 computes them: ModifiedBlackBody.get_emission(freqs, weights) in uK_RJ, and
bandpass_unit_conversion to uK_CMB and MJy/sr.

    python3 pysm3_bands.py          (needs pysm3, numpy, astropy; writes pysm3.txt beside itself)

Rows: n, nu[n] in GHz, weight[n], I(353 GHz) in MJy/sr, T, beta, then the band in uK_RJ, uK_CMB, MJy/sr.
"""
import os
import numpy as np
import pysm3
import pysm3.units as u
from pysm3.models.dust import get_emission_numba
from pysm3.utils import bandpass_unit_conversion, normalize_weights

here = os.path.dirname(os.path.abspath(__file__))
rng = np.random.default_rng(20180604)
with open(os.path.join(here, "pysm3.txt"), "w") as f:
    f.write(f"# pysm3 {pysm3.__version__}: n nu[n] weight[n] I T beta, uK_RJ, uK_CMB, MJy/sr\n")
    for n in (1, 2, 5, 10, 40):
        for centre in (40.0, 143.0, 220.0, 353.0, 545.0, 857.0):
            nu = np.sort(centre * rng.uniform(0.8, 1.2, n))
            w = rng.uniform(0.05, 3.0, n)
            i, t, beta = 10 ** rng.uniform(-3, 3), rng.uniform(10, 30), rng.uniform(1, 2)
            reference = (i * u.MJy / u.sr).to_value(u.uK_RJ, equivalencies=u.cmb_equivalencies(353 * u.GHz))
            zero = np.zeros(1)
            rj = get_emission_numba(nu, normalize_weights(nu, w), np.array([reference]), zero, zero, 353.0, 353.0,
                                    np.array([beta]), np.array([t]))[0, 0]
            values = [rj] + [rj * bandpass_unit_conversion(nu * u.GHz, w, unit).value.item() if n == 1 else
                             rj * bandpass_unit_conversion(nu * u.GHz, w, unit).value for unit in (u.uK_CMB, u.MJy / u.sr)]
            f.write(" ".join([str(n)] + [repr(float(x)) for x in [*nu, *w, i, t, beta, *values]]) + "\n")
