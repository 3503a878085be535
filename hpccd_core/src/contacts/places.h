// SPDX-License-Identifier: Apache-2.0
// Points, normals and nearest points of contacts, as far as they are requested.
#pragma once

#include "contacts/outputs.h"
#include "elementary/batch.h"
#include "elementary/pair.h"
#include "elementary/undecided.h"

namespace hpccd {

PairPlaces pair_places(const UndecidedPair& pair, double toc, Outputs outputs);

// Writes to entry i of lists that are large enough.
void write_places(Contacts& contacts, std::size_t i, const UndecidedPair& pair, double toc, Outputs outputs);
void write_places(Contacts& contacts, std::size_t i, const Candidate& pair, double toc, const Geometry& geometry,
                  Outputs outputs);

}  // namespace hpccd
