"""How does a script talk to a coordinator?

`submit` runs the program `lucerna`, which reads scenes (lucerna/program.py); all else speaks the protocol.
Calls that may be made twice are tried again with growing pauses while the coordinator starts or is out
of reach for a moment, and a watch that breaks is opened again.
"""

import dataclasses
import ipaddress
import json
import os
import pathlib
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Self, TypeVar

import grpc

from lucerna import program as _program
from lucerna.errors import (AccessError, Error, JobFailedError, NotFoundError, StateError,
                            UnreachableError, UsageError, printable)
from lucerna.exr import decode_exr
from lucerna.image import Image
from lucerna.program import StrPath, Value
from lucerna.state import WIRE_NAMES, JobState
from lucerna.v1 import images_pb2, images_pb2_grpc, jobs_pb2, jobs_pb2_grpc

_CALL_S = 30.0
_ATTEMPTS = 7  # about six seconds of pauses in all
_FIRST_PAUSE_S = 0.1
_PAGE = 200  # jobs of a list that come at once
_LONGEST_PAUSE_S = 2.0
_MAX_IMAGE_BYTES = 8 << 30
# As render/wire/channel.cc: a machine that vanished is noticed, and no proxy for the web is asked.
_CHANNEL = [
    ("grpc.max_receive_message_length", 16 << 20),
    ("grpc.keepalive_time_ms", 10_000),
    ("grpc.keepalive_timeout_ms", 20_000),
    ("grpc.keepalive_permit_without_calls", 1),
    ("grpc.http2.max_pings_without_data", 0),
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.min_reconnect_backoff_ms", 20_000),
    ("grpc.max_reconnect_backoff_ms", 2_000),
    ("grpc.enable_http_proxy", 0),
]
_AGAIN = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED)
_CLASSES = {
    grpc.StatusCode.INVALID_ARGUMENT: UsageError,
    grpc.StatusCode.NOT_FOUND: NotFoundError,
    grpc.StatusCode.FAILED_PRECONDITION: StateError,
    grpc.StatusCode.UNAUTHENTICATED: AccessError,
    grpc.StatusCode.PERMISSION_DENIED: AccessError,
}
_Answer = TypeVar("_Answer")


@dataclasses.dataclass(frozen=True)
class Tls:
    """PEM files, as the flags --tls-ca, --tls-cert and --tls-key name them."""
    ca: StrPath
    certificate: StrPath
    key: StrPath


class Job:
    """One job of a coordinator, by its id. Every method that changes it returns its new state.

    Errors of all: NotFoundError, AccessError, UnreachableError, StateError."""

    def __init__(self, client: "Client", job_id: str, warnings: Iterable[str] = ()):
        self._client = client
        self.job_id = job_id
        # What was approximated or left out when the scene was read; of jobs from `submit`.
        self.warnings = tuple(map(printable, warnings))

    def __repr__(self) -> str:
        return f"<Job {self.job_id}>"

    def state(self) -> JobState:
        return self._client._change("Get", jobs_pb2.GetJobRequest(job_id=self.job_id))

    def watch(self) -> Iterator[JobState]:
        """The state at once and whenever it changes, at most about ten times a second and at least
        every five seconds. The last one has ended: succeeded, cancelled or failed."""
        return self._client._watch(self.job_id)

    def wait(self) -> JobState:
        """Until the job has ended. Errors: also JobFailedError when it did not succeed."""
        state = None
        for state in self.watch():
            pass
        assert state is not None
        if state.state == "cancelled":
            raise JobFailedError(f"job {self.job_id} was cancelled")
        if state.state == "failed":
            raise JobFailedError(f"job {self.job_id} failed: {state.failure}")
        return state

    def fetch(self, path: StrPath | None = None) -> Image:
        """The image, of a job that runs the image so far. With `path` the EXR file is written there
        too, whole or not at all. Errors: also StateError before the first pass."""
        content = self._client._image(self.job_id)
        try:
            image = decode_exr(content)
        except Error as error:
            raise Error(f"the image of job {self.job_id} arrived damaged; fetch it again: "
                        f"{error}") from None
        if path is not None:
            _write(pathlib.Path(path), content)
        return image

    def pause(self) -> JobState:
        return self._client._change("Pause", jobs_pb2.PauseJobRequest(job_id=self.job_id))

    def resume(self) -> JobState:
        return self._client._change("Resume", jobs_pb2.ResumeJobRequest(job_id=self.job_id))

    def stop(self) -> JobState:
        """Ends the job, and keeps its image."""
        return self._client._change("Stop", jobs_pb2.StopJobRequest(job_id=self.job_id))

    def cancel(self) -> JobState:
        """Ends the job, and drops its image."""
        return self._client._change("Cancel", jobs_pb2.CancelJobRequest(job_id=self.job_id))

    def set_priority(self, priority: int) -> JobState:
        return self._client._change("SetPriority", jobs_pb2.SetJobPriorityRequest(
            job_id=self.job_id, priority=priority))

    def extend(self, **until: Value) -> JobState:
        """Goes on with the job, from all its photons, to a new end: passes, photons, time or error,
        each in all."""
        request = jobs_pb2.ExtendJobRequest(job_id=self.job_id)
        for name, value in until.items():
            request.until.settings.add(name=WIRE_NAMES.get(name, name),
                                       value=_program.text_of(value))
        return self._client._change("Extend", request)

    def delete(self) -> None:
        """Forgets a job that has ended, and its image."""
        self._client._delete(self.job_id)


class Client:
    """A connection to a coordinator. What is not given is taken from LUCERNA_SERVER, LUCERNA_TOKEN,
    LUCERNA_TLS_CA, LUCERNA_TLS_CERT and LUCERNA_TLS_KEY, as the program does.

    program: the `lucerna` that `submit` runs. connect_timeout_s: how long to wait for a coordinator that
    is not there. max_silence_s: after so long without news `watch` gives up. One thread, or several."""

    def __init__(self, server: str | None = None, *, token: str | None = None,
                 tls: Tls | None = None, program: StrPath = "lucerna",
                 connect_timeout_s: float = 3, max_silence_s: float = 30):
        self.server = server or os.environ.get("LUCERNA_SERVER") or "127.0.0.1:7400"
        self.tls = tls or _tls_of_environment()
        self._token = (token or os.environ.get("LUCERNA_TOKEN") or "").strip()
        self._program = program
        self._max_silence_s = max_silence_s
        self._metadata: list[tuple[str, str]] = []
        if self._token:
            self._check_token()
            self._metadata = [("authorization", f"Bearer {self._token}")]
        if self.tls is None:
            self._channel = grpc.insecure_channel(self.server, options=_CHANNEL)
        else:
            try:
                files = [pathlib.Path(path).read_bytes()
                         for path in (self.tls.ca, self.tls.key, self.tls.certificate)]
            except OSError as error:
                raise UsageError(f"{error.filename}: {error.strerror}") from None
            self._channel = grpc.secure_channel(
                self.server, grpc.ssl_channel_credentials(*files), options=_CHANNEL)
        self._jobs = jobs_pb2_grpc.JobServiceStub(self._channel)
        self._images = images_pb2_grpc.ImageServiceStub(self._channel)
        try:
            grpc.channel_ready_future(self._channel).result(timeout=connect_timeout_s)
        except grpc.FutureTimeoutError:
            why = self._why_not_connected()
            self.close()
            raise self._unreachable(why) from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._channel.close()

    def submit(self, scene: StrPath, *, reference: StrPath | None = None, priority: int = 0,
               allow_paths: Iterable[StrPath] = (), **settings: Value) -> Job:
        """Sends a scene with all files that it names. `settings` are those of `lucerna help settings`
        with _ for -: size="640x480", error="2%", time="5m", radius_controller="ppm".

        reference: an EXR file to measure the true error by. allow_paths: folders below which the
        scene may name files by absolute paths and by `..`.
        Errors: UsageError, UnreachableError; Error with every error of the scene."""
        words = ["submit", os.path.abspath(scene), "--json", "--quiet",
                 f"--server={self.server}", f"--priority={priority}"]
        if reference is not None:
            words.append(f"--reference={os.path.abspath(reference)}")
        words += [f"--allow-path={os.fspath(path)}" for path in allow_paths]
        if self.tls is not None:
            words += [f"--tls-ca={os.fspath(self.tls.ca)}",
                      f"--tls-cert={os.fspath(self.tls.certificate)}",
                      f"--tls-key={os.fspath(self.tls.key)}"]
        words += _program.flags(self._program, settings)
        submitted = json.loads(_program.run(self._program, words, token=self._token))
        return Job(self, submitted["job_id"], submitted["warnings"])

    def job(self, job_id: str) -> Job:
        """A job that was submitted earlier. Makes no call: its methods tell whether there is one."""
        return Job(self, job_id)

    def jobs(self, *, states: Iterable[str] = (), owner: str = "",
             name_contains: str = "") -> list[JobState]:
        """All jobs, newest first, without their samples; only those that are in one of `states`, are
        `owner`'s, and whose names contain this."""
        request = jobs_pb2.ListJobsRequest(page_size=_PAGE, owner=owner, name_contains=name_contains)
        for name in states:
            try:
                request.states.append(jobs_pb2.JobState.Value(f"JOB_STATE_{name.upper()}"))
            except ValueError:
                raise UsageError(f"{name} is no state of a job; give queued, preparing, running, "
                                 "paused, succeeded, cancelled or failed") from None
        found: list[JobState] = []
        while True:
            page = self._retry(lambda: self._call("List", request))
            found += map(JobState.of_message, page.jobs)
            # A page that leads back to itself would never end.
            if page.next_page_token in ("", request.page_token):
                return found
            request.page_token = page.next_page_token

    # For Job.

    def _call(self, method: str, request: Any) -> Any:
        return getattr(self._jobs, method)(request, timeout=_CALL_S, metadata=self._metadata)

    def _change(self, method: str, request: Any) -> JobState:
        return JobState.of_message(self._retry(lambda: self._call(method, request)))

    def _delete(self, job_id: str) -> None:
        request = jobs_pb2.DeleteJobRequest(job_id=job_id)
        attempts = 0

        def delete() -> None:
            nonlocal attempts
            attempts += 1
            try:
                self._call("Delete", request)
            except grpc.RpcError as error:
                # An attempt whose answer was lost may have done it.
                if attempts == 1 or error.code() != grpc.StatusCode.NOT_FOUND:
                    raise
        self._retry(delete)

    def _image(self, job_id: str) -> bytes:
        def fetch() -> bytes:
            content = bytearray()
            # No deadline: a line may be slow, and keepalive notices one that is dead.
            call = self._images.GetImage(images_pb2.GetImageRequest(job_id=job_id),
                                         metadata=self._metadata)
            try:
                for chunk in call:
                    content += chunk.bytes
                    if len(content) > _MAX_IMAGE_BYTES:
                        raise Error("the image is longer than 8 GiB")
            finally:
                call.cancel()
            return bytes(content)
        return self._retry(fetch)

    def _watch(self, job_id: str) -> Iterator[JobState]:
        request = jobs_pb2.WatchJobRequest(job_id=job_id)
        last_news = time.monotonic()
        pause_s = _FIRST_PAUSE_S
        while True:
            call = self._jobs.Watch(request, metadata=self._metadata)
            try:
                for message in call:
                    state = JobState.of_message(message)
                    yield state
                    if state.has_ended:
                        return
                    # From here: the time that the caller took does not count.
                    last_news = time.monotonic()
                    pause_s = _FIRST_PAUSE_S
            except grpc.RpcError as error:
                if error.code() not in (*_AGAIN, grpc.StatusCode.DEADLINE_EXCEEDED):
                    raise self._error_of(error) from None
                if time.monotonic() - last_news > self._max_silence_s:
                    raise self._unreachable(error.details()) from None
            finally:
                call.cancel()
            time.sleep(pause_s)
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)

    def _retry(self, call: Callable[[], _Answer]) -> _Answer:
        pause_s = _FIRST_PAUSE_S
        for attempt in range(1, _ATTEMPTS + 1):
            try:
                return call()
            except grpc.RpcError as error:
                if error.code() not in _AGAIN or attempt == _ATTEMPTS:
                    raise self._error_of(error) from None
            time.sleep(pause_s)
            pause_s = min(2 * pause_s, _LONGEST_PAUSE_S)
        raise AssertionError("the last attempt returns or raises")

    def _error_of(self, error: grpc.RpcError) -> Error:
        code = error.code()
        if code in (*_AGAIN, grpc.StatusCode.DEADLINE_EXCEEDED):
            return self._unreachable(error.details())
        if code == grpc.StatusCode.UNIMPLEMENTED:
            return Error(f"the coordinator does not offer this at {self.server}; is it of another "
                         "version, or is that its address for workers?")
        said = printable(error.details() or code.name, keeps="\n")
        return _CLASSES.get(code, Error)(said)

    def _unreachable(self, why: str | None) -> UnreachableError:
        why = printable(why or "")
        is_refused = "failed to connect" in why and (
            "Socket closed" in why or "Connection reset" in why)
        if self.tls is None and is_refused:
            return UnreachableError(f"the coordinator at {self.server} ended the connection at "
                                    "once; if it uses TLS, give tls=")
        # What is wrong with certificates is only in gRPC's words.
        detail = f" ({why})" if why and self.tls else ""
        return UnreachableError(f"cannot reach the coordinator at {self.server}; is lucerna-server "
                                f"running there?{detail}")

    def _why_not_connected(self) -> str | None:
        # A channel has a state but no reason; a call has one.
        try:
            self._jobs.Get(jobs_pb2.GetJobRequest(), timeout=1)
        except grpc.RpcError as error:
            return error.details()
        return None

    def _check_token(self) -> None:
        if not all(" " < character <= "~" for character in self._token):
            raise UsageError("the token is not one line of printable characters; lucerna token new "
                             "makes one")
        if self.tls is None and not _is_loopback(self.server):
            raise UsageError(f"the token would be readable on the way to {self.server}; give tls=, "
                             "or leave the token away")


def _is_loopback(server: str) -> bool:
    host = server.rpartition(":")[0].removeprefix("[").removesuffix("]")
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _tls_of_environment() -> Tls | None:
    ca, certificate, key = (os.environ.get(f"LUCERNA_TLS_{name}", "")
                            for name in ("CA", "CERT", "KEY"))
    if not (ca or certificate or key):
        return None
    if not (ca and certificate and key):
        raise UsageError("LUCERNA_TLS_CA, LUCERNA_TLS_CERT and LUCERNA_TLS_KEY go together")
    return Tls(ca, certificate, key)


def _write(path: pathlib.Path, content: bytes) -> None:
    """Whole or not at all."""
    beside = path.with_name(f".{path.name}.{uuid.uuid4().hex}.tmp")
    try:
        beside.write_bytes(content)
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
