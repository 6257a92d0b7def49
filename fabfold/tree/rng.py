"""A tiny seeded generator for kernels (splitmix64), since numba's own is global state."""

# mypy: disallow-untyped-decorators=False, disable-error-code="no-any-return,return-value"

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["generator", "mix", "random_below", "random_bits", "random_float"]


def generator(seed: int) -> NDArray[np.uint64]:
    """State for the kernels' random numbers.

    Parameters
    ----------
    seed : int
        Not negative.

    Returns
    -------
    (1,) uint64 array
        Advanced in place by the functions below.
    """
    state: NDArray[np.uint64] = np.array([seed], dtype=np.uint64)
    state[0] = mix(state[0])
    return state


@njit(cache=True)
def mix(value: np.uint64) -> np.uint64:
    """Scramble 64 bits by splitmix64's finalizer; also the Zobrist key of a small integer.

    Parameters
    ----------
    value : uint64
        Bits to scramble.

    Returns
    -------
    uint64
        A different number for each value.
    """
    z = value + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True)
def random_bits(state: NDArray[np.uint64]) -> np.uint64:
    """Next 64 random bits.

    Parameters
    ----------
    state : (1,) uint64 array
        Random state, advanced.

    Returns
    -------
    uint64
        Any number.
    """
    out = mix(state[0])
    state[0] = state[0] + np.uint64(0x9E3779B97F4A7C15)
    return out


@njit(cache=True)
def random_float(state: NDArray[np.uint64]) -> float:
    """Next random number.

    Parameters
    ----------
    state : (1,) uint64 array
        Random state, advanced.

    Returns
    -------
    float
        Uniform in [0, 1).
    """
    return np.float64(random_bits(state) >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@njit(cache=True)
def random_below(state: NDArray[np.uint64], bound: int) -> int:
    """Next random integer.

    Parameters
    ----------
    state : (1,) uint64 array
        Random state, advanced.
    bound : int
        Greater than 0.

    Returns
    -------
    int
        Uniform in [0, bound).
    """
    return np.int64(random_bits(state) >> np.uint64(33)) % np.int64(bound)
