#!/usr/bin/env python3
"""Minimax polynomials of the vector mathematics (kernels/src/simd/math.rs, kernels/src/simd/atan.rs).

Remez exchange in 60-digit arithmetic; the coefficients are rounded to f64 and the largest relative error of the
*rounded* polynomial over the interval is printed with them.

    python3 polynomials.py > polynomials.txt        (needs mpmath)
"""
from mpmath import mp, mpf

mp.dps = 60


def solve(target, weight, lo, hi, degree):
    """Coefficients p minimising max |weight(z) (p(z) - target(z))| over [lo, hi]."""
    n = degree + 2
    mid, half = (hi + lo) / 2, (hi - lo) / 2
    nodes = [mid - half * mp.cos(mp.pi * (2 * i + 1) / (2 * n)) for i in range(n)]
    for _ in range(30):
        a, b = mp.matrix(n, n), mp.matrix(n, 1)
        for i, z in enumerate(nodes):
            for j in range(degree + 1):
                a[i, j] = z**j
            a[i, degree + 1] = (-1) ** i / weight(z)
            b[i] = target(z)
        solution = mp.lu_solve(a, b)
        p = [solution[j] for j in range(degree + 1)]
        level = abs(solution[degree + 1])

        def error(z):
            return weight(z) * (mp.polyval(p[::-1], z) - target(z))

        grid = [mid - half * mp.cos(mp.pi * (i + mpf("0.5")) / (40 * n)) for i in range(40 * n)]
        values = [error(z) for z in grid]
        peaks = []
        for i, (z, v) in enumerate(zip(grid, values)):
            left = values[i - 1] if i else mpf(0)
            right = values[i + 1] if i + 1 < len(grid) else mpf(0)
            if abs(v) >= abs(left) and abs(v) >= abs(right) or (v > 0) != (left > 0) and abs(v) >= abs(right):
                if peaks and (peaks[-1][1] > 0) == (v > 0):
                    if abs(v) > abs(peaks[-1][1]):
                        peaks[-1] = (z, v)
                else:
                    peaks.append((z, v))
        while len(peaks) > n:
            peaks.pop(0 if abs(peaks[0][1]) < abs(peaks[-1][1]) else -1)
        if len(peaks) < n:
            break
        nodes = [z for z, _ in peaks]
        if max(abs(v) for _, v in peaks) < level * mpf("1.0001"):
            break
    return p


def report(name, target, weight, lo, hi, degree):
    p = [mpf(float(c)) for c in solve(target, weight, lo, hi, degree)]
    worst = max(
        abs(weight(z) * (mp.polyval(p[::-1], z) - target(z)))
        for z in (lo + (hi - lo) * (i + mpf("0.37")) / 2000 for i in range(2000))
    )
    print(f"{name}: degree {degree} on [{mp.nstr(lo, 8)}, {mp.nstr(hi, 8)}], error {mp.nstr(worst, 3)}")
    for c in p:
        print(f"    {float(c)!r},")


def safe(f, series):
    """f away from zero, its Taylor coefficients where it cancels."""
    return lambda z: f(z) if abs(z) > mpf("1e-6") else mp.polyval(series[::-1], z)


h = mp.log(2) / 2 * mpf("1.0001")
report(
    "exp: (e^r - 1 - r)/r^2, relative to e^r - 1 (weight |r| exp(-r/2), at least h/50)",
    safe(lambda r: (mp.expm1(r) - r) / r**2, [1 / mp.factorial(k + 2) for k in range(8)]),
    lambda r: max(abs(r), h / 50) * mp.exp(-r / 2),
    -h, h, 9,
)
ln2 = mp.log(2)
report(
    "exp2: (2^r - 1 - r ln 2)/r^2, relative to 2^r - 1 (weight |r| 2^(-r/2), at least 1/100)",
    safe(lambda r: (mp.expm1(r * ln2) - r * ln2) / r**2, [ln2 ** (k + 2) / mp.factorial(k + 2) for k in range(8)]),
    lambda r: max(abs(r), mpf("0.01")) * mp.exp(-r * ln2 / 2) / ln2,
    mpf("-0.50005"), mpf("0.50005"), 9,
)
z = ((mp.sqrt(2) - 1) / (mp.sqrt(2) + 1)) ** 2 * mpf("1.0001")
report(
    "ln: (ln((1+s)/(1-s)) - 2s)/s^3 in z = s^2, relative to ln",
    safe(lambda z: (2 * mp.atanh(mp.sqrt(z)) / mp.sqrt(z) - 2) / z, [mpf(2) / (2 * k + 3) for k in range(8)]),
    lambda z: max(z, mpf("1e-4")) / 2,
    mpf(0), z, 6,
)
report(
    "pow: (ln((1+s)/(1-s)) - 2s - 2/3 s^3)/s^5 in z = s^2, relative to ln",
    safe(lambda z: (2 * mp.atanh(mp.sqrt(z)) / mp.sqrt(z) - 2 - 2 * z / 3) / z**2,
         [mpf(2) / (2 * k + 5) for k in range(12)]),
    lambda z: max(z, mpf("1e-3")) ** 2 / 2,
    mpf(0), z, 7,
)
q = (mp.pi / 4) ** 2 * mpf("1.0001")
report(
    "sin: (sin r - r)/r^3 in z = r^2, relative to sin",
    safe(lambda z: (mp.sin(mp.sqrt(z)) / mp.sqrt(z) - 1) / z,
         [(-1) ** (k + 1) / mp.factorial(2 * k + 3) for k in range(8)]),
    lambda z: z * mp.sqrt(z) / mp.sin(mp.sqrt(z)) if z > mpf("1e-3") else mpf("1e-3"),
    mpf(0), q, 5,
)
report(
    "cos: (cos r - 1 + r^2/2)/r^4 in z = r^2, relative to cos",
    safe(lambda z: (mp.cos(mp.sqrt(z)) - 1 + z / 2) / z**2,
         [(-1) ** k / mp.factorial(2 * k + 4) for k in range(8)]),
    lambda z: max(z, mpf("1e-3")) ** 2 / mp.cos(mp.sqrt(z)),
    mpf(0), q, 5,
)
report(
    "asin: (asin x - x)/x^3 in z = x^2, relative to asin",
    safe(lambda z: (mp.asin(mp.sqrt(z)) - mp.sqrt(z)) / mp.sqrt(z) ** 3,
         [mp.binomial(2 * k, k) / (4**k * (2 * k + 1)) for k in range(1, 9)]),
    lambda z: max(z, mpf("1e-6")),
    mpf(0), mpf("0.50005"), 17,
)
report(
    "rough asin: the same, shorter",
    safe(lambda z: (mp.asin(mp.sqrt(z)) / mp.sqrt(z) - 1) / z,
         [mp.binomial(2 * k, k) / (4**k * (2 * k + 1)) for k in range(1, 9)]),
    lambda z: max(z, mpf("1e-9")) * (mp.sqrt(z) / mp.asin(mp.sqrt(z)) if z else 1),
    mpf(0), mpf("0.5"), 10,
)
report(
    "atan: (atan x - x)/x^3 in z = x^2, relative to atan",
    safe(lambda z: (mp.atan(mp.sqrt(z)) - mp.sqrt(z)) / mp.sqrt(z) ** 3,
         [mpf((-1) ** k) / (2 * k + 1) for k in range(1, 9)]),
    lambda z: max(z, mpf("1e-6")),
    mpf(0), mp.tan(mp.pi / 8) ** 2 * mpf("1.0001"), 10,
)


def parts(name, value, bits):
    """value as a sum of f64, all but the last with so many significant bits."""
    out, rest = [], value
    for b in bits:
        e = mp.floor(mp.log(abs(rest), 2))
        scale = mpf(2) ** (b - 1 - e)
        part = mp.floor(rest * scale) / scale
        out.append(float(part))
        rest -= part
    out.append(float(rest))
    print(name, ", ".join(repr(x) for x in out), " hex:", ", ".join(x.hex() for x in out))


parts("ln 2 (32 bits + rest):", mp.log(2), [32])
parts("log2 e (f64 + rest):", 1 / mp.log(2), [53])
parts("pi/2 (33 + 33 + 33 bits + rest):", mp.pi / 2, [33, 33, 33])
parts("2/pi:", 2 / mp.pi, [53])
parts("2/3:", mpf(2) / 3, [53])
hok = mpf("6.62607015e-34") * 10**9 / mpf("1.380649e-23")
parts("h/k in K/GHz (f64 + rest):", hok, [53])
