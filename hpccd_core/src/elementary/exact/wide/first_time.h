// SPDX-License-Identifier: Apache-2.0
// The first root of a polynomial at which other polynomials have the required signs.
#pragma once

#include <optional>

#include "elementary/exact/wide/part.h"

namespace hpccd::exact::wide {

struct Event {
  Coefficients vanishes;  // not constant
  Coefficients not_zero;  // and nowhere negative
  std::vector<Coefficients> at_least_zero;
};

class FirstTime {
 public:
  explicit FirstTime(const Event& event);

  // floor(t 2^62) for the first t in the window, its end included and its beginning excluded, if it is below `limit`;
  // there must be none before `from`.
  std::optional<std::int64_t> in(const Window& window, std::int64_t from, std::int64_t limit);

 private:
  struct Condition {
    Coefficients q;
    std::optional<Numbers> shared;  // with of_, once it has been computed
  };
  using Open = std::vector<std::size_t>;  // indices of conditions

  std::optional<std::int64_t> within(Part part, Open open);
  bool excluded(const Window& window, Open& open) const;
  bool holds_at(const Dyadic& t) const;
  std::optional<std::int64_t> at_root(Part part, const Open& open);
  int sign_at(Condition& condition, Part& part, std::optional<Dyadic>& exact);
  std::int64_t time_of(Part& part, std::optional<Dyadic>& exact) const;
  void remove_repeated_roots();

  Numbers of_;
  bool square_free_ = false;
  Numbers repeated_;  // the repeated roots of of_, each once
  Condition not_zero_;
  std::vector<Condition> at_least_zero_;
  std::int64_t from_ = 0, limit_ = 0;
};

}  // namespace hpccd::exact::wide
