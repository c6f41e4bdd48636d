#!/usr/bin/env python3
"""HEALPix operations on one thread: ours, healpy and ducc0, in one run, alternating.

    pip install numpy healpy ducc0
    python3 benches/peers/healpix.py [--nsides 64 2048 1048576] [--points 262144] [--rounds 5] [--level best] [--only ang2pix]

Builds and runs `cargo run --release -p dust3d-benches --example healpix_peer`. Random directions and pixels, each program's
arrays in its own layout, made beforehand; ducc0 writes into arrays given to it, healpy makes its own. Every round times
every program (best of a few calls); the best of all rounds counts. Results are compared before any timing: numbers of
pixels are equal (for a direction within the rounding of an edge, equal to the peer's for a direction a few units in the
last place away), coordinates to 1e-14, weights to the rounding of the input. Whole maps at Nside 2048 at most; discs by
the number of pixels healpy has to list.
"""
import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import argparse
import json
import pathlib
import platform
import subprocess
import tempfile
import time

import ducc0
import healpy as hp
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Degrees; healpy lists pixels, so only where they are few.
RADII = {64: (10.0, 60.0), 2048: (1.0, 10.0, 60.0), 1 << 20: (0.02, 0.2)}
ORDERS = ("ring", "nested")


class Ours:
    """Our kernels behind a pipe."""

    def __init__(self):
        subprocess.run(["cargo", "build", "-q", "--release", "-p", "dust3d-benches", "--example", "healpix_peer"], cwd=ROOT, check=True)
        target = os.environ.get("CARGO_TARGET_DIR", ROOT / "target")
        self.process = subprocess.Popen([str(pathlib.Path(target) / "release/examples/healpix_peer")],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, *words):
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())


def best_ms(run, repeats):
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times) * 1e3


def same_pixels(ours, theirs, perturbed):
    """Equal, or equal to the peer's answer for a direction a few units in the last place away."""
    for k in np.flatnonzero(ours != theirs):
        assert ours[k] in perturbed(k), (k, ours[k], theirs[k])
    return int(np.count_nonzero(ours != theirs))


def around(*numbers):
    """Numbers and their neighbours, 4 units in the last place away, in all combinations."""
    return np.stack(np.meshgrid(*[[x - 4 * np.spacing(x), x, x + 4 * np.spacing(x)] for x in numbers])).reshape(len(numbers), -1)


def same_weights(ours, theirs, tolerance):
    """Stencils as sparse rows: pixels with a weight beyond the tolerance are the same, with the same weight."""
    (pixels, weights), (peer_pixels, peer_weights) = ours, theirs
    plain = np.all(pixels == peer_pixels, axis=0)
    worst = np.max(abs(weights - peer_weights)[:, plain])
    assert worst < tolerance, (worst, tolerance)
    for k in np.flatnonzero(~plain):
        sums = {}
        for pixel, weight in zip([*pixels[:, k], *peer_pixels[:, k]], [*weights[:, k], *-peer_weights[:, k]]):
            sums[pixel] = sums.get(pixel, 0.0) + weight
        assert max(map(abs, sums.values())) < tolerance, (k, pixels[:, k], peer_pixels[:, k], sums)
    return int(np.count_nonzero(~plain))


def joined(ranges):
    """Ranges with touching ones joined."""
    ranges = np.asarray(ranges, np.int64).reshape(-1, 2)
    starts = np.concatenate([[True], ranges[1:, 0] != ranges[:-1, 1]])
    ends = np.concatenate([starts[1:], [True]])
    return np.stack([ranges[starts, 0], ranges[ends, 1]], axis=1)


class Points:
    """Random directions and pixels of one resolution, in every program's layout; jobs on them."""

    def __init__(self, ours, nside, count, folder):
        self.ours, self.nside, self.count, self.folder = ours, nside, count, folder
        rng = np.random.default_rng(nside)
        self.theta, self.phi = np.arccos(rng.uniform(-1, 1, count)), rng.uniform(0, 2 * np.pi, count)
        self.xyz = np.ascontiguousarray(hp.ang2vec(self.theta, self.phi).T)
        self.ring = rng.integers(0, 12 * nside**2, count)
        self.pixels = {"ring": self.ring, "nested": hp.ring2nest(nside, self.ring)}
        self.ang, self.vec = np.stack([self.theta, self.phi], axis=1), np.ascontiguousarray(self.xyz.T)
        self.bases = {"ring": ducc0.healpix.Healpix_Base(nside, "RING"), "nested": ducc0.healpix.Healpix_Base(nside, "NEST")}
        self.out = {kind: np.zeros((count, k) if k > 1 else count, t) for kind, k, t in
                    (("pixels", 1, np.int64), ("ang", 2, float), ("vec", 3, float), ("eight", 8, np.int64))}
        for name, array in (("theta", self.theta), ("phi", self.phi), *zip("xyz", self.xyz), *self.pixels.items()):
            array.tofile(folder / name)
        ours.ask("points", nside, folder)

    def peers(self, what, order):
        nside, nest, base, pixels = self.nside, order == "nested", self.bases[order], self.pixels[order]
        ang, vec, out = self.ang, self.vec, self.out
        return {
            "ang2pix": (lambda: hp.ang2pix(nside, self.theta, self.phi, nest=nest), lambda: base.ang2pix(ang, out=out["pixels"])),
            "vec2pix": (lambda: hp.vec2pix(nside, *self.xyz, nest=nest), lambda: base.vec2pix(vec, out=out["pixels"])),
            "pix2ang": (lambda: hp.pix2ang(nside, pixels, nest=nest), lambda: base.pix2ang(pixels, out=out["ang"])),
            "pix2vec": (lambda: hp.pix2vec(nside, pixels, nest=nest), lambda: base.pix2vec(pixels, out=out["vec"])),
            "reorder_pixels": ((lambda: hp.nest2ring(nside, pixels), lambda: base.nest2ring(pixels, out=out["pixels"])) if nest else
                               (lambda: hp.ring2nest(nside, pixels), lambda: base.ring2nest(pixels, out=out["pixels"]))),
            "neighbours": (lambda: hp.get_all_neighbours(nside, pixels, nest=nest), lambda: base.neighbors(pixels, out=out["eight"])),
            "interpolation": (lambda: hp.get_interp_weights(nside, self.theta, self.phi, nest=nest), None),
        }[what]

    def results(self, what, order, level):
        self.ours.ask("time", what, order, level, 1)
        self.ours.ask("write", self.folder)
        pixels = np.stack([np.fromfile(self.folder / f"p{k}", np.int64) for k in range(8)])
        return pixels, np.stack([np.fromfile(self.folder / f"f{k}") for k in range(4)])

    def check(self, what, order, level):
        """Compares the results; says how many differ by rounding at an edge."""
        nside, nest = self.nside, order == "nested"
        pixels, numbers = self.results(what, order, level)
        healpy, ducc = self.peers(what, order)
        if what == "ang2pix":
            near = lambda k: hp.ang2pix(nside, *around(self.theta[k], self.phi[k]), nest=nest)
            same_pixels(pixels[0], ducc(), near)
            return same_pixels(pixels[0], healpy(), near)
        if what == "vec2pix":
            near = lambda k: hp.vec2pix(nside, *around(*self.xyz[:, k]), nest=nest)
            same_pixels(pixels[0], ducc(), near)
            return same_pixels(pixels[0], healpy(), near)
        if what in ("pix2ang", "pix2vec"):
            k = 2 if what == "pix2ang" else 3
            assert np.max(abs(numbers[:k] - np.array(healpy()))) < 1e-14
            assert np.max(abs(numbers[:k] - ducc().T)) < 1e-14
        elif what == "reorder_pixels":
            assert np.array_equal(pixels[0], healpy()) and np.array_equal(pixels[0], ducc())
        elif what == "neighbours":
            assert np.array_equal(pixels, healpy()) and np.array_equal(pixels, ducc().T)
        else:
            return same_weights((pixels[:4], numbers), healpy(), 4e-15 * nside + 1e-14)
        return 0


class Maps:
    """Whole maps of one resolution."""

    def __init__(self, ours, nside, folder):
        self.ours, self.nside, self.folder, self.out_nside = ours, nside, folder, nside // 4
        pixels = np.arange(12 * nside**2, dtype=np.uint64)
        self.map = ((pixels * np.uint64(2654435761)) & np.uint64(0xFFFFFFFF)).astype(float) / 4294967296.0
        self.numbers = pixels.astype(np.int64)
        self.base = ducc0.healpix.Healpix_Base(nside, "RING")
        ours.ask("map", nside, self.out_nside)

    def peers(self, what, order):
        if what == "degrade":
            return lambda: hp.ud_grade(self.map, self.out_nside), None
        # The map is in `order`; each pixel of the result asks where it was.
        numbers_of = self.base.ring2nest if order == "nested" else self.base.nest2ring
        healpy = lambda: hp.reorder(self.map, n2r=order == "nested", r2n=order == "ring")
        return healpy, lambda: self.map[numbers_of(self.numbers)]

    def check(self, what, order, level):
        self.ours.ask("time", what, order, level, 1)
        self.ours.ask("write", self.folder)
        ours = np.fromfile(self.folder / "map")
        healpy, ducc = self.peers(what, order)
        if what == "degrade":
            assert np.max(abs(ours - healpy())) < 1e-14
        else:
            assert np.array_equal(ours, healpy()) and np.array_equal(ours, ducc())
        return 0


class Discs:
    """Discs around some of the points."""

    def __init__(self, points, radius):
        self.points, self.radius = points, np.radians(radius)
        self.vec, self.ang = points.vec[::8192].copy(), points.ang[::8192].copy()
        self.listed = points.nside**2 * self.radius**2 < 1e7

    def peers(self, what, order):
        nside, nest, base = self.points.nside, order == "nested", self.points.bases[order]

        def healpy():
            # One at a time: lists of pixels are long.
            for v in self.vec:
                hp.query_disc(nside, v, self.radius, nest=nest)

        def ducc():
            for a in self.ang:
                base.query_disc(a, self.radius)

        return healpy if self.listed else None, ducc

    def check(self, what, order, level):
        self.points.ours.ask("discs", self.radius, order, level, 1)
        self.points.ours.ask("write", self.points.folder)
        ours = np.fromfile(self.points.folder / "ranges", np.int64).reshape(-1, 2)
        theirs = np.concatenate([self.points.bases[order].query_disc(a, self.radius) for a in self.ang])
        pixels, peer = (np.sum(r[:, 1] - r[:, 0]) for r in (ours, theirs))
        # A centre on the rim may fall on either side.
        ours, theirs = joined(ours), joined(theirs)
        differ = np.count_nonzero(~np.isin(ours[:, 0], theirs[:, 0])) + np.count_nonzero(~np.isin(ours[:, 1], theirs[:, 1]))
        assert abs(pixels - peer) <= differ <= 1e-5 * len(ours), (pixels, peer, differ)
        return differ


def run(options, ours, folder):
    rows = []
    for nside in options.nsides:
        jobs = []
        points = Points(ours, nside, options.points, folder)
        for what in ("ang2pix", "pix2ang", "vec2pix", "pix2vec", "reorder_pixels", "neighbours", "interpolation"):
            name = {"reorder_pixels": ("ring2nest", "nest2ring")}.get(what, (f"{what} ring", f"{what} nested"))
            for order, label in zip(ORDERS, name):
                jobs.append((label, points, what, order, options.points, ("time", what, order)))
        if nside <= 2048:
            maps = Maps(ours, nside, folder)
            for what, order, label in (("reorder_map", "ring", "map to nested"), ("reorder_map", "nested", "map to ring"),
                                       ("degrade", "ring", f"degrade to {maps.out_nside}")):
                jobs.append((label, maps, what, order, 12 * nside**2, ("time", what, order)))
        for radius in RADII.get(nside, (1.0,)):
            discs = Discs(points, radius)
            for order in ORDERS:
                jobs.append((f"disc {radius:g}\N{DEGREE SIGN} {order}", discs, "disc", order, None, ("discs", discs.radius, order)))
        for label, data, what, order, count, request in jobs:
            if options.only and options.only not in label:
                continue
            differ = data.check(what, order, options.level)
            answer = ours.ask(*request, options.level, 1)
            repeats = max(1, min(200, int(20 / max(answer["ms"], 1e-3))))
            peers = data.peers(what, order)
            times = [float("inf")] * 3
            for _ in range(options.rounds):
                times[0] = min(times[0], ours.ask(*request, options.level, repeats)["ms"])
                for k, peer in enumerate(peers, 1):
                    if peer is not None:
                        times[k] = min(times[k], best_ms(peer, max(1, repeats // 20)))
            units = count if count is not None else len(data.vec)
            rate = [units / t * (1e-3 if count is not None else 1e-0) for t in times]
            best = min(times[1:])
            unit = "M/s" if count is not None else "discs/ms"
            rows.append((nside, label, best / times[0]))
            print(f"{nside:8} {label:20} {unit:8} {rate[0]:9.4g} " + " ".join(f"{r:9.4g}" if r > 0 else f"{'':9}" for r in rate[1:])
                  + f" {best / times[0]:8.2f} {differ or '':>7}", flush=True)
    return rows


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--nsides", type=int, nargs="+", default=[64, 2048, 1 << 20])
    parser.add_argument("--points", type=int, default=1 << 18)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--level", default="best")
    parser.add_argument("--only", help="jobs whose name contains this")
    options = parser.parse_args()
    cpu = next((l.split(":")[1].strip() for l in open("/proc/cpuinfo") if l.startswith("model name")), platform.processor())
    with tempfile.TemporaryDirectory() as folder:
        ours = Ours()
        print(f"{cpu}; healpy {hp.__version__}, ducc0 {ducc0.__version__}; {options.points} points, 1 thread, best of {options.rounds}")
        print(f"{'nside':>8} {'operation':20} {'':8} {'ours':>9} {'healpy':>9} {'ducc0':>9} {'ratio':>8} {'at edges':>8}")
        rows = run(options, ours, pathlib.Path(folder))
    if rows:
        least = min(rows, key=lambda row: row[2])
        print(f"{sum(r[2] >= 5 for r in rows)} of {len(rows)} at 5 or more; least {least[2]:.2f}: {least[1]} at Nside {least[0]}")


if __name__ == "__main__":
    main()
