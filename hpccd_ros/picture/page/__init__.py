# SPDX-License-Identifier: Apache-2.0
"""A recording as one HTML file that opens without a network: meshes and contacts to turn, a timeline, a chart.

`recording_page.py` collects the steps, `positions.py` and `contact_columns.py` what is drawn of them, `packing.py`
makes bytes of it, `document.py` the file, around the viewer in `assets` and the WebGL library of `library.py`.
"""
