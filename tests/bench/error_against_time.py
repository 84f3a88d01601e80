#!/usr/bin/env python3
"""How wrong is an image after so many seconds?

Renders a scene with growing time limits and compares each image with a reference. Time is
processor seconds of the whole render (client, coordinator and workers, start-up included) over
two, as on a machine of two cores that does nothing else.

  tests/bench/error_against_time.py SCENE REFERENCE [--mask M] [--floor F] [--noise E] [--times 1,2,5]
    [--bin FOLDER]... [-- render flags]

The floor of relMSE is that of `lucerna diff`, or F. The reference's own squared noise is taken off,
where it says it or E gives it. Several folders of programs take turns.

Prints one line for each time and folder: seconds, relMSE of all pixels and without the worst 0.1 %,
mean ratio, passes.
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
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return json.loads(done.stdout)


class Program:
    """The programs of one folder. Start and end of a job cost time too: what is not for passes."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.overhead = 0.0

    def render(self, scene, image, seconds, flags):
        """Within 6 % of the time, or the third try: seconds and the job."""
        for _ in range(3):
            limit = max(0.05, seconds - self.overhead)
            before = cpu_of_children()
            job = run([self.folder / "lucerna", "render", scene, "-o", image, "--json",
                       "--time", f"{limit:.3f}", *flags])
            spent = (cpu_of_children() - before) / 2
            self.overhead = spent - limit
            if abs(spent - seconds) <= 0.06 * seconds:
                break
        return spent, job


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("reference")
    parser.add_argument("--mask")
    parser.add_argument("--floor")
    parser.add_argument("--noise", type=float)
    parser.add_argument("--times", default="1,2,5,10,20")
    parser.add_argument("--bin", action="append")
    arguments, flags = parser.parse_known_args()
    folders = arguments.bin or [pathlib.Path(__file__).parents[2] / "build/release/bin"]
    programs = [Program(folder) for folder in folders]
    mask = ["--mask", arguments.mask] if arguments.mask else []
    floor = ["--floor", arguments.floor] if arguments.floor else []
    flags = [flag for flag in flags if flag != "--"]
    print(f"{'s':>6} {'relMSE':>10} {'trimmed':>10} {'ratio':>8} {'passes':>7} {'wall s':>7}")
    with tempfile.TemporaryDirectory() as folder:
        image = pathlib.Path(folder) / "out.exr"
        diff = [programs[0].folder / "lucerna", "diff", image, arguments.reference, *mask, *floor,
                "--json"]
        for seconds in map(float, arguments.times.split(",")):
            for program in programs:
                spent, job = program.render(arguments.scene, image, seconds, flags)
                errors = [run(diff), run([*diff, "--trim", "0.001"])]
                everything, trimmed = (
                    error["rel_mse"] - (arguments.noise if arguments.noise is not None
                                        else error.get("reference_rel_mse") or 0)
                    for error in errors)
                print(f"{spent:6.2f} {everything:10.2e} {trimmed:10.2e} "
                      f"{errors[0]['mean_ratio']:8.4f} {job['passes']:7d} "
                      f"{job['running_s']:7.2f}{f'  {program.folder}' if len(programs) > 1 else ''}",
                      flush=True)


if __name__ == "__main__":
    main()
