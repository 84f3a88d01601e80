"""A job at one moment, as plain values."""

import dataclasses
import math
from typing import Any, Self

from google.protobuf import duration_pb2

from lucerna.errors import printable
from lucerna.v1 import jobs_pb2, values_pb2

ENDED = frozenset({"succeeded", "cancelled", "failed"})


def _name(enum: Any, number: int, prefix: str) -> str:
    """"running" of JOB_STATE_RUNNING; "" of UNSPECIFIED."""
    name = enum.Name(number) if number in enum.values() else str(number)
    name = name.removeprefix(prefix).lower()
    return "" if name == "unspecified" else name


def _root(squared: float) -> float:
    return math.sqrt(max(0.0, squared))


@dataclasses.dataclass(frozen=True)
class ErrorEstimate:
    """Relative errors, roots of relMSE: 0.02 is 2 %. Without the worst 0.1 % of pixels, but for the
    untrimmed ones."""
    value: float
    # The interval that holds the true error: 95 % of jobs have it inside at all estimates.
    low: float
    high: float
    untrimmed: float
    # Against the job's reference image, if it has one.
    true: float | None = None
    true_untrimmed: float | None = None

    def __str__(self) -> str:
        return f"{100 * self.value:.3g} % ({100 * self.low:.3g} % to {100 * self.high:.3g} %)"

    @classmethod
    def of_sample(cls, sample: jobs_pb2.ErrorSample) -> Self:
        squared = sample.relative
        return cls(
            value=_root(squared.noise + squared.bias), low=_root(squared.low),
            high=_root(squared.high), untrimmed=_root(sample.relative_untrimmed),
            true=_root(sample.true_relative) if sample.HasField("true_relative") else None,
            true_untrimmed=(_root(sample.true_relative_untrimmed)
                            if sample.HasField("true_relative_untrimmed") else None))


@dataclasses.dataclass(frozen=True)
class ErrorSample:
    """What was known of the error at one moment."""
    passes: int
    photons: int
    seconds: float      # wall time since the job began to run
    cpu_seconds: float  # of coordinator and workers
    # None: the image was black, and nothing is known of its error.
    error: ErrorEstimate | None


@dataclasses.dataclass(frozen=True)
class JobState:
    job_id: str
    name: str
    # queued, preparing, running, paused, succeeded, cancelled or failed.
    state: str
    stop_reason: str        # of succeeded: passes, time, error, photons or user
    failure: str            # of failed: what went wrong and what to do
    condition: str          # of paused: why, and when it goes on
    has_workers: bool       # False: it runs, and no worker is connected
    passes: int             # merged into the image
    photons: int
    seconds: float          # wall time in which the job ran and a worker was connected
    cpu_seconds: float      # of coordinator and workers
    photons_per_second: float
    workers: int
    # The newest estimate; None before the first one, and while the image is black.
    error: ErrorEstimate | None
    # The whole record, oldest first; empty in lists of jobs.
    samples: tuple[ErrorSample, ...]
    # By the names that `Client.submit` takes; empty until the job runs.
    settings: dict[str, str]
    scene_digest: str
    warnings: tuple[str, ...]
    owner: str
    priority: int
    # The protocol's own message, with what is not above: lights, workers, energy, events.
    message: jobs_pb2.Job = dataclasses.field(repr=False, compare=False)

    @property
    def has_ended(self) -> bool:
        return self.state in ENDED

    @classmethod
    def of_message(cls, job: jobs_pb2.Job) -> Self:
        samples = tuple(
            ErrorSample(passes=one.passes, photons=one.photons, seconds=_seconds(one.running),
                        cpu_seconds=_seconds(one.cpu),
                        error=None if one.nothing_found else ErrorEstimate.of_sample(one))
            for one in job.convergence)
        progress = job.progress
        return cls(
            job_id=printable(job.job_id), name=printable(job.name),
            state=_name(jobs_pb2.JobState, job.state, "JOB_STATE_"),
            stop_reason=_name(jobs_pb2.StopReason, job.stop_reason, "STOP_REASON_"),
            failure=printable(job.failure, keeps="\n"), condition=printable(job.condition),
            has_workers=not job.no_workers, passes=progress.passes, photons=progress.photons,
            seconds=_seconds(progress.running),
            cpu_seconds=_seconds(progress.coordinator_cpu) + _seconds(progress.worker_cpu),
            photons_per_second=progress.photons_per_second, workers=progress.workers,
            error=samples[-1].error if samples else None, samples=samples,
            settings=_settings(job.settings), scene_digest=job.scene_digest.hex(),
            warnings=tuple(map(printable, job.warnings)), owner=printable(job.owner),
            priority=job.priority, message=job)


def _seconds(duration: duration_pb2.Duration) -> float:
    return float(duration.seconds + duration.nanos * 1e-9)


# The wire names the unit, the command line does not.
WIRE_NAMES = {"time": "time_s"}
_FLAG_NAMES = {wire: flag for flag, wire in WIRE_NAMES.items()}


def _settings(settings: values_pb2.RenderSettings) -> dict[str, str]:
    return {_FLAG_NAMES.get(one.name, one.name): one.value for one in settings.settings}
