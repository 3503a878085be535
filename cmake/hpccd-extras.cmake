# SPDX-License-Identifier: Apache-2.0
# find_package(hpccd) also provides hpccd::core, the core installed with this package.
find_package(hpccd_core CONFIG REQUIRED PATHS "${hpccd_DIR}/../../.." NO_DEFAULT_PATH)
