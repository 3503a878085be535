# SPDX-License-Identifier: Apache-2.0
"""Motion steps as one HTML file that opens without a network: meshes and contacts to turn, a timeline, a chart.

`packing.py` makes bytes of what is drawn, `document.py` the file, around the viewer in `assets` and a WebGL library.
"""
