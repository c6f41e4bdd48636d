"""Spherical harmonic transforms side by side: dust3d, ducc0 and healpy in one run, alternating.

Needs numpy, ducc0 (its wheel) and, unless --no-healpy, healpy. From the root of the repository:

    cargo build --release -p dust3d-benches --example sht_peer
    python benches/peers/sht.py                                # all sizes, 1 and 2 threads
    python benches/peers/sht.py --sizes 64:191 --threads 1 --rounds 10
    python benches/peers/sht.py --cpu                          # CPU time of one thread, for a busy machine

Every round times each program once (best of a few calls for small sizes); the table shows the best of all rounds in ms
and ducc0's time over ours. The maps and coefficients of all are allocated beforehand. ducc0 and healpy take their
number of threads from OMP_NUM_THREADS at import, so each number of threads runs in its own process.
"""
import argparse
import json
import os
import subprocess
import sys
import time

PEER = "target/release/examples/sht_peer"
SIZES = ["64:191", "256:767", "512:1024", "1024:2048", "2048:4096"]


class Ours:
    def __init__(self, threads, level):
        self.threads, self.level = threads, level
        self.process = subprocess.Popen([PEER, "serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __call__(self, nside, lmax, what, repeats):
        print(nside, lmax, self.threads, repeats, self.level, what, file=self.process.stdin, flush=True)
        best = float("inf")
        while (line := self.process.stdout.readline().strip()) != "done":
            best = min(best, json.loads(line)["ms"])
        return best


def measure(options, threads):
    import ducc0
    import numpy as np

    clock = time.process_time if options.cpu else time.perf_counter
    ours = Ours(threads, options.level)
    print(f"ducc0 {ducc0.__version__}, {threads} thread(s), {'CPU time' if options.cpu else 'wall time'}, ms")
    print(f"{'size':>10} {'transform':<14} {'ours':>10} {'ducc0':>10} {'healpy':>10} {'ducc0/ours':>10}")
    for size in options.sizes:
        nside, lmax = map(int, size.split(":"))
        geometry = ducc0.healpix.Healpix_Base(nside, "RING").sht_info()
        rng = np.random.default_rng(1)
        repeats = max(1, 2_000_000 // (nside * nside * lmax // 20))

        def best(run):
            run()
            times = []
            for _ in range(repeats):
                start = clock()
                run()
                times.append(clock() - start)
            return 1e3 * min(times) if not options.cpu else 1e3 * sum(times) / repeats

        for spin in (0, 2):
            alm = rng.normal(size=(1 if spin == 0 else 2, (lmax + 1) * (lmax + 2) // 2)) + 0j
            maps = np.zeros((len(alm), 12 * nside * nside))
            arguments = dict(lmax=lmax, spin=spin, nthreads=threads, **geometry)

            def synthesis():
                ducc0.sht.synthesis(alm=alm, map=maps, **arguments)

            def adjoint():
                ducc0.sht.adjoint_synthesis(map=maps, alm=alm, **arguments)

            def healpy_synthesis():
                import healpy as hp
                hp.alm2map(alm[0], nside, lmax) if spin == 0 else hp.alm2map_spin(list(alm), nside, 2, lmax)

            def healpy_adjoint():
                import healpy as hp
                hp.map2alm(maps[0], lmax, iter=0) if spin == 0 else hp.map2alm_spin(list(maps), 2, lmax)

            for name, theirs, healpy in (("synthesis", synthesis, healpy_synthesis), ("adjoint", adjoint, healpy_adjoint)):
                times = [float("inf")] * 3
                for _ in range(options.rounds):
                    times[0] = min(times[0], ours(nside, lmax, f"{name}{spin}", repeats))
                    times[1] = min(times[1], best(theirs))
                    if not options.no_healpy and nside <= 1024:
                        times[2] = min(times[2], best(healpy))
                print(f"{size:>10} {name + ' ' + str(spin):<14} {times[0]:10.3f} {times[1]:10.3f} {times[2]:10.3f} "
                      f"{times[1] / times[0]:10.2f}", flush=True)
        if nside <= 512:
            # six layers of I, Q, U against six times ducc0's I and Q, U
            for name, call in (("synthesis", ducc0.sht.synthesis), ("adjoint", ducc0.sht.adjoint_synthesis)):
                times = [float("inf")] * 2
                for _ in range(options.rounds):
                    times[0] = min(times[0], ours(nside, lmax, f"{name}_iqu6", 1))
                    total = 0
                    for spin in (0, 2):
                        alm = np.ones((1 if spin == 0 else 2, (lmax + 1) * (lmax + 2) // 2), complex)
                        maps = np.ones((len(alm), 12 * nside * nside))
                        total += best(lambda: call(alm=alm, map=maps, lmax=lmax, spin=spin, nthreads=threads, **geometry))
                    times[1] = min(times[1], 6 * total)
                print(f"{size:>10} {name + ' IQUx6':<14} {times[0]:10.3f} {times[1]:10.3f} {'':>10} "
                      f"{times[1] / times[0]:10.2f}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", nargs="+", default=SIZES)
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--level", default="best", help="best, avx512, avx2 or portable")
    parser.add_argument("--no-healpy", action="store_true")
    parser.add_argument("--cpu", action="store_true")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        measure(options, options.threads[0])
        return
    if options.cpu:
        options.threads = [1]
    for threads in options.threads:
        environment = dict(os.environ, OMP_NUM_THREADS=str(threads))
        if options.cpu:
            environment["SHT_CPU"] = "1"
        arguments = [a for a in sys.argv[1:]]
        if "--threads" in arguments:
            at = arguments.index("--threads")
            end = next((k for k in range(at + 1, len(arguments)) if arguments[k].startswith("-")), len(arguments))
            del arguments[at:end]
        subprocess.run([sys.executable, __file__, *arguments, "--child", "--threads", str(threads)],
                       env=environment, check=True)


if __name__ == "__main__":
    main()
