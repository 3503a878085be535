// SPDX-License-Identifier: Apache-2.0
// Points, normals and nearest points of a contact, as far as they were asked for.
#pragma once

#include "contacts/geometry.h"
#include "elementary/pair.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// When the features are looked at for points and directions.
enum class AtTime : bool { contact, start };

struct Outputs {
  bool points, normals, closest;
  AtTime at;
};

// Into entry i of lists that have room for it.
void write_places(Contacts& contacts, std::size_t i, const Candidate& pair, double toc, const Geometry& geometry,
                  Outputs outputs);

}  // namespace hpccd
