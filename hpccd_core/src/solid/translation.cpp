// SPDX-License-Identifier: Apache-2.0
#include "solid/translation.h"

namespace hpccd {

double separating_translation(const MovedPair& pair, const Vec3<double>& direction) {
  const Translation translation(pair, direction);
  ContactTime time;
  for (;;) {
    // From one interval to the one of those at its end that lasts longest. Features take over from their neighbours at
    // exactly the same time.
    while (const auto end = translation.latest_end(&time)) {
      if (translation.compare(*end, time) <= 0) break;
      time = *end;
    }
    if (!translation.contained_after(time)) return translation.length(time);
    const auto next = translation.earliest_begin(time);
    if (!next) return translation.length(time);
    time = *next;
  }
}

}  // namespace hpccd
