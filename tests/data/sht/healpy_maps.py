"""Spin-0 and spin-2 synthesis by healpy of simple coefficients, on the whole of small maps.

a_k = (cos k, sin 2k) for the k-th coefficient in healpy's order, E as that, B = (sin 3k, cos k)/2, imaginary parts zero
for m = 0, l < 2 zero for E and B. Writes healpy_maps.txt: nside lmax, then one line per pixel: T Q U.
Run: python healpy_maps.py > healpy_maps.txt   (healpy 1.20)
"""
import healpy as hp
import numpy as np

print("# healpy", hp.__version__, "alm2map and alm2map_spin(spin=2); see healpy_maps.py")
for nside, lmax in ((1, 3), (2, 5), (4, 12), (8, 17)):
    k = np.arange(hp.Alm.getsize(lmax))
    l, m = hp.Alm.getlm(lmax)
    t = np.cos(k) + 1j * np.where(m > 0, np.sin(2 * k), 0)
    b = (np.sin(3 * k) + 1j * np.where(m > 0, np.cos(k), 0)) / 2
    e, b = np.where(l < 2, 0, t), np.where(l < 2, 0, b)
    maps = [hp.alm2map(t, nside, lmax=lmax)] + list(hp.alm2map_spin([e, b], nside, 2, lmax))
    print(nside, lmax)
    for row in np.transpose(maps):
        print(*(repr(float(x)) for x in row))
