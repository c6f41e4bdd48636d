#!/usr/bin/env python3
"""Reference vectors of the vector mathematics: exp, expm1, ln, sin, cos, pow of f64 arguments in 200-bit arithmetic.

    python3 vectors.py          (needs mpmath; writes exp.txt … pow.txt beside itself)

Each row is the arguments and the value, the value as an f64 and what that lacks, so that errors can be measured to a
fraction of an ulp. Arguments are drawn with a fixed seed; the edges of every interval are among them.
"""
import os
import random
import sys
from mpmath import mp, mpf

mp.prec = 200
here = os.path.dirname(os.path.abspath(__file__))
random.seed(20180601)


def write(name, function, arguments):
    with open(os.path.join(here, name + ".txt"), "w") as f:
        for a in arguments:
            a = a if isinstance(a, tuple) else (a,)
            value = function(*[mpf(x) for x in a])
            if abs(value) > mpf(sys.float_info.max) or value != 0 and abs(value) < mpf("1e-300"):
                continue
            hi = float(value)
            f.write(" ".join(repr(x) for x in a) + f" {hi!r} {float(value - mpf(hi))!r}\n")


def log_uniform(lo, hi, n, sign=False):
    out = [10 ** random.uniform(lo, hi) for _ in range(n)]
    return [random.choice((-1, 1)) * x for x in out] if sign else out


ln2 = float(mp.log(2))
write("exp", mp.exp, [0.0, 1.0, -1.0, 709.7, -690.0, ln2 / 2, -ln2 / 2, 3 * ln2 / 2]
      + [random.uniform(-690, 709) for _ in range(300)] + [random.uniform(-2, 2) for _ in range(300)]
      + log_uniform(-18, 0, 100, True))
write("expm1", mp.expm1, [1.0, -1.0, 709.7, -690.0, ln2 / 2, -ln2 / 2, 3 * ln2 / 2]
      + [random.uniform(-60, 709) for _ in range(200)] + [random.uniform(-2, 2) for _ in range(500)]
      + log_uniform(-300, 0, 200, True))
near = [1 + random.choice((-1, 1)) * 10 ** random.uniform(-15, -0.5) for _ in range(300)]
write("ln", mp.log, [2.0, 0.5, 1.4142135623730951, 0.7071067811865476, 5e-324, 1e-310, sys.float_info.max]
      + log_uniform(-300, 300, 300) + near + [random.uniform(0.3, 3) for _ in range(300)])
angles = ([random.uniform(-7, 7) for _ in range(400)] + [random.uniform(-1e6, 1e6) for _ in range(300)]
          + log_uniform(-12, 15, 200, True)
          + [float(k * mp.pi / 2) for k in list(range(-8, 9)) + [1000, 52174, 344, 710, 573204] if k]
          + [6381956970095103.0 * 2.0**797, 1e22])
write("sin", mp.sin, angles)
write("cos", mp.cos, angles)
powers = [(10 ** random.uniform(-3, 3), random.uniform(-5, 5)) for _ in range(300)]
powers += [(random.uniform(0.5, 2), random.uniform(-900, 900)) for _ in range(300)]
powers += [(10 ** random.uniform(-290, 290), random.uniform(-1, 1)) for _ in range(200)]
powers += [(1 + random.uniform(-1e-6, 1e-6), random.uniform(-1e8, 1e8)) for _ in range(100)]
write("pow", lambda x, y: mp.power(x, y), powers)
