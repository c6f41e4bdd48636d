"""Wigner 3j symbols (j l2 l3; 0 m -m) from Racah's sum in integer arithmetic: columns l2 l3 m j value."""
from fractions import Fraction
from math import factorial as f

import mpmath

mpmath.mp.dps = 40


def symbol(j, l2, l3, m):
    # Racah's formula for (a b c; 0 m -m); the sum is a fraction, the root is taken at the end.
    a, b, c = j, l2, l3
    total = Fraction(0)
    for k in range(0, a + b + c + 1):
        terms = [k, c - b + k, c - a + k - m, a + b - c - k, a - k, b + m - k]
        if min(terms) < 0:
            continue
        denominator = 1
        for term in terms:
            denominator *= f(term)
        total += Fraction((-1) ** k, denominator)
    if total == 0:
        return mpmath.mpf(0)
    square = Fraction(f(a + b - c) * f(a - b + c) * f(-a + b + c), f(a + b + c + 1))
    square *= f(a) * f(a) * f(b + m) * f(b - m) * f(c - m) * f(c + m)
    square *= total * total
    sign = (-1) ** (a - b + m) * (1 if total > 0 else -1)
    return sign * mpmath.sqrt(mpmath.mpf(square.numerator) / mpmath.mpf(square.denominator))


for l2, l3 in [(0, 0), (1, 1), (1, 4), (2, 2), (2, 3), (2, 100), (3, 2), (5, 5), (7, 12), (30, 31), (64, 64), (100, 3), (90, 150), (200, 200)]:
    for m in (0, 2):
        if m > min(l2, l3):
            continue
        first, last = abs(l2 - l3), l2 + l3
        js = sorted({first, first + 1, first + 2, (first + last) // 2, (first + last) // 2 + 1, last - 2, last - 1, last})
        for j in js:
            if first <= j <= last:
                print(l2, l3, m, j, mpmath.nstr(symbol(j, l2, l3, m), 20, min_fixed=0, max_fixed=0))
