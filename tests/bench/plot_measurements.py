#!/usr/bin/env python3
"""Plots of the tables in docs/measurements.

  tests/bench/plot_measurements.py [FOLDER]

Reads the CSV files of FOLDER (docs/measurements by default; the first line of each is a comment with the
command that made the figures) and writes one SVG beside each that is worth a plot. Standard library only.
"""
import csv
import math
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
COLORS = ["#0b5", "#b40", "#05b", "#a0a", "#850", "#088", "#555"]
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 640, 340, 60, 190, 40, 60


def read(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def number(text):
    """The first number of a cell, or None."""
    found = re.match(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", text.strip())
    return float(found.group()) if found else None


def plot(path, title, x_names, lines, log_x=None, levels=()):
    """`lines`: label -> values, None where there is none, over `x_names`. The value axis is logarithmic.

    `log_x`: positions on a logarithmic axis, else the names are spread evenly. `levels`: horizontal lines.
    """
    values = [value for line in lines.values() for value in line if value is not None] + list(levels)
    low, high = min(values) / 1.15, max(values) * 1.15
    at = [math.log(x) for x in log_x] if log_x else list(range(len(x_names)))

    def x_of(index):
        share = (at[index] - at[0]) / ((at[-1] - at[0]) or 1)
        return LEFT + (WIDTH - LEFT - RIGHT) * share

    def y_of(value):
        share = math.log(value / low) / math.log(high / low)
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" '
           'font-family="sans-serif" font-size="11">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
           f'<text x="{LEFT}" y="20" font-size="13">{title}</text>',
           f'<path d="M{LEFT} {TOP}V{HEIGHT - BOTTOM}H{WIDTH - RIGHT}" fill="none" stroke="black"/>']
    for value in levels or (low * 1.15, math.sqrt(low * high), high / 1.15):
        out.append(f'<text x="4" y="{y_of(value) + 4:.1f}">{value:.2g}</text>')
        out.append(f'<line x1="{LEFT}" y1="{y_of(value):.1f}" x2="{WIDTH - RIGHT}" y2="{y_of(value):.1f}" '
                   'stroke="#ccc"/>')
    for index, name in enumerate(x_names):
        x, y = x_of(index), HEIGHT - BOTTOM + 12
        out.append(f'<text x="{x:.1f}" y="{y}" text-anchor="end" transform="rotate(-30 {x:.1f} {y})">'
                   f'{name}</text>')
    for row, (label, line) in enumerate(lines.items()):
        color = COLORS[row % len(COLORS)]
        dash = ' stroke-dasharray="4 3"' if row >= len(COLORS) else ""
        points = [(x_of(i), y_of(value)) for i, value in enumerate(line) if value is not None]
        joined = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        out.append(f'<polyline points="{joined}" fill="none" stroke="{color}"{dash}/>')
        out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{color}"/>' for x, y in points]
        out.append(f'<text x="{WIDTH - RIGHT + 12}" y="{TOP + 14 * row + 10}" fill="{color}">{label}</text>')
    path.write_text("\n".join(out + ["</svg>"]) + "\n", encoding="utf-8")


def error_against_time(folder):
    rows = [row for row in read(folder / "error-against-time.csv") if row["scene"] == "sphere-box, trimmed"]
    times = [name for name in rows[0] if name.endswith(" s")]
    plot(folder / "error-against-time.svg", "sphere-box: relMSE without the worst 0.1 % of pixels, by time",
         times, {row["renderer"]: [number(row[time]) for time in times] for row in rows},
         [number(time) for time in times])


def controllers(folder):
    rows = [row for row in read(folder / "controllers.csv") if row["s"] == "5"]
    names = [name for name in rows[0] if name not in ("scene", "s", "ppm")]
    plot(folder / "controllers.svg", "relMSE of each radius controller over that of ppm, after 5 s",
         [row["scene"] for row in rows],
         {name: [number(row[name]) / number(row["ppm"]) for row in rows] for name in names},
         levels=(0.2, 0.5, 1))


def noise_layer(folder):
    rows = read(folder / "noise-layer.csv")
    deciles = [name for name in rows[0] if name.startswith("decile")]
    plot(folder / "noise-layer.svg", "Deviation over seeds / layer noise, by decile of brightness", deciles,
         {row["scene"]: [number(row[name]) for name in deciles] for row in rows}, levels=(0.8, 1, 1.25))


def error_estimate(folder):
    rows = read(folder / "error-estimate-unseen.csv")
    rows = [row for row in rows if row["scene"] != "all"]
    lines = {}
    for part in ("first set", "second set"):
        cells = [re.findall(r"\d+\.\d+", row[f"{part}: estimated/true"]) for row in rows]
        for index, when in enumerate(("first", "middle", "last")):
            lines[f"{part}, {when} checkpoint"] = [float(cell[index]) for cell in cells]
    plot(folder / "error-estimate.svg", "Estimated over true error on unseen scenes",
         [row["scene"] for row in rows], lines, levels=(0.5, 0.8, 1, 1.25, 2))


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/measurements"
    for make in (error_against_time, controllers, noise_layer, error_estimate):
        make(folder)


if __name__ == "__main__":
    main()
