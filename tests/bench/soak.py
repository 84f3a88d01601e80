#!/usr/bin/env python3
"""Does a coordinator stay well over as many results as a farm delivers in a day?

Starts a coordinator with a state folder and workers on loopback and keeps small jobs of four kinds
coming until so many results of workers were merged: 86,400 are a day of one a second, of 64 workers
say whose leases take a minute. Every few seconds a worker is killed and another started; every
--restart results the coordinator is killed and started again in the same folder. Every job must
succeed with the image that the first job of its kind had. Writes a row every ten seconds: results,
jobs, resident memory of the coordinator and of the largest worker, open files, and bytes on disk.

  tests/bench/soak.py OUT.csv [--results N] [--workers N] [--restart N]
"""
import argparse
import csv
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = ROOT / "build/release/bin"
KINDS = [("glass-box.pbrt", "16x16", "96"), ("caustic.pbrt", "16x16", "96"),
         ("penumbra.pbrt", "12x20", "64"), ("hard-shadow.pbrt", "24x8", "128")]
KILL_WORKER_EVERY_S = 5
SUBMITTERS = 6


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def run(*words):
    done = subprocess.run([str(BIN / "lucerna"), *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"lucerna {' '.join(map(str, words))}: {done.stderr.strip()}")
    return done.stdout


class Farm:
    """The processes, of which workers and the coordinator are killed and replaced."""

    def __init__(self, folder, workers):
        self.folder = folder
        self.address = f"127.0.0.1:{free_port()}"
        self.metrics = f"127.0.0.1:{free_port()}"
        self.results_before = 0  # of coordinators that were killed
        self.last_results = 0
        self.kills = 0
        self.restarts = 0
        self.coordinator = self.start_coordinator()
        self.workers = [self.start_worker() for _ in range(workers)]

    def start(self, name, *words):
        log = open(self.folder / f"{name}.log", "a")
        return subprocess.Popen([str(BIN / name), *words], stdout=log, stderr=log)

    def start_coordinator(self):
        started = self.start("lucerna-server", "--listen", self.address, "--metrics", self.metrics,
                             "--state", str(self.folder / "state"), "--jobs-at-once", "4",
                             "--audit-share", "0.005", "--log-level", "warn")
        for _ in range(600):
            try:
                urllib.request.urlopen(f"http://{self.metrics}/metrics", timeout=1).read()
                return started
            except OSError:
                time.sleep(0.05)
        sys.exit("the coordinator does not start: " + str(self.folder / "lucerna-server.log"))

    def start_worker(self):
        return self.start("lucerna-worker", "--server", self.address, "--threads", "1",
                          "--log-level", "warn")

    def results(self):
        text = urllib.request.urlopen(f"http://{self.metrics}/metrics", timeout=10).read().decode()
        found = re.search(r'lucerna_results_total\{outcome="accepted"\} (\d+)', text)
        self.last_results = int(found.group(1))
        return self.results_before + self.last_results

    def kill_a_worker(self):
        worker = self.workers.pop(0)
        worker.kill()
        worker.wait()
        self.workers.append(self.start_worker())
        self.kills += 1

    def kill_coordinator(self):
        self.results()
        self.coordinator.kill()
        self.coordinator.wait()
        self.results_before += self.last_results
        self.coordinator = self.start_coordinator()
        self.restarts += 1

    def stop(self):
        for process in [*self.workers, self.coordinator]:
            process.send_signal(signal.SIGTERM)
            process.wait()


def resident_mb(pid):
    text = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", text).group(1)) / 1024


def disk_mb(folder):
    size = 0
    for name, _, files in os.walk(folder):
        for file in files:
            try:
                size += os.stat(os.path.join(name, file)).st_size
            except FileNotFoundError:  # between the listing and here
                pass
    return size / 2**20


def submit_one(farm, kind, folder):
    """Submits a job, waits for it and returns the digest of its image."""
    scene, size, passes = kind
    server = ["--server", farm.address]
    job = run("submit", ROOT / "tests/scenes" / scene, "--size", size, "--passes", passes, *server)
    job = job.split()[0]
    report = json.loads(run("wait", job, "--json", *server))
    if report["state"] != "SUCCEEDED":
        raise RuntimeError(f"job {job} ended as {report['state']}: {report}")
    image = folder / f"{job}.exr"
    run("fetch", job, "-o", image, "--quiet", *server)
    digest = run("digest", image).split()[0]
    image.unlink()
    return digest


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--results", type=int, default=86400)
    parser.add_argument("--workers", type=int, default=3)
    parser.add_argument("--restart", type=int, default=10000)
    arguments = parser.parse_args()

    digests, wrong, jobs = {}, [], 0
    lock = threading.Lock()
    is_over = threading.Event()
    with tempfile.TemporaryDirectory() as folder, arguments.out.open("w") as out:
        folder = pathlib.Path(folder)
        farm = Farm(folder, arguments.workers)

        def keep_submitting(number):
            nonlocal jobs
            turn = number
            while not is_over.is_set():
                kind = KINDS[turn % len(KINDS)]
                turn += 1
                try:
                    digest = submit_one(farm, kind, folder)
                except RuntimeError as error:
                    with lock:
                        wrong.append(str(error))
                    continue
                with lock:
                    jobs += 1
                    if digests.setdefault(kind, digest) != digest:
                        wrong.append(f"{kind}: {digest}, not {digests[kind]}")

        submitters = [threading.Thread(target=keep_submitting, args=[i]) for i in range(SUBMITTERS)]
        for submitter in submitters:
            submitter.start()
        out.write("# tests/bench/soak.py " + " ".join(sys.argv[1:]) + "\n")
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["seconds", "results", "jobs", "failures", "worker_kills", "restarts",
                         "coordinator_mb", "largest_worker_mb", "open_files", "disk_mb"])
        begin = time.monotonic()
        next_row, next_kill, next_restart = 0.0, KILL_WORKER_EVERY_S, arguments.restart
        results = 0
        try:
            while results < arguments.results and len(wrong) < 20:
                time.sleep(1)
                results = farm.results()
                seconds = time.monotonic() - begin
                if seconds >= next_row:
                    next_row += 10
                    with lock:
                        done, failures = jobs, len(wrong)
                    pid = farm.coordinator.pid
                    writer.writerow([round(seconds), results, done, failures, farm.kills, farm.restarts,
                                     round(resident_mb(pid), 1),
                                     round(max(resident_mb(w.pid) for w in farm.workers), 1),
                                     len(os.listdir(f"/proc/{pid}/fd")),
                                     round(disk_mb(folder / "state"), 1)])
                    out.flush()
                if seconds >= next_kill:
                    next_kill += KILL_WORKER_EVERY_S
                    farm.kill_a_worker()
                if results >= next_restart:
                    next_restart += arguments.restart
                    farm.kill_coordinator()
        finally:  # processes do not outlive this one
            is_over.set()
            for submitter in submitters:
                submitter.join()
            farm.stop()
    print(f"{results} results, {jobs} jobs, {farm.kills} workers killed, {farm.restarts} restarts, "
          f"{len(wrong)} failures")
    for line in wrong[:20]:
        print(line)
    sys.exit(1 if wrong or results < arguments.results else 0)


if __name__ == "__main__":
    main()
