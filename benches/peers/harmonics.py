"""dust3d emit --coord, --beam, --nside, --alm against healpy, on the emission of a run (not band-limited).

    pip install healpy
    cargo build --release
    python benches/peers/harmonics.py

A run of the built-in sky at Nside 64 is made; its maps at 353 GHz are rotated (Rotator.rotate_map_alms), smoothed (I:
smoothing; Q, U: with the beam of I, without the factor exp(2 sigma^2) that healpy adds for spin 2), resampled and analysed
by healpy with the same lmax. The largest difference relative to the rms of the map is printed, and must be below 1e-6.
"""

import subprocess
import tempfile
from pathlib import Path

import healpy as hp
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
DUST3D = ROOT / "target" / "release" / "dust3d"
NSIDE = 64
BOUND = 1e-6


def dust3d(*arguments):
    subprocess.run([DUST3D, "--quiet", *map(str, arguments)], check=True)


def check(what, ours, theirs):
    ours, theirs = np.atleast_2d(ours), np.atleast_2d(theirs)
    difference = (np.abs(ours - theirs).max(axis=1) / theirs.std(axis=1)).max()
    print(f"{what:45s} {difference:.1e}")
    assert difference < BOUND, what


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        dust3d("run", "--nside", NSIDE, "--freq", 353, "--out", folder / "run")

        def emit(*options, nside=NSIDE):
            dust3d("emit", folder / "run", "--freq", 353, "--format", "fits", "--force", "--out", folder / "maps", *options)
            maps = hp.read_map(folder / "maps" / "3d_353GHz.fits", field=(0, 1, 2), dtype=np.float64)
            assert hp.get_nside(maps) == nside
            return maps

        sky = emit()
        for lmax in [2 * NSIDE, 3 * NSIDE - 1]:
            for frame in "CE":
                theirs = hp.Rotator(coord=["G", frame]).rotate_map_alms(sky, lmax=lmax, use_pixel_weights=False)
                check(f"rotation to {frame}, lmax {lmax}", emit("--coord", frame, "--lmax", lmax), theirs)
            for arcmin in [30.0, 90.0]:
                fwhm = np.radians(arcmin / 60)
                sigma = fwhm / np.sqrt(8 * np.log(2))
                theirs = hp.smoothing(sky, fwhm=fwhm, lmax=lmax)
                theirs[1:] *= np.exp(-2 * sigma**2)
                check(f"beam of {arcmin:g} arcmin, lmax {lmax}", emit("--beam", arcmin, "--lmax", lmax), theirs)
        for nside in [32, 128]:
            lmax = 2 * min(nside, NSIDE)
            theirs = hp.alm2map(hp.map2alm(sky, lmax=lmax), nside, lmax=lmax)
            check(f"Nside {nside}, lmax {lmax}", emit("--nside", nside, nside=nside), theirs)
        lmax = 2 * NSIDE
        theirs = hp.map2alm(sky, lmax=lmax)
        options = ["emit", folder / "run", "--freq", 353, "--alm", "--force", "--out", folder / "maps"]
        dust3d(*options)
        ours = [np.fromfile(folder / "maps" / f"3d_353GHz_{x}.c128", "<c16") for x in "TEB"]
        check("a_lm, raw", ours, theirs)
        dust3d(*options, "--format", "fits")
        fits = hp.read_alm(folder / "maps" / "3d_353GHz_alm.fits", hdu=(1, 2, 3))
        assert (fits == ours).all(), "FITS a_lm differ from raw ones"
        dust3d(*options, "--format", "npy")
        npy = [np.load(folder / "maps" / f"3d_353GHz_{x}.npy") for x in "TEB"]
        assert (npy == np.array(ours)).all(), "npy a_lm differ from raw ones"
        print("a_lm of FITS and npy files are the same to the last bit")


if __name__ == "__main__":
    main()
