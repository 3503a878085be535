// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Each loop keeps so many independent results
// that the latency of an operation does not limit it, and few enough for sixteen registers.

#include <cstdint>

#include "base/machine_rate_kernels.h"

namespace hpccd::HPCCD_ISA {
namespace {

// Boxes' own comparisons (MotionBox::overlaps) of rows in the first cache, with another box each time.
double compare(const float* data, std::size_t, std::uint64_t repeats) {
  constexpr int chains = 4;
  static_assert(compared_rows % (2 * chains) == 0);
  Mask16 apart[chains];
  for (std::uint64_t r = 0; r < repeats; ++r) {
    const Floats16 bound = all16(static_cast<float>(r % 1024));
    for (int i = 0; i < compared_rows; i += 2 * chains)
      for (int k = 0; k < chains; ++k) {
        const float* row = data + 16 * (i + 2 * k);
        apart[k] = apart[k] | (less(load16(row), bound) & less(bound, load16(row + 16)));
      }
  }
  double sum = 0;
  for (const Mask16& a : apart) sum += a.bits();
  return sum;
}

// R: one number or several in lanes, of type Scalar.
template <class R, class Scalar>
double compute(std::uint64_t repeats) {
  R x[computed_chains];
  for (int i = 0; i < computed_chains; ++i) x[i] = R(0.5 + 0.01 * i);
  const R a(0.999), b(0.0015);
  for (std::uint64_t r = 0; r < repeats; ++r)
    for (R& value : x) value = a * value + b;
  double sum = 0;
  for (const R& value : x) {
    Scalar first;
    __builtin_memcpy(&first, &value, sizeof first);
    sum += first;
  }
  return sum;
}

double floats(const float*, std::size_t, std::uint64_t repeats) { return compute<Single, float>(repeats); }
double doubles(const float*, std::size_t, std::uint64_t repeats) { return compute<Double, double>(repeats); }

double read(const float* data, std::size_t n, std::uint64_t repeats) {
  constexpr std::size_t chains = 4;
  Floats16 sum[chains];
  for (Floats16& s : sum) s = all16(0);
  for (std::uint64_t r = 0; r < repeats; ++r)
    for (std::size_t i = 0; i + 16 * chains <= n; i += 16 * chains)
      for (std::size_t k = 0; k < chains; ++k) sum[k] = sum[k] + load16(data + i + 16 * k);
  float first;
  const Floats16 all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
  __builtin_memcpy(&first, &all, sizeof first);
  return first;
}

}  // namespace

RateKernels rate_kernels() {
  return {compare,
          floats,
          doubles,
          read,
          2 * RealTraits<Single>::width * computed_chains,
          2 * RealTraits<Double>::width * computed_chains};
}

}  // namespace hpccd::HPCCD_ISA
