"""FITS files of other programs read by dust3d, and files of dust3d read by them: to the last bit.

    pip install healpy
    cargo build --release
    python benches/peers/fits.py

Writes tables as healpy, astropy, Planck (1024E, NESTED, K_CMB, POLCCONV) and WMAP (one pixel or 1024 a row, mK, NESTED) write them,
in every type (E, D, I, J, K), row length, order and indexing; reads each with `dust3d map convert` and compares the bits with
what was written. Then writes maps, coefficients and spectra with dust3d and compares what healpy and astropy read.
"""

import itertools
import subprocess
import tempfile
from pathlib import Path

import healpy as hp
import numpy as np
from astropy.io import fits

ROOT = Path(__file__).resolve().parents[2]
DUST3D = ROOT / "target" / "release" / "dust3d"


def dust3d(*arguments):
    subprocess.run([DUST3D, "--quiet", *map(str, arguments)], check=True)


def convert(source, folder):
    dust3d("map", "convert", source, "--out", folder / "out.f64")
    return np.fromfile(folder / "out.f64", "<f8")


def same(ours, theirs, what):
    theirs = np.where(np.isnan(theirs) | np.isclose(theirs, hp.UNSEEN, rtol=1e-5), hp.UNSEEN, theirs)
    assert ours.dtype == np.float64 and np.array_equal(ours, theirs), what


def table(path, names, forms, units, arrays, **cards):
    columns = [fits.Column(name=n, format=f, unit=u, array=a) for n, f, u, a in zip(names, forms, units, arrays)]
    hdu = fits.BinTableHDU.from_columns(columns)
    for key, value in cards.items():
        hdu.header[key] = value
    fits.HDUList([fits.PrimaryHDU(), hdu]).writeto(path, overwrite=True)


def whole_maps(folder):
    rng = np.random.default_rng(1)
    count = 0
    for nside, repeat, code, nested in itertools.product([16, 32], [1, 12, 1024, 3072], "EDIJK", [False, True]):
        npix = 12 * nside**2
        kind = {"E": ">f4", "D": ">f8", "I": ">i2", "J": ">i4", "K": ">i8"}[code]
        ring = (rng.normal(size=npix) * 1000).astype(kind)
        stored = ring[hp.nest2ring(nside, np.arange(npix))] if nested else ring
        form = f"{repeat}{code}" if repeat > 1 else code
        table(folder / "map.fits", ["SIGNAL", "HITS"], [form, form], ["K_CMB", None],
              [stored.reshape(-1, repeat) if repeat > 1 else stored] * 2,
              PIXTYPE="HEALPIX", ORDERING="NESTED" if nested else "RING", NSIDE=nside, COORDSYS="G",
              FIRSTPIX=0, LASTPIX=npix - 1, INDXSCHM="IMPLICIT")
        for source in ["map.fits", "map.fits[HITS]", "map.fits[HDU=1][2]"]:
            same(convert(folder / source, folder), ring.astype("f8"), (nside, repeat, code, nested, source))
            count += 1
    return count


def healpy_files(folder):
    rng = np.random.default_rng(2)
    count = 0
    for nside, nest, partial, dtype, gz in itertools.product([4, 32, 64], [False, True], [False, True], [np.float32, np.float64], ["", ".gz"]):
        maps = rng.normal(size=(3, 12 * nside**2)).astype(dtype)
        maps[:, rng.integers(0, 12 * nside**2, 7)] = hp.UNSEEN
        path = folder / f"healpy.fits{gz}"
        hp.write_map(path, maps, nest=nest, partial=partial, dtype=dtype, coord="G", column_units="mK_RJ", overwrite=True)
        theirs = hp.read_map(path, field=(0, 1, 2), dtype=None)
        for number, wanted in enumerate(theirs, 1):
            # In a list of pixels the first column is their numbers.
            same(convert(f"{path}[{number + partial}]", folder), wanted.astype("f8"), (nside, nest, partial, dtype, gz, number))
            count += 1
    return count


def missions(folder):
    rng = np.random.default_rng(3)
    nside = 64
    npix = 12 * nside**2
    iqu = rng.normal(size=(3, npix)).astype(">f4")
    nest = iqu[:, hp.nest2ring(nside, np.arange(npix))]
    rows = [m.reshape(-1, 1024) for m in nest]
    # Planck: I, Q, U, hits and covariances in one table, IAU here, BAD_DATA instead of NaN.
    hits = rng.integers(0, 1000, (npix // 1024, 1024)).astype(">i4")
    table(folder / "planck.fits", ["I_STOKES", "Q_STOKES", "U_STOKES", "HITS", "II_COV"], ["1024E"] * 3 + ["1024J", "1024E"],
          ["K_CMB"] * 3 + ["", "K_CMB^2"], [*rows, hits, rows[0] ** 2], PIXTYPE="HEALPIX", COORDSYS="GALACTIC", ORDERING="NESTED",
          NSIDE=nside, FIRSTPIX=0, LASTPIX=npix - 1, INDXSCHM="IMPLICIT", POLCCONV="IAU", BAD_DATA=-1.63750e30, EXTNAME="FREQ-MAP")
    for name, wanted in zip(["I_STOKES", "Q_STOKES", "U_STOKES"], iqu * np.array([[1], [1], [-1]])):
        same(convert(folder / f"planck.fits[{name}]", folder), wanted.astype("f8"), name)
    # WMAP: TEMPERATURE, Q_POLARISATION, U_POLARISATION, N_OBS; one pixel a row; mK without saying which; two HDUs.
    table(folder / "wmap.fits", ["TEMPERATURE", "Q_POLARISATION", "U_POLARISATION", "N_OBS"], ["E"] * 4, ["mK", "mK", "mK", "counts"],
          [*nest, nest[0]], PIXTYPE="HEALPIX", ORDERING="NESTED", NSIDE=nside, COORDSYS="G", OBJECT="FULLSKY", EXTNAME="Stokes Maps")
    for name, wanted in zip(["TEMPERATURE", "Q_POLARISATION", "U_POLARISATION"], iqu):
        same(convert(folder / f"wmap.fits[{name}]", folder), wanted.astype("f8"), name)
    # A list of pixels: OBJECT = PARTIAL, without INDXSCHM.
    some = rng.permutation(npix)[:5000]
    table(folder / "partial.fits", ["PIXEL", "SIGNAL"], ["J", "D"], ["", "uK_CMB"], [some, nest[0][some]], PIXTYPE="HEALPIX",
          ORDERING="NESTED", NSIDE=nside, COORDSYS="G", OBJECT="PARTIAL")
    wanted = np.full(npix, hp.UNSEEN)
    wanted[hp.nest2ring(nside, some)] = nest[0][some]
    same(convert(folder / "partial.fits", folder), wanted, "partial")
    return 7


def written(folder):
    dust3d("run", "--nside", 32, "--freq", 353, "--out", folder / "run")
    count = 0
    for dtype in ["f32", "f64"]:
        out = folder / dtype
        common = ["emit", folder / "run", "--band", "95", "--unit", "uK_RJ", "--dtype", dtype]
        dust3d(*common, "--out", out / "raw")
        dust3d(*common, "--format", "fits", "--out", out / "fits")
        dust3d(*common, "--format", "npy", "--out", out / "npy")
        theirs = hp.read_map(out / "fits/3d_95GHz.fits", field=(0, 1, 2), dtype=None)
        with fits.open(out / "fits/3d_95GHz.fits") as hdus:
            hdus.verify("exception")
            header = hdus[1].header
            assert header["TFORM1"] == f"1024{'E' if dtype == 'f32' else 'D'}" and header["TUNIT2"] == "uK_RJ"
            assert (header["ORDERING"], header["NSIDE"], header["COORDSYS"], header["POLCCONV"]) == ("RING", 32, "G", "COSMO")
            assert header["FREQ"] == 95.0 and header["RANDSEED"] == 1 and header["CREATOR"] == "dust3d"
        for s, letter in enumerate("IQU"):
            raw = np.fromfile(out / f"raw/3d_95GHz_{letter}.{dtype}", {"f32": "<f4", "f64": "<f8"}[dtype])
            assert np.array_equal(raw, theirs[s]) and np.array_equal(raw, np.load(out / f"npy/3d_95GHz_{letter}.npy"))
            count += 2
    maps = [folder / "run/observations" / f"{s}_353.f64" for s in "IQU"]
    dust3d("map", "spectrum", *maps, "--out", folder / "cl.fits")
    dust3d("map", "spectrum", *maps, "--out", folder / "cl.csv")
    csv = np.genfromtxt(folder / "cl.csv", delimiter=",", names=True)
    theirs = hp.read_cl(folder / "cl.fits")
    # Columns of the file are in the order of HEALPix (TB before EB).
    for name, cl in zip(["TT", "EE", "BB", "TE", "TB", "EB"], theirs):
        assert np.array_equal(csv[name], cl), name
        count += 1
    return count


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for step in [whole_maps, healpy_files, missions, written]:
            print(f"{step.__name__:14s} {step(folder)} maps are the same to the last bit")


if __name__ == "__main__":
    main()
