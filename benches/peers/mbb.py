#!/usr/bin/env python3
"""Emission of six layers at Nside 512 (I, Q, U; one frequency, ten, a band of ten): ours, plain numpy and PySM3, in one run.

    pip install numpy pysm3
    python3 benches/peers/mbb.py [--nside 512] [--rounds 5] [--no-pysm3]

Builds and runs `cargo run --release -p dust3d-benches --example emission_peer`. Every round times every program once, one
after the other; the best of all rounds counts. An evaluation is pixel x layer x frequency, I, Q and U together.
Results are compared before anything is printed. Threads: one, and all for PySM3 (numba) and ours. What ours and numpy
write to is there before the clock runs.
"""
import os

THREADS = os.cpu_count()
os.environ.setdefault("NUMBA_NUM_THREADS", str(THREADS))
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import argparse
import json
import pathlib
import platform
import subprocess
import tempfile
import time

import numba
import numpy as np
import pysm3
import pysm3.units as u
from pysm3 import ModifiedBlackBodyLayers

ROOT = pathlib.Path(__file__).resolve().parents[2]
LAYERS = 6
H_OVER_K = 6.62607015e-34 * 1e9 / 1.380649e-23
TEN = [200.0 + 4 * i for i in range(10)]


class Ours:
    """Our kernels behind a pipe."""

    def __init__(self, *arguments):
        subprocess.run(["cargo", "build", "-q", "--release", "-p", "dust3d-benches", "--example", "emission_peer"], cwd=ROOT, check=True)
        target = os.environ.get("CARGO_TARGET_DIR", ROOT / "target")
        self.process = subprocess.Popen([str(pathlib.Path(target) / "release/examples/emission_peer"), *map(str, arguments)],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, *words):
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())


def numpy_add(layers, nu, weight, out):
    """One frequency of all layers, as one writes it in numpy."""
    for i, q, u_, t, beta in layers:
        scaling = (nu / 353.0) ** (beta + 3.0) * np.expm1(H_OVER_K * 353.0 / t) / np.expm1(H_OVER_K * nu / t)
        if weight != 1.0:
            scaling *= weight
        for o, x in zip(out, (i, q, u_)):
            o += x * scaling


def timed(run):
    start = time.perf_counter()
    run()
    return (time.perf_counter() - start) * 1e3


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--nside", type=int, default=512)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--no-pysm3", action="store_true", help="leave out PySM3, most of the time")
    options = parser.parse_args()
    npix = 12 * options.nside**2
    rng = np.random.default_rng(1)
    layers = np.empty((LAYERS, 5, npix))
    for layer in layers:
        layer[0] = np.exp(rng.normal(size=npix))
        layer[1:3] = 0.05 * rng.normal(size=(2, npix))
        layer[3] = rng.normal(19.4, 1.25, npix)
        layer[4] = rng.normal(1.6, 0.13, npix)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "layers.f64"
        layers.tofile(path)
        ours = Ours("mbb", path, npix, LAYERS)
        result = pathlib.Path(folder) / "out.f64"

        def result_of(maps):
            ours.ask("write", result)
            return np.fromfile(result).reshape(maps, npix)

        with_pysm3 = not options.no_pysm3
        peer = with_pysm3 and ModifiedBlackBodyLayers(map_layers=layers[:, :3] * u.MJy / u.sr, freq_ref=353 * u.GHz,
                                                       map_mbb_index=layers[:, 4], map_mbb_temperature=layers[:, 3] * u.K,
                                                       nside=options.nside, num_layers=LAYERS, unit_layers="MJy/sr", unit_mbb_temperature="K")
        # Power weights 1/n per point: the trapezoid rule's end points count half, so they get twice the weight.
        power = np.ones(len(TEN))
        power[[0, -1]] = 2.0
        to_rj = pysm3.bandpass_unit_conversion(TEN * u.GHz, power, output_unit=u.MJy / u.sr, input_unit=u.uK_RJ).value
        one_rj = (1 * u.uK_RJ).to_value(u.MJy / u.sr, equivalencies=u.cmb_equivalencies(217 * u.GHz))

        # Equal results first. Q and U of the layers cancel: differences are relative to the sum of sizes.
        out, size = np.zeros((3, npix)), np.zeros((3, npix))
        numpy_add(layers, 217.0, 1.0, out)
        numpy_add(abs(layers), 217.0, 1.0, size)
        ours.ask("list", 1, "best", 217.0)
        worst = np.max(abs(result_of(3) - out) / size)
        pysm = np.max(abs(peer.get_emission(217 * u.GHz).value * one_rj - out) / size) if with_pysm3 else 0.0
        assert worst < 1e-12 and pysm < 1e-9, (worst, pysm)
        out = np.zeros((3, npix))
        for nu in TEN:
            numpy_add(layers, nu, 0.1, out)
        ours.ask("band", 1, "best", *TEN)
        band = np.max(abs(result_of(3) - out) / size)
        pysm_band = np.max(abs(peer.get_emission(TEN * u.GHz, power).value * to_rj - out) / size) if with_pysm3 else 0.0
        assert band < 1e-12 and pysm_band < 1e-9, (band, pysm_band)
        ours.ask("list", 1, "best", *TEN)
        sums = np.zeros((len(TEN), 3, npix))
        ten = result_of(30).reshape(sums.shape)
        for nu, o, x in zip(TEN, sums, ten):
            numpy_add(layers, nu, 1.0, o)
            assert np.max(abs(x - o) / size) < 1e-12
        del ten

        def numpy_list(frequencies):
            for nu, o in zip(frequencies, sums):
                o.fill(0.0)
                numpy_add(layers, nu, 1.0, o)

        def numpy_band():
            sums[0].fill(0.0)
            for nu in TEN:
                numpy_add(layers, nu, 0.1, sums[0])

        def pysm_run(threads, *arguments):
            numba.set_num_threads(threads)
            peer.get_emission(*arguments)

        jobs = {
            ("one", "numpy", 1): lambda: timed(lambda: numpy_list([217.0])),
            ("ten", "numpy", 1): lambda: timed(lambda: numpy_list(TEN)),
            ("band10", "numpy", 1): lambda: timed(numpy_band),
        }
        for threads in sorted({1, THREADS}):
            for level in ("best", "avx2"):
                jobs["one", level, threads] = lambda a=threads, b=level: ours.ask("list", a, b, 217.0)["ms"]
                jobs["ten", level, threads] = lambda a=threads, b=level: ours.ask("list", a, b, *TEN)["ms"]
                jobs["band10", level, threads] = lambda a=threads, b=level: ours.ask("band", a, b, *TEN)["ms"]
            if with_pysm3:
                jobs["one", "pysm3", threads] = lambda a=threads: timed(lambda: pysm_run(a, 217 * u.GHz))
                jobs["band10", "pysm3", threads] = lambda a=threads: timed(lambda: pysm_run(a, TEN * u.GHz, power))
        best = {}
        for _ in range(options.rounds):
            for key, job in jobs.items():
                best[key] = min(best.get(key, np.inf), job())
        name = ours.ask("list", 1, "best", 217.0)["level"]

    cpu = next((l.split(":")[1].strip() for l in open("/proc/cpuinfo") if l.startswith("model name")), platform.processor())
    print(f"{cpu}; numpy {np.__version__}, pysm3 {pysm3.__version__}; Nside {options.nside}, {LAYERS} layers, best of {options.rounds}")
    print(f"largest difference from numpy {worst:.1e} (one), {band:.1e} (band)")
    print(f"{'job':8} {'threads':>7} {'program':8} {'ns/evaluation':>14} {'ratio to ours':>14}")
    for job, frequencies in (("one", 1), ("ten", 10), ("band10", 10)):
        for threads in sorted({1, THREADS}):
            for program in ("best", "avx2", "numpy", "pysm3"):
                if (job, program, threads) in best:
                    ms = best[job, program, threads]
                    label = name if program == "best" else program
                    print(f"{job:8} {threads:7} {label:8} {ms * 1e6 / npix / LAYERS / frequencies:14.3f} {ms / best[job, 'best', threads]:14.2f}")


if __name__ == "__main__":
    main()
