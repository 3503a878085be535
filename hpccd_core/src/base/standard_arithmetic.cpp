// SPDX-License-Identifier: Apache-2.0
#include "base/standard_arithmetic.h"

namespace hpccd {

// Out of line, with memory clobbers: compilers do not move arithmetic across these calls.
#if defined(__x86_64__)

namespace {

std::uint32_t mode() {
  std::uint32_t m;
  __asm__ volatile("stmxcsr %0" : "=m"(m) : : "memory");
  return m;
}
void set_mode(std::uint32_t m) { __asm__ volatile("ldmxcsr %0" : : "m"(m) : "memory"); }

constexpr std::uint32_t status_flags = 0x3f, standard = 0x1f80;  // all traps masked

}  // namespace

// The register is only written if needed, because writing costs more than reading.
StandardArithmetic::StandardArithmetic() : before_(mode()) {
  if ((before_ & ~status_flags) != standard) set_mode(standard);
}
StandardArithmetic::~StandardArithmetic() {
  if ((before_ & ~status_flags) != standard) set_mode(before_);
}

#elif defined(__aarch64__)

namespace {

std::uint64_t mode() {
  std::uint64_t m;
  __asm__ volatile("mrs %0, fpcr" : "=r"(m) : : "memory");
  return m;
}
void set_mode(std::uint64_t m) { __asm__ volatile("msr fpcr, %0" : : "r"(m) : "memory"); }

}  // namespace

StandardArithmetic::StandardArithmetic() : before_(mode()) {
  if (before_) set_mode(0);
}
StandardArithmetic::~StandardArithmetic() {
  if (before_) set_mode(before_);
}

#else

StandardArithmetic::StandardArithmetic() {
  std::fegetenv(&before_);
  std::fesetenv(FE_DFL_ENV);
}
StandardArithmetic::~StandardArithmetic() { std::fesetenv(&before_); }

#endif

}  // namespace hpccd
