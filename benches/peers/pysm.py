"""dust3d export --pysm against PySM 3: pysm3.Sky on the export must give the maps of `dust3d emit`.

    pip install pysm3
    cargo build --release
    python benches/peers/pysm.py [RUN]

RUN is the directory of a finished run; without one, a run of the built-in sky at Nside 32 is made, in f64 and in f32. Every
unit, single frequencies and bandpasses are compared; the largest difference, relative to the largest value of the map, is
printed, and must be below 1e-10 (f64) or 1e-6 (f32).
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pysm3
import pysm3.units as u

ROOT = Path(__file__).resolve().parents[2]
DUST3D = ROOT / "target" / "release" / "dust3d"
UNITS = ["MJy/sr", "Jy/sr", "K_RJ", "mK_RJ", "uK_RJ", "K_CMB", "mK_CMB", "uK_CMB"]
FREQUENCIES = [23.0, 95.5, 150.0, 353.0, 857.0]
# Weights without zeros: PySM leaves points of small weight out of the conversion to K_CMB, but not out of the integral.
BANDS = {
    "flat": (np.linspace(130.0, 170.0, 41), np.ones(41)),
    "bell": (
        np.array([300.0, 310.0, 325.0, 345.0, 353.0, 371.0, 390.0, 404.0]),
        np.array([0.05, 0.31, 0.84, 1.02, 0.99, 1.00, 0.55, 0.02]),
    ),
}


def dust3d(*arguments):
    subprocess.run([DUST3D, "--quiet", *map(str, arguments)], check=True)


def compare(run, folder, dtype, bound):
    """The largest relative difference over everything that is compared."""
    dust3d("export", run, "--pysm", "--out", folder / "pysm")
    nside = int(np.sqrt(np.fromfile(run / f"templates/I_1.{dtype}", f"<{dtype[0]}{int(dtype[1:]) // 8}").size / 12))
    kind = f"<f{int(dtype[1:]) // 8}"
    worst = 0.0
    for name, (nu, weight) in BANDS.items():
        np.savetxt(folder / f"{name}.txt", np.column_stack([nu, weight]), fmt="%.17g")
    for unit in UNITS:
        sky = pysm3.Sky(nside, component_config=str(folder / "pysm" / "pysm3.toml"), output_unit=unit)
        out = folder / ("emit_" + unit.replace("/", "_"))
        bandpasses = ",".join(str(folder / f"{name}.txt") for name in BANDS)
        frequencies = [f"--band={nu:g}" for nu in FREQUENCIES]
        dust3d("emit", run, *frequencies, "--bandpass", bandpasses, "--unit", unit, "--out", out)
        cases = [(f"{nu:g}GHz", nu * u.GHz, None) for nu in FREQUENCIES]
        cases += [(name, nu * u.GHz, weight) for name, (nu, weight) in BANDS.items()]
        for name, nu, weight in cases:
            theirs = sky.get_emission(nu, weight).value
            ours = np.array([np.fromfile(out / f"3d_{name}_{s}.{dtype}", kind) for s in "IQU"], dtype=float)
            difference = np.abs(ours - theirs).max(axis=1) / np.abs(theirs).max(axis=1)
            worst = max(worst, difference.max())
    print(f"{run}: largest relative difference {worst:.2e} (bound {bound:g})")
    assert worst < bound
    return worst


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if len(sys.argv) > 1:
            run = Path(sys.argv[1])
            dtype = next(run.glob("templates/I_1.f*")).suffix[1:]
            compare(run, folder, dtype, 1e-10 if dtype == "f64" else 1e-6)
            return
        for dtype, bound in [("f64", 1e-10), ("f32", 1e-6)]:
            run = folder / dtype
            dust3d("run", "--nside", 32, "--freq", 353, "--set", f"output.dtype={dtype}", "--out", run / "run")
            compare(run / "run", run, dtype, bound)


if __name__ == "__main__":
    main()
