# SPDX-License-Identifier: Apache-2.0
"""Coverage-guided fuzzing of everything that reads bytes: messages, recordings and files.

`make fuzz-bytes` runs targets under Atheris (`__main__.py`). `test_corpus.py` runs each target without it, on its
seeds, on the stored inputs and on seeded mutations of both.
"""
