// SPDX-License-Identifier: Apache-2.0
#include "solid/translation.h"

namespace hpccd {

ContactTime first_separation(const Translation& translation) {
  ContactTime time;
  for (;;) {
    // From one interval to the one of those at its end that lasts longest. Features take over from their neighbours at
    // exactly the same time.
    while (const auto end = translation.latest_end(&time)) {
      if (translation.compare(*end, time) <= 0) break;
      time = *end;
    }
    if (!translation.contained_after(time)) return time;
    const auto next = translation.earliest_begin(time);
    if (!next) return time;
    time = *next;
  }
}

double separating_translation(const MovedPair& pair, const Vec3<double>& direction) {
  const Translation translation(pair, direction);
  return translation.length(first_separation(translation));
}

}  // namespace hpccd
