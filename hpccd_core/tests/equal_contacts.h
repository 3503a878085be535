// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "hpccd/hpccd.h"

namespace hpccd::test {

// Bit-identical, in the same order.
inline void expect_equal(const Contacts& a, const Contacts& b) {
  EXPECT_EQ(a.vf, b.vf);
  EXPECT_EQ(a.ee, b.ee);
  EXPECT_EQ(a.vf_toc, b.vf_toc);
  EXPECT_EQ(a.ee_toc, b.ee_toc);
  EXPECT_EQ(a.hash, b.hash);
}

}  // namespace hpccd::test
