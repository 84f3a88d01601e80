#!/usr/bin/env python3
"""What does leaving out what a scene does not need save?

Renders every scene as it is and with --use-everything, in turn, and prints a table: processor time of
coordinator and workers, the largest process, and bytes sent a pass, each as it is over everything, and
whether the images agree.

  tests/bench/lean.py [--passes N] [--size WxH] SCENE ... [-- render flags]
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile


def render(lucerna, scene, arguments, image, everything):
    command = ["/usr/bin/env", "time", "-f", "%M", lucerna, "render", scene, "-o", image, "--json",
               "--full", "--quiet", "--size", arguments.size, "--passes", arguments.passes, *arguments.flags]
    if everything:
        command.append("--use-everything")
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{scene}: {done.stderr}")
    report = json.loads(done.stdout)
    report["largest_kb"] = int(done.stderr.strip().splitlines()[-1])
    return report


def main():
    words = sys.argv[1:]
    flags = []
    if "--" in words:
        flags = words[words.index("--") + 1:]
        words = words[:words.index("--")]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--passes", default="128")
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("scenes", nargs="+")
    arguments = parser.parse_args(words)
    arguments.flags = flags
    root = pathlib.Path(__file__).resolve().parents[2]
    lucerna = root / "build/release/bin/lucerna"

    print("| scene | left out | processor time | largest process | bytes sent a pass | image |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        for scene in arguments.scenes:
            runs = {False: [], True: []}
            for repetition in range(arguments.repetitions):
                for everything in ((False, True), (True, False))[repetition % 2]:
                    image = scratch / f"{everything}.exr"
                    runs[everything].append(render(lucerna, scene, arguments, image, everything))
            lean, full = ({key: statistics.median(run[key] for run in runs[everything])
                           for key in ("largest_kb", "sent_bytes")} |
                          {"cpu": statistics.median(run["coordinator_cpu_s"] + run["worker_cpu_s"]
                                                    for run in runs[everything])}
                          for everything in (False, True))
            left_out = sum(not part["is_used"] for part in runs[False][0]["parts"])
            diff = json.loads(subprocess.run(
                [lucerna, "diff", scratch / "False.exr", scratch / "True.exr", "--trim", "0.001",
                 "--json"], capture_output=True, text=True, check=True).stdout)
            same = "same bits" if diff["rmse"] == 0 else f"relMSE {diff['rel_mse']:.1e}"
            print(f"| {pathlib.Path(scene).stem} | {left_out} | "
                  f"{lean['cpu'] / full['cpu']:.2f} | {lean['largest_kb'] / full['largest_kb']:.2f} | "
                  f"{lean['sent_bytes'] / full['sent_bytes']:.2f} | {same} |", flush=True)


if __name__ == "__main__":
    main()
