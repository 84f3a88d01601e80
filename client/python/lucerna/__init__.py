"""Jobs of a Lucerna coordinator: submit, follow, fetch to numpy, compare.

    with lucerna.Client("127.0.0.1:7400") as client:
        job = client.submit("scene.pbrt", size="256x256", error="2%")
        for state in job.watch():
            print(state.passes, state.error)
        image = job.fetch()
        print(image["beauty"].shape, image["noise"].mean())

docs/python.md says more.
"""

from lucerna.client import Client, Job, Tls
from lucerna.errors import (AccessError, Error, JobFailedError, NotFoundError, StateError,
                            UnreachableError, UsageError)
from lucerna.exr import decode_exr, read_image
from lucerna.image import Image
from lucerna.metrics import Metrics, diff
from lucerna.program import compare
from lucerna.state import ErrorEstimate, ErrorSample, JobState

__all__ = [
    "AccessError", "Client", "Error", "ErrorEstimate", "ErrorSample", "Image", "Job",
    "JobFailedError", "JobState", "Metrics", "NotFoundError", "StateError", "Tls",
    "UnreachableError", "UsageError", "compare", "decode_exr", "diff", "read_image",
]
