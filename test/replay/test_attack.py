# SPDX-License-Identifier: Apache-2.0
"""Thousands of damaged and hostile recordings: no traceback, no hang, bounded memory, never a wrong "verified".

HPCCD_ATTACK=2000 runs 2,000 of each family instead of a few; `python attack.py` beside this file tells the counts.
"""

import os

import attack
import hostile
import pytest

from hpccd_ros.replay import many_recordings

MANY = int(os.environ.get("HPCCD_ATTACK", "0"))
N_CRAFTED = len(hostile.KINDS)


@pytest.mark.timeout(0 if MANY else 600)
@pytest.mark.parametrize(
    ("family", "number", "seed", "every"),
    [
        ("random", 40, 1, 1),
        pytest.param("random", 130, 1, 1, marks=pytest.mark.long),
        ("crafted", N_CRAFTED, 1, 3),
        *(pytest.param("crafted", N_CRAFTED, seed, 1, marks=pytest.mark.long) for seed in (1, 1 + N_CRAFTED)),
    ],
)
def test_whatever_a_recording_holds_it_ends_with_a_status_and_a_sentence(family, number, seed, every, sound_bags):
    number = MANY or number
    names = attack.cases(*((number, 0) if family == "random" else (0, number)), seed=seed)[:: 1 if MANY else every]
    seen = []
    bad = attack.attack(names, sound_bags, seen.append)
    assert not bad, "\n".join(f"{result['name']}: {problem}" for result in bad for problem in result["problems"])
    assert len(seen) == len(names)
    # Both must be reached, or nothing was tried.
    verified = [result["name"] for result in seen if result["outcomes"]["replay"] == "VERIFIED"]
    rejected = [result["name"] for result in seen if result["outcomes"]["replay"] == 2]
    assert len(rejected) > len(names) / 4 and (verified or family == "random")


def test_a_sample_as_processes(sound_bags, tmp_path, hpccd):
    """As a user meets them: the status that the shell sees, and nothing on the terminal but sentences."""
    for name in ("random/truncate/1", "crafted/setup_is_no_json/1", "crafted/roles_swapped/3", "crafted/bomb/1"):
        path = tmp_path / (name.replace("/", "-") + ".mcap")
        path.write_bytes(attack.make_case(name, sound_bags))
        for command in ("doctor", "replay", "view"):
            done = hpccd(command, path)
            assert done.returncode in (0, 1, 2) and "Traceback" not in done.stderr, done
            assert done.returncode != 2 or done.stderr.startswith(f"hpccd {command}: "), done


def test_one_of_many_recordings_is_unusable_not_failed(sound_bags, tmp_path):
    for number, name in enumerate(attack.cases(0, 60, seed=7)):
        path = tmp_path / f"{number}.mcap"
        path.write_bytes(attack.make_case(name, sound_bags))
        row = many_recordings.replay_one(str(path), backend="cpu")
        assert row["result"] in ("VERIFIED", "DIVERGED", "NOT VERIFIED", "COMPUTED", "NOTHING", "UNUSABLE"), name
