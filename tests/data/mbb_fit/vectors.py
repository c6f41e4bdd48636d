#!/usr/bin/env python3
"""Reference fits of modified blackbodies by a general bounded least-squares program.

    python3 vectors.py          (needs numpy, scipy; writes fits.txt beside itself)

Each row: n, nu[n] in GHz, sigma[n], I[n], then tau, T, beta, chi2 of the least chi2 = sum ((m/I - 1)/sigma)^2 over
tau > 0, 5 <= T <= 60, 0 <= beta <= 4 and how many different local minima a grid of starts led to. Intensities are drawn
with a fixed seed: a modified blackbody, inside or beyond the bounds, times (1 + noise).
"""
import os
import numpy as np
from scipy.optimize import least_squares

here = os.path.dirname(os.path.abspath(__file__))
h, k, c = 6.62607015e-34, 1.380649e-23, 299792458.0
rng = np.random.default_rng(20180603)
DEFAULT_NU = np.array([353.0, 545.0, 857.0, 2997.92458])
DEFAULT_SIGMA = np.array([0.0078, 0.061, 0.064, 0.135])


def law(nu, t, beta):
    return (nu / 353) ** beta * 2 * h * nu**3 * 1e47 / c**2 / np.expm1(h * nu * 1e9 / (k * t))


def fit(nu, sigma, intensity):
    """All local minima as (chi2, tau, T, beta), the least first."""
    minima = []
    for t0 in (6.0, 9.0, 13.0, 19.0, 28.0, 40.0, 55.0):
        for b0 in (0.3, 1.2, 2.0, 3.0, 3.8):
            scale = np.exp(np.mean(np.log(intensity / law(nu, t0, b0))))

            def residual(p):
                return (p[0] * scale * law(nu, p[1], p[2]) / intensity - 1) / sigma

            def jacobian(p):
                m = p[0] * scale * law(nu, p[1], p[2]) / intensity / sigma
                x = h * nu * 1e9 / (k * p[1])
                return np.stack([m / p[0], m * x / -np.expm1(-x) / p[1], m * np.log(nu / 353)], axis=1)

            s = least_squares(residual, [1.0, t0, b0], jacobian, bounds=([0, 5, 0], [np.inf, 60, 4]),
                              x_scale=[1.0, 10.0, 1.0], ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=2000)
            found = (2 * s.cost, s.x[0] * scale, s.x[1], s.x[2])
            if all(abs(found[2] - m[2]) > 1e-3 * m[2] or abs(found[3] - m[3]) > 1e-3 for m in minima):
                minima.append(found)
    return sorted(minima)


def polish(nu, sigma, intensity, start):
    """Newton's method in the free parameters, those within 1e-5 of a bound held there."""
    _, tau, t, beta = start
    p = np.array([np.log(tau), t, beta])
    p[1] = 5.0 if p[1] < 5.00005 else 60.0 if p[1] > 59.9994 else p[1]
    p[2] = 0.0 if p[2] < 1e-5 else 4.0 if p[2] > 4 - 1e-5 else p[2]
    free = [0] + ([1] if 5 < p[1] < 60 else []) + ([2] if 0 < p[2] < 4 else [])
    def residual(p):
        return (np.exp(p[0]) * law(nu, p[1], p[2]) / intensity - 1) / sigma

    def gradient(p):
        q = np.exp(p[0]) * law(nu, p[1], p[2]) / intensity / sigma
        x = h * nu * 1e9 / (k * p[1])
        a = np.stack([np.ones_like(x), x / -np.expm1(-x) / p[1], np.log(nu / 353)], axis=1)
        return a.T @ (q * residual(p))

    for _ in range(30):
        g = gradient(p)
        step = np.zeros(3)
        hessian = np.empty((3, 3))
        for j, e in enumerate(np.eye(3) * [1e-5, 1e-4, 1e-5]):
            hessian[j] = (gradient(p + e) - gradient(p - e)) / (2 * e[j])
        step[free] = np.linalg.solve(hessian[np.ix_(free, free)], -g[free])
        p += step
        if np.all(abs(step) < 1e-13 * np.maximum(abs(p), 1)):
            break
    return np.sum(residual(p) ** 2), np.exp(p[0]), p[1], p[2]


def case(nu, sigma, t, beta, noise):
    i = 10 ** rng.uniform(-7, -3) * law(nu, t, beta) * (1 + noise * sigma * rng.standard_normal(len(nu)))
    return (nu, sigma, i) if np.all(i > 0) else case(nu, sigma, t, beta, noise)


cases = []
for noise in (0.3, 1.0, 2.0):
    for _ in range(60):
        cases.append(case(DEFAULT_NU, DEFAULT_SIGMA, rng.normal(19.4, 1.25), rng.normal(1.6, 0.13), noise))
        cases.append(case(DEFAULT_NU, DEFAULT_SIGMA, rng.uniform(5, 60), rng.uniform(0, 4), noise))
for _ in range(100):
    cases.append(case(DEFAULT_NU, DEFAULT_SIGMA, rng.choice([rng.uniform(3.5, 5.5), rng.uniform(50, 120)]), rng.uniform(0, 4), 0.5))
    cases.append(case(DEFAULT_NU, DEFAULT_SIGMA, rng.uniform(6, 50), rng.choice([rng.uniform(-0.5, 0.2), rng.uniform(3.8, 4.5)]), 0.5))
for _ in range(30):
    cases.append(case(DEFAULT_NU[1:], DEFAULT_SIGMA[1:], rng.uniform(8, 40), rng.uniform(0.5, 3), 1.0))
    nu = np.array([217.0, 353.0, 545.0, 857.0, 1249.0, 1873.0, 2997.92458])
    cases.append(case(nu, np.full(7, 0.05), rng.uniform(8, 40), rng.uniform(0.5, 3), 1.0))

if __name__ == "__main__":
    several = 0
    with open(os.path.join(here, "fits.txt"), "w") as f:
        f.write("# n nu[n] sigma[n] I[n] tau T beta chi2 minima\n")
        for nu, sigma, i in cases:
            minima = fit(nu, sigma, i)
            several += len(minima) > 1
            if len(minima) > 1:
                print(minima)
            best = polish(nu, sigma, i, minima[0])
            # The polished point must be the same minimum.
            assert best[0] <= minima[0][0] + 1e-8 * (1 + minima[0][0]), (best, minima)
            row = [*nu, *sigma, *i, best[1], best[2], best[3], best[0]]
            f.write(" ".join([str(len(nu))] + [repr(float(x)) for x in row] + [str(len(minima))]) + "\n")
    print(len(cases), "cases,", several, "with several minima")
