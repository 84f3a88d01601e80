"""How far is one image from another? As `lucerna diff` measures it."""

import dataclasses
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lucerna.errors import UsageError
from lucerna.image import Image

# As render/estimate/relative_error.h has them.
_FLOOR_SHARE = 0.01
_BRIGHT_SHARE = 0.01
_TRIMMED_SHARE = 0.001
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclasses.dataclass(frozen=True)
class Metrics:
    pixels: int                # compared
    rmse: float                # root of the mean over pixels and channels of (a - b)²
    rel_mse: float             # mean over pixels and channels of (a - b)² / (b² + floor)
    # The same without the `trim` of pixels in which it is largest, 0.1 % where that is 0, and of all.
    rel_mse_trimmed: float
    rel_mse_untrimmed: float
    floor: float
    mean_a: float
    mean_b: float
    mean_ratio: float
    channel_mean_ratio: tuple[float, float, float]
    # The part of rel_mse that is noise of the reference; of images that `lucerna reference` made.
    reference_rel_mse: float | None = None


def _colour(image: Image | ArrayLike, who: str) -> NDArray[np.float64]:
    if isinstance(image, Image):
        missing = [name for name in "RGB" if name not in image.channels]
        if missing:
            raise UsageError(f"the {who} has no channel {missing[0]}")
        image = np.stack([image.channels[name] for name in "RGB"], axis=-1)
    pixels = np.asarray(image, dtype=np.float64)
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise UsageError(f"the {who} must be an image, or an array of [height, width, 3]")
    return pixels


def relative_error_floor(reference: ArrayLike) -> float:
    """A hundredth of the squared mean luminance, which is taken without the brightest 1 % of the
    pixels that have any light."""
    luminances = (np.asarray(reference, dtype=np.float64) @ _LUMINANCE).ravel()
    luminances[~np.isfinite(luminances)] = 0
    lit = np.sort(luminances[luminances > 0])
    if lit.size == 0:
        return 0.0
    bright = int(_BRIGHT_SHARE * lit.size)
    mean = float(lit[:lit.size - bright].sum()) / (luminances.size - bright)
    return _FLOOR_SHARE * mean * mean


def _relative(squared: NDArray[np.float64], reference: NDArray[np.float64],
              floor: float) -> NDArray[np.float64]:
    # No error is none, also where there is neither a value nor a floor.
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(squared == 0, 0.0, squared / (reference * reference + floor)).sum(axis=-1)


def _ratio(a: float, b: float) -> float:
    if a == b:
        return 1.0
    return a / b if b != 0 else math.copysign(math.inf, a)


def _kept(pixels: int, share: float) -> int:
    return pixels - int(share * pixels)


def diff(image: Image | ArrayLike, reference: Image | ArrayLike, *, trim: float = 0,
         floor: float | None = None, clip: float = math.inf,
         mask: ArrayLike | None = None) -> Metrics:
    """Compares red, green and blue of two images or arrays [height, width, 3] of one size.

    trim: share of the pixels with the largest relative errors left out. floor: of relMSE, else that
    of the reference. clip: of both images first. mask: [height, width]; pixels that are 0 in it are
    left out. Errors: UsageError for sizes that differ and pixels that are not finite.
    """
    a = _colour(image, "image")
    b = _colour(reference, "reference")
    if a.shape != b.shape:
        raise UsageError(f"the images differ in size: {a.shape[1]}x{a.shape[0]} and "
                         f"{b.shape[1]}x{b.shape[0]}")
    if not 0 <= trim < 1:
        raise UsageError("the share of pixels to trim is at least 0 and below 1")
    # What is not finite stays so and is reported; clipping would hide it.
    a = np.where(np.isfinite(a), np.minimum(a, clip), a)
    b = np.where(np.isfinite(b), np.minimum(b, clip), b)
    if floor is None:
        floor = relative_error_floor(b)
    noise = None
    if (isinstance(reference, Image) and clip == math.inf
            and "lucerna.reference.rel_mse" in reference.metadata
            and all(f"noise.{name}" in reference.channels for name in "RGB")):
        noise = reference["noise"].astype(np.float64)
    counts = np.ones(a.shape[:2], dtype=bool)
    if mask is not None:
        counts = np.asarray(mask) != 0
        if counts.shape != a.shape[:2]:
            raise UsageError("the mask must be an array of the images' [height, width]")
    for who, pixels in (("image", a), ("reference", b)):
        bad = np.argwhere(counts & ~np.isfinite(pixels).all(axis=-1))
        if bad.size:
            raise UsageError(f"the {who} is not finite at pixel ({bad[0][1]}, {bad[0][0]})")
    a, b = a[counts], b[counts]
    if len(a) == 0:
        raise UsageError("there is no pixel left to compare")
    relative = _relative((a - b) ** 2, b, floor)
    # Ties go by place, as in the program.
    order = np.argsort(relative, kind="stable")
    kept = _kept(len(a), trim)
    kept_trimmed = kept if trim > 0 else _kept(len(a), _TRIMMED_SHARE)

    def mean_of(values: NDArray[np.float64], pixels: int) -> float:
        return float(values[order[:pixels]].sum()) / (3 * pixels)

    reference_rel_mse = None
    if noise is not None:
        reference_rel_mse = mean_of(_relative(noise[counts] ** 2, b, floor), kept)
    a, b, compared = a[order[:kept]], b[order[:kept]], len(a)
    sums_a, sums_b = a.sum(axis=0), b.sum(axis=0)
    ratios = [_ratio(float(sums_a[c]), float(sums_b[c])) for c in range(3)]
    mean_a, mean_b = float(sums_a.sum()) / (3 * kept), float(sums_b.sum()) / (3 * kept)
    return Metrics(pixels=kept, rmse=math.sqrt(float(((a - b) ** 2).sum()) / (3 * kept)),
                   rel_mse=mean_of(relative, kept),
                   rel_mse_trimmed=mean_of(relative, kept_trimmed),
                   rel_mse_untrimmed=mean_of(relative, compared), floor=floor, mean_a=mean_a,
                   mean_b=mean_b, mean_ratio=_ratio(mean_a, mean_b),
                   channel_mean_ratio=(ratios[0], ratios[1], ratios[2]),
                   reference_rel_mse=reference_rel_mse)
