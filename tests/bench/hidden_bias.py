#!/usr/bin/env python3
"""How much of the bias of images does a reference hide, because it has the same?

  tests/bench/hidden_bias.py BIN SCENE REFERENCE LIGHT_TRACED [--seeds N] [-- render flags]

LIGHT_TRACED is a second reference without blur (lucerna-unblurred-reference), however noisy. Renders
the scene with N seeds (default: 6). E is what an image is off by, B its layer `bias`, both as luminance
relative to the reference; products are of two different seeds, so that they have no noise of images
in the mean, and leave out 0.1 % of the pixels. By the light-traced reference E has its noise too,
which is independent of B.

Prints the noise of images, E², EB and B² by the reference, and EB by the light-traced one. Where the
estimate of the bias is right and the reference hides none, all four are alike; of a reference that
hides a share s of the bias they are (1 - s)², 1 - s and 1. Needs the Python client (docs/python.md).
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

import lucerna
import numpy as np
from lucerna.metrics import relative_error_floor

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def luminance_of(path):
    return np.asarray(lucerna.read_image(path)["beauty"], dtype=np.float64) @ LUMINANCE


def main():
    words = sys.argv[1:]
    cut = words.index("--") if "--" in words else len(words)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("reference", type=pathlib.Path)
    parser.add_argument("light_traced", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=6)
    arguments = parser.parse_args(words[:cut])
    reference = luminance_of(arguments.reference)
    unit = np.sqrt(reference**2 + relative_error_floor(reference[..., None].repeat(3, axis=-1)))
    errors, biases = [], []
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "image.exr"
        for seed in range(11, 11 + arguments.seeds):
            done = subprocess.run([arguments.bin / "lucerna", "render", arguments.scene, "-o", out,
                                   "--seed", str(seed), "--quiet", "--force", "--no-checkpoints",
                                   *words[cut + 1:]], capture_output=True, text=True, check=False)
            if done.returncode != 0:
                sys.exit(done.stderr)
            image = lucerna.read_image(out)
            errors.append((luminance_of(out) - reference) / unit)
            biases.append(np.asarray(image["bias"], dtype=np.float64).reshape(unit.shape) / unit)
    errors, biases = np.array(errors), np.array(biases)
    hidden = (reference - luminance_of(arguments.light_traced)) / unit
    size = np.abs(errors.mean(axis=0)) + np.abs(biases.mean(axis=0))
    kept = np.ones(size.size, dtype=bool)
    left_out = size.size // 1000
    for of_pixels in (size, np.abs(hidden)):
        kept[np.argsort(-of_pixels.ravel())[:left_out]] = False
    kept = kept.reshape(size.shape)

    def product(a, b):
        seeds = len(a)
        pairs = a.sum(axis=0) * b.sum(axis=0) - (a * b).sum(axis=0)
        return (pairs / (seeds * (seeds - 1)))[kept].mean()

    print(f"{arguments.scene.stem}: noise {errors.var(axis=0, ddof=1)[kept].mean():.2e}, "
          f"E² {product(errors, errors):.2e}, EB {product(errors, biases):.2e}, "
          f"B² {product(biases, biases):.2e}, "
          f"EB by light tracing {product(errors + hidden, biases):.2e}")


if __name__ == "__main__":
    main()
