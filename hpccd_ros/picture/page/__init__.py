# SPDX-License-Identifier: Apache-2.0
"""A recording as one HTML file that opens without a network: meshes and contacts to turn, a timeline, a chart.

`recording_page.py` replays the steps, `packing.py` makes bytes of what is drawn of them, `document.py` the file, around
the viewer in `assets` and a WebGL library.
"""
