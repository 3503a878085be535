# SPDX-License-Identifier: Apache-2.0
"""Trials of the topic stop: random approaches, each followed by silence; and ends of publisher and node."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import stop_scene

from bench.ros.stop_link import Ears, Sender


@dataclass
class Approaches:
    """frames: of all trials; sent: when. silences: s from the last frame of each trial to the rise of stop. waited:
    frames sent again until stop was false, after a silence."""

    frames: list[stop_scene.Frame] = field(default_factory=list)
    sent: list[float] = field(default_factory=list)
    silences: list[float] = field(default_factory=list)
    waited: int = 0


def approaches(sender: Sender, ears: Ears, trials: int, rate: float, seed: int, done: Callable[[], None]) -> Approaches:
    """Frames at a fixed rate; after each trial none, until stop is true."""
    random, out, stamp = np.random.default_rng(seed), Approaches(), 0

    def send(frame: stop_scene.Frame) -> None:
        nonlocal stamp
        stamp += 1
        out.frames.append(frame)
        out.sent.append(sender.frame(frame, stamp))

    for _ in range(trials):
        frames = stop_scene.trial(random)
        send(frames[0])
        time.sleep(1 / rate)
        while ears.listener.stop:  # after the silence, and at the beginning
            send(frames[0])
            out.waited += 1
            time.sleep(1 / rate)
        begin = time.monotonic()
        for k, frame in enumerate(frames[1:]):
            while (left := begin + k / rate - time.monotonic()) > 0:
                time.sleep(left)
            send(frame)
        time.sleep(1 / rate)
        last = out.sent[-1]
        out.silences.append(ears.until(True) - last)
        done()
    return out


BEFORE_SILENCE = 0.9  # of the time-out


@dataclass
class Judged:
    """steps, near: of all; rises: s from the frame with which a step ends that comes near, after one that did not, to
    stop; late: those that took longer than a frame. missed: steps that come near without stop being true before the
    silence of what follows would make it so. false: of steps that do not, and follow one that did not, those with stop
    true a frame later."""

    steps: int
    near: int
    rises: list[float]
    late: int
    missed: int
    false: int


def judge(found: Approaches, ears: Ears, rate: float, timeout: float, done: Callable[[], None]) -> Judged:
    """By brute force on each step. The first frame ends none. timeout: stop_timeout, s."""
    truth = []
    for start, end in zip(found.frames, found.frames[1:], strict=False):
        truth.append(stop_scene.near(start, end))
        done()
    out = Judged(len(truth), sum(truth), [], 0, 0, 0)
    period, before = 1 / rate, True
    for near, sent, following in zip(truth, found.sent[1:], [*found.sent[2:], float("inf")], strict=True):
        risen = ears.rise(sent)
        if near and (risen is None or risen - sent > BEFORE_SILENCE * timeout):
            out.missed += 1
        elif near and not before:
            out.rises.append(risen - sent)
            out.late += risen - sent > period
        # A silence follows the last frame of a trial: what is said then is another matter.
        if not near and not before and ears.at(min(following, sent + period)):
            out.false += 1
        before = near
    return out


def ended(
    ears: Ears,
    process_of: Callable[[], object],
    number: signal.Signals,
    times: int,
    after: Callable[[], None],
    done: Callable[[], None],
) -> list[float]:
    """s from the signal to the process, while stop was false, to the rise of stop. after: brings it back."""
    random, taken = np.random.default_rng(times), []
    for _ in range(times):
        ears.until(False)
        time.sleep(random.uniform(0.05, 0.3))  # anywhere between two frames, and between two repetitions
        ears.until(False)
        began = time.monotonic()
        process_of().send_signal(number)
        taken.append(ears.until(True) - began)
        after()
        done()
    return taken
