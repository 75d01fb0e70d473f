"""Errors from pairs of seeds, and what two renderers' errors and times say of each other.

A pair is two runs of one setting with different seeds. Half the squared difference of their pictures has the expectation
of the squared error of one (its variance; a bias both share is not in it, which is what `difference` is for). Pictures
are cut into blocks, so that intervals need few pairs: they come from drawing blocks and pairs anew with replacement
(bootstrap), the same blocks for all settings of a scene.
"""

from dataclasses import dataclass, field

import numpy as np

import pictures

BLOCK = 16
DRAWS = 2000
MEASURES = ("mse", "shown")
QUANTILES = (2.5, 97.5)


def block_means(values):
    """Means over blocks of BLOCK x BLOCK pixels, those at the edge smaller. values: (frames, height, width).
    Returns (frames, blocks)."""
    rows, columns = (np.arange(0, size, BLOCK) for size in values.shape[1:])
    sums = np.add.reduceat(np.add.reduceat(values.astype(np.float64), rows, 1), columns, 2)
    return sums.reshape(len(values), -1) / block_sizes(*values.shape[1:])


def block_sizes(height, width):
    """Pixels of each block."""
    rows, columns = (np.diff(np.append(np.arange(0, size, BLOCK), size)) for size in (height, width))
    return np.outer(rows, columns).ravel()


@dataclass
class Pair:
    """What is kept of two runs."""
    mse: np.ndarray  # (frames, blocks): squared error of one run, mean over pixels and channels
    grey_variance: np.ndarray  # (frames, blocks): variance of a pixel's mean over channels
    grey: np.ndarray  # (2, frames, blocks): mean over channels and pixels of each run
    cpu: np.ndarray  # (2): CPU seconds of each run
    shown: np.ndarray  # (1, blocks): squared error of the last frame as people see it, 0 to 1
    seen: dict  # by SEEN: where it is worst


SEEN = ("darkest", "worst", "exceeded", "black")
FEWEST_IN_BLOCK = 64  # pixels; smaller ones at the edge are not judged


def exposure_as_shown(picture):
    """The factor at which the mean of the picture on a display is .4."""
    low, high = 1e-9, 1e9
    for _ in range(100):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if pictures.to_display(middle * picture).mean() < 0.4 else (low, middle)
    return middle


def error_as_shown(a, b):
    """Error of one of two pictures, (height, width, 3), at one exposure, as sRGB clamped to [0, 1]: dark parts count as the
    eye sees them, highlights no more than white. Returns the squared error, (1, blocks), and where it is worst: RMSE of the
    darkest quarter and of the worst block, what one pixel in 1,000 exceeds, the share of pixels black in one picture alone."""
    mean = 0.5 * (a.astype(np.float64) + b)
    exposure = exposure_as_shown(mean)
    squared = 0.5 * np.square(pictures.to_display(exposure * a) - pictures.to_display(exposure * b)).mean(-1)
    blocks = block_means(squared[None])
    brightness = pictures.to_display(exposure * mean).sum(-1)
    black = [(picture <= 0).all(-1) for picture in (a, b)]
    seen = {"darkest": np.sqrt(squared[brightness <= np.quantile(brightness, 0.25)].mean()),
            "worst": np.sqrt(blocks[0][block_sizes(*squared.shape) >= FEWEST_IN_BLOCK].max(initial=0)),
            "exceeded": np.quantile(np.sqrt(squared), 0.999), "black": 0.5 * (black[0] != black[1]).mean()}
    return blocks, seen


def measure_pair(a, b, cpu):
    """a, b: (frames, height, width, 3)."""
    grey_a, grey_b = a.mean(-1, dtype=np.float64), b.mean(-1, dtype=np.float64)
    half_squares = 0.5 * np.square(a.astype(np.float64) - b).mean(-1)
    return Pair(block_means(half_squares), block_means(0.5 * np.square(grey_a - grey_b)),
                np.stack([block_means(grey_a), block_means(grey_b)]), np.asarray(cpu, float), *error_as_shown(a[-1], b[-1]))


@dataclass
class Setting:
    """Pairs of one renderer and setting in one scene."""
    name: str
    level: int  # samples a pixel, or rounds
    pairs: list
    pixels: np.ndarray  # (blocks): how many each has
    draws: dict = field(default_factory=dict)

    @property
    def shares(self):
        return self.pixels / self.pixels.sum()

    def blocks(self, measure):
        """Squared error, (pairs, blocks)."""
        return np.array([getattr(pair, measure).mean(0) for pair in self.pairs])

    def mse(self, measure="mse"):
        return float((self.blocks(measure) @ self.shares).mean())

    def seen(self, what):
        """One of SEEN, mean over pairs."""
        return float(np.mean([pair.seen[what] for pair in self.pairs]))

    def cpu(self):
        return float(np.mean([pair.cpu for pair in self.pairs]))

    def work(self):
        """Samples or rounds in all runs: how well the mean of its pictures is known."""
        return 2 * len(self.pairs) * self.level

    def efficiency(self):
        return 1 / (self.cpu() * self.mse())


def interval(values):
    low, high = np.percentile(values, QUANTILES)
    return float(low), float(high)


def draw(settings, seed=1):
    """Fills in DRAWS bootstrap values of errors and CPU seconds of each setting of a scene."""
    random = np.random.default_rng(seed)
    shares = settings[0].shares
    picked = random.multinomial(len(shares), np.full(len(shares), 1 / len(shares)), DRAWS) * shares
    picked /= picked.sum(1, keepdims=True)
    for setting in settings:
        count = len(setting.pairs)
        weights = random.multinomial(count, np.full(count, 1 / count), DRAWS) / count
        cpu = np.concatenate([pair.cpu for pair in setting.pairs])
        setting.draws = {name: np.einsum("dp,pd->d", weights, setting.blocks(name) @ picked.T) for name in MEASURES}
        setting.draws["cpu"] = random.choice(cpu, (DRAWS, len(cpu))).mean(1)


def cpu_at(cpus, errors, target):
    """CPU seconds at which a renderer has the squared error `target`: along straight lines in the logarithms of both;
    beyond the last point as 1 / CPU. None where the first point is already better. Points from cheap to dear."""
    x, y = np.log(np.asarray(cpus)), np.log(np.asarray(errors))
    t = np.log(target)
    if t > y[0]:
        return None
    if t < y[-1]:
        return float(np.exp(x[-1] + y[-1] - t))
    k = int(np.argmax(y[1:] <= t)) if len(y) > 1 else 0
    if len(y) == 1 or y[k] == y[k + 1]:
        return float(np.exp(x[k]))
    return float(np.exp(x[k] + (y[k] - t) / (y[k] - y[k + 1]) * (x[k + 1] - x[k])))


@dataclass
class Ratio:
    """How many times the CPU seconds of `curve` the setting of the other renderer takes, at its error."""
    value: float
    low: float
    high: float
    cpu: float  # of the curve
    bound: bool  # the cheapest point of the curve is already better: at least so many times
    extrapolated: bool  # beyond the dearest


def ratio_at_error(curve, other, measure="mse"):
    """curve: settings of one renderer from cheap to dear, other: one of the other; all drawn."""
    target = other.mse(measure)
    cpus, errors = [s.cpu() for s in curve], [s.mse(measure) for s in curve]
    cpu = cpu_at(cpus, errors, target)
    bound = cpu is None
    cpu = cpus[0] if bound else cpu
    drawn = []
    for i in range(DRAWS):
        own = cpu_at(*([s.draws[name][i] for s in curve] for name in ("cpu", measure)), other.draws[measure][i])
        drawn.append(other.draws["cpu"][i] / (curve[0].draws["cpu"][i] if own is None else own))
    return Ratio(other.cpu() / cpu, *interval(drawn), cpu, bound, not bound and target < errors[-1])


@dataclass
class Difference:
    """Two renderers' pictures: what more than their noise tells them apart."""
    mean: float  # of the second
    relative: float  # difference of the image means over it
    error: float  # its standard error
    z_squared: float  # mean over blocks of (difference / standard error)^2; 1 where nothing differs
    systematic: float  # root of the mean square over blocks, without noise, over the mean

    def z(self):
        return self.relative / self.error


def difference(first, second):
    """The first setting's pictures minus the second's."""
    grey, noise, overall = [], [], []
    for setting in (first, second):
        runs = np.concatenate([pair.grey.mean(1) for pair in setting.pairs])  # (runs, blocks)
        frames = setting.pairs[0].grey.shape[1]
        variance = np.mean([pair.grey_variance.mean(0) for pair in setting.pairs], 0)
        grey.append(runs.mean(0))
        noise.append(variance / (setting.pixels * frames * len(runs)))
        # Pixels of a run may err together: what the runs' means say counts where it is more.
        between = np.var(runs @ setting.shares, ddof=1) / len(runs)
        overall.append(max(between, float(noise[-1] @ np.square(setting.shares))))
    apart, variance = grey[0] - grey[1], noise[0] + noise[1]
    mean = float(grey[1] @ second.shares)
    known = variance > 0
    return Difference(mean, float(apart @ first.shares) / mean, float(np.sqrt(sum(overall))) / mean,
                      float(np.mean(np.square(apart[known]) / variance[known])),
                      float(np.sqrt(max(0.0, (np.square(apart) - variance) @ first.shares))) / mean)


def beyond_noise(first, second):
    """Mean square over pixels and channels of the difference of two renderers' expectations, without their noise, and its
    standard error. What differs from pixel to pixel and not on the mean of a block is in it. first, second: runs, (2 or
    more, height, width, 3)."""
    apart = first.mean(0, dtype=np.float64) - second.mean(0, dtype=np.float64)
    noise = sum(runs.var(0, ddof=1, dtype=np.float64) / len(runs) for runs in (first, second))
    blocks = block_means((np.square(apart) - noise).mean(-1)[None])[0]
    shares = block_sizes(*apart.shape[:2])
    shares = shares / shares.sum()
    mean = blocks @ shares
    return float(mean), float(np.sqrt(np.square(shares) @ np.square(blocks - mean)))
