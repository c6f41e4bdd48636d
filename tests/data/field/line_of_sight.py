"""Line-of-sight ratios Q_m/I_m, U_m/I_m in 30-digit arithmetic.

python line_of_sight.py > line_of_sight.txt

Straight from the definitions (MKD18, sections 3.2 and 4.2, polarisation perpendicular to B_perp): positions and the
field as vectors, Gauss-Legendre by mpmath over pieces cut at the hole, at the tangent points, and ever closer to the
density peak and to the point nearest to the axis.
"""

import random

import mpmath as mp

mp.mp.dps = 30
SUN, HOLE, P0 = mp.mpf(8.5), mp.mpf(1), mp.mpf("0.2")


def ratios(lon, lat, near, far, pitch, k, h_r, h_z):
    lon, lat, near, far, pitch, k, h_r, h_z = map(mp.mpf, (lon, lat, near, far, pitch, k, h_r, h_z))
    sl, cl, sb, cb = mp.sin(lon), mp.cos(lon), mp.sin(lat), mp.cos(lat)
    if lat == 0:
        sb, cb = mp.mpf(0), mp.mpf(1)
    south, east = (sb * cl, sb * sl, -cb), (-sl, cl, mp.mpf(0))

    def at(r):
        return r * cb * cl - SUN, r * cb * sl, r * sb

    def ln_n(r):
        x, y, z = at(r)
        return -mp.hypot(x, y) / h_r - 2 * mp.log(mp.cosh(abs(z) / h_z))

    a, b = near, far
    for _ in range(150):
        c, d = b - (b - a) * mp.mpf("0.618"), a + (b - a) * mp.mpf("0.618")
        a, b = (a, d) if ln_n(c) > ln_n(d) else (c, b)
    peak = max((near, far, (a + b) / 2), key=ln_n)
    top = ln_n(peak)

    def integrand(r):
        n = mp.exp(ln_n(r) - top)
        x, y, _ = at(r)
        radius = mp.hypot(x, y)
        if radius <= HOLE:
            return mp.matrix([n, 0, 0])
        theta = mp.atan2(y, x)
        field = (
            mp.sin(pitch) * mp.cos(theta) + mp.cos(pitch) * mp.sin(theta),
            mp.sin(pitch) * mp.sin(theta) - mp.cos(pitch) * mp.cos(theta),
        )
        b_south = field[0] * south[0] + field[1] * south[1]
        b_east = field[0] * east[0] + field[1] * east[1]
        across = mp.hypot(b_south, b_east)
        if across == 0:
            return mp.matrix([n, 0, 0])
        p = P0 * n * across ** (k - 2)
        return mp.matrix([n, p * (b_east**2 - b_south**2), -2 * p * b_south * b_east])

    nearest = SUN * cl / cb
    cuts = {near, far, peak}
    reach = HOLE**2 - (SUN * sl) ** 2
    if reach > 0:
        cuts |= {nearest - mp.sqrt(reach) / cb, nearest + mp.sqrt(reach) / cb}
    chi = mp.pi / 2 - pitch
    tangent = (SUN * sl * mp.cot(chi) + SUN * cl) / cb
    step = far - near
    for _ in range(24):
        step /= 2
        cuts |= {c + s * step for c in (peak, nearest, tangent) for s in (-1, 1)}
    cuts = sorted(c for c in cuts | {nearest, tangent} if near <= c <= far)
    # 24 nodes on each piece: pieces halve towards everything sharp.
    total = mp.matrix([0, 0, 0])
    for lo, hi in zip(cuts, cuts[1:]):
        centre, half = (lo + hi) / 2, (hi - lo) / 2
        if ln_n(lo) < top - 80 and ln_n(hi) < top - 80:
            continue
        for x, w in NODES:
            total += half * w * integrand(centre + half * x)
    return total[1] / total[0], total[2] / total[0]


def rule(n):
    """Nodes and weights of the n-point Gauss-Legendre rule, Newton on the recurrence."""
    nodes = []
    for i in range(1, n + 1):
        x = mp.cos(mp.pi * (i - mp.mpf("0.25")) / (n + mp.mpf("0.5")))
        for _ in range(8):
            before, value = mp.mpf(1), x
            for m in range(2, n + 1):
                before, value = value, ((2 * m - 1) * x * value - (m - 1) * before) / m
            slope = n * (before - x * value) / (1 - x * x)
            x -= value / slope
        nodes.append((x, 2 / ((1 - x * x) * slope**2)))
    return nodes


NODES = rule(24)
EDGES = [0.0] + [10 ** (mu / 5 + 1) / 1000 for mu in (4, 7, 10, 13, 16, 19)]

if __name__ == "__main__":
    print(f"# mpmath {mp.__version__}, 30 digits; lon lat (rad) near far (kpc) pitch (rad) k h_r h_z (kpc) Q/I U/I")
    random.seed(1)
    sky = [(0.0, 0.0), (3.0, 0.0), (0.05, 0.0), (0.11, 1e-3), (0.13, 0.0), (0.7, 0.0), (4.7, -0.06), (0.11, -0.02)]
    sky += [(1.0, 1.5), (2.0, -1.2), (5.5, 0.35), (0.02, 1.0), (3.1415, 1e-5), (1.57, 0.3)]
    sky += [(random.uniform(0, 6.28), random.uniform(-1.5, 1.5)) for _ in range(6)]
    rows = [(lon, lat, i, -33.0, 3.0, 3.0, 0.1) for lon, lat in sky for i in range(6)]
    rows += [(lon, lat, i, q, k, 3.0, 0.1) for lon, lat in sky[2:8] for i, q, k in
             ((3, -11.5, 3.0), (4, -60.0, 2.0), (4, -5.0, 1.0), (3, -45.0, 0.0), (5, 20.0, 2.5), (4, 90.0, 4.0))]
    rows += [(lon, lat, 4, -33.0, 3.0, 0.3, 0.02) for lon, lat in sky[:8]]
    for lon, lat, i, q, k, h_r, h_z in rows:
        row = (lon, lat, EDGES[i], EDGES[i + 1], q * 0.017453292519943295, k, h_r, h_z)
        values = ratios(*row)
        print(*map(repr, row), *(mp.nstr(v, 20) for v in values))
