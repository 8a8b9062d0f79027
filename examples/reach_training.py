# SPDX-License-Identifier: Apache-2.0
"""Trains the policy of `reach.py` in plain NumPy, and writes it as an ONNX file; takes some minutes on two cores.

First the network imitates damped least squares on the arm's Jacobian, at random postures. Then an evolution strategy improves the
last layer over episodes in the environment of `reach.py`, which is the system in which the policy will run, under the virtual clock.
On one machine the same seed gives the same network; 100 unseen goals measure its quality.

    python examples/reach_training.py            writes examples/policies/reach.onnx
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

import opengpac as gpac
from reach import EVERY, HOME, JOINTS, NETWORK, RATE_MAX, TOLERANCE, environment

SEED = 17
LAYERS = [9, 64, 64, 6]
GAIN = 3.0
"""Speed of the tip per metre of distance, 1/s."""

Weights = list[np.ndarray]


def forward(weights: Weights, x: np.ndarray) -> np.ndarray:
    """Evaluates the network: tanh, tanh, linear."""
    for at in range(0, len(weights) - 2, 2):
        x = np.tanh(x @ weights[at] + weights[at + 1])
    return x @ weights[-2] + weights[-1]


class Teacher:
    """Teacher of the network: damped least squares, whose remaining freedom moves the arm back home."""

    def __init__(self, kinematics: gpac.robots.Kinematics) -> None:
        self.axes = np.array([axis.direction for axis in kinematics.axes])
        self.points = np.array([axis.point for axis in kinematics.axes])
        self.tip = np.array(kinematics.home.position)

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """Returns the tip's velocity per unit joint speed, (n, 3, 6)."""
        count = len(q)
        turn, place = np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3))
        lines = []
        for axis, point, angle in zip(self.axes, self.points, q.T, strict=True):
            lines.append((turn @ axis, turn @ point + place))
            cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
            by = np.eye(3) + np.sin(angle)[:, None, None] * cross + (1 - np.cos(angle))[:, None, None] * (cross @ cross)
            place = place + (turn @ (point - by @ point)[..., None])[..., 0]
            turn = turn @ by
        tip = turn @ self.tip + place
        return np.stack([np.cross(axis, tip - point) for axis, point in lines], axis=2)

    def rates(self, q: np.ndarray, error: np.ndarray) -> np.ndarray:
        """Returns the joint speeds, rad/s."""
        jacobian = self.jacobian(q)
        inverse = np.swapaxes(jacobian, 1, 2) @ np.linalg.inv(jacobian @ np.swapaxes(jacobian, 1, 2) + 0.01 * np.eye(3))
        to_goal = (inverse @ (GAIN * error)[..., None])[..., 0]
        home = HOME - q
        back = home - (inverse @ (jacobian @ home[..., None]))[..., 0]
        rates = to_goal + 0.5 * back
        return rates / np.maximum(1.0, np.abs(rates).max(axis=1, keepdims=True) / RATE_MAX)


def imitated(teacher: Teacher, rng: np.random.Generator, steps: int) -> Weights:
    """Returns weights that imitate the teacher, trained with Adam."""
    weights: Weights = []
    for inputs, outputs in itertools.pairwise(LAYERS):
        weights += [rng.standard_normal((inputs, outputs)) / np.sqrt(inputs), np.zeros(outputs)]
    first, second = [np.zeros_like(w) for w in weights], [np.zeros_like(w) for w in weights]
    for step in range(1, steps + 1):
        q = HOME + rng.uniform(-1.2, 1.2, (512, 6)) * rng.uniform(0.1, 1.0, (512, 1))
        size = 0.1 * rng.uniform(0.0, 1.0, (512, 1)) ** 2
        error = np.clip(rng.standard_normal((512, 3)) * 1.5 * size, -0.1, 0.1)
        x, wanted = np.concatenate([q - HOME, 10.0 * error], axis=1), teacher.rates(q, error) / RATE_MAX
        h = np.tanh(x @ weights[0] + weights[1])
        g = np.tanh(h @ weights[2] + weights[3])
        # Near the goal small differences matter: they remain as the final error.
        wrong = (g @ weights[4] + weights[5] - wanted) / (0.05 + np.linalg.norm(10.0 * error, axis=1, keepdims=True)) / len(x)
        to_g = wrong @ weights[4].T * (1 - g * g)
        to_h = to_g @ weights[2].T * (1 - h * h)
        slopes = [x.T @ to_h, to_h.sum(0), h.T @ to_g, to_g.sum(0), g.T @ wrong, wrong.sum(0)]
        rate = 3e-3 * (1 + np.cos(np.pi * step / steps)) / 2
        for w, m, v, slope in zip(weights, first, second, slopes, strict=True):
            m += 0.1 * (slope - m)
            v += 0.001 * (slope * slope - v)
            w -= rate * (m / (1 - 0.9**step)) / (np.sqrt(v / (1 - 0.999**step)) + 1e-8)
    return weights


def episode(env: Any, weights: Weights, seed: int) -> tuple[float, float]:
    """Returns the loss of an episode, and the distance of the tip at its end, m."""
    seen, _ = env.reset(seed=seed)
    lost, over, reward, ended = 0.0, False, 0.0, False
    while not over:
        seen, reward, ended, truncated, _ = env.step(np.clip(forward(weights, seen), -1.0, 1.0))
        over = ended or truncated
        # The path counts, and the last millimetres count more.
        lost += 0.1 * -reward + float(np.log1p(-reward / 0.002)) * 0.01
    return lost, -reward if not ended else np.inf


class Episodes:
    """Parallel environments, one per thread; the system runs without Python's lock."""

    def __init__(self, threads: int = 2, seconds: float = 3.0) -> None:
        self.environments = [environment(seconds=seconds) for _ in range(threads)]
        self.pool = ThreadPoolExecutor(threads)

    def play(self, given: Sequence[tuple[Weights, int]]) -> list[tuple[float, float]]:
        """Plays an episode for each pair of weights and seed."""
        count = len(self.environments)

        def share(at: int) -> list[tuple[float, float]]:
            return [episode(self.environments[at], weights, seed) for weights, seed in given[at::count]]

        parts = [*self.pool.map(share, range(count))]
        return [parts[i % count][i // count] for i in range(len(given))]

    def close(self) -> None:
        """Closes the systems."""
        self.pool.shutdown()
        for env in self.environments:
            env.close()


def bettered(weights: Weights, episodes: Episodes, rng: np.random.Generator, generations: int, pairs: int = 8, goals: int = 2) -> Weights:
    """Improves the last layer by an evolution strategy with pairs of opposite steps."""
    size, step = 0.01, 0.01
    for generation in range(generations):
        seeds = [int(s) for s in rng.integers(1_000_000, 2_000_000, goals)]
        ways = [[rng.standard_normal(w.shape) for w in weights[-2:]] for _ in range(pairs)]
        tried = [
            [*weights[:-2], *(w + sign * size * d for w, d in zip(weights[-2:], way, strict=True))] for way in ways for sign in (1, -1)
        ]
        lost = np.array([found[0] for found in episodes.play([(one, seed) for one in tried for seed in seeds])])
        lost = lost.reshape(pairs, 2, goals).mean(axis=2)
        slope = (lost[:, 0] - lost[:, 1]) / (lost.std() + 1e-9)
        for at in (-2, -1):
            weights[at] = weights[at] - step / pairs * sum(s * way[at] for s, way in zip(slope, ways, strict=True))
        print(f"  generation {generation + 1:3d}: {lost.mean():.4f}", flush=True)
    return weights


def save(weights: Weights, file: Path, seed: int, made: str) -> None:
    """Writes the network as ONNX, with the meaning of its numbers as metadata."""
    nodes, constants, x = [], [], "obs"
    for layer in range(len(LAYERS) - 1):
        out = "actions" if layer == len(LAYERS) - 2 else f"h{layer}"
        constants += [numpy_helper.from_array(weights[2 * layer + k].astype(np.float32), f"{'wb'[k]}{layer}") for k in (0, 1)]
        nodes.append(helper.make_node("Gemm", [x, f"w{layer}", f"b{layer}"], [out], name=f"layer{layer}"))
        x = out
        if out != "actions":
            nodes.append(helper.make_node("Tanh", [out], [f"a{layer}"], name=f"tanh{layer}"))
            x = f"a{layer}"
    ends = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, n]) for name, n in (("obs", LAYERS[0]), ("actions", LAYERS[-1]))]
    model = helper.make_model(
        helper.make_graph(nodes, "reach", ends[:1], ends[1:], constants), opset_imports=[helper.make_opsetid("", 17)], ir_version=10
    )
    period = str(float(EVERY.removesuffix(" ms")) / 1e3)
    helper.set_model_props(model, {"joint_names": ",".join(JOINTS), "period": period, "seed": str(seed), "made": made})
    onnx.checker.check_model(model)
    file.parent.mkdir(parents=True, exist_ok=True)
    onnx.save(model, file)


def told(ends: Sequence[tuple[float, float]]) -> str:
    """Returns how many goals were reached, and the median distance, as text."""
    far = np.array([end for _, end in ends])
    return f"{(far < TOLERANCE).sum()} of {len(far)} unseen goals, median {np.median(far) * 1e3:.1f} mm"


def main() -> None:
    """Trains the network, prints its quality, and saves it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--steps", type=int, default=2000, help="steps of imitation")
    parser.add_argument("--generations", type=int, default=6, help="of the evolution strategy; 0: imitation alone")
    parser.add_argument("--goals", type=int, default=100, help="unseen goals that are tried at the end")
    parser.add_argument("--output", type=Path, default=NETWORK)
    options = parser.parse_args()
    begun = time.monotonic()
    rng = np.random.default_rng(options.seed)
    with gpac.System("teacher", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        teacher = Teacher(gpac.robots.load("ur5e", on=rtp.timer("fast", period="1 ms", priority=80)).kinematics)
    weights = imitated(teacher, rng, options.steps)
    print(f"imitated in {time.monotonic() - begun:.0f} s", flush=True)
    made = f"examples/reach_training.py --seed {options.seed} --steps {options.steps} --generations {options.generations}"
    if options.generations == 0:
        save(weights, options.output, options.seed, made)
        return
    episodes = Episodes()
    print(f"after imitation: {told(episodes.play([(weights, seed) for seed in range(min(20, options.goals))]))}", flush=True)
    weights = bettered(weights, episodes, rng, options.generations)
    after = told(episodes.play([(weights, seed) for seed in range(options.goals)]))
    episodes.close()
    print(f"after evolution: {after}; {time.monotonic() - begun:.0f} s in all", flush=True)
    save(weights, options.output, options.seed, f"{made}: {after}")


if __name__ == "__main__":
    main()
