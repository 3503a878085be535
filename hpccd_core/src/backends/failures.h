// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace hpccd {

// Counts the steps in which a backend's devices have failed.
class Failures {
 public:
  void succeeded() { in_a_row_ = 0; }
  void failed(const std::string& why) {
    ++count_;
    ++in_a_row_;
    last_ = why;
  }

  std::uint64_t count() const { return count_; }
  const std::string& last() const { return last_; }
  // One failure may be temporary, as when another process held the memory. After three failures in a row the device is
  // no longer used: each attempt costs its time in addition to the CPU's.
  bool gave_up() const { return in_a_row_ >= 3; }

 private:
  std::uint64_t count_ = 0;
  int in_a_row_ = 0;
  std::string last_;
};

}  // namespace hpccd
