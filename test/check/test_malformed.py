# SPDX-License-Identifier: Apache-2.0
"""Each malformed input gives one sentence with the file, the problem and the remedy."""

import malformed
import pytest

from hpccd_core.sequences import SequenceError, open_sequence


@pytest.mark.parametrize("name", malformed.MALFORMED)
def test_a_malformed_input_gives_a_sentence(name, tmp_path):
    if name in malformed.PACKAGES:
        pytest.importorskip(malformed.PACKAGES[name], reason=f"{name} needs the extra check")
    paths, options = malformed.MALFORMED[name](tmp_path)
    with pytest.raises(SequenceError) as error:
        sequence = open_sequence(paths, **options)
        for k in range(len(sequence)):
            sequence.frame(k)
    text = str(error.value)
    assert malformed.PROBLEMS[name] in text
    named = [path.name for path in (tmp_path, *tmp_path.iterdir())]
    assert "\n" not in text and len(text) < 500 and (not paths or any(file in text for file in named))
    assert ";" in text or "(" in text  # a remedy


def test_there_are_at_least_fifty():
    assert len(malformed.MALFORMED) >= 50
