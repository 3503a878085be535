# SPDX-License-Identifier: Apache-2.0
"""``python -m hpccd_ros.node --ros-args --params-file FILE``"""

import sys

from hpccd_ros.node import start

sys.exit(start.main())
