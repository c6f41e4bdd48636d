"""Band powers of a masked sky by NaMaster: maps and mask are formulae that the test repeats. Columns: band TT EE BB TE."""
import healpy as hp
import numpy as np
import pymaster as nmt

nside, lmax, width = 32, 42, 8
z, phi = hp.pix2vec(nside, np.arange(12 * nside**2))[2], hp.pix2ang(nside, np.arange(12 * nside**2))[1]
x, y = np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi)
weight = np.clip((np.abs(z) - 0.2) / 0.3, 0, 1) ** 2
i = np.sin(5 * x) * np.cos(4 * y) + np.sin(11 * z * x) + 0.3 * np.cos(17 * y)
q = np.cos(6 * x * y) + np.sin(9 * z) * x + 0.2 * np.cos(19 * x)
u = np.sin(7 * y * z) - np.cos(8 * x) * y + 0.2 * np.sin(18 * y)

reach = min(2 * lmax, 3 * nside - 1)
t = nmt.NmtField(weight, [i], lmax=lmax, lmax_mask=reach, n_iter=3)
p = nmt.NmtField(weight, [q, u], lmax=lmax, lmax_mask=reach, n_iter=3)
count = (lmax + 1 - 2) // width
ells = np.arange(lmax + 1)
band, weights = -np.ones(lmax + 1, int), np.zeros(lmax + 1)
for b in range(count):
    band[2 + b * width : 2 + (b + 1) * width] = b
    weights[2 + b * width : 2 + (b + 1) * width] = 1 / width
bins = nmt.NmtBin(bpws=band, ells=ells, weights=weights, lmax=lmax, f_ell=ells * (ells + 1) / (2 * np.pi))


def decoupled(a, b):
    workspace = nmt.NmtWorkspace()
    workspace.compute_coupling_matrix(a, b, bins)
    return workspace.decouple_cell(nmt.compute_coupled_cell(a, b))


tt, pp, te = decoupled(t, t)[0], decoupled(p, p), decoupled(t, p)[0]
print(f"# NaMaster {nmt.__version__}")
for b in range(count):
    print(b, *(repr(float(v)) for v in (tt[b], pp[0][b], pp[3][b], te[b])))
