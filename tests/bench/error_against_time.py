#!/usr/bin/env python3
"""How wrong is an image after so many seconds?

Renders a scene with growing time limits and compares each image with a reference. Time is
processor seconds of the whole render (client, coordinator and workers, start-up included) over
two, as on a machine of two cores that does nothing else.

  tests/bench/error_against_time.py SCENE REFERENCE [--mask M] [--floor F] [--times 1,2,5]
    [-- render flags]

The floor of relMSE is that of `lucerna diff`, or F.

Prints one line a time: seconds, relMSE of all pixels and without the worst 0.1 %, mean ratio,
passes.
"""
import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile


def cpu_of_children():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("reference")
    parser.add_argument("--mask")
    parser.add_argument("--floor")
    parser.add_argument("--times", default="1,2,5,10,20")
    parser.add_argument("--bin", default=pathlib.Path(__file__).parents[2] / "build/release/bin")
    arguments, flags = parser.parse_known_args()
    lucerna = pathlib.Path(arguments.bin) / "lucerna"
    mask = ["--mask", arguments.mask] if arguments.mask else []
    floor = ["--floor", arguments.floor] if arguments.floor else []
    flags = [flag for flag in flags if flag != "--"]
    print(f"{'s':>6} {'relMSE':>10} {'trimmed':>10} {'ratio':>8} {'passes':>7} {'wall s':>7}")
    with tempfile.TemporaryDirectory() as folder:
        image = pathlib.Path(folder) / "out.exr"
        for seconds in map(float, arguments.times.split(",")):
            # Start and end cost processor time too: give the passes what is left.
            limit = seconds
            for _ in range(3):
                before = cpu_of_children()
                job = run([lucerna, "render", arguments.scene, "-o", image, "--json",
                           "--time", f"{limit:.3f}", *flags])
                spent = (cpu_of_children() - before) / 2
                if abs(spent - seconds) <= 0.06 * seconds:
                    break
                limit = max(0.05, limit + (seconds - spent))
            diff = [lucerna, "diff", image, arguments.reference, *mask, *floor, "--json"]
            everything = run(diff)
            trimmed = run([*diff, "--trim", "0.001"])
            print(f"{spent:6.2f} {everything['rel_mse']:10.2e} {trimmed['rel_mse']:10.2e} "
                  f"{everything['mean_ratio']:8.4f} {job['passes']:7d} {job['running_s']:7.2f}",
                  flush=True)


if __name__ == "__main__":
    main()
