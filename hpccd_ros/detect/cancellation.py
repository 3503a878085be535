# SPDX-License-Identifier: Apache-2.0
"""A detection that another thread may end, whether its detector exists already or not."""

import threading

import hpccd_core as hc


class Ongoing:
    """`use` each detector before it works; `end` makes the one in use, and all later ones, raise hc.Cancelled."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._detector: hc.Detector | None = None
        self._ended = False

    @property
    def ended(self) -> bool:
        return self._ended

    def use(self, detector: hc.Detector) -> hc.Detector:
        """`detector`, from now on the one that `end` ends."""
        with self._lock:
            self._detector = detector
            if self._ended:
                detector.cancel()
        return detector

    def end(self) -> None:
        """From any thread; for good."""
        with self._lock:
            self._ended = True
            if self._detector is not None:
                self._detector.cancel()
