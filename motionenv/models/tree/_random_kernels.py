"""Random numbers inside compiled loops: SplitMix64 (Steele, Lea & Flood 2014), one stream per (key, number).

The key comes from the caller's Generator, the number says which probe or frame it is. So results don't depend on how
work is cut into batches or shared among threads. Draws for one probe that go side by side have a key each, `key_of`.
"""

import numpy as np
from numba import njit

_jit = njit(nogil=True, cache=True, error_model="numpy")

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_UNIT = 1.0 / 9007199254740992.0  # 2⁻⁵³


@_jit
def _mixed(x):
    x = (x ^ (x >> _S30)) * _FIRST
    x = (x ^ (x >> _S27)) * _SECOND
    return x ^ (x >> _S31)


@_jit
def stream(key, number):
    """State (1,) of the stream `number` of `key`, both whole numbers from 0 to 2⁶⁴ - 1."""
    state = np.empty(1, dtype=np.uint64)
    restart(state, key, number)
    return state


@_jit
def restart(state, key, number):
    """Set `state` (1,) to the beginning of the stream `number` of `key`."""
    state[0] = _mixed(np.uint64(key) + _GOLDEN) ^ _mixed(np.uint64(number) * _GOLDEN + _SECOND)


@_jit
def key_of(key, draw):
    """The key to use for one of many draws from each stream of `key`; for draw 0 it is `key` itself."""
    return np.uint64(key) + np.uint64(draw) * _GOLDEN


@_jit
def uniform(state):
    """The next number of a stream, in [0, 1)."""
    state[0] += _GOLDEN
    return np.float64(_mixed(state[0]) >> _S11) * _UNIT


@_jit
def normal(state):
    """A standard normal variate (Box & Muller 1958), from two numbers of the stream."""
    radius = np.sqrt(-2.0 * np.log(1.0 - uniform(state)))
    return radius * np.cos(2.0 * np.pi * uniform(state))
