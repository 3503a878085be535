// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/earliest.h"

#include "elementary/exact/wide/isolate.h"
#include "elementary/exact/wide/sign_at_root.h"

namespace hpccd::exact {
namespace {

struct Event {
  std::int64_t time;
  wide::Root root;
  bool repeats = false;  // an earlier event has the same root
};

void add_events(std::vector<Event>& events, wide::Coefficients p) {
  for (wide::Root& root : wide::roots(p)) {
    const std::int64_t time = root.time();
    events.push_back({time, std::move(root)});
  }
}

// Whether the features touch at event i. The slowest queries are those whose polynomials share roots.
bool touches_at(const Query<Big>& q, std::vector<Event>& events, std::size_t i) {
  std::vector<std::size_t> may_repeat;
  const auto sign_of = [&](const auto& polynomial) {
    const auto p = wide::coefficients(polynomial);
    const int s = wide::sign_at(p, events[i].root);
    if (s == 0)
      for (std::size_t j = i + 1; j < events.size() && events[j].time == events[i].time; ++j)
        if (std::ranges::equal(p, events[j].root.of())) may_repeat.push_back(j);
    return s;
  };
  if (touches(q, sign_of)) return true;
  for (const std::size_t j : may_repeat)
    if (events[j].root.surely_holds(events[i].root)) events[j].repeats = true;
  return false;
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
  // Events in the wrong order have the same rounded time.
  std::stable_sort(events.begin(), events.end(), [](const Event& x, const Event& y) { return x.time < y.time; });
  for (std::size_t i = 0; i < events.size(); ++i)
    if (!events[i].repeats && touches_at(q, events, i)) return {true, rounded_down(events[i].time)};
  return {true, {}};
}

}  // namespace hpccd::exact
