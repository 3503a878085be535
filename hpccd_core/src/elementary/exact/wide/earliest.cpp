// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/earliest.h"

#include "elementary/exact/wide/isolate.h"
#include "elementary/exact/wide/sign_at_root.h"

namespace hpccd::exact {
namespace {

struct Event {
  std::int64_t time;
  wide::Root root;
};

void add_events(std::vector<Event>& events, wide::Coefficients p) {
  for (wide::Root& root : wide::roots(p)) {
    const std::int64_t time = root.time();
    events.push_back({time, std::move(root)});
  }
}

}  // namespace

Answer earliest(const Query<Big>& q) {
  if (certainly_no_root(q.f)) return {true, {}};
  if (touches_at_start(q)) return {true, 0.0};
  const int degree = q.f.degree();
  if (degree == 0) return {true, {}};
  std::vector<Event> events;
  if (degree > 0)
    add_events(events, wide::coefficients(q.f));
  else
    for_event_polynomials(q, [&](const auto& p) {
      if (p.degree() > 0) add_events(events, wide::coefficients(p));
    });
  // Events in the wrong order have the same time.
  std::stable_sort(events.begin(), events.end(), [](const Event& x, const Event& y) { return x.time < y.time; });
  for (auto& [time, root] : events)
    if (touches(q, [&](const auto& p) { return wide::sign_at(wide::coefficients(p), root); }))
      return {true, rounded_down(time)};
  return {true, {}};
}

}  // namespace hpccd::exact
