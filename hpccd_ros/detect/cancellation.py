# SPDX-License-Identifier: Apache-2.0
"""A detection that another thread may end, whether its detector exists already or not."""

import threading

import hpccd_core as hc


class Cancellation:
    """`guard` each detector before it works; `cancel` makes the last ones, and all later ones, raise hc.Cancelled."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._detectors: tuple[hc.Detector, ...] = ()
        self._cancelled = False

    def guard(self, detector: hc.Detector, *others: hc.Detector) -> hc.Detector:
        """`detector`; from now on it and the others are what `cancel` ends."""
        with self._lock:
            self._detectors = (detector, *others)
            if self._cancelled:
                self._cancel_all()
        return detector

    def cancel(self) -> None:
        """From any thread; for good."""
        with self._lock:
            self._cancelled = True
            self._cancel_all()

    def _cancel_all(self) -> None:
        for detector in self._detectors:
            detector.cancel()

    def release(self) -> bool:
        """Whether the guarded detector may go on to other work: `cancel` came too late for it, and no longer ends it.

        False: it is ended.
        """
        with self._lock:
            if not self._cancelled:
                self._detectors = ()
            return not self._cancelled
