// SPDX-License-Identifier: Apache-2.0
#include "base/forks.h"

#include <pthread.h>

#include <atomic>

namespace hpccd {
namespace {

std::atomic<int> count{0};
[[maybe_unused]] const int counting = pthread_atfork(nullptr, nullptr, [] { ++count; });

}  // namespace

int forks() { return count.load(std::memory_order_relaxed); }

}  // namespace hpccd
