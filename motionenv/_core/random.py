"""Random numbers inside compiled loops: SplitMix64 (Steele, Lea & Flood 2014), one stream per (key, number).

The key comes from the caller's Generator, the number says which probe or frame it is. So results don't depend on how
work is cut into batches or shared among threads. Draws for one probe that go side by side have a key each, `key_of`.
"""

import numpy as np

from motionenv._core.compilation import kernel

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_UNIT = 1.0 / 9007199254740992.0  # 2⁻⁵³

_LAYERS = 256
_EDGE, _AREA = 3.6541528853610088, 0.00492867323399  # of 256 layers (Marsaglia & Tsang 2000, section 2)


def _edges() -> np.ndarray:
    """Right ends (257,) of the layers under exp(-x²/2), from the lowest one."""
    x = np.empty(_LAYERS + 1)
    x[0], x[1], x[_LAYERS] = _AREA / np.exp(-0.5 * _EDGE**2), _EDGE, 0.0
    for i in range(2, _LAYERS):
        x[i] = np.sqrt(-2.0 * np.log(_AREA / x[i - 1] + np.exp(-0.5 * x[i - 1] ** 2)))
    return x


_X = _edges()
_Y = np.exp(-0.5 * _X**2)
_SCALE = _X * 2.0**-52  # of the upper 53 bits, sign and all
_LAYER, _UPPER = np.uint64(_LAYERS - 1), np.int64(11)


@kernel
def _mixed(x):
    x = (x ^ (x >> _S30)) * _FIRST
    x = (x ^ (x >> _S27)) * _SECOND
    return x ^ (x >> _S31)


@kernel
def restart(state, key, number):
    """Set `state` (1,) to the beginning of the stream `number` of `key`, both whole numbers from 0 to 2⁶⁴ - 1."""
    state[0] = _mixed(np.uint64(key) + _GOLDEN) ^ _mixed(np.uint64(number) * _GOLDEN + _SECOND)


@kernel
def key_of(key, draw):
    """The key to use for one of many draws from each stream of `key`; for draw 0 it is `key` itself."""
    return np.uint64(key) + np.uint64(draw) * _GOLDEN


@kernel
def uniform(state):
    """The next number of a stream, in [0, 1)."""
    state[0] += _GOLDEN
    return np.float64(_mixed(state[0]) >> _S11) * _UNIT


@kernel
def gaussian(state):
    """A standard normal variate by the ziggurat of Marsaglia & Tsang (2000)."""
    while True:
        state[0] += _GOLDEN
        bits = _mixed(state[0])
        i = np.int64(bits & _LAYER)
        x = np.float64(np.int64(bits) >> _UPPER) * _SCALE[i]
        if abs(x) < _X[i + 1]:
            return x
        if i == 0:
            while True:
                beyond = -np.log(1.0 - uniform(state)) / _EDGE
                if -2.0 * np.log(1.0 - uniform(state)) > beyond * beyond:
                    return _EDGE + beyond if x > 0.0 else -_EDGE - beyond
        if _Y[i] + uniform(state) * (_Y[i + 1] - _Y[i]) < np.exp(-0.5 * x * x):
            return x
