// SPDX-License-Identifier: Apache-2.0
// Floating-point modes that other libraries may set in this thread.
#pragma once

#include <cfenv>
#include <cstdint>
#include <limits>

namespace hpccd::test {

// During its lifetime denormal numbers count as zero, or results are rounded in the given direction.
class OtherArithmetic {
 public:
  static constexpr int flush_to_zero = -1;

  explicit OtherArithmetic(int mode) {
    std::fegetenv(&before_);
    if (mode != flush_to_zero) std::fesetround(mode);
    if (mode == flush_to_zero) flush();
  }
  ~OtherArithmetic() { std::fesetenv(&before_); }
  OtherArithmetic(const OtherArithmetic&) = delete;
  OtherArithmetic& operator=(const OtherArithmetic&) = delete;

 private:
  static void flush() {
#if defined(__x86_64__)
    std::uint32_t mode;
    __asm__ volatile("stmxcsr %0" : "=m"(mode));
    mode |= 0x8040;
    __asm__ volatile("ldmxcsr %0" : : "m"(mode));
#elif defined(__aarch64__)
    std::uint64_t mode;
    __asm__ volatile("mrs %0, fpcr" : "=r"(mode));
    __asm__ volatile("msr fpcr, %0" : : "r"(mode | std::uint64_t{1} << 24));
#endif
  }
  std::fenv_t before_;
};

inline constexpr int other_modes[] = {
#if defined(__x86_64__) || defined(__aarch64__)
    OtherArithmetic::flush_to_zero,
#endif
    FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};

// Results of this thread that differ between the modes.
struct SeenArithmetic {
  bool keeps_denormals, rounds_up, rounds_down, cuts;
  bool operator==(const SeenArithmetic&) const = default;
};
inline SeenArithmetic seen_arithmetic() {
  volatile double least = std::numeric_limits<double>::min(), half = least / 2;
  volatile double one = 1, little = 0x1p-70, above = one + little, below = -one - little, cut = one - little;
  return {half > 0, above > 1, below < -1, cut < 1};
}
inline constexpr SeenArithmetic standard_arithmetic{true, false, false, false};

}  // namespace hpccd::test
