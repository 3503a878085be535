// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/isolate.h"

#include "elementary/exact/wide/sign_at_root.h"

namespace hpccd::exact::wide {
namespace {

// A time that divides the step, and whether the polynomial vanishes there.
struct Mark {
  Root root;
  bool zero;
};

// Adds the roots of p to the marks, which must include 0, 1 and all extrema of p: between them p is monotonic.
std::vector<Mark> with_roots(Coefficients p, std::vector<Mark> marks) {
  std::vector<Mark> all;
  int before = 0;
  for (Mark& mark : marks) {
    const int s = sign_at(p, mark.root);
    if (before * s < 0) all.push_back({Root(p, all.back().root.high(), mark.root.low(), before), true});
    before = s;
    mark.zero = s == 0;
    all.push_back(std::move(mark));
  }
  return all;
}

}  // namespace

std::vector<Root> roots(Coefficients p) {
  std::vector<std::vector<Big>> derivatives;
  for (Coefficients d = p; d.size() > 2; d = derivatives.back()) derivatives.push_back(derivative(d));
  std::vector<Mark> marks = {{Root({0, 0}), false}, {Root({1, 0}), false}};
  for (std::size_t i = derivatives.size(); i-- > 0;) marks = with_roots(derivatives[i], std::move(marks));
  std::vector<Root> found;
  for (Mark& mark : with_roots(p, std::move(marks)))
    if (mark.zero) found.push_back(std::move(mark.root));
  return found;
}

}  // namespace hpccd::exact::wide
