// SPDX-License-Identifier: Apache-2.0
#include "contacts/nearest_points.h"

namespace hpccd {

NearestPoints nearest_points(const UndecidedPair& pair, double time) {
  ByIntegers integers;
  return pair.kind == Kind::vertex_face ? nearest_points<Kind::vertex_face>(pair.t0, pair.t1, time, integers)
                                        : nearest_points<Kind::edge_edge>(pair.t0, pair.t1, time, integers);
}

}  // namespace hpccd
