"""Writes the FITS files of this directory. Every value follows from pixel and column (`value`), so that the tests
know it without a table. Usage: python make.py"""

import gzip

import healpy as hp
import numpy as np
from astropy.io import fits

NSIDE = 4
NPIX = 12 * NSIDE**2


def value(column, npix=NPIX):
    """Exact in float32; RING order."""
    return ((37 * np.arange(npix) % 1009) - 504) / 16 + 64 * column


def nested(ring):
    nside = hp.npix2nside(len(ring))
    return ring[hp.nest2ring(nside, np.arange(len(ring)))]


def table(name, columns, **cards):
    hdu = fits.BinTableHDU.from_columns(columns)
    for key, card in cards.items():
        hdu.header[key] = card
    fits.HDUList([fits.PrimaryHDU(), hdu]).writeto(name, overwrite=True)


PIXELS = dict(PIXTYPE="HEALPIX", ORDERING="RING", NSIDE=NSIDE, COORDSYS="G")
iqu = [value(c) for c in range(3)]

# As healpy writes them.
hp.write_map("iqu_f32.fits", iqu, dtype=np.float32, coord="G", column_units="uK_CMB", overwrite=True)
hp.write_map("iqu_rows_f32.fits", [value(c, 3072) for c in range(3)], dtype=np.float32, coord="G",
             column_units="MJy/sr", overwrite=True)
hp.write_map("nested_f64.fits", nested(iqu[0]), nest=True, dtype=np.float64, overwrite=True)
some = iqu[0].copy()
some[np.arange(NPIX) % 3 == 0] = hp.UNSEEN
hp.write_map("partial_nested_f32.fits", nested(some), nest=True, partial=True, dtype=np.float32, coord="G",
             column_units="K_RJ", overwrite=True)
hp.write_map("equatorial.fits", iqu, dtype=np.float32, coord="C", overwrite=True)

# Two more maps behind a first one, and gzip.
with open("iqu_f32.fits", "rb") as plain, open("iqu_f32.fits.gz", "wb") as packed:
    packed.write(gzip.compress(plain.read(), mtime=0))

# Integers of every width: value = 1/16 * n - 504/16, with one pixel undefined; pixel 5 = null.
counts = (37 * np.arange(NPIX) % 1009) - 504
def integers(name, form, null, dtype):
    n = counts.astype(dtype)
    n[5] = null
    column = fits.Column(name=name, format=form, array=n, null=null)
    return column
columns = [integers("SHORT", "I", -32768, ">i2"), integers("INT", "J", -2147483648, ">i4"),
           integers("LONG", "K", -99999, ">i8"),
           fits.Column(name="BYTE", format="B", array=(np.arange(NPIX) % 251).astype("u1")),
           fits.Column(name="MASK", format="L", array=np.arange(NPIX) % 2 == 1)]
table("integers.fits", columns, **PIXELS)
# The scale is added by hand: astropy would change the numbers.
with fits.open("integers.fits", mode="update", do_not_scale_image_data=True) as file:
    for column in (1, 2, 3):
        file[1].header[f"TSCAL{column}"] = 0.0625
        file[1].header[f"TZERO{column}"] = 64.0

# Rows of 12 values, other columns between, IAU signs and missing pixels of its own.
bad = iqu[2].copy()
bad[7] = -99.0
bad[11] = np.nan
table("iau_bad_data.fits",
      [fits.Column(name="HITS", format="12J", array=np.arange(NPIX).reshape(-1, 12)),
       fits.Column(name="LABEL", format="5A", array=["label"] * (NPIX // 12)),
       fits.Column(name="Q-POLARISATION", format="12E", unit="mK_CMB", array=iqu[1].reshape(-1, 12)),
       fits.Column(name="U-POLARISATION", format="12D", unit="mK_CMB", array=bad.reshape(-1, 12))],
      POLCCONV="IAU", BAD_DATA=-99.0, INDXSCHM="IMPLICIT", **PIXELS)

# Parameters of the dust, the second map in an HDU of its own; NSIDE as a string.
first = fits.BinTableHDU.from_columns([fits.Column(name="N", format="E", array=[1.0, 2.0])], name="NOTES")
second = fits.BinTableHDU.from_columns(
    [fits.Column(name="TAU353", format=f"{NPIX}D", array=iqu[0].reshape(1, -1)),
     fits.Column(name="TEMP", format=f"{NPIX}D", array=iqu[1].reshape(1, -1), unit="K"),
     fits.Column(name="ERR_TEMP", format=f"{NPIX}D", array=iqu[2].reshape(1, -1), unit="K"),
     fits.Column(name="BETA", format=f"{NPIX}D", array=iqu[2].reshape(1, -1))], name="MODEL")
for key, card in {**PIXELS, "NSIDE": str(NSIDE)}.items():
    second.header[key] = card
fits.HDUList([fits.PrimaryHDU(), first, second]).writeto("model.fits", overwrite=True)

# Images.
fits.PrimaryHDU(iqu[0].astype(">f4")).writeto("image.fits", overwrite=True)
image = fits.ImageHDU(np.array(iqu), name="IQU")
image.header["BUNIT"] = "MJy/sr"
fits.HDUList([fits.PrimaryHDU(), image]).writeto("image_iqu.fits", overwrite=True)

np.save("iqu.npy", np.array(iqu, dtype="<f4"))

# One smooth sky in three coordinates, the others by healpy's rotation of the coefficients.
fine, lmax = 8, 12
rng = np.random.default_rng(5)
alms = [(rng.standard_normal(hp.Alm.getsize(lmax)) + 1j * rng.standard_normal(hp.Alm.getsize(lmax))) for _ in range(3)]
for alm in alms:
    alm[: lmax + 1] = alm[: lmax + 1].real
for alm in alms[1:]:
    alm[hp.Alm.getlm(lmax)[0] < 2] = 0
alms[0][0] = 50
for coord in "GCE":
    turned = [alm.copy() for alm in alms]
    if coord != "G":
        turned = hp.Rotator(coord=["G", coord]).rotate_alm(turned)
    hp.write_map(f"smooth_{coord}.fits", hp.alm2map(turned, fine), dtype=np.float64, coord=coord,
                 column_units="MJy/sr", overwrite=True)

# Bandpasses as in the reduced instrument models of Planck: HFI in 1/cm from 0 on, LFI in GHz. The values are invented.
def bandpass(name, unit, nu, weight):
    columns = [fits.Column(name="WAVENUMBER", format="E", unit=unit, array=nu),
               fits.Column(name="TRANSMISSION", format="E", array=weight),
               fits.Column(name="UNCERTAINTY", format="E", array=0 * weight),
               fits.Column(name="FLAG", format="1A", array=["F"] * len(nu))]
    return fits.BinTableHDU.from_columns(columns, name=name)
detectors = fits.BinTableHDU.from_columns(
    [fits.Column(name="DETECTOR", format="8A", array=["143-1a"]), fits.Column(name="FWHM", format="E", array=[7.2])],
    name="CHANNEL_PARAMETERS")
wavenumber = np.arange(0.0, 7.0, 0.25)
hfi = bandpass("BANDPASS_F143", "cm^-1", wavenumber, np.exp(-2 * (wavenumber - 4.75) ** 2))
lfi = bandpass("BANDPASS_030", "GHz", np.arange(21.5, 35.5), np.linspace(0.5, 1.5, 14))
fits.HDUList([fits.PrimaryHDU(), detectors, hfi, lfi]).writeto("rimo.fits", overwrite=True)
