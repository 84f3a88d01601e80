#!/usr/bin/env python3
"""Error against time of one scene with several settings, as an SVG file.

  error_plot.py SCENE OUT.svg [--server HOST:PORT] [--passes N] [--size WxH] CONTROLLER...

Submits one job for each radius controller, follows them, and draws each one's estimated error with its
95 % interval against the processor time of coordinator and workers, on logarithmic axes.
"""

import argparse
import math
from xml.sax.saxutils import escape

import lucerna

WIDTH, HEIGHT, MARGIN = 640, 420, 60  # [pixels]
COLOURS = ["#1b6ca8", "#d1495b", "#3a7d44", "#8d5a97", "#c77d0a", "#444444"]


class Axis:
    """From values to pixels, logarithmic, with whole decades at its ends."""

    def __init__(self, values, start, end):
        self.low = math.floor(math.log10(min(values)))
        self.high = max(self.low + 1, math.ceil(math.log10(max(values))))
        self.start, self.end = start, end

    def __call__(self, value):
        share = (math.log10(value) - self.low) / (self.high - self.low)
        return self.start + min(max(share, 0), 1) * (self.end - self.start)

    def ticks(self):
        return [10.0 ** power for power in range(self.low, self.high + 1)]


def draw(curves):
    """curves: samples by name."""
    curves = {name: [one for one in samples if one.error and one.error.value > 0]
              for name, samples in curves.items()}
    samples = [one for curve in curves.values() for one in curve]
    if not samples:
        raise SystemExit("no light was found yet; give the jobs more passes")
    x = Axis([one.cpu_seconds for one in samples], MARGIN, WIDTH - 20)
    y = Axis([one.error.value for one in samples], HEIGHT - MARGIN, 20)
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" '
             'font-family="sans-serif" font-size="12">',
             '<rect width="100%" height="100%" fill="white"/>']
    for tick in x.ticks():
        parts.append(f'<path d="M{x(tick):.1f} {y.start}V{y.end}" stroke="#ddd"/>'
                     f'<text x="{x(tick):.1f}" y="{y.start + 18}" text-anchor="middle">'
                     f"{tick:g}</text>")
    for tick in y.ticks():
        parts.append(f'<path d="M{x.start} {y(tick):.1f}H{x.end}" stroke="#ddd"/>'
                     f'<text x="{x.start - 6}" y="{y(tick) + 4:.1f}" text-anchor="end">'
                     f"{100 * tick:g} %</text>")
    parts.append(f'<text x="{(x.start + x.end) / 2}" y="{HEIGHT - 16}" text-anchor="middle">'
                 "processor seconds of coordinator and workers</text>"
                 f'<text transform="translate(14 {(y.start + y.end) / 2}) rotate(-90)" '
                 'text-anchor="middle">relative error</text>')
    for number, (name, curve) in enumerate(curves.items()):
        colour = COLOURS[number % len(COLOURS)]
        low = [f"{x(one.cpu_seconds):.1f},{y(max(one.error.low, 1e-9)):.1f}" for one in curve]
        high = [f"{x(one.cpu_seconds):.1f},{y(one.error.high):.1f}" for one in curve]
        line = [f"{x(one.cpu_seconds):.1f},{y(one.error.value):.1f}" for one in curve]
        parts.append(f'<polygon points="{" ".join(low + high[::-1])}" fill="{colour}" '
                     'fill-opacity="0.15"/>'
                     f'<polyline points="{" ".join(line)}" fill="none" stroke="{colour}" '
                     'stroke-width="2"/>'
                     f'<text x="{x.end - 8}" y="{y.end + 18 + 16 * number}" text-anchor="end" '
                     f'fill="{colour}">{escape(name)}</text>')
    return "\n".join(parts + ["</svg>"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("controllers", nargs="+")
    parser.add_argument("--server")
    parser.add_argument("--passes", type=int, default=64)
    parser.add_argument("--size", default="256x256")
    given = parser.parse_args()
    with lucerna.Client(given.server) as client:
        jobs = {name: client.submit(given.scene, size=given.size, passes=given.passes,
                                    radius_controller=name) for name in given.controllers}
        curves = {name: job.wait().samples for name, job in jobs.items()}
    with open(given.out, "w", encoding="utf-8") as file:
        file.write(draw(curves))


if __name__ == "__main__":
    main()
