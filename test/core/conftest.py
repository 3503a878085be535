# SPDX-License-Identifier: Apache-2.0
import hypothesis

# No deadline: the machine may be busy. The examples are the same each time, so that a failure is not luck.
hypothesis.settings.register_profile("hpccd", deadline=None, derandomize=True)
hypothesis.settings.load_profile("hpccd")
