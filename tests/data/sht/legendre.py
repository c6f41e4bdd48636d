"""Normalised Legendre functions and polarisation harmonics at single points, 50 digits and more.

Writes legendre.txt: l m theta lambda X1 X2. theta is the exact value of the f64 printed.
Run: python legendre.py > legendre.txt   (mpmath 1.4.1)
"""
from mpmath import mp, mpf, sqrt, pi, sin, cos, nstr

mp.dps = 160


def functions(l, m, theta):
    """lambda_lm, X1, X2 by upward recurrence from l = m at 160 digits (X1, X2 lose 2 log10(1/theta) of them)."""
    x, s = cos(theta), sin(theta)
    value = sqrt(1 / (4 * pi))
    for k in range(1, m + 1):
        value *= -s * sqrt(mpf(2 * k + 1) / (2 * k))
    eps = lambda k: sqrt(mpf(k * k - m * m) / (4 * k * k - 1))
    before = mpf(0)
    for k in range(m, l):
        value, before = (x * value - eps(k) * before) / eps(k + 1), value
    n = 2 / sqrt(mpf((l + 2) * (l + 1) * l * (l - 1)))
    x1 = n * (-((l - m * m) / s**2 + mpf(l * (l - 1)) / 2) * value + (2 * l + 1) * eps(l) * x / s**2 * before)
    x2 = n * m / s**2 * (-(l - 1) * x * value + (2 * l + 1) * eps(l) * before)
    return value, x1, x2


print("# mpmath, 160 digits; see legendre.py. Columns: l m theta lambda_lm X1_lm X2_lm")
cases = [(l, m, t) for l in (4096,) for m in (0, 1, 2, 3, 10, 100, 1000, 3500)
         for t in (1e-11, 1e-9, 1e-7, 1e-5, 1e-3, 3e-3, 0.03, 0.3, 0.7, 0.9, 1.3, 1.5703)]
cases += [(8192, 8192, t) for t in (1.3, 1.5, 1.5703, 0.9, 1e-3)] + [(8192, 8000, t) for t in (1.3, 1.4, 1.5)]
cases += [(2, 0, 1e-11), (2, 2, 1e-3), (5, 1, 0.5), (64, 63, 1.0), (65, 2, 1e-5)]
for l, m, t in cases:
    print(l, m, repr(t), *(nstr(v, 20) if abs(v) > mpf(10) ** -300 else "0" for v in functions(l, m, mpf(t))))
