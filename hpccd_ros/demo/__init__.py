# SPDX-License-Identifier: Apache-2.0
"""`hpccd demo`: node, publisher and recorder as processes over DDS."""
