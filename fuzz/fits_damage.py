"""A thousand damaged FITS files through the command itself: a sentence and status 1 each (or a map, if the damage is harmless),
no panic, no hang, no more than 100 MB of memory.

    cargo build --release
    python fuzz/fits_damage.py [count] [seed]

Damages the files of tests/data/fits: numbers of keywords replaced by others (large ones, too), cards exchanged or changed,
bits flipped, bytes dropped, ends cut, and all that inside gzip.
"""

import gzip
import os
import random
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DUST3D = ROOT / "target" / "release" / "dust3d"
NUMBERS = ["0", "-1", "1", "2", "3", "8", "12", "64", "999", "1000", "4096", "8192", "16384", "65536", "2147483647", "4294967296",
           "1000000000000", "9223372036854775807", "18446744073709551616", "1E400", "1.5", "T", "'A'", ""]
FORMS = ["E", "1024E", "3072E", "D", "1J", "K", "9999999999E", "1PE(3)", "A", "0E", "X", "-1E", "99999999999999999999D", "C", "M", "L"]


def damage(rng, data):
    data = bytearray(data)
    header = min(len(data), rng.choice([2880, 5760, 8640]))
    kind = rng.randrange(8)
    if kind <= 2:  # the value of a card
        cards = [i for i in range(0, header, 80) if data[i + 8 : i + 10] == b"= "]
        for at in rng.sample(cards, min(len(cards), rng.choice([1, 1, 2]))):
            text = bytes(data[at : at + 80]).decode("latin-1")
            value = f"'{rng.choice(FORMS):<8}'" if text.startswith("TFORM") and rng.random() < 0.8 else f"{rng.choice(NUMBERS):>20}"
            data[at + 10 : at + 80] = f"{value:<70}"[:70].encode()
    elif kind == 3:  # characters of the header
        for _ in range(rng.randint(1, 5)):
            data[rng.randrange(header)] = rng.choice(b"0123456789 '-+.=/ENDTFXZ\xff\0")
    elif kind == 4:  # cards exchanged
        a, b = (80 * rng.randrange(header // 80) for _ in range(2))
        data[a : a + 80], data[b : b + 80] = data[b : b + 80], data[a : a + 80]
    elif kind == 5:
        for _ in range(rng.randint(1, 9)):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    elif kind == 6:
        del data[rng.randrange(len(data)) :]
    else:
        start = rng.randrange(len(data))
        del data[start : start + rng.randint(1, 4000)]
    return bytes(data)


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    rng = random.Random(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    files = sorted((ROOT / "tests" / "data" / "fits").glob("*.fits"))
    outcomes, worst = Counter(), (0, "")
    with tempfile.TemporaryDirectory() as name:
        for number in range(count):
            source = rng.choice(files)
            data = damage(rng, source.read_bytes())
            path = Path(name) / "damaged.fits"
            if rng.random() < 0.2:
                data = gzip.compress(data)
                if rng.random() < 0.3:
                    data = damage(rng, data.ljust(5760, b"\0"))
            path.write_bytes(data)
            what = rng.choice([["map", "info", path], ["map", "info", f"{path}[2]"], ["map", "convert", path, "--out", f"{name}/out.f64"],
                               ["map", "convert", f"{path}[U_STOKES]", "--out", f"{name}/out.f64"]])
            child = subprocess.Popen([DUST3D, *what], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            error = child.stderr.read().decode()
            _, status, usage = os.wait4(child.pid, 0)
            code = os.waitstatus_to_exitcode(status)
            context = f"number {number} ({source.name}): {code} {error}"
            assert code in (0, 1, 2), context
            assert usage.ru_utime + usage.ru_stime < 5, f"slow: {context}"
            assert usage.ru_maxrss < 100 * 1024, f"{usage.ru_maxrss} KiB: {context}"
            last = error.strip().splitlines()[-1] if error.strip() else ""
            if code != 0:
                assert last.startswith("dust3d: ") and "panicked" not in error and "damaged.fits" in last, context
                assert len(last) > 40 and re.search(r"[;:,]", last), context
            outcomes[code] += 1
            worst = max(worst, (usage.ru_maxrss, source.name))
    print(f"{count} files: {dict(outcomes)} by status, at most {worst[0] / 1024:.0f} MB ({worst[1]})")


if __name__ == "__main__":
    main()
