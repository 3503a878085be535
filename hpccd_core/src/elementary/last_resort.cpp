// SPDX-License-Identifier: Apache-2.0
#include "elementary/last_resort.h"

#include "elementary/exact/contact.h"
#include "elementary/tolerant.h"

namespace hpccd {

std::optional<double> last_resort(Accuracy accuracy, Kind kind, const Vec3<double> q_t0[4],
                                  const Vec3<double> q_t1[4]) {
  if (accuracy == Accuracy::conservative || accuracy == Accuracy::exact)
    return exact::earliest_contact(kind, q_t0, q_t1);
  const tolerant::Answer a =
      kind == Kind::vertex_face
          ? tolerant::decide<Kind::vertex_face>(motion_of<Kind::vertex_face>(q_t0, q_t1))
          : tolerant::decide<Kind::edge_edge>(motion_of<Kind::edge_edge>(q_t0, q_t1));
  if (!a.contact) return std::nullopt;
  return a.toc;
}

}  // namespace hpccd
