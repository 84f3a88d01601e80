#!/usr/bin/env python3
"""Which radius controller is ahead after so many seconds?

Renders every scene with every controller and growing time limits and compares with the scene's
reference. Time is processor seconds of the whole render over two. Writes a table to standard output
and, with --plot FILE.svg, error against time on logarithmic axes.

  tests/bench/controllers.py --times 2,5 NAME=SCENE,REFERENCE[,MASK] ... [-- render flags]
"""
import argparse
import json
import math
import pathlib
import resource
import subprocess
import sys
import tempfile

CONTROLLERS = ["ppm", "pppm", "appm", "cppm", "frequency", "frequency-consistent", "frequency-mse"]
COLOURS = ["#444444", "#1f77b4", "#17becf", "#2ca02c", "#d62728", "#ff7f0e", "#9467bd"]


def cpu_of_children():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(command):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return json.loads(done.stdout)


def measure(lucerna, scene, reference, mask, controller, seconds, flags, folder):
    """Processor seconds over two, and trimmed relMSE."""
    image = folder / "out.exr"
    before = cpu_of_children()
    run([lucerna, "render", scene, "-o", image, "--json", "--initial-radius", "auto",
         "--radius-controller", controller, "--time", seconds, *flags])
    spent = (cpu_of_children() - before) / 2
    mask = ["--mask", mask] if mask else []
    diff = run([lucerna, "diff", image, reference, *mask, "--trim", "0.001", "--json"])
    return spent, diff["rel_mse"]


def plot(results, path):
    """results: {scene: {controller: [(seconds, error)]}} as one row of log-log panels in SVG."""
    width, height, margin = 300, 260, 46
    panels = []
    for number, (scene, curves) in enumerate(results.items()):
        points = [point for curve in curves.values() for point in curve]
        low_x, high_x = (f(math.log10(t) for t, _ in points) for f in (min, max))
        low_y, high_y = (f(math.log10(e) for _, e in points) for f in (min, max))
        low_y, high_y = low_y - 0.05, high_y + 0.05

        def x_of(t):
            return margin + (math.log10(t) - low_x) / (high_x - low_x or 1) * (width - margin - 12)

        def y_of(e):
            return 24 + (high_y - math.log10(e)) / (high_y - low_y) * (height - 24 - margin)

        parts = [f'<g transform="translate({number * width},0)">',
                 f'<text x="{margin}" y="15">{scene}</text>',
                 f'<rect x="{margin}" y="24" width="{width - margin - 12}" '
                 f'height="{height - 24 - margin}" fill="none" stroke="#999"/>']
        for t in sorted({round(t) for t, _ in points} - {0}):
            if low_x <= math.log10(t) <= high_x:
                parts.append(f'<text x="{x_of(t):.1f}" y="{height - margin + 14}" '
                             f'text-anchor="middle">{t} s</text>')
        for e in (10.0 ** low_y * 1.13, 10.0 ** high_y / 1.13):
            parts.append(f'<text x="{margin - 3}" y="{y_of(e) + 4:.1f}" '
                         f'text-anchor="end">{e:.0e}</text>')
        for (controller, curve), colour in zip(curves.items(), COLOURS):
            line = " ".join(f"{x_of(t):.1f},{y_of(e):.1f}" for t, e in sorted(curve))
            parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" '
                         f'stroke-width="1.6"/>')
        parts.append("</g>")
        panels.append("\n".join(parts))
    legend = "".join(
        f'<text x="{margin + 140 * i}" y="{height - 8}" fill="{colour}">{name}</text>'
        for i, (name, colour) in enumerate(zip(CONTROLLERS, COLOURS)))
    pathlib.Path(path).write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{max(900, width * len(results))}" '
        f'height="{height}" font-family="sans-serif" font-size="10">\n'
        f'<rect width="100%" height="100%" fill="white"/>\n' + "\n".join(panels) + legend +
        "</svg>\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="+", metavar="NAME=SCENE,REFERENCE[,MASK]")
    parser.add_argument("--times", default="2,5")
    parser.add_argument("--plot")
    parser.add_argument("--bin", default=pathlib.Path(__file__).parents[2] / "build/release/bin")
    arguments, flags = parser.parse_known_args()
    flags = [flag for flag in flags if flag != "--"]
    lucerna = pathlib.Path(arguments.bin) / "lucerna"
    times = arguments.times.split(",")
    print("| scene | s | " + " | ".join(CONTROLLERS) + " |")
    print("|---|---|" + "---|" * len(CONTROLLERS))
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        for text in arguments.scenes:
            name, _, paths = text.partition("=")
            scene, reference, *mask = paths.split(",")
            results[name] = {controller: [] for controller in CONTROLLERS}
            for seconds in times:
                row = []
                for controller in CONTROLLERS:
                    spent, error = measure(lucerna, scene, reference, mask[0] if mask else None,
                                           controller, seconds, flags, pathlib.Path(folder))
                    results[name][controller].append((spent, error))
                    row.append(f"{error:.2e}")
                print(f"| {name} | {seconds} | " + " | ".join(row) + " |", flush=True)
    if arguments.plot:
        plot(results, arguments.plot)


if __name__ == "__main__":
    main()
