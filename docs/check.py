"""Runs the commands of guide.md as they are printed, in a new directory: python docs/check.py

Shell blocks run one after the other in bash (any failure ends it), Python blocks after them in one interpreter, C and Fortran
blocks through the compilers that are there. Needs a built target/release/dust3d, healpy and pysm3.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.M | re.S)


def main():
    blocks = BLOCK.findall((HERE / "guide.md").read_text(encoding="utf-8"))
    code = {kind: "\n".join(text for k, text in blocks if k == kind) for kind in ["sh", "python", "c", "fortran"]}
    path = f"{HERE.parent / 'target' / 'release'}{os.pathsep}{os.environ['PATH']}"
    with tempfile.TemporaryDirectory() as folder:

        def run(*command, **options):
            subprocess.run(command, cwd=folder, check=True, env={**os.environ, "PATH": path}, **options)

        run("bash", "-euxc", code["sh"])
        run(sys.executable, "-c", code["python"])
        for suffix, kind, compiler in [("c", "c", "cc"), ("f90", "fortran", "gfortran")]:
            if shutil.which(compiler) is None:
                print(f"SKIPPED {kind}: there is no {compiler}")
                continue
            Path(folder, f"read.{suffix}").write_text(code[kind], encoding="utf-8")
            run(compiler, f"read.{suffix}", "-o", "read_it", "-lm")
            run("./read_it")
    print(f"{len(blocks)} blocks of the guide ran")


if __name__ == "__main__":
    main()
