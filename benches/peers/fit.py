#!/usr/bin/env python3
"""Fits of tau, T, beta from four frequencies: ours, a batched Levenberg-Marquardt in numpy, and scipy, in one run.

    pip install numpy scipy
    python3 benches/peers/fit.py [--pixels 200000] [--rounds 3]

Noisy data (default errors). Every round times every program once; the best counts. Results are compared before anything is
printed. scipy fits the first 300 pixels, the batched program 20000 of them.
"""
import os

THREADS = os.cpu_count()
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import argparse
import pathlib
import platform
import tempfile
import time

import numpy as np
import scipy
from scipy.optimize import curve_fit, least_squares

NU = np.array([353.0, 545.0, 857.0, 2997.92458])
SIGMA = np.array([0.0078, 0.061, 0.064, 0.135])
H, K, C = 6.62607015e-34, 1.380649e-23, 299792458.0
LOG = np.log(NU / 353.0)
FRONT = 2 * H * NU**3 * 1e47 / C**2
X = H * NU * 1e9 / K


def law(t, beta):
    return np.exp(beta * LOG) * FRONT / np.expm1(X / t)


def scipy_least_squares(data):
    scale = data[0] / law(19.0, 1.6)[0]

    def residual(p):
        return (p[0] * scale * law(p[1], p[2]) / data - 1) / SIGMA

    def jacobian(p):
        m = p[0] * scale * law(p[1], p[2]) / data / SIGMA
        x = X / p[1]
        return np.stack([m / p[0], m * x / -np.expm1(-x) / p[1], m * LOG], axis=1)

    s = least_squares(residual, [1.0, 19.0, 1.6], jacobian, bounds=([0, 5, 0], [np.inf, 60, 4]), x_scale=[1.0, 10.0, 1.0],
                      ftol=1e-12, xtol=1e-12, gtol=1e-12)
    return s.x[0] * scale, s.x[1], s.x[2]


def scipy_curve_fit(data):
    scale = data[0] / law(19.0, 1.6)[0]
    p, _ = curve_fit(lambda _, a, t, b: a * scale * law(t, b) / data, NU, np.ones(4), [1.0, 19.0, 1.6], SIGMA)
    return p[0] * scale, p[1], p[2]


def batched(data, iterations=60):
    """Levenberg-Marquardt in (ln tau, ln T, beta), all pixels at once, those that have converged left out."""
    n = data.shape[1]
    p = np.stack([np.log(data[0] / law(19.0, 1.6)[0]), np.full(n, np.log(19.0)), np.full(n, 1.6)])
    out, left, damping = p.copy(), np.arange(n), np.full(n, 1e-3)
    weight = 1 / SIGMA[:, None]
    x_nu, log_nu, front = X[:, None], LOG[:, None], FRONT[:, None]

    def model(p, data):
        x = x_nu * np.exp(-p[1])
        return np.exp(p[0] + p[2] * log_nu) * front / np.expm1(x) / data * weight, x

    q, x = model(p, data)
    cost = np.sum((q - weight) ** 2, axis=0)
    for _ in range(iterations):
        r = q - weight
        columns = np.stack([q, q * x / -np.expm1(-x), q * log_nu])
        gradient = np.einsum("aip,ip->ap", columns, r)
        hessian = np.einsum("aip,bip->pab", columns, columns)
        damped = hessian + damping[:, None, None] * hessian * np.eye(3)
        step = -np.linalg.solve(damped, gradient.T[:, :, None])[:, :, 0].T
        trial = p + step
        trial[1] = np.clip(trial[1], np.log(5.0), np.log(60.0))
        trial[2] = np.clip(trial[2], 0.0, 4.0)
        q2, x2 = model(trial, data)
        cost2 = np.sum((q2 - weight) ** 2, axis=0)
        better = cost2 <= cost * (1 + 1e-12)
        p, q, x, cost = (np.where(better, a, b) for a, b in ((trial, p), (q2, q), (x2, x), (cost2, cost)))
        damping = np.where(better, damping * 0.1, damping * 10)
        out[:, left] = p
        going = ~(better & (np.max(abs(step), axis=0) < 1e-8))
        if not going.any():
            break
        left, p, q, x, cost, damping, data = left[going], p[:, going], q[:, going], x[:, going], cost[going], damping[going], data[:, going]
    return np.exp(out[0]), np.exp(out[1]), out[2]


def timed(run):
    start = time.perf_counter()
    result = run()
    return time.perf_counter() - start, result


def main():
    from mbb import Ours

    parser = argparse.ArgumentParser()
    parser.add_argument("--pixels", type=int, default=200_000)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    n = options.pixels
    rng = np.random.default_rng(2)
    t, beta = rng.normal(19.4, 1.25, n), rng.normal(1.6, 0.13, n)
    data = 1e-5 * np.exp(beta * LOG[:, None]) * FRONT[:, None] / np.expm1(X[:, None] / t)
    data *= np.maximum(1 + SIGMA[:, None] * rng.normal(size=(4, n)), 0.05)
    few, some = min(300, n), min(20_000, n)
    with tempfile.TemporaryDirectory() as folder:
        path, result = pathlib.Path(folder) / "data.f64", pathlib.Path(folder) / "out.f64"
        data.tofile(path)
        ours = Ours("fit", path, n)
        answer = ours.ask("fit", 1, "best")
        ours.ask("write", result)
        fit = np.fromfile(result).reshape(3, n)
        best = {}
        worst = {}

        def note(name, threads, rate):
            best[name, threads] = max(best.get((name, threads), 0.0), rate)

        for _ in range(options.rounds):
            for threads in sorted({1, THREADS}):
                for level in ("best", "avx2"):
                    note(level, threads, n / ours.ask("fit", threads, level)["ms"] * 1e3)
            for name, program in (("least_squares", scipy_least_squares), ("curve_fit", scipy_curve_fit)):
                seconds, values = timed(lambda: np.array([program(data[:, p]) for p in range(few)]).T)
                note(name, 1, few / seconds)
                worst[name] = np.nanmax(abs(values / fit[:, :few] - 1))
            seconds, values = timed(lambda: np.array(batched(data[:, :some])))
            note("numpy batched", 1, some / seconds)
            worst["numpy batched"] = np.nanmax(abs(values / fit[:, :some] - 1))
    # curve_fit has no bounds and a looser end.
    assert worst["least_squares"] < 1e-6 and worst["numpy batched"] < 1e-6 and worst["curve_fit"] < 1e-4, worst
    cpu = next((l.split(":")[1].strip() for l in open("/proc/cpuinfo") if l.startswith("model name")), platform.processor())
    print(f"{cpu}; numpy {np.__version__}, scipy {scipy.__version__}; {n} noisy pixels, {answer['fitted']} fitted, best of {options.rounds}")
    print(f"{'program':16} {'threads':>7} {'fits/s':>12} {'ours is faster by':>18} {'largest difference':>19}")
    for (name, threads), rate in sorted(best.items(), key=lambda item: -item[1]):
        label = answer["level"] if name == "best" else name
        difference = f"{worst[name]:19.1e}" if name in worst else ""
        print(f"{label:16} {threads:7} {rate:12.3g} {best['best', threads] / rate:18.1f} {difference}")


if __name__ == "__main__":
    main()
