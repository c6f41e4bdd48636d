"""Writes the HEALPix reference tables of this folder: python generate.py

healpy gives the pixel numbers, neighbours, weights and discs; mpmath, with 50 digits and the equations of Górski et al.
(2005), the coordinates of pixel centres and the pixels of directions a few roundings from a pixel edge.
"""

import healpy as hp
import mpmath as mp
import numpy as np

mp.mp.dps = 50
rng = np.random.default_rng(20180501)
NSIDES = [1, 2, 3, 4, 7, 8, 12, 64, 100, 1000, 2048, 2**14, 2**20, 2**20 + 7, 2**25, 2**29 - 1, 2**29]


def power(n):
    return n & (n - 1) == 0


def some_pixels(n, count):
    """Corners of the layout, then any."""
    npix, cap = 12 * n * n, 2 * n * (n - 1)
    edges = [0, 1, 2, 3, 4, 5, 11, 12, cap - 1, cap, cap + 1, cap + 4 * n - 1, cap + 4 * n, npix // 2, npix // 2 - 1]
    edges += [npix - 1 - p for p in edges]
    edges = sorted({p for p in edges if 0 <= p < npix})
    return np.array(edges + list(rng.integers(0, npix, count)))


def row(*values):
    return " ".join(repr(v) if isinstance(v, float) else str(v) for v in values)


def write(name, header, rows):
    with open(name, "w") as file:
        file.write(f"# {header}\n")
        file.writelines(r + "\n" for r in rows)


def pixels():
    rows = []
    for n in NSIDES:
        p = some_pixels(n, 12)
        nest = hp.ring2nest(n, p) if power(n) else np.full(p.size, -1)
        around = hp.get_all_neighbours(n, p)
        around_nest = hp.get_all_neighbours(n, nest, nest=True) if power(n) else np.full(around.shape, -1)
        rows += [row(n, p[i], nest[i], *around[:, i], *around_nest[:, i]) for i in range(p.size)]
    write("pixels.txt", "nside ring_pixel nested_pixel(-1: none) ring neighbours SW W NW N NE E SE S, nested neighbours", rows)


def directions():
    rows = []
    for n in NSIDES:
        theta = np.concatenate([np.arccos(rng.uniform(-1, 1, 10)), 10 ** rng.uniform(-4, -1, 2), np.pi - 10 ** rng.uniform(-4, -1, 2)])
        phi = rng.uniform(0, 2 * np.pi, theta.size)
        p = hp.ang2pix(n, theta, phi)
        nest = hp.ang2pix(n, theta, phi, nest=True) if power(n) else np.full(p.size, -1)
        # Above 2^20 the ring search of get_interp_weights, by cos θ alone, picks neighbouring rings near the poles.
        q, w = hp.get_interp_weights(n, theta, phi) if n <= 2**20 + 7 else np.zeros((2, 0, p.size))
        q = q.astype(int)
        rows += [row(n, float(theta[i]), float(phi[i]), p[i], nest[i], *q[:, i], *map(float, w[:, i])) for i in range(p.size)]
    write("directions.txt", "nside theta phi ring_pixel nested_pixel(-1: none), up to nside 2^20 + 7 four ring pixels and weights of get_interp_weights", rows)


def discs():
    rows = []
    for n in [1, 2, 4, 5, 8, 32, 64]:
        for k in range(16):
            theta, phi = float(np.arccos(rng.uniform(-1, 1))), float(rng.uniform(0, 2 * np.pi))
            if k < 3:
                theta = [0.0, float(np.pi), 1e-3][k]
            radius = float(10 ** rng.uniform(-2.5, 0.3))
            for fact in [0, 1, 4] + ([3] if not power(n) else []):
                for nest in [0, 1] if power(n) else [0]:
                    p = np.sort(hp.query_disc(n, hp.ang2vec(theta, phi), radius, inclusive=fact > 0, fact=max(fact, 1), nest=bool(nest)))
                    starts = np.concatenate([[True], np.diff(p) > 1]) if p.size else np.zeros(0, bool)
                    first = p[starts]
                    last = p[np.concatenate([starts[1:], [True]])] if p.size else p
                    if 0 < first.size < 60:
                        ranges = [v for a, b in zip(first, last) for v in (a, b + 1)]
                        rows.append(row(n, theta, phi, radius, fact, nest, *ranges))
    write("discs.txt", "nside theta phi radius fact(0: centres only) nested(0/1) then [first, end) of every run of pixels", rows)


def centre(n, ring, index):
    """(θ, φ, z, sin θ) of a pixel's centre with 50 digits."""
    n, ring, index = mp.mpf(n), mp.mpf(ring), mp.mpf(index)
    if n <= ring <= 3 * n:
        z = (4 - 2 * ring / n) / 3
        shift = 1 if (ring - n) % 2 == 0 else 0
        phi = (index + mp.mpf(shift) / 2) * mp.pi / (2 * n)
    else:
        i = ring if ring < n else 4 * n - ring
        z = 1 - i * i / (3 * n * n)
        z = z if ring < n else -z
        phi = (index + mp.mpf(1) / 2) * mp.pi / (2 * i)
    sine = mp.sqrt((1 - z) * (1 + z))
    return mp.atan2(sine, z), phi, z, sine


def centres():
    rows = []
    for n in NSIDES[::2]:
        rings = [1, 2, n - 1, n, n + 1, 2 * n - 1, 2 * n, 2 * n + 1, 3 * n, 3 * n + 1, 4 * n - 2, 4 * n - 1]
        rings += [int(v) for v in rng.integers(1, 4 * n, 6)]
        for ring in sorted({r for r in rings if 1 <= r < 4 * n}):
            length = 4 * (n if n <= ring <= 3 * n else min(ring, 4 * n - ring))
            start = sum_before(n, ring)
            for index in {0, length - 1, int(rng.integers(0, length))}:
                theta, phi, z, sine = centre(n, ring, index)
                numbers = [theta, phi, z, sine, sine * mp.cos(phi), sine * mp.sin(phi)]
                rows.append(row(n, start + index, ring, index, *[mp.nstr(v, 25) for v in numbers]))
    write("centres.txt", "nside ring_pixel ring(from 1) index theta phi z sin(theta) x y, 25 digits", rows)


def sum_before(n, ring):
    """Pixels on the rings north of this one, added up in closed form from the lengths 4i, 4n, 4i."""
    if ring <= n:
        return 2 * ring * (ring - 1)
    if ring <= 3 * n:
        return 2 * n * (n - 1) + 4 * n * (ring - n)
    south = 4 * n - ring
    return 12 * n * n - 2 * south * (south + 1)


def exact_pixel(n, theta, phi):
    """(ring pixel, distance to the nearest edge in pixels) with 50 digits."""
    t = mp.mpf(phi) * 2 / mp.pi % 4
    z = mp.cos(mp.mpf(theta))
    if abs(z) <= mp.mpf(2) / 3:
        a, b = n * (mp.mpf("0.5") + t - z * 3 / 4), n * (mp.mpf("0.5") + t + z * 3 / 4)
        ja, jb = int(mp.floor(a)), int(mp.floor(b))
        ring = 2 * n + ja - jb
        shift = 1 if (ring - n) % 2 == 0 else 0
        index = (ja + jb + 1 - n - shift) // 2 % (4 * n)
    else:
        sigma = n * mp.sqrt(3 * (1 - abs(z)))
        quarter = mp.floor(t)
        a, b = (t - quarter) * sigma, (quarter + 1 - t) * sigma
        ja, jb = int(mp.floor(a)), int(mp.floor(b))
        i = ja + jb + 1
        ring = i if z > 0 else 4 * n - i
        index = int(quarter) * i + ja
    edge = min(abs(v - mp.nint(v)) for v in (a, b))
    return sum_before(n, ring) + index, edge


def edges():
    """Directions a few roundings from an edge, where the exact pixel is still certain."""
    rows = []
    for n in [1, 2, 3, 64, 1000, 2048, 2**20, 2**29]:
        done = 0
        while done < 24:
            t = float(rng.uniform(0.01, 3.99))
            phi = t * np.pi / 2
            t = mp.mpf(phi) * 2 / mp.pi
            if done % 2 == 0 or n == 1:
                # rising edges of the belt: n (1/2 + t − 3/4 z) whole
                low, high = mp.ceil(n * t), mp.floor(n * (t + 1))
                if low > high:
                    continue
                k = low + int(rng.integers(0, int(high - low) + 1))
                z = (n * (mp.mpf("0.5") + t) - k) * 4 / (3 * n)
                if abs(z) >= mp.mpf("0.66"):
                    continue
                theta = mp.acos(z)
            else:
                within = t - mp.floor(t)
                k = int(rng.integers(1, max(2, n)))
                sigma = k / within
                if sigma >= n:
                    continue
                sine_half = sigma / n / mp.sqrt(6)
                theta = 2 * mp.asin(sine_half)
                if done % 4 == 3:
                    theta = mp.pi - theta
            theta = float(theta)
            # 8 to 32 units in the last place of whichever angle is rounded worse, to either side.
            step = max(np.spacing(theta), theta * 2e-16, np.spacing(phi) * (min(theta, np.pi - theta) if done % 2 and n > 1 else 1.0))
            theta = float(theta + rng.choice([-1, 1]) * rng.integers(8, 33) * step)
            pixel, _ = exact_pixel(n, theta, phi)
            rows.append(row(n, theta, float(phi), pixel))
            done += 1
    write("edges.txt", "nside theta phi ring_pixel: directions 8 to 32 roundings from a pixel edge", rows)


if __name__ == "__main__":
    pixels()
    directions()
    discs()
    centres()
    edges()
