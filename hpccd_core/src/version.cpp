// SPDX-License-Identifier: Apache-2.0
#include "hpccd/version.h"

const char* hpccd::version() { return HPCCD_VERSION; }
