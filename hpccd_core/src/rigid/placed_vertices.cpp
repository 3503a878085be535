// SPDX-License-Identifier: Apache-2.0
#include "rigid/placed_vertices.h"

#include <algorithm>

#include "base/standard_arithmetic.h"
#include "hpccd/errors.h"

namespace hpccd::rigid {

void place_vertices(std::span<const Pose> poses, std::span<const LinkMesh> meshes, std::span<const Vector> vertices,
                    std::span<Vector> placed) {
  const StandardArithmetic arithmetic;
  std::size_t begin = 0;
  for (const LinkMesh& mesh : meshes) {
    if (mesh.link >= poses.size()) throw InvalidArgument("meshes: one is of a link that has no pose");
    if (mesh.end < begin || mesh.end > vertices.size()) throw InvalidArgument("meshes: their ends are out of order");
    begin = mesh.end;
  }
  if (begin != vertices.size() || placed.size() != vertices.size())
    throw InvalidArgument("vertices: expected as many as all meshes have");
  begin = 0;
  for (const LinkMesh& mesh : meshes) {
    const auto from = vertices.subspan(begin, mesh.end - begin);
    std::ranges::transform(from, placed.begin() + static_cast<std::ptrdiff_t>(begin), Placing(poses[mesh.link]));
    begin = mesh.end;
  }
}

}  // namespace hpccd::rigid
