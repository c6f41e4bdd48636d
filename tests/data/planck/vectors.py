#!/usr/bin/env python3
"""Reference vectors of the Planck function, its derivative, ratios, modified blackbodies, unit factors and bands.

    python3 vectors.py          (needs mpmath; writes planck.txt, ratio.txt, units.txt, bands.txt beside itself)

50-digit arithmetic from the exact SI constants; every argument is an f64. Values are rounded to f64, those of
planck.txt and ratio.txt followed by what the rounding took.
"""
import os
import random
from mpmath import mp, mpf

mp.dps = 50
here = os.path.dirname(os.path.abspath(__file__))
random.seed(20180602)
h, k, c, t_cmb = mpf("6.62607015e-34"), mpf("1.380649e-23"), mpf(299792458), mpf(2.7255)


def x_of(nu, t):
    return h * nu * 10**9 / (k * t)


def planck(nu, t):
    return 2 * h * (nu * 10**9) ** 3 / c**2 / mp.expm1(x_of(nu, t)) * 10**20


def derivative(nu, t):
    x = x_of(nu, t)
    return 2 * k * (nu * 10**9) ** 2 / c**2 * (x / 2 / mp.sinh(x / 2)) ** 2 * 10**20


def rayleigh_jeans(nu):
    return 2 * k * (nu * 10**9) ** 2 / c**2 * 10**20


def split(v):
    hi = float(v)
    return f"{hi!r} {float(v - mpf(hi))!r}"


with open(os.path.join(here, "planck.txt"), "w") as f:
    f.write("# nu_GHz T_K  B rest  dB/dT rest   (MJy/sr, MJy/sr/K)\n")
    cases = [(353.0, 19.4), (353.0, 2.7255), (160.2, 2.7255), (2997.92458, 20.0), (30.0, 1e6), (1e-3, 1e9)]
    cases += [(10 ** random.uniform(1, 3.6), random.uniform(3, 80)) for _ in range(300)]
    # x spread over its whole range.
    for _ in range(500):
        t = 10 ** random.uniform(0, 4)
        x = 10 ** random.uniform(-12, 2.84)
        cases.append((float(x / x_of(1, mpf(t))), t))
    for nu, t in cases:
        f.write(f"{nu!r} {t!r} {split(planck(mpf(nu), mpf(t)))} {split(derivative(mpf(nu), mpf(t)))}\n")

with open(os.path.join(here, "ratio.txt"), "w") as f:
    f.write("# nu_GHz nu0_GHz T_K beta  B_nu/B_nu0 rest  (nu/nu0)^beta B_nu/B_nu0 rest\n")
    cases = [(nu, 353.0, t, b) for nu in (143.0, 217.0, 545.0, 857.0, 2997.92458, 353.0) for t in (5.0, 19.4, 60.0) for b in (0.0, 1.6, 4.0)]
    cases += [(10 ** random.uniform(0.5, 3.8), 353.0, random.uniform(5, 60), random.uniform(0, 4)) for _ in range(500)]
    cases += [(10 ** random.uniform(0, 4), 10 ** random.uniform(0, 4), random.uniform(3, 300), random.uniform(-1, 4)) for _ in range(200)]
    cases += [(10 ** random.uniform(2, 4), 10 ** random.uniform(2, 4), 10 ** random.uniform(-1, 0), 1.5) for _ in range(100)]
    for nu, nu0, t, beta in cases:
        a, b = mpf(nu), mpf(nu0)
        ratio = planck(a, mpf(t)) / planck(b, mpf(t))
        law = ratio * (a / b) ** mpf(beta)
        if mpf("1e-290") < law < mpf("1e290") and mpf("1e-290") < ratio < mpf("1e290"):
            f.write(f"{nu!r} {nu0!r} {t!r} {beta!r} {split(ratio)} {split(law)}\n")

with open(os.path.join(here, "units.txt"), "w") as f:
    f.write("# nu_GHz  uK_RJ and uK_CMB per MJy/sr\n")
    for nu in [353.0, 143.0, 217.0, 545.0, 857.0, 2997.92458, 22.8, 30.0, 44.0, 70.0, 100.0, 1.0, 1e-3, 1e4]:
        a = mpf(nu)
        f.write(f"{nu!r} {float(10**6 / rayleigh_jeans(a))!r} {float(10**6 / derivative(a, t_cmb))!r}\n")

with open(os.path.join(here, "bands.txt"), "w") as f:
    f.write("# n, then nu[n] weight[n] T beta, then the band of an I(353 GHz) = 1 MJy/sr blackbody in MJy/sr, uK_RJ, uK_CMB\n")
    for n in (1, 2, 3, 10, 17, 50):
        for centre in (95.0, 220.0, 353.0, 857.0):
            nu = sorted(centre * random.uniform(0.8, 1.2) for _ in range(n))
            w = [random.uniform(0.0, 3.0) for _ in range(n)]
            t, beta = random.uniform(10, 30), random.uniform(1, 2)
            steps = [1] if n == 1 else [
                (mpf(nu[min(i + 1, n - 1)]) - mpf(nu[max(i - 1, 0)])) / 2 for i in range(n)]

            def integral(g):
                return sum(s * mpf(x) * g(mpf(v)) for s, x, v in zip(steps, w, nu))

            top = integral(lambda v: (v / 353) ** mpf(beta) * planck(v, mpf(t)) / planck(mpf(353), mpf(t)))
            values = [top / integral(lambda v: mpf(1)), 10**6 * top / integral(rayleigh_jeans),
                      10**6 * top / integral(lambda v: derivative(v, t_cmb))]
            f.write(" ".join([str(n)] + [repr(v) for v in nu + w + [t, beta] + [float(v) for v in values]]) + "\n")
