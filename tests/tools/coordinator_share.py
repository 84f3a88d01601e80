#!/usr/bin/env python3
"""Processor time of the coordinator over that of its workers, and photons and bytes, in a part of a job.

Usage: coordinator_share.py BIN SCENE [--workers 1] [--size 512x512] [--from 12] [--to 42] [--tenth]

Starts lucerna-server and workers of one thread of BIN on the loopback, submits SCENE and looks at it
twice, so many seconds after the submission. --tenth holds the coordinator to a tenth of a core, by a
control group of its own (needs root).
"""
import argparse
import json
import os
import subprocess
import time

ADDRESS = "127.0.0.1:7813"
GROUPS = "/sys/fs/cgroup"


def make_group():
    """A control group with a tenth of a core."""
    if os.path.exists(GROUPS + "/cgroup.controllers"):
        group = GROUPS + "/lucerna-tenth"
        os.makedirs(group, exist_ok=True)
        quota, text = group + "/cpu.max", "10000 100000"
    else:
        group = GROUPS + "/cpu/lucerna-tenth"
        os.makedirs(group, exist_ok=True)
        quota, text = group + "/cpu.cfs_quota_us", "10000"
    with open(quota, "w") as file:
        file.write(text)
    return group


def find(value, key):
    """The first value of this key, at any depth."""
    if isinstance(value, dict):
        if key in value:
            return value[key]
        value = list(value.values())
    if isinstance(value, list):
        for part in value:
            found = find(part, key)
            if found is not None:
                return found
    return None


def processor_s(process):
    with open(f"/proc/{process.pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("bin")
    parser.add_argument("scene")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--size", default="512x512")
    parser.add_argument("--from", dest="begin", type=float, default=12)
    parser.add_argument("--to", dest="end", type=float, default=42)
    parser.add_argument("--tenth", action="store_true")
    args = parser.parse_args()
    group = make_group() if args.tenth else None

    def join():
        if group:
            with open(group + "/cgroup.procs", "w") as file:
                file.write(str(os.getpid()))

    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    programs = [subprocess.Popen([args.bin + "/lucerna-server", "--listen", ADDRESS],
                                 preexec_fn=join, **quiet)]
    try:
        time.sleep(2)
        programs += [subprocess.Popen([args.bin + "/lucerna-worker", "--server", ADDRESS,
                                       "--threads", "1"], **quiet) for _ in range(args.workers)]
        time.sleep(2)
        subprocess.run([args.bin + "/lucerna", "submit", args.scene, "--server", ADDRESS, "--size",
                        args.size, "--time", "86400"], check=True, **quiet)

        def look():
            text = subprocess.run([args.bin + "/lucerna", "jobs", "--server", ADDRESS, "--json",
                                   "--full"], capture_output=True, check=True, text=True).stdout
            jobs = json.loads(text)
            count = [float(find(jobs, key) or 0)
                     for key in ("photons", "sent_bytes", "received_bytes")]
            return time.time(), count[0], count[1] + count[2], [processor_s(p) for p in programs]

        time.sleep(args.begin)
        t0, photons0, bytes0, cpu0 = look()
        time.sleep(args.end - args.begin)
        t1, photons1, bytes1, cpu1 = look()
        spent = [b - a for a, b in zip(cpu0, cpu1)]
        photons = photons1 - photons0
        print(f"{photons / (t1 - t0):.4g} photons/s, coordinator {spent[0]:.2f} s, "
              f"workers {sum(spent[1:]):.2f} s, ratio {spent[0] / sum(spent[1:]):.4f}, "
              f"{(bytes1 - bytes0) / photons:.2f} bytes a photon")
    finally:
        for program in programs:
            program.terminate()
        for program in programs:
            program.wait()


main()
