#!/usr/bin/env python3
"""Does the Python package do with real programs what it promises?

  client_test.py FOLDER_OF_PROGRAMS [names of tests]

77 where what it needs is missing.
"""

import json
import math
import os
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
import unittest.mock
import xml.etree.ElementTree
import zlib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PACKAGE = ROOT / "client/python"
SCENE = ROOT / "tests/scenes/caustic.pbrt"
SIZE = "48x36"
FOLDER = tempfile.TemporaryDirectory()


def skip(why):
    print(f"{why}: the Python package is not tested")
    sys.exit(77)


try:
    import grpc  # noqa: F401
    import numpy as np
    import google.protobuf  # noqa: F401
except ImportError as missing:
    skip(f"Python's module {missing.name} is missing (python3-grpcio, python3-protobuf, "
         "python3-numpy)")
for needed in ("protoc", "grpc_python_plugin"):
    if shutil.which(needed) is None:
        skip(f"{needed} is missing")
if len(sys.argv) < 2 or not (pathlib.Path(sys.argv[1]) / "lucerna").exists():
    sys.exit(f"usage: {sys.argv[0]} FOLDER_OF_PROGRAMS")
BIN = pathlib.Path(sys.argv.pop(1)).resolve()
os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"
for name in [name for name in os.environ if name.startswith("LUCERNA_")]:
    del os.environ[name]
# What gRPC itself prints of handshakes that fail, as they should.
os.environ["GRPC_VERBOSITY"] = "NONE"

SOURCE = pathlib.Path(FOLDER.name) / "package"
subprocess.run([sys.executable, PACKAGE / "build_backend.py", SOURCE], check=True)
sys.path.insert(0, str(SOURCE))
import lucerna  # noqa: E402


def lucerna_prints(*words):
    done = subprocess.run([BIN / "lucerna", *map(str, words)], capture_output=True, text=True,
                          check=False)
    if done.returncode != 0:
        raise AssertionError(f"{words}: {done.stderr}")
    return done.stdout


def lucerna_json(*words):
    return json.loads(lucerna_prints(*words))


class Programs:
    """A coordinator, and a worker of it unless it is not wanted."""

    def __init__(self, *flags, listen="127.0.0.1:0", worker=True):
        self.log = open(pathlib.Path(FOLDER.name) / "programs.log", "a", encoding="utf-8")
        self.server = subprocess.Popen([BIN / "lucerna-server", "--listen", listen, *flags],
                                       stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.address = self.server.stdout.readline().split()[-1]
        self.worker = worker and subprocess.Popen(
            [BIN / "lucerna-worker", "--server", self.address, "--threads", "1"],
            stdout=self.log, stderr=self.log)

    def close(self):
        for process in filter(None, (self.worker, self.server)):
            process.terminate()
            process.wait()
        self.server.stdout.close()
        self.log.close()


def run_without_jupyter(path, environment):
    """The code cells of a notebook, in order: what they displayed as SVG, and what they printed."""
    cells = ["".join(cell["source"]) for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]
             if cell["cell_type"] == "code"]
    script = "\n".join([
        "import sys, types",
        "module = types.ModuleType('IPython.display')",
        "plots = []",
        "module.SVG = lambda data: data",
        "class Shown:",
        "    update = staticmethod(plots.append)",
        "module.display = lambda plot, display_id: plots.append(plot) or Shown()",
        "sys.modules['IPython'] = types.ModuleType('IPython')",
        "sys.modules['IPython.display'] = module",
        *cells,
        "print('PLOT', plots[-1])",
    ])
    done = subprocess.run([sys.executable, "-c", script], cwd=path.parent, text=True,
                          env={**os.environ, **environment}, capture_output=True, check=False)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    said, plot = done.stdout.split("PLOT ", 1)
    return [plot], said


class TemporaryTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(dir=FOLDER.name)
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


class TextTest(unittest.TestCase):
    def test_what_a_terminal_would_obey_is_written_out(self):
        printable = lucerna.errors.printable
        self.assertEqual("a\\x1b[2J\\x0ab\\u{202e}", printable("a\x1b[2J\nb\u202e"))
        self.assertEqual("zwei\nZeilen: Größe 5\u00a0µm 影 \U0001f469\u200d\U0001f52c",
                         printable("zwei\nZeilen: Größe 5\u00a0µm 影 \U0001f469\u200d\U0001f52c",
                                   keeps="\n"))


# --- Files ---


def exr(channels, compression, lines_per_block, window=(0, 0), texts=()):
    """An EXR file of scanlines. `channels`: arrays of float32, float16 or uint32 by name."""
    channels = dict(sorted(channels.items()))
    height, width = next(iter(channels.values())).shape
    kinds = {"uint32": 0, "float16": 1, "float32": 2}

    def attribute(name, kind, content):
        return f"{name}\0{kind}\0".encode() + struct.pack("<i", len(content)) + content

    def pack(plain):
        order = np.frombuffer(plain[0::2] + plain[1::2], dtype=np.uint8).astype(int)
        order[1:] = (np.diff(order) + 128) % 256
        packed = zlib.compress(order.astype(np.uint8).tobytes())
        return packed if len(packed) < len(plain) else plain

    x, y = window
    corners = struct.pack("<iiii", x, y, x + width - 1, y + height - 1)
    head = struct.pack("<II", 20000630, 2)
    head += attribute("channels", "chlist", b"".join(
        name.encode() + b"\0" + struct.pack("<iIii", kinds[pixels.dtype.name], 0, 1, 1)
        for name, pixels in channels.items()) + b"\0")
    head += attribute("compression", "compression", bytes([compression]))
    head += attribute("dataWindow", "box2i", corners) + attribute("displayWindow", "box2i", corners)
    head += attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    for name, text in texts:
        head += attribute(name, "string", text.encode())
    head += b"\0"
    blocks = []
    for row in range(0, height, lines_per_block):
        plain = b"".join(pixels[line].tobytes()
                         for line in range(row, min(height, row + lines_per_block))
                         for pixels in channels.values())
        packed = plain if compression == 0 else pack(plain)
        blocks.append(struct.pack("<ii", y + row, len(packed)) + packed)
    offset = len(head) + 8 * len(blocks)
    table = b""
    for block in blocks:
        table += struct.pack("<Q", offset)
        offset += len(block)
    return head + table + b"".join(blocks)


NONE, ZIPS, ZIP = (0, 1), (2, 1), (3, 16)


class ExrTest(TemporaryTest):
    # A ramp gets smaller, noise does not and stands as it is. 37 lines are no multiple of 16.
    CHANNELS = {
        "R": np.linspace(-1, 1, 37 * 5, dtype=np.float32).reshape(37, 5),
        "G": np.random.default_rng(1).random((37, 5), dtype=np.float32),
        "B": np.full((37, 5), np.inf, dtype=np.float32),
        "noise": np.arange(37 * 5, dtype=np.float16).reshape(37, 5),
        "id.Q": np.arange(37 * 5, dtype=np.uint32).reshape(37, 5),
    }

    def test_every_compression_has_the_pixels_and_the_digest_that_the_program_reads(self):
        for compression in (NONE, ZIPS, ZIP):
            with self.subTest(compression=compression):
                path = self.folder / "image.exr"
                path.write_bytes(exr(self.CHANNELS, *compression, window=(3, -7),
                                     texts=[("lucerna.seed", "7"), ("lucerna.run.s", "1.5")]))
                image = lucerna.read_image(path)
                self.assertEqual(sorted(self.CHANNELS), sorted(image.channels))
                for name, pixels in self.CHANNELS.items():
                    self.assertEqual(pixels.astype(np.float32).tobytes(),
                                     image.channels[name].tobytes(), name)
                self.assertEqual({"lucerna.seed": "7", "lucerna.run.s": "1.5"}, image.metadata)
                self.assertEqual(lucerna_prints("digest", path).strip(), image.digest())

    def test_layers_have_their_components_in_order(self):
        plane = np.zeros((2, 3), dtype=np.float32)
        image = lucerna.Image({"B": plane + 3, "A": plane + 4, "R": plane + 1, "G": plane + 2,
                               "N.Z": plane + 3, "N.X": plane + 1, "N.Y": plane + 2, "Z": plane + 9})
        self.assertEqual({"beauty", "N", "Z"}, set(image))
        self.assertEqual([1, 2, 3, 4], image["beauty"][1, 2].tolist())
        self.assertEqual([1, 2, 3], image["N"][0, 0].tolist())
        self.assertEqual((2, 3), image["Z"].shape)
        self.assertRaises(KeyError, lambda: image["X"])

    def test_what_is_cut_off_is_an_error(self):
        content = exr(self.CHANNELS, *ZIP)
        for size in range(0, len(content) - 1):
            with self.assertRaisesRegex(lucerna.Error, "not a usable EXR file|cut off"):
                lucerna.decode_exr(content[:size])

    def test_damaged_bytes_are_an_error_or_an_image_of_the_size_that_they_say(self):
        content = exr({"R": self.CHANNELS["R"], "Z": self.CHANNELS["noise"]}, *ZIP)
        random.seed(1)
        errors = 0
        for _ in range(3000):
            damaged = bytearray(content)
            for _ in range(random.randint(1, 3)):
                damaged[random.randrange(len(damaged))] = random.randrange(256)
            try:
                image = lucerna.decode_exr(bytes(damaged))
                self.assertEqual({(image.height, image.width)},
                                 {pixels.shape for pixels in image.channels.values()})
            except lucerna.Error:
                errors += 1
        self.assertGreater(errors, 1000)

    def test_blocks_that_are_not_where_the_table_says_are_an_error(self):
        content = exr({"R": self.CHANNELS["G"]}, *ZIPS)
        table = len(content) - 37 * (8 + 8 + 5 * 4)
        swapped = (content[:table] + content[table + 8:table + 16] + content[table:table + 8] +
                   content[table + 16:])
        with self.assertRaisesRegex(lucerna.Error, "block of its scanlines is damaged"):
            lucerna.decode_exr(swapped)

    def test_a_small_file_takes_little_memory(self):
        content = bytearray(exr({"R": np.zeros((1, 1), dtype=np.float32)}, *NONE))
        at = content.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
        for corners in [(0, 0, (1 << 30), (1 << 30)), (0, 0, 0, (1 << 27)), (-(1 << 31), 0, 5, 5),
                        (0, 0, -1, 0)]:
            content[at:at + 16] = struct.pack("<iiii", *corners)
            with self.assertRaises(lucerna.Error):
                lucerna.decode_exr(bytes(content))


class DiffTest(unittest.TestCase):
    def test_an_even_error_has_its_closed_form(self):
        reference = np.full((10, 20, 3), 2.0)
        metrics = lucerna.diff(reference + 0.5, reference)
        # The luminance is 2, so the floor is 0.01 · 4.
        self.assertAlmostEqual(0.04, metrics.floor, delta=1e-15)
        self.assertAlmostEqual(0.25 / (4 + 0.04), metrics.rel_mse, delta=1e-15)
        self.assertAlmostEqual(0.5, metrics.rmse, delta=1e-15)
        self.assertAlmostEqual(1.25, metrics.mean_ratio, delta=1e-15)

    def test_trimming_leaves_the_worst_pixels_out_and_the_floor_the_brightest(self):
        reference = np.full((10, 100, 3), 1.0)
        reference[0, :10] = 1000  # 1 % of 1000 lit pixels
        image = reference.copy()
        image[5, 5] += 1          # 0.1 %
        metrics = lucerna.diff(image, reference)
        self.assertAlmostEqual(0.01, metrics.floor, delta=1e-15)
        self.assertEqual(0, metrics.rel_mse_trimmed)
        self.assertAlmostEqual(1 / 1.01 / 1000, metrics.rel_mse_untrimmed, delta=1e-15)
        self.assertEqual(999, lucerna.diff(image, reference, trim=0.001).pixels)

    def test_a_black_reference_gives_no_error_or_an_infinite_one(self):
        black = np.zeros((4, 4, 3))
        self.assertEqual(0, lucerna.diff(black, black).rel_mse)
        self.assertEqual(math.inf, lucerna.diff(black + 1, black).rel_mse)

    def test_what_cannot_be_compared_is_a_sentence(self):
        image = np.zeros((4, 5, 3))
        for other, sentence in [(np.zeros((5, 4, 3)), "differ in size: 5x4 and 4x5"),
                                (np.full((4, 5, 3), np.nan), r"reference is not finite at pixel \(0"),
                                (np.zeros((4, 5)), "must be an image")]:
            with self.assertRaisesRegex(lucerna.UsageError, sentence):
                lucerna.diff(image, other)
        masked = image.copy()
        masked[1, 2] = np.nan
        mask = np.ones((4, 5))
        mask[1, 2] = 0
        self.assertEqual(19, lucerna.diff(masked, image, mask=mask).pixels)
        with self.assertRaisesRegex(lucerna.UsageError, "no pixel left"):
            lucerna.diff(image, image, mask=np.zeros((4, 5)))


# --- Jobs ---


class JobsTest(TemporaryTest):
    @classmethod
    def setUpClass(cls):
        cls.programs = Programs()
        cls.addClassCleanup(cls.programs.close)
        cls.client = lucerna.Client(cls.programs.address)
        cls.addClassCleanup(cls.client.close)

    def submit(self, **settings):
        return self.client.submit(SCENE, **{"size": SIZE, **settings})

    def assert_same_figures(self, program, metrics, samples):
        # Sums of so many terms that are not negative, each right to samples · 2^-53 in any order; the
        # floor is a squared mean of such sums, within a quotient: four of them, in both.
        tolerance = 8 * samples * 2.0 ** -53
        for name in ("rmse", "rel_mse", "rel_mse_trimmed", "rel_mse_untrimmed", "floor", "mean_a",
                     "mean_b", "mean_ratio"):
            self.assertAlmostEqual(1, getattr(metrics, name) / program[name], delta=tolerance,
                                   msg=name)
        self.assertEqual(program["pixels"], metrics.pixels)

    def test_a_job_is_followed_and_its_image_is_that_of_the_program(self):
        job = self.submit(passes=6, radius_controller="ppm", unguided=True,
                          photons_per_pass=1000)
        self.assertTrue(any("Sampler" in warning for warning in job.warnings), job.warnings)
        states = list(job.watch())
        self.assertEqual("succeeded", states[-1].state)
        self.assertEqual("passes", states[-1].stop_reason)
        self.assertEqual([False] * (len(states) - 1) + [True], [one.has_ended for one in states])
        passes = [one.passes for one in states]
        self.assertEqual(sorted(passes), passes)
        last = states[-1]
        self.assertEqual((6, "6", "48x36", "ppm", "true"),
                         (last.passes, last.settings["passes"], last.settings["size"],
                          last.settings["radius_controller"], last.settings["unguided"]))
        self.assertEqual(6 * 1000, last.photons)
        self.assertEqual(6, last.samples[-1].passes)
        error = last.error
        self.assertTrue(0 < error.low <= error.value <= error.high, error)
        self.assertIsNone(error.true)
        self.assertRegex(str(error), r"^\S+ % \(\S+ % to \S+ %\)$")
        self.assertEqual(last, job.wait())

        path = self.folder / "fetched.exr"
        image = job.fetch(path)
        program = self.folder / "program.exr"
        lucerna_prints("fetch", job.job_id, "-o", program, "--server", self.programs.address)
        self.assertEqual(program.read_bytes(), path.read_bytes())
        self.assertEqual([path, program], sorted(self.folder.iterdir()))
        self.assertEqual(lucerna_prints("digest", program).strip(), image.digest())
        self.assertEqual(last.scene_digest, image.metadata["lucerna.scene_digest"])

        floats = self.folder / "program.pfm"
        lucerna_prints("png", program, floats)
        header, pixels = b"PF\n48 36\n-1", floats.read_bytes()
        self.assertEqual(header, pixels[:len(header)])
        # From the bottom to the top.
        self.assertEqual(image["beauty"][::-1].tobytes(), pixels[-4 * 3 * 48 * 36:])
        self.assertEqual((36, 48, 3), image["N"].shape)
        self.assertEqual((36, 48), image["noise"].shape)
        self.assertEqual(image.channels["direct.G"].tobytes(),
                         np.ascontiguousarray(image["direct"][:, :, 1]).tobytes())

    def test_diff_has_the_figures_of_the_program(self):
        images = []
        for seed in (1, 2):
            path = self.folder / f"{seed}.exr"
            job = self.submit(passes=4, seed=seed)
            job.wait()
            images.append((path, job.fetch(path)))
        (path_a, a), (path_b, b) = images
        self.assertNotEqual(a.digest(), b.digest())
        for flags, options in [([], {}), (["--trim", "0.05"], {"trim": 0.05}),
                               (["--floor", "0.5"], {"floor": 0.5}), (["--clip", "0.25"],
                                                                      {"clip": 0.25})]:
            with self.subTest(flags=flags):
                program = lucerna_json("diff", path_a, path_b, "--json", *flags)
                self.assert_same_figures(program, lucerna.diff(a, b, **options), 3 * 48 * 36)

    def test_a_reference_tells_true_errors_and_its_noise_and_settings_are_compared(self):
        path = self.folder / "reference.exr"
        lucerna_prints("reference", SCENE, "-o", path, "--passes", 16, "--size", SIZE, "--quiet")
        job = self.submit(passes=4, reference=path)
        state = job.wait()
        image_path = self.folder / "image.exr"
        image, reference = job.fetch(image_path), lucerna.read_image(path)
        metrics = lucerna.diff(image, reference)
        program = lucerna_json("diff", image_path, path, "--json")
        self.assert_same_figures(program, metrics, 3 * 48 * 36)
        self.assertAlmostEqual(1, metrics.reference_rel_mse / program["reference_rel_mse"],
                               delta=8 * 3 * 48 * 36 * 2.0 ** -53)
        # The coordinator measures pixels of 64 bits, of which the file has 32: each is right to 2^-24
        # of its value. The root of relMSE is a norm, so it is off by no more than that of these parts.
        a, b = image["beauty"].astype(float), reference["beauty"].astype(float)
        self.assertAlmostEqual(state.error.true, math.sqrt(metrics.rel_mse_trimmed), delta=2.0 ** -24 *
                               math.sqrt((a ** 2 / (b ** 2 + metrics.floor)).sum() / 3 / (48 * 36 - 1)))

        compared = lucerna.compare(SCENE, path, {"wide": {"alpha": 0.9, "radius_controller": "ppm"},
                                                 "even": {"unguided": True}},
                                   times=[0.2], repetitions=1, size=SIZE)
        self.assertEqual(["wide", "even"], [one["name"] for one in compared["settings"]])
        self.assertEqual(([0.2], 1), (compared["times_s"], compared["repetitions"]))
        self.assertEqual(["--alpha=0.9 --radius-controller=ppm", "--unguided"],
                         [one["flags"] for one in compared["settings"]])
        # Not figures after that time: on a busy machine a run may have had less of it.
        for one in compared["settings"]:
            self.assertGreater(one["runs"][0]["points"][-1]["measured_rel_mse"], 0)
        with self.assertRaisesRegex(lucerna.UsageError, "there is no setting alfa; did you mean alpha"):
            lucerna.compare(SCENE, path, {"wide": {"alfa": 0.9}})

    def test_a_job_that_goes_on_has_the_image_of_one_that_was_not_stopped(self):
        job = self.submit(passes=3)
        job.wait()
        job.extend(passes=6)
        self.assertEqual(6, job.wait().passes)
        whole = self.submit(passes=6)
        whole.wait()
        self.assertEqual(whole.fetch().digest(), job.fetch().digest())
        with self.assertRaisesRegex(lucerna.UsageError, "--error|error"):
            job.extend(error="much")

    def test_a_job_is_paused_resumed_stopped_listed_and_deleted(self):
        job = self.submit(time="1h")
        for state in job.watch():
            if state.passes > 0:
                break
        self.assertEqual("paused", job.pause().state)
        self.assertEqual([job.job_id], [one.job_id for one in self.client.jobs(states=["paused"])])
        self.assertEqual([], self.client.jobs(states=["paused"], name_contains="teapot"))
        with self.assertRaisesRegex(lucerna.UsageError, "asleep is no state"):
            self.client.jobs(states=["asleep"])
        self.assertEqual(5, job.set_priority(5).priority)
        job.extend(passes=1_000_000, time="2h")
        settings = job.state().settings
        self.assertEqual(("1000000", "7200"), (settings["passes"], settings["time"]))
        job.resume()
        # Of a job that runs: the image so far.
        self.assertIn("beauty", job.fetch())
        with self.assertRaises(lucerna.StateError):
            job.delete()
        job.stop()
        self.assertEqual("user", job.wait().stop_reason)
        job.delete()
        self.assertNotIn(job.job_id, [one.job_id for one in self.client.jobs()])
        with self.assertRaises(lucerna.NotFoundError):
            job.state()

    def test_a_long_list_of_jobs_comes_in_pages(self):
        submitted = [self.submit(passes=1).job_id for _ in range(3)]
        whole = [one.job_id for one in self.client.jobs()]
        self.assertEqual(submitted[::-1], whole[:3])
        with unittest.mock.patch.object(lucerna.client, "_PAGE", 2):
            self.assertEqual(whole, [one.job_id for one in self.client.jobs()])

    def test_a_cancelled_job_says_so(self):
        job = self.submit(time="1h")
        states = job.watch()
        next(states)
        self.assertEqual("cancelled", job.cancel().state)
        self.assertEqual("cancelled", list(states)[-1].state)
        with self.assertRaisesRegex(lucerna.JobFailedError, f"job {job.job_id} was cancelled"):
            job.wait()
        with self.assertRaisesRegex(lucerna.StateError, "cancelled"):
            job.fetch()

    def test_an_unknown_job_is_the_coordinators_sentence(self):
        job = self.client.job("nowhere")
        for call in (job.state, job.fetch, job.wait, job.cancel, job.delete, lambda: next(job.watch())):
            with self.assertRaisesRegex(lucerna.NotFoundError, "^there is no job nowhere"):
                call()

    def test_wrong_settings_and_scenes_are_the_programs_sentences(self):
        for settings, sentence in [
                ({"sise": "4x4"}, "there is no setting sise; did you mean size"),
                ({"output": "out.exr"}, "there is no setting output"),
                ({"error": "much"}, "^--error must be a share, like 2% or 0.02, not \"much\"$"),
                ({"unguided": False}, "unguided is given as True or left away, not False"),
                ({"priority": 500}, "priority")]:
            with self.assertRaisesRegex(lucerna.UsageError, sentence):
                self.client.submit(SCENE, **settings)
        broken = self.folder / "broken.pbrt"
        broken.write_text("WorldBegin\nShape \"teapot\"\n", encoding="utf-8")
        with self.assertRaisesRegex(lucerna.Error, "broken.pbrt:2:[0-9]+: "):
            self.client.submit(broken)
        with self.assertRaisesRegex(lucerna.Error, "cannot be run"):
            client = lucerna.Client(self.programs.address, program=self.folder / "lucerna")
            self.addCleanup(client.close)
            client.submit(SCENE, passes=1)

    def test_the_users_file_of_flags_does_not_count(self):
        (self.folder / "lucerna.toml").write_text('[submit]\nkernel = "constant"\n',
                                                  encoding="utf-8")
        with unittest.mock.patch.dict(os.environ, {"XDG_CONFIG_HOME": str(self.folder)}):
            self.assertEqual("epanechnikov", self.submit(passes=1).wait().settings["kernel"])

    def test_the_example_draws_every_sample(self):
        plot = self.folder / "plot.svg"
        subprocess.run([sys.executable, PACKAGE / "examples/error_plot.py", SCENE, plot, "--server",
                        self.programs.address, "--passes", "8", "--size", SIZE, "appm", "ppm"],
                       env={**os.environ, "PYTHONPATH": str(SOURCE)}, check=True)
        drawn = xml.etree.ElementTree.parse(plot)
        lines = drawn.findall(".//{http://www.w3.org/2000/svg}polyline")
        jobs = [one for one in self.client.jobs() if one.settings.get("passes") == "8"]
        counts = [len(self.client.job(one.job_id).state().samples) for one in jobs[:2]]
        self.assertEqual(sorted(counts), sorted(len(one.get("points").split()) for one in lines))

    def test_the_notebook_runs_and_draws_a_curve_for_each_controller(self):
        path = PACKAGE / "examples/error_against_time.ipynb"
        environment = {"LUCERNA_SCENE": str(SCENE), "LUCERNA_SERVER": self.programs.address,
                       "LUCERNA_SIZE": SIZE, "LUCERNA_PASSES": "8", "PYTHONPATH": str(SOURCE)}
        try:
            import ipykernel  # noqa: F401
            import nbclient
            import nbformat
        except ImportError:
            plots, said = run_without_jupyter(path, environment)
        else:
            notebook = nbformat.read(path, as_version=4)
            nbformat.validate(notebook)
            self.assertFalse(any(cell.get("outputs") for cell in notebook.cells),
                             "what a run has drawn is not part of the notebook")
            with unittest.mock.patch.dict(os.environ, environment):
                nbclient.NotebookClient(notebook, timeout=300, resources={
                    "metadata": {"path": str(path.parent)}}).execute()
            outputs = [output for cell in notebook.cells if cell.cell_type == "code"
                       for output in cell.outputs]
            plots = ["".join(output["data"]["image/svg+xml"]) for output in outputs
                     if "image/svg+xml" in output.get("data", {})]
            said = "".join(output["text"] for output in outputs
                           if output.output_type == "stream" and output.name == "stdout")
        lines = xml.etree.ElementTree.fromstring(plots[-1]).findall(
            ".//{http://www.w3.org/2000/svg}polyline")
        self.assertEqual(3, len(lines))
        for name in ("appm", "ppm", "frequency-mse"):
            self.assertRegex(said, rf"(?m)^{name} +[0-9.]+ % after +[0-9.]+ s, slope ")
            self.assertIn(f">{name}</text>", plots[-1])
        self.assertEqual(2, said.count("relMSE against appm"))

    def test_the_page_of_the_manual_runs_as_it_is(self):
        page = (ROOT / "docs/python.md").read_text(encoding="utf-8")
        script = re.search(r"```python\n(.*?)```", page, re.DOTALL)[1]
        for old, new in [("127.0.0.1:7400", self.programs.address), ("scene.pbrt", str(SCENE)),
                         ("256x256", SIZE)]:
            self.assertIn(old, script)
            script = script.replace(old, new)
        done = subprocess.run([sys.executable, "-c", script], cwd=self.folder, text=True,
                              env={**os.environ, "PYTHONPATH": str(SOURCE)}, capture_output=True,
                              check=False)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertRegex(done.stdout, r"\(36, 48, 3\) [0-9.e-]+ 0\n[0-9.e-]+\n$")


class ConnectionTest(TemporaryTest):
    def test_a_coordinator_that_is_not_there_is_unreachable(self):
        for address in ("127.0.0.1:1", "localhost:1"):
            with self.assertRaisesRegex(lucerna.UnreachableError,
                                        f"cannot reach the coordinator at {address}; is"):
                lucerna.Client(address, connect_timeout_s=0.5)

    def test_a_watch_outlives_a_restart_and_gives_up_without_a_coordinator(self):
        first = Programs("--state", str(self.folder / "state"), "--checkpoint-share", "1")
        self.addCleanup(first.close)
        with lucerna.Client(first.address, max_silence_s=60) as client:
            job = client.submit(SCENE, size=SIZE, time="1h")
            states = job.watch()
            for state in states:
                if state.passes >= 2:
                    break
            first.server.kill()
            first.server.wait()
            listed = []
            call = threading.Thread(target=lambda: listed.extend(client.jobs()))
            with unittest.mock.patch.object(lucerna.client, "_ATTEMPTS", 60):
                # Before there is a coordinator again.
                call.start()
                second = Programs("--state", str(self.folder / "state"), listen=first.address,
                                  worker=False)
                self.addCleanup(second.close)
                call.join()
            self.assertEqual([job.job_id], [one.job_id for one in listed])
            # Of the second one: the first has no news any more, the worker comes back.
            before = state.passes
            for state in states:
                if state.passes > before + 4:
                    break
            job.stop()
            self.assertEqual("succeeded", list(states)[-1].state)
            impatient = lucerna.Client(first.address, max_silence_s=0)
            self.addCleanup(impatient.close)
            other = impatient.submit(SCENE, size=SIZE, time="1h")
            states = other.watch()
            next(states)
            second.server.kill()
            with self.assertRaisesRegex(lucerna.UnreachableError, "cannot reach the coordinator"):
                list(states)
            with self.assertRaises(lucerna.UnreachableError):
                impatient.submit(SCENE, size=SIZE)

    def test_certificates_and_tokens(self):
        ca = self.folder / "ca"
        subprocess.run(["bash", ROOT / "deploy/dev-ca.sh", ca], check=True, capture_output=True)
        tokens = self.folder / "tokens"
        token = {}
        lines = []
        for user in ("alice", "bob"):
            made = lucerna_json("token", "new", user, "--roles", "submit", "--json")
            token[user] = made["token"]
            lines.append(made["line"])
        tokens.write_text("\n".join(lines) + "\n", encoding="utf-8")
        tokens.chmod(0o600)
        programs = Programs("--tokens", str(tokens), "--tls-ca", str(ca / "ca.pem"), "--tls-cert",
                            str(ca / "server.pem"), "--tls-key", str(ca / "server.key"), worker=False)
        self.addCleanup(programs.close)
        tls = lucerna.Tls(ca / "ca.pem", ca / "client.pem", ca / "client.key")
        with lucerna.Client(programs.address, token=token["alice"], tls=tls) as client:
            job = client.submit(SCENE, size=SIZE, passes=1)
            self.assertEqual("alice", job.state().owner)
            self.assertNotIn(token["alice"], repr(vars(job)))
            with self.assertRaisesRegex(lucerna.StateError, "."):
                job.fetch()
        with lucerna.Client(programs.address, token=token["bob"], tls=tls) as client:
            self.assertEqual("alice", client.job(job.job_id).state().owner)
            with self.assertRaises(lucerna.AccessError):
                client.job(job.job_id).cancel()
        with lucerna.Client(programs.address, tls=tls) as client:
            with self.assertRaises(lucerna.AccessError):
                client.jobs()
        with self.assertRaisesRegex(lucerna.UnreachableError, "if it uses TLS, give tls="):
            lucerna.Client(programs.address, connect_timeout_s=2)
        stranger = self.folder / "stranger"
        subprocess.run(["bash", ROOT / "deploy/dev-ca.sh", stranger], check=True,
                       capture_output=True)
        with self.assertRaisesRegex(lucerna.UnreachableError, "certificate verify failed"):
            lucerna.Client(programs.address, connect_timeout_s=2, tls=lucerna.Tls(
                stranger / "ca.pem", ca / "client.pem", ca / "client.key"))

    def test_a_token_does_not_travel_in_the_clear(self):
        with self.assertRaisesRegex(lucerna.UsageError, "would be readable on the way to farm:7400"):
            lucerna.Client("farm:7400", token="secret")
        with self.assertRaisesRegex(lucerna.UsageError, "not one line of printable"):
            lucerna.Client("127.0.0.1:1", token="two\nlines")


class InstallationTest(TemporaryTest):
    def test_pip_installs_it_without_a_network(self):
        environment = {name: value for name, value in os.environ.items()
                       if name != "PYTHONPATH" and not name.startswith("PIP_")}
        made = subprocess.run([sys.executable, "-m", "venv", "--system-site-packages",
                               self.folder / "env"], capture_output=True, check=False)
        if made.returncode != 0:
            self.skipTest("python3-venv is missing")
        python = self.folder / "env/bin/python3"
        installed = subprocess.run([python, "-m", "pip", "install", "--no-index", PACKAGE],
                                   env=environment, capture_output=True, text=True, check=False)
        self.assertEqual(0, installed.returncode, installed.stdout + installed.stderr)
        said = subprocess.run(
            [python, "-c", "import lucerna, importlib.metadata as m, pathlib; "
             "print(m.version('lucerna'), *lucerna.__path__); lucerna.Client"],
            cwd=self.folder, env=environment, capture_output=True, text=True, check=True).stdout.split()
        self.assertEqual(lucerna_prints("--version").split()[-1], said[0])
        self.assertIn(str(self.folder), said[1])
        self.assertTrue((pathlib.Path(said[1]) / "py.typed").exists())

    def test_nothing_generated_is_left_in_the_source_tree(self):
        self.assertEqual([], [str(path) for path in PACKAGE.rglob("*_pb2*.py")])


if __name__ == "__main__":
    unittest.main(verbosity=2)
