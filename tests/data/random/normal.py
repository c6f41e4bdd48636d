"""Normal deviates of random words in 60-digit arithmetic.

python normal.py > normal.txt

z = Phi^-1((w + 1/2) 2^-64 + 1/2), w the word as a signed integer; solved by Newton on the complementary error function.
"""

import random

import mpmath as mp

mp.mp.dps = 60


def deviate(word):
    w = word - 2**64 if word >= 2**63 else word
    twice = 2 * w + 1
    tail = (mp.mpf(2) ** 63 - mp.mpf(abs(twice)) / 2) / mp.mpf(2) ** 64  # 1/2 - |q|
    z = mp.sqrt(2) * (mp.mpf(0) if tail > 0.49 else mp.sqrt(-mp.log(2 * tail)))
    for _ in range(100):
        step = (mp.erfc(z / mp.sqrt(2)) / 2 - tail) / mp.npdf(z)
        z += step
        if abs(step) < mp.mpf(10) ** -50 * (1 + z):
            break
    return mp.sign(twice) * z


if __name__ == "__main__":
    random.seed(1)
    words = [0, 1, 2, 3, 2**11, 2**40, 2**63 - 1, 2**63 - 2, 2**63 - 2**10, 2**63, 2**64 - 1, 2**64 - 2]
    # Both sides of |q| = 0.425 and of sqrt(-ln p) = 5.
    edge = int(0.425 * 2**64)
    far = 2**63 - int(mp.exp(-25) * 2**64)
    words += [edge - 1, edge, edge + 1, far - 1, far, far + 1]
    words += [2**63 - 1 - 2**k for k in range(0, 62, 3)] + [2**k for k in range(0, 62, 3)]
    words += [random.getrandbits(64) for _ in range(200)]
    words += [2**63 - 1 - random.getrandbits(64) % 2 ** random.randrange(1, 60) for _ in range(200)]
    print(f"# mpmath {mp.__version__}, 60 digits; word, z as a double and the rest")
    for word in words:
        z = deviate(word)
        head = float(z)
        print(word, repr(head), mp.nstr(z - mp.mpf(head), 17))
