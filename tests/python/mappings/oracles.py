# SPDX-License-Identifier: Apache-2.0
"""Expected values of the graphs without a model of their own, by SciPy, NumPy, MuJoCo or a line of Python, independent of OpenGPAC.

The virtual clock is the reference of the other mappings, so without these the code would only be compared with itself. `exactly` is
to the bit; the others sum in a different order, and agree within 10^-9.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from scipy import ndimage, signal

import opengpac as gpac
from mappings.graph import LENGTH, scattered

MODEL = Path(gpac.robots.__file__).parent / "ur5e.xml"

Found = Mapping[str, Any]


class Oracle(NamedTuple):
    """Expected values of a graph, possibly computed from its other recorded values."""

    of: Callable[[Found], Mapping[str, Any]]
    is_exact: bool


ORACLES: dict[str, Oracle] = {}


def exactly(of: Callable[[Found], Mapping[str, Any]]) -> None:
    """Registers an oracle to the bit, for the graph with the function's name."""
    ORACLES[of.__name__] = Oracle(of, True)


def nearly(of: Callable[[Found], Mapping[str, Any]]) -> None:
    """Registers an oracle within 10^-9, for the graph with the function's name."""
    ORACLES[of.__name__] = Oracle(of, False)


K = np.arange(LENGTH, dtype=float)


def wave(seed: int = 40503) -> np.ndarray:
    """Returns the stimulus `scatter`."""
    return np.array(scattered(seed))


def square(half: int) -> np.ndarray:
    """Returns the stimulus `square`."""
    return np.arange(LENGTH) // half % 2 == 1


def filtered(b: list[float], a: list[float], u: np.ndarray) -> np.ndarray:
    """Returns the output of SciPy's filter, initially at rest."""
    return np.asarray(signal.lfilter(b, a, u))


def low(u: np.ndarray, alpha: float) -> np.ndarray:
    """Returns the output of a low-pass filter that starts at 0."""
    return filtered([alpha], [1.0, alpha - 1.0], u)


def window(u: np.ndarray, length: int, of: Callable[[np.ndarray], Any]) -> np.ndarray:
    """Returns a function of the last `length` values, or of those that exist."""
    return np.array([of(u[max(0, k - length + 1) : k + 1]) for k in range(len(u))])


@nearly
def fan_on_two_sources_of_one(_: Found) -> Mapping[str, Any]:
    return {"here": 3 * wave(), "there": 5 * wave(), "lower": low(wave(), 0.5)}


@nearly
def echo_within_a_software_source(_: Found) -> Mapping[str, Any]:
    # echo = u - 0.75 of the previous echo, and the recorded value is its negative.
    return {"y": -filtered([1.0], [1.0, 0.75], wave(9))}


@exactly
def join_here_and_there(_: Found) -> Mapping[str, Any]:
    return {"y": (2.0 * wave(13) + 1.0) + -3.0 * (2.0 * wave(13))}


@exactly
def three_readers_of_a_join(_: Found) -> Mapping[str, Any]:
    total = wave(21) + 0.125 * K
    return {"left": 0.5 * total, "right": np.sqrt(np.abs(total))}


@exactly
def ratio_input_beside_a_synchronous_one(_: Found) -> Mapping[str, Any]:
    return {"y": (1000.0 * np.maximum(0, K // 5 - 1) + wave()) + 0.5}


@exactly
def divided_graph(_: Found) -> Mapping[str, Any]:
    return {"quick": K, "slow": 100.0 * K}


@nearly
def interval_that_changes(_: Found) -> Mapping[str, Any]:
    return {"y": low(wave(), 0.125)}


@nearly
def history_then_a_filter_elsewhere(_: Found) -> Mapping[str, Any]:
    return {"y": low(filtered([0.5, 0.0, -0.5], [1.0], wave()), 0.5)}


@exactly
def gather_of_two_processors(_: Found) -> Mapping[str, Any]:
    return {"y": -np.column_stack([wave(n) for n in range(4)]).ravel()}


@exactly
def vector_from_processor_to_processor(_: Found) -> Mapping[str, Any]:
    return {"y": (0.3 * (0.1 * (K[:, None] + np.arange(4) * 0.125))).ravel()}


@exactly
def greatest_and_least_of_several_writers(_: Found) -> Mapping[str, Any]:
    three = [wave(7 + n) for n in range(3)]
    return {"greatest": np.max(three, axis=0), "product": three[0] * three[1] * three[2]}


def _arm() -> tuple[list[np.ndarray], list[np.ndarray], list[float]]:
    """Returns MuJoCo's positions and rotations of the tool, and the minimum singular value of its Jacobian, at the swaying positions."""
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    data = mujoco.MjData(model)
    tool = model.site("tool").id
    places, turns, least = [], [], []
    for k in range(LENGTH):
        at = [(k * (i + 3)) % 200 for i in range(6)]
        data.qpos[:6] = [(a if a < 100 else 200 - a) * 0.01 - 0.5 for a in at]
        mujoco.mj_forward(model, data)
        turn, jacobian = np.zeros(4), np.zeros((6, model.nv))
        mujoco.mju_mat2Quat(turn, data.site_xmat[tool])
        mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], tool)
        places.append(data.site_xpos[tool].copy())
        turns.append(turn)
        least.append(float(np.linalg.svd(jacobian[:, :6], compute_uv=False)[-1]))
    return places, turns, least


def _pose(found: Found) -> np.ndarray:
    """Returns the poses; a quaternion and its negative are the same rotation."""
    places, turns, _ = _arm()
    told = np.reshape(found["pose"], (LENGTH, 7))[:, 3:]
    signed = [turn * (np.sign(turn @ given) or 1.0) for turn, given in zip(turns, told, strict=True)]
    return np.hstack([places, signed]).ravel()


@nearly
def pose_of_an_arm_elsewhere(found: Found) -> Mapping[str, Any]:
    return {"pose": _pose(found)}


@nearly
def singularity_of_an_arm_elsewhere(found: Found) -> Mapping[str, Any]:
    return {"pose": _pose(found)}


@exactly
def struct_of_structs(_: Found) -> Mapping[str, Any]:
    heading = 2.0 * 0.25 * (K % 16)
    return {"y": np.column_stack([K + 1.0, -0.5 * K, K + 9.0 + K, heading]).ravel()}


@exactly
def truth_values(_: Found) -> Mapping[str, Any]:
    return {"both": square(7) & square(11), "one": square(7) ^ square(11)}


@exactly
def graph_that_begins_and_ends_itself(_: Found) -> Mapping[str, Any]:
    return {"y": 4.0 * (wave(41) + 0.01 * K)}


@nearly
def one_graph_twice(_: Found) -> Mapping[str, Any]:
    return dict.fromkeys(("a", "b"), low(2 * wave(43), 0.5))


@nearly
def graph_with_a_filter_inserted(_: Found) -> Mapping[str, Any]:
    return {"y": low(np.clip(2 * wave(44), -0.5, 0.5), 0.5)}


@nearly
def biquad_elsewhere(_: Found) -> Mapping[str, Any]:
    return {"y": filtered([0.2, 0.4, 0.2], [1.0, -0.5, 0.3], wave())}


@nearly
def transfer_function_elsewhere(_: Found) -> Mapping[str, Any]:
    return {"y": filtered([0.1, 0.2, 0.2, 0.1], [1.0, -0.6, 0.3, -0.05], wave())}


@nearly
def median_then_moving_average(_: Found) -> Mapping[str, Any]:
    median = window(wave(51), 5, np.median)
    assert np.array_equal(median[4:], ndimage.median_filter(wave(51), 5)[2:-2])
    return {"median": median, "mean": window(median, 8, np.mean)}


@nearly
def state_space_of_two_inputs(_: Found) -> Mapping[str, Any]:
    system = ([[0.9, 0.1], [-0.1, 0.8]], [[1.0, 0.0], [0.5, 1.0]], [[1.0, -1.0]], [[0.1, 0.0]], 1.0)
    return {"y": signal.dlsim(system, np.column_stack([wave(52), wave(53)]))[1].ravel()}


@exactly
def shapes_in_a_row(found: Found) -> Mapping[str, Any]:
    # Halves are rounded away from 0.
    parts = np.asarray(found["dead"]) / 0.125
    steps = np.sign(parts) * np.floor(np.abs(parts) + 0.5) * 0.125
    return {"steps": steps, "sign": np.sign(steps)}


@nearly
def statistics_of_a_window(_: Found) -> Mapping[str, Any]:
    u = wave(56)
    variance = window(u, 16, lambda part: part.var(ddof=1) if len(part) > 1 else 0.0)
    return {"mean": window(u, 16, np.mean), "variance": variance, "least": window(u, 16, np.min), "greatest": window(u, 16, np.max)}


@nearly
def noise_of_a_seed(found: Found) -> Mapping[str, Any]:
    noise = np.asarray(found["noise"])
    count = K + 1
    return {"mean": np.cumsum(noise) / count, "rms": np.sqrt(np.cumsum(noise**2) / count)}


@exactly
def flip_flop_of_two_processors(_: Found) -> Mapping[str, Any]:
    q, held = [], False
    for is_set, is_reset in zip(square(3), square(8), strict=True):
        held = bool(is_set or (held and not is_reset))
        q.append(held)
    return {"q": q, "not_q": np.logical_not(q)}


@exactly
def comparator_with_hysteresis(_: Found) -> Mapping[str, Any]:
    above, is_above = [], False
    for u in low(wave(61), 0.5):
        is_above = u >= 0.05 - 0.1 if is_above else u > 0.05 + 0.1
        above.append(is_above)
    return {"above": above, "fell": [k > 0 and above[k - 1] and not above[k] for k in range(LENGTH)]}


@exactly
def relaxed_mode(_: Found) -> Mapping[str, Any]:
    return {"y": wave(77) + 0.125}
