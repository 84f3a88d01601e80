#!/usr/bin/env python3
"""How much noise have images of one build, over those of another?

  tests/bench/noise_of_seeds.py BIN OTHER_BIN SCENE ... [--seeds N] [-- render flags]

Renders each scene with N seeds (default: 6) by the programs in both folders. Noise is the variance
over the seeds, relative to the squared mean of all seeds plus the floor of relMSE, without the 0.1 %
of the pixels that have most of it. Bias is not part of it. What a few seeds say is known to 10 %.

Prints a line a scene: both noises, their ratio, and the ratio of the mean images; then the
geometric mean of the ratios. Needs the Python client (docs/python.md).
"""
import argparse
import math
import pathlib
import subprocess
import sys
import tempfile

import lucerna
import numpy as np
from lucerna.metrics import relative_error_floor


def images_of(programs, scene, seeds, flags):
    """[seeds, rows, columns, 3]"""
    images = []
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "image.exr"
        for seed in range(1, seeds + 1):
            done = subprocess.run([programs / "lucerna", "render", scene, "-o", out, "--seed", str(seed),
                                   "--quiet", "--force", "--no-checkpoints", *flags],
                                  capture_output=True, text=True, check=False)
            if done.returncode != 0:
                sys.exit(done.stderr)
            images.append(lucerna.read_image(out)["beauty"])
    return np.asarray(images, dtype=np.float64)


def noise_of(images):
    mean = images.mean(axis=0)
    relative = images.var(axis=0, ddof=1) / (mean**2 + relative_error_floor(mean))
    of_pixels = np.sort(relative.mean(axis=-1).ravel())
    return of_pixels[:math.ceil(0.999 * len(of_pixels))].mean()


def main():
    words = sys.argv[1:]
    cut = words.index("--") if "--" in words else len(words)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("other_bin", type=pathlib.Path)
    parser.add_argument("scenes", nargs="+", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=6)
    arguments = parser.parse_args(words[:cut])
    logarithms = []
    for scene in arguments.scenes:
        images = [images_of(programs, scene, arguments.seeds, words[cut + 1:])
                  for programs in (arguments.bin, arguments.other_bin)]
        noise = [noise_of(of_build) for of_build in images]
        logarithms.append(math.log(noise[0] / noise[1]))
        print(f"{scene.stem:20s} {noise[0]:.3e} {noise[1]:.3e} {noise[0] / noise[1]:7.3f} "
              f"{images[0].mean() / images[1].mean():8.4f}", flush=True)
    print(f"geometric mean {math.exp(sum(logarithms) / len(logarithms)):.3f}")


if __name__ == "__main__":
    main()
