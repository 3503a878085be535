# SPDX-License-Identifier: Apache-2.0
# find_package(hpccd) offers the core too, as hpccd::core: the one that was installed beside this package.
find_package(hpccd_core CONFIG REQUIRED PATHS "${hpccd_DIR}/../../.." NO_DEFAULT_PATH)
