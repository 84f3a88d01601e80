#!/usr/bin/env python3
"""How does the error fall with time, and how true is what the program says of it?

  tests/bench/convergence.py [--times 1,5] [--settings default,pppm,frequency-mse]
                             [--scenes NAME,...] [--references-only]

Renders the twelve scenes of half B of make_study_scenes.py (no constant of the error estimate has
seen them) and twelve others through a coordinator and a worker of its own. For every scene, setting
and time it notes the estimated error with its interval and, against a reference whose own noise is
taken off, the true error with and without the worst 0.1 % of pixels. Errors are roots of relMSE.

Times are processor time of coordinator and worker over two, seconds of a machine of two idle cores:
what else runs on the machine does not matter. One job of each scene goes on from one time to the
next.

References are in --references. One that is missing is made: some six hours of two cores for all,
--references-only for nothing else. Each has so many passes that its squared noise is at most a tenth
of what is judged after 60 s, and that is taken off. It has less blur than a job's image, or none, or bias
that falls slowly would be hidden in it (docs/measurements/references.md). The judged renders take
half an hour.

Results are kept in docs/convergence/results.csv: what is there is not rendered again, so that the
program can be stopped and started. At the end, and after every scene, the page docs/convergence.md
and a plot for each scene are written from the table.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
BIN = ROOT / "build/release/bin"
OWN = ["hard-shadow", "penumbra", "water-sun", "pool", "caustic", "cardioid", "corner",
       "glass-box", "glass-sphere", "lamp-in-glass", "rough-metal", "textured"]
# Where light has edges, how lucerna-unblurred-reference makes an image without the kernel's blur
# (docs/measurements/references.md), with photons a pixel and pass and passes of either half. Else the
# first radius, photons a pixel and pass, and passes of both halves. These numbers follow from the
# noise of a few seeds: of photons a pass the best of 1, 4 and 16, and as many passes as should bring
# the squared noise to 0.08 to 0.1 of what was judged.
UNBLURRED = {"closed-form", "light", "fine"}
REFERENCES = {
    "b-bars-1": ("closed-form",),
    "b-beads-1": ("2px", 4, 12500),
    "b-checkers-1": ("2px", 4, 28100),
    "b-emitters-1": ("2px", 4, 28300),
    "b-emitters-2": ("2px", 1, 64000),
    "b-enclosed-1": ("2px", 16, 4800),
    "b-glossy-1": ("2px", 1, 64600),
    "b-glossy-2": ("2px", 4, 24300),
    "b-holes-1": ("2px", 16, 17300),
    "b-holes-2": ("2px", 4, 60000),
    "b-waves-1": ("fine", 256, 75),
    "b-waves-2": ("fine", 256, 50),
    "cardioid": ("light", 4, 3500),
    "caustic": ("1px", 4, 72000),
    "corner": ("2px", 16, 27600),
    "glass-box": ("2px", 4, 21400),
    "glass-sphere": ("2px", 1, 57700),
    "hard-shadow": ("light", 4, 1500),
    "lamp-in-glass": ("2px", 16, 6400),
    "penumbra": ("closed-form",),
    "pool": ("fine", 256, 20),
    "rough-metal": ("2px", 4, 23000),
    "textured": ("2px", 1, 16700),
    "water-sun": ("light", 4, 1000),
}
SIZE = "128x128"
FLAGS = {"default": [], "pppm": ["--radius-controller", "pppm"],
         "frequency-mse": ["--radius-controller", "frequency-mse"]}
COLUMNS = ["scene", "setting", "time_s", "passes", "photons", "estimated", "low", "high",
           "true_trimmed", "true_untrimmed", "reference_noise"]


def run(command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stdout


class Cluster:
    """A coordinator and a worker on a free port."""

    def __init__(self, log):
        self.server = subprocess.Popen([BIN / "lucerna-server", "--listen", "127.0.0.1:0"],
                                       stdout=log, stderr=log)
        self.log = pathlib.Path(log.name)
        self.address = self.find_address()
        self.worker = subprocess.Popen([BIN / "lucerna-worker", "--server", self.address],
                                       stdout=log, stderr=log)

    def find_address(self):
        for _ in range(100):
            for word in self.log.read_text(encoding="utf-8").split():
                if word.startswith("127.0.0.1:") and not word.endswith(":0"):
                    return word.rstrip(",;.")
            time.sleep(0.1)
        sys.exit("the coordinator did not say where it listens")

    def close(self):
        for process in (self.worker, self.server):
            process.terminate()
            process.wait()

    def seconds(self):
        """Processor time of both programs over two."""
        ticks = 0
        for process in (self.worker, self.server):
            stat = pathlib.Path(f"/proc/{process.pid}/stat").read_text(encoding="utf-8")
            ticks += sum(map(int, stat.rpartition(")")[2].split()[11:13]))
        return ticks / os.sysconf("SC_CLK_TCK") / 2

    def lucerna(self, *words):
        return run([BIN / "lucerna", *words, "--server", self.address])


class Job:
    """A job that goes on from one time to the next."""

    FIRST_PASSES = 4

    def __init__(self, cluster, scene, flags):
        self.cluster = cluster
        self.start = cluster.seconds()
        self.passes = self.FIRST_PASSES
        self.name = json.loads(cluster.lucerna("submit", scene, "--passes", self.passes, *flags,
                                               "--json"))["job_id"]
        self.wait()

    def wait(self):
        self.cluster.lucerna("watch", self.name, "--quiet")
        self.seconds = self.cluster.seconds() - self.start

    def go_on_to(self, seconds):
        """At least to 95 % of this time. The first passes tell little of what later ones take."""
        while self.seconds < 0.95 * seconds:
            grown = min(seconds / self.seconds, 2 if self.passes < 32 else 100)
            self.passes = max(self.passes + 1, round(self.passes * grown))
            self.cluster.lucerna("extend", self.name, "--passes", self.passes)
            self.wait()

    def fetch(self, image):
        """The report; the image goes to `image`."""
        self.cluster.lucerna("fetch", self.name, "-o", image, "--quiet")
        return json.loads(self.cluster.lucerna("report", self.name, "--json"))


def true_error(image, reference, trim):
    diff = json.loads(run([BIN / "lucerna", "diff", image, reference, "--json",
                           *(["--trim", "0.001"] if trim else [])]))
    noise = diff.get("reference_rel_mse") or 0.0
    return math.sqrt(max(diff["rel_mse"] - noise, 0.0)), math.sqrt(max(noise, 0.0))


def scene_digest(image):
    """Of the scene that an image shows. EXR stores text attributes as they are."""
    return re.search(rb"lucerna\.scene_digest\0string\0.{4}([0-9a-f]{64})", image.read_bytes(),
                     re.DOTALL)[1]


def row_of(name, setting, seconds, report, image, reference):
    if scene_digest(image) != scene_digest(reference):
        sys.exit(f"{reference}: it shows the scene as it was once; remove it, and it is made again")
    error = report["convergence"][-1]["relative"]
    trimmed, noise = true_error(image, reference, trim=True)
    untrimmed, _ = true_error(image, reference, trim=False)
    return {"scene": name, "setting": setting, "time_s": f"{seconds:g}", "passes": report["passes"],
            "photons": report["photons"],
            "estimated": math.sqrt(error["noise"] + error["bias"]),
            "low": math.sqrt(error["low"]), "high": math.sqrt(error["high"]),
            "true_trimmed": trimmed, "true_untrimmed": untrimmed, "reference_noise": noise}


def reference_of(name, path, folder):
    """The reference of a scene; it is made where it is missing."""
    reference = folder / f"{name}.exr"
    if not reference.exists():
        how, *counts = REFERENCES[name]
        if how in UNBLURRED:
            run([BIN / "lucerna-unblurred-reference", path, SIZE, reference, how, *counts])
            return reference
        photons, passes = counts
        pixels = math.prod(map(int, SIZE.split("x")))
        was_interrupted = reference.with_name(f"{reference.name}.checkpoints").exists()
        run([BIN / "lucerna", "reference", path, "--size", SIZE, "--quiet", "--seed", "1000003",
             "--radius-controller", "appm", "--initial-radius", how,
             "--photons-per-pass", photons * pixels, "--passes", passes, "-o", reference,
             *(["--resume"] if was_interrupted else [])])
    return reference


def measure(cluster, name, path, wanted, reference, folder):
    """Rows of `wanted` [(setting, seconds)], in order of time for each setting."""
    reports = []
    job = None
    for setting, seconds in wanted:
        if job is None or setting != reports[-1][0]:
            job = Job(cluster, path, ["--size", SIZE, *FLAGS[setting]])
        job.go_on_to(seconds)
        image = folder / f"{setting}-{seconds:g}.exr"
        reports.append((setting, seconds, job.fetch(image), image))
    return [row_of(name, *report, reference) for report in reports]


def read_rows(path):
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def append_row(path, row):
    is_new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerow({key: f"{value:.6g}" if isinstance(value, float) else value
                         for key, value in row.items()})


def number(row, column):
    return float(row[column])


def is_inside(row):
    return number(row, "low") <= number(row, "true_trimmed") <= number(row, "high")


def plot(path, name, rows):
    """True error (line), estimate (circles) and interval (bars) against time, both logarithmic."""
    width, height, margin = 420, 300, 45
    rows = sorted(rows, key=lambda row: number(row, "time_s"))
    times = [number(row, "time_s") for row in rows]
    values = [number(row, column) for row in rows for column in ("low", "high", "true_trimmed")]
    low, high = max(min(values), 1e-5) * 0.8, max(values) * 1.25
    span = math.log(max(times) / min(times)) or 1.0

    def place(seconds, value):
        x = margin + (width - 2 * margin) * math.log(seconds / min(times)) / span
        y = height - margin - (height - 2 * margin) * (
            math.log(max(value, low) / low) / math.log(high / low))
        return f"{x:.1f}", f"{y:.1f}"

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
           'font-family="sans-serif" font-size="11">',
           f'<rect width="{width}" height="{height}" fill="white"/>',
           f'<text x="{margin}" y="20">{name}: error against time, true (line), estimated with '
           'interval</text>']
    line = " ".join(",".join(place(t, number(r, "true_trimmed"))) for t, r in zip(times, rows))
    out.append(f'<polyline points="{line}" fill="none" stroke="black"/>')
    for t, row in zip(times, rows):
        x, y = place(t, number(row, "estimated"))
        _, y_low = place(t, number(row, "low"))
        _, y_high = place(t, number(row, "high"))
        out.append(f'<line x1="{x}" y1="{y_low}" x2="{x}" y2="{y_high}" stroke="#b40"/>')
        out.append(f'<circle cx="{x}" cy="{y}" r="3" fill="none" stroke="#b40"/>')
        out.append(f'<text x="{x}" y="{height - 25}" text-anchor="middle">{t:g} s</text>')
    for value in (low * 1.25, high / 1.25):
        _, y = place(times[0], value)
        out.append(f'<text x="4" y="{y}">{100 * value:.2g} %</text>')
    out.append("</svg>")
    path.write_text("\n".join(out) + "\n", encoding="utf-8")


def share_line(title, rows):
    ratios = [number(row, "estimated") / number(row, "true_trimmed") for row in rows
              if number(row, "true_trimmed") > 0]
    if not ratios:
        return ""
    near = sum(0.8 <= ratio <= 1.25 for ratio in ratios)
    inside = sum(map(is_inside, rows))
    return (f"* {title}: estimated/true within 0.8 to 1.25 in {near} of {len(ratios)} "
            f"({min(ratios):.2f} to {max(ratios):.2f}); true error within the interval in {inside} "
            f"of {len(rows)}; reference's squared noise at most "
            f"{max((number(r, 'reference_noise') / max(number(r, 'true_trimmed'), 1e-9))**2 for r in rows):.2f} "
            "of what is judged.\n")


def plot_overview(path, rows):
    """Estimated over true error of all scenes and times, logarithmic, with lines at 0.8, 1 and 1.25."""
    names = sorted({row["scene"] for row in rows})
    left, step, width = 100, 15, 480
    height = 60 + step * len(names)

    def x_of(ratio):
        return left + (width - left - 20) * math.log(max(0.5, min(ratio, 3)) / 0.5) / math.log(6)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
           'font-family="sans-serif" font-size="11">',
           f'<rect width="{width}" height="{height}" fill="white"/>',
           '<text x="8" y="18">Estimated over true error; filled: the true error is within the interval</text>']
    for ratio in (0.5, 0.8, 1, 1.25, 2, 3):
        out.append(f'<line x1="{x_of(ratio):.1f}" y1="40" x2="{x_of(ratio):.1f}" y2="{height - 12}" stroke="#ccc"/>')
        out.append(f'<text x="{x_of(ratio):.1f}" y="35" text-anchor="middle">{ratio:g}</text>')
    for row in rows:
        if number(row, "true_trimmed") > 0:
            y = 55 + step * names.index(row["scene"])
            x = x_of(number(row, "estimated") / number(row, "true_trimmed"))
            fill = "#05b" if is_inside(row) else "none"
            out.append(f'<circle cx="{x:.1f}" cy="{y}" r="3.5" fill="{fill}" stroke="#05b"/>')
    out += [f'<text x="8" y="{59 + step * i}">{name}</text>' for i, name in enumerate(names)]
    path.write_text("\n".join(out + ["</svg>"]) + "\n", encoding="utf-8")


def write_page(rows, docs):
    page = ["# How the error falls\n",
            f"Made by `tests/bench/convergence.py` ({SIZE} pixels). The error is the root of relMSE; its floor follows the image. "
            "\"True\" is against the reference with the reference's own noise taken off, \"all\" "
            "with the worst 0.1 % of pixels. Scenes b-* are half B of "
            "`tests/tools/make_study_scenes.py`, which no constant of the estimate has seen. All figures "
            "are in [results.csv](convergence/results.csv). References "
            "begin with a radius of 1 or 2 px or, of eight scenes whose light has edges, have none or one of "
            "an eighth of a pixel: they show bias that falls slowly. Columns: errors as fractions, `low` and `high` of the "
            "95 % interval, `true_trimmed` without the worst 0.1 % of pixels.\n",
            "![Estimated over true error](convergence/overview.svg)\n"]
    judged = [row for row in rows if row["setting"] == "default"]
    half_b = [row for row in judged if row["scene"].startswith("b-")]
    page.append(share_line("Half B", half_b) +
                share_line("Other scenes", [row for row in judged if row not in half_b]))
    plot_overview(docs / "convergence/overview.svg", judged)
    page.append("Plots: " + ", ".join(
        f"[{name}](convergence/{name}.svg)" for name in sorted({row["scene"] for row in judged})))
    (docs / "convergence.md").write_text("\n".join(page) + "\n", encoding="utf-8")
    for name in {row["scene"] for row in judged}:
        plot(docs / "convergence" / f"{name}.svg", name,
             [row for row in judged if row["scene"] == name])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--times", default="1,2,5,10,20,60")
    parser.add_argument("--settings", default="default")
    parser.add_argument("--scenes", default="", help="names, by commas; empty: all 24")
    parser.add_argument("--references", type=pathlib.Path,
                        default=ROOT / "tests/bench/references")
    parser.add_argument("--references-only", action="store_true")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "build/convergence")
    parser.add_argument("--docs", type=pathlib.Path, default=DOCS)
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    # As `lucerna render` and the units of systemd start them.
    os.environ.setdefault("GLIBC_TUNABLES", "glibc.malloc.hugetlb=1")
    arguments.references.mkdir(parents=True, exist_ok=True)
    (arguments.docs / "convergence").mkdir(parents=True, exist_ok=True)
    run([ROOT / "tests/tools/make_study_scenes.py", arguments.work / "scenes", "--half", "b"])
    scenes = {path.stem: path for path in sorted((arguments.work / "scenes").glob("b-*.pbrt"))}
    scenes |= {name: ROOT / "tests/scenes" / f"{name}.pbrt" for name in OWN}
    if arguments.scenes:
        scenes = {name: scenes[name] for name in arguments.scenes.split(",")}
    if arguments.references_only:
        for name, path in scenes.items():
            reference_of(name, path, arguments.references)
        return
    table = arguments.docs / "convergence" / "results.csv"
    done = {(row["scene"], row["setting"], float(row["time_s"])) for row in read_rows(table)}
    times = sorted(float(word) for word in arguments.times.split(","))
    with tempfile.TemporaryDirectory() as folder, \
            (arguments.work / "cluster.log").open("w", encoding="utf-8") as log:
        cluster = Cluster(log)
        try:
            for index, (name, path) in enumerate(scenes.items(), 1):
                wanted = [(setting, seconds) for setting in arguments.settings.split(",")
                          for seconds in times if (name, setting, seconds) not in done]
                if not wanted:
                    continue
                print(f"{index} of {len(scenes)}: {name}", flush=True)
                reference = reference_of(name, path, arguments.references)
                for row in measure(cluster, name, path, wanted, reference, pathlib.Path(folder)):
                    append_row(table, row)
                    print(f"  {row['setting']} {row['time_s']} s: true "
                          f"{100 * row['true_trimmed']:.2f} %, estimated "
                          f"{100 * row['estimated']:.2f} %", flush=True)
                write_page(read_rows(table), arguments.docs)
        finally:
            cluster.close()
    write_page(read_rows(table), arguments.docs)


if __name__ == "__main__":
    main()
