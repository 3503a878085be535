# SPDX-License-Identifier: Apache-2.0
"""A detection that another thread may end, whether its detector exists already or not."""

import threading

import hpccd_core as hc


class Cancellation:
    """`guard` each detector before it works; `cancel` makes the last one, and all later ones, raise hc.Cancelled."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._detector: hc.Detector | None = None
        self._cancelled = False

    def guard(self, detector: hc.Detector) -> hc.Detector:
        """`detector`, from now on the one that `cancel` ends."""
        with self._lock:
            self._detector = detector
            if self._cancelled:
                detector.cancel()
        return detector

    def cancel(self) -> None:
        """From any thread; for good."""
        with self._lock:
            self._cancelled = True
            if self._detector is not None:
                self._detector.cancel()

    def release(self) -> bool:
        """Whether the guarded detector may go on to other work: `cancel` came too late for it, and no longer ends it.

        False: it is ended.
        """
        with self._lock:
            if not self._cancelled:
                self._detector = None
            return not self._cancelled
