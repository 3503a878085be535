// SPDX-License-Identifier: Apache-2.0
#include "base/machine_rate.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <vector>

#include "base/machine_rate_kernels.h"
#include "base/parallel.h"
#include "base/simd.h"
#include "base/simd/sets.h"

namespace hpccd {

// Of machine_rate.inl, compiled for each instruction set.
HPCCD_IN_EACH_SET(RateKernels rate_kernels();)

namespace {

using Seconds = std::chrono::duration<double>;

RateKernels kernels(Simd simd) { return HPCCD_OF_SET(simd, rate_kernels)(); }

// Of one thread, written by it: so its pages lie in the memory next to its core.
class Buffer {
 public:
  explicit Buffer(std::size_t bytes) : n_(std::max<std::size_t>(bytes / sizeof(float), 1)), data_(allocate(n_)) {
    std::fill_n(data_.get(), n_, 1.0f);
  }
  float* data() { return data_.get(); }
  std::size_t size() const { return n_; }

 private:
  struct Free {
    void operator()(float* p) const { ::operator delete[](p, std::align_val_t{64}); }
  };
  static float* allocate(std::size_t n) { return new (std::align_val_t{64}) float[n]; }
  std::size_t n_;
  std::unique_ptr<float[], Free> data_;
};

// Work of one thread: so often again, over its own data.
using Work = std::function<double(Buffer&, Buffer&, std::uint64_t)>;

// The least of several tries: others on the machine make it longer, never shorter.
double seconds(ThreadPool& pool, const Work& work, std::vector<std::unique_ptr<Buffer>> (&buffers)[2],
               std::uint64_t repeats, int tries) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < tries; ++i) {
    std::atomic<double> used{0};
    const auto begin = std::chrono::steady_clock::now();
    pool.run([&](int thread) { used = used + work(*buffers[0][thread], *buffers[1][thread], repeats); });
    least = std::min(least, Seconds(std::chrono::steady_clock::now() - begin).count());
  }
  return least;
}

}  // namespace

double machine_rate(Rate rate, Simd simd, int threads, std::size_t bytes) {
  const RateKernels k = kernels(resolve(simd));
  Work work;
  double in_one = 0;  // units of one repeat
  ThreadPool pool(threads);
  const bool arithmetic = rate != Rate::read && rate != Rate::copy;
  // A multiple of what the loop takes at a time.
  const std::size_t least = compared_rows * 16 * sizeof(float);
  const std::size_t own =
      arithmetic ? least : std::max(least, bytes / static_cast<std::size_t>(pool.size()) / 256 * 256);
  const auto by = [](RateKernel kernel) {
    return [kernel](Buffer& b, Buffer&, std::uint64_t repeats) { return kernel(b.data(), b.size(), repeats); };
  };
  switch (rate) {
    case Rate::comparisons:
      work = by(k.compare), in_one = compared_rows * 16;
      break;
    case Rate::floats:
      work = by(k.floats), in_one = k.float_operations;
      break;
    case Rate::doubles:
      work = by(k.doubles), in_one = k.double_operations;
      break;
    case Rate::read:
      work = by(k.read), in_one = static_cast<double>(own);
      break;
    case Rate::copy:
      in_one = static_cast<double>(own);
      work = [](Buffer& from, Buffer& to, std::uint64_t repeats) {
        for (std::uint64_t i = 0; i < repeats; ++i) {
          from.data()[i % from.size()] += 1;  // else one copy would do for all
          std::memcpy(to.data(), from.data(), from.size() * sizeof(float));
        }
        return static_cast<double>(to.data()[to.size() - 1]);
      };
  }
  std::vector<std::unique_ptr<Buffer>> buffers[2];
  for (auto& list : buffers) list.resize(static_cast<std::size_t>(pool.size()));
  pool.run([&](int thread) {
    buffers[0][thread] = std::make_unique<Buffer>(own);
    buffers[1][thread] = std::make_unique<Buffer>(rate == Rate::copy ? own : 1);
  });
  // So long that waking the threads (50 us) does not show.
  constexpr double long_enough = 4e-3;
  std::uint64_t repeats = 1;
  while (seconds(pool, work, buffers, repeats, 3) < long_enough) repeats *= 2;
  const double took = seconds(pool, work, buffers, repeats, 10);
  return static_cast<double>(pool.size()) * static_cast<double>(repeats) * in_one / took;
}

}  // namespace hpccd
